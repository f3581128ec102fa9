//! The recursions of textbooks, in logarithms throughout: slow, and with nothing that could underflow (L. R. Rabiner, *A tutorial on
//! hidden Markov models*, Proceedings of the IEEE 77, 1989).

use trueup::sim2real::regime::{Emission, HiddenMarkov};

/// What is known of the states of a series of one column, the states Gaussian.
pub struct Textbook {
    /// Logarithm of the density of the series.
    pub log_likelihood: f64,
    /// Probability of each state given the whole series, `[row][state]`.
    pub posterior: Vec<Vec<f64>>,
    /// Expected number of transitions, `[from][to]`.
    pub transitions: Vec<Vec<f64>>,
    /// Logarithm of the density of the series along its likeliest path.
    pub best: f64,
}

impl Textbook {
    /// Works everything out for rows of which NaN were lost.
    pub fn of(model: &HiddenMarkov, rows: &[f64]) -> Self {
        let states = model.states();
        let each = |of: &dyn Fn(usize) -> f64| -> Vec<f64> { (0..states).map(of).collect() };
        let log = |from: usize, to: usize| model.transitions(from)[to].ln();
        let density = |row: usize, state: usize| log_density(&model.emissions()[state], rows[row]);
        let mut forward = vec![each(&|to| model.initial()[to].ln() + density(0, to))];
        let mut likeliest = forward.clone();
        for row in 1..rows.len() {
            let next = each(&|to| density(row, to) + sum(&each(&|from| forward[row - 1][from] + log(from, to))));
            let best = each(&|to| density(row, to) + most(&each(&|from| likeliest[row - 1][from] + log(from, to))));
            forward.push(next);
            likeliest.push(best);
        }
        let mut backward = vec![vec![0.0; states]; rows.len()];
        for row in (1..rows.len()).rev() {
            backward[row - 1] = each(&|from| sum(&each(&|to| log(from, to) + density(row, to) + backward[row][to])));
        }
        let log_likelihood = sum(&forward[rows.len() - 1]);
        let posterior = (0..rows.len()).map(|row| each(&|s| (forward[row][s] + backward[row][s] - log_likelihood).exp()));
        let posterior = posterior.collect();
        let transitions = (0..states).map(|from| {
            each(&|to| {
                let into = |row: usize| forward[row - 1][from] + log(from, to) + density(row, to) + backward[row][to];
                (1..rows.len()).map(|row| (into(row) - log_likelihood).exp()).sum()
            })
        });
        let transitions = transitions.collect();
        Self { log_likelihood, posterior, transitions, best: most(&likeliest[rows.len() - 1]) }
    }
}

/// Logarithm of the density of a row in a state; 0 of one that was lost.
pub fn log_density(state: &Emission, x: f64) -> f64 {
    if x.is_nan() {
        return 0.0;
    }
    let (mean, variance) = (state.mean[0], state.variances()[0]);
    -0.5 * ((x - mean).powi(2) / variance + (std::f64::consts::TAU * variance).ln())
}

fn most(logs: &[f64]) -> f64 {
    logs.iter().copied().fold(f64::NEG_INFINITY, f64::max)
}

/// Logarithm of the sum of what these are the logarithms of.
fn sum(logs: &[f64]) -> f64 {
    let most = most(logs);
    if most == f64::NEG_INFINITY { most } else { most + logs.iter().map(|log| (log - most).exp()).sum::<f64>().ln() }
}
