//! Noise of the sensor.

use rand_distr::{Distribution, StandardNormal};

use super::decay::{Decay, gained};
use crate::sim2real::normal_draw::normal;
use crate::sim2real::{
    About, Draws, Form, LaneChange, LaneDraws, Law, Mechanism, Parameter, Plant, Seed, Site, Thetas, Typical,
};

/// `y -> y + n`, on the plant's first channel, with Gaussian `n` of standard deviation `std`, independent from row to row; in
/// the form `coloured`, of the correlation `exp(-dt / correlation_time)` over a time `dt`.
///
/// Draws are one a row, the same for all lanes, and in the order of the rows from the start of a run: they are not those of
/// a real sensor, whose noise is recognized but not followed.
///
/// Source: Uhlenbeck & Ornstein, "On the theory of the Brownian motion", Physical Review 36 (1930); solved exactly between
/// rows, Gillespie, "Exact numerical simulation of the Ornstein-Uhlenbeck process and its integral", Physical Review E 54
/// (1996).
#[derive(Debug, Clone, Copy)]
pub struct Noise;

impl<P: Plant> Mechanism<P> for Noise
where
    P::Observation: AsMut<[f64]>,
{
    fn about(&self) -> About {
        About {
            name: "noise",
            site: Site::Observation,
            title: "noise of the sensor",
            law: "y -> y + n, n Gaussian of std; coloured: with the correlation exp(-dt / correlation_time)",
            source: "Uhlenbeck & Ornstein, Physical Review 36 (1930); Gillespie, Physical Review E 54 (1996)",
            remedy: "add the noise to the simulator, or a filter to the sensor",
            contains: &[],
        }
    }

    fn forms(&self, typical: &Typical) -> Vec<Form> {
        let starts = [0.003, 0.02].map(|part| part * typical.output);
        let std = || Parameter::new("std", "output", 0.0).within(0.0, f64::INFINITY).starting_at(&starts);
        let time = Parameter::new("correlation_time", "s", 0.0).within(0.0, f64::INFINITY).starting_at(&[0.02, 0.2]);
        vec![Form { name: "white", parameters: vec![std()] }, Form { name: "coloured", parameters: vec![std(), time] }]
    }

    fn followed(&self, _form: usize) -> bool {
        false
    }

    fn law(&self, form: usize, thetas: &Thetas, seed: Seed) -> Box<dyn Law<P>> {
        let lanes = thetas.lanes();
        let correlation_time = if form == 0 { vec![0.0; lanes] } else { thetas.row(1).to_vec() };
        Box::new(Process {
            std: thetas.row(0).to_vec(),
            correlation_time,
            value: vec![0.0; lanes],
            last: None,
            decay: Decay::default(),
            draws: seed.stream("noise"),
            coloured: form != 0,
            own: vec![None; lanes],
            lane_draws: LaneDraws::new("noise", lanes),
        })
    }
}

#[derive(Clone)]
struct Process {
    std: Vec<f64>,
    correlation_time: Vec<f64>,
    /// The noise of the last row in standard deviations.
    value: Vec<f64>,
    /// Time of the last row [s]; none before the first, at which the process is already what it always is.
    last: Option<f64>,
    decay: Decay,
    draws: Draws,
    /// Whether the correlation time is the second parameter.
    coloured: bool,
    /// Where each lane has its own clock: the time of its last row [s].
    own: Vec<Option<f64>>,
    lane_draws: LaneDraws,
}

impl Process {
    /// What the noise of lane `lane` is, in standard deviations, where it has gained this much and `draw` is new.
    fn step(value: &mut f64, gained: f64, draw: f64) {
        // With the correlation 1 - g, what is new has the variance 1 - (1 - g)^2 = g (2 - g).
        *value += (gained * (2.0 - gained)).sqrt() * draw - *value * gained;
    }
}

