//! How much a Sharpe ratio can be trusted: its error, the odds that it is above another, and what is left of it where it
//! is the best of many.

use statrs::distribution::{ContinuousCDF, Normal};

use super::defined;

/// Euler's constant.
const EULER_GAMMA: f64 = 0.577_215_664_901_532_9;

/// Standard error of a Sharpe ratio per period, estimated from `n` returns that are independent and normal:
/// `sqrt((1 + sharpe^2 / 2) / n)`. Times the root of the periods in a year it is that of the yearly ratio.
///
/// None of no returns, or where `sharpe` is not finite.
///
/// Source: Lo, "The statistics of Sharpe ratios", Financial Analysts Journal 58 (2002), for returns that
/// are independent and identically distributed.
#[must_use]
pub fn sharpe_standard_error(sharpe: f64, n: usize) -> Option<f64> {
    defined(((1.0 + 0.5 * sharpe * sharpe) / n as f64).sqrt())
}

/// The probability that the true Sharpe ratio per period is above `benchmark`, where `n` returns of this `skewness` and
/// `kurtosis` (3 for normal ones) gave `sharpe`.
///
/// None of fewer than two returns, and where the arguments are not those of any sample.
///
/// Source: Bailey and Lopez de Prado, "The Sharpe ratio efficient frontier", Journal of Risk 15 (2012).
#[must_use]
pub fn probabilistic_sharpe(sharpe: f64, benchmark: f64, n: usize, skewness: f64, kurtosis: f64) -> Option<f64> {
    if n < 2 {
        return None;
    }
    let variance = 1.0 - skewness * sharpe + (kurtosis - 1.0) / 4.0 * sharpe * sharpe;
    let score = defined((sharpe - benchmark) * ((n - 1) as f64).sqrt() / variance.sqrt())?;
    Some(Normal::standard().cdf(score))
}

/// The largest Sharpe ratio to be expected of `trials` independent trials none of which is any good, where the ratios
/// found differ by `variance_of_trial_sharpes`; of one trial it is 0. Per period, if the variance is.
///
/// None of fewer than one trial or where the variance is no variance. The approximation is below 0 between one trial and
/// two; 0 is given there.
///
/// Source: Bailey and Lopez de Prado, "The deflated Sharpe ratio: correcting for selection bias, backtest overfitting and
/// non-normality", Journal of Portfolio Management 40 (2014).
#[must_use]
pub fn expected_largest_sharpe(trials: f64, variance_of_trial_sharpes: f64) -> Option<f64> {
    if !trials.is_finite() || trials < 1.0 || !variance_of_trial_sharpes.is_finite() || variance_of_trial_sharpes < 0.0 {
        return None;
    }
    if trials == 1.0 {
        return Some(0.0);
    }
    let quantile = |exceeded: f64| Normal::standard().inverse_cdf(1.0 - exceeded);
    let (once, rarer) = (quantile(1.0 / trials), quantile(1.0 / (trials * std::f64::consts::E)));
    let largest = variance_of_trial_sharpes.sqrt() * ((1.0 - EULER_GAMMA) * once + EULER_GAMMA * rarer);
    defined(largest.max(0.0))
}

