//! Held-out data: what they leave of a channel, and whether they speak for what was named.

use super::Comparison;
use super::diagnosis::ChannelFit;
use super::hypothesis::Hypothesis;
use super::needed::INFORMATIVE_ROWS;
use super::remainder::MOSTLY_LEFT;
use super::weigh::ABOVE_NOISE;
use super::whiteness::ChannelMisfit;

/// A remainder above this part of the first misfit is more than an error of form.
pub(super) const FORM_ERROR: f64 = 0.10;
/// The mean square of the noise is known to this factor.
const NOISE_KNOWN: f64 = 1.05;
/// A twin whose mean squared residual is this many times the noise does not explain the recordings, whether or not
/// anything foretells what is left.
pub(super) const FAR_ABOVE_THE_NOISE: f64 = 9.0;
/// What a regression foretells counts where the mean squared residual is more than this many times the noise.
pub(super) const HARDLY_ABOVE: f64 = 1.2;
/// Noise does not grow from one recording to another: a mean squared residual this many times that of the fitted rows is something else, ...
const GROWN: f64 = 1.3;
/// ... beyond so many standard deviations of its logarithm by chance.
const BY_CHANCE: f64 = 3.0;
/// Larger by less than this, an error is as large.
const WORSE: f64 = 1.02;

/// The part of the recalibrated misfit above the noise that is left on held-out data; the noise is known to
/// [`NOISE_KNOWN`].
pub(super) fn held_out_remainder(fit: &ChannelFit) -> f64 {
    let above = |rmse: f64, known: f64| (rmse * rmse - known * fit.noise_floor * fit.noise_floor).max(0.0);
    let misfit = above(fit.recalibrated_rmse, 1.0);
    if misfit > 0.0 { above(fit.trued_rmse, NOISE_KNOWN) / misfit } else { 0.0 }
}

/// Whether so much is left on held-out signals that what was named does not explain them.
pub(super) fn fails_unseen(fit: &ChannelFit) -> bool {
    let remainder = held_out_remainder(fit);
    far_off(fit) && remainder > FORM_ERROR || remainder > MOSTLY_LEFT
}

/// Whether the recalibrated twin leaves more than the noise on held-out data.
pub(super) fn above_the_noise(fit: &ChannelFit) -> bool {
    fit.recalibrated_rmse * fit.recalibrated_rmse > HARDLY_ABOVE * fit.noise_floor * fit.noise_floor
}

/// The same beyond chance: of noise that remembers itself, few rows are independent, and one recording may have more of it than another.
pub(super) fn visible<T>(fit: &ChannelFit, selected: &Hypothesis<T>) -> bool {
    above_the_noise(fit) && beyond_chance(fit.recalibrated_rmse, fit, selected)
}

/// Whether the trued twin leaves so much more than the noise on held-out data, beyond chance, that what was named may not be all.
pub(super) fn leaves_more<T>(fit: &ChannelFit, selected: &Hypothesis<T>) -> bool {
    let noise = fit.noise_floor.powi(2);
    fit.trued_rmse.powi(2) > ABOVE_NOISE * noise && beyond_chance(fit.trued_rmse, fit, selected)
}

/// Whether an error is larger than what noise that remembers itself may come to in one recording.
fn beyond_chance<T>(rmse: f64, fit: &ChannelFit, selected: &Hypothesis<T>) -> bool {
    let coloured = |misfit: &&ChannelMisfit| misfit.channel == fit.channel && misfit.level > 1.0 && misfit.one_colour;
    let by_chance = selected.misfits.iter().find(coloured).map_or(1.0, by_chance);
    rmse.powi(2) > by_chance * fit.noise_floor.powi(2)
}

/// What noise leaves at the most in one recording, times what it left in the fitted one, if as much is held out as was fitted.
fn by_chance(fitted: &ChannelMisfit) -> f64 {
    (BY_CHANCE * 2.0 / fitted.effective().max(1.0).sqrt()).exp()
}

/// Whether what was named does worse on held-out data than nothing.
pub(super) fn worse(fit: &ChannelFit) -> bool {
    fit.trued_rmse > WORSE * fit.recalibrated_rmse
}

/// Whether what is left on held-out data stands far above the noise.
pub(super) fn far_off(fit: &ChannelFit) -> bool {
    fit.trued_rmse * fit.trued_rmse > FAR_ABOVE_THE_NOISE * fit.noise_floor * fit.noise_floor
}

/// Whether what was named does better on held-out data, by more than chance. Of messages one alone may tell of it: whichever of them are
/// drawn, it is never worse.
pub(super) fn confirms(fit: &ChannelFit, sampled: bool) -> bool {
    let least = fit.improvement_ci95[0];
    least > 0.0 || !sampled && least >= 0.0 && fit.trued_rmse < fit.recalibrated_rmse
}

/// Whether what was named moves no more than a few of the held-out rows, in any channel: where it moves many, and they do not confirm it, they
/// say that it is not so.
pub(super) fn few_tell(comparisons: &[Comparison]) -> bool {
    comparisons.iter().filter(|comparison| comparison.held_out).all(|comparison| {
        let rows = comparison.trued.iter().zip(&comparison.recalibrated).zip(&comparison.measured);
        let moved = rows.filter(|(_, measured)| measured.is_some()).map(|((trued, recalibrated), _)| trued - recalibrated);
        let (second, fourth) = moved.fold((0.0, 0.0), |(s, f), d| (s + d * d, f + d.powi(4)));
        second * second < INFORMATIVE_ROWS as f64 * fourth || second == 0.0
    })
}

