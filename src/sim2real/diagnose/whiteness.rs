//! How much independent evidence residuals hold, and whether anything is left in them.

use std::cell::RefCell;

use realfft::RealFftPlanner;

use crate::sim2real::identify::Block;

/// Lags over which [`adequacy`] looks.
const LAGS: usize = 40;

/// Residuals of one channel over all parts: sum of squares, number, and autocorrelation time.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ChannelMisfit {
    pub channel: String,
    pub sum_of_squares: f64,
    pub count: usize,
    /// In rows: about 1 for uncorrelated residuals, down to a half for alternating ones.
    pub autocorrelation_time: f64,
    /// Mean square that noise of the colour of these residuals leaves, in units of the noise floor: 1 where they are white,
    /// or too slow to be noise. The floor is found from differences of neighbouring rows, and coloured noise hides in them.
    pub level: f64,
    /// Whether they fall out of correlation at one rate, as noise of one origin does: beside a motion that something is missing from they
    /// fall fast at first, and then slowly.
    pub one_colour: bool,
}

impl ChannelMisfit {
    /// Number of independent residuals that hold as much evidence: no more than there are.
    pub fn effective(&self) -> f64 {
        self.count as f64 / self.autocorrelation_time.max(1.0)
    }

    /// What is left above noise of mean square `level`.
    pub fn above(&self, level: f64) -> f64 {
        (self.sum_of_squares - level * self.count as f64).max(0.0)
    }

    /// Whether it is of the size and the colour of coloured noise: then nothing more need be sought in it.
    pub fn like_noise(&self) -> bool {
        self.level > 1.0 && self.one_colour && self.within(1.0 + BY_CHANCE, self.level)
    }

    /// Whether the mean square is at most `times` that of noise of mean square `level`.
    pub fn within(&self, times: f64, level: f64) -> bool {
        self.sum_of_squares <= times * level * self.count as f64
    }
}

/// By how much standard deviations are larger than white noise of the noise floor's size makes them: misfit and autocorrelation widen them.
pub(super) fn widening(misfits: &[ChannelMisfit]) -> f64 {
    let one = |m: &ChannelMisfit| (m.sum_of_squares / m.count.max(1) as f64).max(1.0) * m.autocorrelation_time.max(1.0);
    misfits.iter().map(one).fold(1.0, f64::max).sqrt()
}

/// The misfit of every channel; `rounding` gives the variance of a channel's rounding, in units of its noise.
///
/// Rounding is white, and it is there however well a model does: residuals far below it, which may all be the same in the
/// last bits, are no less independent for that.
pub(super) fn channel_misfits(residual: &[f64], blocks: &[Block], rounding: impl Fn(&str) -> f64) -> Vec<ChannelMisfit> {
    let mut channels: Vec<&str> = blocks.iter().map(|b| b.channel.as_str()).collect();
    channels.dedup();
    channels.sort_unstable();
    channels.dedup();
    channels
        .into_iter()
        .map(|channel| {
            let series = of_channel(residual, blocks, channel);
            let sum_of_squares: f64 = series.iter().flat_map(|s| s.iter()).map(|r| r * r).sum();
            let count: usize = series.iter().map(|s| s.len()).sum();
            let white = rounding(channel) * count as f64;
            let coloured = if sum_of_squares > 0.0 { sum_of_squares / (sum_of_squares + white) } else { 0.0 };
            let covariance = autocovariances(&series, usize::MAX).filter(|c| c[0] > 0.0);
            let time = covariance.as_ref().map_or(1.0, |c| initial_positive_sequence(c).clamp(0.5, count.max(1) as f64));
            let mean_square = sum_of_squares / count.max(1) as f64;
            ChannelMisfit {
                channel: channel.to_owned(),
                sum_of_squares,
                count,
                autocorrelation_time: 1.0 + coloured * (time - 1.0),
                one_colour: covariance.as_ref().is_none_or(|c| of_one_colour(c, count)),
                level: match covariance {
                    Some(c) if mean_square < MOST_HIDDEN && coloured_like_noise(&c) => {
                        (mean_square * (1.0 - remembered(&c))).max(1.0)
                    }
                    _ => 1.0,
                },
            }
        })
        .collect()
}

/// The residuals of one channel, one slice a part.
pub(super) fn of_channel<'a>(residual: &'a [f64], blocks: &[Block], channel: &str) -> Vec<&'a [f64]> {
    blocks.iter().filter(|b| b.channel == channel).map(|b| &residual[b.range.clone()]).collect()
}

