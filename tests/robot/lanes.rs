//! Lanes of an assembly, each a run of its own.

use trueup::robot::{Axis, Joint, MECHANISMS, Motion, Signal};
use trueup::sim2real::{Assembly, LaneRun, LoopIsClosed, Parameter, Pid, Seed, Ticks};

fn joint() -> Assembly<Joint> {
    Assembly::new(Joint::new(Axis::Rotary, [0.1, 0.2, 0.0, 1.0], [0.0; 4]), MECHANISMS)
}

#[test]
fn the_agent_is_the_controller() {
    let closed = joint().controlled_by(Pid::new([]));
    assert!(LaneRun::new(&closed, 2, &[0.0, 0.0]).is_ok(), "a controller without gains has no part in it");
    let closed = closed.controlled_by(Pid::new([Parameter::new("kp", "", 3.0)]));
    assert_eq!(LaneRun::new(&closed, 2, &[0.0, 0.0]).unwrap_err(), LoopIsClosed);
}

#[test]
fn each_lane_has_its_own_command_state_and_parameters() {
    let mut run = LaneRun::new(&joint(), 2, &[0.0, 0.0]).unwrap();
    run.begin(0, &[0.1, 0.0, 0.0, 1.0], Motion::default(), Seed(0));
    run.begin(1, &[0.2, 0.0, 0.0, 1.0], Motion { position: 1.0, velocity: 0.0 }, Seed(1));
    for k in 0..100 {
        let time = f64::from(k) * 1e-3;
        run.step(Ticks { step: 1e-3, times: &[time, time] }, &[Signal(1.0), Signal(-1.0)]);
    }
    let [first, second] = run.states() else { panic!("two lanes") };
    assert!((first.velocity - 1.0).abs() < 1e-12 && (second.velocity + 0.5).abs() < 1e-12);
    assert!((first.position - 0.05).abs() < 1e-12 && (second.position - 0.975).abs() < 1e-12);
}

#[test]
fn what_a_law_tells_of_itself_is_of_its_lane() {
    let (row, mechanism) = MECHANISMS.iter().enumerate().find(|(_, row)| row.about().name == "thermal_derating").unwrap();
    let parameters = mechanism.forms(&Default::default())[0].parameters.clone();
    let mut run = LaneRun::new(&joint().with_mechanism(MECHANISMS[row], 0, parameters), 2, &[0.0, 0.0]).unwrap();
    for (lane, strength) in [(0, 0.1), (1, 0.0)] {
        run.begin(lane, &[0.1, 0.2, 0.0, 1.0, strength, f64::INFINITY], Motion::default(), Seed(0));
    }
    for k in 0..1_000 {
        let time = f64::from(k) * 1e-3;
        run.step(Ticks { step: 1e-3, times: &[time, time] }, &[Signal(1.0), Signal(1.0)]);
    }
    assert!((run.told("thermal_derating", 0).unwrap() - 0.1).abs() < 1e-9);
    assert_eq!((run.told("thermal_derating", 1), run.told("backlash", 0)), (Some(0.0), None));
}
