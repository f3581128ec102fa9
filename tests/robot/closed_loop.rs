//! Twins with a controller: what is recorded as a command is the set point of the first channel.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

#[cfg(feature = "cli")]
use std::fmt::Write as _;

use trueup::robot::{Axis, Commands, Joint, MECHANISMS};
use trueup::sim2real::diagnose::{Verdict, diagnose};
use trueup::sim2real::{Assembly, DerivativeOf, Measured, Parameter, Pid, Recording, Seed, Simulator, Thetas, Typical};

/// Inertia, viscous friction, gravity torque, gain; then kp, ki, kd, limit.
const ARM: [f64; 4] = [0.1, 0.2, 2.0, 1.5];
const GAINS: [f64; 4] = [6.0, 4.0, 0.3, 2.0];

fn pid(period: Option<f64>, derivative: DerivativeOf) -> Pid {
    let gain = |(name, value): (&'static str, f64)| Parameter::new(name, "", value).known_to(0.0);
    let mut pid = Pid::new(["kp", "ki", "kd", "limit"].into_iter().zip(GAINS).map(gain));
    (pid.period, pid.derivative) = (period, derivative);
    pid
}

fn arm() -> Joint {
    Joint::new(Axis::Rotary, ARM, [0.2, 0.2, 0.2, 0.0])
}

/// Set points that step and swing, every 5 ms.
fn set_points(rows: usize) -> Recording<Commands> {
    let time: Vec<f64> = (0..rows).map(|i| i as f64 * 5e-3).collect();
    let goal = |t: &f64| 0.5 * (1.7 * t).sin() + if (0.7 * t).sin() > 0.0 { 0.3 } else { -0.2 };
    Recording { name: "goals".into(), stimulus: Commands(time.iter().map(goal).collect()), measured: vec![], time }
}

fn values(initial: [f64; 2]) -> Vec<f64> {
    ARM.into_iter().chain(GAINS).chain(initial).collect()
}

/// The arm under the controller, by Runge-Kutta at 20 us, with dry friction of `friction` [N m].
fn reference(goals: &Recording<Commands>, every: usize, of: DerivativeOf, friction: f64) -> Vec<f64> {
    let [inertia, viscous, gravity, gain] = ARM;
    let [kp, ki, kd, limit] = GAINS;
    let (mut q, mut v, mut u) = (0.1_f64, 0.0_f64, 0.0_f64);
    let (mut integral, mut last): (f64, Option<(f64, f64)>) = (0.0, None);
    let mut seen = Vec::new();
    for goal in &goals.stimulus.0 {
        seen.push(q);
        for millisecond in 0..5 {
            if (5 * (seen.len() - 1) + millisecond).is_multiple_of(every) {
                let step = every as f64 * 1e-3;
                let error = goal - q;
                let followed = if of == DerivativeOf::Error { error } else { -q };
                let mut derivative = 0.0;
                if let Some((last_error, last_followed)) = last {
                    derivative = (followed - last_followed) / step;
                    if u.abs() < limit || u * last_error <= 0.0 {
                        integral += ki * last_error * step;
                    }
                }
                last = Some((error, followed));
                u = (kp * error + integral + kd * derivative).clamp(-limit, limit);
            }
            let h = 2e-5;
            for _ in 0..50 {
                if friction > 0.0 {
                    let free = v + h * (gain * u - viscous * v - gravity * q.sin()) / inertia;
                    v = free.signum() * (free.abs() - h * friction / inertia).max(0.0);
                    q += h * v;
                    continue;
                }
                let a = |q: f64, v: f64| (gain * u - viscous * v - gravity * q.sin()) / inertia;
                let (k1, l1) = (v, a(q, v));
                let (k2, l2) = (v + 0.5 * h * l1, a(q + 0.5 * h * k1, v + 0.5 * h * l1));
                let (k3, l3) = (v + 0.5 * h * l2, a(q + 0.5 * h * k2, v + 0.5 * h * l2));
                let (k4, l4) = (v + h * l3, a(q + h * k3, v + h * l3));
                q += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
                v += h / 6.0 * (l1 + 2.0 * l2 + 2.0 * l3 + l4);
            }
        }
    }
    seen
}

#[test]
fn a_controlled_arm_moves_as_one_integrated_by_itself() {
    let goals = set_points(1_500);
    for (every, of) in [(1, DerivativeOf::Measurement), (20, DerivativeOf::Measurement), (5, DerivativeOf::Error)] {
        let period = (every > 1).then_some(every as f64 * 1e-3);
        let twin = Assembly::new(arm(), MECHANISMS).controlled_by(pid(period, of));
        let ours = &twin.rollout(&Thetas::single(&values([0.1, 0.0])), &goals, 0..1_500, Seed(0))[0][0].samples;
        let theirs = reference(&goals, every, of, 0.0);
        let worst = ours.iter().zip(&theirs).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst < 1e-4, "{worst} rad, acting every {every} ms on {of:?}");
        assert!(theirs.iter().fold(0.0_f64, |m, q| m.max(q.abs())) > 0.5, "it moves");
    }
}