/// `1 + 2 sum rho` over the initial positive sequence: pairs of neighbouring lags are added while their sum is positive
/// (Geyer, "Practical Markov chain Monte Carlo", Statistical Science 7 (1992)). The mean is not taken off: a residual
/// that stays on one side is one piece of evidence, however long it is.
pub(super) fn autocorrelation_time(series: &[&[f64]]) -> f64 {
    let count: usize = series.iter().map(|s| s.len()).sum();
    let covariance = autocovariances(series, usize::MAX).filter(|c| c[0] > 0.0);
    covariance.map_or(1.0, |c| initial_positive_sequence(&c).clamp(0.5, count.max(1) as f64))
}

fn initial_positive_sequence(covariance: &[f64]) -> f64 {
    if covariance.len() < 2 {
        return 1.0;
    }
    let sums = covariance.chunks_exact(2).map(|pair| (pair[0] + pair[1]) / covariance[0]);
    sums.take_while(|sum| *sum > 0.0).fold(-1.0, |time, sum| time + 2.0 * sum)
}

/// Lags, in rows, by which the colour of noise is told.
const NEAR_LAG: usize = 2;
const FAR_LAG: usize = 6;
/// Noise forgets at least this part of itself from one row to the next; a motion is smoother.
const FORGETS: f64 = 0.045;
/// Differences of neighbouring rows hide at most this part of the mean square of noise that forgets so fast.
const MOST_HIDDEN: f64 = 40.0;
/// Residuals less correlated than this over [`NEAR_LAG`] rows are white enough.
const WHITE: f64 = 0.1;

/// Whether residuals fall out of correlation as a first-order autoregressive process does, with white noise beside it: at
/// once. What a missing law leaves is as smooth as the motion, and its correlation starts out flat.
fn coloured_like_noise(covariance: &[f64]) -> bool {
    if covariance.len() <= 4 * FAR_LAG {
        return false;
    }
    let rho = |lag: usize| covariance[lag] / covariance[0];
    rho(NEAR_LAG) > WHITE && rho(FAR_LAG) < rho(NEAR_LAG) * (1.0 - FORGETS).powi((FAR_LAG - NEAR_LAG) as i32)
}

/// Lags at which noise of one colour is held to what its first two lags foretell.
const HELD_TO: [usize; 3] = [12, 24, 36];
/// Of these, correlations that differ by no more than this, or this many standard deviations of what so many rows tell of a process that
/// remembers itself so long (Bartlett, JRSS Supplement 8 (1946)), are as foretold.
const AS_FORETOLD: f64 = 0.1;
const DEVIATIONS: f64 = 2.0;

/// Whether residuals, so many in all, fall out of correlation as a first-order process does, with white noise beside it: by the same part
/// from each row to the next.
fn of_one_colour(covariance: &[f64], count: usize) -> bool {
    let Some(&[whole, first, second]) = covariance.first_chunk() else { return true };
    let kept = (second / first).clamp(0.0, 0.999);
    let remembers = (1.0 + kept) / (1.0 - kept);
    let apart = AS_FORETOLD.max(DEVIATIONS * (remembers / count.max(1) as f64).sqrt());
    let foretold = |lag: usize| first / whole * kept.powi(lag as i32 - 1);
    HELD_TO
        .iter()
        .filter_map(|lag| Some((*lag, covariance.get(*lag)?)))
        .all(|(lag, c)| (c / whole - foretold(lag)).abs() <= apart)
}

/// Noise of any colour has forgotten itself after so many rows, ...
const LONG_LAG: usize = 60;
/// ... but for this part, which may be chance.
const BY_CHANCE: f64 = 0.15;

/// The part of residuals that is remembered for longer than noise remembers anything: a slow misfit beside noise.
fn remembered(covariance: &[f64]) -> f64 {
    let long = covariance.get(LONG_LAG).filter(|_| covariance.len() > 4 * LONG_LAG);
    long.map(|c| c / covariance[0]).filter(|part| *part > BY_CHANCE).unwrap_or(0.0)
}

/// Mean over [`LAGS`] lags of `N rho^2`: about 1 where nothing is left but white noise (Box & Pierce, JASA 65 (1970)).
pub(super) fn adequacy(residual: &[f64], blocks: &[Block]) -> f64 {
    let mut channels: Vec<&str> = blocks.iter().map(|b| b.channel.as_str()).collect();
    channels.sort_unstable();
    channels.dedup();
    let of = |channel: &str| -> Option<f64> {
        let series = of_channel(residual, blocks, channel);
        let count: usize = series.iter().map(|s| s.len()).sum();
        let covariance = autocovariances(&series, LAGS + 1).filter(|c| c[0] > 0.0)?;
        let squares: f64 = covariance[1..].iter().map(|c| (c / covariance[0]).powi(2)).sum();
        Some(count as f64 * squares / (covariance.len() - 1).max(1) as f64)
    };
    channels.into_iter().filter_map(of).fold(0.0, f64::max)
}

