//! Regimes: models of which the answer is known, by hand or because the series were drawn from them.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may stop where it fails")]

mod both_ends;
mod textbook;

use proptest::prelude::*;
use textbook::{Textbook, log_density};
use trueup::sim2real::Seed;
use trueup::sim2real::regime::{
    Assumed, Collapse, Cost, Degrees, Division, Emission, Family, Filter, HiddenMarkov, Observations, Penalty, Prior,
    RegimeError, RunLengths, Settings, Spread, fit, fit_states, kolmogorov_smirnov, refit, wasserstein,
};

/// Annual flow of the Nile at Aswan, 1871 to 1970 [1e8 m³]: G. W. Cobb, *The problem of the Nile*, Biometrika 65 (1978); the data
/// set `Nile` of R.
const NILE: [f64; 100] = [
    1120.0, 1160.0, 963.0, 1210.0, 1160.0, 1160.0, 813.0, 1230.0, 1370.0, 1140.0, 995.0, 935.0, 1110.0, 994.0, 1020.0,
    960.0, 1180.0, 799.0, 958.0, 1140.0, 1100.0, 1210.0, 1150.0, 1250.0, 1260.0, 1220.0, 1030.0, 1100.0, 774.0, 840.0,
    874.0, 694.0, 940.0, 833.0, 701.0, 916.0, 692.0, 1020.0, 1050.0, 969.0, 831.0, 726.0, 456.0, 824.0, 702.0, 1120.0,
    1100.0, 832.0, 764.0, 821.0, 768.0, 845.0, 864.0, 862.0, 698.0, 845.0, 744.0, 796.0, 1040.0, 759.0, 781.0, 865.0, 845.0,
    944.0, 984.0, 897.0, 822.0, 1010.0, 771.0, 676.0, 649.0, 846.0, 812.0, 742.0, 801.0, 1040.0, 860.0, 874.0, 848.0, 890.0,
    744.0, 749.0, 838.0, 1050.0, 918.0, 986.0, 797.0, 923.0, 975.0, 815.0, 1020.0, 906.0, 901.0, 1170.0, 912.0, 746.0,
    919.0, 718.0, 714.0, 740.0,
];

/// The row of 1899, the first year of the lower flow.
const LOWER: usize = 28;

fn state(mean: f64, variance: f64) -> Emission {
    Emission { mean: vec![mean], spread: Spread::Diagonal(vec![variance]), degrees: None }
}

/// Three regimes of one mean or almost: calm, lively and wild.
fn market() -> HiddenMarkov {
    let transition = vec![vec![0.98, 0.015, 0.005], vec![0.03, 0.95, 0.02], vec![0.02, 0.08, 0.9]];
    let states = vec![state(0.0005, 0.005_f64.powi(2)), state(0.0, 0.012_f64.powi(2)), state(-0.002, 0.03_f64.powi(2))];
    HiddenMarkov::new(vec![0.6, 0.3, 0.1], transition, states).unwrap()
}

/// Two states with means 0 and 1 and standard deviation 1, and the rows 0 and 1: four paths, which can be worked out on paper.
#[test]
fn a_chain_of_two_rows_by_hand() {
    let model =
        HiddenMarkov::new(vec![0.8, 0.2], vec![vec![0.9, 0.1], vec![0.4, 0.6]], vec![state(0.0, 1.0), state(1.0, 1.0)])
            .unwrap();
    let (near, far) = (1.0 / std::f64::consts::TAU.sqrt(), (-0.5_f64).exp() / std::f64::consts::TAU.sqrt());
    let paths = [
        (0.8 * near * 0.9 * far, [0, 0]),
        (0.8 * near * 0.1 * near, [0, 1]),
        (0.2 * far * 0.4 * far, [1, 0]),
        (0.2 * far * 0.6 * near, [1, 1]),
    ];
    let total: f64 = paths.iter().map(|p| p.0).sum();
    let series = [0.0, 1.0];
    let series = Observations::of(&series).unwrap();
    assert!((model.log_likelihood(series).unwrap() - total.ln()).abs() < 1e-14);
    let smooth = model.smooth(series).unwrap();
    assert!((smooth[0] - (paths[0].0 + paths[1].0) / total).abs() < 1e-14);
    assert!((smooth[2] - (paths[0].0 + paths[2].0) / total).abs() < 1e-14);
    let filtered = model.filter(series).unwrap();
    assert!((filtered[0] - 0.8 * near / (0.8 * near + 0.2 * far)).abs() < 1e-14);
    let (path, log) = model.viterbi(series).unwrap();
    assert_eq!(path, [0, 0]);
    assert!((log - paths[0].0.ln()).abs() < 1e-14);
}

