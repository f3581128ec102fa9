//! A velocity that is made of positions, and so is late: by a difference of two of them, by a filter, or by both.

use super::observation_delay::Line;
use super::of_readings::rate_of_the_first;
use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Plant, Seed, Site, Thetas, Typical};

/// In each channel that is the rate `v` of a channel `y`: `time_constant dw/dt = v - w`, of which `w` is reported, in the form `low_pass`;
/// `v -> (y(t) - y(t - window)) / window` in the form `difference`; and the former of the latter in the form `filtered_difference`.
/// Drives tell a velocity so: of what an encoder counts, differences are too coarse to be used as they are.
///
/// Before its first row a run is taken to have gone on evenly, as it does until the second.
///
/// Source: Bélanger, Dobrovolny, Helmy & Zhang, "Estimation of angular velocity and acceleration from shaft-encoder measurements",
/// International Journal of Robotics Research 17 (1998); the filter, Åström & Murray, *Feedback Systems* (2nd ed. 2021), section 6.3.
#[derive(Debug, Clone, Copy)]
pub struct VelocityFilter {
    /// Channels whose rate of change is a channel of the plant: the number of each, with that of its rate.
    pub rates: &'static [(usize, usize)],
}

/// A filter that takes longer hides what moves [s].
const LONGEST: f64 = 0.5;
const LOW_PASS: usize = 0;
const DIFFERENCE: usize = 1;
const FILTERED_DIFFERENCE: usize = 2;

