//! The residuals of a simulator over parts of recordings, and how they move with its parameters.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::columns::{products, slices, take_out};
use super::initial_state::{Reach, State, weight};
use crate::sim2real::residual::{Expected, residuals};
use crate::sim2real::{ChannelWeight, Parameter, Part, Seed, Simulator, Thetas};

/// Step of a finite difference, as a part of a parameter's scale: wide enough to smooth over the moments at which dry
/// friction lets go, which move by whole steps of integration.
pub(super) const DIFFERENCE: f64 = 1e-4;

/// Most lanes of one run.
const LANES: usize = 16;

/// A simulator beside what it should explain.
///
/// The states from which parts start are no parameters of the fit: at each evaluation they are solved for, to first
/// order, within their priors, and the residuals are what is left then (variable projection, Golub & Pereyra 1973).
#[derive(Debug)]
pub struct Problem<'a, S: Simulator> {
    /// The simulator.
    pub simulator: &'a S,
    /// What it should explain.
    pub parts: &'a [Part<'a, S::Stimulus>],
    /// Noise of each channel.
    pub weights: &'a [ChannelWeight],
    /// Randomness of mechanisms that have any.
    pub seed: Seed,
}

/// The rows of a residual vector that belong to one channel of one part.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Block {
    /// Number of the part.
    pub part: usize,
    /// The channel.
    pub channel: String,
    /// Where its values are in the residual vector.
    pub range: Range<usize>,
    /// The rows of the recording they belong to.
    pub rows: Vec<usize>,
}

/// Residuals in units of the noise, and where they come from.
#[derive(Debug, Clone)]
pub struct Evaluation {
    /// Measured minus simulated over noise, for all [`Block`]s; then what priors of initial states add.
    pub residual: DVector<f64>,
    /// Derivatives of the residual, one column a parameter asked for.
    pub jacobian: DMatrix<f64>,
    /// Number of residuals that are of measurements.
    pub measured: usize,
    /// By how much each part's initial parameters should move, to first order.
    pub initial_step: Vec<Vec<f64>>,
    /// How these steps change with the parameters asked for: to be taken off, one row an initial parameter.
    pub initial_by_parameter: Vec<DMatrix<f64>>,
    /// Standard deviations of each part's initial parameters, as noise and priors leave them where all else is known.
    pub initial_std: Vec<Vec<f64>>,
    /// What each part's initial parameters can explain: an orthonormal basis over its measured rows, then their priors'.
    pub initial_basis: Vec<DMatrix<f64>>,
    /// Sum of squares of what is measured and of what priors of initial states add, before they are moved.
    pub objective: f64,
}

/// One part followed: residuals and their derivatives, before what initial states explain is taken out.
#[derive(Debug, Clone)]
pub(super) struct Followed {
    pub residual: DVector<f64>,
    pub derivatives: Vec<DVector<f64>>,
    pub by_initial: Vec<DVector<f64>>,
}

/// All parts followed.
#[derive(Debug, Clone)]
pub(super) struct Runs(pub Vec<Followed>);

/// One part evaluated: residuals, and one column a perturbed parameter.
pub(super) struct Piece {
    pub residual: DVector<f64>,
    pub jacobian: DMatrix<f64>,
    pub initial_step: Vec<f64>,
    pub initial_by_parameter: DMatrix<f64>,
    pub initial_std: Vec<f64>,
    initial_basis: DMatrix<f64>,
    pub objective: f64,
}

