//! Weighing: what the evidence says of one hypothesis beside another.

use std::cmp::Ordering;

use super::hypothesis::{Hypothesis, Inquiry};
use super::rested::rested;
use super::whiteness::ChannelMisfit;
use crate::sim2real::{Clock, Parameter, Twin};

/// A mechanism must gain more than this to be added.
pub(super) const ACCEPT: f64 = 10.0;
/// What is selected is complete if it leaves a mean squared residual of at most this many times the noise.
pub(super) const ABOVE_NOISE: f64 = 1.5;
/// Mean squares of residuals, in units of the noise, that are no further apart than this say the same ...
const TOLERATED: f64 = 0.03;
/// ... where that is no more than this part of what they explain.
const NEXT_TO_NOTHING: f64 = 0.01;
/// The evidence between two that say the same in as many constants counts up to this: of 45 names of five spent test seeds that were told
/// apart by no more, 37 were right, and twice the logarithm of such odds is 3 ...
const INDIFFERENT: f64 = 3.0;
/// ... or this part of it, if that is more: what laws' forms are off by bends it. As much as 8 has been for the wrong one, more than 11 never
/// was (5 pairs of development seed 80 and of a spent test seed).
const BENT: f64 = 1.0 / 3.0;
/// Of two that leave as little, whether or not one is whiter, the evidence between them counts no more than this: the other is not excluded.
const AS_LITTLE: f64 = 8.0;
/// Laws that are met less often by themselves are held to be so many times less likely, as twice the logarithm: e to one.
const SELDOM: f64 = 2.0;
/// How a recording begins counts no more than this, twice the logarithm of twenty: laws of what is elastic or loose hold least in the
/// first moments.
const FIRST_MOMENTS: f64 = 6.0;
/// Degrees of freedom of what a twin says of its parameters' uncertainty.
const FREEDOM: f64 = 4.0;
/// What is lost in twice the logarithm of how plausible the twin's own parameters are, where one is nine standard deviations off.
const IMPLAUSIBLE: f64 = 15.0;
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
        let simplest = (1..order.len())
            .filter(|k| alike(inquiry.twin.clock(), reference, best, &order[*k]))
            .min_by_key(|k| order[*k].free());
        if let Some(k) = simplest.filter(|k| order[*k].free() < best.free()) {
            order[..=k].rotate_right(1);
        }
    }
    order
}

/// Whether two alternatives to `first` leave the same but for what steps of integration and forms of laws are off by: less than
/// the noise by far, and next to nothing of what either explains. Of messages laws have the form they are written in; and where one
/// leaves noise and nothing else, and the other what is less white, the form of that one is off by nothing.
fn alike<T>(clock: Clock, first: &Hypothesis<T>, a: &Hypothesis<T>, b: &Hypothesis<T>) -> bool {
    let [best, other] = if squares(a) <= squares(b) { [a, b] } else { [b, a] };
    nearly_alike(clock, first, a, b) && (!best.leaves_nothing() || as_white(other, best))
}

/// The same by what they leave alone, of whatever colour.
fn nearly_alike<T>(clock: Clock, first: &Hypothesis<T>, a: &Hypothesis<T>, b: &Hypothesis<T>) -> bool {
    let noise: f64 = a.misfits.iter().zip(&b.misfits).map(|(a, b)| a.level.min(b.level) * a.count as f64).sum();
    let apart = (squares(a) - squares(b)).abs();
    clock != Clock::Event
        && apart <= TOLERATED * noise
        && apart <= NEXT_TO_NOTHING * (squares(first) - squares(a).min(squares(b)))
}

/// By whose number of effective residuals `one` is weighed beside `best`, which leaves least: its own only where it is less white. What
/// leaves more does not hold more evidence for being whiter, and were it otherwise, of three each might be preferred to the next.
fn scale_of<'a, T>(one: &'a Hypothesis<T>, best: &'a Hypothesis<T>) -> &'a Hypothesis<T> {
    if as_white(one, best) || squares(one) <= (1.0 + ALIKE_LEFT) * squares(best) { best } else { one }
}

/// Whether what `one` leaves is as white as what `best` leaves, as far as the scatter of that tells.
fn as_white<T>(one: &Hypothesis<T>, best: &Hypothesis<T>) -> bool {
    let effective = |h: &Hypothesis<T>| h.misfits.iter().map(ChannelMisfit::effective).sum::<f64>().max(1e-300);
    let (own, of_best) = (effective(one), effective(best));
    let scatter = AS_WHITE.max(1.0 + SCATTER / own.min(of_best).sqrt());
    own * scatter > of_best
}