/// The deflated Sharpe ratio: the probability that the true Sharpe ratio per period is above what the best of `trials`
/// would show if none were any good.
///
/// `sharpe_per_period` is that of the trial chosen, from `n` returns of this `skewness` and `kurtosis` (3 for normal ones);
/// `trials` counts all that were tried, or how many independent ones they amount to; `variance_of_trial_sharpes` is that of
/// their Sharpe ratios per period. Ratios made yearly are divided by the root of the periods in a year first, their
/// variance by that number.
///
/// None where [`probabilistic_sharpe`] or [`expected_largest_sharpe`] is.
///
/// Source: that of [`expected_largest_sharpe`].
#[must_use]
pub fn deflated_sharpe(
    sharpe_per_period: f64,
    n: usize,
    skewness: f64,
    kurtosis: f64,
    trials: f64,
    variance_of_trial_sharpes: f64,
) -> Option<f64> {
    let benchmark = expected_largest_sharpe(trials, variance_of_trial_sharpes)?;
    probabilistic_sharpe(sharpe_per_period, benchmark, n, skewness, kurtosis)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(found: Option<f64>, expected: f64, within: f64) -> bool {
        found.is_some_and(|f| (f - expected).abs() <= within)
    }

    /// Lo (2002), table 1: asymptotic errors at Sharpe ratios of 0.5 and 1 from 12 and 60 returns.
    #[test]
    fn errors_are_those_of_lo() {
        assert!(close(sharpe_standard_error(0.5, 12), 0.306, 5e-4));
        assert!(close(sharpe_standard_error(1.0, 60), 0.158, 5e-4));
        assert_eq!((sharpe_standard_error(0.5, 0), sharpe_standard_error(f64::NAN, 9)), (None, None));
    }

    /// Bailey and Lopez de Prado (2012): two years of months, a ratio of 0.458 a month, skewness -2.448 and kurtosis 10.164.
    /// 0.982 if they were normal, 0.913 as they are.
    #[test]
    fn the_probabilistic_ratio_is_that_of_the_paper() {
        assert!(close(probabilistic_sharpe(0.458, 0.0, 24, 0.0, 3.0), 0.982, 5e-4));
        assert!(close(probabilistic_sharpe(0.458, 0.0, 24, -2.448, 10.164), 0.913, 5e-4));
        assert!(close(probabilistic_sharpe(0.3, 0.3, 50, -1.0, 5.0), 0.5, 1e-12));
        assert_eq!(probabilistic_sharpe(0.458, 0.0, 1, 0.0, 3.0), None);
        assert_eq!(probabilistic_sharpe(1.0, 0.0, 24, 5.0, 3.0), None, "no sample has these moments");
    }

    /// Bailey and Lopez de Prado (2014), "A numerical example": the best of 100 trials has 2.5 a year from 1,250 days, 250 a
    /// year; the trials' ratios have a variance of 1/2 a year. 0.1132 a day is to be expected of the best, and 0.9004 is
    /// left; 46 trials would have left 0.9505, and so would 88 had the returns been normal.
    #[test]
    fn the_deflated_ratio_is_that_of_the_paper() {
        let (sharpe, variance) = (2.5 / 250.0_f64.sqrt(), 0.5 / 250.0);
        assert!(close(expected_largest_sharpe(100.0, variance), 0.1132, 5e-5));
        assert!(close(deflated_sharpe(sharpe, 1_250, -3.0, 10.0, 100.0, variance), 0.9004, 5e-5));
        assert!(close(deflated_sharpe(sharpe, 1_250, -3.0, 10.0, 46.0, variance), 0.9505, 5e-5));
        assert!(close(deflated_sharpe(sharpe, 1_250, 0.0, 3.0, 88.0, variance), 0.9505, 5e-5));
    }

    #[test]
    fn one_trial_deflates_nothing_and_more_deflate_more() {
        let at = |trials| deflated_sharpe(0.1, 500, 0.0, 3.0, trials, 0.002).unwrap();
        assert_eq!(Some(at(1.0)), probabilistic_sharpe(0.1, 0.0, 500, 0.0, 3.0));
        let left: Vec<f64> = [1.0, 1.1, 1.5, 2.0, 10.0, 100.0, 1e6].map(at).to_vec();
        assert!(left.windows(2).all(|pair| pair[0] >= pair[1]), "{left:?}");
        for (trials, variance) in [(0.0, 0.1), (f64::NAN, 0.1), (f64::INFINITY, 0.1), (5.0, -0.1), (5.0, f64::NAN)] {
            assert_eq!(deflated_sharpe(0.1, 500, 0.0, 3.0, trials, variance), None, "{trials} {variance}");
        }
    }
}
