//! A sensor whose disc does not run true.

use super::of_readings::of_readings;
use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Plant, Seed, Site, Thetas, Typical};

/// `y -> y + sine sin(y) + cosine cos(y)`, on the plant's first channel, an angle: a disc off its axis is wrong once a turn. In the
/// form `two_harmonics`, also `second_sine sin(2 y) + second_cosine cos(2 y)`: a disc that is oval or tilted, or a ring magnet
/// whose two tracks differ in size, is wrong twice. Over a small swing one harmonic takes on what a second one does there: `sin(2 y)` is
/// about `2 sin(y)`, so that its sine is about `sine + 2 second_sine`.
///
/// In forms `.._with_rate` the first channel's rate of change is told from the same readings, as a drive tells a speed from its
/// encoder, and is wrong with them. In the others it has a sensor of its own.
///
/// An amplitude and a phase, written as a sine and a cosine: that is linear, and has no phase to lose where the amplitude
/// is small.
///
/// Source: Sanchez-Brea & Morlanes, "Metrological errors in optical encoders", Measurement Science and Technology 19 (2008).
#[derive(Debug, Clone, Copy)]
pub struct Eccentricity {
    /// The channel that is the first one's rate of change, where there is one.
    pub rate: Option<usize>,
}

/// Forms from this one on are those before it, with the rate.
const WITH_RATE: usize = 2;

impl<P: Plant> Mechanism<P> for Eccentricity
where
    P::Observation: AsMut<[f64]>,
{
    fn about(&self) -> About {
        About {
            name: "eccentricity",
            site: Site::Observation,
            title: "an eccentric sensor",
            law: "y -> y + sine sin(y) + cosine cos(y); two_harmonics: and the same of 2 y; with_rate: and dy/dt of that",
            source: "Sanchez-Brea & Morlanes, Metrological errors in optical encoders, Meas. Sci. Technol. 19 (2008)",
            remedy: "centre the disc, read it on two sides, or correct readings by a table over a turn",
            contains: &[],
        }
    }

    fn forms(&self, typical: &Typical) -> Vec<Form> {
        // What matters is in proportion to the motion, and no disc in use is off by more than some hundredths of a turn.
        let start = (0.03 * typical.output).min(0.02);
        // A fit finds the sign of what is linear: the second pair needs a slope to begin with, not both signs.
        let starts: [&[f64]; 4] = [&[start, -start], &[start, -start], &[0.3 * start], &[0.3 * start]];
        let waves = |names: &[&'static str]| -> Vec<Parameter> {
            let wave = |name| Parameter::new(name, "output", 0.0).within(-0.5, 0.5).proportional();
            names.iter().zip(starts).map(|(name, starts)| wave(*name).starting_at(starts)).collect()
        };
        let mut forms = vec![
            Form { name: "one_harmonic", parameters: waves(&NAMES[..2]) },
            Form { name: "two_harmonics", parameters: waves(&NAMES) },
        ];
        if self.rate.is_some() {
            forms.push(Form { name: "one_harmonic_with_rate", parameters: waves(&NAMES_WITH_RATE[..2]) });
            forms.push(Form { name: "two_harmonics_with_rate", parameters: waves(&NAMES_WITH_RATE) });
        }
        forms
    }

    fn told_by(&self, form: usize) -> Option<usize> {
        self.rate.filter(|_| form >= WITH_RATE)
    }

    /// A turn is a turn of an angle.
    fn applies(&self, _form: usize, plant: &P, _stimulus: &P::Stimulus) -> bool {
        plant.channels().first().is_some_and(|channel| channel.unit == "rad")
    }

    /// Over less than a turn two harmonics may be bent into whatever else a sensor does.
    fn general(&self, form: usize) -> bool {
        form % WITH_RATE == 1
    }

    fn law(&self, form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<P>> {
        let waves = (0..thetas.lanes())
            .map(|lane| std::array::from_fn(|k| if k < thetas.parameters() { thetas.row(k)[lane] } else { 0.0 }))
            .collect();
        of_readings(Box::new(Waves(waves)), Mechanism::<P>::told_by(self, form))
    }
}

/// Sine and cosine of one turn, then of half a turn.
const NAMES: [&str; 4] = ["sine", "cosine", "second_sine", "second_cosine"];
const NAMES_WITH_RATE: [&str; 4] =
    ["sine_with_rate", "cosine_with_rate", "second_sine_with_rate", "second_cosine_with_rate"];

/// Sine and cosine of the first harmonic, then of the second, one set a lane.
#[derive(Clone)]
struct Waves(Vec<[f64; 4]>);

impl<P: Plant> Law<P> for Waves
where
    P::Observation: AsMut<[f64]>,
{
    fn change(&mut self, change: &LaneChange<'_>) {
        change.derived(&mut self.0, |values| std::array::from_fn(|k| values.get(k).copied().unwrap_or_default()));
    }

    fn sense(&mut self, _time: f64, observations: &mut [P::Observation]) {
        for (observation, waves) in observations.iter_mut().zip(&self.0) {
            if let Some(y) = observation.as_mut().first_mut() {
                let (sine, cosine) = y.sin_cos();
                let twice = [2.0 * sine * cosine, cosine * cosine - sine * sine];
                *y += waves[0] * sine + waves[1] * cosine + waves[2] * twice[0] + waves[3] * twice[1];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::wire::{rows, sensed};
    use super::*;

    #[test]
    fn readings_are_off_by_an_amplitude_at_a_phase_once_and_twice_a_turn() {
        let rows = rows(700, 0.01, |t| 3.0 * t - 8.0);
        let (amplitude, phase) = (0.03, 0.7_f64);
        let (second, second_phase) = (0.01, -1.9_f64);
        let first = [amplitude * phase.cos(), amplitude * phase.sin()];
        let both = [first[0], first[1], second * second_phase.cos(), second * second_phase.sin()];
        let disc = Eccentricity { rate: None };
        let once = &sensed(&disc, 0, &[&first], 1, &rows)[0];
        let twice = &sensed(&disc, 1, &[&both], 1, &rows)[0];
        for (i, (_, [y, _])) in rows.iter().enumerate() {
            let expected = y + amplitude * (y + phase).sin();
            assert!((once[i][0] - expected).abs() < 1e-13);
            assert!((twice[i][0] - expected - second * (2.0 * y + second_phase).sin()).abs() < 1e-13);
        }
    }
}
