use super::*;

fn record(effects: &[ServoEffect]) -> Table {
    Servo::default().with(effects).record(Excitation::SinesAndSteps, Seed(7))
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value * value, count + 1.0));
    f64::sqrt(sum / count)
}

#[test]
fn same_seed_same_bits() {
    let arm = Servo::default().with(ServoEffect::TYPICAL);
    let once = arm.record(Excitation::ChirpAndSteps, Seed(3));
    assert_eq!(once, arm.record(Excitation::ChirpAndSteps, Seed(3)));
    assert_ne!(once, arm.record(Excitation::ChirpAndSteps, Seed(4)));
}

/// Energy is the invariant: without friction, drive or load a pendulum keeps it.
#[test]
fn a_free_pendulum_keeps_its_energy() {
    let arm = Servo { viscous_friction: 0.0, ..Servo::default() };
    let energy = |s: State| 0.5 * arm.inertia * s.velocity * s.velocity + arm.gravity_torque * (1.0 - s.position.cos());
    let start = State { position: 1.2, ..State::default() };
    let end = arm.integrate(start, 0.0, 5.0, &Distortion::default());
    assert!((energy(end) / energy(start) - 1.0).abs() < 1e-9, "{}", energy(end) / energy(start));
}

#[test]
fn bristles_hold_below_their_level_and_slip_above_it() {
    let held = Servo { gravity_torque: 0.0, ..Servo::default() };
    let distortion = Distortion::of(&[ServoEffect::BristleFriction { coulomb: 0.18, breakaway: 0.18 }]);
    let below = held.integrate(State::default(), 0.15, 5.0, &distortion);
    let later = held.integrate(below, 0.15, 5.0, &distortion);
    assert!(below.position.abs() < 0.001, "it gave way by {} rad", below.position);
    assert!((later.position - below.position).abs() < 1e-6, "it crept by {} rad", later.position - below.position);
    let above = held.integrate(State::default(), 0.25, 5.0, &distortion);
    let terminal = (0.25 - 0.18) / held.viscous_friction;
    assert!((above.velocity / terminal - 1.0).abs() < 0.01, "{} against {terminal}", above.velocity);
}

/// The step follows the bristles, so that a step five times finer changes nothing that a sensor would see.
#[test]
fn the_integration_has_converged() {
    let arm = Servo::default().with(ServoEffect::TYPICAL);
    let distortion = Distortion::of(&arm.effects);
    let coarse = arm.integrate(State::default(), 1.0, 0.4, &distortion);
    let fine = (0..20_000).fold(State::default(), |state, _| arm.runge_kutta(state, 1.0, 2e-5, &distortion));
    assert!((coarse.position - fine.position).abs() < 1e-6, "{} against {}", coarse.position, fine.position);
}

#[test]
fn a_late_bus_is_late_by_its_delay() {
    let prompt = Servo { noise: 0.0, resolution: 0.0, ..Servo::default() };
    let late = prompt.clone().with([ServoEffect::BusDelay { delay: 0.02, jitter: 0.0 }]);
    let (a, b) = (prompt.record(Excitation::ChirpAndSteps, Seed(1)), late.record(Excitation::ChirpAndSteps, Seed(1)));
    let (a, b) = (a.real("q").unwrap(), b.real("q").unwrap());
    assert!(rms(a.iter().zip(&b[5..]).map(|(a, b)| a - b)) < 2e-6);
    assert!(rms(a.iter().zip(b).map(|(a, b)| a - b)) > 0.005);
}

/// METHOD: signal to noise of 20 to 45 dB, effects of more than one standard deviation of the noise.
#[test]
fn every_effect_shows_above_the_noise() {
    let plain = record(&[]);
    let plain = plain.real("q").unwrap();
    let noise = Servo::default().noise;
    let decibel = 20.0 * (rms(plain.iter().copied()) / noise).log10();
    assert!((30.0..50.0).contains(&decibel), "{decibel} dB");
    for effect in ServoEffect::TYPICAL {
        let with = record(&[effect]);
        let size = rms(with.real("q").unwrap().iter().zip(plain).map(|(a, b)| a - b)) / noise;
        assert!((3.0..200.0).contains(&size), "{effect:?}: {size} sigma");
    }
}

#[test]
fn rows_are_of_one_length_and_values_of_the_sensors_step() {
    let table = record(&[]);
    assert!(table.columns().iter().all(|(_, column)| column.len() == 6_000));
    for value in table.real("q").unwrap() {
        assert!((value / 0.0005 - (value / 0.0005).round()).abs() < 1e-6, "{value}");
    }
}
