//! A hidden Markov model: which regime there is, and how it changes, as far as what is observed can tell.

use rand_distr::{ChiSquared, Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

use super::densities::Densities;
use super::{Emission, Observations, RegimeError};
use crate::sim2real::Seed;

/// States that follow each other as a Markov chain, each with a distribution of what is observed while it lasts.
///
/// It is written to TOML and JSON as `initial`, `transition` and `state`, and is checked when it is read. A fitted model's
/// states are in the order of their volatility, the calmest first.
///
/// Source: L. R. Rabiner, *A tutorial on hidden Markov models and selected applications in speech recognition*,
/// Proceedings of the IEEE 77 (1989).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Written", into = "Written")]
pub struct HiddenMarkov {
    initial: Vec<f64>,
    /// `[from][to]`, row after row.
    transition: Vec<f64>,
    emissions: Vec<Emission>,
    densities: Densities,
    mixes: bool,
}

/// A transition below this may never be made: what it brings to a state is too little to be multiplied by a density.
const RARE: f64 = 1e-100;

/// A model as it is written down.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    initial: Vec<f64>,
    transition: Vec<Vec<f64>>,
    state: Vec<Emission>,
}

impl TryFrom<Written> for HiddenMarkov {
    type Error = RegimeError;

    fn try_from(written: Written) -> Result<Self, RegimeError> {
        Self::new(written.initial, written.transition, written.state)
    }
}

impl From<HiddenMarkov> for Written {
    fn from(model: HiddenMarkov) -> Self {
        let transition = model.transition.chunks_exact(model.initial.len()).map(<[f64]>::to_vec).collect();
        Self { initial: model.initial, transition, state: model.emissions }
    }
}

/// A series drawn from a model.
#[derive(Debug, Clone, PartialEq)]
pub struct Drawn {
    /// State of each row.
    pub states: Vec<usize>,
    /// What was observed, row after row.
    pub values: Vec<f64>,
}

impl HiddenMarkov {
    /// A model of the probabilities of the first state, `[states]`, those of the next state given the last, `[from][to]`,
    /// and what is observed in each.
    ///
    /// # Errors
    /// Parts of different sizes, probabilities that are none, a spread that is none.
    pub fn new(initial: Vec<f64>, transition: Vec<Vec<f64>>, emissions: Vec<Emission>) -> Result<Self, RegimeError> {
        let states = emissions.len();
        let densities = Densities::new(&emissions)?;
        let shape = |what, found| Err(RegimeError::Shape { what, found, expected: states });
        if initial.len() != states {
            return shape("initial probabilities", initial.len());
        }
        if transition.len() != states {
            return shape("rows of transitions", transition.len());
        }
        probabilities("initial", 0, &initial)?;
        for (from, row) in transition.iter().enumerate() {
            if row.len() != states {
                return shape("a row of transitions", row.len());
            }
            probabilities("transitions from state", from, row)?;
        }
        let transition = transition.concat();
        let mixes = transition.iter().all(|probability| *probability >= RARE);
        Ok(Self { initial, transition, emissions, densities, mixes })
    }

    /// Number of states.
    #[must_use]
    pub fn states(&self) -> usize {
        self.emissions.len()
    }

    /// Number of columns of what is observed.
    #[must_use]
    pub fn width(&self) -> usize {
        self.emissions[0].mean.len()
    }

    /// Probabilities of the first state, `[states]`.
    #[must_use]
    pub fn initial(&self) -> &[f64] {
        &self.initial
    }

    /// Probabilities of the next state after state `from`, `[states]`.
    #[must_use]
    pub fn transitions(&self, from: usize) -> &[f64] {
        &self.transition[from * self.states()..][..self.states()]
    }

    /// What is observed in each state.
    #[must_use]
    pub fn emissions(&self) -> &[Emission] {
        &self.emissions
    }

    /// All transitions, row after row.
    pub(super) fn transition(&self) -> &[f64] {
        &self.transition
    }

    /// Whether every state leads to every other at once, so that what is left of a state never falls so low that numbers have no place for
    /// it: otherwise recursions are in logarithms, which takes several times as long.
    pub(super) fn mixes(&self) -> bool {
        self.mixes
    }

    pub(super) fn densities(&self) -> &Densities {
        &self.densities
    }

    /// That a series has this model's width.
    pub(super) fn check(&self, series: Observations) -> Result<(), RegimeError> {
        if series.width() == self.width() {
            return Ok(());
        }
        Err(RegimeError::Width { width: self.width(), found: series.width() })
    }

    /// How long each state lasts on average [rows]: infinite for one that is never left.
    #[must_use]
    pub fn expected_durations(&self) -> Vec<f64> {
        (0..self.states()).map(|state| 1.0 / (1.0 - self.transitions(state)[state]).max(0.0)).collect()
    }

