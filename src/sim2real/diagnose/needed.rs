//! Need: whether one mechanism more explains enough, in enough rows, to be worth its name.

use super::carry_over::carries_over;
use super::hypothesis::{Hypothesis, Inquiry};
use super::weigh::gain;
use super::whiteness::ChannelMisfit;
use crate::sim2real::{Clock, Twin};

/// A second mechanism must explain at least this part of the first misfit, and each one more this part, for laws never have
/// quite the form of the real thing, and what they leave looks like something else; a second of messages must explain more, for of
/// these it is not asked whether it carries over ...
const SHARE: f64 = 0.002;
const SHARE_OF_ORDERS: f64 = 0.01;
const SHARE_OF_MORE: f64 = 0.03;
/// ... unless it explains at least this part of all that was left: errors of form are not explained away so neatly.
const COMPLETES: f64 = 0.8;
/// ... or gains more than this, explains at least that part of the first misfit, and is there in rows it was not fitted to.
const DECISIVE: f64 = 50.0;
const SHARE_OF_DECISIVE: f64 = 0.0003;
/// What is of the size and colour of noise holds something besides, where so large a part of it is explained.
const MORE_THAN_NOISE: f64 = 0.15;
/// A mechanism must move at least this many rows by more than the noise, or what it does be spread over as many, of so many in all, or with
/// decisive evidence.
pub(super) const INFORMATIVE_ROWS: usize = 25;
const MANY_ROWS: usize = 1000;
/// ... or restore at least so many messages and most of those that it moves: they are off by no more than this part of what they were;
/// or take away so much of what they are off by, all together, that no less than so many of them tell of it.
const FEW_ROWS: usize = 4;
const MOST: f64 = 0.75;
const MOST_OF_FEW: f64 = 0.8;
const RESTORED: f64 = 0.2;
const TAKEN_AWAY: f64 = 0.9;
/// Two are enough where all that are moved are restored, or hardly anything of what they are off by is left: that one constant should say
/// by chance which two of hundreds are off, and by how much each, is too much to believe. One alone tells of nothing.
const FEWEST_ROWS: usize = 2;
const ALL_BUT: f64 = 0.97;
/// Residuals with an autocorrelation time below this [rows] are taken for white.
const FAIRLY_WHITE: f64 = 2.0;

/// The least part of the parent's residual that a further mechanism has to explain to be needed.
pub(super) fn needed_share<T: Twin>(inquiry: &Inquiry<'_, T>, first: &Hypothesis<T>, parent: &Hypothesis<T>) -> f64 {
    if parent.added.is_empty() {
        return 0.0;
    }
    let least = |(first, left): (&ChannelMisfit, &ChannelMisfit)| {
        let most = (worth_trying(inquiry.twin.clock(), parent.added.len() + 1) * above_noise(first, left.level))
            .min(COMPLETES * above_noise(left, left.level));
        most / left.sum_of_squares.max(1e-300)
    };
    first.misfits.iter().zip(&parent.misfits).map(least).fold(f64::INFINITY, f64::min)
}

/// The part of the first misfit that the last of so many mechanisms must explain.
fn share_of(clock: Clock, mechanisms: usize) -> f64 {
    match clock {
        _ if mechanisms > 2 => SHARE_OF_MORE,
        Clock::Event => SHARE_OF_ORDERS,
        Clock::Sampled { .. } => SHARE,
    }
}

/// The same of what may yet turn out to be decisive.
fn worth_trying(clock: Clock, mechanisms: usize) -> f64 {
    let decisive = mechanisms == 2 && clock != Clock::Event;
    if decisive { SHARE_OF_DECISIVE } else { share_of(clock, mechanisms) }
}

/// Whether `better` explains nearly all that `other` leaves above noise as white as what `better` leaves.
pub(super) fn completes<T>(other: &Hypothesis<T>, better: &Hypothesis<T>) -> bool {
    other.misfits.iter().zip(&better.misfits).any(|(other, better)| {
        let mean_square = better.sum_of_squares / better.count.max(1) as f64;
        let white = better.autocorrelation_time < FAIRLY_WHITE || better.level > 1.0;
        let level = if white { mean_square } else { 1.0 };
        let explained = other.sum_of_squares - better.sum_of_squares;
        explained > 0.0 && explained >= COMPLETES * other.above(level)
    })
}

