//! Output-error fits by Levenberg-Marquardt.

use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::storage::Owned;
use nalgebra::{DMatrix, DVector, Dyn};

use super::bounds::Bounded;
use super::problem::{DIFFERENCE, Problem, State};
use crate::sim2real::Simulator;

/// Directions in which the data move the parameters less than this part of the strongest count as not determined:
/// derivatives are known no better than the step of their finite differences.
const RANK_TOLERANCE: f64 = 3.0 * DIFFERENCE;

/// A fit ends when a step would lower the objective by less than this part of it: a thousandth of what the weakest
/// evidence that counts is worth.
const CONVERGED: f64 = 1e-6;

/// What a fit found.
#[derive(Debug, Clone)]
pub struct Fit {
    /// Values of all of the simulator's parameters, the fixed ones among them.
    pub values: Vec<f64>,
    /// Their standard deviations as the noise alone makes them; 0 for fixed ones, infinite for those not determined.
    pub std: Vec<f64>,
    /// Covariance of the free parameters that the output depends on smoothly, in their order, as noise and priors make it; none where neither data nor
    /// priors determine them all.
    pub covariance: Option<DMatrix<f64>>,
    /// Numbers of the parameters that were free.
    pub free: Vec<usize>,
    /// Initial states of all parts.
    pub state: State,
    /// Residuals at the solution, in units of the noise: those of the problem's blocks, then those of priors.
    pub residual: DVector<f64>,
    /// Derivatives of the residuals by those of the free parameters that it depends on smoothly.
    pub jacobian: DMatrix<f64>,
    /// Number of directions in the space of the free parameters that the data determine.
    pub rank: usize,
    /// What the priors of the free parameters add to the objective.
    pub prior: f64,
    /// Numbers of the parameters that ended at a bound.
    pub at_bound: Vec<usize>,
}

impl Fit {
    /// Sum of squared residuals, in units of the noise, priors included.
    #[must_use]
    pub fn objective(&self) -> f64 {
        self.residual.norm_squared() + self.prior
    }
}

/// Fits the parameters numbered in `free`, from `start`, by Levenberg-Marquardt within their bounds and priors.
#[must_use]
pub fn fit_smooth<S: Simulator>(problem: &Problem<'_, S>, start: &[f64], free: &[usize], state: &State) -> Fit {
    let mut state = state.clone();
    let mut theta = start.to_vec();
    let rows = measured_rows(problem);
    let measured = |theta: &[f64], state: &State| {
        let evaluation = problem.evaluate(theta, state, &[]);
        (evaluation.residual.rows(0, rows).norm_squared(), evaluation.initial_step)
    };
    // Initial states are solved for to first order only: move them there, and fit again where that made a difference.
    for _ in 0..4 {
        theta = descend(problem, theta, free, &state);
        let (foreseen, steps) = measured(&theta, &state);
        for (values, step) in state.values.iter_mut().zip(&steps) {
            values.iter_mut().zip(step).for_each(|(value, step)| *value += step);
        }
        let misfit = (foreseen / rows.max(1) as f64).sqrt().max(1.0);
        let held = state.initial.iter().flatten().any(|p| p.prior.is_some());
        let tempered = if held { (misfit / state.misfit).ln().abs() } else { 0.0 };
        state.misfit = misfit;
        if steps.iter().all(Vec::is_empty) || (measured(&theta, &state).0 / foreseen - 1.0).abs() < 1e-3 && tempered < 0.7 {
            break;
        }
    }
    describe(problem, theta, free, state)
}

fn measured_rows<S: Simulator>(problem: &Problem<'_, S>) -> usize {
    problem.blocks().last().map_or(0, |b| b.range.end)
}

/// One run of Levenberg-Marquardt with the initial states' linearization where it is.
fn descend<S: Simulator>(problem: &Problem<'_, S>, theta: Vec<f64>, free: &[usize], state: &State) -> Vec<f64> {
    if free.is_empty() {
        return theta;
    }
    let maps: Vec<Bounded> = free.iter().map(|k| Bounded::new(&problem.simulator.parameters()[*k])).collect();
    let point = DVector::from_iterator(free.len(), free.iter().zip(&maps).map(|(k, map)| map.free(theta[*k])));
    let mut target = Target { problem, state, free, maps, point: point.clone(), theta, cached: None };
    target.set_params(&point);
    let settings = LevenbergMarquardt::new().with_ftol(CONVERGED).with_xtol(1e-6).with_stepbound(1.0).with_patience(10);
    settings.minimize(target).0.theta
}

/// The problem as the solver sees it: unbounded parameters, priors as further residuals.
struct Target<'a, 'b, S: Simulator> {
    problem: &'a Problem<'b, S>,
    state: &'a State,
    free: &'a [usize],
    maps: Vec<Bounded>,
    point: DVector<f64>,
    theta: Vec<f64>,
    cached: Option<DVector<f64>>,
}

