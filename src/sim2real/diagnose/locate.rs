//! Where, before anything is named: the stretches of time, and the states, in which the refitted twin parts from the
//! recordings.

use std::collections::BTreeMap;

use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::hypothesis::{Hypothesis, Inquiry};
use super::whiteness::autocorrelation_time;
use super::{Bin, Interval, changes, onset};
use crate::sim2real::{Clock, Covariate, Recording, Twin};

/// Windows into which a recording is cut, and rows of a window at the least.
const WINDOWS: usize = 120;
const FEWEST_ROWS: usize = 5;
/// Probability that a quiet recording has a window that is called loud.
const CHANCE: f64 = 0.01;
/// A window that is loud has at least this many times the mean squared residual of the quiet ones ...
const MATERIAL: f64 = 3.0;
/// ... or, where none is quiet, this many times the mean.
const WORSE: f64 = 1.5;
/// Below this mean squared residual, in units of the noise, nothing is missing anywhere.
const ABOVE_NOISE: f64 = 1.5;
/// A stretch that is told holds this part of the squared error.
const SHARE: f64 = 0.02;
/// Most stretches that are told of a channel.
const TOLD: usize = 12;

/// Quantile bins of a covariate, and how much denser than elsewhere the squared error must be in those that are told.
const BINS: usize = 12;
const DENSER: f64 = 2.0;
/// They hold at least this part of the squared error.
const HOLDS: f64 = 0.3;
/// By what factor a range of sizes is preferred to one of signed values.
const SIMPLER: f64 = 1.25;
/// Covariates that are told of a channel.
const TOLD_BINS: usize = 3;

/// What is left of one channel in one recording, in the order of time.
#[derive(Debug, Clone)]
pub(super) struct Track {
    /// The channel.
    pub channel: String,
    /// Name of the recording.
    pub recording: String,
    /// Time of each row [s].
    pub time: Vec<f64>,
    /// Residuals, in units of the noise.
    pub residual: Vec<f64>,
    /// What they may depend on, row by row.
    pub covariates: Vec<Covariate>,
}

/// What tells a recording from others: two may well have the same name.
pub(super) fn identity<S>(recording: &Recording<S>) -> usize {
    std::ptr::from_ref(recording) as usize
}

/// The covariates of every recording that is fitted, by its identity.
pub(super) type Covariates = BTreeMap<usize, Vec<Covariate>>;

/// The covariates of what is fitted.
pub(super) fn covariates<T: Twin>(inquiry: &Inquiry<'_, T>) -> Covariates {
    let parts = inquiry.evidence.free_run.iter();
    parts.map(|part| (identity(part.recording), inquiry.twin.covariates(part.recording))).collect()
}

/// Where `recalibrated` parts from what it was fitted to.
pub(super) fn located<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    recalibrated: &Hypothesis<T>,
    covariates: &Covariates,
) -> super::Where {
    let tracks = tracks(inquiry, recalibrated, covariates);
    let channels: Vec<&str> = inquiry.evidence.weights.iter().map(|w| w.channel.as_str()).collect();
    let mut found = super::Where::default();
    for channel in channels {
        let own: Vec<&Track> = tracks.iter().filter(|t| t.channel == channel).collect();
        found.intervals.extend(intervals(&own));
        found.changes.extend(changes::changes(&own));
        found.against.extend(against(&own, inquiry.twin.clock(), &|name| unit(inquiry, name)));
    }
    found.intervals.sort_by(|a, b| b.share_of_error.total_cmp(&a.share_of_error));
    found.onset = onset::onset(inquiry, recalibrated).map(|onset| onset.time);
    found
}

/// The unit of a covariate, where it is a channel's.
pub(super) fn unit<T: Twin>(inquiry: &Inquiry<'_, T>, name: &str) -> String {
    let known = inquiry.twin.channels().iter().find(|c| c.name == name);
    known.map(|c| inquiry.twin.unit(&c.unit)).unwrap_or_default()
}