/// What a misfit has above noise of that level.
fn above_noise(misfit: &ChannelMisfit, level: f64) -> f64 {
    misfit.above(level).max(0.1 * misfit.sum_of_squares)
}

/// By what part of the first misfit above the noise `better` explains more than `other`, in the channel where it is most.
pub(super) fn share<T>(first: &Hypothesis<T>, other: &Hypothesis<T>, better: &Hypothesis<T>) -> f64 {
    let channels = first.misfits.iter().zip(&other.misfits).zip(&better.misfits);
    channels
        .map(|((first, other), better)| {
            (other.sum_of_squares - better.sum_of_squares) / above_noise(first, better.level).max(1e-300)
        })
        .fold(f64::NEG_INFINITY, f64::max)
}

/// Whether `whole` explains enough more than `less`, in enough rows.
pub(super) fn needed<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    first: &Hypothesis<T>,
    less: &Hypothesis<T>,
    whole: &Hypothesis<T>,
) -> bool {
    let misfits = || first.misfits.iter().zip(&less.misfits).zip(&whole.misfits);
    let enough = whole.added.len() == 1
        || misfits()
            .any(|((first, less), last)| explains_enough(inquiry.twin.clock(), whole.added.len(), [first, less, last]))
        || decisive(inquiry, first, less, whole) && carries_over(inquiry, less, whole);
    let rows = inquiry.problem(&whole.twin, &inquiry.evidence.compared).blocks().last().map_or(0, |b| b.range.end);
    let change = || (0..rows).map(|i| less.fit.residual[i] - whole.fit.residual[i]);
    let moved = change().filter(|d| d.abs() > 1.0).count();
    // Effects below the noise show in the sum of many rows only: over how many it is spread counts then.
    let (fourth, second) = change().fold((0.0, 0.0), |(f, s), d| (f + d.powi(4), s + d.powi(2)));
    // Messages tell some things exactly: a few that nothing else accounts for are enough.
    let restored = (0..rows).filter(|i| {
        let (before, after) = (less.fit.residual[*i], whole.fit.residual[*i]);
        (before - after).abs() > 1.0 && after.abs() < RESTORED * before.abs()
    });
    let restored = restored.count();
    let few = restored >= FEW_ROWS && restored as f64 >= MOST * moved as f64 || restored >= FEWEST_ROWS && restored == moved;
    let pairs: Vec<[f64; 2]> = (0..rows).map(|i| [less.fit.residual[i], whole.fit.residual[i]]).collect();
    let seen = inquiry.twin.clock() == Clock::Event && (few || takes_away(&pairs) || most_of_few(moved, rows));
    let many = rows > MANY_ROWS || inquiry.evidence.sparse || gain(inquiry, less, whole) > DECISIVE;
    let spread = many && second * second >= INFORMATIVE_ROWS as f64 * fourth;
    enough && (spread || seen || moved >= INFORMATIVE_ROWS)
}

/// Whether the evidence for a second mechanism of a sampled recording is such that not even what laws are off by explains it, unless it is
/// not there in other rows.
fn decisive<T: Twin>(inquiry: &Inquiry<'_, T>, first: &Hypothesis<T>, less: &Hypothesis<T>, whole: &Hypothesis<T>) -> bool {
    let second = whole.added.len() == 2 && inquiry.twin.clock() != Clock::Event;
    second && share(first, less, whole) >= SHARE_OF_DECISIVE && gain(inquiry, less, whole) > DECISIVE
}

/// Whether so many are most of all the messages there are, where these are no more than a few times as many as would tell of anything.
fn most_of_few(moved: usize, messages: usize) -> bool {
    messages <= INFORMATIVE_ROWS && moved >= 2 * FEW_ROWS && moved as f64 >= MOST_OF_FEW * messages as f64
}

