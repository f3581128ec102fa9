//! Fitting a hidden Markov model: expectation and maximization in turn, from several starts.

use rayon::prelude::*;
use serde::Serialize;
use wide::f64x2;

use super::densities::Densities;
use super::ends::{Ends, LANES, Steps};
use super::moments::Moments;
use super::observations::is_lost;
use super::starts;
use super::trellis::{Arrivals, Seen, Trellis, Visit};
use super::{Degrees, Emission, Family, HiddenMarkov, Observations, RegimeError, Settings, Spread};

/// Rows of which starts are tried: of a longer series a sample of stretches, and the best start goes on over all of it.
const TRIED_ROWS: usize = 20_000;

/// Stretches of such a sample.
const STRETCHES: usize = 10;

/// Iterations of a start on such a sample: enough to see which is best.
const TRIED_ITERATIONS: usize = 40;

/// Why a state is no regime.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Collapse {
    /// Its variance fell to the floor: it holds rows that are all but equal.
    Narrow,
    /// It holds fewer rows than its distribution has parameters.
    Empty,
}

/// A model that was fitted.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// The model, its states in the order of their volatility.
    pub model: HiddenMarkov,
    /// Logarithm of the density of the series.
    pub log_likelihood: f64,
    /// Number of rows that were observed.
    pub observed: usize,
    /// Iterations over the whole series.
    pub iterations: usize,
    /// Whether the gain fell below the tolerance before iterations ran out.
    pub converged: bool,
    /// States that are no regimes, and why.
    pub collapsed: Vec<(usize, Collapse)>,
    /// Log-likelihood that each start came to (of a long series, on a sample of it); `None` where it began with an empty state.
    pub starts: Vec<Option<f64>>,
    /// Number of parameters that were fitted.
    pub parameters: usize,
}

impl Fit {
    /// Akaike's information criterion: lower is better.
    #[must_use]
    pub fn aic(&self) -> f64 {
        2.0 * self.parameters as f64 - 2.0 * self.log_likelihood
    }

    /// Schwarz's Bayesian information criterion: lower is better, and it asks more of a further state.
    #[must_use]
    pub fn bic(&self) -> f64 {
        self.parameters as f64 * (self.observed as f64).ln() - 2.0 * self.log_likelihood
    }
}

/// Fits a model to one or more series of the same kind, by maximum likelihood (L. E. Baum, T. Petrie, G. Soules and N. Weiss,
/// Annals of Mathematical Statistics 41, 1970). Transitions within a series count, and none from one to the next.
///
/// The same settings give the same bits, at any number of threads.
///
/// # Errors
/// Settings out of range; no more rows than `states * (columns + 1)`; a column that never changes; more states than different
/// rows; series of different widths.
pub fn fit(series: &[Observations], settings: &Settings) -> Result<Fit, RegimeError> {
    settings.check()?;
    let whole = Whole::of(series, settings)?;
    let floors: Vec<f64> = whole.variances.iter().map(|v| v * settings.floor).collect();
    let short = sample(series);
    let long = short.len() != series.len() || short.iter().zip(series).any(|(a, b)| a.len() != b.len());
    let most = if long { settings.iterations.min(TRIED_ITERATIONS) } else { settings.iterations };
    let tried: Vec<Option<Climb>> = (0..settings.starts)
        .into_par_iter()
        .map(|number| {
            let model = starts::start(number, &short, settings, &whole.means, &whole.variances)?;
            Some(climb(model, &short, settings, &floors, most))
        })
        .collect();
    let starts = tried.iter().map(|climb| climb.as_ref().map(|c| c.log_likelihood)).collect();
    // The first of the best.
    let best =
        tried.into_iter().flatten().reduce(|best, next| if next.log_likelihood > best.log_likelihood { next } else { best });
    let Some(best) = best else {
        return Err(RegimeError::FewValues { states: settings.states, distinct: whole.distinct });
    };
    let best = if long { climb(best.model, series, settings, &floors, settings.iterations) } else { best };
    Ok(told(best, settings, &floors, whole.observed, starts))
}

