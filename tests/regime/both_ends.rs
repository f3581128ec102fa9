//! Series, which are taken from both ends at once, beside the recursions of textbooks.

use trueup::sim2real::Seed;
use trueup::sim2real::regime::{Emission, Family, Filter, HiddenMarkov, Observations, Settings, Spread, refit};

use super::textbook::{Textbook, log_density};
use super::{market, state};

/// A chain of so many states with levels 2 apart, of which each may stay or go one up or down, and nothing else.
fn ladder(states: usize) -> HiddenMarkov {
    let transition = |from: usize| -> Vec<f64> {
        let near: Vec<f64> = (0..states).map(|to| [0.9, 0.05, 0.0][from.abs_diff(to).min(2)]).collect();
        let sum: f64 = near.iter().sum();
        near.iter().map(|p| p / sum).collect()
    };
    let mut initial = vec![0.0; states];
    initial[0] = 1.0;
    let levels = (0..states).map(|level| state(2.0 * level as f64, 1.0 + 0.3 * level as f64)).collect();
    HiddenMarkov::new(initial, (0..states).map(transition).collect(), levels).unwrap()
}

fn check(model: &HiddenMarkov, rows: &[f64], case: &str) {
    let series = Observations::of(rows).unwrap();
    let right = Textbook::of(model, rows);
    let close = |found: f64, right: f64| (found - right).abs() < 1e-10 * right.abs();
    let found = model.log_likelihood(series).unwrap();
    assert!(close(found, right.log_likelihood), "{case}: {found} and {}", right.log_likelihood);
    let mut online = Filter::new(model.clone());
    rows.iter().for_each(|x| drop(online.step(&[*x]).map(<[f64]>::len)));
    assert!(close(online.log_likelihood(), right.log_likelihood), "{case}: {} online", online.log_likelihood());
    for (row, smooth) in model.smooth(series).unwrap().chunks(model.states()).enumerate() {
        for (smooth, right) in smooth.iter().zip(&right.posterior[row]) {
            assert!((smooth - right).abs() < 1e-6, "{case}, row {row}: {smooth} and {right}");
        }
    }
    // The path that was found is as likely as it says, and none is likelier.
    let (path, log) = model.viterbi(series).unwrap();
    let steps: f64 = path.windows(2).map(|pair| model.transitions(pair[0])[pair[1]].ln()).sum();
    let densities: f64 = path.iter().zip(rows).map(|(state, x)| log_density(&model.emissions()[*state], *x)).sum();
    let along = model.initial()[path[0]].ln() + steps + densities;
    assert!(close(log, right.best) && close(along, right.best), "{case}: {log}, {along} along it, and {}", right.best);
    // One iteration of Baum-Welch: what is expected, and what is likeliest then.
    let few = Settings { iterations: 2, tolerance: 0.0, ..Settings::new(model.states()) };
    let fit = refit(model, &[series], &few).unwrap().model;
    let order = right_order(&right, rows);
    for (state, was) in order.into_iter().enumerate() {
        let [weight, mean, variance] = moments(&right, rows, was);
        let found = &fit.emissions()[state];
        assert!((found.mean[0] - mean).abs() < 1e-7 * variance.sqrt(), "{case}: mean {} and {mean}", found.mean[0]);
        assert!(
            (found.variances()[0] / variance - 1.0).abs() < 1e-7,
            "{case}: variance {} of {weight}",
            found.variances()[0]
        );
        let sum: f64 = right.transitions[was].iter().sum();
        let stay = right.transitions[was][was] / sum;
        assert!((fit.transitions(state)[state] - stay).abs() < 1e-8, "{case}: {} and {stay}", fit.transitions(state)[state]);
        let mut found = fit.transitions(state).to_vec();
        let mut right: Vec<f64> = right.transitions[was].iter().map(|count| count / sum).collect();
        found.sort_by(f64::total_cmp);
        right.sort_by(f64::total_cmp);
        assert!(found.iter().zip(&right).all(|(a, b)| (a - b).abs() < 1e-8), "{case}: {found:?} and {right:?}");
    }
}