/// Whether the last of so many mechanisms explains enough of a channel that leaves so much with none, without it and with it. A channel in
/// which nothing is off speaks for none.
fn explains_enough(clock: Clock, mechanisms: usize, [first, less, last]: [&ChannelMisfit; 3]) -> bool {
    let explained = less.sum_of_squares - last.sum_of_squares;
    let (all, left) = (above_noise(first, last.level), above_noise(less, last.level));
    let noise_alone = less.like_noise() && explained < MORE_THAN_NOISE * less.sum_of_squares;
    let completes = !noise_alone && explained >= COMPLETES * left;
    explained > 0.0 && (explained >= share_of(clock, mechanisms) * all || completes)
}

/// Whether of the messages that are moved, each off by so much before and after, nearly all that they were off by is gone, and more than a
/// few tell of it: a limit that varies from order to order restores none of them exactly.
fn takes_away(messages: &[[f64; 2]]) -> bool {
    let moved = messages.iter().filter(|[before, after]| (before - after).abs() > 1.0);
    let [mut before, mut after, mut fourth] = [0.0; 3];
    for [was, is] in moved {
        before += was * was;
        after += is * is;
        fourth += was.powi(4);
    }
    let tell = |rows: usize, part: f64| after <= (1.0 - part) * before && before * before >= rows as f64 * fourth;
    before > 0.0 && (tell(FEW_ROWS, TAKEN_AWAY) || tell(FEWEST_ROWS, ALL_BUT))
}

#[cfg(test)]
mod tests {
    use super::super::weigh::tests::leaving;
    use super::*;

    #[test]
    fn a_second_of_messages_must_explain_more_than_one_of_samples_and_a_third_most() {
        let sampled = Clock::Sampled { longest_step: 0.01 };
        assert!(share_of(Clock::Event, 2) > 2.0 * share_of(sampled, 2), "it is not asked whether it carries over");
        assert!(share_of(sampled, 3) > share_of(Clock::Event, 2));
        assert!((share_of(Clock::Event, 3) - share_of(sampled, 3)).abs() < f64::EPSILON);
    }

    /// Of 671 orders an impact explains nearly all of what they cost, and another one a thousandth; of the part filled nothing is off.
    #[test]
    fn a_channel_in_which_nothing_is_off_speaks_for_no_second_mechanism() {
        let misfit = |mean_square: f64| {
            let h = leaving(mean_square, 5_900.0);
            h.misfits.into_iter().next().unwrap()
        };
        let enough = |squares: [f64; 3]| {
            let [first, less, last] = squares.map(misfit);
            explains_enough(Clock::Event, 2, [&first, &less, &last])
        };
        assert!(!enough([38.0, 1.04, 0.99]), "a thousandth of all, and half of what is left");
        assert!(enough([38.0, 1.5, 0.99]) && enough([3.0, 1.04, 0.99]));
        assert!(!enough([0.0, 0.0, 0.0]));
    }

    #[test]
    fn few_messages_tell_of_a_limit_that_varies_and_one_large_one_does_not() {
        let cut =
            |varies: f64| -> Vec<[f64; 2]> { (0..12).map(|k| [-30.0 - k as f64, varies * (k as f64 - 5.5)]).collect() };
        assert!(takes_away(&cut(1.5)), "none is restored to a fifth, all together are to a tenth");
        assert!(!takes_away(&cut(3.5)), "too much is left");
        let mut one = cut(1.0);
        one.push([-900.0, 2.0]);
        assert!(!takes_away(&one), "one of them is nearly all there is");
        assert!(most_of_few(9, 10) && !most_of_few(7, 7) && !most_of_few(9, 12) && !most_of_few(30, 30));
        assert!(takes_away(&[[-30.0, 5.0]; 2]) && !takes_away(&[[-30.0, 6.0]; 3]) && takes_away(&[[-30.0, 6.0]; 4]));
        assert!(!takes_away(&[[-30.0, 0.0]]) && !takes_away(&[]), "one tells of nothing");
    }
}
