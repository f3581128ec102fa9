//! What there is to do in a market: how actions become orders, and what is rewarded.

use std::fmt;

use crate::market::{Blotter, Orders, View};
use crate::rl::{BoxSpace, Episode};

/// A component of an observation: name, unit, lower and upper bound.
pub(super) type Component = (String, &'static str, f32, f32);

/// How a task stands after a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// Reward of the step.
    pub reward: f64,
    /// Whether the task is done.
    pub done: bool,
}

/// Something to do in a market. It decides on what a strategy sees and asks for what a strategy may ask for, so that a policy does in
/// a backtest, to the last bit, what it does in an environment.
pub trait Task: Clone + fmt::Debug + Send + Sync + 'static {
    /// Begins an episode, at the first view of it that anybody decides on.
    fn begin(&mut self, episode: Episode, view: &View<'_>);

    /// Components of observations beside those of the market: name, unit, lower and upper bound.
    fn components(&self) -> Vec<(String, &'static str, f32, f32)>;

    /// What can be done.
    fn actions(&self) -> BoxSpace;

    /// Smallest and largest reward of a step.
    fn reward_range(&self) -> (f64, f64) {
        (f64::NEG_INFINITY, f64::INFINITY)
    }

    /// Sees any event, also those at which nobody decides.
    fn watch(&mut self, _view: &View<'_>, _orders: &mut Orders) {}

    /// Whether what is under way goes on without anybody deciding: no step is due meanwhile.
    fn goes_on_alone(&self) -> bool {
        false
    }

    /// Turns an action into orders. `last` says that no later one comes.
    fn act(&mut self, view: &View<'_>, orders: &mut Orders, action: &[f32], last: bool);

    /// Writes the [components](Self::components).
    fn observe(&self, view: &View<'_>, into: &mut [f32]);

    /// What came of the last action by now, with the fills and fees there were.
    fn settle(&mut self, view: &View<'_>, blotter: &Blotter) -> Outcome;

    /// What came of it where the data ended before the task was done.
    fn cut_off(&mut self, view: &View<'_>, blotter: &Blotter) -> Outcome {
        self.settle(view, blotter)
    }

    /// Names and units of what it tells beside that.
    fn tells(&self) -> Vec<(&'static str, &'static str)> {
        Vec::new()
    }

    /// The values of these.
    fn told(&self, _channel: usize) -> f64 {
        f64::NAN
    }
}

/// `value` within bounds; the lower one for what is no number.
pub(super) fn within(value: f64, low: f64, high: f64) -> f32 {
    if value.is_nan() { low as f32 } else { value.clamp(low, high) as f32 }
}