/// States that hardly ever stay: each row is of another state than its neighbours, the first and the last among them.
#[test]
fn a_path_that_alternates_is_found_to_its_ends() {
    let transition = vec![vec![0.1, 0.9], vec![0.9, 0.1]];
    let model = HiddenMarkov::new(vec![0.5, 0.5], transition, vec![state(0.0, 1.0), state(5.0, 1.0)]).unwrap();
    let rows = [0.2, 4.9, -0.3, 5.4, 0.1];
    for length in 1..=rows.len() {
        let (path, _) = model.viterbi(Observations::of(&rows[..length]).unwrap()).unwrap();
        assert_eq!(path, [0, 1, 0, 1, 0][..length]);
    }
}

/// Of a short series, sums and maxima over all paths, with a row that was lost.
#[test]
fn recursions_are_sums_over_all_paths() {
    let model = market();
    let rows = [0.001, -0.02, f64::NAN, 0.05, 0.004, -0.001, 0.0];
    let series = Observations::of(&rows).unwrap();
    let (mut total, mut of_state, mut best) = (0.0, vec![0.0; 3 * rows.len()], (f64::NEG_INFINITY, vec![]));
    for code in 0..3_usize.pow(7) {
        let path: Vec<usize> = (0..7).map(|row| code / 3_usize.pow(row) % 3).collect();
        let mut log = model.initial()[path[0]].ln();
        log += path.windows(2).map(|w| model.transitions(w[0])[w[1]].ln()).sum::<f64>();
        log += path.iter().zip(rows).map(|(state, x)| log_density(&model.emissions()[*state], x)).sum::<f64>();
        total += log.exp();
        path.iter().enumerate().for_each(|(row, state)| of_state[3 * row + state] += log.exp());
        if log > best.0 {
            best = (log, path);
        }
    }
    assert!((model.log_likelihood(series).unwrap() - total.ln()).abs() < 1e-10);
    for (smooth, sum) in model.smooth(series).unwrap().iter().zip(of_state) {
        assert!((smooth - sum / total).abs() < 1e-12);
    }
    let (path, log) = model.viterbi(series).unwrap();
    assert!((log - best.0).abs() < 1e-10);
    assert_eq!(path, best.1);
}

/// Of a long series with rows thousands of deviations from every state, the recursions of textbooks, in logarithms throughout.
#[test]
fn far_rows_are_as_likely_as_logarithms_say() {
    let model = market();
    let mut rows = model.simulate(700, Seed(4)).values;
    for (place, far) in [(0, 3.0), (63, -9.0), (64, 40.0), (300, -90.0), (301, 90.0), (699, 7.0)] {
        rows[place] = far;
    }
    rows[100] = f64::NAN;
    let series = Observations::of(&rows).unwrap();
    let (found, right) = (model.log_likelihood(series).unwrap(), Textbook::of(&model, &rows));
    assert!((found - right.log_likelihood).abs() < 1e-11 * found.abs(), "{found} and {}", right.log_likelihood);
    for (row, smooth) in model.smooth(series).unwrap().chunks(3).enumerate() {
        for (smooth, right) in smooth.iter().zip(&right.posterior[row]) {
            assert!((smooth - right).abs() < 1e-6, "row {row}: {smooth} and {right}");
        }
    }
}

