//! Observations that arrive late.

use super::delay_line::{DelayLine, FixedLine};
use super::latency::{Latency, Redraw, Steps, rounded_up};
use super::layer::{Layer, copy_row, refused};
use crate::rl::{About, Actions, EnvError, Episodes, Out, SplitMix64, StreamName, Which};

/// The learner is shown the newest observation that has arrived. It looks at the times of steps: an observation under way for a
/// fraction of a step is seen from the next step on. That of the reset arrives at once. Rewards and ends are not late.
#[derive(Debug, Clone)]
pub struct ObservationLatency {
    latency: Latency,
    name: StreamName,
    line: Line,
    size: usize,
}

#[derive(Debug, Clone)]
enum Line {
    Fixed(FixedLine<f32>),
    Drawn { line: DelayLine<f32>, steps: Steps, streams: Vec<SplitMix64>, episode: Vec<u64> },
}

impl ObservationLatency {
    /// Observations are under way so long.
    #[must_use]
    pub fn new(latency: Latency) -> Self {
        let line = Line::Fixed(FixedLine::new(0, 0, 0));
        Self { latency, name: StreamName::new("observation_latency"), line, size: 0 }
    }

    /// The same with draws from the stream of this name, to tell two of them apart.
    #[must_use]
    pub fn named(self, name: &str) -> Self {
        Self { name: StreamName::new(name), ..self }
    }
}

impl Layer for ObservationLatency {
    const NAME: &'static str = "a latency of observations";

    fn prepare(&mut self, about: &mut About, lanes: usize) -> Result<(), EnvError> {
        let steps = self.latency.within(about).map_err(|[why, remedy]| refused::<Self>(about, why, remedy))?;
        self.size = about.observation.size();
        self.line = match steps.fixed() {
            Some(delay) => Line::Fixed(FixedLine::new(lanes, self.size, delay.ceil() as usize)),
            None => Line::Drawn {
                line: DelayLine::new(lanes, self.size, steps.longest()),
                steps,
                streams: vec![SplitMix64::default(); lanes],
                episode: vec![0; lanes],
            },
        };
        Ok(())
    }

    fn begin(&mut self, which: Which<'_>, episodes: &Episodes, observations: &mut [f32]) {
        for (lane, row) in observations.chunks_exact(self.size.max(1)).enumerate() {
            if !which.has(lane) {
                continue;
            }
            match &mut self.line {
                Line::Fixed(line) => line.begin(lane, row),
                Line::Drawn { line, steps, streams, episode } => {
                    line.begin(lane, row);
                    streams[lane] = episodes.lane(lane).stream(self.name);
                    episode[lane] = rounded_up(steps.draw(&mut streams[lane]));
                }
            }
        }
    }

    fn sense(&mut self, _: Actions<'_>, out: &mut Out<'_>) {
        match &mut self.line {
            Line::Fixed(line) => line.exchange(out.observations),
            Line::Drawn { line, steps, streams, episode } => {
                for (lane, row) in out.observations.chunks_exact_mut(self.size.max(1)).enumerate() {
                    let now = line.sent(lane) + 1;
                    let delay = match steps.redraw {
                        Redraw::Message => rounded_up(steps.draw(&mut streams[lane])),
                        Redraw::Episode => episode[lane],
                    };
                    line.send(lane, row, now + delay);
                    row.copy_from_slice(line.newest(lane, now));
                }
            }
        }
    }

    fn holds(&self, other: &Self) -> bool {
        self.latency == other.latency
    }

