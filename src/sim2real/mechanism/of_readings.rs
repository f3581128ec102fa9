//! A rate of change that is told from the readings of a sensor, and so has the sensor's faults too.

use crate::sim2real::{LaneChange, Law, Plant};

/// How far ahead readings are looked at for their rate of change [s]: short beside any motion, long beside rounding.
const AHEAD: f64 = 1e-6;

/// Which channel is the rate of change of a plant's first, among all the `rates` of its channels.
#[must_use]
pub const fn rate_of_the_first(rates: &[(usize, usize)]) -> Option<usize> {
    match rates {
        [(0, rate), ..] => Some(*rate),
        _ => None,
    }
}

/// `law`, which distorts the first channel and remembers nothing, and in channel `rate` what its readings change by: the speed of an
/// encoder that counts 1 % too much is 1 % too much, where a tachometer's would be right.
pub(super) fn of_readings<P: Plant>(law: Box<dyn Law<P>>, rate: Option<usize>) -> Box<dyn Law<P>>
where
    P::Observation: AsMut<[f64]>,
{
    match rate {
        Some(rate) => Box::new(OfReadings::<P> { law, rate, ahead: Vec::new(), first: Vec::new(), times: Vec::new() }),
        None => law,
    }
}

#[derive(Clone)]
struct OfReadings<P: Plant> {
    law: Box<dyn Law<P>>,
    rate: usize,
    /// What is read a little later.
    ahead: Vec<P::Observation>,
    /// What the first channel is now, and a little later, before the law.
    first: Vec<[f64; 2]>,
    /// When that is, lane by lane [s].
    times: Vec<f64>,
}

impl<P: Plant> OfReadings<P>
where
    P::Observation: AsMut<[f64]>,
{
    /// Looks ahead in every lane.
    fn look(&mut self, observations: &mut [P::Observation]) {
        self.ahead.clear();
        self.first.clear();
        for observation in observations {
            let mut ahead = observation.clone();
            let channels = ahead.as_mut();
            let moved = channels.get(self.rate).map_or(0.0, |rate| AHEAD * rate);
            let now = channels.first().copied().unwrap_or_default();
            channels.iter_mut().take(1).for_each(|y| *y += moved);
            self.first.push([now, now + moved]);
            self.ahead.push(ahead);
        }
    }

    /// Adds what the law's part changes by: where the law does nothing, no bit.
    fn tell(&mut self, observations: &mut [P::Observation]) {
        for ((observation, ahead), first) in observations.iter_mut().zip(&mut self.ahead).zip(&self.first) {
            let channels = observation.as_mut();
            let [now, later] = [channels.first(), ahead.as_mut().first()].map(|y| y.copied().unwrap_or_default());
            if let Some(rate) = channels.get_mut(self.rate) {
                *rate += ((later - first[1]) - (now - first[0])) / AHEAD;
            }
        }
    }
}

impl<P: Plant> Law<P> for OfReadings<P>
where
    P::Observation: AsMut<[f64]>,
{
    fn change(&mut self, change: &LaneChange<'_>) {
        self.law.change(change);
    }

    fn sense_each(&mut self, times: &[f64], observations: &mut [P::Observation]) {
        self.look(observations);
        self.times.clear();
        self.times.extend(times.iter().map(|time| time + AHEAD));
        self.law.sense_each(&self.times, &mut self.ahead);
        self.law.sense_each(times, observations);
        self.tell(observations);
    }

    fn sense(&mut self, time: f64, observations: &mut [P::Observation]) {
        self.look(observations);
        self.law.sense(time + AHEAD, &mut self.ahead);
        self.law.sense(time, observations);
        self.tell(observations);
    }
}

#[cfg(test)]
mod tests {
    use super::super::wire::sensed;
    use super::super::{Drift, Eccentricity, Rectification, Scale};

    const RATE: Option<usize> = Some(1);

    /// What a motion of `1.5 sin 2 t` is read as at times of a row each.
    fn rows() -> Vec<(f64, [f64; 2])> {
        let at = |t: f64| (t, [1.5 * (2.0 * t).sin(), 3.0 * (2.0 * t).cos()]);
        (0..300).map(|i| at(0.01 * f64::from(i))).collect()
    }

    /// Readings of `form` at `theta`, and how far their rate is at most from what `readings` change by.
    fn apart(mechanism: &dyn crate::sim2real::Mechanism<super::super::wire::Wire>, form: usize, theta: &[f64]) -> f64 {
        let told = sensed(mechanism, form, &[theta], 1, &rows());
        let between = |later: bool| {
            let shift = if later { 1e-4 } else { -1e-4 };
            let moved = rows().into_iter().map(|(t, _)| {
                let t = t + shift;
                (t, [1.5 * (2.0 * t).sin(), 3.0 * (2.0 * t).cos()])
            });
            sensed(mechanism, form, &[theta], 1, &moved.collect::<Vec<_>>()).remove(0)
        };
        let (before, after) = (between(false), between(true));
        let slopes = before.iter().zip(&after).map(|(before, after)| (after[0] - before[0]) / 2e-4);
        let rates = told[0].iter().map(|row| row[1]);
        // The first row may have nothing before it.
        slopes.zip(rates).skip(1).map(|(slope, rate)| (slope - rate).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn rates_are_those_of_the_readings() {
        assert!(apart(&Scale { rate: RATE }, 2, &[0.1]) < 1e-5);
        assert!(apart(&Scale { rate: RATE }, 3, &[0.1, 0.05]) < 1e-5);
        assert!(apart(&Eccentricity { rate: RATE }, 2, &[0.02, -0.03]) < 1e-5);
        assert!(apart(&Eccentricity { rate: RATE }, 3, &[0.02, -0.03, 0.01, 0.02]) < 1e-5);
        assert!(apart(&Drift { rate: RATE }, 3, &[0.05]) < 1e-5);
        assert!(apart(&Drift { rate: RATE }, 4, &[0.2, 1.5]) < 1e-5);
        assert!(apart(&Rectification { rate: RATE }, 1, &[1.0]) < 1e-5);
        assert!(apart(&Scale { rate: RATE }, 0, &[0.1]) > 0.2, "a tachometer is another sensor");
    }
}