/// Windows may start an open loop anywhere, and no closed one.
#[test]
fn a_loop_says_whether_it_is_closed() {
    let open = Assembly::new(arm(), MECHANISMS);
    assert!(!open.in_closed_loop() && open.controlled_by(pid(None, DerivativeOf::Error)).in_closed_loop());
}

#[test]
fn lanes_of_a_closed_loop_do_not_see_each_other() {
    let goals = set_points(400);
    let twin = Assembly::new(arm(), MECHANISMS).controlled_by(pid(None, DerivativeOf::Measurement));
    let one = values([0.1, 0.0]);
    let other: Vec<f64> = one.iter().map(|v| 1.1 * v).collect();
    let alone = twin.rollout(&Thetas::single(&one), &goals, 0..400, Seed(0));
    let beside = twin.rollout(&Thetas::from_lanes(&[other.clone(), one.clone(), other, one]), &goals, 0..400, Seed(0));
    assert!(beside[1] == alone[0] && beside[3] == alone[0]);
    assert!(beside[0] != alone[0]);
}

/// A run that starts in the midst of a recording knows the integral and the difference from what was measured before.
#[test]
fn a_controller_remembers_what_was_measured_before_a_window() {
    let mut goals = set_points(1_000);
    let twin = Assembly::new(arm(), MECHANISMS).controlled_by(pid(Some(5e-3), DerivativeOf::Measurement));
    let whole = twin.rollout(&Thetas::single(&values([0.1, 0.0])), &goals, 0..1_000, Seed(0)).remove(0);
    let samples = whole[0].samples.iter().map(|q| Some(*q)).collect();
    goals.measured = vec![Measured { channel: "position".into(), unit: "rad".into(), samples }];
    let start = [whole[0].samples[600], whole[1].samples[600]];
    let window = twin.rollout(&Thetas::single(&values(start)), &goals, 600..1_000, Seed(0)).remove(0);
    let apart = window[0].samples.iter().zip(&whole[0].samples[600..]).map(|(a, b)| (a - b).abs());
    assert!(apart.fold(0.0, f64::max) < 1e-9);
}

/// The sensor's offset is what the controller drives to the set point, and the driver's limit lies behind the controller.
#[test]
fn the_controller_stands_between_sensor_and_driver() {
    let mut goals = set_points(1_600);
    goals.stimulus.0.fill(0.4);
    let with = |name: &str, value: f64| {
        let mechanism = MECHANISMS.iter().find(|m| m.about().name == name).unwrap();
        let parameters = mechanism.forms(&Typical::default())[0].parameters.clone();
        let twin = Assembly::new(arm(), MECHANISMS)
            .controlled_by(pid(None, DerivativeOf::Measurement))
            .with_mechanism(*mechanism, 0, parameters);
        let mut theta = values([0.1, 0.0]);
        theta.insert(8, value);
        twin.rollout(&Thetas::single(&theta), &goals, 0..1_600, Seed(0)).remove(0).remove(0).samples
    };
    // The reported position settles at the set point, whatever the offset; the limit keeps the arm below.
    assert!((with("bias", 0.1)[1_599] - 0.4).abs() < 1e-3);
    assert!((with("bias", 0.0)[1_599] - 0.4).abs() < 1e-3);
    let limited = with("saturation", 0.3)[1_599];
    assert!((limited - (0.3 * 1.5 / 2.0_f64).asin()).abs() < 1e-3, "{limited}");
}

/// What a sensor makes of angles whose noise is spread evenly over 1 mrad.
fn sensed(angles: Vec<f64>) -> Vec<f64> {
    let mut drawn = 1_u64;
    let mut noisy = |q: f64| {
        drawn = drawn.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        q + 1e-3 * ((drawn >> 11) as f64 / (1_u64 << 53) as f64 - 0.5)
    };
    angles.into_iter().map(&mut noisy).collect()
}

