//! A sensor that counts in steps.

use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Plant, Seed, Signs, Site, Thetas, Typical};

/// `y -> round(y / step) step`, on the plant's first channel.
///
/// Rounding to the nearest; a sensor that counts downward is off by half a step besides, which is a bias.
///
/// Source: Widrow & Kollár, *Quantization Noise* (2008), chapter 1.
#[derive(Debug, Clone, Copy)]
pub struct Quantization;

impl<P: Plant> Mechanism<P> for Quantization
where
    P::Observation: AsMut<[f64]>,
{
    fn about(&self) -> About {
        About {
            name: "quantization",
            site: Site::Observation,
            title: "the steps in which the sensor counts",
            law: "y -> round(y / step) step",
            source: "Widrow & Kollár, Quantization Noise (2008), ch. 1",
            remedy: "round in the simulator as the sensor does, or use a finer sensor",
            contains: &[],
        }
    }

    /// Fits begin at the steps that are seen; where none are, at one too small to be seen.
    fn forms(&self, typical: &Typical) -> Vec<Form> {
        let start = if typical.resolution > 0.0 { typical.resolution } else { 1e-3 * typical.output };
        Form::only(vec![Parameter::new("step", "output", 0.0).within(0.0, f64::INFINITY).starting_at(&[start]).stepped()])
    }

    fn finishing(&self, _form: usize) -> bool {
        true
    }

    /// A signal that noise moves by about a step is rounded visibly, though no fit can tell to which side.
    fn recognized(&self, _form: usize, signs: &Signs) -> Option<Vec<f64>> {
        (signs.step > 0.0).then(|| vec![signs.step])
    }

    fn law(&self, _form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<P>> {
        Box::new(Steps(thetas.row(0).to_vec()))
    }
}

#[derive(Clone)]
struct Steps(Vec<f64>);

impl<P: Plant> Law<P> for Steps
where
    P::Observation: AsMut<[f64]>,
{
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.0);
    }

    fn sense(&mut self, _time: f64, observations: &mut [P::Observation]) {
        for (observation, step) in observations.iter_mut().zip(&self.0) {
            if let Some(y) = observation.as_mut().first_mut().filter(|_| *step > 0.0) {
                *y = (*y / step).round() * step;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::wire::{rows, sensed};
    use super::*;

    #[test]
    fn readings_are_whole_steps_and_their_errors_are_uniform() {
        let step = 0.013;
        let rows = rows(20_000, 1e-3, |t| (2.0 * t).sin() + 0.3 * (5.1 * t).cos());
        let out = &sensed(&Quantization, 0, &[&[step]], 1, &rows)[0];
        let errors: Vec<f64> = out.iter().zip(&rows).map(|(got, (_, [y, _]))| got[0] - y).collect();
        assert!(out.iter().all(|[y, _]| (y / step - (y / step).round()).abs() < 1e-9));
        assert!(errors.iter().all(|e| e.abs() <= 0.5 * step * (1.0 + 1e-9)));
        let mean = errors.iter().sum::<f64>() / errors.len() as f64;
        let std = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
        assert!(mean.abs() < 0.02 * step, "mean {mean}");
        assert!((std / (step / 12.0_f64.sqrt()) - 1.0).abs() < 0.02, "std {std}");
    }
}
