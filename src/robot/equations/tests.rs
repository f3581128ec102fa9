//! Equations against solvers, laws and bad input.

use super::*;
use crate::robot::{Axis, Commands, EQUATIONS_MECHANISMS, Joint, MECHANISMS};
use crate::sim2real::{Assembly, Measured, Seed, Simulator, Twin, check_mechanism, check_plant};
use differential_equations::prelude::*;

fn state(name: &str, unit: &str, initial: f64) -> StateVariable {
    StateVariable { name: name.into(), unit: unit.into(), initial, std: None }
}

/// Time that grows with the square of what is read would be minutes here.
#[test]
fn large_systems_are_made_ready_in_time_and_larger_ones_refused() {
    let long = |k: usize| (0..150).map(|n| format!("{k}.{n}*x")).collect::<Vec<_>>().join(" + ");
    let chain = |k: usize| format!("d{}", k + 1);
    for text in [&long as &dyn Fn(usize) -> String, &chain] {
        let mut definitions: Vec<(String, String)> = (0..900).map(|k| (format!("d{k}"), text(k))).collect();
        definitions.push(("d900".into(), "2*x".into()));
        let mut system = duffing();
        system.definitions.extend(definitions);
        assert!(Equations::new(system.clone(), 1e-3).is_ok());
        system.definitions.extend((901..1_200).map(|k| (format!("d{k}"), "x".into())));
        let error = Equations::new(system, 1e-3).unwrap_err();
        assert!(error.message.contains("at most 1000 names"), "{error}");
    }
}

