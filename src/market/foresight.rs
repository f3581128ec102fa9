//! What the mid does of itself after orders are decided: the alpha of whoever decides them.
//!
//! Whoever foresees a move trades ahead of it, and the move then looks as if the orders had made it. It is no physics that a
//! backtest leaves out, for the tape has it in any case; it has to be told from impact all the same. Alpha runs from the
//! decision, knows nothing of the quantity and comes little by little; impact comes with the fill, and grows with the quantity.

/// Times over which what is foreseen comes true [s].
pub(super) const HORIZONS: [f64; 4] = [1.0, 10.0, 100.0, 1_000.0];

/// Names of what each horizon brings in all, in the direction of the order [bps].
pub(super) const NAMES: [&str; 4] = ["alpha_1s", "alpha_10s", "alpha_100s", "alpha_1000s"];

/// What is still to come of what orders foresaw, and what the mid has done since it was looked at last.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Foresight {
    /// What an order foresees by horizon [bps].
    alphas: [f64; HORIZONS.len()],
    /// What is still to come of it [bps].
    coming: [f64; HORIZONS.len()],
    /// What has come since the last look [bps].
    come: f64,
    /// By how much own orders had moved the mid at the last look [bps].
    displaced: f64,
    /// When an order or a look was last [s].
    last: f64,
}

impl Foresight {
    /// Orders that foresee `alphas` [bps], one a horizon; those that are not given are 0.
    pub(super) fn of(alphas: impl Iterator<Item = f64>) -> Self {
        let mut own = Self::default();
        own.alphas.iter_mut().zip(alphas).for_each(|(own, alpha)| *own = alpha);
        own
    }

    /// Lets time pass until `time` [s].
    fn pass(&mut self, time: f64) {
        let seconds = (time - self.last).max(0.0);
        self.last = self.last.max(time);
        if self.coming == [0.0; HORIZONS.len()] {
            return;
        }
        for (coming, horizon) in self.coming.iter_mut().zip(HORIZONS) {
            let come = *coming * -(-seconds / horizon).exp_m1();
            *coming -= come;
            self.come += come;
        }
    }

    /// An order that buys (`sign` 1) or sells (-1) is decided at `time` [s].
    pub(super) fn decided(&mut self, time: f64, sign: f64) {
        // A run of the venue foresees nothing, and pays nothing for this.
        if self.alphas == [0.0; HORIZONS.len()] {
            return;
        }
        self.pass(time);
        self.coming.iter_mut().zip(self.alphas).for_each(|(coming, alpha)| *coming += sign * alpha);
    }

    /// What the mid has done since the last look [bps], at `time` [s], where own orders have moved it by `displaced` [bps].
    pub(super) fn look(&mut self, time: f64, displaced: f64) -> f64 {
        self.pass(time);
        let moved = self.come + displaced - self.displaced;
        (self.come, self.displaced) = (0.0, displaced);
        moved
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_foreseen_comes_little_by_little_and_goes_with_the_order() {
        let mut foresight = Foresight::of([0.0, 2.0].into_iter());
        foresight.decided(0.0, 1.0);
        assert!((foresight.look(10.0, 0.0) - 2.0 * (1.0 - (-1.0_f64).exp())).abs() < 1e-12);
        // A sale foresees the opposite: what is left of the first comes besides.
        foresight.decided(10.0, -1.0);
        let left = 2.0 * (-1.0_f64).exp();
        assert!((foresight.look(1e6, 0.0) - (left - 2.0)).abs() < 1e-12);
    }

    #[test]
    fn a_look_sees_what_orders_have_moved_since_the_last() {
        let mut foresight = Foresight::default();
        foresight.decided(1.0, 1.0);
        assert_eq!([foresight.look(1.0, 0.0), foresight.look(2.0, 3.0), foresight.look(3.0, 1.0)], [0.0, 3.0, -2.0]);
    }
}