#[test]
fn a_fit_finds_what_a_series_was_drawn_from() {
    let truth = market();
    let drawn = truth.simulate(12_000, Seed(1));
    let series = [Observations::of(&drawn.values).unwrap()];
    let found = fit(&series, &Settings::new(3)).unwrap();
    assert!(found.converged && found.collapsed.is_empty(), "{found:?}");
    // The likeliest model is likelier than the true one, by about half a parameter each.
    let gain = found.log_likelihood - truth.log_likelihood(series[0]).unwrap();
    assert!(gain > 0.0 && gain < 25.0, "{gain}");
    for state in 0..3 {
        let ratio = found.model.emissions()[state].volatility() / truth.emissions()[state].volatility();
        assert!((ratio - 1.0).abs() < 0.06, "state {state}: {ratio}");
        let (stay, was) = (found.model.transitions(state)[state], truth.transitions(state)[state]);
        assert!((stay - was).abs() < 0.02, "state {state}: {stay} and {was}");
    }
    let right = |path: &[usize]| path.iter().zip(&drawn.states).filter(|(a, b)| a == b).count() as f64 / 12_000.0;
    let (ours, best) = (found.model.viterbi(series[0]).unwrap().0, truth.viterbi(series[0]).unwrap().0);
    assert!(right(&ours) > right(&best) - 0.01, "{} and {}", right(&ours), right(&best));
    assert_eq!(fit(&series, &Settings::new(3)).unwrap(), found);
}

#[test]
fn a_likelihood_never_falls_with_iterations() {
    let drawn = market().simulate(1_000, Seed(3));
    let series = [Observations::of(&drawn.values).unwrap()];
    for family in
        [Family::Gaussian, Family::StudentT(Degrees::Fitted), Family::StudentT(Degrees::Fixed(4.0)), Family::GaussianFull]
    {
        let mut before = f64::NEG_INFINITY;
        for iterations in [1, 2, 3, 5, 8, 13, 30, 80] {
            let settings = Settings { iterations, family, starts: 1, tolerance: 0.0, ..Settings::new(3) };
            let now = fit(&series, &settings).unwrap().log_likelihood;
            assert!(now >= before - 1e-9 * now.abs(), "{family:?}: {before} to {now} at {iterations}");
            before = now;
        }
    }
}

#[test]
fn heavy_tails_are_told_from_a_further_state() {
    let heavy = |variance: f64, degrees| Emission { degrees: Some(degrees), ..state(0.0, variance) };
    let transition = vec![vec![0.99, 0.01], vec![0.02, 0.98]];
    let truth = HiddenMarkov::new(vec![0.5, 0.5], transition, vec![heavy(1.0, 4.0), heavy(25.0, 8.0)]).unwrap();
    let drawn = truth.simulate(10_000, Seed(2));
    let series = [Observations::of(&drawn.values).unwrap()];
    let settings = Settings { family: Family::StudentT(Degrees::Fitted), ..Settings::new(2) };
    let found = fit(&series, &settings).unwrap();
    let degrees: Vec<f64> = found.model.emissions().iter().map(|e| e.degrees.unwrap()).collect();
    assert!((degrees[0] - 4.0).abs() < 0.6 && (degrees[1] - 8.0).abs() < 2.5, "{degrees:?}");
    let gain = found.log_likelihood - truth.log_likelihood(series[0]).unwrap();
    assert!(gain > 0.0 && gain < 20.0, "{gain}");
    let gaussian = fit(&series, &Settings::new(2)).unwrap();
    assert!(gaussian.bic() > found.bic() + 100.0);
}

