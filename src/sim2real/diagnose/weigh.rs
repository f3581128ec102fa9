//! Weighing: what the evidence says of one hypothesis beside another.

use std::cmp::Ordering;

use super::hypothesis::{Hypothesis, Inquiry};
use super::rested::rested;
use super::screen::Screened;
use super::whiteness::ChannelMisfit;
use crate::sim2real::identify::Effort;
use crate::sim2real::{Clock, Parameter, Twin};

/// A second mechanism must explain at least this part of the first misfit, and each one more this part, for laws never have
/// quite the form of the real thing, and what they leave looks like something else; a second of messages must explain more, for of
/// these it is not asked whether it carries over ...
const SHARE: f64 = 0.002;
const SHARE_OF_ORDERS: f64 = 0.01;
const SHARE_OF_MORE: f64 = 0.03;
/// ... unless it explains at least this part of all that was left: errors of form are not explained away so neatly.
const COMPLETES: f64 = 0.8;
/// What is of the size and colour of noise holds something besides, where so large a part of it is explained.
const MORE_THAN_NOISE: f64 = 0.15;
/// A mechanism must move at least this many rows by more than the noise, or what it does be spread over as many.
const INFORMATIVE_ROWS: usize = 25;
/// ... or restore at least so many messages and most of those that it moves: they are off by no more than this part of what they were;
/// or take away so much of what they are off by, all together, that no less than so many of them tell of it.
const FEW_ROWS: usize = 4;
const MOST: f64 = 0.8;
const RESTORED: f64 = 0.2;
const TAKEN_AWAY: f64 = 0.9;
/// Residuals with an autocorrelation time below this [rows] are taken for white.
const FAIRLY_WHITE: f64 = 2.0;
/// What stands behind by more than this after a few steps is not followed further.
const HOPELESS: f64 = 300.0;
/// Mean squares of residuals, in units of the noise, that are no further apart than this say the same ...
const TOLERATED: f64 = 0.03;
/// ... where that is no more than this part of what they explain.
const NEXT_TO_NOTHING: f64 = 0.01;
/// The evidence between two that say the same in as many constants is no more than this: of 45 names of five spent test seeds that were
/// told apart by no more, 37 were right, and twice the logarithm of such odds is 3.
const INDIFFERENT: f64 = 3.0;
/// How a recording begins counts no more than this, twice the logarithm of twenty: laws of what is elastic or loose hold least in the
/// first moments.
const FIRST_MOMENTS: f64 = 6.0;
/// Degrees of freedom of what a twin says of its parameters' uncertainty.
const FREEDOM: f64 = 4.0;
/// Numbers of effective residuals whose ratio is smaller than this differ by their own scatter.
const AS_WHITE: f64 = 1.25;
/// Where residuals are so correlated that few are effective, that number is known to a standard deviation of this over its root, for
/// it is a sum of correlations over many lags (Sokal, "Monte Carlo methods in statistical mechanics", 1997).
const SCATTER: f64 = 4.0;
/// Residuals that differ by less than this part say the same; their numbers of effective residuals differ by more.
const ALIKE_LEFT: f64 = 0.05;

/// Hypotheses by what the evidence says of them, best first.
///
/// Each is weighed with its own number of effective residuals, for the right one leaves whiter ones. But those that leave
/// nearly as little as the one that leaves least, or as white, are weighed with the number of that one: their own would rank
/// them by its scatter.
pub(super) fn ranked<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    reference: &Hypothesis<T>,
    all: Vec<Hypothesis<T>>,
) -> Vec<Hypothesis<T>> {
    // What ran away is no hypothesis: beside what is not a number nothing can be weighed.
    let all: Vec<Hypothesis<T>> = all.into_iter().filter(|h| squares(h).is_finite()).collect();
    let Some(best) = all.iter().min_by(|a, b| squares(a).total_cmp(&squares(b))).cloned() else { return all };
    let mut keyed: Vec<(f64, Hypothesis<T>)> =
        all.into_iter().map(|h| (weighed(inquiry, reference, &h, scale_of(&h, &best)), h)).collect();
    keyed.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut order: Vec<Hypothesis<T>> = keyed.into_iter().map(|(_, h)| h).collect();
    if let Some(best) = order.first() {
        let simplest =
            (1..order.len()).filter(|k| alike(inquiry, reference, best, &order[*k])).min_by_key(|k| order[*k].free());
        if let Some(k) = simplest.filter(|k| order[*k].free() < best.free()) {
            order[..=k].rotate_right(1);
        }
    }
    order
}

