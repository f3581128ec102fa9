//! A sensor that is off by a constant.

use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Plant, Seed, Site, Thetas, Typical};

/// `y -> y + offset`, on the plant's first channel.
///
/// Source: zero error, JCGM 200:2012, *International Vocabulary of Metrology*, 4.28.
#[derive(Debug, Clone, Copy)]
pub struct Bias;

impl<P: Plant> Mechanism<P> for Bias
where
    P::Observation: AsMut<[f64]>,
{
    fn about(&self) -> About {
        About {
            name: "bias",
            site: Site::Observation,
            title: "a zero offset of the sensor",
            law: "y -> y + offset",
            source: "zero error, JCGM 200:2012, International Vocabulary of Metrology, 4.28",
            remedy: "home the axis against a known reference, or subtract the offset",
            contains: &[],
        }
    }

    fn forms(&self, typical: &Typical) -> Vec<Form> {
        let starts = [0.02, -0.02].map(|fraction| fraction * typical.output);
        Form::only(vec![Parameter::new("offset", "output", 0.0).starting_at(&starts).proportional()])
    }

    fn law(&self, _form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<P>> {
        Box::new(Offset(thetas.row(0).to_vec()))
    }
}

#[derive(Clone)]
struct Offset(Vec<f64>);

impl<P: Plant> Law<P> for Offset
where
    P::Observation: AsMut<[f64]>,
{
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.0);
    }

    fn sense(&mut self, _time: f64, observations: &mut [P::Observation]) {
        for (observation, offset) in observations.iter_mut().zip(&self.0) {
            if let Some(y) = observation.as_mut().first_mut() {
                *y += offset;
            }
        }
    }
}