/// The residuals of `hypothesis`, channel by channel and recording by recording.
pub(super) fn tracks<T: Twin>(inquiry: &Inquiry<'_, T>, hypothesis: &Hypothesis<T>, covariates: &Covariates) -> Vec<Track> {
    let parts = &inquiry.evidence.compared;
    let mut tracks: BTreeMap<(usize, String), Track> = BTreeMap::new();
    for block in inquiry.problem(&hypothesis.twin, parts).blocks() {
        let recording = parts[block.part].recording;
        // By number rather than by address, so that the order is the same in every run.
        let number = inquiry.evidence.free_run.iter().position(|p| std::ptr::eq(p.recording, recording)).unwrap_or(0);
        let own = covariates.get(&identity(recording)).map_or(&[][..], Vec::as_slice);
        let track = tracks.entry((number, block.channel.clone())).or_insert_with(|| Track {
            channel: block.channel.clone(),
            recording: recording.name.clone(),
            time: Vec::new(),
            residual: Vec::new(),
            covariates: own.iter().map(|(name, _)| (*name, Vec::new())).collect(),
        });
        track.time.extend(block.rows.iter().map(|row| recording.time[*row]));
        track.residual.extend_from_slice(&hypothesis.fit.residual.as_slice()[block.range.clone()]);
        for ((_, kept), (_, all)) in track.covariates.iter_mut().zip(own) {
            kept.extend(block.rows.iter().map(|row| all[*row]));
        }
    }
    tracks.into_values().collect()
}

/// The stretches of one channel in which it errs most, worst first.
fn intervals(tracks: &[&Track]) -> Vec<Interval> {
    let total: f64 = tracks.iter().flat_map(|t| &t.residual).map(|r| r * r).sum();
    let count: usize = tracks.iter().map(|t| t.residual.len()).sum();
    if total <= ABOVE_NOISE * count as f64 {
        return Vec::new();
    }
    let mut all: Vec<Interval> = tracks.iter().flat_map(|track| of_one(track, total)).collect();
    all.sort_by(|a, b| b.share_of_error.total_cmp(&a.share_of_error));
    all.retain(|interval| interval.share_of_error >= SHARE);
    all.truncate(TOLD);
    all
}

fn of_one(track: &Track, total: f64) -> Vec<Interval> {
    let rows = track.residual.len();
    let width = (rows / WINDOWS).max(FEWEST_ROWS);
    let count = rows / width;
    if count < 4 {
        return Vec::new();
    }
    let cut = |k: usize| rows * k / count;
    let squares = |from: usize, to: usize| track.residual[cut(from)..cut(to)].iter().map(|r| r * r).sum::<f64>();
    let means: Vec<f64> = (0..count).map(|k| squares(k, k + 1) / (cut(k + 1) - cut(k)) as f64).collect();
    let freedom = (width as f64 / autocorrelation_time(&[&track.residual])).max(1.0);
    let loud = loud(&means, freedom);
    let mut out = Vec::new();
    let mut k = 0;
    while k < count {
        let end = (k..count).find(|j| !loud[*j]).unwrap_or(count);
        if end > k {
            out.push(Interval {
                channel: track.channel.clone(),
                start: track.time[cut(k)],
                end: track.time[cut(end).min(rows - 1)],
                share_of_error: squares(k, end) / total,
                recording: track.recording.clone(),
            });
        }
        k = end + 1;
    }
    out
}

/// Which windows have a larger mean squared residual than chance would have it: a chi-square test of each against the level of
/// the quiet ones, which the lower quartile tells, or the noise. Where all are alike, the worse ones are told.
///
/// `freedom` is the number of independent residuals in a window.
fn loud(means: &[f64], freedom: f64) -> Vec<bool> {
    let Ok(chance) = ChiSquared::new(freedom) else { return vec![false; means.len()] };
    let mut sorted = means.to_vec();
    sorted.sort_by(f64::total_cmp);
    let quartile = sorted[sorted.len() / 4] / (chance.inverse_cdf(0.25) / freedom).max(1e-3);
    let quiet = quartile.max(1.0);
    let significant = quiet * chance.inverse_cdf(1.0 - CHANCE / means.len() as f64) / freedom;
    let limit = significant.max(MATERIAL * quiet);
    let mut loud: Vec<bool> = means.iter().map(|mean| *mean > limit).collect();
    if !loud.contains(&true) {
        let worse = WORSE * means.iter().sum::<f64>() / means.len() as f64;
        loud = means.iter().map(|mean| *mean > worse).collect();
    }
    // A single quiet window between loud ones is where the residual crosses zero.
    for k in 1..loud.len().saturating_sub(1) {
        loud[k] |= loud[k - 1] && loud[k + 1];
    }
    loud
}

