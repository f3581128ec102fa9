//! Where a resting order stands in the queue at its price, as far as the data let one know.

use std::fmt;

use serde::{Deserialize, Serialize};

/// How a queue is thought to move where the data say only how much is displayed at a price, and not whose it is.
///
/// Trades take from the front. What else leaves a level was cancelled, ahead of us or behind us: with `a` ahead and `b`
/// behind, a part `f(b) / (f(a) + f(b))` of it from behind. By-order data need no model: each order that leaves is known
/// to have stood ahead or behind.
///
/// Source: the family of Rigtorp, "Estimating order queue position" (2013), and of Moallemi & Yuan, "A model for queue
/// position valuation in a limit order book" (2017).
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", tag = "kind", deny_unknown_fields)]
pub enum QueueModel {
    /// Nothing that is cancelled was ahead, so that trades alone bring us forward: the latest fill of all.
    Trades,
    /// In proportion to what is there: `f(x) = x`.
    #[default]
    Proportional,
    /// `f(x) = ln(1 + x)`: nearer to one half than in proportion.
    Log,
    /// `f(x) = x^exponent`: the larger the exponent, the surer the longer part.
    Power {
        /// The exponent, above 0.
        exponent: f64,
    },
}

impl fmt::Display for QueueModel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Trades => f.write_str("trades alone bring an order forward"),
            Self::Proportional => f.write_str("cancellations ahead and behind in proportion to what is there"),
            Self::Log => f.write_str("cancellations ahead and behind by the logarithms of what is there"),
            Self::Power { exponent } => {
                write!(f, "cancellations ahead and behind by what is there to the power of {exponent}")
            }
        }
    }
}

impl QueueModel {
    /// Holds its parameters to what they can be: whether it can be used.
    #[must_use]
    pub fn is_possible(self) -> bool {
        match self {
            Self::Power { exponent } => exponent.is_finite() && exponent > 0.0,
            _ => true,
        }
    }

    /// The part of what was cancelled that stood behind, with `ahead` and `behind` [units].
    fn part_behind(self, ahead: f64, behind: f64) -> f64 {
        let of = |f: fn(f64, f64) -> f64, n: f64| {
            let (a, b) = (f(ahead, n), f(behind, n));
            if a + b > 0.0 { b / (a + b) } else { 1.0 }
        };
        match self {
            Self::Trades => 1.0,
            Self::Proportional => of(|x, _| x, 1.0),
            Self::Log => of(|x, _| x.ln_1p(), 1.0),
            Self::Power { exponent } => of(f64::powf, exponent),
        }
    }
}

/// The place of one resting order in the queue at its price.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(in crate::market) struct Place {
    /// What stands ahead of it of what is displayed [units].
    pub(super) ahead: f64,
    /// What stands behind that and still ahead of it, though it is not displayed [units]: trades reach it before the order.
    beyond: f64,
    /// What own orders want that stand ahead of it: trades of one instant reach them before it [units].
    own: f64,
    /// What stood ahead when it joined [units].
    pub(super) joined_behind: f64,
    /// How many events of single orders there had been when it joined: whoever joined by one of these stands ahead.
    pub(super) joined_after: u64,
    /// What was traded at the price since it was last said what is displayed there [units]; of single orders, what of it was ahead.
    traded: f64,
}

impl Place {
    /// At the end of a queue of `displayed` [units], and of `beyond` [units] that nobody sees.
    pub fn behind(displayed: f64, beyond: f64, joined_after: u64) -> Self {
        Self { ahead: displayed, beyond, own: 0.0, joined_behind: displayed + beyond, joined_after, traded: 0.0 }
    }

    /// `size` [units] are traded at its price: what of it reaches the order.
    pub fn traded(&mut self, size: f64) -> f64 {
        let reaches = self.past(size - self.ahead);
        self.ahead = (self.ahead - size).max(0.0);
        self.traded += size;
        reaches
    }

    /// The same where the data say themselves whose orders ahead are gone: until they do, what was traded stands in `traded` alone.
    pub fn reached(&mut self, size: f64) -> f64 {
        let ahead = (self.ahead - self.traded).max(0.0);
        self.traded += size.min(ahead);
        self.past(size - ahead)
    }

    /// What reaches the order of `size` [units] that have come past all that is displayed ahead of it.
    fn past(&mut self, size: f64) -> f64 {
        let past = size.max(0.0);
        let past_unseen = (past - self.beyond).max(0.0);
        let reaches = (past_unseen - self.own).max(0.0);
        self.beyond = (self.beyond - past).max(0.0);
        self.own = (self.own - past_unseen).max(0.0);
        reaches
    }

    /// Trades of a new instant come, to which `own` [units] of own orders stand ahead of it.
    pub fn begin_trades(&mut self, own: f64, by_order: bool) {
        self.own = own;
        if by_order {
            // What was traded before is said to be gone by now, or stands there still.
            self.traded = 0.0;
        }
    }

