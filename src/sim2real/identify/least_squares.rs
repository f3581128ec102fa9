//! Output-error fits by Levenberg-Marquardt.
//!
//! The solver is our own because its trial points and finite differences are lanes of the same runs, and because the
//! initial states of all parts move along with the parameters at every step (variable projection), which a general solver
//! cannot know of.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::columns::{gram, slices};
use super::initial_state::State;
use super::normal::Normal;
use super::problem::{DIFFERENCE, Evaluation, Problem, Runs};
use crate::sim2real::{Parameter, Simulator};

/// Directions in which the data move the parameters less than this part of the strongest count as not determined:
/// derivatives are known no better than the step of their finite differences.
const RANK_TOLERANCE: f64 = 3.0 * DIFFERENCE;

/// A fit ends when a step lowers the objective by less than this part of it: a thousandth of what the weakest evidence
/// that counts is worth.
const CONVERGED: f64 = 1e-5;
/// Damping of a first step, relative to the curvature (Marquardt, SIAM Journal 11 (1963)).
const DAMPING: f64 = 1e-2;
/// Dampings tried side by side at every step, relative to the last one that did best.
const SPREAD: [f64; 3] = [0.05, 1.0, 20.0];
/// With more damping than this a step is none.
const STUCK: f64 = 1e8;

/// What a fit found.
#[derive(Debug, Clone)]
pub struct Fit {
    /// Values of all of the simulator's parameters, the fixed ones among them.
    pub values: Vec<f64>,
    /// Their standard deviations as the noise alone makes them; 0 for fixed ones, infinite for those not determined.
    pub std: Vec<f64>,
    /// Covariance of the free parameters that the output depends on smoothly, in their order, as noise and priors make it;
    /// none where neither data nor priors determine them all.
    pub covariance: Option<DMatrix<f64>>,
    /// Numbers of the parameters that were free.
    pub free: Vec<usize>,
    /// Initial states of all parts.
    pub state: State,
    /// Their standard deviations as noise and priors make them; infinite for those not determined.
    pub initial_std: Vec<Vec<f64>>,
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

    /// Correlations of all of the simulator's parameters, which are `parameters`: 1 with themselves, and 0 where the fit does not
    /// tell.
    #[must_use]
    pub fn correlation(&self, parameters: &[Parameter]) -> DMatrix<f64> {
        let count = self.values.len();
        let mut all = DMatrix::identity(count, count);
        let Some(covariance) = &self.covariance else { return all };
        // Those that the output jumps with have no covariance.
        let smooth: Vec<usize> = match self.free.len() == covariance.nrows() {
            true => self.free.clone(),
            false => self.free.iter().copied().filter(|k| parameters[*k].smooth).collect(),
        };
        if smooth.len() != covariance.nrows() {
            return all;
        }
        for (i, row) in smooth.iter().enumerate() {
            for (j, column) in smooth.iter().enumerate().filter(|(j, _)| *j != i) {
                let found = covariance[(i, j)] / (covariance[(i, i)] * covariance[(j, j)]).sqrt();
                all[(*row, *column)] = if found.is_finite() { found.clamp(-1.0, 1.0) } else { 0.0 };
            }
        }
        all
    }
}

/// Fits the parameters numbered in `free`, from `start`, by Levenberg-Marquardt within their bounds and priors.
#[must_use]
pub fn fit_smooth<S: Simulator>(problem: &Problem<'_, S>, start: &[f64], free: &[usize], state: &State) -> Fit {
    let mut descent = Descent::new(problem, start, free, state);
    descent.run(Effort::Thorough.steps());
    descent.freed(Effort::Thorough.steps()).fit()
}

/// How far a fit goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Effort {
    /// As far as it takes to see which of several hypotheses lead somewhere.
    Brief,
    /// To its end.
    Thorough,
}

impl Effort {
    fn steps(self) -> usize {
        match self {
            Self::Brief => 3,
            Self::Thorough => 40,
        }
    }
}

