//! Results do not depend on how many threads work on them.

use trueup::robot::{Axis, Commands, Joint, MECHANISMS};
use trueup::sim2real::diagnose::diagnose;
use trueup::sim2real::{Assembly, Measured, Recording, Seed};

/// An arm with a spring that its simulator does not know of, seen by a coarse encoder.
fn recording() -> Recording<Commands> {
    let time: Vec<f64> = (0..400).map(|row| f64::from(row) * 0.02).collect();
    let commands: Vec<f64> = time.iter().map(|t| 2.0 * (1.7 * t).sin() + (5.1 * t).cos()).collect();
    let (mut position, mut velocity) = (0.0_f64, 0.0_f64);
    let mut samples = Vec::new();
    for command in &commands {
        samples.push(Some((position / 2e-3).round() * 2e-3));
        for _ in 0..100 {
            velocity += 2e-4 * (command - 0.22 * velocity - 2.6 * position.sin() - 1.5 * position) / 0.12;
            position += 2e-4 * velocity;
        }
    }
    let position = Measured { channel: "position".into(), unit: "rad".into(), samples };
    Recording { name: "arm".into(), time, stimulus: Commands(commands), measured: vec![position] }
}

#[test]
fn threads_change_no_bit() {
    let arm = Joint::new(Axis::Rotary, [0.11, 0.25, 2.7, 1.0], [0.2, 0.2, 0.2, 0.0]);
    let (twin, recordings) = (Assembly::new(arm, MECHANISMS), [recording()]);
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().ok()?;
        let outcome = pool.install(|| diagnose(&twin, &recordings, &[], Seed(3), &|_, _, _| {}));
        // Debug output of a float tells every bit of it, but that of a NaN.
        Some(format!("{:?} {:?} {:?} {:?}", outcome.diagnosis, outcome.values, outcome.std, outcome.comparisons))
    };
    let alone = with(1);
    assert!(alone.as_ref().is_some_and(|told| told.contains("stiffness")));
    assert!(with(5) == alone, "a diagnosis by five threads differs from that by one");
}
