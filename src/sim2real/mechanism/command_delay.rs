//! Dead time on the way to the plant: bus, driver and scheduler latency of a servo, order latency of a market.

use std::collections::VecDeque;

use crate::sim2real::{
    About, Command, DelayLine, Form, LaneChange, Law, Mechanism, Parameter, Plant, Seed, Site, Thetas, Tick, Ticks, Typical,
};

/// `u(t) -> u(t - seconds)`; an order arrives `seconds` after it was sent.
///
/// Of a signal the recording does not tell what was in force before its first command: with `seconds` the same as then, as where a
/// recording is cut out of what went on; with `dead_time` nothing, as where a driver is switched on with the recording.
///
/// Source: dead time in a loop, Åström & Murray, *Feedback Systems* (2nd ed. 2021), section 9.2; order latency as
/// simulated time, Moallemi & Sağlam, "The cost of latency", Operations Research 61 (2013).
#[derive(Debug, Clone, Copy)]
pub struct CommandDelay {
    /// The delay's parameter, as its domain bounds it [s].
    pub longest: f64,
    /// Where fits begin [s].
    pub starts: &'static [f64],
    /// Whether commands are signals, which hold until the next: then the output is differentiable in the delay, and something
    /// may have been in force before the first.
    pub holds: bool,
}

/// Where delays differ, few are longer than so many times the usual one.
const SLOW: f64 = 3.0;
/// The form by which nothing was in force before the first command.
const FROM_REST: &str = "from_rest";

impl CommandDelay {
    /// Delays from which fits begin [s]: those that time stamps show come first.
    fn where_fits_begin(&self, typical: &Typical) -> Vec<f64> {
        // What differs from command to command is at its longest far longer than usual.
        let drawn = typical.delays.into_iter().flat_map(|[usual, _]| [SLOW * usual, usual]);
        let shown = typical.delay.into_iter().chain(drawn).filter(|delay| *delay > 0.0 && *delay <= self.longest);
        shown.chain(self.starts.iter().copied()).collect()
    }
}

impl<P: Plant> Mechanism<P> for CommandDelay {
    fn about(&self) -> About {
        About {
            name: "command_delay",
            site: Site::Command,
            title: "a delay of the command",
            law: "u(t) -> u(t - seconds); from_rest: 0 before the first command has arrived, after dead_time",
            source: "Åström & Murray, Feedback Systems (2021), 9.2; Moallemi & Sağlam, Operations Research 61 (2013)",
            remedy: "stamp commands when sent and when they take effect; add the delay to the simulator",
            contains: &[],
        }
    }

    // Buses, drivers and schedulers have other things to do, now more and now less.
    fn unsteady(&self) -> bool {
        true
    }

    fn forms(&self, typical: &Typical) -> Vec<Form> {
        let starts = self.where_fits_begin(typical);
        let delay = |name| {
            let mut delay = Parameter::new(name, "s", 0.0).within(0.0, self.longest).starting_at(&starts).in_time();
            delay.smooth = self.holds;
            delay.shown = typical.delays.filter(|[delay, _]| *delay > 0.0 && *delay <= self.longest);
            delay
        };
        let mut forms = Form::only(vec![delay("seconds")]);
        if self.holds {
            forms.push(Form { name: FROM_REST, parameters: vec![delay("dead_time")] });
        }
        forms
    }

    fn law(&self, form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<P>> {
        let seconds = thetas.row(0).to_vec();
        let line = if form == 0 { <P::Command as Command>::Line::default() } else { DelayLine::at_rest() };
        Box::new(Delay::<P> { lines: vec![line.clone(); seconds.len()], fresh: line, seconds })
    }
}

#[derive(Clone)]
struct Delay<P: Plant> {
    seconds: Vec<f64>,
    lines: Vec<<P::Command as Command>::Line>,
    /// What each line begins as.
    fresh: <P::Command as Command>::Line,
}

impl<P: Plant> Law<P> for Delay<P> {
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.seconds);
        change.memory_from(&mut self.lines, &self.fresh);
    }

    fn shape_each(&mut self, ticks: Ticks<'_>, commands: &mut [P::Command]) {
        let lanes = commands.iter_mut().zip(&mut self.lines).zip(&self.seconds).enumerate();
        lanes.for_each(|(lane, ((command, line), seconds))| line.pass(ticks.lane(lane), *seconds, command));
    }

    fn shape(&mut self, tick: Tick, commands: &mut [P::Command]) {
        for ((command, line), seconds) in commands.iter_mut().zip(&mut self.lines).zip(&self.seconds) {
            line.pass(tick, *seconds, command);
        }
    }
}