thread_local! {
    /// Transforms are planned once for each length: that takes longer than to make one.
    static PLANS: RefCell<RealFftPlanner<f64>> = RefCell::new(RealFftPlanner::new());
}

/// Sums of lagged products over all parts, none across a boundary, by fast Fourier transform.
fn autocovariances(series: &[&[f64]], lags: usize) -> Option<Vec<f64>> {
    let longest = series.iter().map(|s| s.len()).max()?;
    let lags = lags.min(longest).max(1);
    let mut total = vec![0.0; lags];
    for part in series.iter().filter(|s| !s.is_empty()) {
        let size = (2 * part.len()).next_power_of_two();
        let (forward, inverse) = PLANS.with_borrow_mut(|plans| (plans.plan_fft_forward(size), plans.plan_fft_inverse(size)));
        let mut padded = forward.make_input_vec();
        padded[..part.len()].copy_from_slice(part);
        let mut spectrum = forward.make_output_vec();
        forward.process(&mut padded, &mut spectrum).ok()?;
        spectrum.iter_mut().for_each(|z| *z = realfft::num_complex::Complex::new(z.norm_sqr(), 0.0));
        inverse.process(&mut spectrum, &mut padded).ok()?;
        for (sum, product) in total.iter_mut().zip(&padded[..lags.min(part.len())]) {
            *sum += product / size as f64;
        }
    }
    Some(total)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim2real::Seed;
    use rand_distr::{Distribution, StandardNormal};

    fn autoregressive(phi: f64, count: usize) -> Vec<f64> {
        let mut rng = Seed(11).stream("series");
        let mut value = 0.0;
        (0..count)
            .map(|_| {
                let noise: f64 = StandardNormal.sample(&mut rng);
                value = phi * value + noise;
                value
            })
            .collect()
    }

    #[test]
    fn autocorrelation_time_is_that_of_the_process() {
        for phi in [0.0, 0.5, 0.9] {
            let series = autoregressive(phi, 40_000);
            let expected = (1.0 + phi) / (1.0 - phi);
            let found = autocorrelation_time(&[&series]);
            assert!((found / expected - 1.0).abs() < 0.25, "{phi}: {found} for {expected}");
        }
    }

    #[test]
    fn noise_of_any_colour_makes_its_own_level_and_a_slow_misfit_does_not() {
        let level = |series: &[f64]| {
            let block = Block { part: 0, channel: "y".into(), range: 0..series.len(), rows: (0..series.len()).collect() };
            channel_misfits(series, &[block], |_| 0.0)[0].level
        };
        let white = autoregressive(0.0, 5_000);
        assert_eq!(level(&white), 1.0);
        for phi in [0.6, 0.8, 0.92] {
            let found = level(&autoregressive(phi, 5_000));
            assert!((found * (1.0 - phi * phi) - 1.0).abs() < 0.3, "{phi}: {found}");
        }
        let slow: Vec<f64> = white.iter().enumerate().map(|(i, n)| n + 2.0 * (i as f64 * 0.03).sin()).collect();
        assert_eq!(level(&slow), 1.0);
        // Beside coloured noise it is told from it.
        let coloured = autoregressive(0.8, 5_000);
        let both: Vec<f64> = coloured.iter().enumerate().map(|(i, n)| n + 2.0 * (i as f64 * 0.003).sin()).collect();
        let found = level(&both) * (1.0 - 0.8 * 0.8);
        assert!((found - 1.0).abs() < 0.3, "{found}");
    }

    #[test]
    fn noise_falls_out_of_correlation_at_one_rate() {
        let of = |series: &[f64]| {
            let block = Block { part: 0, channel: "y".into(), range: 0..series.len(), rows: (0..series.len()).collect() };
            let misfit = channel_misfits(series, &[block], |_| 0.0).remove(0);
            (misfit.level > 1.0, misfit.one_colour)
        };
        for phi in [0.5, 0.7, 0.9, 0.95] {
            assert_eq!(of(&autoregressive(phi, 5_000)), (true, true), "{phi}");
        }
        // Beside half as much of something that swings slowly it goes for noise, and not for noise of one colour.
        let coloured = autoregressive(0.6, 5_000);
        let both: Vec<f64> = coloured.iter().enumerate().map(|(i, n)| n + 0.9 * (i as f64 * 0.06).sin()).collect();
        assert_eq!(of(&both), (true, false));
    }

    #[test]
    fn adequacy_is_about_one_for_white_noise_only() {
        let of = |series: &[f64]| {
            let block = Block { part: 0, channel: "y".into(), range: 0..series.len(), rows: (0..series.len()).collect() };
            adequacy(series, &[block])
        };
        assert!((0.5..1.7).contains(&of(&autoregressive(0.0, 5_000))));
        assert!(of(&autoregressive(0.5, 5_000)) > 20.0);
    }
}
