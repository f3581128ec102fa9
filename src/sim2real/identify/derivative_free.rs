//! Fits of what has no gradient: parameters on which the output jumps.

use cobyla::{RhoBeg, StopTols, minimize as cobyla_minimize};
use rayon::prelude::*;

use super::initial_state::State;
use super::least_squares::{Effort, Fit, fit_from, fit_smooth, prior_penalty};
use super::problem::Problem;
use crate::sim2real::{Clock, Simulator};

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

/// Fits the parameters numbered in `free` from the best of `starts`: smooth ones by [`fit_from`], the others by a search
/// around each start.
#[must_use]
pub fn fit<S: Simulator>(
    problem: &Problem<'_, S>,
    starts: &[Vec<f64>],
    free: &[usize],
    state: &State,
    effort: Effort,
) -> Fit {
    let parameters = problem.simulator.parameters();
    let (smooth, stepped): (Vec<usize>, Vec<usize>) = free.iter().partition(|k| parameters[**k].smooth);
    if stepped.is_empty() {
        return fit_from(problem, starts, free, state, effort);
    }
    let fits: Vec<Fit> = starts.par_iter().map(|start| around(problem, start, &smooth, &stepped, state)).collect();
    let best = fits.into_iter().min_by(|a, b| a.objective().total_cmp(&b.objective()));
    best.unwrap_or_else(|| fit_smooth(problem, &problem.nominal(), &smooth, state))
}

/// Fits from `start`: `smooth` parameters by descent, at each point of a search over the `stepped` ones.
fn around<S: Simulator>(problem: &Problem<'_, S>, start: &[f64], smooth: &[usize], stepped: &[usize], state: &State) -> Fit {
    let parameters = problem.simulator.parameters();
    let at = |point: &[f64]| {
        let mut theta = start.to_vec();
        stepped.iter().zip(point).for_each(|(k, value)| theta[*k] = *value);
        fit_smooth(problem, &theta, smooth, state)
    };
    let from: Vec<f64> = stepped.iter().map(|k| start[*k]).collect();
    let bounds: Vec<(f64, f64)> = stepped.iter().map(|k| (parameters[*k].lower, parameters[*k].upper)).collect();
    let scale: Vec<f64> =
        stepped.iter().zip(&from).map(|(k, v)| if *v == 0.0 { parameters[*k].scale() } else { 0.2 * v.abs() }).collect();
    let penalty =
        |point: &[f64]| stepped.iter().zip(point).map(|(k, value)| prior_penalty(problem, *k, *value)).sum::<f64>();
    let point = match problem.simulator.clock() {
        // Messages are few, and cheap to follow: the smooth parameters are fitted anew at each point.
        Clock::Event => minimize(|point| at(point).objective() + penalty(point), &from, &bounds, &scale, 60).0,
        // Signals are not: the smooth parameters stay where they fit best at the start.
        Clock::Sampled { .. } => {
            let held = at(&from);
            let objective = |point: &[f64]| {
                let mut theta = held.values.clone();
                stepped.iter().zip(point).for_each(|(k, value)| theta[*k] = *value);
                problem.evaluate(&theta, &held.state, &[]).residual.norm_squared() + penalty(point)
            };
            minimize(objective, &from, &bounds, &scale, 30).0
        }
    };
    let mut fit = at(&point);
    for (i, k) in stepped.iter().enumerate() {
        let objective = |value: f64| {
            let mut theta = fit.values.clone();
            theta[*k] = value;
            problem.evaluate(&theta, &fit.state, &[]).residual.norm_squared() + prior_penalty(problem, *k, value)
        };
        fit.std[*k] = half_width(objective, point[i], bounds[i], scale[i]);
    }
    fit.prior += penalty(&point);
    fit.at_bound.extend(stepped.iter().filter(|k| parameters[**k].at_bound(fit.values[**k])));
    fit.free = smooth.iter().chain(stepped).copied().collect();
    fit.free.sort_unstable();
    fit
}

/// By how far a parameter can be moved, the others staying, before the objective rises by 1: the mean of both directions in which it does:
/// the standard deviation, were the objective a parabola.
fn half_width(objective: impl Fn(f64) -> f64, best: f64, bounds: (f64, f64), scale: f64) -> f64 {
    let limit = objective(best) + 1.0;
    let reach = |direction: f64| {
        let rises = |step: f64| {
            let value = best + direction * step;
            (bounds.0..=bounds.1).contains(&value).then(|| objective(value) > limit)
        };
        let (mut inside, mut step) = (0.0, 1e-6 * scale);
        while rises(step) == Some(false) {
            (inside, step) = (step, 4.0 * step);
        }
        rises(step)?;
        for _ in 0..12 {
            let middle = 0.5 * (inside + step);
            if rises(middle) == Some(true) { step = middle } else { inside = middle }
        }
        Some(step)
    };
    let reached: Vec<f64> = [-1.0, 1.0].into_iter().filter_map(reach).collect();
    if reached.is_empty() { f64::INFINITY } else { reached.iter().sum::<f64>() / reached.len() as f64 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_least_within_bounds() {
        let bowl = |x: &[f64]| (x[0] - 3.0).powi(2) + 10.0 * (x[1] + 1.0).powi(2);
        let (x, value) = minimize(bowl, &[0.0, 0.0], &[(-10.0, 10.0), (-0.5, 10.0)], &[1.0, 1.0], 300);
        assert!((x[0] - 3.0).abs() < 1e-2 && (x[1] + 0.5).abs() < 1e-2, "{x:?}");
        assert!((value - 2.5).abs() < 0.05);
    }

    #[test]
    fn stays_where_it_is_on_a_plateau() {
        let (x, _) = minimize(|x| if x[0] < 0.2 { 5.0 } else { 1.0 }, &[0.25], &[(0.0, 60.0)], &[0.05], 60);
        assert_eq!(x, [0.25]);
    }

    #[test]
    fn the_half_width_of_a_parabola_is_its_standard_deviation() {
        let parabola = |x: f64| ((x - 2.0) / 0.3).powi(2);
        assert!((half_width(parabola, 2.0, (0.0, 10.0), 1.0) - 0.3).abs() < 1e-3);
        // Where one side never rises, the other decides.
        let cliff = |x: f64| if x < 1.9 { 9.0 } else { 0.0 };
        assert!((half_width(cliff, 2.0, (0.0, 10.0), 1.0) - 0.1).abs() < 1e-3);
    }
}
