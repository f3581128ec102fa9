//! What can be concealed, in the generator's own words and forms, all constants known.

/// Something that acts in an arm, its driver or its sensor, and that its twin leaves out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Effect {
    /// Bristles that bend and slip (LuGre; Canudas de Wit, Olsson, Åström, Lischinsky 1995): dry friction that levels off at
    /// `sliding` [N m] from `breakaway` [N m] within `fading` [rad/s], and grows by `load` of the torque transmitted.
    Bristles { sliding: f64, breakaway: f64, fading: f64, load: f64, bend: f64 },
    /// `coefficient |v|^1.9`.
    Drag { coefficient: f64 },
    /// A pull to one side along positive motion [N m], by 3 % less or more along the way.
    Pull { torque: f64, reach: f64 },
    /// A spring that hardens by a tenth at `reach`.
    Spring { rate: f64, reach: f64 },
    /// `rate (q^3 + q^5 / (5 reach^2))`.
    StiffeningSpring { rate: f64, reach: f64 },
    /// Magnets that pull to `count` places a turn (or per m), with a harmonic.
    Magnets { torque: f64, count: f64, phase: f64, harmonic: f64 },
    /// A mass put on within 0.15 s from `time` [s]: inertia and gravity grow by these.
    Load { time: f64, inertia: f64, gravity: f64 },
    /// A pad that is met at `position` on one side: `k d^1.5 (1 + c d')` (Hunt & Crossley 1975).
    Pad { position: f64, side: f64, stiffness: f64, damping: f64 },
    /// A motor and a link with a spring between them that hardens, or with a gap.
    Coupling { motor_share: f64, stiffness: f64, hardening: f64, damping: f64, gap: f64 },
    /// Elements that yield one after the other (Iwan 1966), each by Dahl's law (1968).
    Yielding { torque: f64, reach: f64 },
    /// Two poles of the driver [s].
    Poles { first: f64, second: f64 },
    /// `u - width tanh(u / width)`.
    Band { width: f64 },
    /// `limit tanh(u / limit)`.
    Ceiling { limit: f64 },
    /// `x' = rate tanh((u - x) / (rate 3 ms))`.
    Slew { rate: f64 },
    /// A winding and its housing that heat with the square of the command, relative to `usual`, and weaken the motor.
    Heat { weakening: f64, usual: f64, winding: f64, housing: f64 },
    /// A bus that carries every command late, and not always equally late [s].
    Bus { delay: f64, jitter: f64 },
    /// A sensor mounted at an angle, settling by its last 3 %.
    Offset { offset: f64 },
    /// A sensor that creeps to `size`, with a time constant [s], or as the square root of time where there is none.
    Creep { size: f64, settling: Option<f64> },
    /// A sensor that reads `excess` too much, and a little more far out.
    Stretch { excess: f64, reach: f64 },
    /// A sensor that counts in steps, with a hysteresis of a tenth of one.
    Counts { step: f64 },
    /// A sensor that loses a part of the sign: `(1 - share) q + share sqrt(q^2 + rounding^2)`.
    Fold { share: f64, rounding: f64 },
    /// A disc off its centre: `size (sin(q + phase) + harmonic sin(2q))`.
    Wobble { size: f64, phase: f64, harmonic: f64 },
    /// A sensor that repeats its last value in bursts: stretches of time [s].
    Bursts { share: f64 },
    /// A sensor that reports late [s].
    Late { delay: f64 },
    /// What no registry has.
    Foreign(Foreign),
}

/// What no registry has, so that the right answer is that something unknown is missing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Foreign {
    /// Inertia that depends on where the arm is: `1 + share cos(2q + phase)`, with the torque that goes with it.
    MovingInertia { share: f64, phase: f64 },
    /// A torque from outside, periodic in time.
    Shaking { torque: f64, frequency: f64, phase: f64 },
    /// Viscous friction in one direction only.
    OneWay { friction: f64, side: f64 },
    /// Further viscous friction that fades as the oil warms.
    WarmingOil { friction: f64, time: f64 },
    /// An eddy-current brake: `2 torque x / (1 + x^2)` with `x = v / peak`.
    Brake { torque: f64, peak: f64 },
    /// A supply that sags and recovers, whatever is commanded.
    Sagging { depth: f64, period: f64 },
    /// A spring and a damper in series beside the arm: it remembers its motion for a while.
    Memory { rate: f64, time: f64 },
    /// A clock that runs now fast, now slow, by `size` [s].
    Clock { size: f64, period: f64 },
    /// A base that shakes up and down: gravity varies.
    ShakenBase { share: f64, frequency: f64 },
    /// A bent shaft: viscous friction that depends on where the arm is.
    BentShaft { friction: f64, phase: f64 },
}

impl Effect {
    /// Whether it acts on what is seen of an arm alone, and not on its motion.
    pub fn is_of_sensor(&self) -> bool {
        matches!(
            self,
            Self::Offset { .. }
                | Self::Creep { .. }
                | Self::Stretch { .. }
                | Self::Counts { .. }
                | Self::Fold { .. }
                | Self::Wobble { .. }
                | Self::Bursts { .. }
                | Self::Late { .. }
                | Self::Foreign(Foreign::Clock { .. })
        )
    }
}
