//! Environments of robots: against Gymnasium, against physics, and against the contract of all environments.
#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use serde::Deserialize;
use trueup::rl::{Actions, Buffers, EnvError, Options, Space, Threads, VecEnv, Which, check_env};
use trueup::robot::env::{Randomization, cart_pole_env};
use trueup::robot::{CART_POLE_MECHANISMS, CartPole, ENVIRONMENTS, Integration};
use trueup::sim2real::randomize::{Distribution, Level, Randomized, Randomizer, Redraw, Target};
use trueup::sim2real::{Assembly, Mechanism, Simulator};

const CART_POLE: &str = "trueup/CartPole-v0";
const PENDULUM: &str = "trueup/Pendulum-v0";
const SERVO: &str = "trueup/Servo-v0";

fn make(id: &str, lanes: usize, options: &Options) -> Result<Box<dyn VecEnv>, EnvError> {
    (ENVIRONMENTS.iter().find(|entry| entry.id == id).unwrap().make)(lanes, options)
}

/// An environment under way, with all that it gives out.
struct Play {
    env: Box<dyn VecEnv>,
    out: Buffers,
}

impl Play {
    fn new(id: &str, lanes: usize, options: &Options) -> Self {
        let env = make(id, lanes, options).unwrap();
        Self { out: Buffers::of(&*env), env }
    }

    fn reset(&mut self, seed: u64, options: &Options) -> &mut Self {
        let seeds: Vec<u64> = (0..self.env.lanes() as u64).map(|lane| seed + lane).collect();
        self.env.reset(Which::All, Some(&seeds), options, &mut self.out.observations).unwrap();
        self
    }

    /// A step by the same action in every lane.
    fn step(&mut self, action: f64) {
        let lanes = self.env.lanes();
        match self.env.about().action {
            Space::Box(_) => self.env.step(Actions::Continuous(&vec![action as f32; lanes]), &mut self.out.out()),
            _ => self.env.step(Actions::Discrete(&vec![action as i64; lanes]), &mut self.out.out()),
        }
        .unwrap();
    }

    fn info(&self, name: &str) -> Vec<f64> {
        let mut values = vec![f64::NAN; self.env.lanes()];
        self.env.info(self.env.about().channel(name).unwrap(), &mut values);
        values
    }

    fn privileged(&self, name: &str) -> Vec<f64> {
        let mut values = vec![f64::NAN; self.env.lanes()];
        let place = self.env.about().privileged.iter().position(|one| one.name == name).unwrap();
        self.env.privileged(place, &mut values);
        values
    }
}

#[derive(Deserialize)]
struct Golden {
    cart_pole: Vec<Trajectory>,
    pendulum: Vec<Trajectory>,
}

#[derive(Deserialize)]
struct Trajectory {
    #[serde(default)]
    start: f64,
    rows: Vec<Row>,
}

#[derive(Deserialize)]
struct Row {
    action: f64,
    state: Vec<f64>,
    reward: f64,
    #[serde(default)]
    terminated: bool,
}

fn golden() -> Golden {
    serde_json::from_str(include_str!("gymnasium.json")).unwrap()
}

