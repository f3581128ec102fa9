//! What the plots of a diagnosis are drawn from.

use crate::sim2real::diagnose::{Excitation, Profile};

/// The series behind the plots of a diagnosis.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DiagnosisFigures {
    /// One entry for each recording, channel and part (fitted or held out), in the order in which to show them.
    pub traces: Vec<Trace>,
    /// Errors over states, in the order in which to show them.
    pub profiles: Vec<Profile>,
    /// The commands of the next experiment, where one was designed.
    pub excitation: Option<Excitation>,
}

/// One channel of one recording: what was measured, and what the three twins say. All series have one entry a row.
#[derive(Debug, Clone, PartialEq)]
pub struct Trace {
    /// Name of the recording.
    pub recording: String,
    /// Whether no fit has seen these rows.
    pub held_out: bool,
    /// Channel.
    pub channel: String,
    /// Unit of all series.
    pub unit: String,
    /// What the rows are.
    pub abscissa: Abscissa,
    /// Time of each row [s].
    pub time: Vec<f64>,
    /// What was measured; none where the sample was lost.
    pub measured: Vec<Option<f64>>,
    /// The twin as given.
    pub nominal: Vec<f64>,
    /// The twin with its own parameters refitted.
    pub recalibrated: Vec<f64>,
    /// The twin with what was found added.
    pub trued: Vec<f64>,
}

/// What the rows of a trace are, and so what they are plotted over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Abscissa {
    /// Samples of a trajectory, plotted over time [s].
    Time,
    /// Orders (messages of an event clock), plotted one by one.
    Order,
}

impl Trace {
    /// `recording, channel`, as captions have it.
    pub(super) fn caption(&self) -> String {
        format!("{}: {}", self.recording, self.channel)
    }

    /// Measured less `predicted`, row by row.
    pub(super) fn residual(&self, predicted: &[f64]) -> Vec<Option<f64>> {
        self.measured.iter().zip(predicted).map(|(m, p)| m.map(|m| m - p).filter(|r| r.is_finite())).collect()
    }

    /// Root mean square of measured less `predicted`, over the rows measured; none where there are none.
    pub(super) fn rmse(&self, predicted: &[f64]) -> Option<f64> {
        let squares: Vec<f64> = self.residual(predicted).into_iter().flatten().map(|r| r * r).collect();
        (!squares.is_empty()).then(|| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
    }

    /// Smallest and largest measured value.
    pub(super) fn span(&self) -> Option<(f64, f64)> {
        let mut values = self.measured.iter().flatten().copied().filter(|v| v.is_finite());
        let first = values.next()?;
        Some(values.fold((first, first), |(l, h), v| (l.min(v), h.max(v))))
    }
}
