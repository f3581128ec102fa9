//! What acts on an arm beside its motor, its viscous friction and its weight.

use std::f64::consts::TAU;

use super::effect::{Effect, Foreign};

/// Time within which a mass is put on [s].
pub(super) const PUT_ON: f64 = 0.15;

/// All effects inside the plant.
#[derive(Debug, Clone, Default)]
pub(super) struct Load {
    bristles: Option<Bristles>,
    yielding: Option<(f64, f64)>,
    pub coupling: Option<Coupling>,
    pub pad: Option<Pad>,
    mass: Option<(f64, f64, f64)>,
    drag: f64,
    pull: (f64, f64),
    spring: (f64, f64),
    stiffening: (f64, f64),
    magnets: Option<[f64; 4]>,
    foreign: Option<Foreign>,
}

/// Dry friction of the LuGre model.
#[derive(Debug, Clone, Copy)]
struct Bristles {
    sliding: f64,
    breakaway: f64,
    fading: f64,
    load: f64,
    bend: f64,
}

/// A motor and a link, coupled.
#[derive(Debug, Clone, Copy)]
pub(super) struct Coupling {
    pub motor_share: f64,
    stiffness: f64,
    hardening: f64,
    damping: f64,
    gap: f64,
}

/// An end stop with a pad.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pad {
    position: f64,
    side: f64,
    stiffness: f64,
    damping: f64,
}

/// Where the arm is, what drives it, and when.
#[derive(Debug, Clone, Copy)]
pub(super) struct Instant {
    pub position: f64,
    pub velocity: f64,
    /// Velocity where friction acts: the motor's, where motor and link move apart.
    pub rubbing: f64,
    pub motor: f64,
    pub weight: f64,
    pub time: f64,
}

/// What a load remembers: bristles, three yielding elements, a relaxing spring.
pub(super) type Memory = [f64; 5];

/// What acts against positive motion: where friction acts, and at the link.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Against {
    pub friction: f64,
    pub link: f64,
}

/// Where yielding elements yield, as parts of the reach.
const YIELDS: [f64; 3] = [0.25, 0.8, 2.0];

impl Load {
    pub fn of(effects: &[Effect]) -> Self {
        let mut all = Self::default();
        for effect in effects {
            match *effect {
                Effect::Bristles { sliding, breakaway, fading, load, bend } => {
                    all.bristles = Some(Bristles { sliding, breakaway, fading, load, bend });
                }
                Effect::Drag { coefficient } => all.drag = coefficient,
                Effect::Pull { torque, reach } => all.pull = (torque, reach),
                Effect::Spring { rate, reach } => all.spring = (rate, reach),
                Effect::StiffeningSpring { rate, reach } => all.stiffening = (rate, reach),
                Effect::Magnets { torque, count, phase, harmonic } => all.magnets = Some([torque, count, phase, harmonic]),
                Effect::Load { time, inertia, gravity } => all.mass = Some((time, inertia, gravity)),
                Effect::Pad { position, side, stiffness, damping } => {
                    all.pad = Some(Pad { position, side, stiffness, damping });
                }
                Effect::Coupling { motor_share, stiffness, hardening, damping, gap } => {
                    all.coupling = Some(Coupling { motor_share, stiffness, hardening, damping, gap });
                }
                Effect::Yielding { torque, reach } => all.yielding = Some((torque, reach)),
                Effect::Foreign(foreign) => all.foreign = Some(foreign),
                _ => {}
            }
        }
        all
    }

    /// Further inertia and gravity torque at a time.
    pub fn mass(&self, time: f64) -> (f64, f64) {
        self.mass.map_or((0.0, 0.0), |(since, inertia, gravity)| {
            let x = ((time - since) / PUT_ON).clamp(0.0, 1.0);
            let part = x * x * (3.0 - 2.0 * x);
            (part * inertia, part * gravity)
        })
    }

    /// By what inertia is multiplied at a position, and the slope of that.
    pub fn inertia_factor(&self, position: f64) -> (f64, f64) {
        match self.foreign {
            Some(Foreign::MovingInertia { share, phase }) => {
                let (sine, cosine) = (2.0 * position + phase).sin_cos();
                (1.0 + share * cosine, -2.0 * share * sine)
            }
            _ => (1.0, 0.0),
        }
    }

    /// By what gravity is multiplied at a time.
    pub fn gravity_factor(&self, time: f64) -> f64 {
        match self.foreign {
            Some(Foreign::ShakenBase { share, frequency }) => 1.0 + share * (TAU * frequency * time).sin(),
            _ => 1.0,
        }
    }

    /// Torques against positive motion [N m], and how fast the memory moves.
    pub fn act(&self, now: &Instant, memory: &Memory) -> (Against, Memory) {
        let mut rates = [0.0; 5];
        let mut against = Against { friction: 0.0, link: self.springs(now.position) - self.pull(now.position) };
        if self.drag != 0.0 {
            against.link += self.drag * now.velocity.abs().powf(1.9).copysign(now.velocity);
        }
        if let Some(bristles) = &self.bristles {
            let (torque, rate) = bristles.act(now, memory[0]);
            against.friction += torque;
            rates[0] = rate;
        }
        if let Some((torque, reach)) = self.yielding {
            for (k, part) in YIELDS.iter().enumerate() {
                let most = part * reach;
                rates[1 + k] = now.rubbing - now.rubbing.abs() * memory[1 + k] / most;
                against.friction += torque / 3.0 * memory[1 + k] / most;
            }
        }
        if let Some(pad) = &self.pad {
            against.link += pad.push(now.position, now.velocity);
        }
        if let Some(foreign) = self.foreign {
            let (torque, rate) = strange(foreign, now, memory[4]);
            against.link += torque;
            rates[4] = rate;
        }
        (against, rates)
    }

