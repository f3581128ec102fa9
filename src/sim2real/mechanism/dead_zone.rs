//! A command too small to have any effect.

use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Plant, Seed, Site, Thetas, Tick, Typical};

/// `u -> 0` where `|u| <= width`, `u - sign(u) width` elsewhere; in the form `soft`, `u -> u - u / sqrt(1 + (u / soft_width)^2)`,
/// as where several small gaps, or a driver's crossover, add up.
///
/// Source: Tao & Kokotović, *Adaptive Control of Systems with Actuator and Sensor Nonlinearities* (1996), chapter 2.
#[derive(Debug, Clone, Copy)]
pub struct DeadZone;

impl<P: Plant> Mechanism<P> for DeadZone
where
    P::Command: AsMut<f64>,
{
    fn about(&self) -> About {
        About {
            name: "dead_zone",
            site: Site::Command,
            title: "a dead zone of the actuator",
            law: "u -> sign(u) max(|u| - width, 0); soft: u -> u - u / sqrt(1 + (u / soft_width)^2)",
            source: "Tao & Kokotović, Adaptive Control of Systems with Actuator and Sensor Nonlinearities (1996), ch. 2",
            remedy: "raise small commands above the dead zone, or add it to the simulator",
            contains: &[],
        }
    }

    fn forms(&self, typical: &Typical) -> Vec<Form> {
        let starts = [0.02, 0.1, 0.3].map(|fraction| fraction * typical.command);
        let width = |name| Parameter::new(name, "command", 0.0).within(0.0, f64::INFINITY).starting_at(&starts);
        vec![
            Form { name: "hard", parameters: vec![width("width")] },
            Form { name: "soft", parameters: vec![width("soft_width")] },
        ]
    }

    fn law(&self, form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<P>> {
        let widths = thetas.row(0).to_vec();
        if form == 0 { Box::new(Width(widths)) } else { Box::new(SoftWidth(widths)) }
    }
}

#[derive(Clone)]
struct Width(Vec<f64>);

impl<P: Plant> Law<P> for Width
where
    P::Command: AsMut<f64>,
{
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.0);
    }

    fn shape(&mut self, _tick: Tick, commands: &mut [P::Command]) {
        for (command, width) in commands.iter_mut().zip(&self.0) {
            let u = command.as_mut();
            if *width > 0.0 {
                *u = u.signum() * (u.abs() - width).max(0.0);
            }
        }
    }
}

#[derive(Clone)]
struct SoftWidth(Vec<f64>);

impl<P: Plant> Law<P> for SoftWidth
where
    P::Command: AsMut<f64>,
{
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.0);
    }

    fn shape(&mut self, _tick: Tick, commands: &mut [P::Command]) {
        for (command, width) in commands.iter_mut().zip(&self.0) {
            let u = command.as_mut();
            if *width > 0.0 {
                *u -= *u / (*u / width).hypot(1.0);
            }
        }
    }
}
