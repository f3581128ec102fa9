//! Constancy: whether the constants of what was named are the same where they were not fitted.
//!
//! A law that stands for another can be bent until it follows one recording, and is bent otherwise by the next: friction that acts in one
//! direction alone goes for a wrong gain of that side, of as much as the motion at hand makes of it. So where what was named leaves more
//! than noise of the held-out rows, it is asked what constants would explain those; what is named remains as it is.
//!
//! Source: Chow, "Tests of equality between sets of coefficients in two linear regressions", Econometrica 28 (1960).

use super::decision::ABOVE_THE_NOISE;
use super::diagnosis::ChannelFit;
use super::held_out::above_the_noise;
use super::hypothesis::{Hypothesis, Inquiry};
use super::{uncertainty, words};
use crate::sim2real::identify::{Effort, Fit};
use crate::sim2real::{Clock, Site, Twin};

/// Other constants must leave at most this part of what is above the noise where they are fitted.
const LEFT: f64 = 0.5;
/// Constants are others where they differ by more than this part of the larger, which no other form of the same law makes of them, ...
const DIFFERENT: f64 = 0.25;
/// ... and by more than so many standard deviations of both.
const BEYOND_CHANCE: f64 = 2.0;

/// What is to be said of the constant that changes most, if one does.
///
/// It is a free run that tells. A time may be that of an event, which is another one in each recording, and what a sensor is off by may be
/// another each time it is switched on: neither has to stay.
pub(super) fn changed<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    selected: &Hypothesis<T>,
    trued: (&Fit, &[f64]),
    fits: &[ChannelFit],
) -> Option<String> {
    let asked = inquiry.twin.clock() != Clock::Event && inquiry.evidence.window.is_none() && !inquiry.evidence.sparse;
    if !asked || selected.added.is_empty() || !fits.iter().any(off) {
        return None;
    }
    let evidence = inquiry.evidence.of_held_out();
    let there = Inquiry { evidence: &evidence, ..*inquiry };
    let (fit, std) = trued;
    let refitted = there.begun(selected.twin.clone(), selected.added.clone(), &fit.values, None, Effort::Thorough);
    if !explains(selected, &refitted, fits) {
        return None;
    }
    let std_there = uncertainty::inflated(&there, &refitted, &refitted.fit);
    let lasting = |place: &usize| inquiry.candidates[selected.added[*place]].about.site != Site::Observation;
    let moved = (0..selected.added.len()).filter(lasting).filter_map(|place| {
        let parameters = selected.twin.parameters();
        let constants = inquiry.of_mechanism(selected, place);
        let constants = constants.filter(|k| parameters[*k].unit != "s" && parameters[*k].shown.is_none());
        let asked = constants.map(|k| (k, Constant::of([fit.values[k], refitted.fit.values[k]], [std[k], std_there[k]])));
        Some((place, most_moved(asked.collect())?))
    });
    let (place, (_, k)) = moved.max_by(|a, b| a.1.0.total_cmp(&b.1.0))?;
    let values = [fit.values[k], refitted.fit.values[k]];
    let parameter = &selected.twin.parameters()[k];
    let unit = inquiry.twin.unit(&parameter.unit);
    let [here, elsewhere] = values.map(|value| format!("{} {unit}", words::figure(value, 3)).trim_end().to_owned());
    let name = inquiry.candidates[selected.added[place]].about.name;
    Some(format!(
        "{name}.{} is {here} where it was fitted, and {elsewhere} would explain what it leaves elsewhere",
        parameter.name
    ))
}

/// Whether what was named leaves more than noise of held-out rows that the twin without it does not explain either.
fn off(fit: &ChannelFit) -> bool {
    left(fit) > ABOVE_THE_NOISE && above_the_noise(fit)
}

/// The mean square that is left of held-out rows, in units of the noise.
fn left(fit: &ChannelFit) -> f64 {
    (fit.trued_rmse / fit.noise_floor).powi(2)
}

/// Whether what was `refitted` to the held-out rows explains them where they were off.
fn explains<T>(selected: &Hypothesis<T>, refitted: &Hypothesis<T>, fits: &[ChannelFit]) -> bool {
    fits.iter().filter(|fit| off(fit)).all(|fit| {
        let level = selected.misfits.iter().find(|m| m.channel == fit.channel).map_or(1.0, |m| m.level);
        let own = refitted.misfits.iter().find(|m| m.channel == fit.channel);
        own.is_some_and(|m| m.sum_of_squares / (level * m.count.max(1) as f64) - 1.0 < LEFT * (left(fit) - 1.0))
    })
}

/// What becomes of a constant where it was not fitted.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Constant {
    /// It is another, by so many standard deviations of both values.
    Moves(f64),
    /// It is known well enough to say that it is the same.
    Stays,
    /// It may be the same.
    Open,
}

impl Constant {
    fn of([here, there]: [f64; 2], std: [f64; 2]) -> Self {
        let (by, scatter) = ((here - there).abs(), std[0].hypot(std[1]));
        let different = DIFFERENT * here.abs().max(there.abs());
        match by > different {
            true if by > BEYOND_CHANCE * scatter && scatter > 0.0 => Self::Moves(by / scatter),
            false if scatter > 0.0 && BEYOND_CHANCE * scatter < different => Self::Stays,
            _ => Self::Open,
        }
    }
}

/// The constant of one law that moves most, and by how much; none where another of it stays: one of several may stand for what its form
/// is off by, as the stiffness of what meets behind a gap.
fn most_moved(constants: Vec<(usize, Constant)>) -> Option<(f64, usize)> {
    if constants.iter().any(|(_, constant)| *constant == Constant::Stays) {
        return None;
    }
    let moved = constants.into_iter().filter_map(|(k, constant)| match constant {
        Constant::Moves(by) => Some((by, k)),
        _ => None,
    });
    moved.max_by(|a, b| a.0.total_cmp(&b.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constants_differ_by_a_quarter_and_beyond_chance() {
        assert_eq!(Constant::of([1.0, 0.5], [0.06, 0.08]), Constant::Moves(5.0));
        assert_eq!(Constant::of([1.0, 0.8], [0.001, 0.001]), Constant::Stays, "the same law in another form");
        assert_eq!(Constant::of([1.0, 0.9], [0.2, 0.001]), Constant::Open, "hardly known");
        assert_eq!(Constant::of([1.0, 0.5], [0.3, 0.1]), Constant::Open, "hardly known, and another");
        assert_eq!(Constant::of([1.0, 0.5], [f64::INFINITY, 0.1]), Constant::Open, "not known");
        assert_eq!(Constant::of([1.0, 1.0], [0.0, 0.0]), Constant::Open, "not fitted");
    }

    #[test]
    fn a_law_of_which_one_constant_stays_is_that_law() {
        let [moves, more] = [Constant::Moves(3.0), Constant::Moves(7.0)];
        assert_eq!(most_moved(vec![(4, moves), (5, Constant::Open), (6, more)]), Some((7.0, 6)));
        assert_eq!(most_moved(vec![(4, moves), (5, Constant::Stays)]), None);
        assert_eq!(most_moved(vec![(4, Constant::Open)]), None);
    }
}