/// Follows Gymnasium's trajectories in 11 lanes: whole blocks of lanes, and a part of one.
fn follow(id: &str, trajectories: &[Trajectory], options: &Options, start: impl Fn(f64) -> Options) {
    for trajectory in trajectories {
        let mut play = Play::new(id, 11, options);
        play.reset(0, &start(trajectory.start));
        for (k, row) in trajectory.rows.iter().enumerate() {
            play.step(row.action);
            let about = play.env.about();
            // Where sensors tell the truth, there is no other beside it.
            let states: Vec<Vec<f64>> = match about.info.get(..row.state.len()) {
                Some(truth) => truth.iter().map(|channel| play.info(&channel.name)).collect(),
                None => (0..row.state.len())
                    .map(|k| play.out.observations.chunks_exact(4).map(|row| f64::from(row[k])).collect())
                    .collect(),
            };
            for lane in 0..11 {
                for (theirs, ours) in row.state.iter().zip(&states) {
                    assert!((theirs - ours[lane]).abs() < 1e-6, "{id}, step {k}: {theirs} and {}", ours[lane]);
                }
                assert!((row.reward - play.out.rewards[lane]).abs() < 1e-6);
                assert_eq!((row.terminated, false), (play.out.terminated[lane], play.out.truncated[lane]), "step {k}");
            }
            let seen = match states.as_slice() {
                [angle, spin] => vec![angle[0].cos(), angle[0].sin(), spin[0]],
                all => all.iter().map(|values| values[0]).collect(),
            };
            for (seen, state) in play.out.observations.iter().zip(seen) {
                assert!((f64::from(*seen) - state).abs() < 1e-6, "{id}, step {k}");
            }
        }
    }
}

fn corner(start: f64) -> Options {
    Options::new().with("low", start).with("high", start)
}

fn at_rest(_: f64) -> Options {
    Options::new().with("x_init", 0.0).with("y_init", 0.0)
}

#[test]
fn they_move_as_gymnasiums_do() {
    follow(CART_POLE, &golden().cart_pole, &Options::new(), corner);
    follow(PENDULUM, &golden().pendulum, &Options::new(), at_rest);
}

/// A mechanism that does nothing takes the environment to the path on which any mechanism can be.
#[test]
fn with_mechanisms_that_do_nothing_they_move_as_gymnasiums_do() {
    let twin = Options::new().with("twin", "[[mechanism]]\nname = \"coulomb_friction\"\ntorque = 0.0\n");
    follow(CART_POLE, &golden().cart_pole, &twin, corner);
    follow(PENDULUM, &golden().pendulum, &twin, at_rest);
    let wires = "[[mechanism]]\nname = \"command_delay\"\nseconds = 0.0\n[[mechanism]]\nname = \"noise\"\nstd = 0.0\n";
    follow(CART_POLE, &golden().cart_pole, &Options::new().with("twin", wires), corner);
}

#[test]
fn they_keep_the_contract_of_environments() {
    for entry in ENVIRONMENTS {
        let report = check_env(|lanes| (entry.make)(lanes, &Options::new()), 300).unwrap();
        assert!(report.findings.is_empty(), "{report}");
    }
}

/// What is randomized when an episode begins, within it, and with regimes.
const RANDOMIZED: &str = "
[[mechanism]]
name = \"command_delay\"
seconds = 0.01
[[mechanism]]
name = \"noise\"
std = 0.01
[[randomize.parameter]]
mechanism = \"command_delay\"
parameter = \"seconds\"
distribution = \"uniform\"
low = 0.0
high = 0.05
[[randomize.parameter]]
mechanism = \"noise\"
parameter = \"std\"
distribution = \"log_uniform\"
low = 0.001
high = 0.02
";

const GRAVITY: &str = "
[[randomize.parameter]]
parameter = \"gravity\"
distribution = \"uniform\"
low = 0.8
high = 1.2
relative = true
at = \"startup\"
";

const WITHIN: &str = "
[[randomize.parameter]]
mechanism = \"coulomb_friction\"
parameter = \"torque\"
distribution = \"uniform\"
low = 0.0
high = 0.2
at = { steps = 7 }
[[randomize.parameter]]
mechanism = \"gain_error\"
parameter = \"error\"
distribution = \"uniform\"
low = -0.3
high = -0.1
at = { regime = 1 }
";

/// Laws with memory, draws and clocks of their own.
const LASTING: &str = "
[[mechanism]]
name = \"actuator_lag\"
time_constant = 0.03
[[mechanism]]
name = \"rate_limit\"
rate = 100.0
[[mechanism]]
name = \"backlash\"
gap = 0.01
motor_share = 0.4
[[mechanism]]
name = \"drift\"
rate = 0.01
[[mechanism]]
name = \"observation_delay\"
seconds = 0.013
[[mechanism]]
name = \"dropout\"
probability = 0.1
[[mechanism]]
name = \"noise\"
std = 0.01
correlation_time = 0.1
";