/// Whether two alternatives to `first` leave the same but for what steps of integration and forms of laws are off by: less than
/// the noise by far, and next to nothing of what either explains. Of messages laws have the form they are written in.
fn alike<T: Twin>(inquiry: &Inquiry<'_, T>, first: &Hypothesis<T>, a: &Hypothesis<T>, b: &Hypothesis<T>) -> bool {
    if inquiry.twin.clock() == Clock::Event {
        return false;
    }
    let noise: f64 = a.misfits.iter().zip(&b.misfits).map(|(a, b)| a.level.min(b.level) * a.count as f64).sum();
    let apart = (squares(a) - squares(b)).abs();
    apart <= TOLERATED * noise && apart <= NEXT_TO_NOTHING * (squares(first) - squares(a).min(squares(b)))
}

/// By whose number of effective residuals `one` is weighed beside `best`, which leaves least: its own only where it is less white. What
/// leaves more does not hold more evidence for being whiter, and were it otherwise, of three each might be preferred to the next.
fn scale_of<'a, T>(one: &'a Hypothesis<T>, best: &'a Hypothesis<T>) -> &'a Hypothesis<T> {
    let effective = |h: &Hypothesis<T>| h.misfits.iter().map(ChannelMisfit::effective).sum::<f64>().max(1e-300);
    let (own, of_best) = (effective(one), effective(best));
    let scatter = AS_WHITE.max(1.0 + SCATTER / own.min(of_best).sqrt());
    let as_white = own * scatter > of_best;
    if as_white || squares(one) <= (1.0 + ALIKE_LEFT) * squares(best) { best } else { one }
}

/// By how much the evidence prefers `a` to `b`, two alternatives to `first` of which neither need contain the other: what the
/// recordings say, and what the twin says of its own parameters.
pub(super) fn lead<T: Twin>(inquiry: &Inquiry<'_, T>, first: &Hypothesis<T>, a: &Hypothesis<T>, b: &Hypothesis<T>) -> f64 {
    let by_own = plausibility(inquiry, &a.fit.values) - plausibility(inquiry, &b.fit.values);
    let evidence = evidence(inquiry, first, a, b);
    if !alike(inquiry, first, a, b) {
        return evidence + by_own;
    }
    // What says the same is told apart by its length, and by whether it lets what rested begin at rest.
    let said = match b.free() as f64 - a.free() as f64 {
        0.0 => match ageing(inquiry, a).cmp(&ageing(inquiry, b)) {
            // What is the same at all times explains more than what happens to change as if it were.
            Ordering::Greater => -INDIFFERENT,
            Ordering::Less => INDIFFERENT,
            Ordering::Equal => evidence.clamp(-INDIFFERENT, INDIFFERENT),
        },
        longer => longer * (1.0 + least_left(a, b).misfits.iter().map(ChannelMisfit::effective).sum::<f64>()).ln(),
    };
    said + by_own + (rested(a) - rested(b)).clamp(-FIRST_MOMENTS, FIRST_MOMENTS)
}

/// How many of the laws of `hypothesis` are others at other times.
fn ageing<T: Twin>(inquiry: &Inquiry<'_, T>, hypothesis: &Hypothesis<T>) -> usize {
    hypothesis.added.iter().filter(|number| inquiry.candidates[**number].ages).count()
}

/// The same by what they leave alone, also where that is alike.
pub(super) fn evidence<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    first: &Hypothesis<T>,
    a: &Hypothesis<T>,
    b: &Hypothesis<T>,
) -> f64 {
    let best = least_left(a, b);
    weighed(inquiry, first, a, scale_of(a, best)) - weighed(inquiry, first, b, scale_of(b, best))
}

