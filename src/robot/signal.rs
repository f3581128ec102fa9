//! What drives a plant that is sampled: a signal that holds its value until the next.

use crate::sim2real::mechanism::HeldLine;
use crate::sim2real::{Command, DelayLine, Plant, Stimulus, Tick};

/// A command that holds until the next, in the actuator's own unit.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Signal(pub f64);

impl AsMut<f64> for Signal {
    fn as_mut(&mut self) -> &mut f64 {
        &mut self.0
    }
}

impl Command for Signal {
    type Line = HeldLine;
}

impl DelayLine<Signal> for HeldLine {
    fn pass(&mut self, tick: Tick, seconds: f64, command: &mut Signal) {
        command.0 = self.mean(tick, seconds, command.0);
    }

    fn at_rest() -> Self {
        Self::at_zero()
    }
}

/// The commands of a recording, one a row.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Commands(pub Vec<f64>);

impl<P: Plant<Command = Signal, Input = ()>> Stimulus<P> for Commands {
    fn command(&self, row: usize) -> Signal {
        Signal(self.0[row])
    }

    fn input(&self, _row: usize, _arriving: &Signal) {}

    fn commands(&self) -> Option<&[f64]> {
        Some(&self.0)
    }

    fn commanded(&self, commands: Vec<f64>) -> Option<Self> {
        Some(Self(commands))
    }
}

impl AsRef<[f64]> for Commands {
    fn as_ref(&self) -> &[f64] {
        &self.0
    }
}