/// By how much the evidence prefers `a` to `b`, two alternatives to `first` of which neither need contain the other: what the
/// recordings say, and what the twin says of its own parameters.
pub(super) fn lead<T: Twin>(inquiry: &Inquiry<'_, T>, first: &Hypothesis<T>, a: &Hypothesis<T>, b: &Hypothesis<T>) -> f64 {
    let by_own = beforehand(inquiry, a) - beforehand(inquiry, b);
    let evidence = evidence(inquiry, first, a, b);
    if !alike(inquiry.twin.clock(), first, a, b) {
        // Of as many constants, the one that leaves noise alone is preferred; the form of a third may have bent the other.
        let as_long = a.free() == b.free() && nearly_alike(inquiry.twin.clock(), first, a, b);
        return if as_long { evidence.clamp(-AS_LITTLE, AS_LITTLE) } else { evidence } + by_own;
    }
    // What says the same is told apart by its length, and by whether it lets what rested begin at rest.
    let said = match b.free() as f64 - a.free() as f64 {
        0.0 => match ageing(inquiry, a).cmp(&ageing(inquiry, b)) {
            // What is the same at all times explains more than what happens to change as if it were.
            Ordering::Greater => -INDIFFERENT,
            Ordering::Less => INDIFFERENT,
            Ordering::Equal => between_equals(evidence),
        },
        longer => longer * (1.0 + least_left(a, b).misfits.iter().map(ChannelMisfit::effective).sum::<f64>()).ln(),
    };
    said + by_own + (rested(a) - rested(b)).clamp(-FIRST_MOMENTS, FIRST_MOMENTS)
}

/// The same where both are known to say different things, however little they leave differs.
pub(super) fn lead_unlike<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    first: &Hypothesis<T>,
    a: &Hypothesis<T>,
    b: &Hypothesis<T>,
) -> f64 {
    evidence(inquiry, first, a, b) + beforehand(inquiry, a) - beforehand(inquiry, b)
}

/// What counts of the `evidence` between two that say the same in as many constants.
fn between_equals(evidence: f64) -> f64 {
    let size = evidence.abs();
    size.min(INDIFFERENT).max(BENT * size).min(AS_LITTLE).copysign(evidence)
}

/// Twice the logarithm of how likely `hypothesis` is before anything is recorded, but for what all have in common.
fn beforehand<T: Twin>(inquiry: &Inquiry<'_, T>, hypothesis: &Hypothesis<T>) -> f64 {
    let seldom = hypothesis.added.iter().filter(|number| inquiry.candidates[**number].seldom).count();
    plausibility(inquiry, &hypothesis.fit.values) - SELDOM * seldom as f64
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

/// Whether `hypothesis` explains what was recorded by parameters of the twin's own that what the twin says of them makes implausible: then
/// it may stand for another that leaves them where they are.
pub(super) fn strained<T: Twin>(inquiry: &Inquiry<'_, T>, hypothesis: &Hypothesis<T>) -> bool {
    hypothesis.within(ABOVE_NOISE) && plausibility(inquiry, &hypothesis.fit.values) < -IMPLAUSIBLE
}

/// Sum of squared residuals of all channels.
pub(super) fn squares<T>(hypothesis: &Hypothesis<T>) -> f64 {
    hypothesis.misfits.iter().map(|m| m.sum_of_squares).sum()
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
            one_colour: true,
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
    fn little_evidence_between_equals_counts_whole_and_much_in_part() {
        assert_eq!([2.0, 8.0, -8.0, 18.0, 26.0, -400.0].map(between_equals), [2.0, 3.0, -3.0, 6.0, 8.0, -8.0]);
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
    fn one_offset_is_something_however_little_it_counts() {
        // A small offset beside the noise: hardly more than that in size, and three residuals in evidence.
        let offset = leaving(1.38, 3.0);
        assert!(offset.within(1.5) && offset.leaves_something());
        assert!(!leaving(1.0, 5_900.0).leaves_something(), "white noise");
        let mut coloured = leaving(9.0, 600.0);
        coloured.misfits[0].level = 9.0;
        assert!(!coloured.leaves_something(), "noise that remembers itself");
    }

    #[test]
    fn what_leaves_noise_alone_is_not_like_what_leaves_as_little_and_less_white() {
        let sampled = Clock::Sampled { longest_step: 0.01 };
        let first = leaving(50.0, 30.0);
        let like = |a: &Hypothesis<()>, b: &Hypothesis<()>| {
            let both = [alike(sampled, &first, a, b), alike(sampled, &first, b, a)];
            assert_eq!(both[0], both[1], "whichever comes first");
            both[0]
        };
        let right = leaving(1.008, 6_000.0);
        assert!(like(&right, &leaving(1.025, 5_500.0)), "as white: a form may be off by that");
        assert!(!like(&right, &leaving(1.025, 1_000.0)), "something is in it");
        assert!(like(&leaving(1.15, 1_200.0), &leaving(1.17, 600.0)), "in both something is");
        assert!(!like(&right, &leaving(1.06, 5_500.0)), "more than a form is off by");
        assert!(!alike(Clock::Event, &first, &right, &right), "messages have the forms laws are written in");
    }
}
