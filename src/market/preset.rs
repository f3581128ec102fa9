//! How uncertain what stands between decision and fill is, where nothing better is known, each with its source.

use crate::io::DEFAULT_UNCERTAINTY;
use crate::sim2real::randomize::{Distribution, Preset, PresetRow, Redraw, Target};

/// Almgren, Thum, Hauptmann and Li, "Direct estimation of equity market impact", Risk 18 (2005): the permanent coefficient is
/// 0.314 with a standard error of 0.041.
const ALMGREN: &str = "Almgren et al., Risk 18 (2005): 0.314 +- 0.041";
/// Tóth et al., "Anomalous price impact and the critical nature of liquidity in financial markets", Physical Review X 1 (2011):
/// the constant before the square root is of order one, whatever the market.
const TOTH: &str = "Toth et al., Physical Review X 1 (2011): a constant of order one";
/// What a value of a twin is known to where nobody says how uncertain it is.
const HOUSE: &str = "this project: what a value is known to where a twin does not say (uncertainty = 0.3), as of 2026";

/// The presets of markets. All are factors of the nominal values: what a run does not model is not made up.
#[must_use]
pub fn presets() -> Vec<Preset> {
    let factor = |id: &str, parameter: &str, distribution, source| PresetRow {
        target: Target::of(id, parameter),
        distribution,
        relative: true,
        at: Redraw::Reset,
        unit: "",
        source,
    };
    let unsaid = || Distribution::LogNormal { median: 1.0, sigma: DEFAULT_UNCERTAINTY };
    vec![Preset {
        name: "execution",
        about: "Spread, impact and latency of orders",
        rows: vec![
            factor("half_spread", "bps", unsaid(), HOUSE),
            factor("half_spread", "fraction", unsaid(), HOUSE),
            factor("command_delay", "seconds", unsaid(), HOUSE),
            factor("linear_impact", "bps_at_full_participation", unsaid(), HOUSE),
            factor("volatility_slippage", "fraction", unsaid(), HOUSE),
            factor("sqrt_impact", "bps_at_full_participation", Distribution::LogUniform { low: 0.5, high: 2.0 }, TOTH),
            factor(
                "permanent_impact",
                "bps_at_full_participation",
                Distribution::TruncatedNormal { mean: 1.0, std: 0.13, low: 0.3, high: 1.7 },
                ALMGREN,
            ),
        ],
    }]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::market::MECHANISMS;

    #[test]
    fn every_row_is_of_the_registry_and_has_a_source() {
        for row in presets().iter().flat_map(|preset| &preset.rows) {
            row.distribution.check().unwrap();
            assert!(row.source.contains("20") && row.relative && row.distribution.support()[0] > 0.0, "{}", row.target);
            let mechanism = MECHANISMS.iter().find(|m| Some(m.about().name) == row.target.mechanism.as_deref()).unwrap();
            let forms = mechanism.forms(&Default::default());
            assert!(forms.iter().any(|f| f.parameters.iter().any(|p| p.name == row.target.parameter)), "{}", row.target);
        }
    }
}
