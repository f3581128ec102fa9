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

/// Appends `(measured - simulated) / noise` to `out`: channel after channel in the order of `weights`, and within each
/// the rows that count and were not lost. `simulated` begins at the row the part starts from.
pub(crate) fn residuals_into<S>(part: &Part<'_, S>, simulated: &[Simulated], weights: &[ChannelWeight], out: &mut Vec<f64>) {
    for weight in weights {
        let Some(measured) = part.recording.channel(&weight.channel) else { continue };
        let Some(simulated) = simulated.iter().find(|s| s.channel == weight.channel) else { continue };
        let inverse = 1.0 / weight.noise;
        let simulated = &simulated.samples[part.rows.start - part.start..];
        out.reserve(part.rows.len());
        for (measured, simulated) in measured.samples[part.rows.clone()].iter().zip(simulated) {
            if let Some(measured) = measured {
                out.push((measured - simulated) * inverse);
            }
        }
    }
}
