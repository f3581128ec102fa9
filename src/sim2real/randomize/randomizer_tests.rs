use super::super::normal::AT_ONCE;
use super::super::{Distribution, Redraw};
use super::*;
use crate::sim2real::Parameter;

fn randomized(name: &str, nominal: f64, distribution: Distribution) -> Randomized {
    Randomized {
        target: Target::own(name),
        parameter: Parameter::named(name.to_owned(), "", nominal),
        distribution,
        relative: false,
        at: Redraw::Reset,
    }
}

fn uniform_of(name: &str, nominal: f64, low: f64, high: f64) -> Randomized {
    randomized(name, nominal, Distribution::Uniform { low, high })
}

/// One of every distribution, in absolute terms and relative ones.
fn mixed() -> Vec<Randomized> {
    use Distribution as D;
    let all = [
        D::Constant { value: 1.5 },
        D::Uniform { low: 0.5, high: 2.0 },
        D::LogUniform { low: 0.5, high: 2.0 },
        D::Normal { mean: 1.0, std: 0.1 },
        D::TruncatedNormal { mean: 1.0, std: 1.0, low: 0.5, high: 2.0 },
        D::LogNormal { median: 1.0, sigma: 0.2 },
        D::Choice { values: vec![0.5, 1.0, 2.0], weights: vec![1.0, 2.0, 1.0] },
    ];
    let mut out = Vec::new();
    for (k, distribution) in all.into_iter().enumerate() {
        out.push(randomized(&format!("absolute{k}"), 1.2, distribution.clone()));
        out.push(Randomized { relative: true, ..randomized(&format!("relative{k}"), 3.0, distribution) });
    }
    out
}

#[test]
fn draws_are_the_same_however_many_are_drawn_and_by_whom() {
    let correlation = Correlation { between: [Target::own("absolute3"), Target::own("relative1")], coefficient: 0.6 };
    let randomizer = Randomizer::new(mixed(), vec![correlation]).unwrap();
    let seed = Seed(11);
    let all = randomizer.begin(seed, 0, 64, 3, Level::FULL);
    let few = randomizer.begin(seed, 40, 8, 3, Level::FULL);
    let mut one = randomizer.nominal(5);
    for occasion in [Occasion::Startup, Occasion::Reset] {
        randomizer.redraw(&mut one, 2, seed, occasion, Turn { environment: 41, episode: 3 }, Level::FULL);
    }
    for k in 0..all.targets().len() {
        assert_eq!(all.row(k)[40..48], *few.row(k));
        assert_eq!(all.row(k)[41].to_bits(), one.row(k)[2].to_bits());
        assert_eq!(one.row(k)[0], randomizer.entries[k].nominal, "the others stay as they are");
    }
    // What else is randomized changes nothing.
    let alone = Randomizer::new(vec![mixed().swap_remove(2)], Vec::new()).unwrap().begin(seed, 0, 64, 3, Level::FULL);
    assert_eq!(alone.row(0), all.row(2));
    let other = randomizer.begin(seed, 0, 64, 4, Level::FULL);
    assert_ne!(other.row(2), all.row(2), "another episode");
}

/// Of every distribution, some of which take the copula's normal numbers and some the parts below them; blocks are full and not.
#[test]
fn correlated_draws_are_the_same_one_by_one_and_many_at_once() {
    let pairs = mixed().windows(2).map(|pair| [pair[0].target.clone(), pair[1].target.clone()]).collect::<Vec<_>>();
    let pairs = pairs.into_iter().map(|between| Correlation { between, coefficient: 0.4 }).collect();
    let randomizer = Randomizer::new(mixed(), pairs).unwrap();
    let (seed, count) = (Seed(11), 2 * AT_ONCE + 22);
    for level in [Level::FULL, Level::new(0.5).unwrap()] {
        let all = randomizer.begin(seed, 0, count, 3, level);
        let few = randomizer.begin(seed, 60, 8, 3, level);
        for place in 0..count {
            let key = Streams::new(seed, Occasion::Reset).environment(place as u64, 3);
            let standard = |entry: &Entry| [normal_quantile(uniform(key, entry.key))];
            let mut normal: Vec<[f64; 1]> = randomizer.entries.iter().map(standard).collect();
            randomizer.groups[0].correlate(&mut normal);
            for (k, (entry, [z])) in randomizer.entries.iter().zip(normal).enumerate() {
                let alone = entry.levelled(key, entry.inverse.at_normal(z), level);
                assert_eq!(all.row(k)[place].to_bits(), alone.to_bits(), "{:?} at {place}", entry.inverse);
                if let Some(other) = place.checked_sub(60).and_then(|place| few.row(k).get(place)) {
                    assert_eq!(all.row(k)[place].to_bits(), other.to_bits(), "{:?} at {place}", entry.inverse);
                }
            }
        }
    }
}

