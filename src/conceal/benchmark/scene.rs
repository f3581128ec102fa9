//! How an arm moves without anything concealed: the yardstick of every effect.

use super::arm::Arm;
use super::motion::{Drive, Machine, Precision};
use crate::sim2real::Seed;

/// Typical sizes of a recording.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scales {
    /// Root mean square of the command.
    pub command: f64,
    /// Its largest value.
    pub loudest: f64,
    /// Root mean square of the motor's torque [N m].
    pub torque: f64,
    /// Root mean square of the position about its mean [rad].
    pub reach: f64,
    /// The farthest positions on either side [rad].
    pub farthest: (f64, f64),
    /// Root mean square of the velocity [rad/s].
    pub speed: f64,
    /// Length of the recording [s].
    pub duration: f64,
    /// The arm.
    pub arm: Arm,
}

impl Scales {
    /// Of `arm` under `drive`.
    pub fn of(arm: Arm, drive: &Drive) -> Self {
        let motion = Machine::new(arm, &[]).run(drive, Precision::Coarse, Seed(0));
        let rows = drive.commands.len();
        let positions: Vec<f64> = (0..rows).map(|row| motion.at(drive.time(row))).collect();
        let mean = positions.iter().sum::<f64>() / rows as f64;
        let square = |values: &mut dyn Iterator<Item = f64>| (values.map(|v| v * v).sum::<f64>() / rows as f64).sqrt();
        let command = square(&mut drive.commands.iter().copied());
        Self {
            command,
            loudest: drive.commands.iter().fold(0.0, |most: f64, u| most.max(u.abs())),
            torque: command * arm.gain,
            reach: square(&mut positions.iter().map(|q| q - mean)),
            farthest: positions.iter().fold((0.0, 0.0), |(low, high): (f64, f64), q| (low.min(*q), high.max(*q))),
            speed: square(&mut positions.windows(2).map(|w| (w[1] - w[0]) / drive.sample)),
            duration: rows as f64 * drive.sample,
            arm,
        }
    }
}