    fn copy_lane(&mut self, other: Option<&Self>, from: usize, to: usize) {
        match (&mut self.line, other.map(|other| &other.line)) {
            (Line::Fixed(line), Some(Line::Fixed(other))) => line.copy_lane(Some(other), from, to),
            (Line::Fixed(line), _) => line.copy_lane(None, from, to),
            (
                Line::Drawn { line, streams, episode, .. },
                Some(Line::Drawn { line: other, streams: others, episode: their, .. }),
            ) => {
                line.copy_lane(Some(other), from, to);
                copy_row(streams, Some(others), 1, from, to);
                copy_row(episode, Some(their), 1, from, to);
            }
            (Line::Drawn { line, streams, episode, .. }, _) => {
                line.copy_lane(None, from, to);
                copy_row(streams, None, 1, from, to);
                copy_row(episode, None, 1, from, to);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Wrap;
    use super::*;
    use crate::rl::walk::{Push, Walk};
    use crate::rl::{Buffers, Options, VecEnv};

    /// The step at which each shown observation was taken, which the second component tells.
    fn shown(latency: Latency, lanes: usize, seed: u64, steps: usize) -> Vec<Vec<f32>> {
        let mut env = Walk::new(lanes).with(ObservationLatency::new(latency)).unwrap();
        let mut buffers = Buffers::of(&env);
        let seeds: Vec<u64> = (0..lanes as u64).map(|lane| seed + lane).collect();
        env.reset(Which::All, Some(&seeds), &Options::new(), &mut buffers.observations).unwrap();
        let mut all = Vec::new();
        for _ in 0..steps {
            env.step(Actions::Continuous(&vec![0.0; lanes]), &mut buffers.out()).unwrap();
            all.push(buffers.observations.chunks(2).map(|row| row[1]).collect());
        }
        all
    }

    #[test]
    fn a_fixed_latency_shows_what_was_so_many_steps_ago() {
        assert_eq!(shown(Latency::steps(0), 2, 1, 3), [[1.0; 2], [2.0; 2], [3.0; 2]]);
        assert_eq!(shown(Latency::steps(2), 2, 1, 5), [[0.0; 2], [0.0; 2], [1.0; 2], [2.0; 2], [3.0; 2]]);
        // 0.06 s are 1.2 steps: seen after two.
        assert_eq!(shown(Latency::seconds(0.06, 0.0), 1, 1, 3), [[0.0], [0.0], [1.0]]);
    }

    #[test]
    fn a_drawn_latency_never_shows_what_has_not_arrived_and_never_goes_back() {
        let all = shown(Latency::steps_between(1, 4), 50, 3, 400);
        let mut ages = [0_u32; 6];
        for lane in 0..50 {
            for (step, row) in all.iter().enumerate() {
                let age = step + 1 - row[lane] as usize;
                assert!((1..=4).contains(&age), "{age}");
                assert!(step == 0 || row[lane] >= all[step - 1][lane]);
                if step >= 4 {
                    ages[age] += 1;
                }
            }
        }
        // The age is 1 where the newest took 1 (1/4); over 1 where it took more; 4 only where none of three newer has arrived:
        // 3/4 * 2/4 * 1/4.
        let n = f64::from(ages.iter().sum::<u32>());
        for (age, share) in [(1, 0.25), (2, 0.75 * 0.5), (3, 0.75 * 0.5 * 0.75), (4, 0.75 * 0.5 * 0.25)] {
            let found = f64::from(ages[age]) / n;
            assert!((found - share).abs() < 0.02, "{age}: {found} for {share}");
        }
    }

    #[test]
    fn a_latency_of_an_episode_is_the_same_throughout() {
        let all = shown(Latency::steps_between(0, 3).drawn(Redraw::Episode), 40, 5, 10);
        let mut seen = [false; 4];
        for lane in 0..40 {
            let ages: Vec<usize> = (4..).zip(&all[4..10]).map(|(step, all)| step + 1 - all[lane] as usize).collect();
            assert!(ages.iter().all(|age| *age == ages[0]));
            seen[ages[0]] = true;
        }
        assert_eq!(seen, [true; 4]);
    }

    #[test]
    fn a_lane_of_another_latency_has_no_place() {
        let late = |steps| Walk::new(1).with(ObservationLatency::new(Latency::steps(steps))).unwrap();
        let error = late(2).copy_lane_from(&late(3), 0, 0).unwrap_err().to_string();
        assert!(error.contains("a latency of observations is set otherwise"), "{error}");
        assert!(late(2).copy_lane_from(&late(2), 0, 0).is_ok());
    }

    #[test]
    fn steps_of_no_fixed_length_need_a_latency_in_steps() {
        let error = Push::new(1).with(ObservationLatency::new(Latency::seconds(0.1, 0.0))).unwrap_err().to_string();
        assert!(error.starts_with("a latency of observations cannot be put around `test/Push-v0`"), "{error}");
        assert!(error.ends_with("hint: give the latency in steps"));
    }
}
