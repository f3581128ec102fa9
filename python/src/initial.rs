//! What is read off a recording: the state a run starts from, and the steps in which a sensor counts.

use std::sync::Arc;

use trueup::sim2real::{Measured, Parameter, Recording};

/// Rows on either side of one by which a state is estimated there.
const AROUND: usize = 5;

/// What drives a simulator of Python: its inputs, one value a row each.
#[derive(Clone, PartialEq, Debug)]
pub struct Inputs(pub Arc<Vec<Vec<f64>>>);

/// A parameter of the state a run starts from: what it is estimated by, and how far that may be off.
#[derive(Clone)]
pub struct Initial {
    pub name: String,
    pub unit: String,
    pub value: f64,
    /// The channel it is read off, or the derivative of which it is.
    pub channel: Option<String>,
    pub derivative: bool,
    pub std: Option<f64>,
}

impl Initial {
    /// The parameter it is where a run starts from `row`.
    pub fn at(&self, recording: &Recording<Inputs>, row: usize) -> Parameter {
        let measured = self.channel.as_ref().and_then(|channel| recording.channel(channel));
        let seen = measured.and_then(|measured| around(recording, measured, row));
        let value = seen.map_or(self.value, |(value, slope)| if self.derivative { slope } else { value });
        let parameter = Parameter::named(self.name.clone(), self.unit.clone(), value);
        // Where nobody says how far it may be off, three tenths of how the channel spreads.
        let typical = measured.map(|measured| (0.3 * spread(recording, measured, self.derivative)).max(1e-9));
        match self.std.or(typical) {
            Some(std) => parameter.known_to(std),
            None => parameter,
        }
    }
}

/// Value and slope at `row` of a line through the samples around it.
pub fn around(recording: &Recording<Inputs>, measured: &Measured, row: usize) -> Option<(f64, f64)> {
    let rows = row.saturating_sub(AROUND)..(row + AROUND + 1).min(recording.len());
    let at = recording.time.get(row)?;
    let points: Vec<(f64, f64)> = rows.filter_map(|k| Some((recording.time[k] - at, measured.samples[k]?))).collect();
    let count = points.len() as f64;
    let (t, y) = points.iter().fold((0.0, 0.0), |(t, y), point| (t + point.0 / count, y + point.1 / count));
    let (tt, ty) = points.iter().fold((0.0, 0.0), |(tt, ty), p| (tt + (p.0 - t) * (p.0 - t), ty + (p.0 - t) * (p.1 - y)));
    let slope = if tt > 0.0 { ty / tt } else { 0.0 };
    (!points.is_empty()).then_some((y - slope * t, slope))
}

/// Root mean square of the values of a channel about their mean, or of its slope from sample to sample.
fn spread(recording: &Recording<Inputs>, measured: &Measured, derivative: bool) -> f64 {
    let present: Vec<(f64, f64)> =
        recording.time.iter().zip(&measured.samples).filter_map(|(t, y)| Some((*t, (*y)?))).collect();
    let values: Vec<f64> = match derivative {
        false => present.iter().map(|point| point.1).collect(),
        true => present.windows(2).map(|w| (w[1].1 - w[0].1) / (w[1].0 - w[0].0)).collect(),
    };
    let count = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / count;
    (values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / count).sqrt()
}

/// Standard deviation of the rounding of a sensor that counts in steps: `step / sqrt(12)` (Widrow and Kollár, *Quantization Noise*
/// (2008), section 5.4), where nine in ten changes of the signal are whole multiples of the smallest; 0 elsewhere.
pub fn rounding(measured: &Measured) -> f64 {
    let changes: Vec<f64> = measured.samples.windows(2).filter_map(|w| Some((w[1]? - w[0]?).abs())).collect();
    let largest = changes.iter().copied().fold(0.0, f64::max);
    let changes: Vec<f64> = changes.into_iter().filter(|change| *change > 1e-9 * largest).collect();
    let step = changes.iter().copied().fold(f64::INFINITY, f64::min);
    let whole = changes.iter().filter(|change| ((**change / step) - (**change / step).round()).abs() < 1e-3).count();
    if !changes.is_empty() && 10 * whole >= 9 * changes.len() { step / 12.0_f64.sqrt() } else { 0.0 }
}