/// The past of a signal that holds its value until the next.
///
/// What leaves the line during a tick is the mean of the delayed signal over that tick, which is continuous in the
/// delay, so that a delay is fitted with derivatives although the signal steps.
#[derive(Debug, Clone, Default)]
pub struct HeldLine {
    /// Change points (time [s], value from then on), oldest first.
    past: VecDeque<(f64, f64)>,
}

impl HeldLine {
    /// A line on which the signal was 0 before its first value.
    #[must_use]
    pub fn at_zero() -> Self {
        Self { past: VecDeque::from([(f64::NEG_INFINITY, 0.0)]) }
    }

    /// Mean over `[start, start + step)` of the signal `seconds` [s] ago, after `value` has been held from `start` on.
    pub fn mean(&mut self, tick: Tick, seconds: f64, value: f64) -> f64 {
        // Before its first change a signal is taken to have held the value it has at first.
        if self.past.back().is_none_or(|(_, held)| *held != value) {
            self.past.push_back((tick.time, value));
        }
        let from = tick.time - seconds;
        while self.past.get(1).is_some_and(|(time, _)| *time <= from) {
            self.past.pop_front();
        }
        let first = self.past.front().map_or(value, |(_, v)| *v);
        if tick.step <= 0.0 || self.past.get(1).is_none_or(|(time, _)| *time >= from + tick.step) {
            return first;
        }
        let mut area = 0.0;
        let (mut since, mut held) = (from, first);
        for (time, next) in self.past.iter().skip(1).take_while(|(time, _)| *time < from + tick.step) {
            area += held * (time - since);
            (since, held) = (*time, *next);
        }
        (area + held * (from + tick.step - since)) / tick.step
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tick(index: usize, step: f64) -> Tick {
        Tick { index, time: index as f64 * step, step }
    }

    #[test]
    fn a_step_arrives_late_and_split_over_the_tick_it_falls_into() {
        let mut line = HeldLine::default();
        let out: Vec<f64> = (0..6).map(|i| line.mean(tick(i, 1.0), 1.75, if i == 0 { 0.0 } else { 1.0 })).collect();
        // The step of t = 1 s arrives at 2.75 s: a quarter of the tick from 2 s on has it.
        assert_eq!(out, [0.0, 0.0, 0.25, 1.0, 1.0, 1.0]);
    }

    /// Delays of many seconds that differ are not found from starts of a second and less.
    #[test]
    fn fits_begin_where_delays_that_differ_are() {
        let delay = CommandDelay { longest: 60.0, starts: &[0.1, 1.0], holds: false };
        let starts = |typical: Typical| delay.where_fits_begin(&typical);
        assert_eq!(starts(Typical::default()), [0.1, 1.0]);
        assert_eq!(starts(Typical { delays: Some([14.0, 0.5]), ..Typical::default() }), [42.0, 14.0, 0.1, 1.0]);
        assert_eq!(
            starts(Typical { delays: Some([30.0, 0.5]), ..Typical::default() }),
            [30.0, 0.1, 1.0],
            "90 s are too long"
        );
    }

    #[test]
    fn before_the_first_command_arrives_there_is_nothing_or_the_same() {
        let arriving = |mut line: HeldLine| -> Vec<f64> {
            (0..6).map(|i| line.mean(tick(i, 1.0), 1.75, if i < 3 { 4.0 } else { 8.0 })).collect()
        };
        assert_eq!(arriving(HeldLine::default()), [4.0, 4.0, 4.0, 4.0, 5.0, 8.0]);
        assert_eq!(arriving(HeldLine::at_zero()), [0.0, 1.0, 4.0, 4.0, 5.0, 8.0]);
    }

    #[test]
    fn no_delay_changes_no_bit() {
        for mut line in [HeldLine::default(), HeldLine::at_zero()] {
            for i in 0..100 {
                let value = (i as f64 * 0.7).cos();
                assert_eq!(line.mean(tick(i, 0.001), 0.0, value), value);
            }
        }
    }

    #[test]
    fn the_line_forgets_what_has_left_it() {
        let mut line = HeldLine::default();
        for i in 0..10_000 {
            line.mean(tick(i, 0.001), 0.01, i as f64);
        }
        assert!(line.past.len() < 20);
    }
}
