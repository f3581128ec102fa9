//! A sensor whose samples are lost now and then.

use rand::RngExt;

use crate::sim2real::{
    About, Draws, Form, LaneChange, LaneDraws, Law, Mechanism, Parameter, Plant, Seed, Signs, Site, Thetas, Typical,
};

/// With `probability` a row repeats the row before, in all channels: a message was lost, and what reads the sensor holds
/// the last. In the form `bursts`, losses begin with `probability` and last `length` rows in the mean, as of a bus that is
/// disturbed or a link behind a wall.
///
/// Draws are one a row, the same for all lanes, and in the order of the rows from the start of a run. They say nothing
/// of when a real sensor lost its samples: a dropout is recognized by its repeats, not by following it.
///
/// Source: Sinopoli et al., "Kalman filtering with intermittent observations", IEEE Transactions on Automatic Control 49
/// (2004); holding the last, Schenato, "To zero or to hold control inputs with lossy links?", the same 54 (2009); bursts,
/// Gilbert, "Capacity of a burst-noise channel", Bell System Technical Journal 39 (1960).
#[derive(Debug, Clone, Copy)]
pub struct Dropout;

impl<P: Plant> Mechanism<P> for Dropout
where
    P::Observation: AsMut<[f64]>,
{
    fn about(&self) -> About {
        About {
            name: "dropout",
            site: Site::Observation,
            title: "lost samples of the sensor",
            law: "y -> the y before, with probability; bursts: lost for length rows in the mean",
            source: "Sinopoli et al., IEEE TAC 49 (2004); Schenato, IEEE TAC 54 (2009); Gilbert, BSTJ 39 (1960)",
            remedy: "check cable, bus load and time-outs; mark lost samples as lost instead of repeating the last",
            contains: &[],
        }
    }

    fn forms(&self, _typical: &Typical) -> Vec<Form> {
        let probability =
            |starts: &[f64]| Parameter::new("probability", "", 0.0).within(0.0, 0.99).starting_at(starts).stepped();
        let length = Parameter::new("length", "rows", 1.0).within(1.0, 1e4).starting_at(&[5.0, 20.0]).stepped();
        vec![
            Form { name: "independent", parameters: vec![probability(&[0.05, 0.2])] },
            Form { name: "bursts", parameters: vec![probability(&[0.01, 0.05]), length] },
        ]
    }

    fn followed(&self, _form: usize) -> bool {
        false
    }

    /// Single losses are independent, longer runs of them are bursts.
    fn recognized(&self, form: usize, signs: &Signs) -> Option<Vec<f64>> {
        let bursts = signs.run > 1.5;
        match form {
            _ if signs.repeated <= 0.0 || bursts != (form == 1) => None,
            0 => Some(vec![signs.repeated]),
            _ => Some(vec![signs.repeated / signs.run / (1.0 - signs.repeated).max(1e-3), signs.run]),
        }
    }

    fn law(&self, form: usize, thetas: &Thetas, seed: Seed) -> Box<dyn Law<P>> {
        let begins = thetas.row(0).to_vec();
        // Independent losses go on as they begin.
        let goes_on = match form {
            0 => begins.clone(),
            _ => thetas.row(1).iter().map(|length| going_on(*length)).collect(),
        };
        let held = vec![None; thetas.lanes()];
        Box::new(Losses::<P> {
            begins,
            goes_on,
            bursts: form != 0,
            lost: vec![false; thetas.lanes()],
            held,
            draws: seed.stream("dropout"),
            lane_draws: LaneDraws::new("dropout", thetas.lanes()),
        })
    }
}

/// Probability that a loss goes on, of those that last `length` rows in the mean.
fn going_on(length: f64) -> f64 {
    1.0 - 1.0 / length.max(1.0)
}

#[derive(Clone)]
struct Losses<P: Plant> {
    /// Probability that a sample is lost after one that was not ...
    begins: Vec<f64>,
    /// ... and after one that was.
    goes_on: Vec<f64>,
    /// Whether losses go on in bursts.
    bursts: bool,
    lost: Vec<bool>,
    /// What was last reported; none before the first row, which is not lost.
    held: Vec<Option<P::Observation>>,
    draws: Draws,
    lane_draws: LaneDraws,
}