/// Fits from the best of several starts: all make a few steps, and the one that is then lowest goes on to the end, with
/// any that comes near it.
#[must_use]
pub fn fit_from<S: Simulator>(
    problem: &Problem<'_, S>,
    starts: &[Vec<f64>],
    free: &[usize],
    state: &State,
    effort: Effort,
) -> Fit {
    let steps = effort.steps();
    let mut descents: Vec<Descent<'_, '_, S>> = starts
        .par_iter()
        .map(|start| {
            let mut descent = Descent::new(problem, start, free, state);
            if starts.len() > 1 {
                descent.run(PROBE);
                descent.run_while_falling(PROBE, STEEP);
            } else {
                descent.run(steps);
            }
            descent
        })
        .collect();
    let lowest = descents.iter().map(|d| d.objective).fold(f64::INFINITY, f64::min);
    match effort {
        Effort::Brief => descents.retain(|d| d.objective <= lowest),
        Effort::Thorough => descents.retain(|d| d.objective <= NEAR * lowest),
    }
    if starts.len() > 1 {
        descents.par_iter_mut().for_each(|d| d.run(steps));
    }
    if effort == Effort::Brief {
        descents.par_iter_mut().for_each(|d| d.run_while_falling(Effort::Thorough.steps(), FALLING));
    }
    match descents.into_iter().min_by(|a, b| a.objective.total_cmp(&b.objective)) {
        Some(best) if effort == Effort::Thorough => best.freed(steps).fit(),
        Some(best) => best.fit(),
        None => fit_smooth(problem, &problem.nominal(), free, state),
    }
}

/// Steps that tell which starts lead somewhere; one that takes away this part of what is left with each is given as many again.
const PROBE: usize = 3;
const STEEP: f64 = 0.25;
/// A start that stands at most this much higher than the best is followed too.
const NEAR: f64 = 1.05;

/// A brief fit goes on while each step takes away at least this part of what is left: it has not come to what it can do.
const FALLING: f64 = 0.1;

/// A fit that leaves no more than this many times the square of the noise has come to its end; ...
const STANDS: f64 = 1.1;
/// ... one that does not makes some other steps, and more while each takes away this part of what is left, ...
const SLOWLY: f64 = 0.01;
/// ... and goes on from there where so little is left of that, beside the noise.
const FREED: f64 = 0.5;

/// A fit under way.
struct Descent<'a, 'b, S: Simulator> {
    problem: &'a Problem<'b, S>,
    free: &'a [usize],
    theta: Vec<f64>,
    state: State,
    /// What was followed at `theta` and `state`, and its normal equations; of where the last step led, once that is asked for.
    runs: Runs,
    normal: Normal,
    /// What is left where the last step led, part by part, as long as derivatives there have not been asked for.
    left: Option<Vec<Option<DVector<f64>>>>,
    /// Sum of squares there, priors of the parameters included.
    objective: f64,
    damping: f64,
    /// Whether the steps of initial states are damped too.
    holds_back: bool,
    /// The part of the objective that the last step took away.
    fell: f64,
    ended: bool,
}

impl<'a, 'b, S: Simulator> Descent<'a, 'b, S> {
    fn new(problem: &'a Problem<'b, S>, start: &[f64], free: &'a [usize], state: &State) -> Self {
        let parameters = problem.simulator.parameters();
        let theta: Vec<f64> = start.iter().zip(parameters).map(|(value, p)| value.clamp(p.lower, p.upper)).collect();
        let state = state.clone();
        let runs = problem.followed(&theta, &state, free);
        let normal = Normal::new(&runs, &state);
        let (left, objective, damping, fell) = (None, 0.0, DAMPING, 0.0);
        let (holds_back, ended) = (false, false);
        let mut descent =
            Self { problem, free, theta, state, runs, normal, left, objective, damping, holds_back, fell, ended };
        descent.temper();
        descent
    }