/// Whether held-out errors speak for what was named, though not by more than chance.
pub(super) fn better(fits: &[ChannelFit]) -> bool {
    fits.iter().any(|fit| fit.trued_rmse < fit.recalibrated_rmse) && !fits.iter().any(worse)
}

/// Whether more is left of held-out rows than noise leaves that leaves as much as this of the fitted ones.
pub(super) fn grown<T>(fit: &ChannelFit, selected: &Hypothesis<T>) -> bool {
    let Some(own) = selected.misfits.iter().find(|misfit| misfit.channel == fit.channel) else { return false };
    let fitted = (own.sum_of_squares / (own.level * own.count.max(1) as f64)).max(1.0);
    fit.recalibrated_rmse.powi(2) > GROWN.max(by_chance(own)) * fitted * fit.noise_floor.powi(2)
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::weigh::tests::leaving;
    use super::*;
    use crate::sim2real::Clock;

    /// A channel that is off by so much on held-out data, recalibrated and trued, in units of the noise.
    pub fn error(recalibrated_rmse: f64, trued_rmse: f64) -> ChannelFit {
        ChannelFit {
            channel: "position".into(),
            unit: "rad".into(),
            noise_floor: 1.0,
            nominal_rmse: 20.0,
            recalibrated_rmse,
            trued_rmse,
            nominal_mae: 20.0,
            recalibrated_mae: recalibrated_rmse,
            trued_mae: trued_rmse,
            improvement_ci95: [0.0, 0.0],
        }
    }

    #[test]
    fn errors_are_held_to_the_noise_and_to_each_other() {
        assert!(worse(&error(2.0, 2.1)) && !worse(&error(2.0, 2.0)));
        assert!(above_the_noise(&error(1.2, 1.0)) && !above_the_noise(&error(1.05, 1.0)));
        assert!(far_off(&error(9.0, 3.1)) && !far_off(&error(9.0, 2.9)));
        assert!(fails_unseen(&error(9.0, 3.1)), "a tenth of the misfit is left, far above the noise");
        assert!(!fails_unseen(&error(9.0, 2.9)), "and close to it that is an error of form");
        assert!(fails_unseen(&error(3.0, 2.0)), "unless it is a third");
    }

    #[test]
    fn what_noise_may_leave_by_chance_is_not_off() {
        assert!(visible(&error(1.2, 1.2), &leaving(1.0, 6_000.0)), "of many rows");
        let mut coloured = leaving(7.0, 230.0);
        assert!(visible(&error(1.2, 1.1), &coloured), "what is slower than noise");
        coloured.misfits[0].level = 7.0;
        assert!(!visible(&error(1.2, 1.1), &coloured), "of so few it may be chance");
        assert!(visible(&error(1.3, 1.1), &coloured));
        coloured.misfits[0].one_colour = false;
        assert!(visible(&error(1.2, 1.1), &coloured), "and what has two colours may be no noise");
    }

    #[test]
    fn what_names_leave_elsewhere_is_half_as_much_as_noise_and_more() {
        let white = leaving(1.0, 6_000.0);
        assert!(leaves_more(&error(2.0, 1.36), &white) && !leaves_more(&error(2.0, 1.19), &white));
        let mut coloured = leaving(7.0, 60.0);
        coloured.misfits[0].level = 7.0;
        assert!(!leaves_more(&error(2.0, 1.36), &coloured), "of so few it may be chance");
    }

    #[test]
    fn a_few_messages_confirm_by_never_being_worse() {
        let with = |ci: f64| ChannelFit { improvement_ci95: [ci, 0.9], ..error(0.012, 0.004) };
        assert!(confirms(&with(0.1), true) && confirms(&with(0.0), false), "a cap that one order of those held out meets");
        assert!(!confirms(&with(0.0), true) && !confirms(&with(-0.1), false));
        assert!(!confirms(&error(1.0, 1.0), false), "what moves nothing there says nothing");
        assert!(better(&[error(0.62, 0.58), error(0.0, 0.0)]) && !better(&[error(0.62, 0.62)]));
        assert!(!better(&[error(0.62, 0.58), error(1.0, 1.1)]));
        let unseen = |moved: usize| Comparison {
            recording: "held out".into(),
            held_out: true,
            clock: Clock::Event,
            channel: "cost".into(),
            unit: "bps".into(),
            time: (0..600).map(f64::from).collect(),
            measured: vec![Some(0.0); 600],
            nominal: vec![0.0; 600],
            recalibrated: vec![0.0; 600],
            trued: (0..600).map(|row| if row < moved { 0.5 } else { 0.0 }).collect(),
        };
        assert!(few_tell(&[unseen(0)]) && few_tell(&[unseen(20), unseen(3)]));
        assert!(!few_tell(&[unseen(3), unseen(60)]), "an impact on a tape that goes on for hours");
    }
}
