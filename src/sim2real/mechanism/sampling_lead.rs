//! Samples that stand ahead of their commands on the clock of a recording.

use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Plant, Seed, Site, Thetas, Typical};

/// `y -> y + lead dy/dt`, in channels whose rate of change is a channel too: what is written down for a moment is what the plant shows
/// a little later. No cause does that; the record does: samples are stamped late, commands early, or both were made by a simulator
/// whose steps are semi-implicit (symplectic Euler, as most engines of rigid bodies), which shows positions by half a step ahead.
///
/// It is a matter of the record and nothing a simulator leaves out, and so no diagnosis names it.
///
/// Source: the half step, Hairer, Lubich & Wanner, *Geometric Numerical Integration* (2nd ed. 2006), sections I.1.4 and IX.3.
#[derive(Debug, Clone, Copy)]
pub struct SamplingLead {
    /// Channels whose rate of change is a channel of the plant: the number of each, with that of its rate.
    pub rates: &'static [(usize, usize)],
}

/// Half the step of any simulator that is of use, and more; over a longer one a plant does not move evenly [s].
const LONGEST: f64 = 5e-3;

impl<P: Plant> Mechanism<P> for SamplingLead
where
    P::Observation: AsMut<[f64]>,
{
    fn about(&self) -> About {
        About {
            name: "sampling_lead",
            site: Site::Observation,
            title: "samples that stand ahead of their commands",
            law: "y -> y + lead dy/dt",
            source: "Hairer, Lubich & Wanner, Geometric Numerical Integration (2006), I.1.4, IX.3",
            remedy: "stamp samples and commands by one clock; simulate in shorter steps, or by a method of higher order",
            contains: &[],
        }
    }

    fn forms(&self, _typical: &Typical) -> Vec<Form> {
        Form::only(vec![Parameter::new("lead", "s", 0.0).within(0.0, LONGEST).starting_at(&[5e-4]).in_time()])
    }

    fn of_the_record(&self) -> bool {
        true
    }

    fn law(&self, _form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<P>> {
        Box::new(Ahead { leads: thetas.row(0).to_vec(), rates: self.rates })
    }
}

#[derive(Clone)]
struct Ahead {
    leads: Vec<f64>,
    rates: &'static [(usize, usize)],
}

impl<P: Plant> Law<P> for Ahead
where
    P::Observation: AsMut<[f64]>,
{
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.leads);
    }

    fn sense(&mut self, _time: f64, observations: &mut [P::Observation]) {
        for (observation, lead) in observations.iter_mut().zip(&self.leads) {
            let channels = observation.as_mut();
            for (level, rate) in self.rates {
                let moved = channels.get(*rate).map_or(0.0, |rate| lead * rate);
                if let Some(y) = channels.get_mut(*level) {
                    *y += moved;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::wire::sensed;
    use super::*;

    #[test]
    fn a_sine_is_read_a_little_later_than_it_is_stamped() {
        let rows: Vec<(f64, [f64; 2])> =
            (0..500).map(|i| 4e-3 * f64::from(i)).map(|t| (t, [(3.0 * t).sin(), 3.0 * (3.0 * t).cos()])).collect();
        let read = &sensed(&SamplingLead { rates: &[(0, 1)] }, 0, &[&[1e-3], &[0.0]], 1, &rows)[0];
        for (got, (time, [_, rate])) in read.iter().zip(&rows) {
            assert!((got[0] - (3.0 * (time + 1e-3)).sin()).abs() < 9.0 * 1e-6 / 2.0 && got[1] == *rate);
        }
    }
}