    /// Follows the derivatives where the last step led. Of most starts nobody asks how they would go on.
    fn settle(&mut self) {
        if let Some(left) = self.left.take() {
            self.runs = self.problem.followed_beside(left, &self.theta, &self.state, self.free);
            self.normal = Normal::new(&self.runs, &self.state);
            self.temper();
        }
    }

    /// Holds the priors of initial states against the misfit as it is now.
    fn temper(&mut self) {
        let misfit = (self.normal.left / self.normal.measured.max(1) as f64).sqrt().max(1.0);
        // Within a tenth nothing is gained by changing what is being minimized.
        if (misfit / self.state.misfit).ln().abs() > 0.1 {
            self.state.misfit = misfit;
            self.normal = Normal::new(&self.runs, &self.state);
        }
        self.objective = self.normal.objective + self.prior(&self.theta);
    }

    /// What priors add, held against the misfit as it is: beside an error far above the noise they would count for nothing, and
    /// a twin that lacks something be bent out of all likeness.
    fn prior(&self, theta: &[f64]) -> f64 {
        let penalty: f64 = self.free.iter().map(|k| prior_penalty(self.problem, *k, theta[*k])).sum();
        self.state.misfit.powi(2) * penalty
    }

    /// Makes at most `steps` more steps.
    fn run(&mut self, steps: usize) {
        let mut small = 0;
        for _ in 0..steps {
            if self.ended {
                return;
            }
            self.settle();
            let before = self.objective;
            self.step();
            // One small step may be the bend of a valley; two are its end.
            small = if self.objective > before * (1.0 - CONVERGED) { small + 1 } else { 0 };
            self.ended |= small >= 2;
        }
    }

    /// Makes at most `steps` more steps, and ends with the first that does not take away this part of what is left.
    fn run_while_falling(&mut self, steps: usize, least: f64) {
        for _ in 0..steps {
            if self.ended || self.fell < least {
                return;
            }
            self.step();
        }
    }

    /// Goes on from where it came to, if that is far from an end: where dry friction, a stop or a pendulum near its top make something else
    /// of the step that is best for initial states of a linear plant, no damping of the parameters alone leads anywhere.
    ///
    /// What is gained a little at a time that way is as often the wrong valley's as the right one's: it counts where it is most of what
    /// was left.
    fn freed(mut self, steps: usize) -> Self {
        if self.objective <= STANDS * self.normal.measured as f64 || self.state.values.iter().all(Vec::is_empty) {
            return self;
        }
        self.settle();
        let (theta, state, runs, normal) = (self.theta.clone(), self.state.clone(), self.runs.clone(), self.normal.clone());
        let (holds_back, damping, fell, ended) = (true, 1.0, 0.0, false);
        let mut other = Self { theta, state, runs, normal, holds_back, damping, fell, ended, left: None, ..self };
        other.run(PROBE + 1);
        other.run_while_falling(steps, SLOWLY);
        let noise = self.normal.measured as f64;
        if other.objective - noise < FREED * (self.objective - noise) {
            (other.holds_back, other.ended) = (false, false);
            other.run(steps);
            self = other;
        }
        self
    }

    /// One step: the best of several dampings, or none where more damping does not help either.
    fn step(&mut self) {
        self.settle();
        let (information, gradient) = self.normal_equations();
        let held = self.held(&gradient);
        while self.damping < STUCK {
            let points: Vec<(Vec<f64>, State)> =
                SPREAD.iter().map(|s| self.moved(&information, &gradient, &held, s * self.damping)).collect();
            let (values, residuals) = self.problem.tried(&points);
            let best = values
                .iter()
                .zip(&points)
                .map(|(value, (theta, _))| value + self.prior(theta))
                .enumerate()
                .min_by(|a, b| a.1.total_cmp(&b.1));
            if let Some((k, value)) = best.filter(|(_, value)| *value < self.objective) {
                let Some((theta, state)) = points.into_iter().nth(k) else { return };
                self.fell = 1.0 - value / self.objective;
                // After a step too small to matter no other follows.
                self.ended |= self.fell <= 0.1 * CONVERGED;
                (self.theta, self.state) = (theta, state);
                self.damping = (self.damping * SPREAD[k]).max(1e-9);
                // What is left there has been followed already.
                self.left = Some(residuals.into_iter().map(|part| part.into_iter().nth(k)).collect());
                self.objective = value;
                return;
            }
            self.damping *= SPREAD[2] * SPREAD[2];
        }
        self.fell = 0.0;
        self.ended = true;
    }

