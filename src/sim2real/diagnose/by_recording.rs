//! Which of several recordings is off, and how much of that is explained.

use super::{Comparison, RecordingError};

/// The errors on held-out data, recording by recording and channel by channel; nothing where there is one recording alone. A
/// channel without samples in a recording is left out.
pub(super) fn by_recording(comparisons: &[Comparison]) -> Vec<RecordingError> {
    let held: Vec<&Comparison> = comparisons.iter().filter(|comparison| comparison.held_out).collect();
    let parts_of = |channel: &str| held.iter().filter(|comparison| comparison.channel == channel).count();
    let squares = |comparison: &Comparison, simulated: &[f64]| -> f64 {
        let errors = comparison.measured.iter().zip(simulated).filter_map(|(m, s)| Some((*m)? - s));
        errors.map(|error| error * error).sum()
    };
    let mut found = Vec::new();
    for comparison in held.iter().filter(|comparison| parts_of(&comparison.channel) > 1) {
        let own = held.iter().filter(|other| other.channel == comparison.channel);
        let whole: f64 = own.map(|other| squares(other, &other.recalibrated)).sum();
        let rows = comparison.measured.iter().flatten().count();
        if rows == 0 {
            continue;
        }
        // A run that has left all bounds has an error without one.
        let rmse = |simulated: &[f64]| {
            let error = (squares(comparison, simulated) / rows as f64).sqrt();
            if error.is_nan() { f64::INFINITY } else { error }
        };
        let share = squares(comparison, &comparison.recalibrated) / whole;
        found.push(RecordingError {
            recording: comparison.recording.clone(),
            channel: comparison.channel.clone(),
            unit: comparison.unit.clone(),
            rows,
            share_of_error: if share.is_finite() { share } else { 0.0 },
            nominal_rmse: rmse(&comparison.nominal),
            recalibrated_rmse: rmse(&comparison.recalibrated),
            trued_rmse: rmse(&comparison.trued),
        });
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim2real::Clock;

    fn comparison(recording: &str, held_out: bool, error: f64) -> Comparison {
        Comparison {
            recording: recording.to_owned(),
            held_out,
            clock: Clock::Event,
            channel: "cost".to_owned(),
            unit: "bps".to_owned(),
            time: vec![0.0, 1.0, 2.0],
            measured: vec![Some(1.0), None, Some(1.0)],
            nominal: vec![1.0 + 2.0 * error, 9.0, 1.0 - 2.0 * error],
            recalibrated: vec![1.0 + error, 9.0, 1.0 - error],
            trued: vec![1.0, 9.0, 1.0],
        }
    }

    #[test]
    fn the_recording_that_is_off_holds_the_error() {
        assert_eq!(by_recording(&[comparison("A", false, 1.0), comparison("A", true, 1.0)]), []);
        let all = [comparison("A", true, 1.0), comparison("B", true, 3.0), comparison("B", false, 9.0)];
        let found = by_recording(&all);
        let told: Vec<(&str, usize, f64, [f64; 3])> = found
            .iter()
            .map(|e| (e.recording.as_str(), e.rows, e.share_of_error, [e.nominal_rmse, e.recalibrated_rmse, e.trued_rmse]))
            .collect();
        assert_eq!(told, [("A", 2, 0.1, [2.0, 1.0, 0.0]), ("B", 2, 0.9, [6.0, 3.0, 0.0])]);
    }
}
