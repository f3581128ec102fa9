//! When to be on which side of something that comes back.

use super::{Kind, StrategyError};

/// The scores at which a side is taken and left, in standard deviations.
///
/// The rule of E. Gatev, W. N. Goetzmann and K. G. Rouwenhorst, "Pairs trading: performance of a relative-value arbitrage
/// rule", Review of Financial Studies 19 (2006), which opens at two deviations and closes at none, with a stop beside.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Thresholds {
    entry: f64,
    exit: f64,
    stop: Option<f64>,
}

/// The side taken: long below, short above.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Reversion {
    side: i64,
    /// The side that was stopped out, until the score has been back.
    stopped: i64,
}

impl Thresholds {
    /// Sides are taken `entry` off, left `exit` off, and given up `stop` off.
    ///
    /// # Errors
    /// If not 0 <= exit < entry < stop.
    pub(super) fn new(kind: &Kind, entry: f64, exit: f64, stop: Option<f64>) -> Result<Self, StrategyError> {
        let value = |parameter, value: f64, hint| {
            Err(StrategyError::Value { kind: kind.name, parameter, value: value.to_string(), hint })
        };
        if !(entry.is_finite() && entry > 0.0) {
            return value("entry", entry, "it is a number of standard deviations above 0, as 2");
        }
        if !(0.0..entry).contains(&exit) {
            return value("exit", exit, "it is a number of standard deviations from 0 to below `entry`");
        }
        match stop {
            Some(stop) if !(stop.is_finite() && stop > entry) => {
                value("stop", stop, "it is a number of standard deviations above `entry`; leave it out for no stop")
            }
            _ => Ok(Self { entry, exit, stop }),
        }
    }
}

impl Reversion {
    /// The side to be on after a score: 1 for long, -1 for short, 0 for neither.
    ///
    /// Whoever was stopped out waits until the score has been back within `exit`; and beyond the stop nothing is begun.
    #[inline]
    pub fn after(&mut self, score: f64, thresholds: &Thresholds) -> i64 {
        let Thresholds { entry, exit, stop } = *thresholds;
        // How far off on a side's own way: below for a long one.
        let off = |side: i64| -(side as f64) * score;
        if off(self.stopped) <= exit {
            self.stopped = 0;
        }
        if self.side != 0 && off(self.side) <= exit {
            self.side = 0;
        } else if self.side != 0 && stop.is_some_and(|stop| off(self.side) >= stop) {
            (self.side, self.stopped) = (0, self.side);
        }
        if self.side == 0 {
            let open =
                |side: &i64| *side != self.stopped && off(*side) >= entry && stop.is_none_or(|stop| off(*side) < stop);
            self.side = [1, -1].into_iter().find(open).unwrap_or(0);
        }
        self.side
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sides(thresholds: &Thresholds, scores: &[f64]) -> Vec<i64> {
        let mut reversion = Reversion::default();
        scores.iter().map(|score| reversion.after(*score, thresholds)).collect()
    }

    fn thresholds(entry: f64, exit: f64, stop: Option<f64>) -> Result<Thresholds, StrategyError> {
        Thresholds::new(&super::super::mean_reversion::KIND, entry, exit, stop)
    }

    #[test]
    fn a_side_is_taken_far_off_and_left_near() {
        let of = thresholds(2.0, 0.5, None).unwrap();
        let scores = [0.0, -1.9, -2.0, -1.0, -0.6, -0.5, -1.0, 2.5, 0.6, -2.0, 2.0, 0.0];
        assert_eq!(sides(&of, &scores), [0, 0, 1, 1, 1, 0, 0, -1, -1, 1, -1, 0]);
    }

    #[test]
    fn who_was_stopped_out_waits_until_it_was_back() {
        let of = thresholds(2.0, 0.0, Some(3.0)).unwrap();
        let scores = [-2.0, -3.0, -2.5, -0.1, -2.5, 0.0, -2.0, -3.5, 2.0, 3.0, -2.5];
        assert_eq!(sides(&of, &scores), [1, 0, 0, 0, 0, 0, 1, 0, -1, 0, 1]);
        // Beyond the stop nothing is begun.
        assert_eq!(sides(&of, &[-4.0, 3.0, 2.9]), [0, 0, -1]);
    }

    #[test]
    fn thresholds_are_in_order() {
        for (entry, exit, stop, parameter) in [
            (0.0, 0.0, None, "entry"),
            (f64::NAN, 0.0, None, "entry"),
            (1.0, 1.0, None, "exit"),
            (1.0, -0.1, None, "exit"),
            (1.0, 0.0, Some(1.0), "stop"),
            (1.0, 0.0, Some(f64::INFINITY), "stop"),
        ] {
            let error = thresholds(entry, exit, stop).unwrap_err().to_string();
            assert!(error.starts_with(&format!("[strategy] mean_reversion: {parameter} is ")), "{error}");
        }
    }
}