    /// `J'J` and `J'r`, priors of the parameters included.
    fn normal_equations(&self) -> (DMatrix<f64>, DVector<f64>) {
        let (mut information, mut gradient) = (self.normal.information.clone(), self.normal.gradient.clone());
        for (i, k) in self.free.iter().enumerate() {
            let weight = (self.state.misfit * prior_weight(self.problem, *k)).powi(2);
            information[(i, i)] += weight;
            if weight > 0.0 {
                gradient[i] += weight * (self.theta[*k] - self.problem.simulator.parameters()[*k].nominal);
            }
        }
        (information, gradient)
    }

    /// Which free parameters stand at a bound that the gradient pushes them against, or move nothing.
    fn held(&self, gradient: &DVector<f64>) -> Vec<bool> {
        let parameters = self.problem.simulator.parameters();
        self.free
            .iter()
            .enumerate()
            .map(|(i, k)| {
                let (value, p) = (self.theta[*k], &parameters[*k]);
                value <= p.lower && gradient[i] >= 0.0 || value >= p.upper && gradient[i] <= 0.0
            })
            .collect()
    }

    /// Where a step of this damping leads, initial states and all: these to what is best there of a linear plant, or held back as the
    /// parameters are.
    fn moved(&self, information: &DMatrix<f64>, gradient: &DVector<f64>, held: &[bool], damping: f64) -> (Vec<f64>, State) {
        let parameters = self.problem.simulator.parameters();
        let step = damped_step(information, gradient, held, damping);
        let mut theta = self.theta.clone();
        let mut made = DVector::zeros(self.free.len());
        for (i, k) in self.free.iter().enumerate() {
            theta[*k] = (theta[*k] + step[i]).clamp(parameters[*k].lower, parameters[*k].upper);
            made[i] = theta[*k] - self.theta[*k];
        }
        let mut state = self.state.clone();
        let own = if self.holds_back { 1.0 / (1.0 + damping) } else { 1.0 };
        for (part, values) in state.values.iter_mut().enumerate() {
            let along = &self.normal.initial_by_parameter[part] * &made;
            for ((value, step), along) in values.iter_mut().zip(self.normal.initial_step[part].iter()).zip(along.iter()) {
                *value += own * step - along;
            }
        }
        (theta, state)
    }

    /// Residuals, derivatives and their consequences where the descent has come.
    fn fit(mut self) -> Fit {
        self.settle();
        let Self { problem, free, theta, state, runs, .. } = self;
        let evaluation = problem.projected(&runs, &state);
        let parameters = problem.simulator.parameters();
        let scales: Vec<f64> = free.iter().map(|k| parameters[*k].scale()).collect();
        let mut scaled = evaluation.jacobian.clone();
        scaled.column_iter_mut().zip(&scales).for_each(|(mut column, scale)| column *= *scale);
        let mut information = gram(&slices(&scaled));
        let rank = rank(&information);
        for (i, k) in free.iter().enumerate() {
            information[(i, i)] += (state.misfit * prior_weight(problem, *k) * scales[i]).powi(2);
        }
        let covariance = if free.is_empty() { None } else { information.try_inverse() }
            .map(|inverse| DMatrix::from_fn(free.len(), free.len(), |i, j| inverse[(i, j)] * scales[i] * scales[j]));
        let mut std = vec![0.0; theta.len()];
        for (i, k) in free.iter().enumerate() {
            let variance = covariance.as_ref().map_or(f64::INFINITY, |c| c[(i, i)]);
            std[*k] = if variance >= 0.0 { variance.sqrt() } else { f64::INFINITY };
        }
        let at_bound = free.iter().copied().filter(|k| parameters[*k].at_bound(theta[*k])).collect();
        let penalty: f64 = free.iter().map(|k| prior_penalty(problem, *k, theta[*k])).sum();
        let prior = state.misfit.powi(2) * penalty;
        let initial_std = initial_std(&evaluation, covariance.as_ref());
        Fit {
            values: theta,
            std,
            covariance,
            free: free.to_vec(),
            state,
            initial_std,
            residual: evaluation.residual,
            jacobian: evaluation.jacobian,
            rank,
            prior,
            at_bound,
        }
    }
}

