//! Carrying over: whether what explains little is there in recordings it has not been fitted to.
//!
//! What the form of one law is off by looks like a further mechanism of one recording, and like another one of the next: moved in
//! another way, it bends another way. What is there is there in both. So the rows that are fitted are divided once more, each side is
//! fitted with the mechanism and without, and both are asked of the other side; what is held out for the proof is not touched.
//!
//! Source: Stone, "Cross-validatory choice and assessment of statistical predictions", Journal of the Royal Statistical Society B 36
//! (1974).

use rayon::prelude::*;

use super::hypothesis::{Hypothesis, Inquiry, free_parameters};
use crate::sim2real::identify::{Effort, Problem, State, fit};
use crate::sim2real::{Part, Twin};

/// A further mechanism must take away this part of what is above the noise where it was not fitted: errors of form, carried over,
/// took away a quarter at the most, and mechanisms half or more.
const CARRIED: f64 = 1.0 / 3.0;
/// How often an initial state is moved to where it fits best.
const SETTLED: usize = 3;

/// Whether `whole`, fitted to one side of the recordings, leaves so much less of the other than `less` does that what it has beyond that
/// is there.
pub(super) fn carries_over<T: Twin>(inquiry: &Inquiry<'_, T>, less: &Hypothesis<T>, whole: &Hypothesis<T>) -> bool {
    let sides = sides(&inquiry.evidence.compared);
    if sides.iter().any(Vec::is_empty) {
        return true;
    }
    let left = |hypothesis: &Hypothesis<T>| -> f64 {
        let ways: [[usize; 2]; 2] = [[0, 1], [1, 0]];
        0.5 * ways.into_par_iter().map(|[own, other]| left(inquiry, hypothesis, &sides[own], &sides[other])).sum::<f64>()
    };
    carried(left(less), left(whole))
}

/// The same of the mean squares that both leave, in units of the noise.
fn carried(less: f64, whole: f64) -> bool {
    less - whole > CARRIED * (less - 1.0).max(0.0)
}

/// Two sides of the parts, no recording on both of them; of one recording its first half and its second.
fn sides<'a, S>(parts: &[Part<'a, S>]) -> [Vec<Part<'a, S>>; 2] {
    let mut names: Vec<&str> = parts.iter().map(|part| part.recording.name.as_str()).collect();
    names.dedup();
    let side = |k: usize| {
        let of_side = |part: &&Part<'a, S>| names.iter().position(|name| *name == part.recording.name).unwrap_or(0) % 2 == k;
        parts.iter().filter(of_side).cloned().collect()
    };
    match parts {
        [whole] => {
            let middle = whole.rows.start + whole.rows.len() / 2;
            let half = |rows| vec![Part { rows, ..whole.clone() }];
            [half(whole.rows.start..middle), half(middle..whole.rows.end)]
        }
        parts if names.len() == 1 => {
            let (first, second) = parts.split_at(parts.len() / 2);
            [first.to_vec(), second.to_vec()]
        }
        _ => [side(0), side(1)],
    }
}

/// What `hypothesis`, fitted to some parts, leaves of others: a mean square, in units of the noise.
fn left<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    hypothesis: &Hypothesis<T>,
    fitted: &[Part<'_, T::Stimulus>],
    asked: &[Part<'_, T::Stimulus>],
) -> f64 {
    let twin = &hypothesis.twin;
    let problem = |parts| Problem { simulator: twin, parts, weights: &inquiry.evidence.weights, seed: inquiry.seed };
    let (own, other) = (problem(fitted), problem(asked));
    let start = std::slice::from_ref(&hypothesis.fit.values);
    let state = |problem: &Problem<'_, T>| inquiry.evidence.initial_state(problem);
    let values = fit(&own, start, &free_parameters(twin), &state(&own), Effort::Thorough).values;
    best_begun(&other, &values, state(&other))
}

/// The mean square that is left at `values`, begun from where it is least.
pub(super) fn best_begun<T: Twin>(problem: &Problem<'_, T>, values: &[f64], mut state: State) -> f64 {
    let mut least = f64::INFINITY;
    for _ in 0..=SETTLED {
        let evaluation = problem.evaluate(values, &state, &[]);
        let rows = evaluation.measured.max(1) as f64;
        least = least.min(evaluation.objective / rows);
        for (values, steps) in state.values.iter_mut().zip(&evaluation.initial_step) {
            values.iter_mut().zip(steps).for_each(|(value, step)| *value += step);
        }
    }
    least
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim2real::Recording;

    fn recording(name: &str) -> Recording<()> {
        Recording { name: name.into(), time: (0..10).map(f64::from).collect(), stimulus: (), measured: Vec::new() }
    }

    #[test]
    fn a_third_of_what_is_above_the_noise_must_go() {
        assert!(carried(4.0, 2.9) && !carried(4.0, 3.1));
        assert!(!carried(0.9, 0.9) && !carried(2.0, 5.0));
        assert!(!carried(f64::INFINITY, f64::INFINITY), "what runs away tells nothing");
    }

    #[test]
    fn no_recording_is_on_both_sides_and_one_alone_is_halved() {
        let recordings = ["a", "b", "c"].map(recording);
        let rows = |side: &[Part<'_, ()>]| -> Vec<(String, std::ops::Range<usize>)> {
            side.iter().map(|part| (part.recording.name.clone(), part.rows.clone())).collect()
        };
        let windows: Vec<Part<'_, ()>> = recordings
            .iter()
            .flat_map(|recording| [0..5, 5..10].map(|rows| Part { recording, start: rows.start, rows }))
            .collect();
        let names = |side: &[Part<'_, ()>]| side.iter().map(|part| part.recording.name.clone()).collect::<String>();
        let [first, second] = sides(&windows);
        assert_eq!([names(&first), names(&second)], ["aacc", "bb"]);
        let [first, second] = sides(&windows[..2]);
        assert_eq!([rows(&first), rows(&second)], [vec![("a".into(), 0..5)], vec![("a".into(), 5..10)]]);
        let [first, second] = sides(&[Part::whole(&recordings[0])]);
        assert_eq!([rows(&first), rows(&second)], [vec![("a".into(), 0..5)], vec![("a".into(), 5..10)]]);
    }
}