    fn springs(&self, position: f64) -> f64 {
        let mut torque = 0.0;
        let (rate, reach) = self.spring;
        if rate != 0.0 {
            torque += rate * position * (1.0 + 0.1 * (position / reach).powi(2));
        }
        let (rate, reach) = self.stiffening;
        if rate != 0.0 {
            torque += rate * position.powi(3) * (1.0 + 0.2 * (position / reach).powi(2));
        }
        if let Some([size, count, phase, harmonic]) = self.magnets {
            let angle = count * position;
            torque += size * ((angle + phase).sin() + harmonic * (2.0 * angle + 1.0).sin());
        }
        torque
    }

    fn pull(&self, position: f64) -> f64 {
        let (torque, reach) = self.pull;
        if torque == 0.0 { 0.0 } else { torque * (1.0 + 0.03 * (2.0 * position / reach).sin()) }
    }

    /// Whether it has a state: bristles, what yields, or what no registry has.
    pub fn remembers(&self) -> bool {
        self.bristles.is_some() || self.yielding.is_some() || self.foreign.is_some()
    }

    /// The fastest rate [1/s] at which anything here moves, for an arm of `inertia` at `velocity`.
    pub fn fastest(&self, inertia: f64, position: f64, velocity: f64, rubbing: f64) -> f64 {
        let mut rate = 0.0_f64;
        if let Some(bristles) = &self.bristles {
            let level = bristles.sliding.max(bristles.breakaway);
            rate = rate.max(rubbing.abs() / bristles.bend).max((level / (bristles.bend * inertia)).sqrt());
        }
        if let Some((_, reach)) = self.yielding {
            rate = rate.max(rubbing.abs() / (YIELDS[0] * reach));
        }
        if let Some(coupling) = &self.coupling {
            let reduced = inertia * coupling.motor_share * (1.0 - coupling.motor_share);
            rate = rate.max((coupling.stiffness / reduced).sqrt()).max(coupling.damping / reduced);
        }
        if let Some(pad) = &self.pad {
            rate = rate.max(pad.fastest(inertia, position, velocity));
        }
        rate
    }
}

impl Bristles {
    /// Torque of friction [N m], and rate of the bristles' deflection.
    fn act(&self, now: &Instant, deflection: f64) -> (f64, f64) {
        let faded = (-(now.rubbing / self.fading).powi(2)).exp();
        let transmitted = if self.load > 0.0 {
            // What a gear carries when its motor holds a weight, both sides counted (Duclusaud et al. 2024, M3).
            let torque = now.motor + now.weight;
            (torque * torque + 0.0025 * now.motor * now.motor + 1e-12).sqrt()
        } else {
            0.0
        };
        let level = self.sliding + (self.breakaway - self.sliding) * faded + self.load * transmitted;
        // Bristles bend equally far at every level: their stiffness grows with the load they carry.
        let rate = now.rubbing - now.rubbing.abs() * deflection / self.bend;
        (level * (deflection + 0.002 * faded * rate) / self.bend, rate)
    }
}

impl Coupling {
    /// Torque from the motor to the link [N m].
    pub fn torque(&self, twist: f64, rate: f64) -> f64 {
        let half = 0.5 * self.gap;
        let bent = if twist > half {
            twist - half
        } else if twist < -half {
            twist + half
        } else {
            return 0.0;
        };
        self.stiffness * bent * (1.0 + self.hardening * bent * bent) + self.damping * rate
    }
}

impl Pad {
    fn push(&self, position: f64, velocity: f64) -> f64 {
        let depth = self.side * (position - self.position);
        if depth <= 0.0 {
            return 0.0;
        }
        let rate = self.side * velocity;
        self.side * (self.stiffness * depth * depth.sqrt() * (1.0 + self.damping * rate)).max(0.0)
    }

    /// Whether an arm at `position` is in touch with it.
    pub fn touches(&self, position: f64) -> bool {
        self.side * (position - self.position) > 0.0
    }

    fn fastest(&self, inertia: f64, position: f64, velocity: f64) -> f64 {
        // What may be touched within a millisecond counts as touched.
        let depth = self.side * (position + 1e-3 * velocity - self.position);
        if depth > 0.0 {
            (1.5 * self.stiffness * depth.sqrt() / inertia).sqrt() * (1.0 + self.damping * velocity.abs())
        } else {
            0.0
        }
    }
}

/// Torque of what no registry has, against positive motion, and rate of what it remembers.
fn strange(foreign: Foreign, now: &Instant, memory: f64) -> (f64, f64) {
    match foreign {
        Foreign::Shaking { torque, frequency, phase } => (torque * (TAU * frequency * now.time + phase).sin(), 0.0),
        Foreign::OneWay { friction, side } => (friction * side * (side * now.velocity).max(0.0), 0.0),
        Foreign::WarmingOil { friction, time } => (friction * (-now.time / time).exp() * now.velocity, 0.0),
        Foreign::Brake { torque, peak } => {
            let x = now.velocity / peak;
            (2.0 * torque * x / (1.0 + x * x), 0.0)
        }
        Foreign::Memory { rate, time } => (rate * memory, now.velocity - memory / time),
        Foreign::BentShaft { friction, phase } => (friction * (1.0 + (now.position + phase).cos()) * now.velocity, 0.0),
        Foreign::MovingInertia { .. } | Foreign::Sagging { .. } | Foreign::Clock { .. } | Foreign::ShakenBase { .. } => {
            (0.0, 0.0)
        }
    }
}
