//! How uncertain what stands between decision and fill is, where nothing better is known, each with its source.

use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2};

use crate::io::DEFAULT_UNCERTAINTY;
use crate::sim2real::randomize::{Distribution, Preset, PresetRow, Redraw, Target};

/// Almgren, Thum, Hauptmann and Li, "Direct estimation of equity market impact", Risk 18 (2005): the permanent coefficient
/// is 0.314 with a standard error of 0.041, which is 13 % of it. What is cut off lies more than five standard errors away.
const ALMGREN: &str = "Almgren et al., Risk 18 (2005): 0.314 +- 0.041";
/// Tóth, Eisler and Bouchaud, "The square-root impact law also holds for option markets", arXiv:1602.03043 (2016): the
/// constant before the square root is of order one, and 0.5 to 1 for stocks and futures. A factor of 2 from end to end,
/// which lies about the nominal value here: what that is in units of volatility, a document does not say.
const TOTH: &str = "Toth, Eisler and Bouchaud, arXiv:1602.03043 (2016): a constant of 0.5 to 1 for stocks and futures";
/// What a value of a twin is known to where nobody says how uncertain it is.
const HOUSE: &str = "this project: what a value is known to where a twin does not say (uncertainty = 0.3), as of 2026";
/// Interactive Brokers, "Commissions: stocks, ETFs, warrants and structured products", United States, tiered
/// (interactivebrokers.co.uk, `commissions-stocks.php`, of the time of the SEC's fee of USD 27.80 a million): USD 0.0035 a
/// share up to 300,000 shares a month, 0.0020 up to 3 million, 0.0015 up to 20 million, 0.0010 up to 100 million, 0.0005
/// above. An order costs USD 0.35 at least and 1 % of its value at most; fees of exchanges, clearing and regulators come on
/// top.
const TIERS: &str = "Interactive Brokers (2024-25), commissions on US stocks, tiered: USD 0.0035 to 0.0005 a share";

/// The presets of markets. The rows of `execution` are factors of the nominal values: what a run does not model is not made
/// up.
#[must_use]
pub fn presets() -> Vec<Preset> {
    vec![execution(), us_tiers()]
}

fn execution() -> Preset {
    let factor = |id: &str, parameter: &str, distribution, source| PresetRow {
        target: Target::of(id, parameter),
        distribution,
        relative: true,
        at: Redraw::Reset,
        unit: "",
        source,
    };
    let unsaid = || Distribution::LogNormal { median: 1.0, sigma: DEFAULT_UNCERTAINTY };
    Preset {
        name: "execution",
        about: "Spread, impact and latency of orders",
        rows: vec![
            factor("half_spread", "bps", unsaid(), HOUSE),
            factor("half_spread", "fraction", unsaid(), HOUSE),
            factor("command_delay", "seconds", unsaid(), HOUSE),
            factor("linear_impact", "bps_at_full_participation", unsaid(), HOUSE),
            factor("volatility_slippage", "fraction", unsaid(), HOUSE),
            factor(
                "sqrt_impact",
                "bps_at_full_participation",
                Distribution::LogUniform { low: FRAC_1_SQRT_2, high: SQRT_2 },
                TOTH,
            ),
            factor(
                "permanent_impact",
                "bps_at_full_participation",
                Distribution::TruncatedNormal { mean: 1.0, std: 0.041 / 0.314, low: 0.3, high: 1.7 },
                ALMGREN,
            ),
        ],
    }
}

/// Which tier an account is in is known at the end of the month. All are alike: nobody says how many accounts are in each.
fn us_tiers() -> Preset {
    Preset {
        name: "us_tiers",
        about: "The commission of a broker of US stocks, by the tier that a month's volume ends in [USD]",
        rows: vec![PresetRow {
            target: Target::of("commission", "per_share"),
            distribution: Distribution::Choice { values: vec![0.0035, 0.002, 0.0015, 0.001, 0.0005], weights: Vec::new() },
            relative: false,
            at: Redraw::Reset,
            unit: "currency/unit",
            source: TIERS,
        }],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::market::MECHANISMS;

    #[test]
    fn every_row_is_of_the_registry_and_has_a_source() {
        for row in presets().iter().flat_map(|preset| &preset.rows) {
            row.distribution.check().unwrap();
            assert!(row.source.contains("20") && row.distribution.support()[0] > 0.0, "{}", row.target);
            let mechanism = MECHANISMS.iter().find(|m| Some(m.about().name) == row.target.mechanism.as_deref()).unwrap();
            let forms = mechanism.forms(&Default::default());
            let parameter = forms.iter().flat_map(|f| &f.parameters).find(|p| p.name == row.target.parameter);
            let parameter = parameter.unwrap_or_else(|| panic!("{} is no parameter", row.target));
            assert_eq!(row.unit, if row.relative { "" } else { parameter.unit.as_ref() }, "{}", row.target);
        }
    }

    #[test]
    fn what_a_run_does_not_model_is_not_made_up_of_factors() {
        assert!(execution().rows.iter().all(|row| row.relative));
    }
}
