//! Normal equations of a fit, made of runs in one pass over them.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::columns::{gram, slices};
use super::initial_state::{Reach, State};
use super::problem::{Followed, Runs};
use crate::sim2real::Parameter;

/// What a step of a fit needs to know of residuals and derivatives, once initial states are moved to where they fit best.
#[derive(Debug, Clone)]
pub(super) struct Normal {
    /// `J'J`.
    pub information: DMatrix<f64>,
    /// `J'r`.
    pub gradient: DVector<f64>,
    /// Sum of squares of what is measured and of what priors of initial states add, before they are moved.
    pub objective: f64,
    /// Number of residuals that are of measurements.
    pub measured: usize,
    /// Sum of squares of what is measured, once initial states are moved.
    pub left: f64,
    /// By how much each part's initial parameters should move, to first order.
    pub initial_step: Vec<DVector<f64>>,
    /// How these steps change with the parameters: to be taken off, one row an initial parameter.
    pub initial_by_parameter: Vec<DMatrix<f64>>,
}

impl Normal {
    /// Of `runs`, which were followed from `state`.
    pub fn new(runs: &Runs, state: &State) -> Self {
        let parts = runs.0.par_iter().zip(&state.initial).zip(&state.values);
        let parts: Vec<Self> = parts.map(|((run, initial), start)| Self::of(run, initial, start, state.misfit)).collect();
        let count = parts.first().map_or(0, |part| part.gradient.len());
        let mut whole = Self {
            information: DMatrix::zeros(count, count),
            gradient: DVector::zeros(count),
            objective: 0.0,
            measured: 0,
            left: 0.0,
            initial_step: Vec::with_capacity(parts.len()),
            initial_by_parameter: Vec::with_capacity(parts.len()),
        };
        for part in parts {
            whole.information += part.information;
            whole.gradient += part.gradient;
            whole.objective += part.objective;
            whole.measured += part.measured;
            whole.left += part.left;
            whole.initial_step.extend(part.initial_step);
            whole.initial_by_parameter.extend(part.initial_by_parameter);
        }
        whole
    }

    /// Of one part alone.
    ///
    /// With an orthonormal basis `Q` of what the initial state can explain, `J'J - (Q'J)'(Q'J)` is what is left of `J'J`: all of it
    /// comes from products of the columns as they are, and none has to be written anew.
    fn of(run: &Followed, initial: &[Parameter], start: &[f64], misfit: f64) -> Self {
        let reach = Reach::new(run, initial, start, misfit);
        let (rows, count, free) = (run.residual.len(), initial.len(), run.derivatives.len());
        let priors = DVector::from_column_slice(reach.priors());
        let derivatives = run.derivatives.iter().map(DVector::as_slice);
        let basis = slices(reach.basis()).into_iter().map(|column| &column[..rows]);
        let columns: Vec<&[f64]> = derivatives.chain(basis).chain([run.residual.as_slice()]).collect();
        let products = gram(&columns);
        let last = free + count;
        let by_parameter = products.view((free, 0), (count, free)).into_owned();
        let measured = products.view((free, last), (count, 1)).into_owned();
        let known = reach.basis().rows(rows, count);
        let along = &measured + known.tr_mul(&priors);
        let squares = products[(last, last)];
        // Of the residuals that are measured, without the priors' below them.
        let within = (products.view((free, free), (count, count)) * &along - 2.0 * &measured).dot(&along);
        Self {
            information: products.view((0, 0), (free, free)) - by_parameter.tr_mul(&by_parameter),
            gradient: products.view((0, last), (free, 1)) - by_parameter.tr_mul(&along),
            objective: squares + priors.norm_squared(),
            measured: rows,
            left: (squares + within).max(0.0),
            initial_step: vec![-reach.solved(&DMatrix::from_columns(&[along])).column(0)],
            initial_by_parameter: vec![reach.solved(&by_parameter)],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::problem::project;
    use super::*;

    #[test]
    fn are_those_of_the_derivatives_that_initial_states_leave() {
        const ROWS: usize = 700;
        let column =
            |salt: usize| DVector::from_fn(ROWS, |i, _| ((i * salt + 31 * salt * salt) % 1_009) as f64 / 500.0 - 1.0);
        let columns = |salts: &[usize]| -> Vec<DVector<f64>> { salts.iter().map(|salt| column(*salt)).collect() };
        let initial =
            [Parameter::new("angle", "rad", 0.1).known_to(0.01), Parameter::new("rate", "rad/s", 0.0).known_to(0.5)];
        let (all, start) = (initial.as_slice(), [0.12, 0.3]);
        for (initial, start) in [(all, start.as_slice()), (&all[..0], &[][..])] {
            let by_initial = columns(&[7, 11][..initial.len()]);
            let run = Followed { residual: column(3), derivatives: columns(&[13, 17, 19]), by_initial };
            let (normal, whole) = (Normal::of(&run, initial, start, 2.0), project(&run, initial, start, 2.0));
            let close = |a: &[f64], b: &[f64]| {
                a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9 * (1.0 + b.abs()))
            };
            assert!(close(normal.information.as_slice(), whole.jacobian.tr_mul(&whole.jacobian).as_slice()));
            assert!(close(normal.gradient.as_slice(), whole.jacobian.tr_mul(&whole.residual).as_slice()));
            assert!(close(
                &[normal.objective, normal.left],
                &[whole.objective, whole.residual.rows(0, ROWS).norm_squared()]
            ));
            assert!(close(normal.initial_step[0].as_slice(), &whole.initial_step));
            assert!(close(normal.initial_by_parameter[0].as_slice(), whole.initial_by_parameter.as_slice()));
            assert_eq!(normal.measured, ROWS);
            // `(A'A)^-1` of the derivatives by the initial state, with the rows of its priors below, at twice their weight.
            let a = DMatrix::from_fn(ROWS + initial.len(), initial.len(), |row, k| match row.checked_sub(ROWS) {
                None => run.by_initial[k][row],
                Some(prior) if prior == k => 2.0 / initial[k].prior.unwrap(),
                Some(_) => 0.0,
            });
            let covariance = a.tr_mul(&a).try_inverse().unwrap();
            let std: Vec<f64> = covariance.diagonal().iter().map(|variance| variance.sqrt()).collect();
            assert!(close(&whole.initial_std, &std), "{:?} {std:?}", whole.initial_std);
        }
    }
}