#[test]
fn bic_finds_the_number_of_states() {
    let drawn = market().simulate(8_000, Seed(4));
    let series = [Observations::of(&drawn.values).unwrap()];
    let (best, fits) = fit_states(&series, 1..=5, &Settings::new(1)).unwrap();
    assert_eq!((best, fits.len(), fits[best].model.states()), (2, 5, 3));
    assert!(fits.windows(2).all(|w| w[1].log_likelihood > w[0].log_likelihood - 0.5));
    assert!(fits[2].aic() < fits[1].aic());
    let nothing = fit_states(&series, std::ops::RangeInclusive::new(1, 0), &Settings::new(1));
    assert!(matches!(nothing, Err(RegimeError::Setting { name: "states", .. })));
}

#[test]
fn columns_that_move_together() {
    let full = |mean: [f64; 2], a: f64, b: f64, c: f64| Emission {
        mean: mean.to_vec(),
        spread: Spread::Full(vec![vec![a, c], vec![c, b]]),
        degrees: None,
    };
    // Means and variances are the same: only what goes with what tells the states apart.
    let states = vec![full([0.0, 0.0], 1.0, 1.0, 0.9), full([0.0, 0.0], 1.0, 1.1, -0.9)];
    let truth = HiddenMarkov::new(vec![0.5, 0.5], vec![vec![0.97, 0.03], vec![0.03, 0.97]], states).unwrap();
    let drawn = truth.simulate(3_000, Seed(6));
    let series = [Observations::rows(&drawn.values, 2).unwrap()];
    let found = fit(&series, &Settings { family: Family::GaussianFull, starts: 8, ..Settings::new(2) }).unwrap();
    let gain = found.log_likelihood - truth.log_likelihood(series[0]).unwrap();
    assert!(gain > 0.0 && gain < 20.0, "{gain}");
    let diagonal = fit(&series, &Settings::new(2)).unwrap();
    assert!(found.log_likelihood > diagonal.log_likelihood + 500.0);
    let Spread::Full(rows) = &found.model.emissions()[0].spread else { panic!("a full covariance") };
    assert_eq!(rows[0][1], rows[1][0]);
}

/// Two halves as two series: no transition from one to the next is counted, and lost rows cost what they hold and no more.
#[test]
fn several_series_and_lost_rows() {
    let truth = market();
    let drawn = truth.simulate(6_000, Seed(7));
    let (one, other) = drawn.values.split_at(3_000);
    let halves = [Observations::of(one).unwrap(), Observations::of(other).unwrap()];
    let found = fit(&halves, &Settings::new(3)).unwrap();
    let sum: f64 = halves.iter().map(|half| found.model.log_likelihood(*half).unwrap()).sum();
    assert!((found.log_likelihood - sum).abs() < 1e-8 * sum.abs());
    let mut holed = drawn.values.clone();
    holed.iter_mut().skip(3).step_by(5).for_each(|x| *x = f64::NAN);
    let whole = Observations::of(&holed).unwrap();
    let found = fit(&[whole], &Settings::new(3)).unwrap();
    assert_eq!(found.observed, 4_800);
    let ratio = found.model.emissions()[2].volatility() / truth.emissions()[2].volatility();
    assert!((ratio - 1.0).abs() < 0.15, "{ratio}");
}

/// Halfway and on from there is the whole way; from another width there is none.
#[test]
fn a_model_goes_on_from_where_it_was_kept() {
    let drawn = market().simulate(3_000, Seed(10));
    let series = [Observations::of(&drawn.values).unwrap()];
    let settings = Settings { starts: 1, ..Settings::new(3) };
    let whole = fit(&series, &settings).unwrap();
    let half = fit(&series, &Settings { iterations: 4, ..settings }).unwrap();
    let kept: HiddenMarkov = serde_json::from_str(&serde_json::to_string(&half.model).unwrap()).unwrap();
    let found = refit(&kept, &series, &Settings::new(1)).unwrap();
    assert!(found.converged && found.iterations < whole.iterations);
    assert!((found.log_likelihood - whole.log_likelihood).abs() < 1e-2, "{} {}", found.log_likelihood, whole.log_likelihood);
    let wide = Observations::rows(&drawn.values, 2).unwrap();
    assert!(matches!(refit(&kept, &[wide], &settings), Err(RegimeError::Width { width: 1, found: 2 })));
}

