//! `buy_and_hold`: the yardstick of all others.

use serde::Deserialize;

use crate::market::{Orders, Quantity, Strategy, View};

use super::{Kind, StrategyError, check_weight, most_of_it, read};

/// Buys each instrument at its first price and holds it to the end.
///
/// Instruments share `weight` of the equity at that time evenly. What could not be filled is not asked for again.
#[derive(Debug, Clone)]
pub struct BuyAndHold {
    parameters: Parameters,
    bought: Vec<bool>,
}

pub(super) const KIND: Kind = Kind {
    name: "buy_and_hold",
    about: "buys each instrument at its first price and holds it to the end",
    example: include_str!("buy_and_hold.toml"),
    parameters: &["weight"],
    instruments: 1,
    build: |parameters| Ok(Box::new(BuyAndHold::new(read(&KIND, parameters)?)?)),
};

/// Parameters of [`BuyAndHold`].
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// Part of the equity to buy, shared evenly among the instruments of the run.
    #[serde(default = "most_of_it")]
    pub weight: f64,
}

impl BuyAndHold {
    /// A strategy with the given parameters.
    ///
    /// # Errors
    /// If the weight is not above 0.
    pub fn new(parameters: Parameters) -> Result<Self, StrategyError> {
        check_weight(&KIND, parameters.weight)?;
        Ok(Self { parameters, bought: Vec::new() })
    }
}

impl Strategy for BuyAndHold {
    fn name(&self) -> &str {
        KIND.name
    }
    fn copied(&self) -> Option<Box<dyn Strategy>> {
        Some(Box::new(self.clone()))
    }

    fn lookback(&self) -> usize {
        1
    }

    fn on_event(&mut self, view: &View<'_>, orders: &mut Orders) {
        let (instrument, count) = (view.event().instrument, view.instruments().len());
        self.bought.resize(count, false);
        if self.bought[instrument] || view.price(instrument).is_none() {
            return;
        }
        self.bought[instrument] = true;
        let share = self.parameters.weight / count as f64 * view.equity().to_f64();
        let size = view.lots_worth(instrument, share);
        if size > Quantity::ZERO {
            orders.to_position(view, instrument, size);
        }
    }
}