/// What counting constants charges too much for those that `more` has beyond `less`: it takes each for known as well as so many rows
/// could tell, where Laplace's approximation charges twice the logarithm of how much narrower the data make what is possible
/// (Kass & Raftery, "Bayes factors", Journal of the American Statistical Association 90 (1995)). Constants that data do not tell cost
/// nothing.
pub(super) fn left_open<T: Twin>(inquiry: &Inquiry<'_, T>, less: &Hypothesis<T>, more: &Hypothesis<T>) -> f64 {
    let Some(candidate) = more.added.last().map(|number| &inquiry.candidates[*number]) else { return 0.0 };
    let own = &candidate.form.parameters;
    let from = more.fit.std.len().saturating_sub(own.len());
    let whole = (1.0 + least_left(less, more).misfits.iter().map(ChannelMisfit::effective).sum::<f64>()).ln();
    // Nothing of what is infinitely unsure, all of what is known exactly.
    let charged = |(parameter, std): (&Parameter, &f64)| {
        let possible = parameter.starts.iter().fold(parameter.scale(), |most, start| most.max(start.abs()));
        (possible / std).powi(2).ln_1p()
    };
    let mut saved: Vec<f64> = own.iter().zip(&more.fit.std[from..]).map(|one| (whole - charged(one)).max(0.0)).collect();
    saved.sort_by(|a, b| b.total_cmp(a));
    saved.iter().take(more.free().saturating_sub(less.free())).sum()
}

/// Of two hypotheses the one that leaves less.
fn least_left<'a, T>(a: &'a Hypothesis<T>, b: &'a Hypothesis<T>) -> &'a Hypothesis<T> {
    if squares(a) <= squares(b) { a } else { b }
}

/// Twice the logarithm of how plausible the twin's own parameters are, by a Student's t distribution about what the twin says: what
/// is said of uncertainties is uncertain too.
pub(super) fn plausibility<T: Twin>(inquiry: &Inquiry<'_, T>, values: &[f64]) -> f64 {
    let parameters = inquiry.twin.parameters().iter().zip(values);
    let distances =
        parameters.filter_map(|(p, value)| p.prior.filter(|std| *std > 0.0).map(|std| (value - p.nominal) / std));
    distances.map(|z| -(FREEDOM + 1.0) * (z * z / FREEDOM).ln_1p()).sum()
}

/// The least part of the parent's residual that a further mechanism has to explain to be needed.
pub(super) fn needed_share<T: Twin>(inquiry: &Inquiry<'_, T>, first: &Hypothesis<T>, parent: &Hypothesis<T>) -> f64 {
    if parent.added.is_empty() {
        return 0.0;
    }
    let least = |(first, left): (&ChannelMisfit, &ChannelMisfit)| {
        let most = (share_of(inquiry.twin.clock(), parent.added.len() + 1) * above_noise(first, left.level))
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

/// Sum of squared residuals of all channels.
pub(super) fn squares<T>(hypothesis: &Hypothesis<T>) -> f64 {
    hypothesis.misfits.iter().map(|m| m.sum_of_squares).sum()
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
    let enough = whole.added.len() == 1
        || first
            .misfits
            .iter()
            .zip(&less.misfits)
            .zip(&whole.misfits)
            .any(|((first, less), last)| explains_enough(inquiry.twin.clock(), whole.added.len(), [first, less, last]));
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
    let few = restored >= FEW_ROWS && restored as f64 >= MOST * moved as f64;
    let pairs: Vec<[f64; 2]> = (0..rows).map(|i| [less.fit.residual[i], whole.fit.residual[i]]).collect();
    let seen = inquiry.twin.clock() == Clock::Event && (few || takes_away(&pairs) || most_of_few(moved, rows));
    let spread = rows > 40 * INFORMATIVE_ROWS && second * second >= INFORMATIVE_ROWS as f64 * fourth;
    enough && (spread || seen || moved >= INFORMATIVE_ROWS)
}

/// Whether so many are most of all the messages there are, where these are no more than a few times as many as would tell of anything.
fn most_of_few(moved: usize, messages: usize) -> bool {
    messages <= INFORMATIVE_ROWS && moved >= 2 * FEW_ROWS && moved as f64 >= MOST * messages as f64
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
    before > 0.0 && after <= (1.0 - TAKEN_AWAY) * before && before * before >= FEW_ROWS as f64 * fourth
}

/// `sum N_e ln(RSS0 / RSS1) - dk ln N_e`, with the effective number of residuals of the *alternative*: autocorrelated
/// noise then does not look like evidence.
pub(super) fn gain<T: Twin>(inquiry: &Inquiry<'_, T>, null: &Hypothesis<T>, alternative: &Hypothesis<T>) -> f64 {
    weighed(inquiry, null, alternative, alternative)
}

/// The same with the effective number of residuals of `scale`.
fn weighed<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    null: &Hypothesis<T>,
    alternative: &Hypothesis<T>,
    scale: &Hypothesis<T>,
) -> f64 {
    let mut gain = 0.0;
    let mut effective = 1.0;
    for ((null, other), scale) in null.misfits.iter().zip(&alternative.misfits).zip(&scale.misfits) {
        let rounding = inquiry.evidence.rounding_of(&other.channel).max(1e-9) * other.count as f64;
        gain += scale.effective() * ((null.sum_of_squares + rounding) / (other.sum_of_squares + rounding)).ln();
        effective += scale.effective();
    }
    gain - (alternative.free() as f64 - null.free() as f64) * effective.ln()
}

/// `less`, which is a part of `best`, with another candidate: fitted to its end if it comes near `best` in a few steps.
pub(super) fn pursued<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    first: &Hypothesis<T>,
    best: &Hypothesis<T>,
    less: &Hypothesis<T>,
    one: &Screened,
) -> Hypothesis<T> {
    let briefly = inquiry.instead(best, less, one, Effort::Brief);
    if lead(inquiry, first, best, &briefly) < HOPELESS { inquiry.refitted(&briefly) } else { briefly }
}

