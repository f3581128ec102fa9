//! `mean_reversion`: long far below the mean, short far above.

use serde::Deserialize;

use crate::market::indicator::{Indicator, Period, ZScore};
use crate::market::{EventKind, Orders, Quantity, Strategy, View};

use super::reversion::{Reversion, Thresholds};
use super::{Kind, StrategyError, check_period, check_weight, most_of_it, read, yes};

/// Buys an instrument when its close lies `entry` standard deviations below the mean of its last `window` closes, and is
/// short as far above; it leaves within `exit` of the mean, or at `stop`, after which it waits until the close has been
/// back. It trades when that changes, not to rebalance. While all closes of a window are equal nothing changes.
///
/// The rule as in E. P. Chan, Algorithmic Trading: Winning Strategies and Their Rationale, 2013, chapter 3, with
/// J. Bollinger's bands as thresholds. An instrument without bars is never traded.
#[derive(Debug, Clone)]
pub struct MeanReversion {
    parameters: Parameters,
    thresholds: Thresholds,
    fresh: ZScore,
    states: Vec<(ZScore, Reversion)>,
}

pub(super) const KIND: Kind = Kind {
    name: "mean_reversion",
    about: "long where the close is far below the mean of the last `window`, short where far above, until it is back",
    example: include_str!("mean_reversion.toml"),
    parameters: &["window", "entry", "exit", "stop", "short", "weight"],
    instruments: 1,
    build: |parameters| Ok(Box::new(MeanReversion::new(read(&KIND, parameters)?)?)),
};

/// Parameters of [`MeanReversion`].
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// Number of bars of mean and standard deviation, the newest counted.
    pub window: usize,
    /// How far off a side is taken [standard deviations].
    pub entry: f64,
    /// How far off it is left [standard deviations].
    #[serde(default)]
    pub exit: f64,
    /// How far off it is given up [standard deviations]; none for never.
    pub stop: Option<f64>,
    /// Whether to be short above the mean.
    #[serde(default = "yes")]
    pub short: bool,
    /// Part of the equity to hold, shared evenly among the instruments of the run.
    #[serde(default = "most_of_it")]
    pub weight: f64,
}

impl MeanReversion {
    /// A strategy with the given parameters.
    ///
    /// # Errors
    /// If not 3 <= window <= 1,000,000, or 0 <= exit < entry < stop; if `entry` is beyond what a window can show, the root
    /// of `window - 1`; or if the weight is not above 0.
    pub fn new(parameters: Parameters) -> Result<Self, StrategyError> {
        let Parameters { window, entry, exit, stop, weight, .. } = parameters;
        let period: Period = check_period(&KIND, "window", window, 3)?;
        let thresholds = Thresholds::new(&KIND, entry, exit, stop)?;
        if entry * entry >= (window - 1) as f64 {
            let hint = "the last of n closes is never more than the root of n - 1 deviations off: a longer `window`?";
            return Err(StrategyError::Value { kind: KIND.name, parameter: "entry", value: entry.to_string(), hint });
        }
        check_weight(&KIND, weight)?;
        Ok(Self { parameters, thresholds, fresh: ZScore::new(period), states: Vec::new() })
    }
}

impl Strategy for MeanReversion {
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
        let (event, count) = (view.event(), view.instruments().len());
        let Some(bar) = view.bars(event.instrument).last().filter(|_| event.kind == EventKind::Bar) else { return };
        if self.states.len() < count {
            self.states.resize(count, (self.fresh.clone(), Reversion::default()));
        }
        let (score, reversion) = &mut self.states[event.instrument];
        let Some(score) = score.update(bar.close.to_f64()) else { return };
        let side = reversion.after(score, &self.thresholds);
        let wanted = if self.parameters.short { side } else { side.max(0) };
        let coming = view.position(event.instrument) + view.working(event.instrument);
        if coming.0.signum() == wanted {
            return;
        }
        let share = self.parameters.weight / count as f64;
        let size = view.lots_worth(event.instrument, share * view.equity().to_f64());
        orders.to_position(view, event.instrument, Quantity(size.0 * wanted));
    }
}
