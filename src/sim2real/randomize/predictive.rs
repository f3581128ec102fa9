//! Bands that draws make, and how much of what was measured lies within.

use rayon::prelude::*;
use serde::Serialize;

use super::Predicted;
use super::normal::normal_cdf;

/// The parts of all draws, noise included, that bands hold.
pub const BANDS: [f64; 3] = [0.5, 0.8, 0.95];
/// The widest band, which what was measured should hardly ever leave.
pub const WIDEST: f64 = 0.99;
/// The part of the samples outside the widest band above which draws do not cover a recording: five times what lies there if they
/// do. Errors of neighbouring samples go together, so that some stretch may lie outside by chance.
pub const OUTSIDE: f64 = 0.05;
/// Samples in a row outside the widest band that are no chance: of independent ones, one in a million.
const IN_A_ROW: usize = 3;
/// Rows of curves: more are not seen.
const ROWS: usize = 600;
/// Halvings by which a quantile is found: to a hundred-thousandth of the spread.
const HALVINGS: usize = 22;

/// The bands of one channel over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Bands {
    /// Rows of the recording that the curves are of: all, or evenly some of them.
    pub rows: Vec<usize>,
    /// Half of the draws, noise included, lie below.
    pub median: Vec<f64>,
    /// Lower and upper ends of each of [`BANDS`].
    pub ends: Vec<[Vec<f64>; 2]>,
}

/// How much of what was measured the draws cover.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Coverage {
    /// The recording.
    pub recording: String,
    /// The channel.
    pub channel: String,
    /// Its unit.
    pub unit: String,
    /// Samples that were measured.
    pub samples: usize,
    /// Standard deviation of the noise that is added to draws, in `unit`.
    pub noise_floor: f64,
    /// Of each of [`BANDS`] and of [`WIDEST`]: the part it should hold, and the part of the samples it holds.
    pub within: Vec<BandShare>,
    /// The part of the samples outside the widest band.
    pub outside: f64,
    /// When they first leave it and stay outside for some samples [s]; none where they never do.
    pub first_outside: Option<f64>,
    /// Whether that is no more than chance.
    pub covered: bool,
    /// Median width of the widest of [`BANDS`], in `unit`.
    pub width: f64,
    /// Draws that left all bounds.
    pub diverged: usize,
}

/// What a band holds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct BandShare {
    /// The part of draws it holds.
    pub band: f64,
    /// The part of the samples it holds.
    pub share: f64,
}

/// The part of what draws foretell, each with Gaussian noise, that lies below `value`.
///
/// Noise is not drawn: the mixture of all draws' Gaussians is told exactly, so that bands are as smooth as few draws let them be.
fn below(value: f64, draws: &[f64], noise: f64) -> f64 {
    let part = |draw: &f64| match (value - draw) / noise {
        // Beyond, nothing is left to 16 digits.
        z if z > 8.5 => 1.0,
        z if z < -8.5 => 0.0,
        z if z.is_nan() => 0.5,
        z => normal_cdf(z),
    };
    draws.iter().map(part).sum::<f64>() / draws.len().max(1) as f64
}

