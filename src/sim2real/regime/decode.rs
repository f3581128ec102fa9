//! Which states a whole series was in: the probability of each in each row, and the likeliest path.

use super::trellis::{self, Seen, Trellis, Visit};
use super::{HiddenMarkov, Observations, RegimeError, viterbi};

/// Asks for nothing but what is believed given the whole series.
struct Believed;

impl Visit for Believed {
    const KEEPS: bool = true;

    #[inline(always)]
    fn visit(&mut self, _: Seen) {}
}

impl HiddenMarkov {
    /// Logarithm of the density of a series.
    ///
    /// # Errors
    /// A series of another width than the model's.
    pub fn log_likelihood(&self, series: Observations) -> Result<f64, RegimeError> {
        self.check(series)?;
        Ok(trellis::log_likelihood(self, series))
    }

    /// Probability of each state in each row given the whole series, `[row][state]` row after row. It looks ahead: decisions
    /// in time rest on [`Filter`](super::Filter).
    ///
    /// # Errors
    /// A series of another width than the model's.
    pub fn smooth(&self, series: Observations) -> Result<Vec<f64>, RegimeError> {
        self.check(series)?;
        let mut trellis = Trellis::default();
        trellis.forward(self, series);
        trellis.backward(self, &mut Believed);
        trellis.beliefs.truncate(series.len() * self.states());
        Ok(trellis.beliefs)
    }

    /// The likeliest path of states given the whole series, and the logarithm of its density with the series (A. J. Viterbi,
    /// IEEE Transactions on Information Theory 13, 1967). Where states are equally likely the lower number is taken.
    ///
    /// # Errors
    /// A series of another width than the model's.
    pub fn viterbi(&self, series: Observations) -> Result<(Vec<usize>, f64), RegimeError> {
        self.check(series)?;
        Ok(viterbi::likeliest(self, series))
    }
}