impl<S: Simulator> LeastSquaresProblem<f64, Dyn, Dyn> for Target<'_, '_, S> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, point: &DVector<f64>) {
        self.point.copy_from(point);
        for ((k, map), z) in self.free.iter().zip(&self.maps).zip(point.iter()) {
            self.theta[*k] = map.value(*z);
        }
        self.cached = None;
    }

    fn params(&self) -> DVector<f64> {
        self.point.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        let evaluation = self.problem.evaluate(&self.theta, self.state, &[]);
        Some(with_priors(self.problem, &self.theta, self.free, evaluation.residual))
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let evaluation = self.problem.evaluate(&self.theta, self.state, self.free);
        let mut jacobian = jacobian_with_priors(self.problem, self.free, evaluation.jacobian);
        for ((mut column, map), z) in jacobian.column_iter_mut().zip(&self.maps).zip(self.point.iter()) {
            column *= map.slope(*z);
        }
        Some(jacobian)
    }
}

/// The weight of a parameter's prior: none where it is flat.
fn prior_weight<S: Simulator>(problem: &Problem<'_, S>, k: usize) -> f64 {
    problem.simulator.parameters()[k].prior.filter(|std| *std > 0.0).map_or(0.0, |std| 1.0 / std)
}

/// What the prior of parameter `k` adds to the objective at `value`.
pub(super) fn prior_penalty<S: Simulator>(problem: &Problem<'_, S>, k: usize, value: f64) -> f64 {
    let weight = prior_weight(problem, k);
    if weight > 0.0 { (weight * (value - problem.simulator.parameters()[k].nominal)).powi(2) } else { 0.0 }
}

fn with_priors<S: Simulator>(
    problem: &Problem<'_, S>,
    theta: &[f64],
    free: &[usize],
    residual: DVector<f64>,
) -> DVector<f64> {
    let rows = residual.len();
    let mut out = residual.resize_vertically(rows + free.len(), 0.0);
    for (i, k) in free.iter().enumerate() {
        let nominal = problem.simulator.parameters()[*k].nominal;
        let weight = prior_weight(problem, *k);
        out[rows + i] = if weight > 0.0 { weight * (theta[*k] - nominal) } else { 0.0 };
    }
    out
}

fn jacobian_with_priors<S: Simulator>(problem: &Problem<'_, S>, free: &[usize], jacobian: DMatrix<f64>) -> DMatrix<f64> {
    let rows = jacobian.nrows();
    let mut out = jacobian.resize_vertically(rows + free.len(), 0.0);
    for (i, k) in free.iter().enumerate() {
        out[(rows + i, i)] = prior_weight(problem, *k);
    }
    out
}

/// Number of directions in which the columns reach, to within [`RANK_TOLERANCE`] of the longest reach.
fn rank(columns: &DMatrix<f64>) -> usize {
    // Of nothing there are no singular values to ask for.
    if columns.is_empty() {
        return 0;
    }
    let singular = columns.singular_values();
    let strongest = singular.iter().copied().fold(0.0, f64::max);
    singular.iter().filter(|s| **s > RANK_TOLERANCE * strongest && **s > 0.0).count()
}

/// Residuals, derivatives and their consequences at the solution.
fn describe<S: Simulator>(problem: &Problem<'_, S>, theta: Vec<f64>, free: &[usize], state: State) -> Fit {
    let evaluation = problem.evaluate(&theta, &state, free);
    let parameters = problem.simulator.parameters();
    let scales: Vec<f64> = free.iter().map(|k| parameters[*k].scale()).collect();
    let mut scaled = evaluation.jacobian.clone();
    scaled.column_iter_mut().zip(&scales).for_each(|(mut column, scale)| column *= *scale);
    let rank = rank(&scaled);

    let mut information = scaled.tr_mul(&scaled);
    for (i, k) in free.iter().enumerate() {
        information[(i, i)] += (prior_weight(problem, *k) * scales[i]).powi(2);
    }
    let covariance = if free.is_empty() { None } else { information.try_inverse() }
        .map(|inverse| DMatrix::from_fn(free.len(), free.len(), |i, j| inverse[(i, j)] * scales[i] * scales[j]));
    let mut std = vec![0.0; theta.len()];
    for (i, k) in free.iter().enumerate() {
        let variance = covariance.as_ref().map_or(f64::INFINITY, |c| c[(i, i)]);
        std[*k] = if variance >= 0.0 { variance.sqrt() } else { f64::INFINITY };
    }
    let at_bound = free.iter().copied().filter(|k| parameters[*k].at_bound(theta[*k])).collect();
    let prior = free.iter().map(|k| prior_penalty(problem, *k, theta[*k])).sum();
    Fit {
        values: theta,
        std,
        covariance,
        free: free.to_vec(),
        state,
        residual: evaluation.residual,
        jacobian: evaluation.jacobian,
        rank,
        prior,
        at_bound,
    }
}