/// Sum of probabilities, mean and variance of the rows in a state.
fn moments(right: &Textbook, rows: &[f64], state: usize) -> [f64; 3] {
    let seen = || rows.iter().zip(&right.posterior).filter(|(x, _)| !x.is_nan()).map(|(x, p)| (*x, p[state]));
    let weight: f64 = seen().map(|(_, p)| p).sum();
    let mean = seen().map(|(x, p)| p * x).sum::<f64>() / weight;
    [weight, mean, seen().map(|(x, p)| p * (x - mean).powi(2)).sum::<f64>() / weight]
}

/// States in the order of the volatility that rows give them, as those of a fit are.
fn right_order(right: &Textbook, rows: &[f64]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..right.transitions.len()).collect();
    order.sort_by(|a, b| moments(right, rows, *a)[2].total_cmp(&moments(right, rows, *b)[2]));
    order
}

/// Of even and odd lengths, of one row and of a few, of whole blocks of steps and of one more or less.
#[test]
fn series_are_as_likely_as_textbooks_say() {
    for states in 1..=6 {
        let model = ladder(states);
        for rows in [1, 2, 3, 4, 63, 126, 127, 128, 129, 130, 257] {
            check_densities(&model, &model.simulate(rows, Seed(rows as u64)).values);
        }
        for rows in [512, 1_001, 4_733] {
            let drawn = model.simulate(rows, Seed(rows as u64)).values;
            check(&model, &drawn, &format!("{states} states, {rows} rows"));
        }
    }
}

/// Rows that were lost, or are thousands of deviations from every state: at the ends, where halves meet, and anywhere.
#[test]
fn series_with_holes_and_far_rows() {
    let model = market();
    for count in [5_000, 5_001] {
        let (mut rows, middle) = (model.simulate(count, Seed(5)).values, count / 2);
        for (place, x) in [
            (0, 3.0),
            (63, -9.0),
            (middle - 1, 40.0),
            (middle, f64::NAN),
            (middle + 1, -90.0),
            (3_000, 90.0),
            (count - 1, 7.0),
        ] {
            rows[place] = x;
        }
        rows.iter_mut().skip(3).step_by(11).for_each(|x| *x = f64::NAN);
        check_densities(&model, &rows);
    }
}

fn check_densities(model: &HiddenMarkov, rows: &[f64]) {
    let series = Observations::of(rows).unwrap();
    let right = Textbook::of(model, rows);
    let found = model.log_likelihood(series).unwrap();
    assert!((found - right.log_likelihood).abs() < 1e-10 * found.abs(), "{found} and {}", right.log_likelihood);
    for (smooth, right) in model.smooth(series).unwrap().iter().zip(right.posterior.iter().flatten()) {
        // Logarithms of a hundred million have lost digits of their own.
        assert!((smooth - right).abs() < 1e-5, "{smooth} and {right}");
    }
    let (_, log) = model.viterbi(series).unwrap();
    assert!((log - right.best).abs() < 1e-10 * log.abs());
}

/// States that hardly ever stay, so that the path changes where halves meet, whatever its length.
#[test]
fn a_path_that_alternates_is_found_where_halves_meet() {
    let transition = vec![vec![0.1, 0.9], vec![0.9, 0.1]];
    let model = HiddenMarkov::new(vec![0.5, 0.5], transition, vec![state(0.0, 1.0), state(5.0, 1.0)]).unwrap();
    for count in [2, 3, 4, 5, 127, 128, 129, 130, 1_000, 1_001, 2_040, 2_041, 2_048, 2_055, 5_003] {
        let path: Vec<usize> = (0..count).map(|row| row % 2).collect();
        let rows: Vec<f64> = path.iter().map(|state| 5.0 * *state as f64 + 0.2).collect();
        assert!(model.viterbi(Observations::of(&rows).unwrap()).unwrap().0 == path, "{count} rows");
    }
}

