use super::*;
use crate::conceal::Kind;
use crate::conceal::kind::planned;
use crate::sim2real::Seed;

fn cases(seed: u64, indices: std::ops::Range<usize>) -> Vec<Case> {
    indices.map(|index| draw(Seed(seed), index)).collect()
}

/// Each kind of case conceals what it is for, in a size that it is for.
#[test]
fn effects_have_sizes_within_what_is_drawn_and_not_excited_ones_are_not_seen() {
    let cases = cases(1, 0..7);
    let sizes: Vec<f64> = cases
        .iter()
        .filter(|case| matches!(case.label.kind, Kind::Single | Kind::Pair))
        .flat_map(|case| case.label.effects.iter().map(|effect| effect.size))
        .collect();
    assert!(sizes.len() > 4 && sizes.iter().all(|size| (0.45..36.0).contains(size)), "{sizes:?}");
    for case in &cases {
        match case.label.kind {
            Kind::NotExcited => assert!(case.label.effects.iter().all(|effect| effect.size <= 0.11), "{:?}", case.label),
            Kind::Null(_) => assert!(case.label.effects.is_empty() && case.label.outside.is_none()),
            Kind::Outside => assert!(case.label.effects.is_empty() && case.label.outside.is_some()),
            Kind::Single | Kind::Pair => {}
        }
    }
}

/// A case is drawn from its seed and number alone: not from the thread it is drawn on, nor from what was drawn before it.
#[test]
fn a_case_is_the_same_wherever_and_whenever_it_is_drawn() {
    use rayon::prelude::*;
    let alone = draw(Seed(5), 3);
    let pool = |threads: usize| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    for threads in [1, 4] {
        let all: Vec<Case> = pool(threads).install(|| (2..4).into_par_iter().map(|index| draw(Seed(5), index)).collect());
        assert_eq!(all[1], alone);
        assert_ne!(all[0].train, alone.train);
    }
    assert_ne!(draw(Seed(6), 3).train, alone.train);
}

/// Twins do not tell: what they say is near the truth, exact for the gain, and the same whatever is concealed.
#[test]
fn twins_are_off_by_as_much_as_they_say_they_may_be() {
    for case in cases(2, 0..5) {
        let (truth, label) = (case.label.arm.values(), &case.label);
        for (nominal, truth) in case.nominal.iter().zip(&truth).take(3) {
            assert!((nominal / truth - 1.0).abs() < 0.31 || *truth == 0.0 && *nominal == 0.0, "{label:?}");
        }
        assert_eq!((case.nominal[3], case.uncertainty[3]), (truth[3], 0.0));
        let rows = case.train.rows();
        assert!((2_000..12_001).contains(&rows) && case.test.rows() == rows);
        for table in [&case.train, &case.test] {
            assert!(["t", "u", "q"].iter().all(|name| table.real(name).unwrap().iter().all(|v| v.is_finite())));
        }
        assert!((20.0..45.0).contains(&label.snr) && label.excitation[0] != label.excitation[1]);
    }
}

/// What happens at a time is labelled with it.
#[test]
fn events_carry_their_time() {
    let index = (0..400).find(|index| planned(*index).0 == 0 && draw::names(Seed(1), *index).contains(&"payload_change"));
    let label = draw(Seed(1), index.unwrap()).label;
    let effect = &label.effects[0];
    let onset = effect.onset.unwrap();
    assert!((4.0..19.0).contains(&onset) && effect.active[0].start < onset && effect.parameters["time"] == onset);
}

/// Every name that can be concealed comes up, in each of its kinds of case.
#[test]
fn no_name_is_left_out() {
    use std::collections::BTreeSet;
    let mut seen = BTreeSet::new();
    for ordinal in 0..recipe::KNOWN.len() {
        // The ordinal-th case with one effect.
        let index = (0..200).find(|index| planned(*index) == (0, ordinal)).unwrap();
        seen.extend(draw::names(Seed(9), index));
    }
    assert_eq!(seen, recipe::KNOWN.into_iter().collect());
}
