//! How much a price has moved of late: what those who quote look at when they decide how much to ask for.

use std::collections::VecDeque;

use crate::sim2real::Timestamp;

use super::{Seen, Tape};

/// How far back is looked [s], and in what steps [s].
pub(super) const WINDOW: f64 = 300.0;
const STEP: f64 = 10.0;
const STEPS: usize = (WINDOW / STEP) as usize;
/// Fewer steps than these make no volatility.
const FEWEST: usize = 6;

/// Root of the summed squared returns of the last five minutes, in steps of ten seconds (Andersen, Bollerslev, Diebold & Labys,
/// "Modeling and forecasting realized volatility", Econometrica 71 (2003)): the standard deviation of a return over five minutes.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Recent {
    /// End of the step under way [ns].
    end: i64,
    /// Price at its begin.
    begun_at: f64,
    /// Newest price.
    price: f64,
    /// Squared returns of the last steps, the newest last.
    squares: VecDeque<f64>,
    /// As of the last step that is over (a fraction).
    volatility: Option<f64>,
}

impl Recent {
    /// Sees a price.
    #[inline]
    pub fn see(&mut self, time: Timestamp, price: f64) {
        if time.0 >= self.end {
            self.turn(time);
        }
        self.price = price;
    }

    /// Ends the steps that are over at `time`.
    fn turn(&mut self, time: Timestamp) {
        const NANOS: i64 = STEP as i64 * Timestamp::NANOS;
        if self.begun_at > 0.0 {
            self.squares.push_back((self.price / self.begun_at - 1.0).powi(2));
            let silent = ((time.0 - self.end) / NANOS).clamp(0, STEPS as i64) as usize;
            self.squares.extend(std::iter::repeat_n(0.0, silent));
            while self.squares.len() > STEPS {
                self.squares.pop_front();
            }
            self.volatility = of(&self.squares.iter().copied().collect::<Vec<_>>());
        }
        if self.price > 0.0 {
            self.begun_at = self.price;
        }
        self.end = time.0.div_euclid(NANOS).saturating_add(1).saturating_mul(NANOS);
    }

    /// A split, which is no return, by so many new units for an old one.
    pub fn split(&mut self, units: f64) {
        self.price /= units;
        self.begun_at /= units;
    }

    /// The volatility, as of the last step that is over (a fraction); none before there are enough.
    pub fn volatility(&self) -> Option<f64> {
        self.volatility
    }
}

/// The same from the mids of `tape` before `time`.
pub(super) fn of_tape(tape: &Tape, time: Timestamp) -> Option<f64> {
    let mids: Vec<f64> = (0..=STEPS).filter_map(|k| tape.mid(Seen::at(time.plus_seconds(-STEP * k as f64)))).collect();
    of(&mids.windows(2).map(|pair| (pair[0] / pair[1] - 1.0).powi(2)).collect::<Vec<_>>())
}

fn of(squares: &[f64]) -> Option<f64> {
    let mean = squares.iter().sum::<f64>() / squares.len().max(1) as f64;
    (squares.len() >= FEWEST).then(|| (mean * STEPS as f64).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_price_that_moves_a_basis_point_each_step_moves_the_root_of_thirty_in_five_minutes() {
        let mut recent = Recent::default();
        for k in 0..400_i64 {
            // Ten looks a step, of which the last counts: it goes up and down in turns.
            let price = if (k / 10) % 2 == 0 { 100.0 } else { 100.01 };
            recent.see(Timestamp(k * Timestamp::NANOS), price);
            assert_eq!(recent.volatility().is_some(), k >= 70, "at {k} s");
        }
        assert!((recent.volatility().unwrap() - 1e-4 * 30.0_f64.sqrt()).abs() < 1e-7, "{recent:?}");
        // Silence is no movement: it is forgotten in five minutes.
        recent.see(Timestamp(1_000 * Timestamp::NANOS), 100.0);
        assert_eq!(recent.volatility(), Some(0.0));
    }
}