/// Standard deviations of initial states: what is left open where all else is known, and what `covariance` of the rest adds.
fn initial_std(evaluation: &Evaluation, covariance: Option<&DMatrix<f64>>) -> Vec<Vec<f64>> {
    let parts = evaluation.initial_std.iter().zip(&evaluation.initial_by_parameter);
    parts
        .map(|(alone, by_parameter)| {
            let added = |row: usize| {
                let row = by_parameter.row(row);
                covariance.map_or(0.0, |c| (row * c).dot(&row).max(0.0))
            };
            alone.iter().enumerate().map(|(row, alone)| (alone * alone + added(row)).sqrt()).collect()
        })
        .collect()
}

/// `-(H + damping diag H)^-1 g` over the parameters that are not held, in units in which the diagonal of `H` is 1.
fn damped_step(information: &DMatrix<f64>, gradient: &DVector<f64>, held: &[bool], damping: f64) -> DVector<f64> {
    let count = gradient.len();
    let length: Vec<f64> = (0..count).map(|i| information[(i, i)].sqrt()).map(|l| if l > 0.0 { l } else { 1.0 }).collect();
    let loose = |i: usize| !held[i] && information[(i, i)] > 0.0;
    let matrix = DMatrix::from_fn(count, count, |i, j| match (i == j, loose(i) && loose(j)) {
        (true, true) => 1.0 + damping,
        (true, false) => 1.0,
        (false, true) => information[(i, j)] / (length[i] * length[j]),
        (false, false) => 0.0,
    });
    let right = DVector::from_fn(count, |i, _| if loose(i) { -gradient[i] / length[i] } else { 0.0 });
    match matrix.cholesky() {
        Some(cholesky) => cholesky.solve(&right).zip_map(&DVector::from_vec(length), |step, length| step / length),
        None => DVector::zeros(count),
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

/// Number of directions in which columns with this Gram matrix reach, to within [`RANK_TOLERANCE`] of the longest reach.
fn rank(gram: &DMatrix<f64>) -> usize {
    // Of nothing there are no eigenvalues to ask for.
    if gram.is_empty() || gram.iter().any(|v| !v.is_finite()) {
        return 0;
    }
    let squared = gram.clone().symmetric_eigenvalues();
    let strongest = squared.iter().copied().fold(0.0, f64::max);
    squared.iter().filter(|s| **s > RANK_TOLERANCE * RANK_TOLERANCE * strongest && **s > 0.0).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_unsure_of_the_parameters_adds_to_initial_states() {
        let evaluation = Evaluation {
            residual: DVector::zeros(0),
            jacobian: DMatrix::zeros(0, 0),
            measured: 0,
            initial_step: Vec::new(),
            initial_by_parameter: vec![DMatrix::from_row_slice(2, 2, &[2.0, 0.0, 1.0, 1.0])],
            initial_std: vec![vec![3.0, f64::INFINITY]],
            initial_basis: Vec::new(),
            objective: 0.0,
        };
        // A step of 2 for each of the first parameter, which is known to 2.
        let covariance = DMatrix::from_row_slice(2, 2, &[4.0, 1.0, 1.0, 9.0]);
        assert_eq!(initial_std(&evaluation, Some(&covariance)), [[5.0, f64::INFINITY]]);
        assert_eq!(initial_std(&evaluation, None), [[3.0, f64::INFINITY]]);
    }
}
