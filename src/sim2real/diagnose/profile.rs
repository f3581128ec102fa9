//! Errors over the states they may depend on: what a report draws.

use super::hypothesis::{Hypothesis, Inquiry};
use super::locate::{Covariates, Track, tracks, unevenness, unit};
use crate::sim2real::Twin;

/// Bins of equal width into which the range of a covariate is cut.
const BINS: usize = 40;
/// Rows a bin needs, or it is left out.
const FEWEST: usize = 8;
/// Covariates of each channel that are kept: those over which the error lies most unevenly.
const KEPT: usize = 3;

/// Root mean square errors of one channel over the values of one covariate, on what was fitted.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    /// The channel.
    pub channel: String,
    /// Its unit, and that of the errors.
    pub unit: String,
    /// The covariate.
    pub on: String,
    /// Its unit, where it has one that is known.
    pub on_unit: String,
    /// Middle of each bin, in `on_unit`.
    pub at: Vec<f64>,
    /// Of the twin with its own parameters refitted, bin by bin.
    pub recalibrated: Vec<f64>,
    /// Of the twin with what was found added.
    pub trued: Vec<f64>,
    /// Standard deviation of the noise.
    pub noise: f64,
}

/// The profiles of every channel, in the order of the twin's covariates.
pub(super) fn profiles<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    recalibrated: &Hypothesis<T>,
    trued: &Hypothesis<T>,
    covariates: &Covariates,
) -> Vec<Profile> {
    let (before, after) = (tracks(inquiry, recalibrated, covariates), tracks(inquiry, trued, covariates));
    let mut out = Vec::new();
    for weight in &inquiry.evidence.weights {
        let own =
            |tracks: &[Track]| -> Vec<Track> { tracks.iter().filter(|t| t.channel == weight.channel).cloned().collect() };
        let (before, after) = (own(&before), own(&after));
        let residual = |tracks: &[Track]| -> Vec<f64> {
            tracks.iter().flat_map(|t| t.residual.iter().map(|r| r * weight.noise)).collect()
        };
        let (before_all, after_all) = (residual(&before), residual(&after));
        let Some(first) = before.first() else { continue };
        let mut columns: Vec<(f64, usize, Vec<f64>)> = (0..first.covariates.len())
            .filter(|k| before.iter().all(|t| t.covariates.len() > *k))
            .map(|k| {
                let values: Vec<f64> = before.iter().flat_map(|t| t.covariates[k].1.iter().copied()).collect();
                (unevenness(&values, &before_all), k, values)
            })
            .collect();
        columns.sort_by(|a, b| b.0.total_cmp(&a.0));
        columns.truncate(KEPT);
        columns.sort_by_key(|(_, k, _)| *k);
        for (_, k, values) in columns {
            let name = first.covariates[k].0;
            let Some((at, [recalibrated, trued])) = binned(&values, [&before_all, &after_all]) else { continue };
            out.push(Profile {
                channel: weight.channel.clone(),
                unit: unit(inquiry, &weight.channel),
                on: name.to_owned(),
                on_unit: unit(inquiry, name),
                at,
                recalibrated,
                trued,
                noise: weight.noise,
            });
        }
    }
    out
}

/// Middles of the bins that hold enough rows, and root mean squares of both errors in them. The outermost half per cent
/// of the values on either side share the outermost bins.
fn binned(values: &[f64], errors: [&[f64]; 2]) -> Option<(Vec<f64>, [Vec<f64>; 2])> {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let outer = sorted.len() / 200;
    let (low, high) = (*sorted.get(outer)?, *sorted.get(sorted.len().checked_sub(outer + 1)?)?);
    if high <= low {
        return None;
    }
    let mut sums = vec![(0, 0.0, 0.0); BINS];
    for ((value, a), b) in values.iter().zip(errors[0]).zip(errors[1]).filter(|((v, _), _)| v.is_finite()) {
        let bin = ((value - low) / (high - low) * BINS as f64).clamp(0.0, BINS as f64 - 1.0) as usize;
        sums[bin] = (sums[bin].0 + 1, sums[bin].1 + a * a, sums[bin].2 + b * b);
    }
    let kept: Vec<(f64, f64, f64)> = sums
        .iter()
        .enumerate()
        .filter(|(_, (count, ..))| *count >= FEWEST)
        .map(|(k, (count, a, b))| {
            let middle = low + (high - low) * (k as f64 + 0.5) / BINS as f64;
            (middle, (a / *count as f64).sqrt(), (b / *count as f64).sqrt())
        })
        .collect();
    let of = |pick: fn(&(f64, f64, f64)) -> f64| kept.iter().map(pick).collect::<Vec<f64>>();
    (kept.len() >= 3).then(|| (of(|k| k.0), [of(|k| k.1), of(|k| k.2)]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_profile_has_its_error_where_the_rows_have_it() {
        let values: Vec<f64> = (0..4_000).map(|i| f64::from((i * 1_237) % 4_000) / 4_000.0).collect();
        let before: Vec<f64> = values.iter().map(|v| if *v > 0.75 { 2.0 } else { 0.1 }).collect();
        let after = vec![0.1; 4_000];
        let (at, [recalibrated, trued]) = binned(&values, [&before, &after]).unwrap();
        for ((at, before), after) in at.iter().zip(&recalibrated).zip(&trued) {
            assert!(
                (before - if *at > 0.76 { 2.0 } else { 0.1 }).abs() < 1e-9 || (at - 0.75).abs() < 0.02,
                "{at}: {before}"
            );
            assert!((after - 0.1).abs() < 1e-9);
        }
        assert_eq!(binned(&[1.0; 100], [&[0.0; 100], &[0.0; 100]]), None);
    }
}
