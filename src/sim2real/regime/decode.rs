//! Which states a whole series was in: the probability of each in each row, and the likeliest path.

use super::trellis::{Trellis, Visit, follow};
use super::{HiddenMarkov, Observations, RegimeError};

/// Probabilities as they are shown, `[row][state]`.
struct Smoothed(Vec<f64>);

impl Visit for Smoothed {
    #[inline(always)]
    fn visit(&mut self, row: usize, posterior: &[f64], _: &[f64]) {
        self.0[row * posterior.len()..][..posterior.len()].copy_from_slice(posterior);
    }
}

impl HiddenMarkov {
    /// Logarithm of the density of a series.
    ///
    /// # Errors
    /// A series of another width than the model's.
    pub fn log_likelihood(&self, series: Observations) -> Result<f64, RegimeError> {
        self.check(series)?;
        Ok(follow(self, series, |_| ()))
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
        let mut smoothed = Smoothed(vec![0.0; trellis.beliefs.len()]);
        trellis.backward(self, &mut smoothed);
        Ok(smoothed.0)
    }

    /// The likeliest path of states given the whole series, and the logarithm of its density with the series (A. J. Viterbi,
    /// IEEE Transactions on Information Theory 13, 1967). Of paths equally likely it is the one of lower numbers.
    ///
    /// # Errors
    /// A series of another width than the model's.
    pub fn viterbi(&self, series: Observations) -> Result<(Vec<usize>, f64), RegimeError> {
        self.check(series)?;
        let states = self.states();
        let logarithms: Vec<f64> = self.transition().iter().map(|p| p.ln()).collect();
        let mut best: Vec<f64> = self.initial().iter().map(|p| p.ln()).collect();
        let (mut next, mut density) = (vec![0.0; states], vec![0.0; states]);
        // Where each state's best path came from, `[row][state]`.
        let mut origins = vec![0_u32; series.len() * states];
        for (number, (row, origin)) in series.iter().zip(origins.chunks_exact_mut(states)).enumerate() {
            self.densities().logarithms(row, &mut density);
            if number == 0 {
                for (score, log) in best.iter_mut().zip(&density) {
                    *score += log;
                }
                continue;
            }
            for to in 0..states {
                let (mut from, mut score) = (0, f64::NEG_INFINITY);
                for (state, before) in best.iter().enumerate() {
                    let candidate = before + logarithms[state * states + to];
                    if candidate > score {
                        (from, score) = (state, candidate);
                    }
                }
                origin[to] = from as u32;
                next[to] = score + density[to];
            }
            std::mem::swap(&mut best, &mut next);
        }
        let (mut state, mut score) = (0, f64::NEG_INFINITY);
        for (candidate, of) in best.iter().enumerate() {
            if *of > score {
                (state, score) = (candidate, *of);
            }
        }
        let mut path = vec![state; series.len()];
        for row in (1..series.len()).rev() {
            state = origins[row * states + state] as usize;
            path[row - 1] = state;
        }
        Ok((path, score))
    }
}