/// A mass on a spring that hardens: Duffing's oscillator.
fn duffing() -> EquationSystem {
    let parameter = |(name, value): (&'static str, f64)| Parameter::new(name, "", value).known_to(0.1 * value);
    EquationSystem {
        states: vec![state("v", "m/s", 0.0), state("x", "m", 0.0)],
        inputs: vec![InputVariable { name: "u".into(), unit: "V".into(), interpolated: false }],
        parameters: [("d", 0.4), ("k", 9.0), ("k3", 20.0), ("m", 0.7)].map(parameter).to_vec(),
        definitions: vec![("spring".into(), "k*x + hard".into()), ("hard".into(), "k3*x^3".into())],
        rates: vec![("x".into(), "v".into()), ("v".into(), "(u - d*v - spring)/m".into())],
        outputs: vec![OutputVariable { name: "y".into(), unit: "m".into(), expression: "x".into() }],
        attach: Some(Attachment { position: "x".into(), velocity: "v".into(), inertia: "m".into() }),
        discrete: false,
    }
}

fn recording(rows: usize, interpolated: bool) -> Recording<Driving> {
    let time: Vec<f64> = (0..rows).map(|i| i as f64 * 0.02).collect();
    let commands: Vec<f64> = time.iter().map(|t| 3.0 * (2.0 * t).sin() + (5.0 * t).cos()).collect();
    let samples = time.iter().map(|t| Some(0.3 * (2.0 * t).sin())).collect();
    let measured = vec![Measured { channel: "y".into(), unit: "m".into(), samples }];
    Recording { name: "duffing".into(), stimulus: Driving::new(&time, &[(commands, interpolated)]), measured, time }
}

fn follow(system: EquationSystem, step: f64, theta: &[f64], recording: &Recording<Driving>) -> Vec<f64> {
    let assembly = Assembly::new(Equations::new(system, step).unwrap(), EQUATIONS_MECHANISMS);
    assembly.rollout(&Thetas::single(theta), recording, 0..recording.len(), Seed(0)).remove(0).remove(0).samples
}

#[test]
fn the_plant_and_every_row_of_its_registry_keep_their_contracts() {
    let plant = Equations::new(duffing(), 5e-3).unwrap();
    check_plant(&plant, EQUATIONS_MECHANISMS, &recording(500, false)).unwrap();
    for mechanism in EQUATIONS_MECHANISMS {
        check_mechanism(*mechanism, &plant, EQUATIONS_MECHANISMS, &recording(500, false)).unwrap();
    }
}

struct Oscillator {
    recording: Recording<Driving>,
    interpolated: bool,
}

impl ODE<f64, [f64; 2]> for Oscillator {
    fn diff(&self, t: f64, y: &[f64; 2], dydt: &mut [f64; 2]) {
        let commands = self.recording.stimulus.as_ref();
        let row = ((t / 0.02).floor() as usize).min(commands.len() - 2);
        let share = if self.interpolated { t / 0.02 - row as f64 } else { 0.0 };
        let u = commands[row] + share * (commands[row + 1] - commands[row]);
        *dydt = [y[1], (u - 0.4 * y[1] - 9.0 * y[0] - 20.0 * y[0].powi(3)) / 0.7];
    }
}

/// Row by row, so that the solver meets no step of the command within one call.
#[test]
fn follows_the_equations_as_an_ode_solver_does() {
    for (interpolated, tolerance) in [(false, 1e-8), (true, 1e-5)] {
        let recording = recording(300, interpolated);
        let ours = follow(duffing(), 2.5e-3, &[0.4, 9.0, 20.0, 0.7, 0.1, 0.0], &recording);
        let ode = Oscillator { recording, interpolated };
        let mut y = [0.1, 0.0];
        for (row, ours) in ours.iter().enumerate().take(299) {
            assert!((ours - y[0]).abs() < tolerance, "row {row}: {ours} instead of {}", y[0]);
            let (from, to) = (row as f64 * 0.02 + 1e-12, (row + 1) as f64 * 0.02 - 1e-12);
            let method = ExplicitRungeKutta::dop853().rtol(1e-11).atol(1e-12);
            y = *IVP::ode(&ode, from, to, y).method(method).solve().unwrap().y.last().unwrap();
        }
    }
}

/// The joint's own equation, written down, with the joint's mechanisms: another integrator of the same physics.
#[test]
fn mechanisms_of_motion_act_as_on_a_joint() {
    let mut system = duffing();
    system.rates[1].1 = "(u - d*v - k*sin(x))/m".into();
    (system.states[0].unit, system.states[1].unit) = ("rad/s".into(), "rad".into());
    let plant = Equations::new(system, 1e-4).unwrap();
    let joint = Joint::new(Axis::Rotary, [0.7, 0.4, 9.0, 1.0], [0.1; 4]);
    let ours = recording(500, false);
    let stimulus = Commands(ours.stimulus.as_ref().to_vec());
    let theirs = Recording { name: String::new(), stimulus, measured: vec![], time: ours.time.clone() };
    for (name, value) in [("coulomb_friction", 0.8), ("quadratic_drag", 0.5), ("stiffness", 2.0), ("constant_load", 0.7)] {
        let of_joint = MECHANISMS.iter().find(|m| m.about().name == name).unwrap();
        let of_ours = EQUATIONS_MECHANISMS.iter().find(|m| m.about().name == name).unwrap();
        let form = |forms: Vec<crate::sim2real::Form>| forms[0].parameters.clone();
        let joint =
            Assembly::new(joint.clone(), MECHANISMS).with_mechanism(*of_joint, 0, form(of_joint.forms(&Typical::default())));
        let written = Assembly::new(plant.clone(), EQUATIONS_MECHANISMS).with_mechanism(
            *of_ours,
            0,
            form(of_ours.forms(&Typical::default())),
        );
        let joint =
            joint.stepping(1e-4).rollout(&Thetas::single(&[0.7, 0.4, 9.0, 1.0, value, 0.3, 0.0]), &theirs, 0..500, Seed(0));
        let thetas = Thetas::single(&[0.4, 9.0, 20.0, 0.7, value, 0.3, 0.0]);
        let written = written.rollout(&thetas, &ours, 0..500, Seed(0));
        let worst = joint[0][0].samples.iter().zip(&written[0][0].samples).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst < 1e-4, "{name}: {worst} rad");
    }
}

