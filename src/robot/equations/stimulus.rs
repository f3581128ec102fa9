//! What drives equations while a recording is followed.

use std::sync::Arc;

use super::Equations;
use crate::robot::signal::Signal;
use crate::sim2real::Stimulus;

/// The columns of a recording that drive equations.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Driving {
    commands: Vec<f64>,
    interpolated: bool,
    measured: Vec<Measurements>,
}

/// The inputs beside the command during one row: nothing, or of each the value where the row starts and its slope [its
/// unit/s], 0 for one that holds.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Measurements(Option<Arc<Row>>);

#[derive(Debug, PartialEq)]
struct Row {
    start: f64,
    inputs: Vec<(f64, f64)>,
}

impl Measurements {
    /// Whether there are no inputs but the command.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_none()
    }

    /// Input `k`, beside the command, where its row starts.
    pub(super) fn begun(&self, k: usize) -> f64 {
        self.0.as_ref().and_then(|row| row.inputs.get(k)).map_or(0.0, |(value, _)| *value)
    }

    /// Input `k`, beside the command, at `time` [s].
    pub(super) fn at(&self, k: usize, time: f64) -> f64 {
        self.0.as_ref().and_then(|row| Some((row.start, row.inputs.get(k)?))).map_or(0.0, |(start, (value, slope))| {
            // A slope of 0 changes no bit, however far the row reaches.
            if *slope == 0.0 { *value } else { value + slope * (time - start) }
        })
    }
}

impl Driving {
    /// Columns at `time` [s], the command first, each with whether it goes straight from row to row or holds.
    #[must_use]
    pub fn new(time: &[f64], columns: &[(Vec<f64>, bool)]) -> Self {
        let Some(((commands, interpolated), others)) = columns.split_first() else { return Self::default() };
        let row = |row: usize| {
            let input = |(values, interpolated): &(Vec<f64>, bool)| match time.get(row + 1) {
                Some(next) if *interpolated => (values[row], (values[row + 1] - values[row]) / (next - time[row])),
                _ => (values[row], 0.0),
            };
            Measurements(Some(Arc::new(Row { start: time[row], inputs: others.iter().map(input).collect() })))
        };
        let measured = if others.is_empty() { Vec::new() } else { (0..time.len()).map(row).collect() };
        Self { commands: commands.clone(), interpolated: *interpolated, measured }
    }
}

impl Driving {
    /// The inputs of the first row, the command first; nothing where there is no row.
    #[must_use]
    pub fn first_row(&self) -> Vec<f64> {
        let others = self.measured.first().and_then(|row| row.0.as_ref());
        let others = others.into_iter().flat_map(|row| row.inputs.iter().map(|(value, _)| *value));
        self.commands.first().copied().into_iter().chain(others).collect()
    }
}

impl AsRef<[f64]> for Driving {
    fn as_ref(&self) -> &[f64] {
        &self.commands
    }
}

impl Stimulus<Equations> for Driving {
    fn command(&self, row: usize) -> Signal {
        Signal(self.commands[row])
    }

    /// Of a command that goes straight from row to row, its mean over the tick.
    fn command_within(&self, row: usize, share: f64) -> Signal {
        let command = self.commands[row];
        match self.commands.get(row + 1) {
            Some(next) if self.interpolated => Signal(command + share * (next - command)),
            _ => Signal(command),
        }
    }

    fn input(&self, row: usize, _arriving: &Signal) -> Measurements {
        self.measured.get(row).cloned().unwrap_or_default()
    }

    fn commands(&self) -> Option<&[f64]> {
        Some(&self.commands)
    }

    /// Only where nothing else drives it: what an experiment would measure is not known.
    fn commanded(&self, commands: Vec<f64>) -> Option<Self> {
        self.measured.is_empty().then(|| Self { commands, ..self.clone() })
    }
}