#[test]
fn they_keep_it_with_mechanisms_and_whatever_is_drawn() {
    let documents = [RANDOMIZED.to_owned(), format!("{RANDOMIZED}{WITHIN}"), LASTING.to_owned()];
    for id in [CART_POLE, PENDULUM, SERVO] {
        for text in &documents {
            let gravity = if id == SERVO { "" } else { GRAVITY };
            let options = Options::new().with("twin", format!("{text}{gravity}")).with("regime_seconds", 0.2);
            let report = check_env(|lanes| make(id, lanes, &options), 200).unwrap();
            assert!(report.findings.is_empty(), "{text}\n{report}");
        }
    }
}

/// Cart-poles with a delay and noise, the delay and gravity drawn at random; `more` has another mechanism, which does nothing.
fn wired(more: bool) -> Box<dyn VecEnv> {
    let plant = CartPole::new([1.0, 0.1, 0.5, 9.8, 0.0, 0.0, 10.0], [0.0; 7]);
    let mut assembly = Assembly::new(plant.integrated(Integration::Euler { step: 0.02 }), CART_POLE_MECHANISMS);
    for (id, value) in [("command_delay", 0.03), ("noise", 0.01), ("coulomb_friction", 0.0)] {
        let mechanism: &'static dyn Mechanism<CartPole> =
            *CART_POLE_MECHANISMS.iter().find(|row| row.about().name == id).unwrap();
        let mut parameters = mechanism.forms(&Default::default())[0].parameters.clone();
        parameters[0].nominal = value;
        if more || id != "coulomb_friction" {
            assembly = assembly.with_mechanism(mechanism, 0, parameters);
        }
    }
    let drawn = |place: usize, target: Target, low: f64, high: f64| Randomized {
        target,
        parameter: assembly.parameters()[place].clone(),
        distribution: Distribution::Uniform { low, high },
        relative: false,
        at: Redraw::Reset,
    };
    let randomized =
        vec![drawn(3, Target::own("gravity"), 9.0, 11.0), drawn(7, Target::of("command_delay", "seconds"), 0.0, 0.1)];
    let randomizer = Randomizer::new(randomized, Vec::new()).unwrap();
    let randomization = Randomization { randomizer, places: vec![3, 7], level: Level::FULL, regime_seconds: 1.0 };
    cart_pole_env(13, assembly, Some(randomization), &Options::new().with("sutton_barto_reward", true)).unwrap()
}

/// What is written for the task alone does what the laws do.
#[test]
fn blocks_of_lanes_do_what_the_mechanisms_do() {
    let (mut fast, mut whole) = (wired(false), wired(true));
    let (mut one, mut other) = (Buffers::of(&*fast), Buffers::of(&*whole));
    let seeds: Vec<u64> = (0..13).collect();
    fast.reset(Which::All, Some(&seeds), &Options::new(), &mut one.observations).unwrap();
    whole.reset(Which::All, Some(&seeds), &Options::new(), &mut other.observations).unwrap();
    let mut ended = 0;
    for k in 0..400_usize {
        let apart = one.observations.iter().zip(&other.observations).map(|(a, b)| (a - b).abs());
        assert!(apart.fold(0.0, f32::max) < 1e-6, "step {k}");
        let actions: Vec<i64> = (0..13).map(|lane| ((k * (lane + 3)) / 4 % 2) as i64).collect();
        fast.step(Actions::Discrete(&actions), &mut one.out()).unwrap();
        whole.step(Actions::Discrete(&actions), &mut other.out()).unwrap();
        assert_eq!((&one.terminated, &one.truncated, &one.rewards), (&other.terminated, &other.truncated, &other.rewards));
        let over = one.terminated.clone();
        if over.contains(&true) {
            ended += over.iter().filter(|over| **over).count();
            fast.reset(Which::Mask(&over), None, &Options::new(), &mut one.observations).unwrap();
            whole.reset(Which::Mask(&over), None, &Options::new(), &mut other.observations).unwrap();
        }
    }
    assert!(ended > 50, "{ended} episodes");
}