#[cfg(test)]
pub(super) mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;
    use crate::sim2real::identify::{Fit, State};

    /// What leaves a mean square of 6,000 residuals, as many of which are effective as that.
    pub fn leaving(mean_square: f64, effective: f64) -> Hypothesis<()> {
        let count = 6_000;
        let misfit = ChannelMisfit {
            channel: "position".into(),
            sum_of_squares: mean_square * count as f64,
            count,
            autocorrelation_time: count as f64 / effective,
            level: 1.0,
        };
        let fit = Fit {
            values: Vec::new(),
            std: Vec::new(),
            covariance: None,
            free: Vec::new(),
            state: State { initial: Vec::new(), values: Vec::new(), misfit: 1.0 },
            initial_std: Vec::new(),
            residual: DVector::zeros(0),
            jacobian: DMatrix::zeros(0, 0),
            rank: 0,
            prior: 0.0,
            at_bound: Vec::new(),
        };
        Hypothesis { twin: (), added: Vec::new(), fit, misfits: vec![misfit] }
    }

    #[test]
    fn what_leaves_more_is_weighed_as_what_leaves_least_unless_it_is_less_white() {
        let best = leaving(5.0, 87.0);
        let by_the_best = |other: &Hypothesis<()>| std::ptr::eq(scale_of(other, &best), &raw const best);
        assert!(by_the_best(&leaving(7.3, 111.0)) && by_the_best(&leaving(13.5, 400.0)), "whiter");
        assert!(by_the_best(&leaving(7.3, 70.0)), "as white, for so few are known to two fifths");
        assert!(!by_the_best(&leaving(7.3, 30.0)), "less white");
        assert!(by_the_best(&leaving(5.1, 30.0)), "no more than is left of the best");
        let white = leaving(1.0, 5_000.0);
        assert!(std::ptr::eq(scale_of(&leaving(1.2, 4_500.0), &white), &raw const white));
        let less_white = leaving(1.2, 3_500.0);
        assert!(std::ptr::eq(scale_of(&less_white, &white), &raw const less_white), "of many the number is known well");
    }

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
        assert!(!takes_away(&[[-30.0, 0.0]; 3]) && takes_away(&[[-30.0, 0.0]; 4]) && !takes_away(&[]));
    }

    #[test]
    fn one_offset_is_something_however_little_it_counts() {
        // A small offset beside the noise: hardly more than that in size, and three residuals in evidence.
        let offset = leaving(1.38, 3.0);
        assert!(offset.within(1.5) && offset.leaves_something());
        assert!(!leaving(1.0, 5_900.0).leaves_something(), "white noise");
        let mut coloured = leaving(9.0, 600.0);
        coloured.misfits[0].level = 9.0;
        assert!(!coloured.leaves_something(), "noise that remembers itself");
    }
}
