//! Equations stepped over all lanes at once.

use super::program::Memory;
use super::stimulus::Measurements;
use super::system::Model;
use crate::robot::joint::{CREEP_RATE, CREEP_SHARE};
use crate::robot::mover::Push;
use crate::robot::runge_kutta::Contact;
use crate::robot::signal::Signal;
use crate::sim2real::Tick;

/// The room a step works in: states and slopes by state, then lane.
#[derive(Debug, Default)]
pub(super) struct Work {
    pub memory: Memory,
    lanes: usize,
    base: Vec<f64>,
    slope: Vec<f64>,
    sum: Vec<f64>,
    trial: Vec<f64>,
    /// How long the step of each lane is [s], and what of the tick is left to it [s].
    length: Vec<f64>,
    left: Vec<f64>,
    contact: Vec<Contact>,
    /// Whether mechanisms push any lane in this tick.
    pushed: bool,
}

/// What acts during a step.
pub(super) struct Acting<'a> {
    pub model: &'a Model,
    pub tick: Tick,
    pub inputs: &'a [Measurements],
    pub commands: &'a [Signal],
    pub effects: &'a [Push],
    /// Inertia of each lane; empty where nothing moves.
    pub inertia: &'a [f64],
}

/// The stages of the classical Runge-Kutta method: how far along the slope before, and the weight of the own.
///
/// Source: Hairer, Nørsett & Wanner, *Solving Ordinary Differential Equations I* (1993), II.1.
const STAGES: [(f64, f64); 4] = [(0.0, 1.0), (0.5, 2.0), (0.5, 2.0), (1.0, 1.0)];

/// How often a coordinate may stop within one step before it is held for the rest of it.
const STOPS: usize = 3;

impl Work {
    /// Room for `lanes` lanes, in which `memory` has the parameters.
    pub fn new(model: &Model, memory: Memory, lanes: usize) -> Self {
        let all = vec![0.0; model.system.states.len() * lanes];
        Self {
            memory,
            lanes,
            base: all.clone(),
            slope: all.clone(),
            sum: all.clone(),
            trial: all,
            length: vec![0.0; lanes],
            left: vec![0.0; lanes],
            contact: vec![Contact::Sliding(0.0); lanes],
            pushed: false,
        }
    }

    /// Advances `states` by one tick.
    pub fn advance(&mut self, acting: &Acting<'_>, states: &mut [Vec<f64>]) {
        for (i, state) in states.iter().enumerate() {
            state.iter().enumerate().for_each(|(k, value)| self.base[k * self.lanes + i] = *value);
        }
        let model = acting.model;
        self.pushed = acting.effects.iter().any(|push| *push != Push::default());
        for (i, command) in acting.commands.iter().enumerate() {
            self.memory.slot_mut(model.input_slot(0))[i] = command.0;
        }
        if model.system.discrete {
            self.next_row(acting);
        } else if acting.effects.iter().any(|push| push.dry_friction > 0.0) && model.moving.is_some() {
            self.step_with_friction(acting);
        } else {
            self.length.fill(acting.tick.step);
            self.left.fill(acting.tick.step);
            self.contact.fill(Contact::Sliding(0.0));
            self.step(acting);
            std::mem::swap(&mut self.base, &mut self.trial);
        }
        for (i, state) in states.iter_mut().enumerate() {
            state.iter_mut().enumerate().for_each(|(k, value)| *value = self.base[k * self.lanes + i]);
        }
    }

    /// The value of each state in the next row.
    fn next_row(&mut self, acting: &Acting<'_>) {
        self.length.fill(0.0);
        self.left.fill(acting.tick.step);
        self.evaluate(acting, 0.0);
        self.base.copy_from_slice(&self.slope);
    }

    /// One step of each lane's length from `base` to `trial`.
    fn step(&mut self, acting: &Acting<'_>) {
        for (stage, (share, weight)) in STAGES.into_iter().enumerate() {
            self.evaluate(acting, share);
            for (sum, slope) in self.sum.iter_mut().zip(&self.slope) {
                *sum = if stage == 0 { *slope } else { *sum + weight * slope };
            }
        }
        for (k, trial) in self.trial.chunks_exact_mut(self.lanes).enumerate() {
            let own = k * self.lanes..(k + 1) * self.lanes;
            let lanes = trial.iter_mut().zip(&self.base[own.clone()]).zip(&self.sum[own]).zip(&self.length);
            lanes.for_each(|(((trial, base), sum), length)| *trial = base + length / 6.0 * sum);
        }
    }