#[test]
fn threads_change_no_bit() {
    let options = Options::new().with("twin", format!("{LASTING}{WITHIN}"));
    for id in [CART_POLE, PENDULUM, SERVO] {
        let mut whole = Play::new(id, 13, &options);
        let threads = Threads::new(13, 4, |lanes| make(id, lanes, &options)).unwrap();
        let mut split = Play { out: Buffers::of(&threads), env: Box::new(threads) };
        whole.reset(5, &Options::new());
        split.reset(5, &Options::new());
        for k in 0..40 {
            assert_eq!(whole.out, split.out, "{id}, step {k}");
            let action = f64::from(k % 3 == 0);
            whole.step(action);
            split.step(action);
        }
    }
}

#[test]
fn a_delay_of_two_steps_is_one() {
    let delayed = Options::new().with("twin", "[[mechanism]]\nname = \"command_delay\"\nseconds = 0.04\n");
    let actions: Vec<f64> = (0..40).map(|k| f64::from(u8::from(k * k % 7 < 3))).collect();
    let (mut plain, mut late) = (Play::new(CART_POLE, 3, &Options::new()), Play::new(CART_POLE, 3, &delayed));
    plain.reset(1, &Options::new());
    late.reset(1, &Options::new());
    for k in 0..20_usize {
        // Before its first command a lane has had that for ever.
        plain.step(actions[k.saturating_sub(2)]);
        late.step(actions[k]);
        assert_eq!(plain.out.observations, late.out.observations, "step {k}");
    }
}

#[test]
fn every_lane_has_parameters_of_its_own_and_they_are_told() {
    let options = Options::new().with("twin", format!("{RANDOMIZED}{GRAVITY}"));
    for id in [CART_POLE, PENDULUM] {
        let mut play = Play::new(id, 50, &options);
        play.reset(3, &Options::new());
        let (gravity, delay) = (play.privileged("gravity"), play.privileged("command_delay.seconds"));
        for (values, [low, high]) in [(&gravity, [7.8, 12.0]), (&delay, [0.0, 0.05])] {
            assert!(values.iter().all(|v| (low..=high).contains(v)), "{values:?}");
            assert!((1..50).all(|lane| values[lane] != values[lane - 1]));
        }
        play.env.reset(Which::All, None, &Options::new(), &mut play.out.observations).unwrap();
        assert_eq!(play.privileged("gravity"), gravity);
        assert!(play.privileged("command_delay.seconds").iter().zip(&delay).all(|(a, b)| a != b));
        // Lane 1 of seed 3 is lane 0 of seed 4; nothing is drawn at level 0.
        let mut other = Play::new(id, 2, &options);
        assert_eq!(other.reset(4, &Options::new()).privileged("gravity")[0], gravity[1]);
        other.reset(4, &Options::new().with("level", 0.0));
        assert_eq!(other.privileged("command_delay.seconds"), [0.01; 2]);
    }
}

#[test]
fn parameters_change_within_an_episode_and_with_regimes() {
    let options = Options::new().with("twin", WITHIN).with("regime_seconds", 0.3).with("mechanisms", false);
    let mut play = Play::new(SERVO, 20, &options);
    play.reset(0, &Options::new());
    let mut before = play.privileged("coulomb_friction.torque");
    let (mut in_second, mut in_none) = (0, 0);
    for k in 1..=200 {
        play.step(0.3);
        let now = play.privileged("coulomb_friction.torque");
        assert_eq!(now.iter().zip(&before).filter(|(a, b)| a != b).count(), if k % 7 == 0 { 20 } else { 0 }, "step {k}");
        before = now;
        for (regime, error) in play.info("regime").into_iter().zip(play.privileged("gain_error.error")) {
            assert_eq!(error != 0.0, regime == 1.0);
            in_second += u32::from(regime == 1.0);
            in_none += u32::from(regime == -1.0);
        }
    }
    // Three states, each as likely; the first is none.
    assert!((800..2_000).contains(&in_second) && (900..2_200).contains(&in_none), "{in_second}, {in_none}");
}