impl<S: Simulator> Problem<'_, S> {
    /// The initial parameters of every part.
    #[must_use]
    pub fn initial(&self) -> Vec<Vec<Parameter>> {
        self.parts.iter().map(|p| self.simulator.initial_parameters(p.recording, p.start)).collect()
    }

    /// Where the residuals of each channel of each part are.
    #[must_use]
    pub fn blocks(&self) -> Vec<Block> {
        let mut blocks = Vec::new();
        let mut at = 0;
        for (number, part) in self.parts.iter().enumerate() {
            for weight in self.weights {
                let Some(measured) = part.recording.channel(&weight.channel) else { continue };
                let rows: Vec<usize> = part.rows.clone().filter(|row| measured.samples[*row].is_some()).collect();
                let range = at..at + rows.len();
                at = range.end;
                blocks.push(Block { part: number, channel: weight.channel.clone(), range, rows });
            }
        }
        blocks
    }

    /// Residuals at `theta` (the simulator's parameters) and their derivatives by the parameters numbered in `free`.
    ///
    /// The parts start from `state`, to first order moved to where they are best started from.
    #[must_use]
    pub fn evaluate(&self, theta: &[f64], state: &State, free: &[usize]) -> Evaluation {
        self.projected(&self.followed(theta, state, free), state)
    }

    /// Follows all parts, and their derivatives by the parameters numbered in `free` and by initial states.
    pub(super) fn followed(&self, theta: &[f64], state: &State, free: &[usize]) -> Runs {
        self.followed_beside(vec![None; self.parts.len()], theta, state, free)
    }

    /// The same where residuals at `theta` and `state` may be known already, part by part.
    pub(super) fn followed_beside(
        &self,
        known: Vec<Option<DVector<f64>>>,
        theta: &[f64],
        state: &State,
        free: &[usize],
    ) -> Runs {
        let parts = self.parts.par_iter().zip(&state.initial).zip(&state.values).zip(known);
        Runs(
            parts.map(|(((part, initial), start), known)| self.follow(part, (theta, start), initial, free, known)).collect(),
        )
    }

    /// What is left of `runs` once the initial states of `state`, from which they were followed, are moved to where they fit
    /// best: another misfit weighs their priors anew, and needs no other runs.
    pub(super) fn projected(&self, runs: &Runs, state: &State) -> Evaluation {
        let parts = runs.0.par_iter().zip(&state.initial).zip(&state.values);
        let pieces: Vec<Piece> = parts.map(|((run, initial), start)| project(run, initial, start, state.misfit)).collect();
        Self::assemble(pieces)
    }

    /// Lays the pieces one after the other: all measured residuals first, then all prior rows.
    fn assemble(pieces: Vec<Piece>) -> Evaluation {
        let objective = pieces.iter().map(|p| p.objective).sum();
        let measured: Vec<usize> = pieces.iter().map(|p| p.residual.len() - p.initial_step.len()).collect();
        let (residual, jacobian) = match pieces.as_slice() {
            [_] => (DVector::zeros(0), DMatrix::zeros(0, 0)),
            pieces => stacked(pieces, &measured),
        };
        let alone = pieces.len() == 1;
        let count = pieces.len();
        let mut whole = Evaluation {
            residual,
            jacobian,
            measured: measured.iter().sum(),
            initial_step: Vec::with_capacity(count),
            initial_by_parameter: Vec::with_capacity(count),
            initial_std: Vec::with_capacity(count),
            initial_basis: Vec::with_capacity(count),
            objective,
        };
        for piece in pieces {
            // One alone is laid already.
            if alone {
                (whole.residual, whole.jacobian) = (piece.residual, piece.jacobian);
            }
            whole.initial_step.push(piece.initial_step);
            whole.initial_by_parameter.push(piece.initial_by_parameter);
            whole.initial_std.push(piece.initial_std);
            whole.initial_basis.push(piece.initial_basis);
        }
        whole
    }

    /// The nominal values of the simulator's parameters.
    #[must_use]
    pub fn nominal(&self) -> Vec<f64> {
        self.simulator.parameters().iter().map(|p| p.nominal).collect()
    }

    /// Measured residuals at several points of the simulator's parameters, from the same initial states: one vector a
    /// point, in the order of [`Problem::blocks`], with what `basis` explains taken out, part by part.
    #[must_use]
    pub fn residuals(&self, thetas: &[Vec<f64>], state: &State, basis: &[DMatrix<f64>]) -> Vec<DVector<f64>> {
        let of_part = |(number, part): (usize, &Part<'_, S::Stimulus>)| -> Vec<DVector<f64>> {
            let lanes: Vec<Vec<f64>> =
                thetas.iter().map(|theta| theta.iter().chain(&state.values[number]).copied().collect()).collect();
            let known = slices(&basis[number]);
            self.followed_by(part, &lanes, |_, mut residual| {
                // The priors' rows of the basis meet zeros: only its measured rows count.
                let known: Vec<&[f64]> = known.iter().map(|column| &column[..residual.len()]).collect();
                let along = products(&known, &[residual.as_slice()]);
                take_out(&mut [residual.as_mut_slice()], &known, &along);
                residual
            })
        };
        let mut parts: Vec<Vec<DVector<f64>>> = self.parts.par_iter().enumerate().map(of_part).collect();
        if let [alone] = parts.as_mut_slice() {
            return std::mem::take(alone);
        }
        (0..thetas.len()).map(|k| joined(parts.iter().map(|part| &part[k]))).collect()
    }

    /// Sums of squared residuals at several points, priors of initial states included: lanes of the same runs.
    #[must_use]
    pub fn objectives(&self, points: &[(Vec<f64>, State)]) -> Vec<f64> {
        self.tried(points).0
    }

    /// The same, with the residuals: of each part one vector a point.
    pub(super) fn tried(&self, points: &[(Vec<f64>, State)]) -> (Vec<f64>, Vec<Vec<DVector<f64>>>) {
        let of_part = |(number, part): (usize, &Part<'_, S::Stimulus>)| -> (Vec<f64>, Vec<DVector<f64>>) {
            let lanes: Vec<Vec<f64>> =
                points.iter().map(|(theta, state)| theta.iter().chain(&state.values[number]).copied().collect()).collect();
            let prior = |state: &State| -> f64 {
                let (initial, values) = (&state.initial[number], &state.values[number]);
                initial.iter().zip(values).map(|(p, v)| (weight(p, state.misfit) * (v - p.nominal)).powi(2)).sum()
            };
            let mut sums = Vec::with_capacity(points.len());
            let followed = self.followed_by(part, &lanes, |_, residual| {
                sums.push(residual.norm_squared());
                residual
            });
            sums.iter_mut().zip(points).for_each(|(sum, (_, state))| *sum += prior(state));
            (sums, followed)
        };
        let (sums, residuals): (Vec<Vec<f64>>, Vec<_>) = self.parts.par_iter().enumerate().map(of_part).unzip();
        ((0..points.len()).map(|k| sums.iter().map(|values| values[k]).sum()).collect(), residuals)
    }

    /// Follows `part` from `at`, a point of the simulator's parameters and one of its initial ones, and its derivatives; what is left
    /// at that point may be `known`.
    fn follow(
        &self,
        part: &Part<'_, S::Stimulus>,
        at: (&[f64], &[f64]),
        initial: &[Parameter],
        free: &[usize],
        known: Option<DVector<f64>>,
    ) -> Followed {
        let (theta, start) = at;
        let parameters = self.simulator.parameters();
        let steps: Vec<(usize, f64)> = free
            .iter()
            .map(|k| (*k, difference(&parameters[*k], theta[*k])))
            .chain(initial.iter().enumerate().map(|(k, p)| (theta.len() + k, difference(p, start[k]))))
            .collect();
        let base: Vec<f64> = theta.iter().chain(start).copied().collect();
        let mut lanes = if known.is_some() { Vec::new() } else { vec![base.clone()] };
        for (k, step) in &steps {
            let mut lane = base.clone();
            lane[*k] += step;
            lanes.push(lane);
        }
        let mut residual = known;
        let first = lanes.len() - steps.len();
        let mut derivatives = self.followed_by(part, &lanes, |lane, mut moved| match &residual {
            Some(base) if lane >= first => {
                let step = steps[lane - first].1;
                moved.zip_apply(base, |moved, base| *moved = (*moved - base) / step);
                moved
            }
            _ => {
                residual = Some(moved);
                DVector::zeros(0)
            }
        });
        derivatives.drain(..first);
        let by_initial = derivatives.split_off(free.len());
        Followed { residual: residual.unwrap_or_else(|| DVector::zeros(0)), derivatives, by_initial }
    }

    /// What `finish` makes of the residuals of `part` in each of `lanes`, as soon as they are there.
    ///
    /// Some lanes are followed at a time: they take room, and more gain no speed.
    fn followed_by(
        &self,
        part: &Part<'_, S::Stimulus>,
        lanes: &[Vec<f64>],
        mut finish: impl FnMut(usize, DVector<f64>) -> DVector<f64>,
    ) -> Vec<DVector<f64>> {
        let mut all = Vec::with_capacity(lanes.len());
        let expected = Expected::of(part, self.weights);
        let runs = lanes.len().div_ceil(LANES).max(1);
        for some in lanes.chunks(lanes.len().div_ceil(runs).max(1)) {
            let runs =
                self.simulator.rollout_measured(&Thetas::from_lanes(some), part.recording, part.followed(), self.seed);
            for run in runs {
                let residual = DVector::from_vec(residuals(&expected, run));
                all.push(finish(all.len(), residual));
            }
        }
        all
    }
}