/// A push below the friction moves nothing, to the bit; one above does.
#[test]
fn what_is_stuck_stays_stuck() {
    let mut system = duffing();
    system.rates[1].1 = "(u - d*v)/m".into();
    let friction = EQUATIONS_MECHANISMS.iter().find(|m| m.about().name == "coulomb_friction").unwrap();
    let parameters = friction.forms(&Typical::default())[0].parameters.clone();
    let plant = Equations::new(system, 5e-3).unwrap();
    let assembly = Assembly::new(plant, EQUATIONS_MECHANISMS).with_mechanism(*friction, 0, parameters);
    let recording = recording(400, false);
    let lanes = [[0.4, 9.0, 20.0, 0.7, 4.5, 0.123, 0.0], [0.4, 9.0, 20.0, 0.7, 0.5, 0.123, 0.0]];
    let both = assembly.rollout(&Thetas::from_lanes(&lanes), &recording, 0..400, Seed(0));
    assert!(both[0][0].samples.iter().all(|x| *x == 0.123));
    assert!(both[1][0].samples[100] > 0.2);
}

#[test]
fn equations_from_row_to_row_take_one_step_a_row() {
    let mut system = duffing();
    (system.discrete, system.attach) = (true, None);
    system.rates = vec![("x".into(), "0.5*x + u".into()), ("v".into(), "x".into())];
    system.outputs[0].expression = "x - v".into();
    let recording = recording(100, false);
    let ours = follow(system, 1e-3, &[0.4, 9.0, 20.0, 0.7, 0.0, 2.0], &recording);
    let (mut x, mut v) = (2.0, 0.0);
    for (row, ours) in ours.iter().enumerate() {
        assert_eq!(*ours, x - v);
        (x, v) = (0.5 * x + recording.stimulus.as_ref()[row], x);
    }
}

/// A drive that is switched on and off by a second input, with gears whose friction grows with what it does: as a joint that is given
/// no command meanwhile. Taken for off throughout, it would drive no load.
#[test]
fn mechanisms_know_the_other_inputs() {
    let mut system = duffing();
    system.inputs.push(InputVariable { name: "on".into(), unit: String::new(), interpolated: false });
    system.rates[1].1 = "(on*u - d*v - k*sin(x))/m".into();
    (system.states[0].unit, system.states[1].unit) = ("rad/s".into(), "rad".into());
    let of_one = recording(500, false);
    let (time, commands) = (of_one.time, of_one.stimulus.as_ref().to_vec());
    let on: Vec<f64> = (0..500).map(|row| f64::from(u8::from(row % 200 < 120))).collect();
    let given: Vec<f64> = commands.iter().zip(&on).map(|(u, on)| u * on).collect();
    let stimulus = Driving::new(&time, &[(commands, false), (on, false)]);
    let ours = Recording { name: String::new(), stimulus, measured: of_one.measured, time: time.clone() };
    let theirs = Recording { name: String::new(), stimulus: Commands(given), measured: vec![], time };

    let plant = Equations::new(system, 1e-4).unwrap();
    let typical = plant.typical(std::slice::from_ref(&ours));
    assert!((typical.effort / typical.command - 1.0).abs() < 1e-9, "{typical:?}");
    let joint = Joint::new(Axis::Rotary, [0.7, 0.4, 9.0, 1.0], [0.1; 4]);
    let of_ours = EQUATIONS_MECHANISMS.iter().find(|m| m.about().name == "load_friction").unwrap();
    let of_joint = MECHANISMS.iter().find(|m| m.about().name == "load_friction").unwrap();
    let form = of_ours.forms(&typical).remove(0).parameters;
    let written = Assembly::new(plant, EQUATIONS_MECHANISMS).with_mechanism(*of_ours, 0, form.clone());
    let joint = Assembly::new(joint, MECHANISMS).with_mechanism(*of_joint, 0, form).stepping(1e-4);
    let written = written.rollout(&Thetas::single(&[0.4, 9.0, 20.0, 0.7, 0.2, 0.3, 0.3, 0.0]), &ours, 0..500, Seed(0));
    let joint = joint.rollout(&Thetas::single(&[0.7, 0.4, 9.0, 1.0, 0.2, 0.3, 0.3, 0.0]), &theirs, 0..500, Seed(0));
    let worst = joint[0][0].samples.iter().zip(&written[0][0].samples).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(worst < 1e-3, "{worst} rad");
}

