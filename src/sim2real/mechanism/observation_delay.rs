//! Dead time on the way back: what is reported of a plant is already old.

use std::collections::VecDeque;

use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Observation, Parameter, Plant, Seed, Site, Thetas, Typical};

/// `y(t) -> y(t - seconds)`, in all channels: filters, buses and exposure times of a camera.
///
/// Between rows a channel whose rate of change is a channel too is a cubic through both (Hermite), any other a straight line:
/// continuous in the delay, and for the former smooth. Before the first row of a run nothing is known; there the plant is
/// taken to have moved on at its first rate, and channels without one to have held. In an open loop nothing but this
/// beginning tells a late report from a late command.
///
/// Source: dead time in a loop, Åström & Murray, *Feedback Systems* (2nd ed. 2021), section 9.2; the interpolation, Fritsch
/// & Carlson, "Monotone piecewise cubic interpolation", SIAM Journal on Numerical Analysis 17 (1980), equation 2.
#[derive(Debug, Clone, Copy)]
pub struct ObservationDelay {
    /// The delay's upper bound [s].
    pub longest: f64,
    /// Where fits begin [s].
    pub starts: &'static [f64],
    /// Channels whose rate of change is a channel of the plant: the number of each, with that of its rate.
    pub rates: &'static [(usize, usize)],
}

impl<P: Plant> Mechanism<P> for ObservationDelay
where
    P::Observation: AsMut<[f64]>,
{
    fn about(&self) -> About {
        About {
            name: "observation_delay",
            site: Site::Observation,
            title: "a delay of the sensor",
            law: "y(t) -> y(t - seconds)",
            source: "Åström & Murray, Feedback Systems (2021), 9.2",
            remedy: "stamp samples when they are taken, not when they arrive; add the delay to the simulator",
            contains: &[],
        }
    }

    fn forms(&self, _typical: &Typical) -> Vec<Form> {
        Form::only(vec![Parameter::new("seconds", "s", 0.0).within(0.0, self.longest).starting_at(self.starts).in_time()])
    }

    fn law(&self, _form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<P>> {
        let seconds = thetas.row(0).to_vec();
        Box::new(Late::<P> { lines: vec![Line::default(); seconds.len()], seconds, rates: self.rates })
    }
}

#[derive(Clone)]
struct Late<P: Plant> {
    seconds: Vec<f64>,
    lines: Vec<Line<P::Observation>>,
    rates: &'static [(usize, usize)],
}

impl<P: Plant> Law<P> for Late<P>
where
    P::Observation: AsMut<[f64]>,
{
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.seconds);
        change.memory(&mut self.lines);
    }

    fn sense_each(&mut self, times: &[f64], observations: &mut [P::Observation]) {
        let lanes = observations.iter_mut().zip(&mut self.lines).zip(&self.seconds).zip(times);
        lanes.for_each(|(((observation, line), seconds), time)| line.pass(*time, *seconds, observation, self.rates));
    }

    fn sense(&mut self, time: f64, observations: &mut [P::Observation]) {
        for ((observation, line), seconds) in observations.iter_mut().zip(&mut self.lines).zip(&self.seconds) {
            line.pass(time, *seconds, observation, self.rates);
        }
    }
}

/// The past of one lane, as far back as its delay reaches.
#[derive(Clone)]
pub(super) struct Line<O> {
    /// Rows (time [s], observation), oldest first.
    past: VecDeque<(f64, O)>,
    /// Rows that have left the line, to be written over: a delay that is under way takes no more memory.
    left: Vec<O>,
}

impl<O> Default for Line<O> {
    fn default() -> Self {
        Self { past: VecDeque::new(), left: Vec::new() }
    }
}

impl<O: Observation + AsMut<[f64]>> Line<O> {
    /// Puts what is reported `seconds` late in the place of what is observed.
    pub(super) fn pass(&mut self, time: f64, seconds: f64, observation: &mut O, rates: &[(usize, usize)]) {
        let from = time - seconds;
        while !self.past.is_empty() && self.past.get(1).map_or(time, |(next, _)| *next) <= from {
            self.left.extend(self.past.pop_front().map(|(_, row)| row));
        }
        let mut newest = self.left.pop().unwrap_or_default();
        newest.clone_from(observation);
        self.past.push_back((time, newest));
        let Some((since, first)) = self.past.front() else { return };
        match self.past.get(1) {
            Some((until, second)) if from >= *since => {
                between((from - since) / (until - since), until - since, [first, second], observation.as_mut(), rates);
            }
            _ => before(from - since, first, observation.as_mut(), rates),
        }
    }
}

/// The channels `seconds` [s], negative, from their `first` row.
fn before<O: Observation>(seconds: f64, first: &O, channels: &mut [f64], rates: &[(usize, usize)]) {
    channels.iter_mut().enumerate().for_each(|(k, y)| *y = first.channel(k));
    for (k, rate) in rates {
        if let Some(y) = channels.get_mut(*k) {
            *y += seconds * first.channel(*rate);
        }
    }
}