/// Fits a model further, from where it is: a model that was kept, brought up to newer rows. Of `settings`, states are the model's own,
/// and nothing is drawn.
///
/// # Errors
/// As [`fit`]; series of another width than the model's.
pub fn refit(model: &HiddenMarkov, series: &[Observations], settings: &Settings) -> Result<Fit, RegimeError> {
    let settings = &Settings { states: model.states(), ..*settings };
    settings.check()?;
    series.iter().try_for_each(|part| model.check(*part))?;
    let whole = Whole::of(series, settings)?;
    let floors: Vec<f64> = whole.variances.iter().map(|v| v * settings.floor).collect();
    let best = climb(model.clone(), series, settings, &floors, settings.iterations);
    let starts = vec![Some(best.log_likelihood)];
    Ok(told(best, settings, &floors, whole.observed, starts))
}

/// What is kept of the climb, once states have been put in order.
fn told(best: Climb, settings: &Settings, floors: &[f64], observed: usize, starts: Vec<Option<f64>>) -> Fit {
    let width = floors.len();
    let of_state = match settings.family {
        Family::Gaussian | Family::StudentT(Degrees::Fixed(_)) => 2 * width,
        Family::GaussianFull => width + width * (width + 1) / 2,
        Family::StudentT(Degrees::Fitted) => 2 * width + 1,
    };
    let states = settings.states;
    let parameters = states - 1 + states * (states - 1) + states * of_state;
    let before = best.model.emissions().to_vec();
    let model = best.model.by_volatility();
    let collapsed = model.emissions().iter().enumerate().filter_map(|(state, emission)| {
        let was = before.iter().position(|e| e == emission)?;
        if best.rows[was] < of_state as f64 {
            Some((state, Collapse::Empty))
        } else {
            narrow(emission, floors).then_some((state, Collapse::Narrow))
        }
    });
    let collapsed = collapsed.collect();
    let Climb { log_likelihood, iterations, converged, .. } = best;
    Fit { collapsed, model, log_likelihood, observed, iterations, converged, starts, parameters }
}

/// Whether a spread lies on the floor.
fn narrow(emission: &Emission, floors: &[f64]) -> bool {
    let at = |variance: f64, floor: f64| variance <= floor * (1.0 + 1e-9);
    match &emission.spread {
        Spread::Diagonal(variances) => variances.iter().zip(floors).any(|(v, f)| at(*v, *f)),
        Spread::Full(rows) => {
            let scaled =
                nalgebra::DMatrix::from_fn(floors.len(), floors.len(), |i, j| rows[i][j] / (floors[i] * floors[j]).sqrt());
            // Of eigenvalues whose ratio reaches 1e6, digits are lost.
            scaled.symmetric_eigenvalues().min() <= 1.0 + 1e-6
        }
    }
}

/// What a fit needs to know of all rows.
struct Whole {
    means: Vec<f64>,
    variances: Vec<f64>,
    observed: usize,
    distinct: usize,
}

impl Whole {
    fn of(series: &[Observations], settings: &Settings) -> Result<Self, RegimeError> {
        let width = series.first().map_or(1, Observations::width);
        if let Some(other) = series.iter().find(|part| part.width() != width) {
            return Err(RegimeError::Width { width, found: other.width() });
        }
        let rows = || series.iter().flat_map(Observations::iter).filter(|row| !is_lost(row));
        let observed = rows().count();
        let needed = (settings.states * (width + 1)).max(3);
        if observed < needed {
            return Err(RegimeError::TooShort { what: "a hidden Markov model", found: observed, needed });
        }
        let mean = |column: usize| rows().map(|row| row[column]).sum::<f64>() / observed as f64;
        let means: Vec<f64> = (0..width).map(mean).collect();
        let variance =
            |column: usize| rows().map(|row| (row[column] - means[column]).powi(2)).sum::<f64>() / observed as f64;
        let variances: Vec<f64> = (0..width).map(variance).collect();
        let mut different: Vec<&[f64]> = vec![];
        for row in rows() {
            if different.len() >= settings.states.max(2) {
                break;
            }
            if !different.contains(&row) {
                different.push(row);
            }
        }
        let first = different[0];
        let constant = (0..width).find(|column| rows().all(|row| row[*column] == first[*column]));
        if let Some(column) = constant {
            return Err(RegimeError::Constant { column, value: first[column] });
        }
        if different.len() < settings.states {
            return Err(RegimeError::FewValues { states: settings.states, distinct: different.len() });
        }
        Ok(Self { means, variances, observed, distinct: different.len() })
    }
}

