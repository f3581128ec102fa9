//! An actuator that gives more or less than it is told to.

use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Plant, Seed, Site, Thetas, Tick, Typical};

/// `u -> (1 + error) u`; in the form `asymmetric`, `u -> (1 + negative_error) u` where `u < 0` and `u` elsewhere, as of a
/// cylinder with a rod on one side, or an output stage whose halves differ.
///
/// A twin whose own gain is free cannot tell the first form from it. The second it can.
///
/// Source: a segment of another slope on each side, Vörös, "Parameter identification of discontinuous Hammerstein systems",
/// Automatica 33 (1997); single-rod cylinders, Merritt, *Hydraulic Control Systems* (1967).
#[derive(Debug, Clone, Copy)]
pub struct GainError;

impl<P: Plant> Mechanism<P> for GainError
where
    P::Command: AsMut<f64>,
{
    fn about(&self) -> About {
        About {
            name: "gain_error",
            site: Site::Command,
            title: "a wrong gain of the actuator",
            law: "u -> (1 + error) u; asymmetric: u -> (1 + negative_error) u where u < 0",
            source: "Vörös, Automatica 33 (1997); Merritt, Hydraulic Control Systems (1967)",
            remedy: "measure what the actuator gives against what it is told, in both directions; correct the gain",
            contains: &[],
        }
    }

    fn forms(&self, _typical: &Typical) -> Vec<Form> {
        // An actuator that gives nothing at all, or has its sign wrong, is no matter of a gain that is a little off.
        let error = |name| Parameter::new(name, "", 0.0).within(-0.95, 5.0).starting_at(&[0.15, -0.15]).proportional();
        vec![
            Form { name: "both", parameters: vec![error("error")] },
            Form { name: "asymmetric", parameters: vec![error("negative_error")] },
        ]
    }

    fn law(&self, form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<P>> {
        let negative: Vec<f64> = thetas.row(0).iter().map(|error| 1.0 + error).collect();
        let positive = if form == 0 { negative.clone() } else { vec![1.0; thetas.lanes()] };
        Box::new(Gains { positive, negative, both: form == 0 })
    }
}

#[derive(Clone)]
struct Gains {
    positive: Vec<f64>,
    negative: Vec<f64>,
    /// Whether the error is that of both signs.
    both: bool,
}

impl<P: Plant> Law<P> for Gains
where
    P::Command: AsMut<f64>,
{
    fn change(&mut self, change: &LaneChange<'_>) {
        let both = self.both;
        change.derived(&mut self.negative, |values| 1.0 + values[0]);
        change.derived(&mut self.positive, |values| if both { 1.0 + values[0] } else { 1.0 });
    }

    fn shape(&mut self, _tick: Tick, commands: &mut [P::Command]) {
        for ((command, positive), negative) in commands.iter_mut().zip(&self.positive).zip(&self.negative) {
            let u = command.as_mut();
            *u *= if *u < 0.0 { negative } else { positive };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::wire::shaped;
    use super::*;

    #[test]
    fn gains_are_those_of_each_direction() {
        let commands = [-2.0, -0.5, 0.0, 0.5, 2.0];
        assert_eq!(shaped(&GainError, 0, &[&[0.25], &[0.0]], 1e-3, &commands)[0], [-2.5, -0.625, 0.0, 0.625, 2.5]);
        assert_eq!(shaped(&GainError, 1, &[&[0.25], &[0.0]], 1e-3, &commands)[0], [-2.5, -0.625, 0.0, 0.5, 2.0]);
        assert_eq!(shaped(&GainError, 1, &[&[0.25], &[0.0]], 1e-3, &commands)[1], commands);
    }
}