#[test]
fn dry_friction_is_named_in_a_closed_loop() {
    let mut goals = set_points(2_400);
    let samples = sensed(reference(&goals, 5, DerivativeOf::Measurement, 0.25)).into_iter().map(Some).collect();
    goals.measured = vec![Measured { channel: "position".into(), unit: "rad".into(), samples }];
    let twin = Assembly::new(arm(), MECHANISMS).controlled_by(pid(Some(5e-3), DerivativeOf::Measurement));
    let found = diagnose(&twin, &[goals], &[], Seed(0), &|_, _, _| {}).diagnosis;
    assert_eq!(found.verdict, Verdict::Named, "{}", found.summary);
    assert_eq!(found.effects[0].mechanism, "coulomb_friction", "{}", found.summary);
    assert!((found.effects[0].parameters["torque"].value - 0.25).abs() < 0.02, "{:?}", found.effects[0]);
}

/// Diagnoses, on the command line, an arm whose controller acts every so many milliseconds, by a twin that does not say how often.
/// Gives the diagnosis and the trued twin.
#[cfg(feature = "cli")]
fn diagnosed_unpaced(every: usize, friction: f64) -> (serde_json::Value, String) {
    let folder = tempfile::TempDir::new().unwrap();
    let goals = set_points(1_200);
    let mut table = String::from("t,goal,q\n");
    let samples = sensed(reference(&goals, every, DerivativeOf::Measurement, friction));
    for ((time, goal), q) in goals.time.iter().zip(&goals.stimulus.0).zip(samples) {
        writeln!(table, "{time},{goal},{q}").unwrap();
    }
    let ([inertia, viscous, gravity, gain], [kp, ki, kd, limit]) = (ARM, GAINS);
    let twin = format!(
        "[twin]\nmodel = \"joint\"\n\n[parameters]\n\
         inertia = {{ value = {inertia}, unit = \"kg m^2\", uncertainty = 0.2 }}\n\
         viscous_friction = {{ value = {viscous}, unit = \"N m s/rad\", uncertainty = 0.2 }}\n\
         gravity_torque = {{ value = {gravity}, unit = \"N m\", uncertainty = 0.2 }}\n\
         gain = {{ value = {gain}, unit = \"N m per unit\", uncertainty = 0 }}\n\n\
         [channels]\ncommand = {{ column = \"goal\" }}\nposition = {{ column = \"q\", unit = \"rad\" }}\n\n\
         [controller]\nkind = \"pid\"\nkp = {{ value = {kp} }}\nki = {{ value = {ki} }}\nkd = {{ value = {kd} }}\n\
         limit = {{ value = {limit} }}\n"
    );
    std::fs::write(folder.path().join("twin.toml"), twin).unwrap();
    std::fs::write(folder.path().join("log.csv"), table).unwrap();
    let run = assert_cmd::Command::new(assert_cmd::cargo::cargo_bin!("trueup"))
        .current_dir(folder.path())
        .args(["diagnose", "twin.toml", "--recording", "log.csv", "--out", "found"])
        .output()
        .unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let read = |name: &str| std::fs::read_to_string(folder.path().join("found").join(name)).unwrap();
    (serde_json::from_str(&read("diagnosis.json")).unwrap(), read("trued.toml"))
}

/// A loop of a microcontroller that logs each of its turns, by a twin whose controller acts at every step of integration: taken as
/// such, what the half of a row makes of the motion would be told as something that is missing.
#[cfg(feature = "cli")]
#[test]
fn a_controller_that_is_not_said_to_wait_acts_as_often_as_the_recording_shows() {
    let (whole, trued) = diagnosed_unpaced(5, 0.0);
    assert_eq!(whole["verdict"], "no_mismatch", "{}", whole["summary"]);
    assert!(trued.contains("period = 0.005"), "{trued}");
    let notes = whole["checks"]["notes"].to_string();
    assert!(notes.contains("once a row, every 0.00500 s"), "{notes}");

    let (rubbing, trued) = diagnosed_unpaced(5, 0.25);
    assert_eq!(rubbing["effects"][0]["mechanism"], "coulomb_friction", "{}", rubbing["summary"]);
    assert_eq!(rubbing["effects"].as_array().unwrap().len(), 1, "{}", rubbing["summary"]);
    assert!(trued.contains("period = 0.005"), "{trued}");

    let (fast, trued) = diagnosed_unpaced(1, 0.25);
    assert_eq!(fast["effects"][0]["mechanism"], "coulomb_friction", "{}", fast["summary"]);
    assert!(!trued.contains("period"), "{trued}");
}
