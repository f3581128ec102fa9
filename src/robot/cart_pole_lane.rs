//! The equations of motion of one cart-pole.

use super::joint::{CREEP_RATE, CREEP_SHARE};
use super::mover::{Push, rubbed};
use super::runge_kutta::Contact;

/// The parameters of one lane: masses [kg], half length of the pole [m], gravity [m/s^2], frictions of the cart [N s/m] and the hinge
/// [N m s], gain [N per unit].
#[derive(Debug, Clone, Copy)]
pub(super) struct Lane {
    pub cart_mass: f64,
    pub pole_mass: f64,
    pub half_length: f64,
    pub gravity: f64,
    pub cart_friction: f64,
    pub pole_friction: f64,
    pub gain: f64,
}

impl Lane {
    /// With these values, in the order of [`CartPole`](super::CartPole)'s parameters.
    pub fn of(values: [f64; 7]) -> Self {
        let [cart_mass, pole_mass, half_length, gravity, cart_friction, pole_friction, gain] = values;
        Self { cart_mass, pole_mass, half_length, gravity, cart_friction, pole_friction, gain }
    }

    /// What the pole weighs along the track while it swings freely: `M + m - 3/4 m cos^2 q` [kg], with a cart of mass `cart`.
    pub fn inertia(&self, cart: f64, cos: f64) -> f64 {
        cart + self.pole_mass * (1.0 - 0.75 * cos * cos)
    }

    /// Force of the freely swinging pole on a cart that does not accelerate [N].
    pub fn reaction(&self, state: &[f64; 4]) -> f64 {
        let [_, _, angle, spin] = *state;
        let (sin, cos) = angle.sin_cos();
        self.pole_mass * self.half_length * spin * spin * sin - 0.75 * cos * self.leaning(sin, spin)
    }

    /// Torque that turns the pole, over its half length [N].
    pub fn leaning(&self, sin: f64, spin: f64) -> f64 {
        self.pole_mass * self.gravity * sin - self.pole_friction * spin / self.half_length
    }

    /// Force on the cart beside the pole's and dry friction's [N].
    pub fn force(&self, state: &[f64; 4], command: f64, push: &Push) -> f64 {
        let [position, velocity, ..] = *state;
        self.gain * command + push.effort - push.stiffness * position - (self.cart_friction + push.damping) * velocity
    }

    /// Rates of change of the state; `contact` is that of the cart with its track.
    pub fn rate(&self, state: &[f64; 4], command: f64, push: &Push, contact: Contact) -> [f64; 4] {
        let [_, velocity, angle, spin] = *state;
        let (sin, cos) = angle.sin_cos();
        let acceleration = match contact {
            Contact::Held => 0.0,
            Contact::Sliding(friction) => {
                let inertia = self.inertia(self.cart_mass + push.inertia, cos);
                let mut force = self.force(state, command, push) + self.reaction(state);
                if push.creeping_friction > 0.0 {
                    let stopping = CREEP_SHARE * (inertia * CREEP_RATE * velocity + force);
                    force -= stopping.max(-push.creeping_friction).min(push.creeping_friction);
                }
                (force + friction) / inertia
            }
        };
        let turning = 0.75 / self.half_length * (self.leaning(sin, spin) / self.pole_mass - cos * acceleration);
        [velocity, acceleration, spin, turning]
    }
}

impl Lane {
    /// One step of Euler's explicit method. Where dry friction stops the cart within the step, its acceleration is the mean one.
    pub fn euler(&self, state: &[f64; 4], step: f64, command: f64, push: &Push) -> [f64; 4] {
        let [position, velocity, angle, spin] = *state;
        let (sin, cos) = angle.sin_cos();
        let rate = self.rate(state, command, push, Contact::Sliding(0.0));
        let mut acceleration = rate[1];
        if push.dry_friction > 0.0 {
            let held = step * push.dry_friction / self.inertia(self.cart_mass + push.inertia, cos);
            acceleration = (rubbed(velocity, velocity + step * acceleration, held) - velocity) / step;
        }
        let turning = 0.75 / self.half_length * (self.leaning(sin, spin) / self.pole_mass - cos * acceleration);
        [position + step * velocity, velocity + step * acceleration, angle + step * spin, spin + step * turning]
    }
}
