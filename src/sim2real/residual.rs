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

/// `(measured - simulated) / noise`: channel after channel in the order of `weights`, and within each the rows that count and were
/// not lost; what is not a number is `diverged`. `simulated` begins at the row the part starts from.
///
/// Residuals are written where the samples were: recordings may be longer than what stays near the processor, and every further copy
/// of them goes through memory.
pub(crate) fn residuals<S>(
    part: &Part<'_, S>,
    mut simulated: Vec<Simulated>,
    weights: &[ChannelWeight],
    diverged: f64,
) -> Vec<f64> {
    let mut all = Vec::new();
    for weight in weights {
        let Some(measured) = part.recording.channel(&weight.channel) else { continue };
        let Some(simulated) = simulated.iter_mut().find(|s| s.channel == weight.channel) else { continue };
        let inverse = 1.0 / weight.noise;
        let mut own = std::mem::take(&mut simulated.samples);
        let (skipped, mut kept) = (part.rows.start - part.start, 0);
        for (k, measured) in measured.samples[part.rows.clone()].iter().enumerate().take(own.len().saturating_sub(skipped)) {
            let Some(measured) = measured else { continue };
            let residual = (measured - own[skipped + k]) * inverse;
            own[kept] = if residual.is_finite() { residual } else { diverged };
            kept += 1;
        }
        own.truncate(kept);
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
        let found = residuals(&part, runs, &[weight("b", 0.5), weight("lacking", 1.0), weight("a", 2.0)], 7.0);
        assert_eq!(found, [1.0, -1.0, 7.0, 0.5, 1.0]);
    }
}
