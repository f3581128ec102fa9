//! The states from which parts start: what is held of them, and what moving them explains.

use nalgebra::DMatrix;

use super::problem::{Followed, Problem};
use crate::sim2real::{Parameter, Simulator};

/// Initial states of all parts during a fit.
#[derive(Debug, Clone)]
pub struct State {
    /// The initial parameters of each part, with their priors.
    pub initial: Vec<Vec<Parameter>>,
    /// Their values as they stand.
    pub values: Vec<Vec<f64>>,
    /// Root mean square residual that the priors are held against, at least 1: what a wrong model cannot explain must
    /// not bend the initial state, however small the noise is.
    pub misfit: f64,
}

impl State {
    /// All parts at the estimates their recordings give.
    #[must_use]
    pub fn estimated<S: Simulator>(problem: &Problem<'_, S>) -> Self {
        let initial = problem.initial();
        Self::at_nominal(initial)
    }

    /// All parts at the estimates their recordings give, which count for nothing: the fit alone decides.
    #[must_use]
    pub fn unknown<S: Simulator>(problem: &Problem<'_, S>) -> Self {
        let mut initial = problem.initial();
        initial.iter_mut().flatten().filter(|p| !p.frozen()).for_each(|p| p.prior = None);
        Self::at_nominal(initial)
    }

    fn at_nominal(initial: Vec<Vec<Parameter>>) -> Self {
        let values = initial.iter().map(|p| p.iter().map(|p| p.nominal).collect()).collect();
        Self { initial, values, misfit: 1.0 }
    }
}

/// The weight of an initial parameter's prior: none where it is flat.
pub(super) fn weight(parameter: &Parameter, misfit: f64) -> f64 {
    parameter.prior.map_or(0.0, |std| misfit / std.max(1e-12 * parameter.scale()))
}

/// What the initial state of a part can explain of its residuals, within its priors.
///
/// Of `A = [J_i; W]`, where `J_i` are the derivatives by the initial parameters and `W` holds their priors' weights, it keeps the
/// factors `Q` and `R`.
pub(super) struct Reach {
    q: DMatrix<f64>,
    r: DMatrix<f64>,
    /// What the priors add to the residuals: weight times distance from the nominal value.
    priors: Vec<f64>,
}

impl Reach {
    /// Of the part that `run` followed from `start`; `misfit` is what priors are held against.
    pub fn new(run: &Followed, initial: &[Parameter], start: &[f64], misfit: f64) -> Self {
        let (rows, count) = (run.residual.len(), initial.len());
        let weight: Vec<f64> = initial.iter().map(|p| weight(p, misfit)).collect();
        let priors = (0..count).map(|k| weight[k] * (start[k] - initial[k].nominal)).collect();
        if count == 0 {
            return Self { q: DMatrix::zeros(rows, 0), r: DMatrix::zeros(0, 0), priors };
        }
        let mut below = Vec::with_capacity((rows + count) * count);
        for column in &run.by_initial {
            below.extend_from_slice(column.as_slice());
            below.resize(below.len() + count, 0.0);
        }
        let mut a = DMatrix::from_vec(rows + count, count, below);
        (0..count).for_each(|k| a[(rows + k, k)] = weight[k]);
        let qr = a.qr();
        Self { q: qr.q(), r: qr.r(), priors }
    }

    /// What the priors add to the residuals, below those that are measured.
    pub fn priors(&self) -> &[f64] {
        &self.priors
    }

    /// Standard deviations of the initial parameters, as noise and priors leave them where all else is known; infinite for one that
    /// leads nowhere.
    pub fn std(&self) -> Vec<f64> {
        let count = self.priors.len();
        let inverse = self.r.solve_upper_triangular(&DMatrix::identity(count, count));
        (0..count).map(|k| inverse.as_ref().map_or(f64::INFINITY, |inverse| inverse.row(k).norm())).collect()
    }

    /// An orthonormal basis of what it can explain, over the measured rows and then the priors'.
    pub fn basis(&self) -> &DMatrix<f64> {
        &self.q
    }

    /// The same, kept.
    pub fn into_basis(self) -> DMatrix<f64> {
        self.q
    }

    /// The initial parameters that lead so far along the basis; 0 where one of them leads nowhere.
    pub fn solved(&self, along: &DMatrix<f64>) -> DMatrix<f64> {
        if self.priors.is_empty() {
            return DMatrix::zeros(0, along.ncols());
        }
        self.r.solve_upper_triangular(along).unwrap_or_else(|| DMatrix::zeros(along.nrows(), along.ncols()))
    }
}