/// The channels a `part` of the way between two rows `step` [s] apart.
fn between<O: Observation>(part: f64, step: f64, rows: [&O; 2], channels: &mut [f64], rates: &[(usize, usize)]) {
    let [first, second] = rows;
    for (k, y) in channels.iter_mut().enumerate() {
        let (a, b) = (first.channel(k), second.channel(k));
        *y = a + part * (b - a);
        if let Some((_, rate)) = rates.iter().find(|(level, _)| *level == k) {
            // How much steeper than the straight line the channel leaves the first row, and reaches the second.
            let (leaves, reaches) = (step * first.channel(*rate) - (b - a), step * second.channel(*rate) - (b - a));
            *y += part * (1.0 - part) * ((1.0 - part) * leaves - part * reaches);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::wire::{Wire, sensed};
    use super::*;

    const WITH_RATE: ObservationDelay = ObservationDelay { longest: 0.5, starts: &[0.02], rates: &[(0, 1)] };
    const WITHOUT: ObservationDelay = ObservationDelay { longest: 0.5, starts: &[0.02], rates: &[] };

    /// A sine and its rate, in rows that are not quite evenly spaced.
    fn sine(count: usize) -> Vec<(f64, [f64; 2])> {
        let times = (0..count).map(|i| 4e-3 * i as f64 + if i % 3 == 1 { 1e-3 } else { 0.0 });
        times.map(|t| (t, [(5.0 * t).sin(), 5.0 * (5.0 * t).cos()])).collect()
    }

    #[test]
    fn a_sine_comes_back_late_by_the_delay_and_by_nothing_else() {
        let rows = sine(2_000);
        for delay in [1e-4, 0.0033, 0.02, 0.1237] {
            let (cubic, straight) =
                (sensed(&WITH_RATE, 0, &[&[delay]], 1, &rows), sensed(&WITHOUT, 0, &[&[delay]], 1, &rows));
            for (i, (t, _)) in rows.iter().enumerate().filter(|(_, (t, _))| *t >= delay) {
                let (level, rate) = ((5.0 * (t - delay)).sin(), 5.0 * (5.0 * (t - delay)).cos());
                // Of step^4 / 384 times the fourth derivative, and of step^2 / 8 times the second.
                assert!((cubic[0][i][0] - level).abs() < 2e-9, "delay {delay}, row {i}");
                assert!((straight[0][i][0] - level).abs() < 1e-4, "delay {delay}, row {i}");
                assert!((cubic[0][i][1] - rate).abs() < 5e-4, "delay {delay}, row {i}");
            }
        }
    }

    #[test]
    fn no_delay_changes_no_bit() {
        let rows = sine(500);
        let out = &sensed(&WITH_RATE, 0, &[&[0.0], &[0.03]], 1, &rows)[0];
        assert!(out.iter().zip(&rows).all(|(got, (_, row))| got == row));
    }

    #[test]
    fn before_its_first_row_a_plant_has_moved_on_at_its_first_rate() {
        let rows: Vec<(f64, [f64; 2])> =
            (0..20).map(|i| 0.01 * f64::from(i)).map(|t| (7.0 + t, [1.0 + 3.0 * t, 3.0])).collect();
        let moving = &sensed(&WITH_RATE, 0, &[&[0.055]], 1, &rows)[0];
        let held = &sensed(&WITHOUT, 0, &[&[0.055]], 1, &rows)[0];
        for (i, (t, _)) in rows.iter().enumerate() {
            let ago = t - 7.0 - 0.055;
            assert!((moving[i][0] - (1.0 + 3.0 * ago)).abs() < 1e-12, "row {i}");
            assert!((held[i][0] - (1.0 + 3.0 * ago.max(0.0))).abs() < 1e-12, "row {i}");
        }
    }

    #[test]
    fn the_output_moves_smoothly_with_the_delay_across_rows() {
        let rows = sine(300);
        let at = |delay: f64| sensed(&WITH_RATE, 0, &[&[delay]], 1, &rows)[0][250][0];
        for k in 0..100 {
            // Delays of whole rows among them.
            let delay = 1e-3 * f64::from(k) + 1e-3;
            let slope = (at(delay + 1e-6) - at(delay - 1e-6)) / 2e-6;
            let exact = -5.0 * (5.0 * (rows[250].0 - delay)).cos();
            assert!((slope - exact).abs() < 1e-4, "delay {delay}: {slope}, not {exact}");
        }
    }

    #[test]
    fn the_line_forgets_what_has_left_it() {
        let mut line = Line::<[f64; 2]>::default();
        for i in 0..10_000 {
            line.pass(f64::from(i) * 1e-3, 0.02, &mut [f64::from(i), 0.0], &[(0, 1)]);
        }
        assert!(line.past.len() + line.left.len() < 30);
        assert!(Mechanism::<Wire>::followed(&WITH_RATE, 0));
    }
}
