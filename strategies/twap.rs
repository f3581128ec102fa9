//! `twap`: an order in equal parts over time.

use serde::Deserialize;

use crate::market::{Orders, Strategy, View};

use super::{Instant, Kind, ParentOrder, Schedule, StrategyError, read};

/// Works an order in equal parts, one every `interval` from `start` on, so that its price comes near the time-weighted
/// average. The first event in a slice brings its part, and what is missing of those before. What is missing at the end is
/// sent then, and again once an interval until all is filled.
///
/// D. Bertsimas and A. W. Lo, "Optimal control of execution costs", Journal of Financial Markets 1 (1998), find that nothing
/// costs less where prices are a random walk and impact is linear and stays.
#[derive(Debug, Clone)]
pub struct Twap {
    parent: ParentOrder,
    schedule: Schedule,
}

pub(super) const KIND: Kind = Kind {
    name: "twap",
    about: "works an order in equal parts, one every `interval` from `start` to `end`",
    example: include_str!("twap.toml"),
    parameters: &["symbol", "side", "quantity", "start", "end", "interval"],
    instruments: 1,
    build: |parameters| Ok(Box::new(Twap::new(&read(&KIND, parameters)?)?)),
};

/// Parameters of [`Twap`].
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// The instrument; where none is named the order is one of each of the run.
    pub symbol: Option<String>,
    /// "buy" or "sell".
    pub side: String,
    /// How much [units].
    pub quantity: f64,
    /// When the first part is sent.
    pub start: Instant,
    /// When all is to be done.
    pub end: Instant,
    /// Time from part to part [s].
    pub interval: f64,
}

impl Twap {
    /// A strategy with the given parameters.
    ///
    /// # Errors
    /// If the side is none, the quantity is not above 0, the end not after the start, or the interval cannot be.
    pub fn new(parameters: &Parameters) -> Result<Self, StrategyError> {
        let Parameters { symbol, side, quantity, start, end, interval } = parameters;
        let parent = ParentOrder::new(&KIND, symbol.as_deref(), side, *quantity, [start.0, end.0])?;
        Ok(Self { schedule: Schedule::new(&KIND, &parent, *interval)?, parent })
    }
}

impl Strategy for Twap {
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
        if !self.parent.concerns(view) {
            return;
        }
        if let Some(slice) = self.schedule.begun(view) {
            self.parent.send(view, orders, slice.share(), None);
        }
    }
}