/// A long series is begun on a sample of it, and ends where it would have.
#[test]
fn long_series_begin_on_a_sample() {
    let truth = market();
    let drawn = truth.simulate(25_000, Seed(8));
    let series = [Observations::of(&drawn.values).unwrap()];
    let found = fit(&series, &Settings::new(3)).unwrap();
    let gain = found.log_likelihood - truth.log_likelihood(series[0]).unwrap();
    assert!(found.converged && gain > 0.0 && gain < 25.0, "{gain}");
}

#[test]
fn what_cannot_be_fitted() {
    let fitted = |values: &[f64], states| fit(&[Observations::of(values).unwrap()], &Settings::new(states)).map(|_| ());
    assert_eq!(fitted(&[2.5; 50], 2), Err(RegimeError::Constant { column: 0, value: 2.5 }));
    assert_eq!(
        fitted(&[1.0, 2.0, 3.0], 2),
        Err(RegimeError::TooShort { what: "a hidden Markov model", found: 3, needed: 4 })
    );
    assert!(matches!(fitted(&[f64::NAN; 50], 2), Err(RegimeError::TooShort { found: 0, .. })));
    assert!(matches!(fitted(&[], 2), Err(RegimeError::TooShort { .. })));
    assert!(fit(&[], &Settings::new(2)).is_err());
    let coin: Vec<f64> = (0..50).map(|k| f64::from(k % 2)).collect();
    assert_eq!(fitted(&coin, 3), Err(RegimeError::FewValues { states: 3, distinct: 2 }));
    let told = fitted(&coin, 3).unwrap_err().to_string();
    assert!(told.contains("3 states") && told.contains("2 different values") && told.contains("hint:"), "{told}");
    let pairs: Vec<f64> = (0..50).flat_map(|k| [f64::from(k), 7.0]).collect();
    let pairs = fit(&[Observations::rows(&pairs, 2).unwrap()], &Settings::new(2)).map(|_| ());
    assert_eq!(pairs, Err(RegimeError::Constant { column: 1, value: 7.0 }));
    let rows = [Observations::of(&coin).unwrap(), Observations::rows(&coin, 2).unwrap()];
    assert!(matches!(fit(&rows, &Settings::new(2)), Err(RegimeError::Width { width: 1, found: 2 })));
    let wrong = [
        Settings { states: 0, ..Settings::new(2) },
        Settings { starts: 0, ..Settings::new(2) },
        Settings { iterations: 0, ..Settings::new(2) },
        Settings { tolerance: -1.0, ..Settings::new(2) },
        Settings { floor: 0.0, ..Settings::new(2) },
        Settings { family: Family::StudentT(Degrees::Fixed(0.0)), ..Settings::new(2) },
    ];
    for settings in wrong {
        assert!(matches!(fit(&rows[..1], &settings), Err(RegimeError::Setting { .. })), "{settings:?}");
    }
}

/// Two values only: each state keeps one of them, and the result says that they are no regimes.
#[test]
fn states_that_collapse_are_told() {
    let coin: Vec<f64> = (0..60).map(|k| f64::from(k / 7 % 2)).collect();
    let found = fit(&[Observations::of(&coin).unwrap()], &Settings::new(2)).unwrap();
    assert_eq!(found.collapsed, [(0, Collapse::Narrow), (1, Collapse::Narrow)]);
    assert!(found.log_likelihood.is_finite());
    // One row far off: with a further state for it, that state holds it alone.
    let mut draws: Vec<f64> = market().simulate(300, Seed(9)).values;
    draws[150] = 10.0;
    let found = fit(&[Observations::of(&draws).unwrap()], &Settings { starts: 10, ..Settings::new(3) }).unwrap();
    assert!(found.collapsed.iter().any(|(_, why)| *why == Collapse::Empty), "{found:?}");
}

