//! Measured minus simulated, in units of each channel's noise.

use super::{Part, Simulated};

/// By what a channel's residuals are divided.
#[derive(Debug, Clone, PartialEq)]
pub struct ChannelWeight {
    /// The channel.
    pub channel: String,
    /// Standard deviation of its noise, in its unit; above 0.
    pub noise: f64,
}

/// What one channel of a part is compared with, ready to be compared with many runs.
pub(crate) struct Expected<'a> {
    channel: &'a str,
    /// One over the noise.
    inverse: f64,
    /// The samples that were not lost.
    samples: Vec<f64>,
    /// Where they are in a run, if not one after the other.
    at: Option<Vec<usize>>,
    /// Where the first row that counts is in a run.
    skipped: usize,
}

impl<'a> Expected<'a> {
    /// Of every channel that has a weight, in the order of `weights`: the rows that count and were not lost.
    pub(crate) fn of<S>(part: &Part<'_, S>, weights: &'a [ChannelWeight]) -> Vec<Self> {
        let skipped = part.rows.start - part.start;
        let of_channel = |weight: &'a ChannelWeight| {
            let rows = &part.recording.channel(&weight.channel)?.samples[part.rows.clone()];
            let samples: Vec<f64> = rows.iter().copied().flatten().collect();
            let kept = || rows.iter().enumerate().filter(|(_, sample)| sample.is_some()).map(|(k, _)| skipped + k).collect();
            let at = (samples.len() < rows.len()).then(kept);
            Some(Self { channel: &weight.channel, inverse: 1.0 / weight.noise, samples, at, skipped })
        };
        weights.iter().filter_map(of_channel).collect()
    }

    /// Writes `(measured - simulated) / noise` where the run's samples were, and drops the others.
    fn compare(&self, run: &mut Vec<f64>) {
        let residual = |measured: f64, simulated: f64| {
            let residual = (measured - simulated) * self.inverse;
            if residual.is_finite() { residual } else { DIVERGED }
        };
        let kept = match &self.at {
            None => {
                run.drain(..self.skipped.min(run.len()));
                run.iter_mut().zip(&self.samples).for_each(|(value, measured)| *value = residual(*measured, *value));
                run.len().min(self.samples.len())
            }
            Some(at) => {
                let within = at.partition_point(|at| *at < run.len());
                for (k, (from, measured)) in at[..within].iter().zip(&self.samples).enumerate() {
                    run[k] = residual(*measured, run[*from]);
                }
                within
            }
        };
        run.truncate(kept);
    }
}

/// What a residual that is not a number is taken for: worse than any other, and finite.
const DIVERGED: f64 = 1e15;

/// `(measured - simulated) / noise` of a run that begins at the row the part starts from, channel after channel.
///
/// Residuals are written where the samples were: recordings may be longer than what stays near the processor, and every further copy
/// of them goes through memory.
pub(crate) fn residuals(expected: &[Expected<'_>], mut simulated: Vec<Simulated>) -> Vec<f64> {
    let mut all = Vec::new();
    for expected in expected {
        let Some(simulated) = simulated.iter_mut().find(|s| s.channel == expected.channel) else { continue };
        let mut own = std::mem::take(&mut simulated.samples);
        expected.compare(&mut own);
        if all.is_empty() { all = own } else { all.extend_from_slice(&own) }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim2real::{Measured, Recording};

    #[test]
    fn lost_rows_and_rows_before_the_part_leave_no_gap() {
        let measured = |channel: &str, samples: &[Option<f64>]| Measured {
            channel: channel.into(),
            unit: "rad".into(),
            samples: samples.to_vec(),
        };
        let recording = Recording {
            name: "r".into(),
            time: (0..5).map(f64::from).collect(),
            stimulus: (),
            measured: vec![
                measured("a", &[Some(1.0), Some(2.0), None, Some(4.0), Some(5.0)]),
                measured("b", &[Some(0.5), None, Some(0.5), Some(0.5), Some(f64::NAN)]),
            ],
        };
        let part = Part { recording: &recording, start: 1, rows: 2..5 };
        let simulated = |channel: &str, samples: [f64; 4]| Simulated { channel: channel.into(), samples: samples.to_vec() };
        let runs = vec![simulated("a", [9.0, 9.0, 3.0, 3.0]), simulated("b", [9.0, 0.0, 1.0, 1.0])];
        let weight = |channel: &str, noise: f64| ChannelWeight { channel: channel.into(), noise };
        let weights = [weight("b", 0.5), weight("lacking", 1.0), weight("a", 2.0)];
        let found = residuals(&Expected::of(&part, &weights), runs);
        assert_eq!(found, [1.0, -1.0, DIVERGED, 0.5, 1.0]);
    }
}
