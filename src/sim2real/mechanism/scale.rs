//! A sensor that reads too much or too little, in proportion.

use super::of_readings::of_readings;
use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Plant, Seed, Site, Thetas, Typical};

/// `y -> (1 + error) y`, on the plant's first channel: a wrong count of pulses per turn, of teeth, or of volts; in the form
/// `bent`, `y -> (1 + bent_error + bow y^2) y`, as of a potentiometer, which is not quite straight either.
///
/// In forms `.._with_rate` the first channel's rate of change is told from the same readings, as a drive tells a speed from its
/// encoder, and is wrong with them. In the others it has a sensor of its own.
///
/// Source: scale factor error and scale factor nonlinearity, IEEE Std 528-2019, *Inertial Sensor Terminology*.
#[derive(Debug, Clone, Copy)]
pub struct Scale {
    /// The channel that is the first one's rate of change, where there is one.
    pub rate: Option<usize>,
}

/// Forms from this one on are those before it, with the rate.
const WITH_RATE: usize = 2;

impl<P: Plant> Mechanism<P> for Scale
where
    P::Observation: AsMut<[f64]>,
{
    fn about(&self) -> About {
        About {
            name: "scale",
            site: Site::Observation,
            title: "a wrong scale of the sensor",
            law: "y -> (1 + error) y; bent: y -> (1 + bent_error + bow y^2) y; with_rate: and dy/dt of that",
            source: "scale factor error, IEEE Std 528-2019, Inertial Sensor Terminology",
            remedy: "move the axis over a known distance; correct the factor from counts to units",
            contains: &[],
        }
    }

    fn forms(&self, typical: &Typical) -> Vec<Form> {
        // A factor that turns the sign or hides the motion altogether is another fault than this.
        let error = |name| Parameter::new(name, "", 0.0).within(-0.95, 10.0).starting_at(&[0.05, -0.05]).proportional();
        let bows = [0.02, -0.02].map(|part| part / (typical.output * typical.output).max(1e-12));
        let bow = |name| Parameter::new(name, "1/output^2", 0.0).starting_at(&bows).proportional();
        let mut forms = vec![
            Form { name: "straight", parameters: vec![error("error")] },
            Form { name: "bent", parameters: vec![error("bent_error"), bow("bow")] },
        ];
        if self.rate.is_some() {
            forms.push(Form { name: "straight_with_rate", parameters: vec![error("error_with_rate")] });
            let bent = vec![error("bent_error_with_rate"), bow("bow_with_rate")];
            forms.push(Form { name: "bent_with_rate", parameters: bent });
        }
        forms
    }

    fn told_by(&self, form: usize) -> Option<usize> {
        self.rate.filter(|_| form >= WITH_RATE)
    }

    fn law(&self, form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<P>> {
        let factor = thetas.row(0).iter().map(|error| 1.0 + error).collect();
        let law: Box<dyn Law<P>> = match form % WITH_RATE {
            0 => Box::new(Factor(factor)),
            _ => Box::new(BentFactor { factor, bow: thetas.row(1).to_vec() }),
        };
        of_readings(law, Mechanism::<P>::told_by(self, form))
    }
}

#[derive(Clone)]
struct BentFactor {
    factor: Vec<f64>,
    bow: Vec<f64>,
}

impl<P: Plant> Law<P> for BentFactor
where
    P::Observation: AsMut<[f64]>,
{
    fn change(&mut self, change: &LaneChange<'_>) {
        change.derived(&mut self.factor, |values| 1.0 + values[0]);
        change.parameter(1, &mut self.bow);
    }

    fn sense(&mut self, _time: f64, observations: &mut [P::Observation]) {
        for ((observation, factor), bow) in observations.iter_mut().zip(&self.factor).zip(&self.bow) {
            if let Some(y) = observation.as_mut().first_mut() {
                *y *= factor + bow * *y * *y;
            }
        }
    }
}

#[derive(Clone)]
struct Factor(Vec<f64>);

impl<P: Plant> Law<P> for Factor
where
    P::Observation: AsMut<[f64]>,
{
    fn change(&mut self, change: &LaneChange<'_>) {
        change.derived(&mut self.0, |values| 1.0 + values[0]);
    }

    fn sense(&mut self, _time: f64, observations: &mut [P::Observation]) {
        for (observation, factor) in observations.iter_mut().zip(&self.0) {
            if let Some(y) = observation.as_mut().first_mut() {
                *y *= factor;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::wire::sensed;
    use super::*;

    #[test]
    fn readings_are_in_proportion_and_the_other_channel_is_left_alone() {
        let rows = [(0.0, [-2.0, 1.0]), (1.0, [0.0, 1.0]), (2.0, [4.0, 1.0])];
        let out = sensed(&Scale { rate: None }, 0, &[&[0.25], &[-0.5]], 1, &rows);
        assert_eq!(out[0], [[-2.5, 1.0], [0.0, 1.0], [5.0, 1.0]]);
        assert_eq!(out[1], [[-1.0, 1.0], [0.0, 1.0], [2.0, 1.0]]);
        let bent = sensed(&Scale { rate: None }, 1, &[&[0.25, 0.5]], 1, &rows);
        assert_eq!(bent[0], [[-6.5, 1.0], [0.0, 1.0], [37.0, 1.0]]);
    }
}
