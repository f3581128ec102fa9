//! An actuator whose output cannot change as fast as its command.

use super::decay::gained;
use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Plant, Seed, Site, Thetas, Tick, Typical};

/// `|du/dt| <= rate`: the output ramps towards a command that holds until it reaches it.
///
/// The ramp is solved exactly; what arrives in a tick is its mean over the tick, which is differentiable in the rate
/// although ticks and the moments at which the command is reached do not fall together.
///
/// A recording does not tell what was in force before its first command: with `rate` that command, as where it is cut out of what
/// went on; in the form `from_rest`, with `slew_rate`, nothing, as where a driver is switched on with it.
///
/// A limit within a loop is met by its error: in the forms `answering` and `answering_from_rest`,
/// `du/dt = (u_command - u) / answer_time` as far as that is within `rate`, so that small changes are followed with a lag. It is
/// the lag of the limited loop itself, and short: a longer one is an `actuator_lag` beside the limit.
///
/// Source: Klyde, McRuer & Myers, "Pilot-induced oscillation analysis and prediction with actuator rate limiting", Journal
/// of Guidance, Control, and Dynamics 20 (1997).
#[derive(Debug, Clone, Copy)]
pub struct RateLimit;

impl<P: Plant> Mechanism<P> for RateLimit
where
    P::Command: AsMut<f64>,
{
    fn about(&self) -> About {
        About {
            name: "rate_limit",
            site: Site::Command,
            title: "a limit to how fast the actuator's output changes",
            law: "|du/dt| <= rate; answering: du/dt = (u_command - u) / answer_time within that; from_rest: from u = 0",
            source: "Klyde, McRuer & Myers, Journal of Guidance, Control, and Dynamics 20 (1997)",
            remedy: "look for a ramp set in the drive; command no faster changes, or limit their rate in the simulator too",
            contains: &[],
        }
    }

    fn forms(&self, typical: &Typical) -> Vec<Form> {
        // From a typical command in a fiftieth of a second to one in a second.
        let starts = [50.0, 15.0, 4.0, 1.0].map(|per_second| per_second * typical.command);
        let rate = |name| {
            let rate = Parameter::new(name, "command/s", f64::INFINITY).within(0.0, f64::INFINITY);
            vec![rate.starting_at(&starts)]
        };
        let answer =
            Parameter::new("answer_time", "s", 0.0).within(0.0, LONGEST_ANSWER).starting_at(&[0.3 * LONGEST_ANSWER]);
        let within_a_loop = |name| rate(name).into_iter().chain([answer.clone()]).collect();
        let mut forms = Form::only(rate("rate"));
        forms.push(Form { name: "from_rest", parameters: rate("slew_rate") });
        forms.push(Form { name: "answering", parameters: within_a_loop("rate") });
        forms.push(Form { name: "answering_from_rest", parameters: within_a_loop("slew_rate") });
        forms
    }

    fn general(&self, form: usize) -> bool {
        form >= ANSWERING
    }

    /// Long enough for a ramp of some steepness to reach its command, after which all that was before is forgotten.
    fn memory(&self) -> f64 {
        4.0
    }

    fn law(&self, form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<P>> {
        let before = if form.is_multiple_of(2) { None } else { Some(0.0) };
        let ramp = Ramp { rate: thetas.row(0).to_vec(), before, output: vec![before; thetas.lanes()] };
        if form < ANSWERING {
            return Box::new(ramp);
        }
        Box::new(Answering { ramp, answer_time: thetas.row(1).to_vec() })
    }
}

/// The forms from this one on are of a limit within a loop.
const ANSWERING: usize = 2;
/// The slowest answer of such a loop [s].
const LONGEST_ANSWER: f64 = 0.01;

#[derive(Clone)]
struct Ramp {
    rate: Vec<f64>,
    /// What the actuator gave before the first command; none where it had already reached that.
    before: Option<f64>,
    /// What it gives at the start of the tick.
    output: Vec<Option<f64>>,
}

impl<P: Plant> Law<P> for Ramp
where
    P::Command: AsMut<f64>,
{
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.rate);
        change.memory_from(&mut self.output, &self.before);
    }

    fn shape(&mut self, tick: Tick, commands: &mut [P::Command]) {
        for ((command, rate), output) in commands.iter_mut().zip(&self.rate).zip(&mut self.output) {
            let u = command.as_mut();
            let start = output.unwrap_or(*u);
            let (way, most) = (*u - start, rate * tick.step);
            if tick.step <= 0.0 || way == 0.0 {
                *output = Some(*u);
            } else if way.abs() >= most {
                *output = Some(start + most.copysign(way));
                *u = start + (0.5 * most).copysign(way);
            } else {
                *output = Some(*u);
                // Short of the command by a triangle as high as the way and as long as the ramp.
                *u -= 0.5 * way * (way.abs() / most);
            }
        }
    }
}