    /// The slopes `share` of the step along the slopes there are.
    fn evaluate(&mut self, acting: &Acting<'_>, share: f64) {
        let model = acting.model;
        for k in 0..model.system.states.len() {
            let own = k * self.lanes..(k + 1) * self.lanes;
            let slot = self.memory.slot_mut(model.state_slot(k));
            if share == 0.0 {
                slot.copy_from_slice(&self.base[own]);
            } else {
                let lanes = slot.iter_mut().zip(&self.base[own.clone()]).zip(&self.slope[own]).zip(&self.length);
                lanes.for_each(|(((slot, base), slope), length)| *slot = base + share * length * slope);
            }
        }
        let begun = |i: usize| acting.tick.time + (acting.tick.step - self.left[i]) + share * self.length[i];
        let time = self.memory.slot_mut(model.time_slot());
        time.iter_mut().enumerate().for_each(|(i, time)| *time = begun(i));
        for (i, measured) in acting.inputs.iter().enumerate().filter(|(_, measured)| !measured.is_empty()) {
            for k in 1..model.system.inputs.len() {
                self.memory.slot_mut(model.input_slot(k))[i] = measured.at(k - 1, begun(i));
            }
        }
        model.rates.run(&mut self.memory);
        for k in 0..model.system.states.len() {
            self.slope[k * self.lanes..][..self.lanes].copy_from_slice(model.rates.output(&self.memory, k));
        }
        self.push(acting);
    }

    /// Adds what mechanisms push with, lane by lane; a lane that nothing pushes keeps its bits.
    fn push(&mut self, acting: &Acting<'_>) {
        let Some(moving) = acting.model.moving.as_ref().filter(|_| self.pushed) else { return };
        for (i, push) in acting.effects.iter().enumerate() {
            if *push == Push::default() {
                continue;
            }
            let acceleration = &mut self.slope[moving.velocity * self.lanes + i];
            let friction = match self.contact[i] {
                Contact::Held => {
                    *acceleration = 0.0;
                    continue;
                }
                Contact::Sliding(friction) => friction,
            };
            let position = self.memory.slot(acting.model.state_slot(moving.position))[i];
            let velocity = self.memory.slot(acting.model.state_slot(moving.velocity))[i];
            let inertia = acting.inertia[i] + push.inertia;
            let mut effort =
                acting.inertia[i] * *acceleration + push.effort - push.stiffness * position - push.damping * velocity;
            if push.creeping_friction > 0.0 {
                let stopping = CREEP_SHARE * (inertia * CREEP_RATE * velocity + effort);
                effort -= stopping.max(-push.creeping_friction).min(push.creeping_friction);
            }
            *acceleration = (effort + friction) / inertia;
        }
    }

    /// A tick with dry friction, as [`step_with_friction`](crate::robot::runge_kutta::step_with_friction) has it for one
    /// lane: each slides until its velocity changes sign, and from rest moves only where what drives it exceeds the
    /// friction.
    fn step_with_friction(&mut self, acting: &Acting<'_>) {
        let Some(moving) = &acting.model.moving else { return };
        let velocity = moving.velocity * self.lanes;
        self.left.fill(acting.tick.step);
        for round in 0..=STOPS {
            self.touch(acting, velocity, round == STOPS);
            self.length.copy_from_slice(&self.left);
            self.step(acting);
            // Lanes that stop on the way go to where they do, and on from there in the next round.
            let mut stopping = false;
            for i in 0..self.lanes {
                if self.left[i] == 0.0 {
                    self.length[i] = 0.0;
                    continue;
                }
                self.length[i] = match self.contact[i] {
                    Contact::Sliding(friction) if friction != 0.0 && self.trial[velocity + i] * friction > 0.0 => {
                        let start = self.base[velocity + i];
                        stopping = true;
                        self.left[i] * start / (start - self.trial[velocity + i])
                    }
                    _ => {
                        self.accept(i);
                        self.left[i] = 0.0;
                        0.0
                    }
                };
            }
            if !stopping {
                return;
            }
            self.step(acting);
            for i in 0..self.lanes {
                if self.left[i] > 0.0 {
                    self.accept(i);
                    self.base[velocity + i] = 0.0;
                    self.left[i] -= self.length[i];
                }
            }
        }
    }

    /// How each lane's friction acts in the step that comes.
    fn touch(&mut self, acting: &Acting<'_>, velocity: usize, last: bool) {
        let resting = (0..self.lanes).any(|i| self.base[velocity + i] == 0.0 && acting.effects[i].dry_friction > 0.0);
        if resting {
            self.length.fill(0.0);
            self.contact.fill(Contact::Sliding(0.0));
            self.evaluate(acting, 0.0);
        }
        for (i, push) in acting.effects.iter().enumerate() {
            let speed = self.base[velocity + i];
            let driving =
                if speed == 0.0 && resting { self.slope[velocity + i] * (acting.inertia[i] + push.inertia) } else { speed };
            self.contact[i] = if push.dry_friction <= 0.0 {
                Contact::Sliding(0.0)
            } else if last || speed == 0.0 && driving.abs() <= push.dry_friction {
                Contact::Held
            } else {
                Contact::Sliding(-push.dry_friction * driving.signum())
            };
        }
    }

    /// Takes over lane `i` of the trial.
    fn accept(&mut self, i: usize) {
        for (base, trial) in self.base.chunks_exact_mut(self.lanes).zip(self.trial.chunks_exact(self.lanes)) {
            base[i] = trial[i];
        }
    }
}
