//! One step of the classical Runge-Kutta method, and what dry friction makes of it.

/// How a coordinate with dry friction moves during a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Contact {
    /// It slides, and this effort acts on it [N].
    Sliding(f64),
    /// It is held where it is.
    Held,
}

/// One step of `step` [s] from `state` along `rate`, the derivative [.../s].
///
/// Source: Hairer, Nørsett & Wanner, *Solving Ordinary Differential Equations I* (1993), II.1; error of order 5 a step.
pub(super) fn step<const N: usize>(state: [f64; N], step: f64, rate: impl Fn(&[f64; N]) -> [f64; N]) -> [f64; N] {
    let along = |slope: &[f64; N], share: f64| -> [f64; N] { std::array::from_fn(|k| state[k] + share * step * slope[k]) };
    let first = rate(&state);
    let second = rate(&along(&first, 0.5));
    let third = rate(&along(&second, 0.5));
    let fourth = rate(&along(&third, 1.0));
    std::array::from_fn(|k| state[k] + step / 6.0 * (first[k] + 2.0 * second[k] + 2.0 * third[k] + fourth[k]))
}

/// How often a coordinate may stop within one step before it is held for the rest of it.
const STOPS: usize = 3;

/// One step with dry friction of up to `friction` [N] on the coordinate whose velocity is `state[velocity]`.
///
/// It slides until its velocity changes sign, which is where it stops; from rest it moves only where `effort`, the net
/// effort on it [N], exceeds the friction. So a stuck coordinate stays where it is, to the bit (Stewart, "Rigid-body
/// dynamics with friction and impact", SIAM Review 42 (2000)).
pub(super) fn step_with_friction<const N: usize>(
    mut state: [f64; N],
    step_length: f64,
    velocity: usize,
    friction: f64,
    effort: impl Fn(&[f64; N]) -> f64,
    rate: impl Fn(&[f64; N], Contact) -> [f64; N],
) -> [f64; N] {
    if friction <= 0.0 {
        return step(state, step_length, |s| rate(s, Contact::Sliding(0.0)));
    }
    let mut left = step_length;
    for _ in 0..STOPS {
        let driving = if state[velocity] == 0.0 { effort(&state) } else { state[velocity] };
        if state[velocity] == 0.0 && driving.abs() <= friction {
            break;
        }
        let sliding = Contact::Sliding(-friction * driving.signum());
        let trial = step(state, left, |s| rate(s, sliding));
        if trial[velocity] * driving.signum() >= 0.0 {
            return trial;
        }
        let share = state[velocity] / (state[velocity] - trial[velocity]);
        state = step(state, share * left, |s| rate(s, sliding));
        state[velocity] = 0.0;
        left *= 1.0 - share;
    }
    step(state, left, |s| rate(s, Contact::Held))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A mass of 2 kg pushed by `force` [N], with friction of 1 N.
    fn slide(mut state: [f64; 2], seconds: f64, force: f64) -> [f64; 2] {
        let rate = |s: &[f64; 2], contact: Contact| match contact {
            Contact::Sliding(friction) => [s[1], (force + friction) / 2.0],
            Contact::Held => [s[1], 0.0],
        };
        for _ in 0..(seconds * 1e3).round() as usize {
            state = step_with_friction(state, 1e-3, 1, 1.0, |_| force, rate);
        }
        state
    }

    #[test]
    fn a_mass_stops_where_its_energy_ends_and_stays_there_to_the_bit() {
        // m v^2 / 2 = friction distance: 1 m/s is spent after 1 m and 2 s.
        let [stopped, velocity] = slide([0.0, 1.0], 2.5, 0.0);
        assert!((stopped - 1.0).abs() < 1e-9 && velocity == 0.0, "{stopped} m, {velocity} m/s");
        assert_eq!(slide([stopped, 0.0], 1.0, 0.999), [stopped, 0.0]);
        let [moved, velocity] = slide([0.0, 0.0], 1.0, 3.0);
        assert!((moved - 0.5).abs() < 1e-9 && (velocity - 1.0).abs() < 1e-9, "{moved} m, {velocity} m/s");
    }
}
