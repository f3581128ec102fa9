//! An arm, what moves it, and chance: for recordings that tests make by integrators of their own.

use trueup::robot::{Axis, Commands, Joint, MECHANISMS};
use trueup::sim2real::{Assembly, Measured, Recording};

/// Inertia [kg m^2], viscous friction [N m s/rad] and torque of gravity [N m] of the arm.
pub const ARM: [f64; 3] = [0.096, 0.25, 2.35];
/// What rows are apart [s].
pub const SPACING: f64 = 4e-3;
/// How many there are.
const ROWS: u32 = 3_000;

/// A twin of the arm, whose values are somewhat off.
pub fn twin() -> Assembly<Joint> {
    Assembly::new(Joint::new(Axis::Rotary, [0.11, 0.22, 2.6, 1.0], [0.2, 0.2, 0.2, 0.0]), MECHANISMS)
}

/// Draws from -1 to 1, by a linear congruential generator.
pub struct Chance(u64);

impl Chance {
    pub fn draw(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        2.0 * ((self.0 >> 11) as f64 / (1_u64 << 53) as f64) - 1.0
    }
}

/// Commands by sines and steps, and what `read` says of each row, of the names and units of `channels`. It is given the command, and chance.
pub fn recorded<const N: usize>(
    name: &str,
    salt: u64,
    channels: [(&str, &str); N],
    mut read: impl FnMut(f64, &mut Chance) -> [f64; N],
) -> Recording<Commands> {
    let mut chance = Chance(salt);
    let waves: Vec<[f64; 3]> =
        (1..8).map(|k| [0.5, 0.3 * f64::from(k) + 0.1 * chance.draw(), 3.0 * chance.draw()]).collect();
    let mut measured =
        channels.map(|(channel, unit)| Measured { channel: channel.into(), unit: unit.into(), samples: Vec::new() });
    let (mut commands, mut held) = (Vec::new(), 0.0);
    let time: Vec<f64> = (0..ROWS).map(|row| SPACING * f64::from(row)).collect();
    for (row, t) in time.iter().enumerate() {
        held = if row % 250 == 0 { chance.draw() } else { held };
        let sines = waves.iter().map(|[height, rate, phase]| height * (6.0 * rate * t + phase).sin());
        let command = held + sines.sum::<f64>();
        commands.push(command);
        measured.iter_mut().zip(read(command, &mut chance)).for_each(|(channel, y)| channel.samples.push(Some(y)));
    }
    Recording { name: name.into(), time, stimulus: Commands(commands), measured: measured.into() }
}