#[test]
fn the_nile_fell_in_1899() {
    let mean = Division { cost: Cost::Mean, penalty: Penalty::Bic, shortest: 2 };
    assert_eq!(mean.divide(&NILE).unwrap().changes, [LOWER]);
    assert_eq!(Division { penalty: Penalty::Mbic, ..mean }.divide(&NILE).unwrap().changes, [LOWER]);
    let both = Division { cost: Cost::MeanAndVariance, penalty: Penalty::Mbic, shortest: 5 };
    assert_eq!(both.divide(&NILE).unwrap().changes, [LOWER]);
    let assumed = Assumed::every(100.0, Prior::weak(1_000.0, 150.0));
    assert_eq!(RunLengths::changes(assumed.clone(), &NILE).unwrap(), [LOWER]);
    // Known a few years later, and not before.
    let mut lengths = RunLengths::new(assumed).unwrap();
    let since: Vec<u64> = NILE.iter().map(|flow| lengths.step(*flow).unwrap()).collect();
    assert_eq!(since[LOWER - 1], 28);
    assert_eq!(since[LOWER + 6], 7);
    // Two states of a hidden Markov model: the flow leaves the higher one in 1899 and stays away but for single years.
    let series = Observations::of(&NILE).unwrap();
    let found = fit(&[series], &Settings::new(2)).unwrap();
    let path = found.model.viterbi(series).unwrap().0;
    let high = usize::from(found.model.emissions()[1].mean > found.model.emissions()[0].mean);
    assert!(path[..LOWER].iter().filter(|s| **s == high).count() >= 26, "{path:?}");
    assert!(path[LOWER..].iter().filter(|s| **s == high).count() <= 3, "{path:?}");
    // The years before and those from then on are of two distributions: distances and probability are those of SciPy 1.17.
    let (before, after) = NILE.split_at(LOWER);
    let gap = kolmogorov_smirnov(before, after).unwrap();
    assert!((gap.distance - 0.706_349_206_349_206_4).abs() < 1e-12, "{gap:?}");
    assert!((gap.p_value / 2.766_220_702_94e-10 - 1.0).abs() < 1e-6, "{gap:?}");
    let moved = wasserstein(before, after, 999, Seed(1)).unwrap();
    assert!((moved.distance - 247.777_777_777_777_77).abs() < 1e-9 && moved.p_value == 1e-3, "{moved:?}");
}

#[test]
fn a_filter_refuses_what_is_no_row_and_stays_as_it_was() {
    let mut filter = Filter::new(market());
    filter.step(&[0.01]).unwrap();
    let before = filter.clone();
    assert!(matches!(filter.step(&[f64::INFINITY]), Err(RegimeError::NotFinite { row: 1, .. })));
    assert_eq!(filter.step(&[0.0, 1.0]).map(<[f64]>::to_vec), Err(RegimeError::Width { width: 1, found: 2 }));
    assert_eq!(filter, before);
    // A lost row: the states are predicted.
    let model = market();
    let predicted: Vec<f64> =
        (0..3).map(|to| (0..3).map(|from| before.belief()[from] * model.transitions(from)[to]).sum()).collect();
    let after = filter.step(&[f64::NAN]).unwrap();
    assert!(after.iter().zip(predicted).all(|(a, b)| (a - b).abs() < 1e-15));
    assert!((filter.log_likelihood() - before.log_likelihood()).abs() < 1e-14);
    assert!(matches!(market().filter(Observations::rows(&[0.0; 4], 2).unwrap()), Err(RegimeError::Width { .. })));
}