/// A ramp towards a command that is slowed down where it comes near.
#[derive(Clone)]
struct Answering {
    ramp: Ramp,
    answer_time: Vec<f64>,
}

impl<P: Plant> Law<P> for Answering
where
    P::Command: AsMut<f64>,
{
    fn change(&mut self, change: &LaneChange<'_>) {
        Law::<P>::change(&mut self.ramp, change);
        change.parameter(1, &mut self.answer_time);
    }

    fn shape(&mut self, tick: Tick, commands: &mut [P::Command]) {
        let Ramp { rate, output, .. } = &mut self.ramp;
        let lanes = commands.iter_mut().zip(rate).zip(&self.answer_time).zip(output);
        for (((command, rate), answer_time), output) in lanes {
            let u = command.as_mut();
            let start = output.unwrap_or(*u);
            let [left, mean] = left_over(*u - start, *rate, *answer_time, tick.step);
            *output = Some(*u - left);
            *u -= mean;
        }
    }
}

/// What is left of the way `error` to a command that holds, after `step` [s] and on average over it.
///
/// First it goes at the full rate, until it has come as near as the loop answers within that; then it decays.
fn left_over(error: f64, rate: f64, answer_time: f64, step: f64) -> [f64; 2] {
    let way = error.abs();
    if way == 0.0 || step <= 0.0 {
        return [0.0; 2];
    }
    let near = if answer_time > 0.0 { rate * answer_time } else { 0.0 };
    let ramping = if way > near { ((way - near) / rate).min(step) } else { 0.0 };
    let (ramped, gained) =
        if ramping < step { (way.min(near), gained(step - ramping, answer_time)) } else { (way - rate * step, 0.0) };
    let sum = 0.5 * (way + ramped) * ramping + ramped * answer_time * gained;
    [ramped * (1.0 - gained), sum / step].map(|left| left.copysign(error))
}

#[cfg(test)]
mod tests {
    use super::super::wire::shaped;
    use super::*;

    #[test]
    fn a_step_becomes_a_ramp_and_each_tick_has_its_mean() {
        let step = 0.1;
        let commands: Vec<f64> = (0..20).map(|i| if i == 0 { 0.0 } else { 1.0 }).collect();
        let out = shaped(&RateLimit, 0, &[&[3.0], &[-0.0], &[f64::INFINITY], &[1e9]], step, &commands);
        // From tick 1 on the output is min(3 (t - 0.1), 1), which reaches 1 a third of the way through tick 4.
        let ramp = |t: f64| (3.0 * (t - step)).clamp(0.0, 1.0);
        for (i, got) in out[0].iter().enumerate() {
            let fine = 10_000;
            let mean: f64 =
                (0..fine).map(|k| ramp((i as f64 + (k as f64 + 0.5) / fine as f64) * step)).sum::<f64>() / fine as f64;
            assert!((got - mean).abs() < 1e-7, "tick {i}: {got}, not {mean}");
        }
        assert_eq!(out[1], vec![0.0; 20]);
        assert_eq!(out[2], commands);
        assert!(out[3].iter().zip(&commands).all(|(got, command)| (got - command).abs() < 1e-7));
    }

