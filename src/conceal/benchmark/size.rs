//! How large an effect is: what it changes in a recording, before a sensor counts, beyond what refitting the arm would hide.

use super::arm::Arm;
use super::motion::{Drive, Machine, Precision};
use crate::sim2real::Seed;

/// Step of the finite differences, as a part of what is varied.
const DIFFERENCE: f64 = 1e-4;
/// A direction shorter than this part of what it was before those before it were taken out is none.
const NEW: f64 = 1e-6;

/// What refitting an arm's inertia, viscous friction, gravity and initial state could do to a recording: an orthonormal
/// basis of it.
#[derive(Debug, Clone)]
pub(super) struct Hideable {
    basis: Vec<Vec<f64>>,
}

impl Hideable {
    /// For `arm` under `drive`, where it usually moves by `reach` [rad] at `speed` [rad/s].
    pub fn of(arm: Arm, drive: &Drive, reach: f64, speed: f64) -> Self {
        let rows = |arm: Arm, start: f64, fast: f64| -> Vec<f64> {
            let drive = Drive { start: drive.start + start, speed: drive.speed + fast, ..drive.clone() };
            let motion = Machine::new(arm, &[]).run(&drive, Precision::Coarse, Seed(0));
            // A position that is moved is there at the first row too: a difference of positions begins at that.
            (0..drive.commands.len()).map(|row| if row == 0 { drive.start } else { motion.at(drive.time(row)) }).collect()
        };
        let base = rows(arm, 0.0, 0.0);
        let mut directions = Vec::new();
        for k in 0..3 {
            let mut values = arm.values();
            values[k] *= 1.0 + DIFFERENCE;
            if values[k] != 0.0 {
                directions.push(rows(arm.with_values(values), 0.0, 0.0));
            }
        }
        directions.push(rows(arm, DIFFERENCE * reach, 0.0));
        directions.push(rows(arm, 0.0, DIFFERENCE * speed));
        let mut all = Self { basis: Vec::new() };
        for mut direction in directions {
            direction.iter_mut().zip(&base).for_each(|(moved, base)| *moved -= base);
            let whole = norm(&direction);
            // Twice, for one pass of Gram and Schmidt leaves what rounding makes of nearly equal directions.
            all.take_out(&mut direction);
            all.take_out(&mut direction);
            let left = norm(&direction);
            if left > NEW * whole && left.is_finite() {
                direction.iter_mut().for_each(|value| *value /= left);
                all.basis.push(direction);
            }
        }
        all
    }

    /// Root mean square of the difference that could not be hidden, in units of `noise`.
    pub fn size(&self, with: &[f64], without: &[f64], noise: f64) -> f64 {
        let mut change: Vec<f64> = with.iter().zip(without).map(|(with, without)| with - without).collect();
        self.take_out(&mut change);
        norm(&change) / (change.len().max(1) as f64).sqrt() / noise
    }

    fn take_out(&self, vector: &mut [f64]) {
        for direction in &self.basis {
            let part: f64 = vector.iter().zip(direction).map(|(v, d)| v * d).sum();
            vector.iter_mut().zip(direction).for_each(|(v, d)| *v -= part * d);
        }
    }
}

