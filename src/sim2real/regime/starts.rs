//! Where a fit begins: guesses of which rows are of which state.

use rand::RngExt;

use super::moments::Moments;
use super::observations::is_lost;
use super::{HiddenMarkov, Observations, Settings};
use crate::sim2real::Seed;

/// Rows over which level and scale are taken around each row, in turn.
const WINDOWS: [usize; 4] = [1, 21, 5, 63];

/// Rounds of k-means: a start need not be settled.
const ROUNDS: usize = 10;

/// Start `number` of a fit: rows sorted by level, then by scale, then grouped by both.
///
/// Regimes may differ in their mean or in their spread alone, so groups are made of the mean around each row and of the
/// logarithm of how far rows around it stray, over windows of several lengths. `None` where a group has no row.
pub(super) fn start(
    number: usize,
    series: &[Observations],
    settings: &Settings,
    center: &[f64],
    variances: &[f64],
) -> Option<HiddenMarkov> {
    let window = WINDOWS[if number < 2 { 2 - number } else { number % WINDOWS.len() }];
    let features = Features::new(series, window, center, variances);
    let labels = match number {
        0 => features.by_quantile(0, settings.states),
        1 => features.by_quantile(features.width - 1, settings.states),
        _ => features.by_means(settings.states, settings.seed, &format!("regime.start {number}")),
    };
    model(series, &labels, settings, variances)
}

/// Level and scale around each row that was observed, each with mean 0 and variance 1 over all.
struct Features {
    /// Columns of the series and one for the scale.
    width: usize,
    values: Vec<f64>,
}

impl Features {
    fn new(series: &[Observations], window: usize, center: &[f64], variances: &[f64]) -> Self {
        let columns = center.len();
        let width = columns + 1;
        let mut values = vec![];
        let mut sums = vec![0.0; width];
        for part in series {
            let rows: Vec<f64> =
                part.iter().filter(|row| !is_lost(row)).flat_map(|row| standardized(row, center, variances)).collect();
            let count = rows.len() / width;
            let half = window / 2;
            for row in 0..count {
                let around = row.saturating_sub(half)..(row + half + 1).min(count);
                sums.fill(0.0);
                for near in rows[around.start * width..around.end * width].chunks_exact(width) {
                    for (sum, value) in sums.iter_mut().zip(near) {
                        *sum += value;
                    }
                }
                let share = 1.0 / around.len() as f64;
                values.extend(sums[..columns].iter().map(|sum| sum * share));
                values.push((sums[columns] * share + 1e-3).ln());
            }
        }
        let mut features = Self { width, values };
        features.standardize();
        features
    }

    fn standardize(&mut self) {
        let count = (self.values.len() / self.width).max(1) as f64;
        for column in 0..self.width {
            let of = || self.values.iter().skip(column).step_by(self.width);
            let mean = of().sum::<f64>() / count;
            let deviation = (of().map(|x| (x - mean).powi(2)).sum::<f64>() / count).sqrt().max(1e-12);
            for value in self.values.iter_mut().skip(column).step_by(self.width) {
                *value = (*value - mean) / deviation;
            }
        }
    }

    /// Groups of equal size, by one feature.
    fn by_quantile(&self, feature: usize, groups: usize) -> Vec<usize> {
        let count = self.values.len() / self.width;
        let mut order: Vec<usize> = (0..count).collect();
        let value = |row: usize| self.values[row * self.width + feature];
        order.sort_by(|a, b| value(*a).total_cmp(&value(*b)));
        let mut labels = vec![0; count];
        for (rank, row) in order.into_iter().enumerate() {
            labels[row] = rank * groups / count;
        }
        labels
    }