/// A step for the finite difference by `parameter` at `value`, towards the inside of its bounds.
fn difference(parameter: &Parameter, value: f64) -> f64 {
    let step = DIFFERENCE * parameter.scale().max(0.1 * if value.is_finite() { value.abs() } else { 0.0 });
    if value + step > parameter.upper { -step } else { step }
}

/// Residuals and derivatives of several pieces, of which so many rows are `measured`, one after the other.
fn stacked(pieces: &[Piece], measured: &[usize]) -> (DVector<f64>, DMatrix<f64>) {
    let columns = pieces.first().map_or(0, |p| p.jacobian.ncols());
    let total: usize = pieces.iter().map(|p| p.residual.len()).sum();
    let mut residual = DVector::zeros(total);
    let mut jacobian = DMatrix::zeros(total, columns);
    let (mut at, mut prior_at) = (0, measured.iter().sum());
    for (piece, count) in pieces.iter().zip(measured.iter().copied()) {
        let priors = piece.initial_step.len();
        for (from, to, rows) in [(0, at, count), (count, prior_at, priors)] {
            residual.rows_mut(to, rows).copy_from(&piece.residual.rows(from, rows));
            jacobian.rows_mut(to, rows).copy_from(&piece.jacobian.rows(from, rows));
        }
        at += count;
        prior_at += priors;
    }
    (residual, jacobian)
}