#[test]
fn threads_change_no_bit() {
    use rayon::prelude::*;
    let randomizer = Randomizer::new(mixed(), Vec::new()).unwrap();
    let whole = randomizer.begin(Seed(5), 0, 1_000, 0, Level::FULL);
    let parts: Vec<DrawTable> =
        (0..10_u64).into_par_iter().map(|part| randomizer.begin(Seed(5), 100 * part, 100, 0, Level::FULL)).collect();
    for k in 0..whole.targets().len() {
        let joined: Vec<u64> = parts.iter().flat_map(|part| part.row(k)).map(|v| v.to_bits()).collect();
        assert_eq!(joined, whole.row(k).iter().map(|v| v.to_bits()).collect::<Vec<_>>());
    }
}

#[test]
fn the_level_goes_from_nominal_to_full_without_a_jump_or_a_step_back() {
    let mut parameters = mixed();
    let limit = randomized("limit", f64::INFINITY, Distribution::Uniform { low: 1.0, high: 2.0 });
    parameters.push(limit);
    // Choices jump one by one: of them, only how many have jumped goes steadily.
    let steady: Vec<Randomized> =
        parameters.iter().filter(|p| !matches!(p.distribution, Distribution::Choice { .. })).cloned().collect();
    let randomizer = Randomizer::new(steady, Vec::new()).unwrap();
    let at = |level: f64| randomizer.begin(Seed(2), 0, 50, 0, Level::new(level).unwrap());
    let (none, full) = (at(0.0), at(1.0));
    for (k, entry) in randomizer.entries.iter().enumerate() {
        assert!(none.row(k).iter().all(|v| v.to_bits() == entry.nominal.to_bits()), "level 0 is nominal to the bit");
        let mut before = none.row(k).to_vec();
        for step in 1..=100 {
            let now = at(f64::from(step) / 100.0);
            for ((now, before), full) in now.row(k).iter().zip(&before).zip(full.row(k)) {
                // Its distance from what is drawn shrinks at every step, and by no more than a few hundredths.
                let left = |value: f64| if value.is_infinite() { f64::INFINITY } else { (full - value).abs() };
                assert!(
                    left(*now) <= left(*before),
                    "{:?} at {step}: {before} {now} {full}",
                    randomizer.randomized[k].target
                );
                if before.is_finite() && entry.nominal.is_finite() {
                    assert!((now - before).abs() <= 0.05 * (full - entry.nominal).abs() + 1e-12);
                }
            }
            before = now.row(k).to_vec();
        }
        assert_eq!(before, full.row(k));
    }
    let choice = Randomizer::new(
        vec![randomized("c", 9.0, Distribution::Choice { values: vec![1.0, 2.0], weights: vec![] })],
        Vec::new(),
    )
    .unwrap();
    let moved = |level: f64| {
        let table = choice.begin(Seed(2), 0, 10_000, 0, Level::new(level).unwrap());
        table.row(0).iter().filter(|v| **v != 9.0).count()
    };
    assert_eq!((moved(0.0), moved(1.0)), (0, 10_000));
    assert!((moved(0.3) as f64 / 10_000.0 - 0.3).abs() < 0.02);
    assert!((1..=20).map(|k| moved(f64::from(k) / 20.0)).collect::<Vec<_>>().windows(2).all(|w| w[0] < w[1]));
}