/// Semi-implicit Euler conserves an energy near the true one: without torque it stays within a band, however long it swings.
#[test]
fn a_pendulum_without_torque_keeps_its_energy() {
    let mut play = Play::new(PENDULUM, 4, &Options::new().with("max_steps", 20_000.0));
    play.reset(2, &Options::new().with("x_init", 3.0).with("y_init", 1.0));
    let energy = |play: &Play| -> Vec<f64> {
        let (angle, spin) = (play.info("true_angle"), play.info("true_angular_velocity"));
        angle.iter().zip(spin).map(|(q, w)| w * w / 6.0 + 5.0 * q.cos()).collect()
    };
    let (mut low, mut high) = (vec![f64::INFINITY; 4], vec![f64::NEG_INFINITY; 4]);
    let mut halves = Vec::new();
    for k in 0..10_000 {
        play.step(0.0);
        for (lane, now) in energy(&play).into_iter().enumerate() {
            low[lane] = low[lane].min(now);
            high[lane] = high[lane].max(now);
        }
        if k == 4_999 {
            halves = low.iter().chain(&high).copied().collect();
        }
    }
    // The band of the second half is that of the first: nothing drifts.
    for (first, both) in halves.iter().zip(low.iter().chain(&high)) {
        assert!((first - both).abs() < 0.05, "{first} and {both} J");
    }
    assert!(low.iter().zip(&high).all(|(low, high)| high - low < 2.0));
}

#[test]
fn friction_holds_a_servo_and_heat_weakens_it() {
    let friction = "[[mechanism]]\nname = \"coulomb_friction\"\ntorque = 0.5\n";
    let mut stuck = Play::new(SERVO, 3, &Options::new().with("twin", friction));
    stuck.reset(0, &Options::new().with("furthest", 0.1));
    let start = stuck.info("true_position");
    (0..50).for_each(|_| stuck.step(0.2));
    assert_eq!(stuck.info("true_position"), start);
    stuck.step(0.9);
    assert!(stuck.info("true_position").iter().zip(&start).all(|(now, start)| now > start));

    let mut warm = Play::new(SERVO, 2, &Options::new().with("sense_heat", true));
    warm.reset(0, &Options::new());
    let mut heat = 0.0;
    for _ in 0..400 {
        warm.step(1.0);
        let now = warm.out.observations[5];
        assert!(now > heat);
        heat = now;
    }
    // strength time_constant (1 - exp(-t / time_constant)) after 8 s.
    assert!((f64::from(heat) - 0.51 * (1.0 - (-8.0_f64 / 30.0).exp())).abs() < 1e-6, "{heat}");
    assert!((warm.info("arriving_command")[0] - (1.0 - f64::from(heat))).abs() < 1e-3);
}

#[test]
fn a_servo_is_paid_by_the_formula_it_states() {
    let options = Options::new().with("mechanisms", false).with("effort_weight", 0.5).with("change_weight", 0.25);
    let mut play = Play::new(SERVO, 2, &options);
    play.reset(7, &Options::new());
    let mut before = 0.0;
    for action in [0.5, -0.25, -0.25, 1.0_f64] {
        play.step(action);
        let change: f64 = action - before;
        for lane in 0..2 {
            let error = play.info("set_point")[lane] - play.info("true_position")[lane];
            let reward = -(error * error + 0.5 * action * action + 0.25 * change * change);
            assert!((play.out.rewards[lane] - reward).abs() < 1e-12);
        }
        before = action;
    }
}

