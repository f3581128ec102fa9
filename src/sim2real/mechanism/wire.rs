//! A plant that does nothing: what laws do to signals is seen on it alone. For tests.

use crate::sim2real::mechanism::HeldLine;
use crate::sim2real::{
    Channel, Clock, Command, DelayLine, Dynamics, Mechanism, Observation, Parameter, Plant, Recording, Seed, Stimulus,
    Thetas, Tick, Typical,
};

/// Two channels, a signal and its rate of change.
#[derive(Clone)]
pub(in crate::sim2real) struct Wire;

/// A command that holds until the next.
#[derive(Clone, Copy, PartialEq)]
pub(in crate::sim2real) struct Level(f64);

impl AsMut<f64> for Level {
    fn as_mut(&mut self) -> &mut f64 {
        &mut self.0
    }
}

impl Command for Level {
    type Line = HeldLine;
}

impl DelayLine<Level> for HeldLine {
    fn pass(&mut self, tick: Tick, seconds: f64, command: &mut Level) {
        command.0 = self.mean(tick, seconds, command.0);
    }

    fn at_rest() -> Self {
        Self::at_zero()
    }
}

impl Observation for [f64; 2] {
    fn channel(&self, k: usize) -> f64 {
        self[k]
    }
}

impl Stimulus<Wire> for () {
    fn command(&self, _: usize) -> Level {
        Level(0.0)
    }

    fn input(&self, _: usize, _: &Level) {}
}

impl Dynamics<Wire> for () {
    fn initial(&self, _: &Thetas) -> Vec<()> {
        Vec::new()
    }

    fn advance(&self, _: Tick, _: &mut [()], _: &[()], _: &[Level], _: &[()]) {}

    fn observe(&self, _: &[()], seen: &mut [[f64; 2]]) {
        seen.fill([0.0; 2]);
    }
}

impl Plant for Wire {
    type Command = Level;
    type Input = ();
    type State = ();
    type Effect = ();
    type Observation = [f64; 2];
    type Dynamics = ();
    type Stimulus = ();

    fn name(&self) -> &'static str {
        "wire"
    }

    fn clock(&self) -> Clock {
        Clock::Sampled { longest_step: 1e-3 }
    }

    fn channels(&self) -> &[Channel] {
        static CHANNELS: &[Channel] = &[Channel::new("signal", "rad"), Channel::new("rate", "rad/s")];
        CHANNELS
    }

    fn parameters(&self) -> Vec<Parameter> {
        Vec::new()
    }

    fn typical(&self, _: &[Recording<()>]) -> Typical {
        Typical::default()
    }

    fn initial_parameters(&self, _: &Recording<()>, _: usize) -> Vec<Parameter> {
        Vec::new()
    }

    fn dynamics(&self, _: &Thetas) {}
}

/// What form `form` of `mechanism`, in each lane with the values given, makes of commands of `step` [s] each: one row a lane.
pub(super) fn shaped(
    mechanism: &dyn Mechanism<Wire>,
    form: usize,
    lanes: &[&[f64]],
    step: f64,
    commands: &[f64],
) -> Vec<Vec<f64>> {
    let mut law = mechanism.law(form, &Thetas::from_lanes(lanes), Seed(1));
    let mut out = vec![Vec::new(); lanes.len()];
    for (index, command) in commands.iter().enumerate() {
        let mut row = vec![Level(*command); lanes.len()];
        law.shape(Tick { index, time: index as f64 * step, step }, &mut row);
        out.iter_mut().zip(row).for_each(|(lane, level)| lane.push(level.0));
    }
    out
}

/// What form `form` of `mechanism`, in each lane with the values given, makes of rows of (time [s], signal and rate): one row a
/// lane.
pub(super) fn sensed(
    mechanism: &dyn Mechanism<Wire>,
    form: usize,
    lanes: &[&[f64]],
    seed: u64,
    rows: &[(f64, [f64; 2])],
) -> Vec<Vec<[f64; 2]>> {
    let mut law = mechanism.law(form, &Thetas::from_lanes(lanes), Seed(seed));
    let mut out = vec![Vec::new(); lanes.len()];
    for (time, observation) in rows {
        let mut row = vec![*observation; lanes.len()];
        law.sense(*time, &mut row);
        out.iter_mut().zip(row).for_each(|(lane, seen)| lane.push(seen));
    }
    out
}

/// `count` rows every `step` [s] of `signal`, with the rate 0.
pub(super) fn rows(count: usize, step: f64, signal: impl Fn(f64) -> f64) -> Vec<(f64, [f64; 2])> {
    (0..count).map(|i| i as f64 * step).map(|time| (time, [signal(time), 0.0])).collect()
}