impl<P: Plant> Law<P> for Process
where
    P::Observation: AsMut<[f64]>,
{
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.std);
        if self.coloured {
            change.parameter(1, &mut self.correlation_time);
            self.decay.change(change, &self.correlation_time);
        }
        change.memory(&mut self.value);
        change.memory(&mut self.own);
        change.draws(&mut self.lane_draws);
    }

    fn sense_each(&mut self, times: &[f64], observations: &mut [P::Observation]) {
        for (lane, (observation, time)) in observations.iter_mut().zip(times).enumerate() {
            let (std, value) = (self.std[lane], &mut self.value[lane]);
            let draw = normal(self.lane_draws.lane(lane).bits());
            // What is correlated has to be known from the last row on; the rest is new.
            let new = match self.own[lane].filter(|_| self.coloured) {
                Some(last) => gained(*time - last, self.correlation_time[lane]),
                None => 1.0,
            };
            self.own[lane] = Some(*time);
            Self::step(value, new, draw);
            if let Some(y) = observation.as_mut().first_mut() {
                *y += std * *value;
            }
        }
    }

    fn sense(&mut self, time: f64, observations: &mut [P::Observation]) {
        let draw: f64 = StandardNormal.sample(&mut self.draws);
        let gained = self.decay.over(self.last.map_or(f64::INFINITY, |last| time - last), &self.correlation_time);
        self.last = Some(time);
        let lanes = self.std.iter().zip(&mut self.value).zip(gained);
        for (observation, ((std, value), gained)) in observations.iter_mut().zip(lanes) {
            Self::step(value, *gained, draw);
            if let Some(y) = observation.as_mut().first_mut() {
                *y += std * *value;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::wire::{rows, sensed};
    use super::*;

    const STEP: f64 = 0.01;

    fn noise(form: usize, lane: &[f64], seed: u64) -> Vec<f64> {
        sensed(&Noise, form, &[lane], seed, &rows(60_000, STEP, |_| 0.0)).remove(0).iter().map(|y| y[0]).collect()
    }

    fn covariance(noise: &[f64], lag: usize) -> f64 {
        noise.iter().zip(&noise[lag..]).map(|(a, b)| a * b).sum::<f64>() / (noise.len() - lag) as f64
    }

    #[test]
    fn white_noise_has_its_std_and_no_memory() {
        let noise = noise(0, &[0.3], 7);
        assert!((covariance(&noise, 0).sqrt() / 0.3 - 1.0).abs() < 0.015);
        for lag in 1..10 {
            assert!((covariance(&noise, lag) / 0.09).abs() < 4.5 / 60_000_f64.sqrt(), "lag {lag}");
        }
        // Gaussian: the fourth moment is three times the square of the second.
        let fourth = noise.iter().map(|n| n.powi(4)).sum::<f64>() / noise.len() as f64;
        assert!((fourth / 0.09_f64.powi(2) - 3.0).abs() < 0.15, "{fourth}");
    }

    #[test]
    fn coloured_noise_has_its_std_from_the_first_row_and_its_correlation_time() {
        let long = noise(1, &[0.3, 0.05], 7);
        assert!((covariance(&long, 0).sqrt() / 0.3 - 1.0).abs() < 0.03);
        for lag in [1, 3, 5, 10] {
            let expected = (-(lag as f64) * STEP / 0.05).exp();
            let found = covariance(&long, lag) / covariance(&long, 0);
            assert!((found - expected).abs() < 0.04, "lag {lag}: {found}, not {expected}");
        }
        let first: Vec<f64> =
            (0..4_000).map(|seed| sensed(&Noise, 1, &[&[0.3, 5.0]], seed, &[(12.0, [0.0, 0.0])])[0][0][0]).collect();
        assert!((covariance(&first, 0).sqrt() / 0.3 - 1.0).abs() < 0.05);
    }

    #[test]
    fn rows_apart_by_any_time_keep_the_std() {
        let times: Vec<(f64, [f64; 2])> = (0..60_000).map(|i| (f64::from(i) + 0.9 * f64::from(i % 2), [0.0, 0.0])).collect();
        let out: Vec<f64> = sensed(&Noise, 1, &[&[1.0, 0.5]], 2, &times)[0].iter().map(|y| y[0]).collect();
        assert!((covariance(&out, 0) - 1.0).abs() < 0.03);
        // Pairs are 1.9 s apart and 0.1 s apart in turn.
        let close: f64 = out.chunks(2).zip(out[2..].chunks(2)).map(|(a, b)| a[1] * b[0]).sum::<f64>() / 29_999.0;
        assert!((close - (-0.1_f64 / 0.5).exp()).abs() < 0.03, "{close}");
    }

    #[test]
    fn the_same_seed_gives_the_same_bits_in_any_lane() {
        let rows = rows(500, STEP, |t| t);
        let alone = sensed(&Noise, 1, &[&[0.3, 0.05]], 7, &rows).remove(0);
        assert_eq!(sensed(&Noise, 1, &[&[0.2, 0.0], &[0.3, 0.05]], 7, &rows)[1], alone);
        assert_ne!(sensed(&Noise, 1, &[&[0.3, 0.05]], 8, &rows)[0], alone);
    }
}
