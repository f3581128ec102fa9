//! What gives in many parts that slip one after another: how far each is drawn, from -1 to 1.

use crate::robot::Mover;
use crate::sim2real::{LaneChange, Law, Scene, Thetas, Tick};

/// Parts that slip; more of them bend more smoothly, and take as much longer.
const PARTS: usize = 8;

/// Where the parts of a lane are: the middle of the last step [rad], and how far each is drawn.
#[derive(Debug, Clone, Copy)]
struct Place {
    position: f64,
    levels: [f64; PARTS],
}

/// Parts of equal torque, of which each slips at an angle of its own.
#[derive(Debug, Clone)]
pub(super) struct Slipping {
    /// Of all parts together [N m].
    torque: Vec<f64>,
    /// At which each slips [rad].
    angles: Vec<[f64; PARTS]>,
    memory: Vec<Option<Place>>,
}

impl Slipping {
    /// Of the parameters of lanes: torque [N m], the angle at which the last part would slip [rad], and the power of a part's number,
    /// from 0 to 1, by which the others slip earlier.
    pub fn of(thetas: &Thetas) -> Self {
        let [torque, slip_angle, spread] = [0, 1, 2].map(|row| thetas.row(row));
        let angles = slip_angle.iter().zip(spread).map(|(angle, spread)| slips(*angle, *spread)).collect();
        Self { torque: torque.to_vec(), angles, memory: vec![None; torque.len()] }
    }
}

/// The angles at which parts slip, in the unit of that at which the last would.
fn slips(slip_angle: f64, spread: f64) -> [f64; PARTS] {
    std::array::from_fn(|part| slip_angle * ((part as f64 + 0.5) / PARTS as f64).powf(spread))
}

impl<P: Mover> Law<P> for Slipping {
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.torque);
        change.derived(&mut self.angles, |values| slips(values[1], values[2]));
        change.memory(&mut self.memory);
    }

    fn act(&mut self, tick: Tick, scene: &Scene<'_, P>, effects: &mut [P::Effect]) {
        let parameters = self.torque.iter().zip(&self.angles).zip(&mut self.memory);
        let lanes = effects.iter_mut().zip(scene.states).zip(parameters).enumerate();
        for (lane, ((effect, state), ((torque, angles), memory))) in lanes {
            if *torque <= 0.0 {
                continue;
            }
            let motion = P::motion(state);
            let midway = motion.midway(tick.step);
            // All parts together must not be stiffer than a step can follow: what slips earlier is dry friction in all but name.
            let least = torque * tick.step * tick.step / P::inertia(scene.dynamics, lane, state);
            let drawn = memory.get_or_insert(Place { position: motion.position, levels: [0.0; PARTS] });
            let way = midway - drawn.position;
            drawn.position = midway;
            for (level, angle) in drawn.levels.iter_mut().zip(angles) {
                *level = (*level + way / angle.max(least)).clamp(-1.0, 1.0);
            }
            P::push(effect).effort -= torque * drawn.levels.iter().sum::<f64>() / PARTS as f64;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Hysteresis;
    use super::*;
    use crate::robot::mechanism::trial::Trial;
    use crate::sim2real::Mechanism;

    #[test]
    fn parts_slip_at_once_or_one_after_another() {
        assert_eq!(slips(0.3, 0.0), [0.3; PARTS]);
        let spread = slips(1.0, 2.0);
        assert!(spread[0] < 0.004 && spread[PARTS - 1] > 0.87 && spread.is_sorted(), "{spread:?}");
    }

    /// Drawn slowly by a tenth of what it can hold, it gives by as much as the springs of all parts do that have not slipped; by more than
    /// it can hold, it slides.
    #[test]
    fn it_gives_and_then_it_slides() {
        let trial = Trial { parameters: [0.1, 0.05, 0.0, 1.0], position: 0.3, velocity: 0.0, step: 1e-3 };
        let form = Mechanism::<crate::robot::Joint>::forms(&Hysteresis, &crate::sim2real::Typical::default())
            .iter()
            .position(|form| form.name == "maxwell_slip")
            .unwrap();
        let ramp: Vec<f64> = (0..60_000).map(|k| 0.01 * f64::from(k) / 60_000.0).collect();
        let held = trial.follow(&Hysteresis, form, &[0.2, 0.1, 1.0], &ramp)[59_999].position;
        let stiffness: f64 = slips(0.1, 1.0).iter().map(|angle| 0.2 / PARTS as f64 / angle).sum();
        assert!((held - 0.3 - 0.01 / stiffness).abs() < 5e-6, "{held}, {}", 0.3 + 0.01 / stiffness);
        let slides = trial.follow(&Hysteresis, form, &[0.2, 0.05, 1.0], &vec![0.5; 60_000])[59_999];
        assert!((slides.velocity - 0.3 / 0.05).abs() < 1e-6, "{}", slides.velocity);
    }
}
