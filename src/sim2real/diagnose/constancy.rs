//! Constancy: whether the constants of what was named are the same where they were not fitted.
//!
//! A law that stands for another can be bent until it follows one recording, and is bent otherwise by the next: friction that acts in one
//! direction alone goes for a wrong gain of that side, of as much as the motion at hand makes of it. So where what was named leaves more
//! than noise of the held-out rows, it is asked what constants would explain those; what is named remains as it is.
//!
//! Source: Chow, "Tests of equality between sets of coefficients in two linear regressions", Econometrica 28 (1960).

use super::decision::ABOVE_THE_NOISE;
use super::diagnosis::ChannelFit;
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
    if !asked || selected.added.is_empty() || !fits.iter().any(|fit| left(fit) > ABOVE_THE_NOISE) {
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
    let constants = (0..selected.added.len()).flat_map(|place| {
        let lasting = inquiry.candidates[selected.added[place]].about.site != Site::Observation;
        inquiry.of_mechanism(selected, place).filter(move |_| lasting).map(move |k| (place, k))
    });
    let moved = constants.filter_map(|(place, k)| {
        let parameter = &selected.twin.parameters()[k];
        let values = [fit.values[k], refitted.fit.values[k]];
        let by = apart(values, [std[k], std_there[k]])?;
        (parameter.unit != "s" && parameter.shown.is_none()).then_some((by, place, k, values))
    });
    let (_, place, k, values) = moved.max_by(|a, b| a.0.total_cmp(&b.0))?;
    let parameter = &selected.twin.parameters()[k];
    let unit = inquiry.twin.unit(&parameter.unit);
    let [here, elsewhere] = values.map(|value| format!("{} {unit}", words::figure(value, 3)).trim_end().to_owned());
    let name = inquiry.candidates[selected.added[place]].about.name;
    Some(format!(
        "{name}.{} is {here} where it was fitted, and {elsewhere} would explain what it leaves elsewhere",
        parameter.name
    ))
}

/// The mean square that is left of held-out rows, in units of the noise.
fn left(fit: &ChannelFit) -> f64 {
    (fit.trued_rmse / fit.noise_floor).powi(2)
}

/// Whether what was `refitted` to the held-out rows explains them where they were off.
fn explains<T>(selected: &Hypothesis<T>, refitted: &Hypothesis<T>, fits: &[ChannelFit]) -> bool {
    fits.iter().filter(|fit| left(fit) > ABOVE_THE_NOISE).all(|fit| {
        let level = selected.misfits.iter().find(|m| m.channel == fit.channel).map_or(1.0, |m| m.level);
        let own = refitted.misfits.iter().find(|m| m.channel == fit.channel);
        own.is_some_and(|m| m.sum_of_squares / (level * m.count.max(1) as f64) - 1.0 < LEFT * (left(fit) - 1.0))
    })
}

/// By how many standard deviations of both two values of a constant differ, if they do.
fn apart([here, there]: [f64; 2], std: [f64; 2]) -> Option<f64> {
    let (by, scatter) = ((here - there).abs(), std[0].hypot(std[1]));
    let differ = by > DIFFERENT * here.abs().max(there.abs()) && by > BEYOND_CHANCE * scatter && scatter > 0.0;
    differ.then(|| by / scatter)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constants_differ_by_a_quarter_and_beyond_chance() {
        assert_eq!(apart([1.0, 0.5], [0.06, 0.08]), Some(5.0));
        assert_eq!(apart([1.0, 0.8], [0.001, 0.001]), None, "the same law in another form");
        assert_eq!(apart([1.0, 0.5], [0.3, 0.1]), None, "hardly known");
        assert_eq!(apart([1.0, 0.5], [f64::INFINITY, 0.1]), None, "not known");
        assert_eq!(apart([1.0, 0.5], [0.0, 0.0]), None, "not fitted");
    }
}