/// A second input, measured, is taken as it is, straight from row to row where it is said to.
#[test]
fn other_inputs_are_taken_as_measured() {
    let mut system = duffing();
    system.inputs.push(InputVariable { name: "w".into(), unit: String::new(), interpolated: true });
    (system.attach, system.rates) = (None, vec![("x".into(), "w".into()), ("v".into(), "t*0 + 1".into())]);
    let time: Vec<f64> = (0..100).map(|i| f64::from(i) * 0.1).collect();
    let columns = [(vec![0.0; 100], false), (time.clone(), true)];
    let recording = Recording { name: String::new(), stimulus: Driving::new(&time, &columns), measured: vec![], time };
    let ours = follow(system, 0.05, &[0.4, 9.0, 20.0, 0.7, 0.0, 0.0], &recording);
    for (x, t) in ours.iter().zip(&recording.time) {
        assert!((x - 0.5 * t * t).abs() < 1e-12);
    }
}

#[test]
fn what_cannot_be_is_told_with_its_place() {
    let told = |change: &dyn Fn(&mut EquationSystem)| {
        let mut system = duffing();
        change(&mut system);
        let error = Equations::new(system, 1e-3).unwrap_err();
        let unknown = error.unknown.map(|(word, _)| format!(" ({word})")).unwrap_or_default();
        format!("{}: {}{unknown}\n  hint: {}", error.place.join("."), error.message, error.hint.unwrap_or_default())
    };
    let changes: [&dyn Fn(&mut EquationSystem); 17] = [
        &|s| s.states[0].name = "sin".into(),
        &|s| s.states[0].name = "2x".into(),
        &|s| s.parameters[0].name = "x".into(),
        &|s| s.states.clear(),
        &|s| s.inputs.clear(),
        &|s| s.outputs.clear(),
        &|s| s.rates.truncate(1),
        &|s| s.rates[0].0 = "y".into(),
        &|s| s.rates[1].1 = "(u - dd*v)/m".into(),
        &|s| s.rates[1].1 = "(u - d*v/m".into(),
        &|s| s.definitions[1].1 = "spring*x".into(),
        &|s| s.definitions[1].1 = "q*x".into(),
        &|s| s.outputs[0].expression = "x + u".into(),
        &|s| s.attach.as_mut().unwrap().position = "q".into(),
        &|s| s.attach.as_mut().unwrap().velocity = "x".into(),
        &|s| s.attach.as_mut().unwrap().inertia = "m*x".into(),
        &|s| s.discrete = true,
    ];
    insta::assert_snapshot!(changes.map(told).join("\n"));
}

#[test]
fn what_is_not_finite_at_the_start_is_found() {
    let of = |rate: &str, output: &str| {
        let mut system = duffing();
        system.rates[1].1 = rate.into();
        system.outputs[0].expression = output.into();
        Equations::new(system, 1e-3).unwrap().not_finite_at_start(&[1.0])
    };
    assert_eq!(of("u/x", "x").as_deref(), Some("v"));
    assert_eq!(of("u", "sqrt(x - 1)").as_deref(), Some("y"));
    assert_eq!(of("u", "x"), None);
}

#[test]
fn units_of_mechanisms_follow_from_what_moves() {
    let of = |position: &str, velocity: &str, declared: &str| {
        let mut system = duffing();
        (system.states[0].unit, system.states[1].unit) = (velocity.into(), position.into());
        Equations::new(system, 1e-3).unwrap().unit(declared)
    };
    assert_eq!(of("m", "m/s", "N m"), "N");
    assert_eq!(of("rad", "rad/s", "N m s/rad"), "N m s/rad");
    assert_eq!(of("V", "V/s", "N m"), "V/s/s");
    assert_eq!(of("V", "", "N m/rad"), "(V/s/s)/V");
    assert_eq!(of("V", "V/s", "command"), "V");
}