impl<P: Plant> Losses<P> {
    fn pass(&mut self, lane: usize, draw: f64, observation: &mut P::Observation) {
        let (lost, held) = (&mut self.lost[lane], &mut self.held[lane]);
        *lost = held.is_some() && draw < if *lost { self.goes_on[lane] } else { self.begins[lane] };
        match held {
            Some(held) if *lost => observation.clone_from(held),
            Some(held) => held.clone_from(observation),
            None => *held = Some(observation.clone()),
        }
    }
}

impl<P: Plant> Law<P> for Losses<P> {
    fn change(&mut self, change: &LaneChange<'_>) {
        let bursts = self.bursts;
        change.parameter(0, &mut self.begins);
        change.derived(&mut self.goes_on, |values| if bursts { going_on(values[1]) } else { values[0] });
        change.memory(&mut self.lost);
        change.memory(&mut self.held);
        change.draws(&mut self.lane_draws);
    }

    fn sense_each(&mut self, _times: &[f64], observations: &mut [P::Observation]) {
        for (lane, observation) in observations.iter_mut().enumerate() {
            let draw = self.lane_draws.lane(lane).unit();
            self.pass(lane, draw, observation);
        }
    }

    fn sense(&mut self, _time: f64, observations: &mut [P::Observation]) {
        let draw: f64 = self.draws.random();
        observations.iter_mut().enumerate().for_each(|(lane, observation)| self.pass(lane, draw, observation));
    }
}

#[cfg(test)]
mod tests {
    use super::super::wire::{rows, sensed};
    use super::*;

    const COUNT: usize = 40_000;

    /// Which rows repeat the one before: the signal itself never does.
    fn repeats(seen: &[[f64; 2]]) -> Vec<bool> {
        seen.windows(2).map(|w| w[0][0] == w[1][0]).collect()
    }

    fn share(repeats: &[bool]) -> f64 {
        repeats.iter().filter(|lost| **lost).count() as f64 / repeats.len() as f64
    }

    #[test]
    fn samples_are_lost_as_often_as_said_and_one_does_not_bring_the_next() {
        let rows = rows(COUNT, 0.01, |t| t);
        let out = &sensed(&Dropout, 0, &[&[0.2]], 3, &rows)[0];
        let lost = repeats(out);
        // Four standard deviations of a binomial.
        let spread = 4.0 * (0.2 * 0.8 / COUNT as f64).sqrt();
        assert!((share(&lost) - 0.2).abs() < spread);
        let pairs: Vec<bool> = lost.windows(2).map(|w| w[0] && w[1]).collect();
        assert!((share(&pairs) - 0.04).abs() < 2.0 * spread);
        // Every row is either its own or the last that was.
        let mut last = rows[0].1;
        for (i, got) in out.iter().enumerate() {
            last = if i > 0 && lost[i - 1] { last } else { rows[i].1 };
            assert_eq!(*got, last, "row {i}");
        }
    }

    #[test]
    fn bursts_last_as_long_as_said() {
        let out = &sensed(&Dropout, 1, &[&[0.02, 8.0]], 3, &rows(COUNT, 0.01, |t| t))[0];
        let lost = repeats(out);
        let bursts = lost.windows(2).filter(|w| !w[0] && w[1]).count() as f64;
        let length = lost.iter().filter(|lost| **lost).count() as f64 / bursts;
        assert!((length - 8.0).abs() < 1.0, "{length} rows in the mean");
        // One begins in every fiftieth of the rows that were not lost.
        let kept = COUNT as f64 - length * bursts;
        assert!((bursts / kept - 0.02).abs() < 0.003, "{bursts} in {kept}");
    }

    #[test]
    fn the_same_seed_loses_the_same_rows_in_any_lane() {
        let rows = rows(2_000, 0.01, |t| t);
        let alone = sensed(&Dropout, 0, &[&[0.3]], 5, &rows).remove(0);
        assert_eq!(sensed(&Dropout, 0, &[&[0.1], &[0.3]], 5, &rows)[1], alone);
        assert_ne!(sensed(&Dropout, 0, &[&[0.3]], 6, &rows)[0], alone);
    }
}