    /// What stands ahead of it, displayed or not [units].
    pub fn in_front(&self) -> f64 {
        self.ahead + self.beyond
    }

    /// Whether nobody knows what stands ahead.
    pub fn is_unknown(&self) -> bool {
        self.ahead.is_infinite()
    }

    /// Its price has come into view, where `displayed` [units] are: no more of them can be ahead; what stands `beyond` [units] is
    /// said where it was not known before.
    pub fn in_view(&mut self, displayed: f64, beyond: Option<f64>) {
        self.ahead = self.ahead.min(displayed.max(0.0));
        self.beyond = beyond.unwrap_or(self.beyond);
        self.traded = 0.0;
    }

    /// What is displayed at its price went from `before` to `after` [units].
    pub fn displayed(&mut self, model: QueueModel, before: f64, after: f64) {
        let untraded = before - std::mem::take(&mut self.traded);
        let cancelled = untraded - after;
        if cancelled > 0.0 && self.ahead > 0.0 {
            let behind = (untraded - self.ahead).max(0.0);
            let from_behind = (model.part_behind(self.ahead, behind) * cancelled).min(behind);
            self.ahead = (self.ahead - (cancelled - from_behind)).max(0.0);
        }
        // No more can be ahead than is there at all.
        self.ahead = self.ahead.min(after.max(0.0));
    }

    /// One unit of before is so many `units` now.
    pub fn split(&mut self, units: f64) {
        self.ahead *= units;
        self.beyond *= units;
        self.own *= units;
        self.joined_behind *= units;
        self.traded *= units;
    }

    /// An order of `size` [units] that is known to have stood ahead is gone.
    pub fn left_ahead(&mut self, size: f64) {
        self.ahead = (self.ahead - size).max(0.0);
        self.traded = (self.traded - size).max(0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn cancellations_are_shared_as_the_model_says() {
        // 60 ahead and 40 behind; 10 are cancelled.
        let after = |model: QueueModel| {
            let mut place = Place::behind(60.0, 0.0, 0);
            place.displayed(model, 100.0, 90.0);
            place.ahead
        };
        assert_eq!(after(QueueModel::Trades), 60.0);
        assert!((after(QueueModel::Proportional) - 54.0).abs() < 1e-12);
        let logs = (61.0_f64.ln(), 41.0_f64.ln());
        assert!((after(QueueModel::Log) - (60.0 - 10.0 * logs.0 / (logs.0 + logs.1))).abs() < 1e-12);
        // 3600 to 1600: 10 * 3600 / 5200 from ahead.
        assert!((after(QueueModel::Power { exponent: 2.0 }) - (60.0 - 10.0 * 3600.0 / 5200.0)).abs() < 1e-12);
    }

    #[test]
    fn what_was_traded_is_not_counted_again_as_cancelled() {
        let mut place = Place::behind(60.0, 0.0, 0);
        assert_eq!(place.traded(25.0), 0.0);
        assert_eq!(place.ahead, 35.0);
        place.displayed(QueueModel::Proportional, 100.0, 75.0);
        assert_eq!(place.ahead, 35.0);
        assert_eq!(place.traded(40.0), 5.0);
        assert_eq!(place.ahead, 0.0);
    }

    proptest! {
        /// Nobody has less than nothing ahead, nor more than is displayed; and the queue only moves forward.
        #[test]
        fn a_queue_only_moves_forward(
            start in 0.0..1e3_f64,
            beyond in prop_oneof![Just(0.0), 0.0..500.0_f64],
            steps in proptest::collection::vec((any::<bool>(), 0.0..300.0_f64), 0..60),
            model in prop_oneof![
                Just(QueueModel::Trades), Just(QueueModel::Proportional), Just(QueueModel::Log),
                (0.1..5.0_f64).prop_map(|exponent| QueueModel::Power { exponent })
            ],
        ) {
            let (mut place, mut shown) = (Place::behind(start, beyond, 0), start);
            for (trade, size) in steps {
                let (before, unseen) = (place.ahead, place.beyond);
                if trade {
                    let reached = place.traded(size);
                    prop_assert!((reached - (size - before - unseen).max(0.0)).abs() < 1e-9);
                    // What nobody sees is used up by what comes past all that is displayed.
                    prop_assert!((unseen - place.beyond - (size - before).clamp(0.0, unseen)).abs() < 1e-9);
                } else {
                    place.displayed(model, shown, size);
                    shown = size;
                    prop_assert!(place.ahead <= shown);
                }
                prop_assert!(place.ahead >= 0.0 && place.ahead <= before && place.ahead.is_finite());
                prop_assert!(place.beyond >= 0.0 && place.beyond <= unseen);
            }
        }
    }
}