/// One vector after the other.
fn joined<'a>(parts: impl Iterator<Item = &'a DVector<f64>> + Clone) -> DVector<f64> {
    let mut all = Vec::with_capacity(parts.clone().map(DVector::len).sum());
    parts.for_each(|part| all.extend_from_slice(part.as_slice()));
    DVector::from_vec(all)
}

/// Takes out of residual and derivatives what the initial state explains, within its priors.
///
/// With `A = [J_i; W]`, where `W` holds the priors' weights, the best step of the initial state leaves
/// `b - Q Q' b` of `b = [r; W d]`, and likewise of every column of the Jacobian.
pub(super) fn project(run: &Followed, initial: &[Parameter], start: &[f64], misfit: f64) -> Piece {
    let Followed { residual, derivatives, .. } = run;
    let (rows, count) = (residual.len(), initial.len());
    let reach = Reach::new(run, initial, start, misfit);
    let mut b = DVector::from_vec([residual.as_slice(), reach.priors()].concat());
    let objective = b.norm_squared();
    let mut below = Vec::with_capacity((rows + count) * derivatives.len());
    for column in derivatives {
        below.extend_from_slice(column.as_slice());
        below.resize(below.len() + count, 0.0);
    }
    let mut jacobian = DMatrix::from_vec(rows + count, derivatives.len(), below);
    let basis = slices(reach.basis());
    let along = products(&basis, &[b.as_slice()]);
    let initial_step = (-reach.solved(&along)).iter().copied().collect();
    take_out(&mut [b.as_mut_slice()], &basis, &along);
    let along = products(&basis, &slices(&jacobian));
    let initial_by_parameter = reach.solved(&along);
    take_out(&mut jacobian.as_mut_slice().chunks_mut((rows + count).max(1)).collect::<Vec<_>>(), &basis, &along);
    Piece {
        residual: b,
        jacobian,
        initial_step,
        initial_by_parameter,
        initial_std: reach.std(),
        objective,
        initial_basis: reach.into_basis(),
    }
}