    /// The share of time each state has in the long run, `[states]`.
    ///
    /// By the elimination of Grassmann, Taksar and Heyman (Operations Research 33, 1985), which subtracts nothing and so
    /// loses no digits where states hardly ever change.
    ///
    /// # Errors
    /// A chain that does not lead from every state to every other.
    pub fn stationary(&self) -> Result<Vec<f64>, RegimeError> {
        let states = self.states();
        let mut left = self.transition.clone();
        for last in (1..states).rev() {
            let leaving: f64 = left[last * states..][..last].iter().sum();
            if leaving <= 0.0 {
                return Err(RegimeError::Reducible);
            }
            for from in 0..last {
                let through = left[from * states + last] / leaving;
                left[from * states + last] = through;
                for to in 0..last {
                    left[from * states + to] += through * left[last * states + to];
                }
            }
        }
        let mut share = vec![1.0; states];
        for state in 1..states {
            share[state] = (0..state).map(|from| share[from] * left[from * states + state]).sum();
        }
        let total: f64 = share.iter().sum();
        if share.contains(&0.0) || !total.is_finite() {
            return Err(RegimeError::Reducible);
        }
        Ok(share.into_iter().map(|s| s / total).collect())
    }

    /// Draws a series of `rows` rows, from the streams "regime.states" and "regime.observations" of `seed`.
    #[must_use]
    pub fn simulate(&self, rows: usize, seed: Seed) -> Drawn {
        let (mut chain, mut noise) = (seed.stream("regime.states"), seed.stream("regime.observations"));
        // Factors were found when the model was made.
        let factors: Vec<_> = self.emissions.iter().enumerate().filter_map(|(k, e)| e.factor(k).ok()).collect();
        let width = self.width();
        let mut drawn = Drawn { states: Vec::with_capacity(rows), values: Vec::with_capacity(rows * width) };
        let mut white = vec![0.0; width];
        for row in 0..rows {
            let next = if row == 0 { &self.initial } else { self.transitions(drawn.states[row - 1]) };
            let state = pick(next, rand::RngExt::random(&mut *chain));
            let emission = &self.emissions[state];
            white.fill_with(|| StandardNormal.sample(&mut *noise));
            let widened = match emission.degrees.and_then(|nu| Some((nu, ChiSquared::new(nu).ok()?))) {
                Some((nu, squared)) => (nu / squared.sample(&mut *noise)).sqrt(),
                None => 1.0,
            };
            for column in 0..width {
                let deviation: f64 = (0..=column).map(|k| factors[state][(column, k)] * white[k]).sum();
                drawn.values.push(emission.mean[column] + widened * deviation);
            }
            drawn.states.push(state);
        }
        drawn
    }

    /// The same model, its states numbered by their volatility, the calmest first; of equal ones the lower mean.
    #[must_use]
    pub fn by_volatility(self) -> Self {
        let mut order: Vec<usize> = (0..self.states()).collect();
        let key = |state: usize| (self.emissions[state].volatility(), &self.emissions[state].mean);
        order.sort_by(|a, b| {
            let ((a, means_a), (b, means_b)) = (key(*a), key(*b));
            a.total_cmp(&b).then_with(|| means_a.partial_cmp(means_b).unwrap_or(std::cmp::Ordering::Equal))
        });
        let transition = order.iter().map(|from| order.iter().map(|to| self.transitions(*from)[*to]).collect()).collect();
        let initial = order.iter().map(|state| self.initial[*state]).collect();
        let emissions = order.iter().map(|state| self.emissions[*state].clone()).collect();
        // Its parts are those of a model.
        Self::new(initial, transition, emissions).unwrap_or(self)
    }
}

/// The first outcome at which the sum of `probabilities` exceeds `uniform`.
fn pick(probabilities: &[f64], uniform: f64) -> usize {
    let mut left = uniform;
    for (outcome, probability) in probabilities.iter().enumerate() {
        left -= probability;
        if left < 0.0 {
            return outcome;
        }
    }
    // Rounding: the last that can be.
    probabilities.iter().rposition(|p| *p > 0.0).unwrap_or(0)
}

