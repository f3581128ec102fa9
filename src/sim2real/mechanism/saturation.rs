//! A command larger than the actuator can give.

use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Plant, Seed, Site, Thetas, Tick, Typical};

/// `u -> min(max(u, -limit), limit)`; in the form `soft`, `u -> u / sqrt(1 + (u / soft_limit)^2)`; in the form `bent`,
/// `u -> u / (1 + |u / bent_limit|^sharpness)^(1 / sharpness)`, which has the others within it: an amplifier that runs into
/// its supply voltage gives way before it stops, some earlier, some later.
///
/// Source: Tarbouriech et al., *Stability and Stabilization of Linear Systems with Saturating Actuators* (2011),
/// chapter 1.
#[derive(Debug, Clone, Copy)]
pub struct Saturation;

impl<P: Plant> Mechanism<P> for Saturation
where
    P::Command: AsMut<f64>,
{
    fn about(&self) -> About {
        About {
            name: "saturation",
            site: Site::Command,
            title: "saturation of the actuator",
            law: "u -> min(max(u, -limit), limit); soft: u -> u / (1 + |u / limit|^sharpness)^(1 / sharpness), sharpness 2 or fitted",
            source: "Tarbouriech et al., Stability and Stabilization of Linear Systems with Saturating Actuators (2011)",
            remedy: "keep commands within the limit, or clip them in the simulator as the actuator does",
            contains: &[],
        }
    }

    fn forms(&self, typical: &Typical) -> Vec<Form> {
        let starts = [1.6, 1.2, 0.8, 0.5].map(|fraction| fraction * typical.command);
        let limit = |name| Parameter::new(name, "command", f64::INFINITY).within(0.0, f64::INFINITY).starting_at(&starts);
        let sharpness = Parameter::new("sharpness", "", 2.0).within(0.5, 20.0).starting_at(&[3.0]);
        vec![
            Form { name: "hard", parameters: vec![limit("limit")] },
            Form { name: "soft", parameters: vec![limit("soft_limit")] },
            Form { name: "bent", parameters: vec![limit("bent_limit"), sharpness] },
        ]
    }

    fn law(&self, form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<P>> {
        let limits = thetas.row(0).to_vec();
        match form {
            0 => Box::new(Limit(limits)),
            1 => Box::new(SoftLimit(limits)),
            _ => Box::new(BentLimit { limits, sharpness: thetas.row(1).to_vec() }),
        }
    }
}

#[derive(Clone)]
struct BentLimit {
    limits: Vec<f64>,
    sharpness: Vec<f64>,
}

impl<P: Plant> Law<P> for BentLimit
where
    P::Command: AsMut<f64>,
{
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.limits);
        change.parameter(1, &mut self.sharpness);
    }

    fn shape(&mut self, _tick: Tick, commands: &mut [P::Command]) {
        for ((command, limit), sharpness) in commands.iter_mut().zip(&self.limits).zip(&self.sharpness) {
            let u = command.as_mut();
            if limit.is_finite() {
                *u = bent(*u, *limit, *sharpness);
            }
        }
    }
}

/// `u / (1 + |u / limit|^sharpness)^(1 / sharpness)`: `u` where it is small, `limit` where it is large.
pub(super) fn bent(u: f64, limit: f64, sharpness: f64) -> f64 {
    u * (1.0 + (u / limit.max(1e-12)).abs().powf(sharpness)).powf(-1.0 / sharpness)
}

#[derive(Clone)]
struct Limit(Vec<f64>);

impl<P: Plant> Law<P> for Limit
where
    P::Command: AsMut<f64>,
{
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.0);
    }

    fn shape(&mut self, _tick: Tick, commands: &mut [P::Command]) {
        for (command, limit) in commands.iter_mut().zip(&self.0) {
            let u = command.as_mut();
            *u = u.max(-limit).min(*limit);
        }
    }
}

#[derive(Clone)]
struct SoftLimit(Vec<f64>);

impl<P: Plant> Law<P> for SoftLimit
where
    P::Command: AsMut<f64>,
{
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.0);
    }

    fn shape(&mut self, _tick: Tick, commands: &mut [P::Command]) {
        for (command, limit) in commands.iter_mut().zip(&self.0) {
            let u = command.as_mut();
            *u = if *limit > 0.0 { *u / (*u / limit).hypot(1.0) } else { 0.0 };
        }
    }
}
