//! Holding a portfolio: an action says which share of it each instrument is to be.

use crate::market::{Blotter, Cash, Orders, Price, Quantity, Side, View};
use crate::rl::{BoxSpace, Episode};

use super::reward::{Reward, Rewarded};
use super::task::{Outcome, Task, within};

/// Largest size of a share that is observed.
const LARGEST_SHARE: f64 = 10.0;

/// The task of `Trade-v0` and `Allocate-v0`: shares of the portfolio's value within [-1, 1] of each instrument, of which no more than
/// the whole is held; what is asked for beyond is scaled down.
#[derive(Debug, Clone, PartialEq)]
pub struct Portfolio {
    instruments: Vec<String>,
    /// What a step is paid.
    pub reward: Reward,
    /// What a share of 1 comes to, as a multiple of the value.
    pub leverage: f64,
    /// Change of an instrument's share below which nothing is traded.
    pub band: f64,
    rewarded: Rewarded,
}

impl Portfolio {
    /// A portfolio of instruments of these names, of which a share of 1 is the whole value.
    #[must_use]
    pub fn new(instruments: Vec<String>, reward: Reward) -> Self {
        Self { instruments, reward, leverage: 1.0, band: 0.0, rewarded: Rewarded::default() }
    }

    /// The lots an instrument is to come to at a share of the value.
    #[inline]
    fn target(view: &View<'_>, instrument: usize, worth: f64) -> Quantity {
        let lots = view.lots_worth(instrument, worth.abs());
        if worth < 0.0 { -lots } else { lots }
    }

    /// Asks for what takes an instrument to its target, if it is `reducing` what is held or is not, as asked.
    #[inline]
    fn trade(&self, view: &View<'_>, orders: &mut Orders, instrument: usize, target: Quantity, reducing: Option<bool>) {
        let coming = view.position(instrument) + view.working(instrument);
        let missing = target - coming;
        if missing == Quantity::ZERO {
            return;
        }
        if reducing.is_some_and(|reducing| reducing != (target.abs() < coming.abs())) {
            return;
        }
        if self.band > 0.0 && target != Quantity::ZERO {
            let (Some(one), equity) = (view.unit_value(instrument), view.equity().to_f64()) else { return };
            if missing.to_f64().abs() * one < self.band * equity {
                return;
            }
        }
        let side = if missing > Quantity::ZERO { Side::Buy } else { Side::Sell };
        orders.market(instrument, side, missing.abs());
    }
}

/// What all trades cost in fees by now, at the rates of now [currency of the run].
pub(super) fn fees(view: &View<'_>) -> f64 {
    (0..view.instruments().len()).map(|k| view.fees(k) * rate(view, k)).sum()
}

/// The currency of the run for one unit of an instrument's; 0 where nobody knows it yet.
#[inline]
fn rate(view: &View<'_>, instrument: usize) -> f64 {
    match view.terms(instrument).currency {
        0 => 1.0,
        other => view.balances().get(other).and_then(|balance| balance.rate).map_or(0.0, Price::to_f64),
    }
}

impl Task for Portfolio {
    fn begin(&mut self, _episode: Episode, view: &View<'_>) {
        self.rewarded = Rewarded::begin(view.equity().to_f64(), fees(view));
    }

    fn components(&self) -> Vec<(String, &'static str, f32, f32)> {
        let (share, own) = (LARGEST_SHARE as f32, self.instruments.len() > 1);
        let name = |what: &str, k: usize| if own { format!("{what}_{k}") } else { what.to_owned() };
        let mut all = vec![("cash".to_owned(), "share", -share, share), ("session_left".to_owned(), "", 0.0, 1.0)];
        for k in 0..self.instruments.len() {
            all.push((name("position", k), "share", -share, share));
            all.push((name("working", k), "share", -share, share));
            all.push((name("unrealized", k), "share", -1.0, 1.0));
        }
        all
    }

    fn actions(&self) -> BoxSpace {
        match self.instruments.len() {
            1 => BoxSpace::of(&[("target", "share", -1.0, 1.0)]),
            count => {
                let mut space = BoxSpace::of(&[]);
                for k in 0..count {
                    space = space.and(format!("target_{k}"), "share", -1.0, 1.0);
                }
                space
            }
        }
    }

    #[inline]
    fn act(&mut self, view: &View<'_>, orders: &mut Orders, action: &[f32], _last: bool) {
        let value = self.leverage * view.equity().to_f64();
        if let [share] = action {
            let target = Self::target(view, 0, f64::from(share.clamp(-1.0, 1.0)) * value);
            return self.trade(view, orders, 0, target, None);
        }
        let all: f64 = action.iter().map(|share| f64::from(share.abs())).sum();
        let scale = value / all.max(1.0);
        // What sets free goes before what it pays for.
        for reducing in [true, false] {
            for (k, share) in action.iter().enumerate() {
                let target = Self::target(view, k, f64::from(*share) * scale);
                self.trade(view, orders, k, target, Some(reducing));
            }
        }
    }

    #[inline]
    fn observe(&self, view: &View<'_>, into: &mut [f32]) {
        let value = view.equity().to_f64();
        let share = |worth: f64| if value > 0.0 { worth / value } else { 0.0 };
        let Some(([cash, session], rest)) = into.split_first_chunk_mut() else { return };
        *cash = within(share(view.cash().to_f64()), -LARGEST_SHARE, LARGEST_SHARE);
        *session = session_left(view, 0);
        for (k, own) in rest.as_chunks_mut::<3>().0.iter_mut().enumerate() {
            let (held, coming) = (view.position(k), view.working(k));
            if held == Quantity::ZERO && coming == Quantity::ZERO {
                *own = [0.0; 3];
                continue;
            }
            let one = view.unit_value(k).unwrap_or_default();
            *own = [
                within(share(held.to_f64() * one), -LARGEST_SHARE, LARGEST_SHARE),
                within(share(coming.to_f64() * one), -LARGEST_SHARE, LARGEST_SHARE),
                within(share(view.unrealized(k) * rate(view, k)), -1.0, 1.0),
            ];
        }
    }

    #[inline]
    fn settle(&mut self, view: &View<'_>, _blotter: &Blotter) -> Outcome {
        let fees = if self.reward.cost_penalty == 0.0 { 0.0 } else { fees(view) };
        let reward = self.rewarded.step(&self.reward, view.equity().to_f64(), fees);
        Outcome { reward, done: view.equity() <= Cash::ZERO }
    }

    fn tells(&self) -> Vec<(&'static str, &'static str)> {
        vec![("drawdown", "share")]
    }

    fn told(&self, _channel: usize) -> f64 {
        self.rewarded.drawdown()
    }
}

/// The part of the session of an instrument that is left: 1 where it has no calendar, 0 while its market is closed.
#[inline]
pub(super) fn session_left(view: &View<'_>, instrument: usize) -> f32 {
    if view.calendar(instrument).is_none() {
        return 1.0;
    }
    view.session(instrument).map_or(0.0, |hours| {
        let all = hours.close.seconds_since(hours.open);
        within(hours.close.seconds_since(view.now()) / all, 0.0, 1.0)
    })
}