#[test]
fn correlated_draws_have_their_correlation_and_their_own_distributions() {
    let parameters = vec![
        randomized("a", 1.0, Distribution::Normal { mean: 1.0, std: 0.1 }),
        randomized("b", 1.0, Distribution::Normal { mean: 5.0, std: 2.0 }),
        uniform_of("c", 1.0, 0.0, 2.0),
        uniform_of("d", 1.0, 0.0, 2.0),
    ];
    let pair = |a: &str, b: &str, coefficient| Correlation { between: [Target::own(a), Target::own(b)], coefficient };
    let randomizer = Randomizer::new(parameters, vec![pair("a", "b", -0.7), pair("b", "c", 0.5)]).unwrap();
    let count = 100_000;
    let table = randomizer.begin(Seed(1), 0, count, 0, Level::FULL);
    let moments = |k: usize| {
        let row = table.row(k);
        let mean = row.iter().sum::<f64>() / count as f64;
        (mean, (row.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / count as f64).sqrt())
    };
    let correlation = |i: usize, j: usize| {
        let ((mi, si), (mj, sj)) = (moments(i), moments(j));
        let rows = table.row(i).iter().zip(table.row(j));
        rows.map(|(a, b)| (a - mi) * (b - mj)).sum::<f64>() / count as f64 / si / sj
    };
    assert!((correlation(0, 1) + 0.7).abs() < 0.01);
    // Of a uniform and a Gaussian, the correlation is that of the copula times sqrt(3 / pi).
    assert!((correlation(1, 2) - 0.5 * (3.0 / std::f64::consts::PI).sqrt()).abs() < 0.01);
    assert!(correlation(0, 3).abs() < 0.015 && correlation(2, 3).abs() < 0.015, "and no others");
    for (k, mean, std) in [(0, 1.0, 0.1), (1, 5.0, 2.0), (2, 1.0, 2.0 / 12.0_f64.sqrt()), (3, 1.0, 2.0 / 12.0_f64.sqrt())] {
        let (found, spread) = moments(k);
        assert!((found - mean).abs() < 5.0 * std / (count as f64).sqrt() && (spread / std - 1.0).abs() < 0.01, "{k}");
    }
}

#[test]
fn each_occasion_draws_what_is_due() {
    let ats = [Redraw::Startup, Redraw::Reset, Redraw::EverySeconds(0.5), Redraw::EverySteps(10), Redraw::Regime(1)];
    let one = |(k, at): (usize, &Redraw)| Randomized { at: *at, ..uniform_of(&format!("p{k}"), 9.0, 0.0, 1.0) };
    let randomizer = Randomizer::new(ats.iter().enumerate().map(one).collect(), Vec::new()).unwrap();
    let seed = Seed(3);
    let mut table = randomizer.nominal(1);
    let mut changed = |occasion: Occasion, episode: u64| {
        let before = table.clone();
        randomizer.draw(&mut table, seed, occasion, 0, &[episode], Level::FULL);
        let moved: Vec<usize> = (0..5).filter(|k| table.row(*k) != before.row(*k)).collect();
        (moved, table.row(4)[0])
    };
    assert_eq!(changed(Occasion::Startup, 0).0, [0]);
    assert_eq!(changed(Occasion::Reset, 0).0, [1, 2, 3]);
    assert_eq!(changed(Occasion::Interval(1), 0).0, [2, 3]);
    assert_eq!(changed(Occasion::Interval(1), 0).0, Vec::<usize>::new(), "the same again");
    assert_eq!(changed(Occasion::Interval(2), 0).0, [2, 3]);
    assert_eq!(changed(Occasion::Regime(0, 1), 0).0, Vec::<usize>::new());
    assert_eq!(changed(Occasion::Regime(1, 1), 0).0, [4]);
    assert_eq!(changed(Occasion::Regime(0, 2), 0), (vec![4], 9.0), "the regime is left");
    assert_eq!(changed(Occasion::Reset, 1).0, [1, 2, 3]);
    assert_eq!(changed(Occasion::Startup, 0).0, Vec::<usize>::new(), "an environment is made once");
}

#[test]
fn what_cannot_be_randomized_is_refused_by_name() {
    let wrong = Randomizer::new(vec![uniform_of("a", 1.0, 0.0, 1.0), uniform_of("b", 1.0, 2.0, 1.0)], Vec::new());
    let error = wrong.unwrap_err();
    assert!(matches!(&error, RandomizeError::Parameter { index: 1, .. }));
    assert!(error.to_string().starts_with("`b`: expected `low` below `high`"));
    let twice = Randomizer::new(vec![uniform_of("a", 1.0, 0.0, 1.0), uniform_of("a", 1.0, 0.0, 2.0)], Vec::new());
    assert!(twice.unwrap_err().to_string().contains("`a` is randomized twice"));
    let odd = Randomizer::new(vec![randomized("a", 1.0, Distribution::Constant { value: 1.0 })], Vec::new()).unwrap();
    assert_eq!(odd.oddities().len(), 1);
}
