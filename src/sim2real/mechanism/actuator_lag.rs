//! An actuator that follows its command with a lag.

use super::decay::Decay;
use crate::sim2real::{About, Form, Law, Mechanism, Parameter, Plant, Seed, Site, Thetas, Tick, Typical};

/// `time_constant du/dt = u_command - u`; in the form `two_stage`, two such lags of half of `total_time` each, one after the
/// other: a filter, then a winding.
///
/// Each stage is solved exactly over a tick for a command that holds; what the next gets is the mean over the tick.
///
/// Source: first-order actuator, Åström & Murray, *Feedback Systems* (2nd ed. 2021), section 3.3.
#[derive(Debug, Clone, Copy)]
pub struct ActuatorLag;

impl<P: Plant> Mechanism<P> for ActuatorLag
where
    P::Command: AsMut<f64>,
{
    fn about(&self) -> About {
        About {
            name: "actuator_lag",
            site: Site::Command,
            title: "a lag of the actuator",
            law: "time_constant du/dt = u_command - u; two_stage: twice, with half of total_time each",
            source: "Åström & Murray, Feedback Systems (2021), 3.3",
            remedy: "measure the actuator's step response; add the lag to the simulator",
            contains: &[],
        }
    }

    fn forms(&self, _typical: &Typical) -> Vec<Form> {
        let time = |name| Parameter::new(name, "s", 0.0).within(0.0, 2.0).starting_at(&[0.01, 0.05]);
        vec![
            Form { name: "first_order", parameters: vec![time("time_constant")] },
            Form { name: "two_stage", parameters: vec![time("total_time")] },
        ]
    }

    fn law(&self, form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<P>> {
        let stages = form + 1;
        let time_constant: Vec<f64> = thetas.row(0).iter().map(|time| time / stages as f64).collect();
        Box::new(Lags(vec![Lag { time_constant, follower: vec![None; thetas.lanes()], decay: Decay::default() }; stages]))
    }
}

/// The stages, in the order in which a command passes them.
struct Lags(Vec<Lag>);

#[derive(Clone)]
struct Lag {
    time_constant: Vec<f64>,
    /// What the actuator gives at the start of the tick; none before the first command, which it has already reached.
    follower: Vec<Option<f64>>,
    decay: Decay,
}

impl<P: Plant> Law<P> for Lags
where
    P::Command: AsMut<f64>,
{
    fn shape(&mut self, tick: Tick, commands: &mut [P::Command]) {
        self.0.iter_mut().for_each(|lag| lag.pass(tick, commands));
    }
}

impl Lag {
    fn pass<C: AsMut<f64>>(&mut self, tick: Tick, commands: &mut [C]) {
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