fn norm(vector: &[f64]) -> f64 {
    vector.iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// The strength at which `size` is `target`, and the size there; none where no strength in `range` comes to it.
///
/// Bisection in the logarithm of the strength, sped up by the secant: most effects are nearly proportional to theirs.
pub(super) fn strength(target: f64, range: (f64, f64), size: impl Fn(f64) -> f64) -> Option<(f64, f64)> {
    // What has no size is too strong: something flew apart.
    let sized = |strength: f64| Some(size(strength)).filter(|size| !size.is_nan()).unwrap_or(f64::INFINITY);
    let error = |strength: f64| (sized(strength).max(1e-12) / target).ln();
    let (mut low, mut high) = (range.0.ln(), range.1.ln());
    let (mut below, mut above): (Option<f64>, Option<f64>) = (None, None);
    let mut at = 0.5 * (low + high);
    for _ in 0..16 {
        let wrong = error(at.exp());
        if !wrong.is_finite() || wrong > 0.0 {
            (high, above) = (at, Some(wrong));
        } else {
            (low, below) = (at, Some(wrong));
        }
        if wrong.abs() < CLOSE {
            return Some((at.exp(), target * wrong.exp()));
        }
        let next = match (below, above) {
            (Some(below), Some(above)) if above.is_finite() => {
                let part = (-below / (above - below)).clamp(0.08, 0.92);
                low + part * (high - low)
            }
            _ if wrong.is_finite() => (at - wrong).clamp(range.0.ln(), range.1.ln()),
            _ => 0.5 * (low + high),
        };
        // Both ends of the range may have to be tried, but not twice.
        if (next - at).abs() < 1e-9 {
            return None;
        }
        at = if next > low && next < high || below.is_none() || above.is_none() { next } else { 0.5 * (low + high) };
    }
    None
}

/// How near a size must come to its target, in its logarithm.
const CLOSE: f64 = 0.05;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strength_is_found_where_there_is_one() {
        let found = strength(3.0, (1e-4, 2.0), |s| 40.0 * s).unwrap();
        assert!((found.1 / 3.0 - 1.0).abs() < 0.06 && (40.0 * found.0 / 3.0 - 1.0).abs() < 0.06);
        // Nothing at first, then steep, as an end stop is.
        let stop = |s: f64| if s < 0.1 { 0.0 } else { 300.0 * (s - 0.1) };
        assert!((stop(strength(3.0, (1e-4, 0.75), stop).unwrap().0) / 3.0 - 1.0).abs() < 0.06);
        assert_eq!(strength(3.0, (1e-4, 0.01), |s| 40.0 * s), None);
        assert_eq!(strength(3.0, (1.0, 2.0), |s| 40.0 * s), None);
        assert!(strength(3.0, (1e-4, 2.0), |s| if s > 0.3 { f64::NAN } else { 40.0 * s }).is_some());
        // The first that is tried has none: the search goes down from there, not up.
        assert!(strength(3.0, (1e-4, 1e3), |s| if s > 0.1 { f64::NAN } else { 40.0 * s }).is_some());
    }

    /// A change that a heavier arm would make is no effect; one that is at right angles to all refitting is seen whole.
    #[test]
    fn what_refitting_hides_does_not_count() {
        let arm = Arm { linear: false, inertia: 0.1, viscous_friction: 0.2, gravity_torque: 2.5, gain: 1.0 };
        let commands: Vec<f64> =
            (0..3_000).map(|i| 1.5 * (f64::from(i) * 0.011).sin() + (f64::from(i) * 0.031).cos()).collect();
        let drive = Drive { commands, sample: 0.004, start: 0.0, speed: 0.0 };
        let hideable = Hideable::of(arm, &drive, 0.5, 2.0);
        assert_eq!(hideable.basis.len(), 5);
        let run = |arm: Arm| -> Vec<f64> {
            let motion = Machine::new(arm, &[]).run(&drive, Precision::Coarse, Seed(0));
            (0..3_000).map(|row| motion.at(drive.time(row))).collect()
        };
        let (base, heavier) = (run(arm), run(Arm { inertia: 0.1001, ..arm }));
        let plain = norm(&heavier.iter().zip(&base).map(|(a, b)| a - b).collect::<Vec<_>>()) / 3_000.0_f64.sqrt();
        assert!(hideable.size(&heavier, &base, 1.0) < 0.01 * plain);
        let shifted: Vec<f64> = base.iter().enumerate().map(|(i, q)| q + if i % 2 == 0 { 0.1 } else { -0.1 }).collect();
        assert!((hideable.size(&shifted, &base, 0.01) - 10.0).abs() < 0.01);
    }
}