    #[test]
    fn what_begins_at_rest_climbs_to_its_first_command() {
        let out = shaped(&RateLimit, 1, &[&[2.0], &[f64::INFINITY]], 0.25, &[1.0; 4]);
        assert_eq!(out, [[0.25, 0.75, 1.0, 1.0], [1.0; 4]]);
        assert_eq!(shaped(&RateLimit, 0, &[&[2.0]], 0.25, &[1.0; 4]), [[1.0; 4]]);
    }

    /// Integrated in 10,000 steps a tick.
    #[test]
    fn within_a_loop_it_goes_at_the_full_rate_until_it_is_near_and_then_as_a_lag() {
        let (step, fine) = (0.02, 10_000);
        let commands: Vec<f64> = (0..40).map(|i| [0.0, 1.0, 0.97, -0.4][i / 10]).collect();
        let out = shaped(&RateLimit, 2, &[&[7.0, 0.008], &[f64::INFINITY, 0.008], &[7.0, 0.0]], step, &commands);
        for (lane, (rate, answer_time)) in [(7.0, 0.008), (f64::INFINITY, 0.008)].into_iter().enumerate() {
            let mut u = commands[0];
            for (i, command) in commands.iter().enumerate() {
                let mut mean = 0.0;
                for _ in 0..fine {
                    let before = u;
                    u += step / f64::from(fine) * ((command - u) / answer_time).clamp(-rate, rate);
                    mean += 0.5 * (before + u) / f64::from(fine);
                }
                assert!((out[lane][i] - mean).abs() < 2e-4, "{lane}, tick {i}: {}, not {mean}", out[lane][i]);
            }
        }
        let ramp = &shaped(&RateLimit, 0, &[&[7.0]], step, &commands)[0];
        assert!(out[2].iter().zip(ramp).all(|(a, b)| (a - b).abs() < 1e-12), "what answers at once ramps to the end");
        let begun = shaped(&RateLimit, 3, &[&[1.0, 0.01], &[f64::INFINITY, 0.0]], 0.25, &[1.0; 8]);
        assert!(begun[0][0] == 0.125 && begun[0][7] > 0.999 && begun[1] == [1.0; 8]);
    }

    #[test]
    fn a_sine_too_fast_becomes_a_triangle_of_the_rate_and_never_climbs_faster() {
        let step = 1e-3;
        let commands: Vec<f64> = (0..20_000).map(|i| (20.0 * i as f64 * step).sin()).collect();
        let out = &shaped(&RateLimit, 0, &[&[2.0]], step, &commands)[0];
        assert!(out.windows(2).all(|w| (w[1] - w[0]).abs() <= 2.0 * step * (1.0 + 1e-9)));
        // Saturated all the time, it climbs for half a period: to rate * period / 4 on either side.
        let peak = out[10_000..].iter().fold(0.0_f64, |peak, u| peak.max(u.abs()));
        let triangle = 2.0 * (std::f64::consts::TAU / 20.0) / 4.0;
        assert!((peak - triangle).abs() < 0.02 * triangle, "{peak}, not {triangle}");
    }

    #[test]
    fn the_output_moves_smoothly_with_the_rate() {
        let commands: Vec<f64> = (0..50).map(|i| if i % 25 < 12 { 0.0 } else { 1.0 }).collect();
        let at = |rate: f64| shaped(&RateLimit, 0, &[&[rate]], 0.02, &commands).remove(0);
        let (low, high) = (at(7.3 - 1e-6), at(7.3 + 1e-6));
        let (below, above) = (at(7.3 - 1e-3), at(7.3 + 1e-3));
        for i in 0..commands.len() {
            let (fine, wide) = ((high[i] - low[i]) / 2e-6, (above[i] - below[i]) / 2e-3);
            assert!((fine - wide).abs() < 1e-3, "tick {i}: slopes {fine} and {wide}");
        }
    }
}
