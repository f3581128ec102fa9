//! An arm refitted in earnest: what a small change of it does tells little of what a larger one would, where gravity does not change in
//! proportion.

use std::f64::consts::PI;

use nalgebra::{DMatrix, DVector};

use super::arm::Arm;
use super::effect::Effect;
use super::motion::{Drive, Machine, Precision};
use super::size::Hideable;
use crate::sim2real::Seed;

/// Inertia, viscous friction, gravity, where it starts and how fast.
const FREE: usize = 5;
const UNCHANGED: [f64; FREE] = [0.0; FREE];
/// Step of the finite differences, as a part of what is varied.
const DIFFERENCE: f64 = 1e-5;
/// Steps of a fit, and how often each is halved until it comes nearer.
const STEPS: usize = 12;
const HALVINGS: usize = 7;
/// A step that comes nearer by less than this part is the last.
const LITTLE: f64 = 0.02;

/// An arm that leaves less than this part of what small changes of it leave hides an effect; where the nearest it comes leaves more than
/// the inverse, small changes told nothing.
const HIDDEN: f64 = 0.5;

/// What may be refitted: an arm with what acts on it, and how it is driven.
pub(super) struct Refit<'a> {
    pub arm: Arm,
    pub effects: &'a [Effect],
    pub drive: &'a Drive,
    pub seed: Seed,
    /// How far and how fast it usually moves [rad, rad/s].
    pub scales: [f64; 2],
}

impl Refit<'_> {
    /// Whether the effects in `all` do nothing to this arm beyond its own that would tell how large they are, though small changes of it
    /// would not do the same.
    ///
    /// Another arm may do most of it by itself. Or what small changes of this one do foretells nothing of larger ones: near its highest
    /// point next to nothing decides how it moves on.
    pub fn hides(&self, all: &[Effect], hideable: &Hideable) -> bool {
        let (without, with) = (self.rows(UNCHANGED), Refit { effects: all, ..*self }.rows(UNCHANGED));
        let size = hideable.size(with.as_slice(), without.as_slice(), 1.0);
        size > 0.0 && ((&with - &without).amax() > PI || misjudged(size, self.left(&with)))
    }

    /// Positions, row by row, after a relative change of all that is free.
    pub fn rows(&self, change: [f64; FREE]) -> DVector<f64> {
        let [inertia, viscous_friction, gravity_torque, start, speed] = change;
        let arm = Arm {
            inertia: self.arm.inertia * (1.0 + inertia),
            viscous_friction: self.arm.viscous_friction * (1.0 + viscous_friction),
            gravity_torque: self.arm.gravity_torque * (1.0 + gravity_torque),
            ..self.arm
        };
        let [reach, fast] = self.scales;
        let drive =
            Drive { start: self.drive.start + start * reach, speed: self.drive.speed + speed * fast, ..self.drive.clone() };
        let motion = Machine::new(arm, self.effects).run(&drive, Precision::Coarse, self.seed);
        DVector::from_iterator(drive.commands.len(), (0..drive.commands.len()).map(|row| motion.at(drive.time(row))))
    }

    /// How far the nearest that refitting comes is from `positions`, root mean square [rad]: by the method of Gauss and Newton, with halved steps.
    pub fn left(&self, positions: &DVector<f64>) -> f64 {
        let mut at = UNCHANGED;
        let mut rows = self.rows(at);
        let mut error = (positions - &rows).norm();
        for _ in 0..STEPS {
            let Some(step) = self.step(at, &rows, positions) else { break };
            let nearer = (0..HALVINGS).find_map(|halved| {
                let to: [f64; FREE] = std::array::from_fn(|k| at[k] + step[k] * 0.5_f64.powi(halved as i32));
                let there = self.rows(to);
                let left = (positions - &there).norm();
                // Neither a mass nor friction is less than nothing.
                (left < error && to[..3].iter().all(|change| *change > -1.0)).then_some((to, there, left))
            });
            let Some((to, there, left)) = nearer else { break };
            let last = left > (1.0 - LITTLE) * error;
            (at, rows, error) = (to, there, left);
            if last {
                break;
            }
        }
        error / (positions.len().max(1) as f64).sqrt()
    }

    fn step(&self, at: [f64; FREE], rows: &DVector<f64>, positions: &DVector<f64>) -> Option<DVector<f64>> {
        let columns: Vec<DVector<f64>> = (0..FREE)
            .map(|k| {
                let mut moved = at;
                moved[k] += DIFFERENCE;
                (self.rows(moved) - rows) / DIFFERENCE
            })
            .collect();
        let jacobian = DMatrix::from_columns(&columns);
        let mut curvature = jacobian.tr_mul(&jacobian);
        // What an arm does not have, as gravity, stays as it is.
        (0..FREE).filter(|k| columns[*k].amax() == 0.0).for_each(|k| curvature[(k, k)] = 1.0);
        curvature.cholesky().map(|c| c.solve(&jacobian.tr_mul(&(positions - rows))))
    }
}

