//! What can be concealed in the arm, in the generator's own words and forms.

/// One effect.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum ServoEffect {
    /// Dry friction by the LuGre model: bristles that bend, and slip at a level that falls with speed.
    ///
    /// Source: Canudas de Wit, Olsson, Åström, Lischinsky 1995, "A new model for control of systems with friction".
    BristleFriction {
        /// Level of sliding friction [N m].
        coulomb: f64,
        /// Level at which it breaks away [N m]; the same as `coulomb` for no Stribeck effect.
        breakaway: f64,
    },
    /// A bus that carries every command late, and not always equally late.
    BusDelay {
        /// Mean delay [s].
        delay: f64,
        /// Standard deviation of a command's delay [s].
        jitter: f64,
    },
    /// A driver that runs into its supply voltage softly: `limit * tanh(u / limit)`.
    SoftDriver {
        /// Largest output [units of command].
        limit: f64,
    },
    /// A driver that answers small commands hardly at all: `u - width * tanh(u / width)`.
    DeadBand {
        /// Half the width of the band [units of command].
        width: f64,
    },
    /// A driver with two equal poles.
    SlowDriver {
        /// Sum of their time constants [s].
        time: f64,
    },
    /// A spring that gets harder: `stiffness * q * (1 + hardening * q^2)`.
    HardeningSpring {
        /// Stiffness about zero [N m/rad].
        stiffness: f64,
        /// Relative hardening [1/rad^2].
        hardening: f64,
    },
    /// Drag of the air: `coefficient * |v|^1.9`, against the motion.
    ///
    /// Source: an exponent below 2 as the coefficient of drag falls slowly with Reynolds number (Hoerner 1965).
    AirDrag {
        /// Torque at 1 rad/s [N m].
        coefficient: f64,
    },
    /// A load that pulls to one side, by 3 % less or more along its way: `torque * (1 + 0.03 sin 2q)`.
    HangingLoad {
        /// Mean torque, against positive motion [N m].
        torque: f64,
    },
    /// A sensor mounted at an angle, settling by its last 3 % as it warms.
    SensorOffset {
        /// Offset once warm [rad].
        offset: f64,
    },
}

impl ServoEffect {
    /// One of each, at a size that a recording of the `servo` set shows clearly.
    pub const TYPICAL: [Self; 9] = [
        Self::BristleFriction { coulomb: 0.18, breakaway: 0.18 },
        Self::BusDelay { delay: 0.022, jitter: 0.0003 },
        Self::SoftDriver { limit: 1.3 },
        Self::DeadBand { width: 0.2 },
        Self::SlowDriver { time: 0.04 },
        Self::HardeningSpring { stiffness: 1.6, hardening: 0.15 },
        Self::AirDrag { coefficient: 0.08 },
        Self::HangingLoad { torque: 0.25 },
        Self::SensorOffset { offset: 0.05 },
    ];

    /// The registry's name for it: what a right diagnosis says.
    #[must_use]
    pub fn mechanism(&self) -> &'static str {
        match self {
            Self::BristleFriction { coulomb, breakaway } if breakaway > coulomb => "stribeck_friction",
            Self::BristleFriction { .. } => "coulomb_friction",
            Self::BusDelay { .. } => "command_delay",
            Self::SoftDriver { .. } => "saturation",
            Self::DeadBand { .. } => "dead_zone",
            Self::SlowDriver { .. } => "actuator_lag",
            Self::HardeningSpring { .. } => "stiffness",
            Self::AirDrag { .. } => "quadratic_drag",
            Self::HangingLoad { .. } => "constant_load",
            Self::SensorOffset { .. } => "bias",
        }
    }
}

/// A friction of bristles, all constants known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bristles {
    /// Level of sliding friction [N m].
    pub(super) coulomb: f64,
    /// Level of breaking away [N m].
    pub(super) breakaway: f64,
    /// Stiffness of the bristles [N m/rad].
    pub(super) stiffness: f64,
    /// Damping of the bristles at rest [N m s/rad].
    pub(super) damping: f64,
    /// Speed at which Stribeck's effect has faded [rad/s].
    pub(super) stribeck_velocity: f64,
}

/// All effects of an arm, put together once so that the integrator asks no list.
#[derive(Debug, Clone, Default)]
pub(super) struct Distortion {
    pub(super) bristles: Option<Bristles>,
    pub(super) delay: f64,
    pub(super) delay_jitter: f64,
    /// Rate of each of the driver's poles [1/s].
    pub(super) driver_pole: Option<f64>,
    limit: Option<f64>,
    band: Option<f64>,
    spring: (f64, f64),
    drag: f64,
    pull: f64,
    sensor: f64,
}

impl Distortion {
    /// Where an effect is given twice, the later one counts.
    pub(super) fn of(effects: &[ServoEffect]) -> Self {
        let mut all = Self::default();
        for effect in effects {
            match *effect {
                ServoEffect::BristleFriction { coulomb, breakaway } => all.bristles = Some(bristles(coulomb, breakaway)),
                ServoEffect::BusDelay { delay, jitter } => (all.delay, all.delay_jitter) = (delay, jitter),
                ServoEffect::SoftDriver { limit } => all.limit = Some(limit),
                ServoEffect::DeadBand { width } => all.band = Some(width),
                ServoEffect::SlowDriver { time } => all.driver_pole = Some(2.0 / time),
                ServoEffect::HardeningSpring { stiffness, hardening } => all.spring = (stiffness, hardening),
                ServoEffect::AirDrag { coefficient } => all.drag = coefficient,
                ServoEffect::HangingLoad { torque } => all.pull = torque,
                ServoEffect::SensorOffset { offset } => all.sensor = offset,
            }
        }
        all
    }

    /// What the driver makes of a command, before its poles [units of command].
    pub(super) fn driven(&self, command: f64) -> f64 {
        let beyond = self.band.map_or(command, |width| command - width * (command / width).tanh());
        self.limit.map_or(beyond, |limit| limit * (beyond / limit).tanh())
    }

    /// Torque of spring, drag and load together, against positive motion [N m].
    pub(super) fn load(&self, position: f64, velocity: f64) -> f64 {
        let (stiffness, hardening) = self.spring;
        let mut torque = self.pull * (1.0 + 0.03 * (2.0 * position).sin());
        torque += stiffness * position * (1.0 + hardening * position * position);
        if self.drag != 0.0 {
            torque += self.drag * velocity.abs().powf(1.9).copysign(velocity);
        }
        torque
    }

    /// What the sensor adds at a time [s] since it was switched on [rad].
    pub(super) fn offset(&self, time: f64) -> f64 {
        self.sensor * (1.0 - 0.03 * (-time / 10.0).exp())
    }
}

/// Bristles that bend by 0.2 mrad before they slip at 0.18 N m, below what the sensor can see.
fn bristles(coulomb: f64, breakaway: f64) -> Bristles {
    Bristles { coulomb, breakaway, stiffness: 900.0, damping: 6.0, stribeck_velocity: 0.05 }
}