fn quantile(part: f64, draws: &[f64], noise: f64) -> f64 {
    let (mut low, mut high) = draws.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
    (low, high) = (low - 4.0 * noise, high + 4.0 * noise);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if below(middle, draws, noise) < part { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

impl Predicted {
    fn at(&self, row: usize) -> Vec<f64> {
        self.draws.iter().map(|draw| draw[row]).collect()
    }

    /// The bands over time; none where no draw stayed within bounds.
    #[must_use]
    pub fn bands(&self) -> Option<Bands> {
        if self.draws.is_empty() {
            return None;
        }
        let count = self.time.len();
        let step = count.div_ceil(ROWS).max(1);
        let rows: Vec<usize> = (0..count).step_by(step).collect();
        let all: Vec<Vec<f64>> = rows
            .par_iter()
            .map(|row| {
                let draws = self.at(*row);
                let tails = BANDS.iter().flat_map(|band| [0.5 - 0.5 * band, 0.5 + 0.5 * band]);
                [0.5].into_iter().chain(tails).map(|part| quantile(part, &draws, self.noise)).collect()
            })
            .collect();
        let curve = |k: usize| all.iter().map(|row| row[k]).collect::<Vec<f64>>();
        let ends = (0..BANDS.len()).map(|k| [curve(1 + 2 * k), curve(2 + 2 * k)]).collect();
        Some(Bands { rows, median: curve(0), ends })
    }

    /// How much of what was measured the draws cover; none where nothing was measured or no draw stayed within bounds.
    #[must_use]
    pub fn coverage(&self) -> Option<Coverage> {
        let measured: Vec<(usize, f64)> =
            self.measured.iter().enumerate().filter_map(|(row, sample)| Some((row, (*sample)?))).collect();
        if measured.is_empty() || self.draws.is_empty() {
            return None;
        }
        let parts: Vec<f64> = measured.par_iter().map(|(row, sample)| below(*sample, &self.at(*row), self.noise)).collect();
        let holds = |band: f64, part: f64| (part - 0.5).abs() <= 0.5 * band;
        let share = |band: f64| parts.iter().filter(|part| holds(band, **part)).count() as f64 / parts.len() as f64;
        let within = BANDS.iter().chain([&WIDEST]).map(|band| BandShare { band: *band, share: share(*band) }).collect();
        let outside = 1.0 - share(WIDEST);
        let first = parts.windows(IN_A_ROW.min(parts.len())).position(|w| w.iter().all(|part| !holds(WIDEST, *part)));
        Some(Coverage {
            recording: self.recording.clone(),
            channel: self.channel.clone(),
            unit: self.unit.clone(),
            samples: parts.len(),
            noise_floor: self.noise,
            within,
            outside,
            first_outside: first.map(|k| self.time[measured[k].0]),
            covered: outside <= OUTSIDE,
            width: self.width(),
            diverged: self.diverged,
        })
    }

    /// Median width of the widest of [`BANDS`], at some rows.
    fn width(&self) -> f64 {
        let band = BANDS[BANDS.len() - 1];
        let rows = (0..self.time.len()).step_by(self.time.len().div_ceil(50).max(1));
        let mut widths: Vec<f64> = rows
            .map(|row| {
                let draws = self.at(row);
                quantile(0.5 + 0.5 * band, &draws, self.noise) - quantile(0.5 - 0.5 * band, &draws, self.noise)
            })
            .collect();
        widths.sort_by(f64::total_cmp);
        widths.get(widths.len() / 2).copied().unwrap_or_default()
    }
}

/// The quantiles of `values` at `parts`, by linear interpolation between them (type 7 of Hyndman and Fan, "Sample quantiles in
/// statistical packages", The American Statistician 50 (1996)); none of no values.
#[must_use]
pub fn quantiles(values: &[f64], parts: &[f64]) -> Option<Vec<f64>> {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|value| !value.is_nan()).collect();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().checked_sub(1)?;
    let at = |part: &f64| {
        let place = part.clamp(0.0, 1.0) * last as f64;
        let (from, way) = (place.floor() as usize, place.fract());
        let (low, high) = (sorted[from], sorted[(from + 1).min(last)]);
        if way == 0.0 || low == high { low } else { low + way * (high - low) }
    };
    Some(parts.iter().map(at).collect())
}

#[cfg(test)]
mod tests {
    use super::super::normal_quantile;
    use super::*;
    use crate::sim2real::Seed;
    use rand_distr::{Distribution, StandardNormal};

    /// Draws of a wave whose height is uncertain by `spread`, and a measurement of one of height `truth`.
    fn predicted(spread: f64, truth: f64, noise: f64) -> Predicted {
        let mut rng = Seed(5).stream("predictive");
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let time: Vec<f64> = (0..2_000).map(|k| f64::from(k) * 0.01).collect();
        let wave = |height: f64| time.iter().map(|t| height * (1.5 + t.sin())).collect::<Vec<f64>>();
        let heights: Vec<f64> = (0..200).map(|k| 1.0 + spread * normal_quantile((f64::from(k) + 0.5) / 200.0)).collect();
        let measured = wave(truth).into_iter().map(|v| Some(v + noise * normal())).collect();
        Predicted {
            recording: "run.csv".into(),
            channel: "position".into(),
            unit: "rad".into(),
            measured,
            noise,
            nominal: wave(0.5),
            draws: heights.iter().map(|height| wave(*height)).collect(),
            diverged: 0,
            time,
        }
    }

    #[test]
    fn bands_are_those_of_the_draws_and_the_noise_together() {
        let predicted = predicted(0.1, 1.0, 0.05);
        let bands = predicted.bands().unwrap();
        for (k, row) in bands.rows.iter().enumerate() {
            let height = 1.5 + predicted.time[*row].sin();
            let std = (0.1 * height).hypot(0.05);
            for (band, ends) in BANDS.iter().zip(&bands.ends) {
                let expected = std * normal_quantile(0.5 + 0.5 * band);
                assert!(
                    (ends[1][k] - height - expected).abs() < 0.02 * std
                        && (height - expected - ends[0][k]).abs() < 0.02 * std
                );
            }
            assert!((bands.median[k] - height).abs() < 1e-3);
        }
    }

    #[test]
    fn draws_around_the_truth_cover_it_and_others_do_not() {
        // What is certain but for the noise: each band holds what it says.
        let sure = predicted(1e-6, 1.0, 0.05).coverage().unwrap();
        for BandShare { band, share } in &sure.within {
            assert!((band - share).abs() < 4.0 * (band * (1.0 - band) / 2_000.0).sqrt(), "{band}: {share}");
        }
        assert!(sure.covered && sure.first_outside.is_none());
        let off = predicted(0.02, 1.3, 0.05).coverage().unwrap();
        assert!(!off.covered && off.outside > 0.5, "{off:?}");
        assert!(off.first_outside.unwrap() < 0.1);
        assert!(predicted(0.3, 1.3, 0.05).coverage().unwrap().covered, "wide draws cover it");
    }

    #[test]
    fn quantiles_lie_between_values() {
        assert_eq!(quantiles(&[3.0, 1.0, 2.0], &[0.0, 0.25, 0.5, 1.0]).unwrap(), [1.0, 1.5, 2.0, 3.0]);
        assert_eq!(quantiles(&[], &[0.5]), None);
        assert_eq!(quantiles(&[f64::INFINITY; 2], &[0.3]).unwrap(), [f64::INFINITY]);
    }
}