    /// Groups by k-means, from centers drawn with k-means++ (D. Arthur and S. Vassilvitskii, SODA 2007).
    fn by_means(&self, groups: usize, seed: Seed, stream: &str) -> Vec<usize> {
        let mut draws = seed.stream(stream);
        let rows: Vec<&[f64]> = self.values.chunks_exact(self.width).collect();
        let mut centers = vec![rows[draws.random_range(0..rows.len())].to_vec()];
        let mut nearest: Vec<f64> = rows.iter().map(|row| squared(row, &centers[0])).collect();
        while centers.len() < groups {
            let mut left = draws.random::<f64>() * nearest.iter().sum::<f64>();
            let drawn = nearest.iter().position(|d| {
                left -= d;
                left < 0.0
            });
            centers.push(rows[drawn.unwrap_or(rows.len() - 1)].to_vec());
            for (distance, row) in nearest.iter_mut().zip(&rows) {
                *distance = distance.min(squared(row, &centers[centers.len() - 1]));
            }
        }
        let mut labels = vec![0; rows.len()];
        for _ in 0..ROUNDS {
            let mut counts = vec![0.0; groups];
            let mut sums = vec![vec![0.0; self.width]; groups];
            for (label, row) in labels.iter_mut().zip(&rows) {
                let mut least = f64::INFINITY;
                for (group, center) in centers.iter().enumerate() {
                    let distance = squared(row, center);
                    if distance < least {
                        (*label, least) = (group, distance);
                    }
                }
                counts[*label] += 1.0;
                for (sum, value) in sums[*label].iter_mut().zip(*row) {
                    *sum += value;
                }
            }
            for ((center, sum), count) in centers.iter_mut().zip(sums).zip(counts) {
                if count > 0.0 {
                    *center = sum.into_iter().map(|s| s / count).collect();
                }
            }
        }
        labels
    }
}

/// Deviations in units of the whole series' own, and the mean of their squares.
fn standardized(row: &[f64], center: &[f64], variances: &[f64]) -> Vec<f64> {
    let mut white: Vec<f64> = row.iter().zip(center).zip(variances).map(|((x, m), v)| (x - m) / v.sqrt()).collect();
    white.push(white.iter().map(|w| w * w).sum::<f64>() / row.len() as f64);
    white
}

fn squared(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

/// The model of rows whose states are known.
fn model(series: &[Observations], labels: &[usize], settings: &Settings, variances: &[f64]) -> Option<HiddenMarkov> {
    let states = settings.states;
    let mut counts = vec![vec![1.0; states]; states];
    let means = group_means(series, labels, states);
    let mut moments = Moments::new(means, variances.len(), settings.family);
    let mut label = labels.iter();
    for part in series {
        let mut before = None;
        for row in part.iter() {
            if is_lost(row) {
                before = None;
                continue;
            }
            let now = *label.next()?;
            if let Some(before) = before.replace(now) {
                let row: &mut Vec<f64> = &mut counts[before];
                row[now] += 1.0;
            }
            moments.add_row(row, now);
        }
    }
    // A start must leave every state some width to grow from.
    let floors: Vec<f64> = variances.iter().map(|v| v * settings.floor.max(1e-4)).collect();
    let emissions =
        (0..states).map(|state| moments.emission(state, settings.family, &floors, None)).collect::<Option<Vec<_>>>()?;
    let transition = counts
        .into_iter()
        .map(|row| {
            let sum: f64 = row.iter().sum();
            row.into_iter().map(|count| count / sum).collect()
        })
        .collect();
    HiddenMarkov::new(vec![1.0 / states as f64; states], transition, emissions).ok()
}

/// Mean of each group, 0 of an empty one: what deviations are taken from.
fn group_means(series: &[Observations], labels: &[usize], groups: usize) -> Vec<f64> {
    let width = series.first().map_or(1, Observations::width);
    let (mut sums, mut counts) = (vec![0.0; groups * width], vec![0.0_f64; groups]);
    let rows = series.iter().flat_map(Observations::iter).filter(|row| !is_lost(row));
    for (row, label) in rows.zip(labels) {
        counts[*label] += 1.0;
        for (sum, value) in sums[label * width..].iter_mut().zip(row) {
            *sum += value;
        }
    }
    for (mean, count) in sums.chunks_exact_mut(width).zip(counts) {
        mean.iter_mut().for_each(|m| *m /= count.max(1.0));
    }
    sums
}
