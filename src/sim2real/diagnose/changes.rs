//! When the error of the recalibrated twin grew or shrank for good: the gap between model and recording, divided into regimes.

use super::Change;
use super::locate::Track;
use crate::sim2real::regime::{Cost, Division, Penalty};

/// Windows into which a recording is cut, and rows of a window at the least.
const WINDOWS: usize = 200;
const FEWEST_ROWS: usize = 5;
/// Windows a regime lasts at the least, and a recording has at the least.
const SHORTEST: usize = 8;
const FEWEST: usize = 4 * SHORTEST;
/// An error changes where it grows or shrinks by this factor.
const FACTOR: f64 = 1.5;
/// Where there are more changes than these in a recording, its error comes and goes with what the system does: that is told by states.
const MOST: usize = 4;
/// Below this mean squared residual, in units of the noise, there is no error.
const ABOVE_NOISE: f64 = 1.5;

/// The changes of a channel's error in each recording, in order of time.
pub(super) fn changes(tracks: &[&Track]) -> Vec<Change> {
    let squares: f64 = tracks.iter().flat_map(|track| &track.residual).map(|r| r * r).sum();
    let count: usize = tracks.iter().map(|track| track.residual.len()).sum();
    if squares <= ABOVE_NOISE * count as f64 {
        return Vec::new();
    }
    tracks.iter().flat_map(|track| of_one(track)).collect()
}

fn of_one(track: &Track) -> Vec<Change> {
    let rows = track.residual.len();
    let width = (rows / WINDOWS).max(FEWEST_ROWS);
    let count = rows / width;
    if count < FEWEST {
        return Vec::new();
    }
    let cut = |k: usize| rows * k / count;
    let mean_square = |from: usize, to: usize| {
        let own = &track.residual[cut(from)..cut(to)];
        own.iter().map(|r| r * r).sum::<f64>() / own.len() as f64
    };
    // Errors below the noise are all alike.
    let sizes: Vec<f64> = (0..count).map(|k| mean_square(k, k + 1).max(1.0).ln()).collect();
    let division = Division { cost: Cost::Mean, penalty: Penalty::Mbic, shortest: SHORTEST };
    let Ok(divided) = division.divide(&sizes) else { return Vec::new() };
    let mut ends = divided.changes;
    if ends.len() > MOST {
        return Vec::new();
    }
    ends.push(count);
    let mut begin = 0;
    let mut found = Vec::new();
    for pair in ends.windows(2) {
        let (at, end) = (pair[0], pair[1]);
        let factor = (mean_square(at, end) / mean_square(begin, at)).sqrt();
        begin = at;
        if factor.is_finite() && !(1.0 / FACTOR..=FACTOR).contains(&factor) {
            let (channel, recording) = (track.channel.clone(), track.recording.clone());
            found.push(Change { channel, recording, time: track.time[cut(at)], factor });
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use rand::RngExt;

    use super::*;
    use crate::sim2real::Seed;

    /// Residuals at 100 Hz whose size is told for each second.
    fn track(size: impl Fn(f64) -> f64) -> Track {
        let mut draws = Seed(3).stream("changes");
        let time: Vec<f64> = (0..3_000).map(|k| 0.01 * f64::from(k)).collect();
        let residual = time.iter().map(|t| size(*t) * 3.0_f64.sqrt() * draws.random_range(-1.0..1.0)).collect();
        Track { channel: "position".into(), recording: "r".into(), time, residual, covariates: Vec::new() }
    }

    #[test]
    fn an_error_that_grows_and_shrinks_is_dated() {
        let found = changes(&[&track(|t| if (12.4..20.0).contains(&t) { 9.0 } else { 2.0 })]);
        let told: Vec<(f64, f64)> = found.iter().map(|change| (change.time, change.factor)).collect();
        assert_eq!(told.len(), 2, "{told:?}");
        assert!((told[0].0 - 12.4).abs() < 0.3 && (told[0].1 / 4.5 - 1.0).abs() < 0.1, "{told:?}");
        assert!((told[1].0 - 20.0).abs() < 0.3 && (told[1].1 * 4.5 - 1.0).abs() < 0.1, "{told:?}");
    }

    #[test]
    fn what_is_steady_what_comes_and_goes_and_what_is_noise_has_no_changes() {
        assert_eq!(changes(&[&track(|_| 5.0)]), []);
        assert_eq!(changes(&[&track(|t| if (t as usize / 3).is_multiple_of(2) { 2.0 } else { 9.0 })]), []);
        assert_eq!(changes(&[&track(|t| if t > 15.0 { 1.1 } else { 0.4 })]), []);
        assert_eq!(changes(&[&Track { residual: vec![9.0; 20], time: vec![0.0; 20], ..track(|_| 1.0) }]), []);
    }
}
