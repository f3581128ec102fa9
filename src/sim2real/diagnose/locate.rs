//! Where: the stretches of time in which the twin, refitted, parts from the recording.

use super::{Comparison, Interval};

/// Stretches into which a recording is cut.
const STRETCHES: usize = 50;
/// A stretch counts when its mean squared error is this many times the mean.
const WORSE: f64 = 1.5;
/// Most stretches that are told.
const TOLD: usize = 5;

/// The worst stretches of the fitted recordings, worst first: neighbouring bad ones are one.
pub(super) fn intervals(comparisons: &[Comparison]) -> Vec<Interval> {
    let mut all: Vec<Interval> = comparisons.iter().filter(|c| !c.held_out).flat_map(of_one).collect();
    all.sort_by(|a, b| b.share_of_error.total_cmp(&a.share_of_error));
    all.truncate(TOLD);
    all
}

fn of_one(comparison: &Comparison) -> Vec<Interval> {
    let squares: Vec<f64> = comparison
        .measured
        .iter()
        .zip(&comparison.recalibrated)
        .map(|(measured, simulated)| measured.map_or(0.0, |m| (m - simulated).powi(2)))
        .collect();
    let total: f64 = squares.iter().sum();
    let rows = squares.len();
    if rows < STRETCHES || total <= 0.0 {
        return Vec::new();
    }
    let cut = |k: usize| rows * k / STRETCHES;
    let share = |from: usize, to: usize| squares[cut(from)..cut(to)].iter().sum::<f64>() / total;
    let bad: Vec<bool> = (0..STRETCHES).map(|k| share(k, k + 1) > WORSE / STRETCHES as f64).collect();
    let mut out = Vec::new();
    let mut k = 0;
    while k < STRETCHES {
        let end = (k..STRETCHES).find(|j| !bad[*j]).unwrap_or(STRETCHES);
        if end > k {
            out.push(Interval {
                channel: comparison.channel.clone(),
                start: comparison.time[cut(k)],
                end: comparison.time[(cut(end)).min(rows - 1)],
                share_of_error: share(k, end),
                recording: comparison.recording.clone(),
            });
        }
        k = end + 1;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim2real::Clock;

    #[test]
    fn finds_the_stretch_that_is_off() {
        let time: Vec<f64> = (0..1_000).map(|i| f64::from(i) * 0.01).collect();
        let measured = time.iter().map(|t| Some(if (4.0..6.0).contains(t) { 1.0 } else { 0.01 })).collect();
        let flat = vec![0.0; 1_000];
        let found = intervals(&[Comparison {
            recording: "r".into(),
            held_out: false,
            clock: Clock::Event,
            channel: "y".into(),
            unit: String::new(),
            time,
            measured,
            nominal: flat.clone(),
            recalibrated: flat.clone(),
            trued: flat,
        }]);
        assert_eq!(found.len(), 1);
        assert!((found[0].start - 4.0).abs() < 0.21 && (found[0].end - 6.0).abs() < 0.21 && found[0].share_of_error > 0.99);
    }
}
