//! Fits of what has no gradient: parameters on which the output jumps.

use cobyla::{RhoBeg, StopTols, minimize as cobyla_minimize};

use super::least_squares::{Fit, fit_smooth};
use super::problem::{Problem, State};
use crate::sim2real::Simulator;

/// An improvement smaller than this part of the objective is none: on a plateau the first point found stays.
const WORTHWHILE: f64 = 1e-6;

/// Minimizes `objective` from `start` within `bounds`, without derivatives (COBYLA, Powell 1994), with first steps of
/// about `scale`, until steps are a thousandth of that or `evaluations` are spent. Gives the best point seen and its
/// value.
pub fn minimize(
    objective: impl Fn(&[f64]) -> f64,
    start: &[f64],
    bounds: &[(f64, f64)],
    scale: &[f64],
    evaluations: usize,
) -> (Vec<f64>, f64) {
    let best = std::cell::RefCell::new((start.to_vec(), objective(start)));
    let scaled = |x: &[f64]| -> Vec<f64> {
        x.iter().zip(scale).zip(start).zip(bounds).map(|(((x, s), start), b)| (start + x * s).clamp(b.0, b.1)).collect()
    };
    let traced = |x: &[f64], (): &mut ()| {
        let point = scaled(x);
        let value = objective(&point);
        let mut best = best.borrow_mut();
        if value < best.1 * (1.0 - WORTHWHILE) {
            *best = (point, value);
        }
        value
    };
    let free: Vec<(f64, f64)> =
        bounds.iter().zip(scale).zip(start).map(|((b, s), start)| ((b.0 - start) / s, (b.1 - start) / s)).collect();
    let no_constraints: [fn(&[f64], &mut ()) -> f64; 0] = [];
    // How it stopped does not matter: what it saw at its best is kept either way.
    let _ = cobyla_minimize(
        traced,
        &vec![0.0; start.len()],
        &free,
        &no_constraints,
        (),
        evaluations,
        RhoBeg::All(1.0),
        Some(StopTols { xtol_abs: vec![1e-3; start.len()], ..Default::default() }),
    );
    best.into_inner()
}

/// Fits the parameters numbered in `free` from `start`: smooth ones by [`fit_smooth`], the others by a search around it.
#[must_use]
pub fn fit<S: Simulator>(problem: &Problem<'_, S>, start: &[f64], free: &[usize], state: &State) -> Fit {
    let parameters = problem.simulator.parameters();
    let (smooth, stepped): (Vec<usize>, Vec<usize>) = free.iter().partition(|k| parameters[**k].smooth);
    if stepped.is_empty() {
        return fit_smooth(problem, start, free, state);
    }
    let at = |point: &[f64]| {
        let mut theta = start.to_vec();
        stepped.iter().zip(point).for_each(|(k, value)| theta[*k] = *value);
        fit_smooth(problem, &theta, &smooth, state)
    };
    let from: Vec<f64> = stepped.iter().map(|k| start[*k]).collect();
    let bounds: Vec<(f64, f64)> = stepped.iter().map(|k| (parameters[*k].lower, parameters[*k].upper)).collect();
    let scale: Vec<f64> =
        stepped.iter().zip(&from).map(|(k, v)| if *v == 0.0 { parameters[*k].scale() } else { 0.2 * v.abs() }).collect();
    let (point, _) = minimize(|point| at(point).objective(), &from, &bounds, &scale, 60);
    let mut fit = at(&point);
    fit.free = free.to_vec();
    fit
}
