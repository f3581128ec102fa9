//! An actuator that follows its command with a lag.

use super::decay::Decay;
use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Plant, Seed, Site, Thetas, Tick, Typical};

/// `time_constant du/dt = u_command - u`; in the form `two_stage`, two such lags of half of `total_time` each, one after the
/// other: a filter, then a winding; in the form `two_poles` the two have each a time constant of its own.
///
/// A recording does not tell what was in force before its first command: by these the same, as where it is cut out of what went
/// on; in the forms `from_rest` (one lag, of `lag_time`) and `two_poles_from_rest` nothing, as where a driver is switched on with it.
///
/// Solved exactly over a tick for a command that holds; what the plant gets is the mean over the tick.
///
/// Source: first-order actuator, Åström & Murray, *Feedback Systems* (2nd ed. 2021), section 3.3.
#[derive(Debug, Clone, Copy)]
pub struct ActuatorLag {
    /// The longest time constant, as its domain bounds it [s].
    pub longest: f64,
    /// Where fits begin [s].
    pub starts: &'static [f64],
}

impl<P: Plant> Mechanism<P> for ActuatorLag
where
    P::Command: AsMut<f64>,
{
    fn about(&self) -> About {
        About {
            name: "actuator_lag",
            site: Site::Command,
            title: "a lag of the actuator",
            law: "time_constant du/dt = u_command - u; two_stage: twice, with half of total_time each; two_poles: twice; from_rest: from u = 0",
            source: "Åström & Murray, Feedback Systems (2021), 3.3",
            remedy: "measure the actuator's step response; add the lag to the simulator",
            contains: &[],
        }
    }

    fn forms(&self, _typical: &Typical) -> Vec<Form> {
        let lasting = |name, starts: &[f64]| Parameter::new(name, "s", 0.0).within(0.0, self.longest).starting_at(starts);
        let time = |name| lasting(name, self.starts);
        let shorter = |name| lasting(name, &[0.5 * self.starts[0]]);
        vec![
            Form { name: "first_order", parameters: vec![time("time_constant")] },
            Form { name: "two_stage", parameters: vec![time("total_time")] },
            Form { name: "two_poles", parameters: vec![time("slow_time_constant"), shorter("fast_time_constant")] },
            Form { name: "from_rest", parameters: vec![time("lag_time")] },
            Form { name: "two_poles_from_rest", parameters: vec![time("slow_lag_time"), shorter("fast_lag_time")] },
        ]
    }

    fn law(&self, form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<P>> {
        let before = if form < FROM_REST { None } else { Some(0.0) };
        let lag =
            |time_constant| Lag { time_constant, before, follower: vec![before; thetas.lanes()], decay: Decay::default() };
        let half = || thetas.row(0).iter().map(|time| 0.5 * time).collect();
        match form {
            1 => Box::new(Stages { first: lag(half()), second: lag(half()), alike: true }),
            0 | FROM_REST => Box::new(lag(thetas.row(0).to_vec())),
            _ => {
                let [first, second] = [0, 1].map(|k| lag(thetas.row(k).to_vec()));
                Box::new(Stages { first, second, alike: false })
            }
        }
    }
}

/// The forms from this one on have an actuator that gave nothing before its first command.
const FROM_REST: usize = 3;

#[derive(Clone)]
struct Lag {
    time_constant: Vec<f64>,
    /// What it gave before the first command; none where it had already reached that.
    before: Option<f64>,
    /// What it gives at the start of the tick.
    follower: Vec<Option<f64>>,
    decay: Decay,
}

impl<P: Plant> Law<P> for Lag
where
    P::Command: AsMut<f64>,
{
    fn change(&mut self, change: &LaneChange<'_>) {
        self.change_by(change, |values| values[0]);
    }

    fn shape(&mut self, tick: Tick, commands: &mut [P::Command]) {
        let gained = self.decay.over(tick.step, &self.time_constant);
        let lanes = commands.iter_mut().zip(&self.time_constant).zip(&mut self.follower).zip(gained);
        for (((command, tau), follower), gained) in lanes {
            let u = command.as_mut();
            let start = follower.unwrap_or(*u);
            let end = start + (*u - start) * gained;
            *follower = Some(end);
            if *tau > 0.0 && tick.step > 0.0 {
                *u += (start - *u) * gained * tau / tick.step;
            }
        }
    }
}

impl Lag {
    /// Changes a lane, whose time constant follows from its parameters by `of`.
    fn change_by(&mut self, change: &LaneChange<'_>, of: impl Fn(&[f64]) -> f64) {
        change.derived(&mut self.time_constant, of);
        change.memory_from(&mut self.follower, &self.before);
        self.decay.change(change, &self.time_constant);
    }
}

/// Two stages, of which the second follows the first.
#[derive(Clone)]
struct Stages {
    first: Lag,
    second: Lag,
    /// Whether both have half of one time constant.
    alike: bool,
}

impl<P: Plant> Law<P> for Stages
where
    P::Command: AsMut<f64>,
{
    fn change(&mut self, change: &LaneChange<'_>) {
        let alike = self.alike;
        self.first.change_by(change, |values| if alike { 0.5 * values[0] } else { values[0] });
        self.second.change_by(change, |values| if alike { 0.5 * values[0] } else { values[1] });
    }

    fn shape(&mut self, tick: Tick, commands: &mut [P::Command]) {
        let Self { first, second, .. } = self;
        let gained =
            (first.decay.over(tick.step, &first.time_constant), second.decay.over(tick.step, &second.time_constant));
        for (lane, command) in commands.iter_mut().enumerate() {
            let u = command.as_mut();
            let stages = [(first.time_constant[lane], gained.0[lane]), (second.time_constant[lane], gained.1[lane])];
            let starts = [first.follower[lane].unwrap_or(*u), second.follower[lane].unwrap_or(*u)];
            first.follower[lane] = Some(starts[0] + (*u - starts[0]) * gained.0[lane]);
            let (end, mean) = two_stages(*u, starts, stages, tick.step);
            second.follower[lane] = Some(end);
            *u = mean;
        }
    }
}

/// What the second of two lags gives at the end of a tick, and in the mean over it, for a command `u` that holds; of each its
/// time constant [s] and how much of a step it gains over the tick.
///
/// The first is off by `x exp(-t / a)` from the command, the second by `y exp(-t / b) + x a / (a - b) (exp(-t / a) - exp(-t / b))`.
fn two_stages(u: f64, starts: [f64; 2], [(a, gained_a), (b, gained_b)]: [(f64, f64); 2], step: f64) -> (f64, f64) {
    let [x, y] = starts.map(|start| start - u);
    // How much of an error is left after the tick, and in the mean over it.
    let left = |tau: f64, gained: f64| if tau > 0.0 { (1.0 - gained, gained * tau / step) } else { (0.0, 0.0) };
    if step <= 0.0 {
        return (starts[1], starts[1]);
    }
    let (of_a, of_b) = (left(a, gained_a), left(b, gained_b));
    let (passed_end, passed_mean) = if (a - b).abs() > ALIKE * a.max(b) {
        let share = a / (a - b);
        (share * (of_a.0 - of_b.0), share * (a * gained_a - b * gained_b) / step)
    } else if a > 0.0 {
        (step / a * of_a.0, of_a.1 - of_a.0)
    } else {
        (0.0, 0.0)
    };
    (u + y * of_b.0 + x * passed_end, u + y * of_b.1 + x * passed_mean)
}

/// Two time constants that differ by less than this part count as one: their difference has too few digits.
const ALIKE: f64 = 1e-6;

#[cfg(test)]
mod tests {
    use super::super::wire::shaped;
    use super::*;

    const LAG: ActuatorLag = ActuatorLag { longest: 2.0, starts: &[0.01, 0.05] };

    /// Two poles answer a step by `1 - (a exp(-t/a) - b exp(-t/b)) / (a - b)`, as two lags in a row do, and as one where the
    /// other is at once.
    #[test]
    fn two_poles_answer_as_two_lags_in_a_row() {
        let (a, b, step) = (0.05, 0.02, 1e-4);
        let commands: Vec<f64> = (0..2_001).map(|k| if k == 0 { 0.0 } else { 1.0 }).collect();
        let out = shaped(&LAG, 2, &[&[a, b], &[b, a], &[a, 0.0]], step, &commands);
        for k in [101_usize, 501, 1_001, 2_000] {
            // The mean over a tick of the answer to what began with tick 1.
            let t = (k as f64 - 0.5) * step;
            let exact = 1.0 - (a * (-t / a).exp() - b * (-t / b).exp()) / (a - b);
            assert!((out[0][k] - exact).abs() < 1e-5 && (out[1][k] - exact).abs() < 1e-5, "{k}: {} not {exact}", out[0][k]);
        }
        let half = shaped(&LAG, 1, &[&[2.0 * b]], step, &commands);
        assert_eq!(half, shaped(&LAG, 2, &[&[b, b]], step, &commands));
        let one = &shaped(&LAG, 0, &[&[a]], step, &commands)[0];
        assert!(out[2].iter().zip(one).all(|(two, one)| (two - one).abs() < 1e-12));
    }

    /// From rest the first command is answered as a step from nothing; where it was in force before, by itself.
    #[test]
    fn what_begins_at_rest_follows_its_first_command() {
        let (a, b, step) = (0.05, 0.02, 0.01);
        let stepped: Vec<f64> = (0..101).map(|k| if k == 0 { 0.0 } else { 1.0 }).collect();
        for (form, before, thetas) in [(3, 0, &[a][..]), (4, 2, &[a, b])] {
            let out = &shaped(&LAG, form, &[thetas], step, &stepped[1..])[0];
            let after_a_zero = &shaped(&LAG, before, &[thetas], step, &stepped)[0][1..];
            assert!(out.iter().zip(after_a_zero).all(|(own, other)| (own - other).abs() < 1e-12), "form {form}");
            assert_eq!(shaped(&LAG, before, &[thetas], step, &stepped[1..])[0], stepped[1..]);
        }
    }
}
