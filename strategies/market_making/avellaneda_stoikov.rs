//! The quotes of Avellaneda and Stoikov.

use serde::Deserialize;

use crate::strategies::{Kind, StrategyError};

/// Where a market maker quotes who dislikes inventory: M. Avellaneda and S. Stoikov, "High-frequency trading in a limit
/// order book", Quantitative Finance 8 (2008), section 3.
///
/// The mid `s` is taken to move as `sigma` times a Brownian motion, and an order `d` away from it to be filled at a rate of
/// `A exp(-kappa d)`. With `q` units held and `T - t` left, one more unit is worth the **reservation price**
/// `r = s - q gamma sigma^2 (T - t)`, and the best quotes lie about it, `gamma sigma^2 (T - t) + (2 / gamma) ln(1 + gamma /
/// kappa)` apart: the paper's approximation to the first order in q.
///
/// The formula lets the inventory grow without bounds; here the side that would add to it is not quoted from
/// `max_inventory` on, as in O. Gueant, C.-A. Lehalle and J. Fernandez-Tapia, "Dealing with the inventory risk", Mathematics
/// and Financial Economics 7 (2013).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AvellanedaStoikov {
    parameters: Parameters,
}

/// Parameters of [`AvellanedaStoikov`].
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// Aversion to risk [1/(currency unit)]: how much a variance of cash counts against its mean.
    pub gamma: f64,
    /// Decay of the rate of fills with the distance from the mid [1/currency].
    pub kappa: f64,
    /// Standard deviation of the mid after a second [currency/s^0.5].
    pub sigma: f64,
    /// Largest inventory on either side [units].
    pub max_inventory: f64,
}

/// What is quoted on both sides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TwoSided {
    /// What one more unit is worth to the quoter [currency].
    pub reservation: f64,
    /// Best bid [currency]; none where no more may be bought.
    pub bid: Option<f64>,
    /// Best ask [currency]; none where no more may be sold.
    pub ask: Option<f64>,
}

impl AvellanedaStoikov {
    /// Quotes with the given parameters, for the strategy `kind`.
    ///
    /// # Errors
    /// If a parameter is not a number above 0.
    pub fn new(kind: &Kind, parameters: Parameters) -> Result<Self, StrategyError> {
        let Parameters { gamma, kappa, sigma, max_inventory } = parameters;
        for (parameter, value, hint) in [
            ("gamma", gamma, "an aversion to risk is above 0, as 0.1"),
            ("kappa", kappa, "a decay of fills with distance is above 0, as 1.5 per unit of currency"),
            ("sigma", sigma, "a standard deviation of the mid after a second is above 0"),
            ("max_inventory", max_inventory, "it is a number of units above 0"),
        ] {
            if !(value.is_finite() && value > 0.0) {
                return Err(StrategyError::Value { kind: kind.name, parameter, value: value.to_string(), hint });
            }
        }
        Ok(Self { parameters })
    }

    /// What one more unit is worth [currency], at a mid [currency], with `inventory` held [units] and `left` to go [s].
    #[must_use]
    pub fn reservation(&self, mid: f64, inventory: f64, left: f64) -> f64 {
        mid - inventory * self.risk(left)
    }

    /// How far apart the quotes lie [currency] with `left` to go [s].
    #[must_use]
    pub fn spread(&self, left: f64) -> f64 {
        let Parameters { gamma, kappa, .. } = self.parameters;
        self.risk(left) + 2.0 / gamma * (gamma / kappa).ln_1p()
    }

    /// What to quote at a mid [currency], with `inventory` held [units] and `left` to go [s]; time that is over is none.
    ///
    /// Quotes are neither on ticks nor held back from crossing the market: with a large inventory the better one may lie
    /// beyond the mid, which means to trade now.
    #[must_use]
    pub fn quotes(&self, mid: f64, inventory: f64, left: f64) -> TwoSided {
        let (reservation, half) = (self.reservation(mid, inventory, left), 0.5 * self.spread(left));
        let most = self.parameters.max_inventory;
        TwoSided {
            reservation,
            bid: (inventory < most).then_some(reservation - half),
            ask: (inventory > -most).then_some(reservation + half),
        }
    }

    /// What a unit of inventory takes from its worth: `gamma sigma^2 (T - t)` [currency].
    fn risk(&self, left: f64) -> f64 {
        self.parameters.gamma * self.parameters.sigma.powi(2) * left.max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const KIND: &Kind = &crate::strategies::buy_and_hold::KIND;

    /// The paper's own example, section 3.3: s = 100, T = 1, sigma = 2, k = 1.5.
    fn of(gamma: f64) -> AvellanedaStoikov {
        AvellanedaStoikov::new(KIND, Parameters { gamma, kappa: 1.5, sigma: 2.0, max_inventory: 10.0 }).unwrap()
    }

    #[test]
    fn quotes_are_those_computed_by_hand() {
        let quotes = of(0.1).quotes(100.0, 3.0, 0.5);
        // gamma sigma^2 (T - t) = 0.1 * 4 * 0.5 = 0.2; 20 ln(16/15) = 1.290770423.
        assert!((quotes.reservation - 99.4).abs() < 1e-12);
        assert!((of(0.1).spread(0.5) - 1.490_770_423).abs() < 1e-9);
        assert!((quotes.bid.unwrap() - (99.4 - 0.745_385_211_5)).abs() < 1e-9);
        assert!((quotes.ask.unwrap() - (99.4 + 0.745_385_211_5)).abs() < 1e-9);
        // Without time there is no risk left, and a small aversion quotes 2 / kappa.
        assert_eq!(of(0.1).reservation(100.0, 3.0, -1.0), 100.0);
        assert!((of(1e-9).spread(0.0) - 2.0 / 1.5).abs() < 1e-9);
    }

    #[test]
    fn the_side_that_adds_to_a_full_inventory_is_not_quoted() {
        let quoted = |inventory: f64| {
            let quotes = of(0.1).quotes(100.0, inventory, 1.0);
            (quotes.bid.is_some(), quotes.ask.is_some())
        };
        assert_eq!([-10.0, -9.0, 9.0, 10.0].map(quoted), [(true, false), (true, true), (true, true), (false, true)]);
    }

    #[test]
    fn parameters_are_above_zero() {
        let good = Parameters { gamma: 0.1, kappa: 1.5, sigma: 2.0, max_inventory: 10.0 };
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            for (parameter, parameters) in [
                ("gamma", Parameters { gamma: bad, ..good }),
                ("kappa", Parameters { kappa: bad, ..good }),
                ("sigma", Parameters { sigma: bad, ..good }),
                ("max_inventory", Parameters { max_inventory: bad, ..good }),
            ] {
                let error = AvellanedaStoikov::new(KIND, parameters).unwrap_err().to_string();
                assert!(error.contains(&format!("{parameter} is {bad}\nhint: ")), "{error}");
            }
        }
    }

    proptest! {
        #[test]
        fn inventory_moves_both_quotes_against_itself(q in -9.0..9.0_f64, more in 0.01..1.0_f64, left in 0.01..1.0_f64) {
            let (before, after) = (of(0.1).quotes(100.0, q, left), of(0.1).quotes(100.0, q + more, left));
            prop_assert!(after.bid.unwrap() < before.bid.unwrap() && after.ask.unwrap() < before.ask.unwrap());
            let width = after.ask.unwrap() - after.bid.unwrap();
            prop_assert!((width - of(0.1).spread(left)).abs() < 1e-9 && width > 0.0);
        }
    }
}