/// Where inflow and outflow are the same, `(pump_gain u / lower_outflow)^2`; and no level is above the rim.
#[test]
fn tanks_settle_where_inflow_is_outflow_and_do_not_run_over_their_rims() {
    let mut play = Play::new("trueup/Tanks-v0", 2, &Options::new());
    play.reset(0, &Options::new());
    (0..400).for_each(|_| play.step(0.6));
    assert!((play.info("lower_level")[0] - (0.03 * 3.0 / 0.05_f64).powi(2)).abs() < 1e-3);
    let mut full = Play::new("trueup/Tanks-v0", 2, &Options::new().with("range", 50.0));
    full.reset(0, &Options::new());
    (0..100).for_each(|_| full.step(1.0));
    assert_eq!((full.info("upper_level"), full.info("lower_level")), (vec![10.0; 2], vec![10.0; 2]));
    let crossed = Options::new().with("lowest", 3.0).with("highest", 2.0);
    let error = make("trueup/Tanks-v0", 1, &crossed).unwrap_err().to_string();
    assert!(error.contains("no larger than `highest`"), "{error}");
}

#[test]
fn a_twin_of_a_joint_is_the_servo() {
    let twin = "[twin]\nmodel = \"joint\"\n[parameters]\ninertia = 0.1\nviscous_friction = 0.0\ngain = 2.0\n\
                [channels]\nposition = { column = \"x\", unit = \"m\" }\ncommand = { column = \"u\" }\n";
    let mut play = Play::new(SERVO, 1, &Options::new().with("twin", twin));
    assert_eq!(play.env.about().observation.units[..2], ["m", "m/s"]);
    play.reset(0, &Options::new());
    (0..50).for_each(|_| play.step(0.5));
    // 1 N on 0.1 kg for 1 s.
    assert!((play.info("true_velocity")[0] - 10.0).abs() < 1e-9);
}

#[test]
fn what_cannot_be_is_refused_with_the_remedy() {
    let refused = |id: &str, options: Options| make(id, 1, &options).unwrap_err().to_string();
    let text = refused(CART_POLE, Options::new().with("twin", "[[mechanism]]\nname = \"comand_delay\"\nseconds = 0.1\n"));
    assert!(text.contains("there is no mechanism `comand_delay`") && text.ends_with("hint: did you mean `command_delay`?"));
    let text = refused(SERVO, Options::new().with("twin", "[[mechanism\n"));
    assert!(text.starts_with("option `twin` is a text with a mistake (twin:1:") && text.contains("\nhint: "), "{text}");
    let text = refused(PENDULUM, Options::new().with("twin", "[parameters]\nmass = 2.0\n"));
    assert!(text.contains("a twin cannot tell its parameters") && text.contains("set `g`"), "{text}");
    let text = refused(CART_POLE, Options::new().with("twin", "[twin]\nmodel = \"joint\"\n"));
    assert!(text.contains("expected the model `cart_pole`"), "{text}");
    let text = refused(SERVO, Options::new().with("sense_heat", true).with("mechanisms", false));
    assert!(text.contains("thermal_derating"), "{text}");
    let controlled = "[twin]\nmodel = \"joint\"\n[parameters]\ninertia = 0.1\nviscous_friction = 0.1\n\
                      [controller]\nkind = \"pid\"\nkp = 3.0\n";
    assert!(refused(SERVO, Options::new().with("twin", controlled)).contains("the agent is the controller"));
    assert!(refused(SERVO, Options::new().with("gravity", 3.0)).contains("`trueup/Servo-v0` has no option `gravity`"));
    assert!(matches!(make(SERVO, 0, &Options::new()), Err(EnvError::NoLanes)));
    let mut play = Play::new(CART_POLE, 2, &Options::new());
    let crossed = Options::new().with("low", 0.1).with("high", -0.1);
    let error = play.env.reset(Which::All, Some(&[0, 1]), &crossed, &mut play.out.observations).unwrap_err();
    assert!(error.to_string().contains("no larger than `high`"), "{error}");
}
