//! A joint with one mechanism, under the hands of a test.

use crate::robot::{Axis, Commands, Joint, MECHANISMS, Motion};
use crate::sim2real::{Assembly, Mechanism, Recording, Seed, Simulator, Thetas, Typical};

/// A joint and where it starts.
#[derive(Debug, Clone, Copy)]
pub(super) struct Trial {
    /// Inertia, viscous friction, gravity torque, gain.
    pub parameters: [f64; 4],
    /// Position at the start [rad].
    pub position: f64,
    /// Velocity at the start [rad/s].
    pub velocity: f64,
    /// Distance of rows [s].
    pub step: f64,
}

impl Trial {
    /// The motion under `commands`, one a row, with `mechanism` in form `form` at `values`.
    pub(super) fn follow(
        &self,
        mechanism: &'static dyn Mechanism<Joint>,
        form: usize,
        values: &[f64],
        commands: &[f64],
    ) -> Vec<Motion> {
        let recording = Recording {
            name: "trial".into(),
            time: (0..commands.len()).map(|k| k as f64 * self.step).collect(),
            stimulus: Commands(commands.to_vec()),
            measured: vec![],
        };
        let parameters = mechanism.forms(&Typical::default())[form].parameters.clone();
        let joint = Joint::new(Axis::Rotary, self.parameters, [0.0; 4]);
        let assembly = Assembly::new(joint, MECHANISMS).with_mechanism(mechanism, form, parameters);
        let theta: Vec<f64> = self.parameters.iter().chain(values).chain(&[self.position, self.velocity]).copied().collect();
        let rollout = assembly.rollout(&Thetas::single(&theta), &recording, 0..commands.len(), Seed(0));
        let [position, velocity] = rollout[0].as_slice() else { return Vec::new() };
        let rows = position.samples.iter().zip(&velocity.samples);
        rows.map(|(position, velocity)| Motion { position: *position, velocity: *velocity }).collect()
    }
}