/// Two states that are hardly ever left, of which one row at an end tells which it is, and no other does: within the series nothing of it is
/// known, and yet it holds for all of it.
#[test]
fn what_the_ends_know_holds_within() {
    let stay = 1.0 - 1e-9;
    let transition = vec![vec![stay, 1e-9], vec![1e-9, stay]];
    let model = HiddenMarkov::new(vec![0.5, 0.5], transition, vec![state(0.0, 1.0), state(1.0, 1.0)]).unwrap();
    for count in [2_041, 4_096, 5_000] {
        for telling in [0, count - 1] {
            for (x, known) in [(3.0, 1), (-2.0, 0)] {
                let mut rows = vec![0.5; count];
                rows[telling] = x;
                let (path, log) = model.viterbi(Observations::of(&rows).unwrap()).unwrap();
                assert!(path.iter().all(|state| *state == known), "{count} rows, row {telling} {x}");
                let right = Textbook::of(&model, &rows).best;
                assert!((log - right).abs() < 1e-10 * right.abs(), "{log} and {right}");
            }
        }
    }
}

/// Sticky states that hardly differ, whose evidence is gathered over thousands of rows, and states that change at any row.
#[test]
fn paths_of_long_series_are_those_of_textbooks() {
    for (stay, level) in [(0.5, 0.3), (0.9, 1.0), (0.99, 0.2), (0.9999, 0.05), (0.999_999, 0.05)] {
        for states in 2..=5_usize {
            let leave = (1.0 - stay) / (states - 1) as f64;
            let row = |from: usize| (0..states).map(|to| if to == from { stay } else { leave }).collect();
            let levels = (0..states).map(|k| state(level * k as f64, 1.0 + 0.1 * k as f64)).collect();
            let model =
                HiddenMarkov::new(vec![1.0 / states as f64; states], (0..states).map(row).collect(), levels).unwrap();
            for count in [2_043, 6_007] {
                let mut rows = model.simulate(count, Seed(count as u64 + states as u64)).values;
                rows.iter_mut().skip(5).step_by(101).for_each(|x| *x = f64::NAN);
                let right = Textbook::of(&model, &rows).best;
                let (path, log) = model.viterbi(Observations::of(&rows).unwrap()).unwrap();
                let steps: f64 = path.windows(2).map(|pair| model.transitions(pair[0])[pair[1]].ln()).sum();
                let densities: f64 = path.iter().zip(&rows).map(|(k, x)| log_density(&model.emissions()[*k], *x)).sum();
                let along = model.initial()[path[0]].ln() + steps + densities;
                let case = format!("{states} states that stay by {stay}, {level} apart, {count} rows");
                let close = |found: f64| (found - right).abs() < 1e-10 * right.abs();
                assert!(close(log) && close(along), "{case}: {log}, {along} along it, and {right}");
            }
        }
    }
}

/// A chain that goes up and never back, its levels so far apart that what is left of a state is less than any number: a model of changes.
#[test]
fn a_chain_of_one_way_is_as_likely_as_textbooks_say() {
    let transition = vec![vec![0.999, 0.001, 0.0], vec![0.0, 0.999, 0.001], vec![0.0, 0.0, 1.0]];
    let levels = vec![state(0.0, 1.0), state(60.0, 2.0), state(-20.0, 3.0)];
    let model = HiddenMarkov::new(vec![1.0, 0.0, 0.0], transition, levels).unwrap();
    let drawn = model.simulate(5_000, Seed(2)).values;
    check(&model, &drawn, "one way");
    // And where the changes are of no such model.
    let rows: Vec<f64> = (0..600).map(|row| [0.0, 60.0, 0.5, -20.0, 59.0, -21.0][row / 100]).collect();
    let series = Observations::of(&rows).unwrap();
    let right = Textbook::of(&model, &rows);
    let found = model.log_likelihood(series).unwrap();
    assert!((found - right.log_likelihood).abs() < 1e-10 * found.abs(), "{found} and {}", right.log_likelihood);
    for (smooth, right) in model.smooth(series).unwrap().iter().zip(right.posterior.iter().flatten()) {
        assert!((smooth - right).abs() < 1e-9, "{smooth} and {right}");
    }
}

