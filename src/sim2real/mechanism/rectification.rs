//! A sensor that does not tell the sign.

use super::of_readings::of_readings;
use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Plant, Seed, Site, Thetas, Typical};

/// `y -> y + fraction (|y| - y)`, on the plant's first channel: `|y|` at a fraction of 1.
///
/// In the form `with_rate` the first channel's rate of change is told from the same readings, as a drive tells a speed from its
/// encoder, and is wrong with them. In the other it has a sensor of its own.
///
/// Source: the pulse counter of the coupled electric drives, Wigren & Schoukens, "Three free data sets for development and
/// benchmarking in nonlinear system identification", European Control Conference (2013).
#[derive(Debug, Clone, Copy)]
pub struct Rectification {
    /// The channel that is the first one's rate of change, where there is one.
    pub rate: Option<usize>,
}

/// Forms from this one on are those before it, with the rate.
const WITH_RATE: usize = 1;

impl<P: Plant> Mechanism<P> for Rectification
where
    P::Observation: AsMut<[f64]>,
{
    fn about(&self) -> About {
        About {
            name: "rectification",
            site: Site::Observation,
            title: "a sensor that does not tell the sign",
            law: "y -> y + fraction (|y| - y); with_rate: and dy/dt of that",
            source: "Wigren & Schoukens, Three free data sets (coupled electric drives), ECC (2013)",
            remedy: "use a sensor that tells the direction, or take the magnitude in the simulator too",
            contains: &[],
        }
    }

    fn forms(&self, _typical: &Typical) -> Vec<Form> {
        let fraction = |name| vec![Parameter::new(name, "", 0.0).within(0.0, 1.0).starting_at(&[0.5, 1.0])];
        let mut forms = vec![Form { name: "reading", parameters: fraction("fraction") }];
        if self.rate.is_some() {
            forms.push(Form { name: "with_rate", parameters: fraction("fraction_with_rate") });
        }
        forms
    }

    fn told_by(&self, form: usize) -> Option<usize> {
        self.rate.filter(|_| form >= WITH_RATE)
    }

    fn law(&self, form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<P>> {
        of_readings(Box::new(Folded(thetas.row(0).to_vec())), Mechanism::<P>::told_by(self, form))
    }
}

#[derive(Clone)]
struct Folded(Vec<f64>);

impl<P: Plant> Law<P> for Folded
where
    P::Observation: AsMut<[f64]>,
{
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.0);
    }

    fn sense(&mut self, _time: f64, observations: &mut [P::Observation]) {
        for (observation, fraction) in observations.iter_mut().zip(&self.0) {
            if let Some(y) = observation.as_mut().first_mut() {
                *y += fraction * (y.abs() - *y);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::wire::{rows, sensed};
    use super::*;

    #[test]
    fn the_sign_is_lost_by_the_fraction() {
        let rows = rows(1_000, 0.01, f64::sin);
        let out = sensed(&Rectification { rate: None }, 0, &[&[1.0], &[0.25]], 1, &rows);
        for (i, (_, [y, _])) in rows.iter().enumerate() {
            assert_eq!(out[0][i][0], y.abs());
            let folded = if *y < 0.0 { 0.5 * y } else { *y };
            assert!((out[1][i][0] - folded).abs() < 1e-15);
        }
    }
}