/// The states in which one channel errs most, each covariate with the range of it that holds the error, the most telling
/// first.
fn against(tracks: &[&Track], clock: Clock, unit: &dyn Fn(&str) -> String) -> Vec<Bin> {
    let Some(first) = tracks.first() else { return Vec::new() };
    let residual: Vec<f64> = tracks.iter().flat_map(|t| t.residual.iter().copied()).collect();
    if residual.iter().map(|r| r * r).sum::<f64>() <= ABOVE_NOISE * residual.len() as f64 {
        return Vec::new();
    }
    let mut names: Vec<&str> = first.covariates.iter().map(|(name, _)| *name).collect();
    names.retain(|name| tracks.iter().all(|t| t.covariates.iter().any(|(other, _)| other == name)));
    let of = |track: &Track, name: &str| {
        track.covariates.iter().find(|(other, _)| *other == name).map(|(_, values)| values.clone()).unwrap_or_default()
    };
    let mut columns: Vec<(String, String, Vec<f64>)> = names
        .iter()
        .map(|name| ((*name).to_owned(), unit(name), tracks.iter().flat_map(|t| of(t, name)).collect()))
        .collect();
    if clock != Clock::Event {
        columns.push(("time".to_owned(), "s".to_owned(), tracks.iter().flat_map(|t| t.time.clone()).collect()));
    }
    let mut found: Vec<(f64, Bin)> = columns
        .into_iter()
        .filter_map(|(name, unit, values)| {
            let signed = range(&first.channel, &name, &unit, &values, &residual);
            let both = values.iter().any(|v| *v < 0.0) && values.iter().any(|v| *v > 0.0);
            let size: Vec<f64> = values.iter().map(|v| v.abs()).collect();
            let unsigned = if both { range(&first.channel, &format!("|{name}|"), &unit, &size, &residual) } else { None };
            // Of a size and its two signs the size is said more simply.
            let unsigned = unsigned.map(|(distance, bin)| (SIMPLER * distance, bin));
            [signed, unsigned].into_iter().flatten().max_by(|a, b| a.0.total_cmp(&b.0))
        })
        .collect();
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.truncate(TOLD_BINS);
    found.into_iter().map(|(_, bin)| bin).collect()
}

/// The range of a covariate in which the squared error is densest, and how far the error's distribution over the covariate
/// is from that of the rows (Kullback & Leibler 1951); none where it is about the same.
fn range(channel: &str, on: &str, unit: &str, values: &[f64], residual: &[f64]) -> Option<(f64, Bin)> {
    let order = sorted(values);
    let bins = quantile_bins(&order, values);
    if bins.len() < 3 {
        return None;
    }
    let squares = |rows: &[usize]| rows.iter().map(|i| residual[*i] * residual[*i]).sum::<f64>();
    let (total, count) = (squares(&order), order.len() as f64);
    let shares: Vec<(f64, f64)> = bins.iter().map(|b| (squares(b) / total, b.len() as f64 / count)).collect();
    let distance: f64 =
        shares.iter().filter(|(error, _)| *error > 0.0).map(|(error, rows)| error * (error / rows).ln()).sum();
    let density = |k: usize| shares[k].0 / shares[k].1;
    let densest = (0..bins.len()).max_by(|a, b| density(*a).total_cmp(&density(*b)))?;
    let low = (0..densest).rev().take_while(|k| density(*k) > WORSE).last().unwrap_or(densest);
    let high = (densest..bins.len()).take_while(|k| density(*k) > WORSE).last().unwrap_or(densest);
    let (error, rows) = shares[low..=high].iter().fold((0.0, 0.0), |sum, s| (sum.0 + s.0, sum.1 + s.1));
    // What holds in one half of the recordings only is a matter of time, not of state.
    let half = |parity: bool| {
        let inside: Vec<usize> = bins[low..=high].iter().flat_map(|b| b.iter().copied()).collect();
        let own =
            |rows: &[usize]| -> Vec<usize> { rows.iter().copied().filter(|i| (2 * i >= values.len()) == parity).collect() };
        let (inside, all) = (own(&inside), own(&order));
        let (of_error, of_rows) = (squares(&inside) / squares(&all), inside.len() as f64 / all.len().max(1) as f64);
        on == "time" || of_error > WORSE * of_rows
    };
    // A stretch in the midst of a recording is told among the intervals; since when, or until when, is said here.
    let open = on != "time" || low == 0 || high + 1 == bins.len();
    let clear = error > DENSER * rows && error > HOLDS && half(false) && half(true) && open;
    let value = |i: usize| values[i];
    clear.then(|| {
        let bin = Bin {
            channel: channel.to_owned(),
            on: on.to_owned(),
            unit: unit.to_owned(),
            from: (low > 0).then(|| value(bins[low][0])),
            to: (high + 1 < bins.len()).then(|| value(bins[high + 1][0])),
            share_of_error: error,
            share_of_rows: rows,
        };
        (distance, bin)
    })
}

