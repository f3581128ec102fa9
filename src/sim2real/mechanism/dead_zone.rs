//! A command too small to have any effect.

use super::saturation::bent;
use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Plant, Seed, Site, Thetas, Tick, Typical};

/// `u -> 0` where `|u| <= width`, `u - sign(u) width` elsewhere; in the form `soft`, `u -> u - u / sqrt(1 + (u / soft_width)^2)`,
/// as where several small gaps, or a driver's crossover, add up; in the form `bent`,
/// `u -> u - u / (1 + |u / bent_width|^sharpness)^(1 / sharpness)`, which has the others within it.
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
            law: "u -> sign(u) max(|u| - width, 0); soft: u -> u - u / (1 + |u / width|^sharpness)^(1 / sharpness), sharpness 2 or fitted",
            source: "Tao & Kokotović, Adaptive Control of Systems with Actuator and Sensor Nonlinearities (1996), ch. 2",
            remedy: "raise small commands above the dead zone, or add it to the simulator",
            contains: &[],
        }
    }

    fn forms(&self, typical: &Typical) -> Vec<Form> {
        let starts = [0.02, 0.1, 0.3].map(|fraction| fraction * typical.command);
        let width = |name| Parameter::new(name, "command", 0.0).within(0.0, f64::INFINITY).starting_at(&starts);
        let sharpness = Parameter::new("sharpness", "", 2.0).within(0.5, 20.0).starting_at(&[3.0]);
        vec![
            Form { name: "hard", parameters: vec![width("width")] },
            Form { name: "soft", parameters: vec![width("soft_width")] },
            Form { name: "bent", parameters: vec![width("bent_width"), sharpness] },
        ]
    }

    /// How an edge is rounded tells where there is a dead zone, and may look like much else where there is none.
    fn general(&self, form: usize) -> bool {
        form == 2
    }

    fn law(&self, form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<P>> {
        let widths = thetas.row(0).to_vec();
        match form {
            0 => Box::new(Width(widths)),
            1 => Box::new(SoftWidth(widths)),
            _ => Box::new(BentWidth { widths, sharpness: thetas.row(1).to_vec() }),
        }
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

#[derive(Clone)]
struct BentWidth {
    widths: Vec<f64>,
    sharpness: Vec<f64>,
}

impl<P: Plant> Law<P> for BentWidth
where
    P::Command: AsMut<f64>,
{
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.widths);
        change.parameter(1, &mut self.sharpness);
    }

    fn shape(&mut self, _tick: Tick, commands: &mut [P::Command]) {
        for ((command, width), sharpness) in commands.iter_mut().zip(&self.widths).zip(&self.sharpness) {
            let u = command.as_mut();
            if *width > 0.0 {
                *u -= bent(*u, *width, *sharpness);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::wire::shaped;
    use super::*;

    #[test]
    fn a_bent_edge_has_the_others_within_it() {
        let commands: Vec<f64> = (-40..=40).map(|k| f64::from(k) * 0.05).collect();
        let width = 0.4;
        let of = |form: usize, values: &[f64]| shaped(&DeadZone, form, &[values], 1e-3, &commands).swap_remove(0);
        let [hard, soft] = [of(0, &[width]), of(1, &[width])];
        let [square, sharp] = [of(2, &[width, 2.0]), of(2, &[width, 20.0])];
        for k in 0..commands.len() {
            assert!((square[k] - soft[k]).abs() < 1e-12, "{} at {}", square[k], commands[k]);
            assert!((sharp[k] - hard[k]).abs() < 0.04 * width, "{} and {} at {}", sharp[k], hard[k], commands[k]);
        }
        assert_eq!(of(2, &[0.0, 2.0]), commands, "no width is no dead zone");
    }
}
