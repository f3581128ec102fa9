//! Kin: a law beside a special case of it, and whether what it says more is there.

use super::carry_over::carries_over;
use super::free_run::strays;
use super::hypothesis::{Hypothesis, Inquiry};
use super::needed::{completes, share};
use super::weigh::{ACCEPT, evidence, lead_unlike};
use super::whiteness::widening;
use crate::sim2real::{About, Clock, Parameter, Twin};

/// What a law explains more of the first misfit than a special case of it counts from this part on.
const SLIGHT: f64 = 0.02;
/// Unless the evidence for it is more than this, and it explains as much where it was not fitted: of laws as slight as that beside a special
/// case that was the right one none had any (32 cases of development seeds 70 and 71); one that was right itself had 1,465.
const NOT_SLIGHT: f64 = 200.0;
/// A law that has another form than the real thing leaves so much of the first misfit: 2 % of what it explains, squared. What is named
/// besides explains more, where without it hardly anything is left.
pub(super) const OFF_BY: f64 = 5e-4;

/// A law shows itself where evidence of more than this speaks for it ...
const SHOWS: f64 = 1.2 * ACCEPT;
/// ... and the constants that make it, of which the law beside it lacks one, are each so many standard deviations from doing nothing: of 60
/// dry frictions none had both beside a Stribeck friction that explained a little more, of 14 Stribeck frictions for which there was any
/// evidence beside a dry one 5 had (ten spent test seeds).
const KNOWN_FROM_NOTHING: f64 = 3.5;

/// Whether `law` explains so little more of the first misfit than a special case of it that the form of that may be all it makes up for: of
/// one alone of signals also where the law leaves nothing else, if that is no more than any form is off by.
pub(super) fn slight<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    first: &Hypothesis<T>,
    special: &Hypothesis<T>,
    law: &Hypothesis<T>,
) -> bool {
    let (sampled, explained) = (inquiry.twin.clock() != Clock::Event, share(first, special, law));
    let beyond_form = || evidence(inquiry, first, law, special) > NOT_SLIGHT && carries_over(inquiry, special, law);
    let off_by = sampled && special.added.len() == 1 && explained < OFF_BY;
    let of_form = explained < SLIGHT && !completes(special, law) || off_by;
    of_form && !(sampled && beyond_form())
}

/// Whether of two hypotheses that differ in one law, by these names, the longer says more that is seen in signals, however little it
/// explains: one law is a special case of the other, there is evidence for the longer, which comes from what the other lacks rather than
/// from another form of what both have, and a free run does not part from it.
pub(super) fn shows_itself<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    first: &Hypothesis<T>,
    [shorter, longer]: [&Hypothesis<T>; 2],
    [less, more]: [&About; 2],
) -> bool {
    inquiry.twin.clock() != Clock::Event
        && (more.contains.contains(&less.name) || less.contains.contains(&more.name))
        && longer.free() > shorter.free()
        && lead_unlike(inquiry, first, longer, shorter) > SHOWS
        && from_nothing(inquiry, [shorter, longer], [less, more]) > KNOWN_FROM_NOTHING
        && !strays(inquiry, shorter, longer)
}

/// By how many standard deviations the law of the longer is more than nothing and than that of the shorter, as what is left makes these.
fn from_nothing<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    [shorter, longer]: [&Hypothesis<T>; 2],
    [less, more]: [&About; 2],
) -> f64 {
    let place = |whole: &Hypothesis<T>, about: &About| {
        whole.added.iter().position(|number| inquiry.candidates[*number].about.name == about.name)
    };
    let (Some(of_shorter), Some(of_longer)) = (place(shorter, less), place(longer, more)) else { return 0.0 };
    let constants = |whole: &Hypothesis<T>, place: usize| &inquiry.candidates[whole.added[place]].form.parameters;
    let shared: Vec<&str> = constants(shorter, of_shorter).iter().map(|p| &*p.name).collect();
    let (own, fit) = (inquiry.of_mechanism(longer, of_longer), &longer.fit);
    nearest(constants(longer, of_longer), &fit.values[own.clone()], &fit.std[own], &shared) / widening(&longer.misfits)
}

/// How many standard deviations the constants of a `law` that do nothing at 0 are from there, that of them which is nearest; 0 where all
/// of them are `shared` with the law beside it.
fn nearest(law: &[Parameter], values: &[f64], std: &[f64], shared: &[&str]) -> f64 {
    let effective = || law.iter().zip(values.iter().zip(std)).filter(|(p, _)| p.nominal == 0.0);
    if effective().all(|(p, _)| shared.contains(&&*p.name)) {
        return 0.0;
    }
    let distance = |(_, (value, std)): (&Parameter, (&f64, &f64))| if *std > 0.0 { value.abs() / std } else { 0.0 };
    effective().map(distance).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Both torques of a Stribeck friction must be there: without an excess it is dry friction of another form.
    #[test]
    fn a_law_is_more_than_its_special_case_by_what_that_lacks() {
        let [torque, excess] = ["torque", "excess"].map(|name| Parameter::new(name, "N m", 0.0));
        let law = [torque, excess, Parameter::new("stribeck_velocity", "rad/s", 3.0)];
        let dry = ["torque", "presliding_torque"];
        let nearest = |values: [f64; 3], std: [f64; 3]| nearest(&law, &values, &std, &dry);
        assert_eq!(nearest([0.5, 0.25, 0.1], [0.0625, 0.03125, 0.2]), 8.0);
        assert_eq!(nearest([0.5, 0.01, 0.1], [0.0625, 0.01, 0.2]), 1.0);
        assert_eq!(nearest([0.0, 0.5, 0.1], [0.0625, 0.0625, 0.2]), 0.0, "nothing but an excess is a lag of another kind");
        assert_eq!(nearest([0.5, 0.0, 0.1], [0.0625, f64::INFINITY, f64::INFINITY]), 0.0, "which no data tell");
        assert_eq!(super::nearest(&law[..1], &[0.5], &[0.0625], &dry), 0.0, "and what says no more");
    }
}