/// How unevenly the squared error lies over the values of a covariate (Kullback & Leibler, as [`range`] has it).
pub(super) fn unevenness(values: &[f64], residual: &[f64]) -> f64 {
    let order = sorted(values);
    let squares = |rows: &[usize]| rows.iter().map(|i| residual[*i] * residual[*i]).sum::<f64>();
    let total = squares(&order);
    let of = |bin: &&[usize]| {
        let (error, rows) = (squares(bin) / total, bin.len() as f64 / order.len() as f64);
        if error > 0.0 { error * (error / rows).ln() } else { 0.0 }
    };
    quantile_bins(&order, values).iter().map(of).sum()
}

/// Numbers of the rows that have a value, by value.
pub(super) fn sorted(values: &[f64]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..values.len()).filter(|i| values[*i].is_finite()).collect();
    order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    order
}

/// Quantile bins of rows sorted by their values; equal values stay together.
pub(super) fn quantile_bins<'a>(order: &'a [usize], values: &[f64]) -> Vec<&'a [usize]> {
    let mut bins = Vec::new();
    let mut from = 0;
    for k in 1..=BINS {
        let mut to = (order.len() * k / BINS).max(from);
        while to > from && to < order.len() && values[order[to]] == values[order[to - 1]] {
            to += 1;
        }
        if to > from {
            bins.push(&order[from..to]);
            from = to;
        }
    }
    bins
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim2real::Seed;
    use rand_distr::{Distribution, StandardNormal};

    /// 20 s at 100 Hz of noise of standard deviation 1 and of `more` where it acts.
    fn track(more: impl Fn(f64, f64) -> f64) -> Track {
        let mut rng = Seed(4).stream("locate");
        let time: Vec<f64> = (0..2_000).map(|i| f64::from(i) * 0.01).collect();
        let velocity: Vec<f64> = time.iter().map(|t| (1.3 * t).sin() + 0.4 * (4.1 * t).sin()).collect();
        let residual = time
            .iter()
            .zip(&velocity)
            .map(|(t, v)| {
                let noise: f64 = StandardNormal.sample(&mut rng);
                noise + more(*t, *v)
            })
            .collect();
        Track { channel: "position".into(), recording: "r".into(), time, residual, covariates: vec![("velocity", velocity)] }
    }

    fn of(track: &Track) -> Vec<Bin> {
        against(&[track], Clock::Sampled { longest_step: 0.01 }, &|_| "rad/s".into())
    }

    #[test]
    fn finds_the_stretches_that_are_off() {
        let found = intervals(&[&track(|t, _| {
            if (4.0..6.0).contains(&t) || (11.0..11.7).contains(&t) { 6.0 * (9.0 * t).sin() } else { 0.0 }
        })]);
        assert_eq!(found.len(), 2, "{found:?}");
        for (interval, (start, end)) in found.iter().zip([(4.0, 6.0), (11.0, 11.7)]) {
            assert!((interval.start - start).abs() < 0.2 && (interval.end - end).abs() < 0.2, "{interval:?}");
        }
        assert!(found[0].share_of_error > 0.5 && found[1].share_of_error < 0.25, "{found:?}");
    }

    #[test]
    fn noise_alone_is_off_nowhere() {
        let quiet = track(|_, _| 0.0);
        assert!(intervals(&[&quiet]).is_empty() && of(&quiet).is_empty());
    }

    #[test]
    fn finds_the_states_that_are_off() {
        let slow = of(&track(|t, v| if v.abs() < 0.2 { 5.0 * (7.0 * t).cos() } else { 0.0 }));
        assert_eq!(slow[0].on, "|velocity|", "{slow:?}");
        assert!(
            slow[0].from.is_none() && (slow[0].to.unwrap() - 0.2).abs() < 0.1 && slow[0].share_of_error > 0.6,
            "{slow:?}"
        );
        let forward = of(&track(|_, v| if v > 0.9 { 4.0 } else { 0.0 }));
        assert_eq!(forward[0].on, "velocity", "{forward:?}");
        assert!(forward[0].to.is_none() && (forward[0].from.unwrap() - 0.9).abs() < 0.15, "{forward:?}");
        let late = of(&track(|t, _| if t > 15.0 { 4.0 } else { 0.0 }));
        assert_eq!(late[0].on, "time", "{late:?}");
    }
}
