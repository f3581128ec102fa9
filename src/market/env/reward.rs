//! What is rewarded of an account's worth.

/// What a step is paid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Payoff {
    /// The relative change of the portfolio's value.
    Profit,
    /// The logarithm of the value over that before.
    LogProfit,
    /// The differential Sharpe ratio: the derivative of the exponentially weighted Sharpe ratio by its rate,
    /// `(B dA - A dB / 2) / (B - A^2)^(3/2)`, where A and B are the weighted means of returns and of their squares before the step.
    ///
    /// Source: Moody and Saffell, "Learning to trade via direct reinforcement", IEEE Transactions on Neural Networks 12 (2001),
    /// equations 11 to 13.
    DifferentialSharpe {
        /// Weight of the newest return, within (0, 1].
        rate: f64,
    },
}

/// What is rewarded of a step, and what is taken off that.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reward {
    /// What is paid.
    pub payoff: Payoff,
    /// What the fees of a step, over the value, count besides.
    pub cost_penalty: f64,
    /// What a deeper drawdown, relative to the highest value so far, counts besides.
    pub drawdown_penalty: f64,
}

impl Default for Reward {
    fn default() -> Self {
        Self { payoff: Payoff::Profit, cost_penalty: 0.0, drawdown_penalty: 0.0 }
    }
}

/// A reward under way.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Rewarded {
    value: f64,
    highest: f64,
    deepest: f64,
    fees: f64,
    /// Weighted means of returns and of their squares, where there was a return.
    means: Option<[f64; 2]>,
}

impl Rewarded {
    /// Begins at this value of the portfolio, with so much paid in fees before.
    pub fn begin(value: f64, fees: f64) -> Self {
        Self { value, highest: value, fees, ..Self::default() }
    }

    /// By how much the value is below the highest, relative to that.
    pub fn drawdown(&self) -> f64 {
        if self.highest > 0.0 { 1.0 - self.value / self.highest } else { 1.0 }
    }

    /// The reward of a step that led to `value`, with so much paid in `fees` since the beginning.
    #[inline]
    pub fn step(&mut self, reward: &Reward, value: f64, fees: f64) -> f64 {
        let before = self.value;
        let change = if before > 0.0 { value / before - 1.0 } else { 0.0 };
        let mut paid = match reward.payoff {
            Payoff::Profit => change,
            // What is ruined has lost all: the least logarithm of a value that is told apart from nothing.
            Payoff::LogProfit => change.max(f64::EPSILON - 1.0).ln_1p(),
            Payoff::DifferentialSharpe { rate } => self.differential_sharpe(rate, change),
        };
        if reward.cost_penalty != 0.0 && before > 0.0 {
            paid -= reward.cost_penalty * (fees - self.fees) / before;
        }
        (self.value, self.fees) = (value, fees);
        self.highest = self.highest.max(value);
        if reward.drawdown_penalty != 0.0 {
            let now = self.drawdown();
            paid -= reward.drawdown_penalty * (now - self.deepest).max(0.0);
            self.deepest = self.deepest.max(now);
        }
        paid
    }

    fn differential_sharpe(&mut self, rate: f64, change: f64) -> f64 {
        let square = change * change;
        let Some([a, b]) = self.means else {
            self.means = Some([change, square]);
            return 0.0;
        };
        let (da, db) = (change - a, square - b);
        let variance = b - a * a;
        self.means = Some([a + rate * da, b + rate * db]);
        // Of returns that are all the same there is no ratio yet.
        if variance > 1e-12 * b { (b * da - 0.5 * a * db) / variance.powf(1.5) } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The derivative of the Sharpe ratio of weighted means, by small differences of its rate.
    #[test]
    fn the_differential_sharpe_ratio_is_the_derivative_of_the_ratio() {
        let reward = Reward { payoff: Payoff::DifferentialSharpe { rate: 0.05 }, ..Reward::default() };
        let mut state = Rewarded::begin(100.0, 0.0);
        let (mut value, mut means): (f64, Option<[f64; 2]>) = (100.0, None);
        for k in 0..200_u32 {
            let change = 0.001 * f64::from(k % 7) - 0.002 + 0.0001 * f64::from(k % 3);
            let found = state.step(&reward, value * (1.0 + change), 0.0);
            let change = value * (1.0 + change) / value - 1.0;
            value *= 1.0 + change;
            let Some([a, b]) = means else {
                means = Some([change, change * change]);
                assert_eq!(found, 0.0);
                continue;
            };
            let ratio = |rate: f64| {
                let (a, b) = (a + rate * (change - a), b + rate * (change * change - b));
                a / (b - a * a).sqrt()
            };
            if b - a * a > 1e-9 * b {
                let slope = (ratio(1e-6) - ratio(-1e-6)) / 2e-6;
                assert!((found - slope).abs() < 1e-3 * slope.abs().max(1.0), "{k}: {found} {slope}");
            }
            means = Some([a + 0.05 * (change - a), b + 0.05 * (change * change - b)]);
        }
    }

    #[test]
    fn costs_and_drawdowns_are_taken_off_once() {
        let reward = Reward { cost_penalty: 2.0, drawdown_penalty: 0.5, ..Reward::default() };
        let mut state = Rewarded::begin(100.0, 1.0);
        assert_eq!(state.step(&reward, 110.0, 1.0), 110.0 / 100.0 - 1.0);
        let fell = state.step(&reward, 99.0, 3.0);
        assert!((fell - (-0.1 - 2.0 * 2.0 / 110.0 - 0.5 * 0.1)).abs() < 1e-12, "{fell}");
        // It is no deeper than before.
        assert_eq!(state.step(&reward, 104.5, 3.0), 104.5 / 99.0 - 1.0);
        assert!((state.drawdown() - 0.05).abs() < 1e-12);
        let mut ruined = Rewarded::begin(1.0, 0.0);
        let log = Reward { payoff: Payoff::LogProfit, ..Reward::default() };
        assert!(ruined.step(&log, -5.0, 0.0).is_finite() && ruined.step(&log, 1.0, 0.0).is_finite());
    }
}
