//! A sensor whose zero moves with time.

use super::decay::gained;
use super::of_readings::of_readings;
use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Plant, Seed, Site, Thetas, Typical};

/// `y -> y + rate t`, on the plant's first channel; in the form `settling`, `y -> y + offset (1 - exp(-t / time_constant))`, as
/// of electronics that warm up; in the form `under_way`, `y -> y + end (1 - (1 - share) exp(-t / time_constant))`, as of those
/// that were switched on a little before: at the recording's beginning a share of it, no more than half, lies behind them.
///
/// `t` is the recording's own clock: the zero is right at its 0, wherever a run starts. Recordings of one twin with a drift
/// should count from one beginning, and none from an epoch far away. Before 0 nothing has settled.
///
/// In forms `.._with_rate` the first channel's rate of change is told from the same readings, as a drive tells a speed from its
/// encoder, and is wrong with them. In the others it has a sensor of its own.
///
/// Source: instrumental drift, JCGM 200:2012, *International Vocabulary of Metrology*, 4.21.
#[derive(Debug, Clone, Copy)]
pub struct Drift {
    /// The channel that is the first one's rate of change, where there is one.
    pub rate: Option<usize>,
}

/// Forms from this one on are those before it, with the rate.
const WITH_RATE: usize = 3;

impl<P: Plant> Mechanism<P> for Drift
where
    P::Observation: AsMut<[f64]>,
{
    fn about(&self) -> About {
        About {
            name: "drift",
            site: Site::Observation,
            title: "a drift of the sensor's zero",
            law: "y -> y + rate t; settling: y -> y + offset (1 - exp(-t / time_constant)); under_way: a share of it at 0; with_rate: and dy/dt of that",
            source: "instrumental drift, JCGM 200:2012, International Vocabulary of Metrology, 4.21",
            remedy: "let the sensor warm up, or home the axis again from time to time; subtract the drift",
            contains: &["bias"],
        }
    }

    fn ages(&self) -> bool {
        true
    }

    fn forms(&self, typical: &Typical) -> Vec<Form> {
        let duration = if typical.duration > 0.0 { typical.duration } else { 1.0 };
        let offsets = [0.1, -0.1].map(|part| part * typical.output);
        let rates = offsets.map(|offset| offset / duration);
        let times = [0.05, 0.3].map(|part| part * duration);
        let time = |name| Parameter::new(name, "s", f64::INFINITY).within(0.0, f64::INFINITY).starting_at(&times);
        let rate = |name| Parameter::new(name, "output/s", 0.0).starting_at(&rates).proportional();
        let offset = |name| Parameter::new(name, "output", 0.0).starting_at(&offsets).proportional();
        let share = Parameter::new("share", "", 0.0).within(0.0, 0.5).starting_at(&[0.1]);
        let mut forms = vec![
            Form { name: "linear", parameters: vec![rate("rate")] },
            Form { name: "settling", parameters: vec![offset("offset"), time("time_constant")] },
            Form { name: "under_way", parameters: vec![offset("end"), time("time_constant"), share] },
        ];
        if self.rate.is_some() {
            let settling = vec![offset("offset_with_rate"), time("time_constant")];
            forms.push(Form { name: "linear_with_rate", parameters: vec![rate("rate_with_rate")] });
            forms.push(Form { name: "settling_with_rate", parameters: settling });
        }
        forms
    }

    fn told_by(&self, form: usize) -> Option<usize> {
        self.rate.filter(|_| form >= WITH_RATE)
    }

    fn law(&self, form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<P>> {
        let size = thetas.row(0).to_vec();
        let times = || thetas.row(1).to_vec();
        let law: Box<dyn Law<P>> = match form % WITH_RATE {
            0 => Box::new(Rate(size)),
            1 => Box::new(Settling { under_way: false, share: vec![0.0; size.len()], end: size, time_constant: times() }),
            _ => Box::new(Settling { under_way: true, share: thetas.row(2).to_vec(), end: size, time_constant: times() }),
        };
        of_readings(law, Mechanism::<P>::told_by(self, form))
    }
}

#[derive(Clone)]
struct Rate(Vec<f64>);

impl<P: Plant> Law<P> for Rate
where
    P::Observation: AsMut<[f64]>,
{
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.0);
    }

    fn sense_each(&mut self, times: &[f64], observations: &mut [P::Observation]) {
        for ((observation, rate), time) in observations.iter_mut().zip(&self.0).zip(times) {
            if let Some(y) = observation.as_mut().first_mut() {
                *y += rate * time;
            }
        }
    }

    fn sense(&mut self, time: f64, observations: &mut [P::Observation]) {
        for (observation, rate) in observations.iter_mut().zip(&self.0) {
            if let Some(y) = observation.as_mut().first_mut() {
                *y += rate * time;
            }
        }
    }
}