/// Values far beyond any state, and states that cannot be reached: probabilities stay probabilities.
#[test]
fn the_improbable_breaks_nothing() {
    let transition = vec![vec![0.5, 0.5, 0.0], vec![0.0, 0.5, 0.5], vec![0.0, 0.0, 1.0]];
    let states = vec![state(0.0, 1e-4), state(1.0, 1e-4), state(2.0, 1e-4)];
    let model = HiddenMarkov::new(vec![1.0, 0.0, 0.0], transition, states).unwrap();
    // From the first state right into the third, which is impossible; back into the first; and out of all bounds.
    let rows = [0.0, 2.0, 2.0, 0.0, 1e9, -1e300, 0.5, f64::NAN, 2.0];
    let series = Observations::of(&rows).unwrap();
    for probabilities in [model.filter(series).unwrap(), model.smooth(series).unwrap()] {
        for row in probabilities.chunks(3) {
            assert!((row.iter().sum::<f64>() - 1.0).abs() < 1e-9, "{probabilities:?}");
        }
    }
    assert!(model.log_likelihood(series).unwrap().is_finite());
    let (path, log) = model.viterbi(series).unwrap();
    assert!(log.is_finite() && path.windows(2).all(|w| model.transitions(w[0])[w[1]] > 0.0), "{path:?}");
}

proptest! {
    /// What a filter says of a row is what it says of the prefix that ends there, bit by bit, whatever comes after.
    #[test]
    fn a_filter_knows_no_future(
        past in prop::collection::vec(prop_oneof![18 => -0.1..0.1_f64, 1 => Just(f64::NAN), 1 => -1e3..1e3_f64], 1..400),
        future in prop::collection::vec(-1.0..1.0_f64, 1..30),
        width in 1..4_usize,
        states in 1..6_usize,
        heavy in any::<bool>(),
        full in any::<bool>(),
        sparse in any::<bool>(),
    ) {
        let spread = |variance: f64| {
            let covariance = |i: usize, j: usize| if i == j { variance } else { 0.3 * variance };
            let all = (0..width).map(|i| (0..width).map(|j| covariance(i, j)).collect());
            if full { Spread::Full(all.collect()) } else { Spread::Diagonal(vec![variance; width]) }
        };
        let emission = |state: usize| {
            let scale = 0.01 * 3.0_f64.powi(state as i32);
            Emission { mean: vec![0.01 * scale; width], spread: spread(scale * scale), degrees: heavy.then_some(3.0 + scale) }
        };
        let transition = |from: usize| -> Vec<f64> {
            let to = |to: usize| if to == from { 0.9 } else { 0.1 / (states as f64 - 1.0) };
            match (states, sparse) {
                (1, _) => vec![1.0],
                // One state leads to the next, and nowhere else.
                (_, true) => (0..states).map(|to| [0.9, 0.1, 0.0][((to + states - from) % states).min(2)]).collect(),
                (_, false) => (0..states).map(to).collect(),
            }
        };
        let emissions = (0..states).map(emission).collect();
        let initial = vec![1.0 / states as f64; states];
        let model = HiddenMarkov::new(initial, (0..states).map(transition).collect(), emissions).unwrap();
        let past: Vec<f64> = past.iter().flat_map(|x| std::iter::repeat_n(*x, width)).collect();
        let all: Vec<f64> = past.iter().copied().chain(future.iter().flat_map(|x| std::iter::repeat_n(*x, width))).collect();
        let bits = |values: &[f64]| values.iter().map(|p| p.to_bits()).collect::<Vec<_>>();
        let whole = model.filter(Observations::rows(&all, width).unwrap()).unwrap();
        let mut online = Filter::new(model.clone());
        for (row, values) in all.chunks(width).enumerate() {
            let said = online.step(values).unwrap();
            prop_assert_eq!(bits(said), bits(&whole[row * states..][..states]));
        }
        let log = model.log_likelihood(Observations::rows(&all, width).unwrap()).unwrap();
        // That of a series is found from both its ends.
        prop_assert!((online.log_likelihood() - log).abs() < 1e-10 * (1.0 + log.abs()), "{} and {log}", online.log_likelihood());
        let prefix = model.filter(Observations::rows(&past, width).unwrap()).unwrap();
        prop_assert_eq!(bits(&prefix), bits(&whole[..prefix.len()]));
    }
}
