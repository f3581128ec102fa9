//! Following a recording row by row, and what a run says on the way.

use std::ops::Range;

use super::run::Run;
use super::{Channel, Clock, Measured, Observation, Plant, Recording, Simulated, Stimulus, Tick, Trajectory};

/// Rows that are collected before each channel of each lane is given its own: as many as stay near the processor.
const COLLECTED: usize = 64;

/// Collects observations, lane by lane and channel by channel.
pub(super) struct Collected<'a> {
    trajectories: Vec<Trajectory>,
    /// Room for rows that are not yet in the trajectories, each with all channels of the first lane, then of the second.
    collected: Vec<f64>,
    said: Said<'a>,
    rows: usize,
}

/// What a run says on the way.
pub(super) struct Said<'a> {
    /// All channels of the plant.
    channels: &'a [Channel],
    /// Numbers of those that are said.
    numbers: Vec<usize>,
    /// Rows after which all lanes go on from the state of the first, if ever.
    every: Option<usize>,
}

impl<'a> Said<'a> {
    /// All of the plant's `channels`.
    pub fn all(channels: &'a [Channel]) -> Self {
        Self { channels, numbers: (0..channels.len()).collect(), every: None }
    }

    /// Those that `recording` measures.
    pub fn measured<S>(channels: &'a [Channel], recording: &Recording<S>) -> Self {
        let numbers = (0..channels.len()).filter(|k| recording.channel(&channels[*k].name).is_some()).collect();
        Self { channels, numbers, every: None }
    }

    /// The same where every `every` rows all lanes go on from the state of the first.
    pub fn rejoined(self, every: usize) -> Self {
        Self { every: Some(every.max(1)), ..self }
    }
}

impl<'a> Collected<'a> {
    pub fn new(said: Said<'a>, lanes: usize, rows: usize) -> Self {
        let named = said.numbers.iter().map(|k| said.channels[*k].name.to_string());
        let one: Trajectory = named.map(|channel| Simulated { channel, samples: Vec::new() }).collect();
        let mut trajectories = vec![one; lanes];
        trajectories.iter_mut().flatten().for_each(|s| s.samples.reserve_exact(rows));
        let collected = vec![0.0; COLLECTED.min(rows) * lanes * said.numbers.len()];
        Self { trajectories, collected, said, rows: 0 }
    }

    /// Rows are samples: the observation of a row is taken before its command acts.
    ///
    /// Commands of the last `memory` [s] before them are sent too: what is on its way when a run starts is not lost, whatever
    /// row it starts from.
    pub fn follow_samples<P: Plant>(
        &mut self,
        run: &mut Run<P>,
        recording: &Recording<P::Stimulus>,
        rows: Range<usize>,
        clock: Clock,
        memory: f64,
    ) {
        let seen = self.said.channels.first().and_then(|first| recording.channel(&first.name));
        let since = recording.time[rows.start] - memory;
        let warm = recording.time[..rows.start].partition_point(|t| *t < since);
        for row in warm..rows.end {
            let time = recording.time[row];
            if row >= rows.start {
                self.record(run, time);
            }
            if row + 1 == rows.end {
                break;
            }
            let interval = recording.time[row + 1] - time;
            let substeps = clock.substeps(interval);
            let step = interval / substeps as f64;
            for sub in 0..substeps {
                let tick = Tick { index: row, time: time + sub as f64 * step, step };
                let share = (sub as f64 + 0.5) / substeps as f64;
                let command = recording.stimulus.command_within(row, share);
                if row < rows.start {
                    let along = sub as f64 / substeps as f64;
                    run.send_before(tick, &command, seen.and_then(|seen| between(seen, row, along)));
                    continue;
                }
                // The row itself has been observed.
                if sub > 0 && run.watched(tick.time) {
                    run.observe(tick.time);
                }
                run.send(tick, &command);
                run.advance(tick, |arriving| recording.stimulus.input(row, arriving));
            }
        }
    }

    /// Rows are messages: the observation of a row is the reply to its command.
    ///
    /// Messages of the last `memory` [s] before them are answered too, and nobody hears of it: what they left behind is met.
    pub fn follow_events<P: Plant>(
        &mut self,
        run: &mut Run<P>,
        recording: &Recording<P::Stimulus>,
        rows: Range<usize>,
        memory: f64,
    ) {
        let since = recording.time.get(rows.start).map_or(0.0, |start| start - memory);
        let warm = recording.time[..rows.start].partition_point(|t| *t < since);
        for row in warm..rows.end {
            let tick = Tick { index: row, time: recording.time[row], step: 0.0 };
            run.send(tick, &recording.stimulus.command(row));
            run.advance(tick, |arriving| recording.stimulus.input(row, arriving));
            if row >= rows.start {
                self.record(run, tick.time);
            } else {
                run.observe(tick.time);
            }
        }
    }

    /// Numbers in a row of all lanes.
    fn width(&self) -> usize {
        self.trajectories.len() * self.said.numbers.len()
    }

    fn record<P: Plant>(&mut self, run: &mut Run<P>, time: f64) {
        let width = self.width();
        let row = &mut self.collected[(self.rows % COLLECTED) * width..][..width];
        let numbers = &self.said.numbers;
        let observed = run.observe(time);
        for (values, observation) in row.chunks_exact_mut(numbers.len().max(1)).zip(observed) {
            values.iter_mut().zip(numbers).for_each(|(value, k)| *value = observation.channel(*k));
        }
        if self.said.every.is_some_and(|every| self.rows.is_multiple_of(every)) {
            run.rejoin();
        }
        self.rows += 1;
        if self.rows.is_multiple_of(COLLECTED) {
            self.sort(COLLECTED);
        }
    }

    /// Gives each channel of each lane what was collected of it in the last `rows` rows.
    fn sort(&mut self, rows: usize) {
        let width = self.width();
        for (at, simulated) in self.trajectories.iter_mut().flatten().enumerate() {
            simulated.samples.extend(self.collected[..rows * width].chunks_exact(width).map(|row| row[at]));
        }
    }

    /// All that was collected.
    pub fn trajectories(mut self) -> Vec<Trajectory> {
        self.sort(self.rows % COLLECTED);
        self.trajectories
    }
}

/// The sample `along` of the way from a row to the next, on a straight line; none where one was lost.
fn between(measured: &Measured, row: usize, along: f64) -> Option<f64> {
    let (from, to) = (measured.samples[row]?, measured.samples[row + 1]?);
    Some(from + along * (to - from))
}