#[derive(Clone)]
struct Settling {
    /// Whether there is a share, which is the third parameter.
    under_way: bool,
    /// How much of it lies behind at the recording's beginning.
    share: Vec<f64>,
    end: Vec<f64>,
    time_constant: Vec<f64>,
}

impl Settling {
    fn add(&self, lane: usize, time: f64, channels: &mut [f64]) {
        let (share, end, tau) = (self.share[lane], self.end[lane], self.time_constant[lane]);
        if let Some(y) = channels.first_mut() {
            *y += end * (share + (1.0 - share) * gained(time.max(0.0), tau));
        }
    }
}

impl<P: Plant> Law<P> for Settling
where
    P::Observation: AsMut<[f64]>,
{
    fn change(&mut self, change: &LaneChange<'_>) {
        let under_way = self.under_way;
        change.parameter(0, &mut self.end);
        change.parameter(1, &mut self.time_constant);
        change.derived(&mut self.share, |values| if under_way { values[2] } else { 0.0 });
    }

    fn sense_each(&mut self, times: &[f64], observations: &mut [P::Observation]) {
        let lanes = observations.iter_mut().zip(times).enumerate();
        lanes.for_each(|(lane, (observation, time))| self.add(lane, *time, observation.as_mut()));
    }

    fn sense(&mut self, time: f64, observations: &mut [P::Observation]) {
        observations.iter_mut().enumerate().for_each(|(lane, observation)| self.add(lane, time, observation.as_mut()));
    }
}

#[cfg(test)]
mod tests {
    use super::super::wire::{rows, sensed};
    use super::*;

    #[test]
    fn the_zero_moves_with_the_recordings_own_clock() {
        let rows = rows(400, 0.05, f64::sin);
        let linear = &sensed(&Drift { rate: None }, 0, &[&[0.03]], 1, &rows)[0];
        let settling = sensed(&Drift { rate: None }, 1, &[&[0.2, 4.0], &[0.2, 0.0], &[0.2, f64::INFINITY]], 1, &rows);
        for (i, (t, [y, _])) in rows.iter().enumerate() {
            assert!((linear[i][0] - y - 0.03 * t).abs() < 1e-15);
            assert!((settling[0][i][0] - y - 0.2 * (1.0 - (-t / 4.0).exp())).abs() < 1e-14);
            assert!((settling[1][i][0] - y - 0.2).abs() < 1e-15);
            assert_eq!(settling[2][i][0], *y);
        }
        let under_way = &sensed(&Drift { rate: None }, 2, &[&[0.2, 4.0, 0.1]], 1, &rows)[0];
        for (i, (t, [y, _])) in rows.iter().enumerate() {
            assert!((under_way[i][0] - y - 0.2 + 0.18 * (-t / 4.0).exp()).abs() < 1e-14);
        }
        // A run that starts in the middle sees the same.
        assert_eq!(sensed(&Drift { rate: None }, 0, &[&[0.03]], 1, &rows[200..])[0], linear[200..]);
        assert_eq!(sensed(&Drift { rate: None }, 1, &[&[0.2, 4.0]], 1, &rows[200..])[0], settling[0][200..]);
        // Rates of change are no business of a zero.
        assert!(linear.iter().all(|[_, rate]| *rate == 0.0));
    }

    #[test]
    fn before_the_clocks_zero_nothing_has_settled() {
        assert_eq!(sensed(&Drift { rate: None }, 1, &[&[0.2, 4.0]], 1, &[(-50.0, [1.0, 0.0])])[0], [[1.0, 0.0]]);
    }
}