/// Stretches of the series of which starts are tried: all of a short one.
fn sample<'a>(series: &[Observations<'a>]) -> Vec<Observations<'a>> {
    let total: usize = series.iter().map(Observations::len).sum();
    if total <= TRIED_ROWS {
        return series.to_vec();
    }
    let length = TRIED_ROWS / STRETCHES;
    let mut stretches = vec![];
    for part in series {
        // As many as its share of all rows.
        let count = (part.len() * STRETCHES).div_ceil(total).min(part.len() / length).max(1);
        for k in 0..count {
            let from = part.len().saturating_sub(length) * k / count.saturating_sub(1).max(1);
            stretches.push(part.slice(from, (from + length).min(part.len())));
        }
    }
    stretches
}

/// A model on its way up.
struct Climb {
    model: HiddenMarkov,
    log_likelihood: f64,
    /// Expected number of rows in each state.
    rows: Vec<f64>,
    iterations: usize,
    converged: bool,
}

fn climb(start: HiddenMarkov, series: &[Observations], settings: &Settings, floors: &[f64], most: usize) -> Climb {
    let observed: usize = series.iter().map(Observations::observed).sum();
    let mut trellis = Trellis::default();
    let mut model = start;
    let mut before = f64::NEG_INFINITY;
    for iterations in 1..=most {
        let expected = Expected::of(&model, series, settings.family, &mut trellis);
        let gain = expected.log_likelihood - before;
        before = expected.log_likelihood;
        let converged = gain <= settings.tolerance * observed as f64;
        if converged || iterations == most {
            let Expected { log_likelihood, moments, .. } = expected;
            return Climb {
                log_likelihood,
                rows: (0..model.states()).map(|state| moments.rows(state)).collect(),
                model,
                iterations,
                converged,
            };
        }
        model = expected.maximize(&model, settings.family, floors);
    }
    Climb { rows: vec![0.0; model.states()], model, log_likelihood: before, iterations: most, converged: false }
}

/// What is expected of the states that are not seen, given a model and the series.
struct Expected {
    log_likelihood: f64,
    initial: Vec<f64>,
    /// Number of transitions over their probability, `[from][to]`.
    transition: Vec<f64>,
    moments: Moments,
}

/// Adds up what is expected of one series.
struct Counting<'a> {
    expected: &'a mut Expected,
    /// Of transitions, from either end, as they are come by.
    transition: &'a mut [f64x2],
    series: Observations<'a>,
    densities: &'a Densities,
    /// Of the steps of a block: what is believed, `[state][step][end]`, and room for the rows, `[column][step][end]`.
    block: [Vec<[f64; LANES]>; 2],
}

impl Counting<'_> {
    /// Keeps what is believed of a step's rows until all of a block are known, and adds these to the moments.
    #[inline(always)]
    fn keep(&mut self, seen: &Seen) {
        let [believed, _] = &mut self.block;
        let place = seen.step % (LANES / seen.ends);
        for (believed, posterior) in believed.iter_mut().zip(seen.posterior) {
            let kept = &mut believed[place * seen.ends..][..seen.ends];
            kept.copy_from_slice(&posterior.as_array_ref()[..seen.ends]);
        }
        if place == 0 {
            // The first step of a block is come by last.
            self.add(seen.step, seen.ends);
        }
    }

    #[inline(never)]
    fn add(&mut self, from: usize, ends: usize) {
        let [believed, columns] = &mut self.block;
        if ends == 1 {
            Steps::of::<f64>(self.series).columns::<f64>(from, columns);
        } else {
            Steps::of::<f64x2>(self.series).columns::<f64x2>(from, columns);
        }
        self.expected.moments.add(columns, believed, self.densities);
    }
}

impl Visit for Counting<'_> {
    const KEEPS: bool = false;

    #[inline(always)]
    fn visit(&mut self, seen: Seen) {
        self.keep(&seen);
        let states = seen.posterior.len();
        let transition = &mut self.transition[..states * states];
        match seen.arrivals {
            Arrivals::None => {
                self.expected.initial.iter_mut().zip(seen.posterior).for_each(|(sum, p)| *sum += p.at(0));
            }
            Arrivals::Products { before, ahead } => {
                for (sums, from) in transition.chunks_exact_mut(states).zip(before) {
                    for (sum, to) in sums.iter_mut().zip(ahead) {
                        *sum += *from * *to;
                    }
                }
            }
            Arrivals::Each(counts) => {
                self.expected.transition.iter_mut().zip(counts).for_each(|(sum, count)| *sum += count);
            }
        }
    }
}