impl<P: Plant> Mechanism<P> for VelocityFilter
where
    P::Observation: AsMut<[f64]>,
{
    fn about(&self) -> About {
        About {
            name: "velocity_filter",
            site: Site::Observation,
            title: "a filter of the measured velocity",
            law: "v -> w, time_constant dw/dt = v - w; difference: v -> (y(t) - y(t - window)) / window",
            source: "Bélanger et al., Angular velocity and acceleration from shaft encoders, Int. J. Robot. Res. 17 (1998)",
            remedy: "filter the simulator's velocity as the drive does, or take positions alone",
            contains: &[],
        }
    }

    fn forms(&self, _typical: &Typical) -> Vec<Form> {
        let time = |name| Parameter::new(name, "s", 0.0).within(0.0, LONGEST).starting_at(&[0.005, 0.03]);
        vec![
            Form { name: "low_pass", parameters: vec![time("time_constant")] },
            Form { name: "difference", parameters: vec![time("window")] },
            Form { name: "filtered_difference", parameters: vec![time("time_constant"), time("window")] },
        ]
    }

    fn general(&self, form: usize) -> bool {
        form == FILTERED_DIFFERENCE
    }

    fn told_by(&self, _form: usize) -> Option<usize> {
        rate_of_the_first(self.rates)
    }

    fn law(&self, form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<P>> {
        let lanes = thetas.lanes();
        let row = |number: Option<usize>| number.map_or_else(|| vec![0.0; lanes], |k| thetas.row(k).to_vec());
        let [time_constant, window] = numbers(form);
        Box::new(Filter::<P> {
            time_constants: row(time_constant),
            windows: row(window),
            lines: vec![Line::default(); lanes],
            filters: vec![Vec::new(); lanes],
            form,
            rates: self.rates,
        })
    }
}

/// Which parameters of a form are the time constant and the window.
fn numbers(form: usize) -> [Option<usize>; 2] {
    match form {
        LOW_PASS => [Some(0), None],
        DIFFERENCE => [None, Some(0)],
        _ => [Some(0), Some(1)],
    }
}

#[derive(Clone)]
struct Filter<P: Plant> {
    /// Lane by lane [s].
    time_constants: Vec<f64>,
    windows: Vec<f64>,
    /// The past of each lane, for differences.
    lines: Vec<Line<P::Observation>>,
    /// The filters of each lane, one a rate.
    filters: Vec<Vec<Passed>>,
    form: usize,
    rates: &'static [(usize, usize)],
}

/// What a filter was last given, and gave.
#[derive(Clone, Copy)]
struct Passed {
    time: f64,
    given: f64,
    gave: f64,
    /// Whether that was the first, of which nothing tells how it came to be.
    first: bool,
}

impl Passed {
    /// The next that it gives: exact where what it is given goes on evenly from row to row.
    fn next(self, time: f64, given: f64, time_constant: f64) -> Self {
        let step = time - self.time;
        if step <= 0.0 {
            return self;
        }
        let behind = time_constant * (given - self.given) / step;
        let off = if self.first { 0.0 } else { self.gave - self.given + behind };
        Self { time, given, gave: given - behind + off * (-step / time_constant).exp(), first: false }
    }
}

impl<P: Plant> Filter<P>
where
    P::Observation: AsMut<[f64]>,
{
    fn pass(&mut self, lane: usize, time: f64, observation: &mut P::Observation) {
        let (time_constant, window) = (self.time_constants[lane], self.windows[lane]);
        if window > 0.0 {
            let mut late = observation.clone();
            self.lines[lane].pass(time, window, &mut late, self.rates);
            let (now, late) = (observation.as_mut(), late.as_mut());
            for (level, rate) in self.rates.iter().filter(|(level, rate)| *level.max(rate) < late.len()) {
                now[*rate] = (now[*level] - late[*level]) / window;
            }
        }
        if time_constant > 0.0 {
            let filters = &mut self.filters[lane];
            for (k, (_, rate)) in self.rates.iter().enumerate() {
                let Some(v) = observation.as_mut().get_mut(*rate) else { continue };
                match filters.get_mut(k) {
                    Some(filter) => *filter = filter.next(time, *v, time_constant),
                    None => filters.push(Passed { time, given: *v, gave: *v, first: true }),
                }
                *v = filters[k].gave;
            }
        }
    }
}

impl<P: Plant> Law<P> for Filter<P>
where
    P::Observation: AsMut<[f64]>,
{
    fn change(&mut self, change: &LaneChange<'_>) {
        let of = |number: Option<usize>| move |values: &[f64]| number.map_or(0.0, |k| values[k]);
        let [time_constant, window] = numbers(self.form);
        change.derived(&mut self.time_constants, of(time_constant));
        change.derived(&mut self.windows, of(window));
        change.memory(&mut self.lines);
        change.memory(&mut self.filters);
    }

    fn sense_each(&mut self, times: &[f64], observations: &mut [P::Observation]) {
        for (lane, (observation, time)) in observations.iter_mut().zip(times).enumerate() {
            self.pass(lane, *time, observation);
        }
    }

    fn sense(&mut self, time: f64, observations: &mut [P::Observation]) {
        for (lane, observation) in observations.iter_mut().enumerate() {
            self.pass(lane, time, observation);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::wire::{rows, sensed};
    use super::*;

    const FILTER: VelocityFilter = VelocityFilter { rates: &[(0, 1)] };

    /// A sine and its rate in rows of 2 ms.
    fn sine() -> Vec<(f64, [f64; 2])> {
        let with_rate = |(t, _): (f64, [f64; 2])| (t, [(6.0 * t).sin(), 6.0 * (6.0 * t).cos()]);
        rows(1_500, 2e-3, f64::sin).into_iter().map(with_rate).collect()
    }

    #[test]
    fn a_low_pass_is_late_and_weak_by_its_frequency_response() {
        let tau = 0.03;
        let told = &sensed(&FILTER, LOW_PASS, &[&[tau]], 1, &sine())[0];
        let (gain, phase) = ((1.0 + (6.0 * tau).powi(2)).sqrt().recip(), (6.0 * tau).atan());
        for ((t, [y, _]), got) in sine().iter().zip(told).filter(|((t, _), _)| *t > 20.0 * tau) {
            assert_eq!(got[0], *y, "positions are as they were");
            assert!((got[1] - 6.0 * gain * (6.0 * t - phase).cos()).abs() < 2e-4, "at {t}");
        }
    }

    #[test]
    fn a_difference_is_the_mean_over_its_window() {
        for window in [2e-3, 0.0071, 0.04] {
            let told = &sensed(&FILTER, DIFFERENCE, &[&[window]], 1, &sine())[0];
            for ((t, _), got) in sine().iter().zip(told).filter(|((t, _), _)| *t > window) {
                let mean = ((6.0 * t).sin() - (6.0 * (t - window)).sin()) / window;
                assert!((got[1] - mean).abs() < 1e-6, "{window} at {t}");
            }
        }
    }

    #[test]
    fn both_are_one_after_the_other_and_one_alone_where_the_other_takes_no_time() {
        let told = |form: usize, theta: &[f64]| sensed(&FILTER, form, &[theta], 1, &sine()).remove(0);
        let one: Vec<(f64, [f64; 2])> =
            sine().iter().zip(told(DIFFERENCE, &[0.004])).map(|((t, _), row)| (*t, row)).collect();
        assert_eq!(told(FILTERED_DIFFERENCE, &[0.02, 0.004]), sensed(&FILTER, LOW_PASS, &[&[0.02]], 1, &one)[0]);
        assert_eq!(told(FILTERED_DIFFERENCE, &[0.02, 0.0]), told(LOW_PASS, &[0.02]));
        assert_eq!(told(FILTERED_DIFFERENCE, &[0.0, 0.004]), told(DIFFERENCE, &[0.004]));
    }

    #[test]
    fn what_has_gone_on_evenly_is_late_from_the_second_row_on() {
        let even: Vec<(f64, [f64; 2])> = (0..50).map(|i| 0.01 * f64::from(i)).map(|t| (t, [2.0 * t * t, 4.0 * t])).collect();
        let told = &sensed(&FILTER, LOW_PASS, &[&[0.02]], 1, &even)[0];
        assert!(even.iter().zip(told).skip(1).all(|((t, _), got)| (got[1] - 4.0 * (t - 0.02)).abs() < 1e-12));
    }
}
