//! What the samples of a recording say by themselves: how its first channel moves, and how finely it was read.

use nalgebra::{Matrix3, Vector3};

use crate::sim2real::{Measured, Parameter, Recording, Typical};

/// Value and rate of a channel at one row, as measured.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Estimate {
    /// Value, in the channel's unit.
    pub value: f64,
    /// Standard deviation of `value`; infinite where nothing tells it.
    pub value_std: f64,
    /// Rate [the channel's unit/s].
    pub rate: f64,
    /// Standard deviation of `rate`, in its unit; infinite where nothing tells it.
    pub rate_std: f64,
}

/// Rows on either side that a local estimate uses, ...
const REACH: usize = 7;
/// ... the fewest samples it needs, ...
const FEWEST: usize = 5;
/// ... how many times as far as the nearest of them is away they must reach, for a parabola leads astray where it goes on from
/// what is close together, ...
const SPREAD: f64 = 2.0;
/// ... how many rows away it looks for the next of them where samples are few, and how many it takes at the most.
const FARTHEST: usize = 16 * REACH;
const MOST: usize = 64;

/// A parabola by least squares through the samples of `channel` around `row`; where there is a channel `rate`, its sample.
pub(super) fn local<S>(recording: &Recording<S>, channel: &str, rate: &str, row: usize) -> Option<Estimate> {
    let samples = &recording.channel(channel)?.samples;
    // Asked for at every row: without room of its own for each.
    let mut points = [(0.0, 0.0); MOST];
    let mut count = 0;
    let near = row.saturating_sub(REACH)..(row + REACH + 1).min(recording.len());
    let beyond = (REACH + 1..=FARTHEST).flat_map(|away| [row.checked_sub(away), Some(row + away)]);
    for (looked_at, i) in near.clone().chain(beyond.flatten().filter(|i| *i < recording.len())).enumerate() {
        if looked_at >= near.len() && (count == MOST || enough(&points[..count])) {
            break;
        }
        if let Some(y) = samples[i] {
            points[count] = (recording.time[i] - recording.time[row], y);
            count += 1;
        }
    }
    let points = &points[..count];
    let scale = points.iter().map(|(t, _)| t.abs()).fold(0.0, f64::max);
    if points.len() < FEWEST || scale <= 0.0 {
        let (_, value) = points.first()?;
        return Some(Estimate { value: *value, value_std: f64::INFINITY, rate: 0.0, rate_std: f64::INFINITY });
    }
    let powers = |t: f64| Vector3::new(1.0, t / scale, (t / scale).powi(2));
    let (mut information, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for (t, y) in points {
        let row = powers(*t);
        information += row * row.transpose();
        right += row * *y;
    }
    let inverse = information.try_inverse()?;
    let solution = inverse * right;
    let spare = (points.len() - 3) as f64;
    let variance = points.iter().map(|(t, y)| (y - powers(*t).dot(&solution)).powi(2)).sum::<f64>() / spare;
    // Samples that repeat each other are rounded alike: they tell no more than as many as the parabola has coefficients.
    let rounded = step_seen(samples, row).powi(2) / 12.0 * points.len() as f64 / 3.0;
    let measured = recording.channel(rate).and_then(|v| v.samples[row]);
    Some(Estimate {
        value: solution[0],
        value_std: ((variance + rounded) * inverse[(0, 0)]).sqrt(),
        rate: measured.unwrap_or(solution[1] / scale),
        rate_std: ((variance + rounded) * inverse[(1, 1)]).sqrt() / scale,
    })
}

/// Value and rate at `row`, where a recording or a window of it is followed from. A rate that is measured is taken where the samples of
/// `channel` tell far less of it: it may be late or out of scale, and one sample of it as noisy as any.
pub(super) fn begun<S>(recording: &Recording<S>, channel: &str, rate: &str, row: usize) -> Estimate {
    let seen = local(recording, channel, "", row).unwrap_or_default();
    match local(recording, rate, "", row) {
        Some(told) if told.value_std.is_finite() && FAR_LESS * told.value_std < seen.rate_std => {
            Estimate { rate: told.value, rate_std: told.value_std, ..seen }
        }
        _ => seen,
    }
}

/// So many times as wide a standard deviation is far less.
const FAR_LESS: f64 = 3.0;

/// The step in which samples about `row` are counted, where some of them repeat each other: the smallest of their changes, or the next
/// one where they do not change at all. 0 where none repeats another, and where nothing ever changes.
fn step_seen(samples: &[Option<f64>], row: usize) -> f64 {
    let changes = |rows: std::ops::Range<usize>| {
        let pairs = samples[rows].windows(2);
        pairs.filter_map(|w| Some((w[1]? - w[0]?).abs()))
    };
    let around = |reach: usize| row.saturating_sub(reach)..(row + reach + 1).min(samples.len());
    if !changes(around(REACH)).any(|change| change == 0.0) {
        return 0.0;
    }
    let smallest = |reach| changes(around(reach)).filter(|change| *change > 0.0).min_by(f64::total_cmp);
    smallest(REACH).or_else(|| smallest(FARTHEST)).unwrap_or(0.0)
}

/// Whether so many samples, at times from the row in question, tell of it.
fn enough(points: &[(f64, f64)]) -> bool {
    let nearest = points.iter().map(|(t, _)| t.abs()).fold(f64::INFINITY, f64::min);
    let first = points.iter().map(|(t, _)| *t).fold(f64::INFINITY, f64::min);
    let last = points.iter().map(|(t, _)| *t).fold(f64::NEG_INFINITY, f64::max);
    points.len() >= FEWEST && last - first >= SPREAD * nearest
}

/// The same at every row; zeros where nothing was measured nearby.
pub(super) fn motion<S>(recording: &Recording<S>, channel: &str, rate: &str) -> Vec<Estimate> {
    (0..recording.len()).map(|row| local(recording, channel, rate, row).unwrap_or_default()).collect()
}

/// The rate at `row`, where a recording or a window of it is followed from, as far as its samples tell. A recording may well begin at
/// rest, and otherwise at a rate of about `usual`, which is asked for there alone; a window begins in the midst of motion.
pub(super) fn initial_rate(
    name: &'static str,
    unit: &'static str,
    seen: &Estimate,
    row: usize,
    usual: impl FnOnce() -> f64,
) -> Parameter {
    let parameter = Parameter::new(name, unit, seen.rate).known_to(seen.rate_std.max(1e-9));
    if row == 0 { parameter.at_rest_or_about(usual()) } else { parameter }
}

/// Typical sizes of a plant whose first channel is `channel` with the rate `rate`, driven by `commands` [unit of the
/// command] through a gain of `gain` [effort per unit].
pub(super) fn typical<S: AsRef<[f64]>>(recordings: &[Recording<S>], channel: &str, rate: &str, gain: f64) -> Typical {
    let command = root_mean_square(recordings.iter().flat_map(|r| r.stimulus.as_ref().iter().copied()));
    let seen: Vec<Estimate> =
        recordings.iter().flat_map(|r| (0..r.len()).step_by(7).filter_map(|row| local(r, channel, rate, row))).collect();
    let mean = seen.iter().map(|e| e.value).sum::<f64>() / seen.len().max(1) as f64;
    let step = |r: &Recording<S>| r.channel(channel).map_or(0.0, rounding) * 12.0_f64.sqrt();
    Typical {
        command,
        effort: command * gain.abs(),
        output: root_mean_square(seen.iter().map(|e| e.value - mean)),
        rate: root_mean_square(seen.iter().map(|e| e.rate)),
        range: range(seen.iter().map(|e| e.value)),
        resolution: recordings.iter().map(step).fold(0.0, f64::max),
        duration: recordings.iter().filter_map(|r| Some(r.time.last()? - r.time.first()?)).fold(0.0, f64::max),
        delay: None,
        delays: None,
        quantum: None,
        age: None,
    }
}

/// Standard deviation of the rounding of a sensor that counts in steps: `step / sqrt(12)` (Widrow & Kollár,
/// *Quantization Noise* (2008), section 5.4), where nine in ten changes of the signal are whole multiples of one step, but for
/// the decimals it was written down to; 0 elsewhere.
pub(super) fn rounding(measured: &Measured) -> f64 {
    let changes = measured.samples.windows(2).filter_map(|w| Some((w[1]? - w[0]?).abs()));
    let largest = changes.clone().fold(0.0, f64::max);
    // Differences of rounded numbers are not quite whole multiples: the last bits differ.
    let mut changes: Vec<f64> = changes.filter(|change| *change > 1e-9 * largest).collect();
    changes.sort_by(f64::total_cmp);
    let Some(smallest) = changes.first() else { return 0.0 };
    let written = last_decimal(measured);
    let written = if written < COARSE * smallest { written } else { 0.0 };
    // The smallest changes are known to a decimal alone; what they have in common with larger ones tells the step.
    let (mut sum, mut steps, mut whole) = (0.0, 0.0, 0);
    for change in &changes {
        let step = if steps > 0.0 { sum / steps } else { *smallest };
        let count = (change / step).round();
        if (change - count * step).abs() < 1e-3 * step + 1.01 * written {
            (sum, steps, whole) = (sum + change, steps + count, whole + 1);
        }
    }
    if 10 * whole >= 9 * changes.len() { sum / steps / 12.0_f64.sqrt() } else { 0.0 }
}

/// What is written down to decimals that are coarser than this part of the smallest change is a multiple of anything.
const COARSE: f64 = 0.1;

/// The value of the last decimal that the samples were written down to; 0 where they have all their digits.
fn last_decimal(measured: &Measured) -> f64 {
    let is_whole = |power: i32| {
        let parts = measured.samples.iter().flatten().map(|y| y * 10.0_f64.powi(power));
        parts.into_iter().all(|part| part.abs() < 1e11 && (part - part.round()).abs() < 1e-4)
    };
    (0..=9).find(|power| is_whole(*power)).map_or(0.0, |power| 10.0_f64.powi(-power))
}

/// Root mean square of what is finite; 0 where nothing is.
pub(super) fn root_mean_square(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.filter(|v| v.is_finite()).fold((0.0, 0), |(sum, count), v| (sum + v * v, count + 1));
    (sum / f64::from(count.max(1))).sqrt()
}

/// Lowest and highest of the values; 0 where there is none.
fn range(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values
        .fold(None, |range, v| Some(range.map_or([v, v], |[low, high]: [f64; 2]| [low.min(v), high.max(v)])))
        .unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sensor_that_counts_is_no_better_than_its_step() {
        let step = 2.0 * std::f64::consts::PI / 4096.0;
        let position = |read: &dyn Fn(f64) -> f64| Measured {
            channel: "position".into(),
            unit: "rad".into(),
            samples: (0..2_000).map(|i| Some(read(f64::from(i) * 4e-3))).collect(),
        };
        let counted = position(&|t| ((0.05 * (3.1 * t).sin()) / step).round() * step);
        assert!((rounding(&counted) / (step / 12.0_f64.sqrt()) - 1.0).abs() < 1e-6, "{}", rounding(&counted));
        assert_eq!(rounding(&position(&|t| 0.3 * t.sin())), 0.0);
        // Written down to so many decimals, counts are no whole multiples of their smallest change any more.
        let fast = |t: f64| ((1.3 * (3.1 * t).sin() + 0.4 * (7.7 * t).cos()) / step).round() * step;
        for decimals in [1e4, 1e5, 1e6, 1e7] {
            let written = rounding(&position(&|t| (fast(t) * decimals).round() / decimals));
            assert!((written / (step / 12.0_f64.sqrt()) - 1.0).abs() < 1e-3, "{decimals}: {written}");
        }
        let noisy = |t: f64| ((0.3 * t.sin() + 1e-3 * (7919.0 * t).sin()) * 1e6).round() / 1e6;
        assert!(rounding(&position(&noisy)) < 1e-6);
    }

    #[test]
    fn value_and_rate_are_those_of_the_parabola() {
        let time: Vec<f64> = (0..40).map(|i| f64::from(i) * 0.01).collect();
        let samples = time.iter().map(|t| Some(1.0 + 2.0 * t + 3.0 * t * t)).collect();
        let measured = vec![Measured { channel: "q".into(), unit: "m".into(), samples }];
        let recording = Recording { name: String::new(), time, stimulus: (), measured };
        let middle = local(&recording, "q", "qd", 20).unwrap();
        assert!((middle.value - 1.52).abs() < 1e-9 && (middle.rate - 3.2).abs() < 1e-9, "{middle:?}");
        assert!(local(&recording, "none", "", 20).is_none());
        // A rate is what positions change by, until these tell far less of it than what is measured of it.
        let mut with_rate = recording;
        let uneven = |i: usize, size: f64| if i.is_multiple_of(3) { size } else { -0.5 * size };
        let samples = (0..40).map(|i| Some(2.5 + 0.06 * i as f64 + uneven(i, 0.01))).collect();
        with_rate.measured.push(Measured { channel: "v".into(), unit: "m/s".into(), samples });
        assert!((begun(&with_rate, "q", "v", 20).rate - 3.2).abs() < 1e-9);
        let rough = |(i, y): (usize, &mut Option<f64>)| *y = y.map(|y| y + uneven(i, 0.2));
        with_rate.measured[0].samples.iter_mut().enumerate().for_each(rough);
        assert!((begun(&with_rate, "q", "v", 20).rate - 3.7).abs() < 0.01);
    }

    #[test]
    fn samples_that_repeat_each_other_do_not_tell_a_rate_exactly() {
        let time: Vec<f64> = (0..300).map(|i| f64::from(i) * 0.01).collect();
        let counted = |first: usize| (0..300).map(|i| Some(if i < first { 0.0 } else { 1e-3 })).collect();
        let recording = |samples| Recording {
            name: String::new(),
            time: time.clone(),
            stimulus: (),
            measured: vec![Measured { channel: "q".into(), unit: "m".into(), samples }],
        };
        // A step in 0.5 s may go at 2 mm/s, and no slower than that is what eight rows of it tell.
        let begun = local(&recording(counted(50)), "q", "", 0).unwrap();
        assert!(begun.rate.abs() < 1e-12 && begun.rate_std > 2e-3, "{begun:?}");
        // What never moves is at rest.
        assert!(local(&recording(counted(300)), "q", "", 0).unwrap().rate_std < 1e-9);
    }

    #[test]
    fn where_samples_are_few_it_looks_farther() {
        let time: Vec<f64> = (0..200).map(|i| f64::from(i) * 0.01).collect();
        let parabola = |t: f64| 1.0 + 2.0 * t + 3.0 * t * t;
        let one_in_ten = time.iter().enumerate().map(|(i, t)| (i % 10 == 0).then(|| parabola(*t))).collect();
        let measured = vec![Measured { channel: "q".into(), unit: "m".into(), samples: one_in_ten }];
        let recording = Recording { name: String::new(), time, stimulus: (), measured };
        let begun = local(&recording, "q", "qd", 3).unwrap();
        assert!((begun.value - parabola(0.03)).abs() < 1e-9 && (begun.rate - 2.18).abs() < 1e-9, "{begun:?}");
        // Noise is not made more of than a few times, where a run is lost at an end.
        let jagged = |i: usize| if i.is_multiple_of(2) { 1e-3 } else { -1e-3 };
        let run_lost = recording.time.iter().enumerate().map(|(i, t)| (i >= 20).then(|| parabola(*t) + jagged(i))).collect();
        let mut recording = recording;
        recording.measured[0].samples = run_lost;
        let begun = local(&recording, "q", "qd", 0).unwrap();
        assert!((begun.value - 1.0).abs() < 5e-3, "{begun:?}");
        // Where there are too few, the nearest is all that is known.
        let kept = [50, 90].map(|i| recording.time[i]);
        let mut alone = recording;
        let known = |t: &f64| kept.contains(t).then(|| parabola(*t));
        alone.measured[0].samples = alone.time.iter().map(known).collect();
        assert_eq!(local(&alone, "q", "qd", 100).unwrap().value, parabola(alone.time[90]));
    }
}