/// What the first half holds possible the other does not: two states of which neither is ever left.
#[test]
fn halves_that_contradict_each_other() {
    let transition = vec![vec![1.0, 0.0], vec![0.0, 1.0]];
    let model = HiddenMarkov::new(vec![0.5, 0.5], transition, vec![state(0.0, 1.0), state(5.0, 1.0)]).unwrap();
    for (change, count) in [(1_000, 5_000), (2_500, 5_000), (4_000, 5_001)] {
        let rows: Vec<f64> = (0..count).map(|row| if row < change { 0.1 } else { 4.8 }).collect();
        let right = Textbook::of(&model, &rows);
        let found = model.log_likelihood(Observations::of(&rows).unwrap()).unwrap();
        assert!((found - right.log_likelihood).abs() < 1e-10 * found.abs(), "{found} and {}", right.log_likelihood);
    }
}

/// A second column that is the same in all states says nothing of them: what is found is what the first alone says, lost rows and all.
#[test]
fn a_column_that_says_nothing_changes_nothing() {
    let alone = market();
    for (count, full) in [(400, false), (401, false), (400, true), (401, true)] {
        let mut rows = alone.simulate(count, Seed(9)).values;
        rows.iter_mut().skip(2).step_by(7).for_each(|x| *x = f64::NAN);
        let beside = |row: usize| (row as f64 * 0.7).sin();
        let both: Vec<f64> = rows.iter().enumerate().flat_map(|(row, x)| [*x, beside(row)]).collect();
        let emissions = alone.emissions().iter().map(|one| {
            let variance = one.variances()[0];
            let spread = if full {
                Spread::Full(vec![vec![variance, 0.0], vec![0.0, 2.0]])
            } else {
                Spread::Diagonal(vec![variance, 2.0])
            };
            Emission { mean: vec![one.mean[0], 0.3], spread, degrees: None }
        });
        let transitions = (0..alone.states()).map(|from| alone.transitions(from).to_vec()).collect();
        let model = HiddenMarkov::new(alone.initial().to_vec(), transitions, emissions.collect()).unwrap();
        let (one, two) = (Observations::of(&rows).unwrap(), Observations::rows(&both, 2).unwrap());
        let close = |a: &[f64], b: &[f64]| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9);
        assert!(close(&alone.smooth(one).unwrap(), &model.smooth(two).unwrap()), "{count} rows, full: {full}");
        assert_eq!(alone.viterbi(one).unwrap().0, model.viterbi(two).unwrap().0);
        let few = Settings { iterations: 2, tolerance: 0.0, ..Settings::new(alone.states()) };
        let of_two = Settings { family: if full { Family::GaussianFull } else { Family::Gaussian }, ..few };
        let (one, two) = (refit(&alone, &[one], &few).unwrap().model, refit(&model, &[two], &of_two).unwrap().model);
        // In the order of all their variances: of the first column as far as the second is the same in all.
        let of = |model: &HiddenMarkov| {
            let mut found: Vec<(f64, f64)> = model.emissions().iter().map(|e| (e.mean[0], e.variances()[0])).collect();
            found.sort_by(|a, b| a.1.total_cmp(&b.1));
            found.into_iter().flat_map(|(mean, variance)| [mean, variance]).collect::<Vec<f64>>()
        };
        assert!(close(&of(&one), &of(&two)), "{count} rows, full: {full}: {:?} and {:?}", of(&one), of(&two));
    }
}

/// Series of one row each, in which nothing follows anything: transitions stay what they were, and first states are what rows say.
#[test]
fn series_of_one_row_tell_no_transitions() {
    let model = market();
    let rows = model.simulate(60, Seed(4)).values;
    let parts: Vec<Observations> = rows.chunks(1).map(|row| Observations::of(row).unwrap()).collect();
    let few = Settings { iterations: 2, tolerance: 0.0, ..Settings::new(model.states()) };
    let fit = refit(&model, &parts, &few).unwrap().model;
    let first: Vec<f64> = parts.iter().map(|part| model.smooth(*part).unwrap()[0]).collect();
    assert!((fit.initial()[0] - first.iter().sum::<f64>() / 60.0).abs() < 1e-12, "{:?}", fit.initial());
    for state in 0..model.states() {
        assert_eq!(fit.transitions(state), model.transitions(state));
    }
}