/// That numbers are probabilities of all that can be.
fn probabilities(what: &'static str, row: usize, found: &[f64]) -> Result<(), RegimeError> {
    let sum: f64 = found.iter().sum();
    if found.iter().all(|p| *p >= 0.0) && (sum - 1.0).abs() <= 1e-6 {
        return Ok(());
    }
    Err(RegimeError::NotProbabilities { what, row, found: found.to_vec() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim2real::regime::Spread;

    fn state(mean: f64, variance: f64) -> Emission {
        Emission { mean: vec![mean], spread: Spread::Diagonal(vec![variance]), degrees: None }
    }

    fn two(leave_first: f64, leave_second: f64) -> HiddenMarkov {
        let transition = vec![vec![1.0 - leave_first, leave_first], vec![leave_second, 1.0 - leave_second]];
        HiddenMarkov::new(vec![0.5, 0.5], transition, vec![state(1.0, 9.0), state(0.0, 1.0)]).unwrap()
    }

    /// Of two states each has the share by which the other is left.
    #[test]
    fn durations_and_shares() {
        let model = two(0.02, 0.08);
        let durations = model.expected_durations();
        assert!((durations[0] - 50.0).abs() < 1e-9 && (durations[1] - 12.5).abs() < 1e-9);
        let share = model.stationary().unwrap();
        assert!((share[0] - 0.8).abs() < 1e-12 && (share[1] - 0.2).abs() < 1e-12);
        assert_eq!(two(0.0, 0.1).expected_durations()[0], f64::INFINITY);
        assert_eq!(two(0.0, 0.1).stationary(), Err(RegimeError::Reducible));
        assert_eq!(two(0.1, 0.0).stationary(), Err(RegimeError::Reducible));
    }

    /// The shares of a chain of four states are left unchanged by a step.
    #[test]
    fn a_step_leaves_the_stationary_distribution_as_it_is() {
        let transition: Vec<Vec<f64>> =
            vec![vec![0.9, 0.1, 0.0, 0.0], vec![0.0, 0.8, 0.15, 0.05], vec![0.3, 0.0, 0.7, 0.0], vec![0.0, 0.0, 1.0, 0.0]];
        let states = (1..=4).map(|v| state(0.0, f64::from(v))).collect();
        let model = HiddenMarkov::new(vec![0.25; 4], transition.clone(), states).unwrap();
        let share = model.stationary().unwrap();
        for to in 0..4 {
            let stepped: f64 = (0..4).map(|from| share[from] * transition[from][to]).sum();
            assert!((stepped - share[to]).abs() < 1e-14, "{share:?}");
        }
    }

    #[test]
    fn states_are_ordered_by_volatility() {
        let ordered = two(0.02, 0.08).by_volatility();
        assert_eq!(ordered.emissions()[0], state(0.0, 1.0));
        assert_eq!(ordered.transitions(0), [0.92, 0.08]);
        assert_eq!(ordered.clone().by_volatility(), ordered);
    }

    #[test]
    fn a_model_is_kept_to_the_last_bit() {
        let model = two(1.0 / 3.0, 0.1);
        let json = serde_json::to_string(&model).unwrap();
        assert_eq!(serde_json::from_str::<HiddenMarkov>(&json).unwrap(), model);
        let toml = toml::to_string(&model).unwrap();
        assert_eq!(toml::from_str::<HiddenMarkov>(&toml).unwrap(), model);
        let wrong = json.replace("0.1", "0.3");
        let told = serde_json::from_str::<HiddenMarkov>(&wrong).unwrap_err().to_string();
        assert!(told.contains("transitions from state 1") && told.contains("hint:"), "{told}");
    }

    #[test]
    fn what_models_cannot_be() {
        let states = || vec![state(0.0, 1.0), state(0.0, 2.0)];
        let rows = || vec![vec![0.5, 0.5]; 2];
        let of = |initial, transition, states| HiddenMarkov::new(initial, transition, states).map(|_| ());
        assert!(matches!(of(vec![0.7, 0.7], rows(), states()), Err(RegimeError::NotProbabilities { .. })));
        assert!(matches!(of(vec![f64::NAN, 1.0], rows(), states()), Err(RegimeError::NotProbabilities { .. })));
        let negative = vec![vec![1.5, -0.5], vec![0.5, 0.5]];
        assert!(matches!(of(vec![0.5; 2], negative, states()), Err(RegimeError::NotProbabilities { .. })));
        assert!(matches!(of(vec![1.0], rows(), states()), Err(RegimeError::Shape { .. })));
        assert!(matches!(of(vec![0.5; 2], vec![vec![1.0]; 2], states()), Err(RegimeError::Shape { .. })));
        assert!(matches!(of(vec![0.5; 2], vec![vec![0.5; 2]], states()), Err(RegimeError::Shape { .. })));
        assert!(matches!(of(vec![], vec![], vec![]), Err(RegimeError::Shape { .. })));
    }

    #[test]
    fn draws_have_the_models_moments() {
        let spread = Spread::Full(vec![vec![2.0, 0.9], vec![0.9, 1.0]]);
        let states = vec![
            Emission { mean: vec![1.0, -1.0], spread, degrees: None },
            Emission { mean: vec![0.0, 0.0], spread: Spread::Diagonal(vec![1.0, 4.0]), degrees: None },
        ];
        let model = HiddenMarkov::new(vec![1.0, 0.0], vec![vec![0.95, 0.05], vec![0.15, 0.85]], states).unwrap();
        let drawn = model.simulate(200_000, Seed(5));
        assert_eq!(drawn, model.simulate(200_000, Seed(5)));
        assert_ne!(drawn.values, model.simulate(200_000, Seed(6)).values);
        let of_first: Vec<&[f64]> =
            drawn.values.chunks(2).zip(&drawn.states).filter(|(_, k)| **k == 0).map(|(row, _)| row).collect();
        assert!((of_first.len() as f64 / 200_000.0 - 0.75).abs() < 0.01);
        let count = of_first.len() as f64;
        let covariance = of_first.iter().map(|x| (x[0] - 1.0) * (x[1] + 1.0)).sum::<f64>() / count;
        assert!((covariance - 0.9).abs() < 0.03, "{covariance}");
    }
}