/// Whether a `size`, which is what small changes of an arm leave, is not that of what the nearest arm leaves.
fn misjudged(size: f64, left: f64) -> bool {
    left < HIDDEN * size || left > size / HIDDEN
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drive() -> Drive {
        let commands = (0..2_500).map(|i| 1.6 * (f64::from(i) * 0.008).sin() + 0.6 * (f64::from(i) * 0.031).cos()).collect();
        Drive { commands, sample: 0.004, start: 0.0, speed: 0.0 }
    }

    /// Swings of a right angle, from which no small step leads to those of an arm that is another by a fifth.
    #[test]
    fn another_arm_of_the_same_kind_leaves_nothing_and_what_is_no_arm_leaves_something() {
        let arm = Arm { linear: false, inertia: 0.1, viscous_friction: 0.2, gravity_torque: 2.5, gain: 1.0 };
        let drive = drive();
        let refit = |arm: Arm| Refit { arm, effects: &[], drive: &drive, seed: Seed(0), scales: [0.8, 3.0] };
        let other = Arm { inertia: 0.12, viscous_friction: 0.17, gravity_torque: 2.2, ..arm };
        // One without gravity has none to be refitted.
        let [level, other_level] = [arm, other].map(|arm| Arm { gravity_torque: 0.0, ..arm });
        assert!(refit(level).left(&refit(other_level).rows(UNCHANGED)) < 1e-3);
        let theirs = refit(other).rows(UNCHANGED);
        assert!((0.7..2.5).contains(&theirs.amax()), "{}", theirs.amax());
        let apart = (refit(arm).rows(UNCHANGED) - &theirs).norm() / 50.0;
        let left = refit(arm).left(&theirs);
        assert!(left < 1e-3 * apart, "{left} of {apart}");
        let shaken = &theirs + DVector::from_fn(2_500, |row, _| if row % 2 == 0 { 0.05 } else { -0.05 });
        assert!((refit(arm).left(&shaken) / 0.05 - 1.0).abs() < 0.02);
    }

    #[test]
    fn a_size_is_what_the_nearest_arm_leaves_or_nothing() {
        assert!(!misjudged(1.0, 0.9) && !misjudged(1.0, 1.2));
        assert!(misjudged(1.0, 0.3), "another arm does most of it");
        assert!(misjudged(1.0, 3.0), "small changes foretold what no arm does");
    }

    /// An arm that is pushed to just below its highest point, and by just a little more over it.
    #[test]
    fn what_next_to_nothing_decides_is_hidden_and_what_moves_an_arm_elsewhere_is_not() {
        let arm = Arm { linear: false, inertia: 0.1, viscous_friction: 0.1, gravity_torque: 1.0, gain: 1.0 };
        let pushed = |torque: f64| Drive { commands: vec![torque; 2_500], sample: 0.004, start: 0.0, speed: 0.0 };
        let passes = |torque: f64| {
            let drive = pushed(torque);
            Refit { arm, effects: &[], drive: &drive, seed: Seed(0), scales: [1.0, 2.0] }.rows(UNCHANGED).amax() > PI
        };
        let (mut below, mut above) = (0.1, 2.0);
        assert!(!passes(below) && passes(above));
        for _ in 0..20 {
            let half = 0.5 * (below + above);
            if passes(half) { above = half } else { below = half }
        }
        let hides = |drive: &Drive, effect: Effect| {
            let hideable = Hideable::of(arm, drive, 1.0, 2.0);
            Refit { arm, effects: &[], drive, seed: Seed(0), scales: [1.0, 2.0] }.hides(&[effect], &hideable)
        };
        let pull = Effect::Pull { torque: 1e-3, reach: 1.0 };
        assert!(hides(&pushed(below), pull), "a thousandth of gravity takes it over the top");
        let to_and_fro = (0..2_500).map(|i| 0.5 * (f64::from(i) * 0.008).sin() + 0.2 * (f64::from(i) * 0.031).cos());
        let to_and_fro = Drive { commands: to_and_fro.collect(), ..pushed(0.0) };
        let twice_as_heavy = Effect::Load { time: 4.0, inertia: 0.0, gravity: 1.0 };
        assert!(!hides(&to_and_fro, twice_as_heavy), "from then on, and no arm is so from the beginning");
        let from_the_beginning = Effect::Load { time: -1.0, inertia: 0.0, gravity: 1.0 };
        let gently = Drive { commands: to_and_fro.commands.iter().map(|torque| 0.25 * torque).collect(), ..to_and_fro };
        assert!(hides(&gently, from_the_beginning), "another arm is so, however little it moves");
    }
}
