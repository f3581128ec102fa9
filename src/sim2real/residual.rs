//! Measured minus simulated, in units of each channel's noise.

use super::{Part, Simulated, Trajectory};

/// By what a channel's residuals are divided.
#[derive(Debug, Clone, PartialEq)]
pub struct ChannelWeight {
    /// The channel.
    pub channel: String,
    /// Standard deviation of its noise, in its unit; above 0.
    pub noise: f64,
}

/// The residuals of one channel in one part of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Residual {
    /// The channel.
    pub channel: String,
    /// Number of the recording's part.
    pub part: usize,
    /// Rows of the recording the values belong to.
    pub rows: Vec<usize>,
    /// (measured - simulated) / noise.
    pub values: Vec<f64>,
}

impl Residual {
    /// Sum of squares.
    #[must_use]
    pub fn sum_of_squares(&self) -> f64 {
        self.values.iter().map(|v| v * v).sum()
    }
}

/// The residuals of all weighted channels that `part` measures, in the order of `weights`.
pub(crate) fn residuals<S>(
    part: &Part<'_, S>,
    number: usize,
    simulated: &Trajectory,
    weights: &[ChannelWeight],
) -> Vec<Residual> {
    weights
        .iter()
        .filter_map(|weight| {
            let measured = part.recording.channel(&weight.channel)?;
            let simulated = simulated.iter().find(|s| s.channel == weight.channel)?;
            let (rows, values) = part
                .rows
                .clone()
                .filter_map(|row| Some((row, (measured.samples[row]? - simulated.samples[row]) / weight.noise)))
                .unzip();
            Some(Residual { channel: weight.channel.clone(), part: number, rows, values })
        })
        .collect()
}

/// Writes `measured - simulated` over noise into `out`, in the order of [`residuals`].
pub(crate) fn residuals_into<S>(part: &Part<'_, S>, simulated: &[Simulated], weights: &[ChannelWeight], out: &mut Vec<f64>) {
    for weight in weights {
        let Some(measured) = part.recording.channel(&weight.channel) else { continue };
        let Some(simulated) = simulated.iter().find(|s| s.channel == weight.channel) else { continue };
        let inverse = 1.0 / weight.noise;
        out.extend(part.rows.clone().filter_map(|row| Some((measured.samples[row]? - simulated.samples[row]) * inverse)));
    }
}
