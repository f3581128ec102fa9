//! What becomes of a command before it is a torque.

use super::effect::{Effect, Foreign};

/// Time in which a slewing driver answers small changes [s].
const ANSWER: f64 = 0.003;

/// All effects between a command and the torque it makes.
#[derive(Debug, Clone, Default)]
pub(super) struct Driver {
    band: Option<f64>,
    ceiling: Option<f64>,
    slew: Option<f64>,
    poles: Option<(f64, f64)>,
    heat: Option<Heat>,
    sagging: Option<(f64, f64)>,
    /// Mean lateness of commands and its standard deviation [s].
    pub bus: (f64, f64),
}

#[derive(Debug, Clone, Copy)]
struct Heat {
    weakening: f64,
    usual: f64,
    winding: f64,
    housing: f64,
}

/// What a driver remembers: slewed output, two poles, two temperatures.
pub(super) type Memory = [f64; 5];

impl Driver {
    pub fn of(effects: &[Effect]) -> Self {
        let mut all = Self::default();
        for effect in effects {
            match *effect {
                Effect::Band { width } => all.band = Some(width),
                Effect::Ceiling { limit } => all.ceiling = Some(limit),
                Effect::Slew { rate } => all.slew = Some(rate),
                Effect::Poles { first, second } => all.poles = Some((first, second)),
                Effect::Heat { weakening, usual, winding, housing } => {
                    all.heat = Some(Heat { weakening, usual, winding, housing });
                }
                Effect::Bus { delay, jitter } => all.bus = (delay, jitter),
                Effect::Foreign(Foreign::Sagging { depth, period }) => all.sagging = Some((depth, period)),
                _ => {}
            }
        }
        all
    }

    /// What it gives [units of command], and how fast its memory moves.
    pub fn act(&self, memory: &Memory, command: f64, time: f64) -> (f64, Memory) {
        let mut rates = [0.0; 5];
        let mut output = self.band.map_or(command, |width| command - width * (command / width).tanh());
        output = self.ceiling.map_or(output, |limit| limit * (output / limit).tanh());
        if let Some(rate) = self.slew {
            rates[0] = rate * ((output - memory[0]) / (rate * ANSWER)).tanh();
            output = memory[0];
        }
        if let Some((first, second)) = self.poles {
            rates[1] = (output - memory[1]) / first;
            rates[2] = (memory[1] - memory[2]) / second;
            output = memory[2];
        }
        if let Some(heat) = &self.heat {
            let power = (output / heat.usual).powi(2);
            rates[3] = (power - (memory[3] - memory[4])) / heat.winding;
            rates[4] = (0.5 * (memory[3] - memory[4]) - memory[4]) / heat.housing;
            output /= 1.0 + heat.weakening * memory[3];
        }
        if let Some((depth, period)) = self.sagging {
            output *= 1.0 - depth * 0.5 * (1.0 - (std::f64::consts::TAU * time / period).cos());
        }
        (output, rates)
    }

    /// The fastest rate at which its memory settles [1/s].
    pub fn fastest(&self) -> f64 {
        let pole = self.poles.map_or(0.0, |(first, second)| 1.0 / first.min(second));
        pole.max(if self.slew.is_some() { 1.0 / ANSWER } else { 0.0 })
    }

    /// Whether it has a state: slewed, behind poles, or warm.
    pub fn remembers(&self) -> bool {
        self.slew.is_some() || self.poles.is_some() || self.heat.is_some()
    }

    /// Whether a command is bent by a tenth or more of itself.
    pub fn bends(&self, command: f64) -> bool {
        self.ceiling.is_some_and(|limit| limit * (command / limit).tanh().abs() < 0.9 * command.abs())
    }

    /// Whether there is a limit that commands may meet.
    pub fn has_ceiling(&self) -> bool {
        self.ceiling.is_some()
    }
}