impl Expected {
    fn of(model: &HiddenMarkov, series: &[Observations], family: Family, trellis: &mut Trellis) -> Self {
        let (mut expected, states) = (Self::nothing(model, family), model.states());
        let mut transition = vec![f64x2::ZERO; states * states];
        for part in series.iter().filter(|part| !part.is_empty()) {
            trellis.forward(model, *part);
            expected.log_likelihood += trellis.log_likelihood;
            expected.transition.iter_mut().zip(&trellis.crossing).for_each(|(sum, count)| *sum += count);
            let densities = model.densities();
            let block = [states, model.width()].map(|count| vec![[0.0; LANES]; count]);
            let mut counting =
                Counting { expected: &mut expected, transition: &mut transition, series: *part, densities, block };
            trellis.backward(model, &mut counting);
        }
        for (k, sum) in expected.transition.iter_mut().enumerate() {
            // From the last row back transitions are to and fro.
            *sum += transition[k].at(0) + transition[k % states * states + k / states].at(1);
        }
        expected
    }

    /// What is expected of no series.
    fn nothing(model: &HiddenMarkov, family: Family) -> Self {
        let states = model.states();
        let centers = model.emissions().iter().flat_map(|e| e.mean.iter().copied()).collect();
        Self {
            log_likelihood: 0.0,
            initial: vec![0.0; states],
            transition: vec![0.0; states * states],
            moments: Moments::new(centers, model.width(), family),
        }
    }

    /// The model under which what is expected is likeliest.
    fn maximize(self, before: &HiddenMarkov, family: Family, floors: &[f64]) -> HiddenMarkov {
        let states = before.states();
        let parts: f64 = self.initial.iter().sum();
        let initial = self.initial.iter().map(|p| p / parts).collect();
        let transition = (0..states)
            .map(|from| {
                let earlier = before.transitions(from);
                let counts = self.transition[from * states..][..states].iter().zip(earlier).map(|(sum, p)| sum * p);
                let counts: Vec<f64> = counts.collect();
                let sum: f64 = counts.iter().sum();
                // A state that is never left in the series keeps what it had.
                if sum > 1e-12 { counts.into_iter().map(|count| count / sum).collect() } else { earlier.to_vec() }
            })
            .collect();
        let emissions = before
            .emissions()
            .iter()
            .enumerate()
            .map(|(state, earlier)| {
                self.moments.emission(state, family, floors, Some(earlier)).unwrap_or_else(|| earlier.clone())
            })
            .collect();
        HiddenMarkov::new(initial, transition, emissions).unwrap_or_else(|_| before.clone())
    }
}

/// Fits models of each number of states in turn. The first of the pair is the place, in the second, of the one with the least BIC,
/// of those in which no state has collapsed where there are any: one that keeps a few equal rows is as likely as its floor is low.
///
/// Numbers of states that the series is too short or too poor for are left out.
///
/// # Errors
/// As [`fit`], where no number of states can be fitted.
pub fn fit_states(
    series: &[Observations],
    states: std::ops::RangeInclusive<usize>,
    settings: &Settings,
) -> Result<(usize, Vec<Fit>), RegimeError> {
    let mut fits: Vec<Fit> = vec![];
    let mut refused = RegimeError::setting("states", 0.0, false, "a range that holds a number from 1").err();
    for states in states {
        match fit(series, &Settings { states, ..*settings }) {
            Ok(fit) => fits.push(fit),
            Err(error) => refused = Some(error),
        }
    }
    let rank = |fit: &Fit| (!fit.collapsed.is_empty(), fit.bic());
    let best = (0..fits.len()).min_by(|a, b| {
        let ((a, of_a), (b, of_b)) = (rank(&fits[*a]), rank(&fits[*b]));
        a.cmp(&b).then(of_a.total_cmp(&of_b))
    });
    match (best, refused) {
        (Some(best), _) => Ok((best, fits)),
        (None, Some(error)) => Err(error),
        (None, None) => Err(RegimeError::Reducible),
    }
}
