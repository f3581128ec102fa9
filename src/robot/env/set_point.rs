//! Where a servo is to be: a set point that steps or moves.

use std::f64::consts::TAU;

use crate::rl::{Episode, SplitMix64, StreamName};

/// Names the stream of set points.
const SET_POINT: StreamName = StreamName::new("set point");
/// How long a step holds at the least and at the most [s].
const HOLDS: [f64; 2] = [0.5, 1.5];
/// Slowest and fastest sine [Hz].
const FREQUENCIES: [f64; 2] = [0.1, 1.0];

/// How a set point moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Course {
    /// It holds, and then jumps.
    Steps,
    /// The sum of two sines.
    Sines,
    /// Either, episode by episode.
    Mixed,
}

/// The names of courses, as an option has them.
pub(super) const COURSES: [(&str, Course); 3] =
    [("steps", Course::Steps), ("sines", Course::Sines), ("mixed", Course::Mixed)];

/// The set point of one lane under way. With the stream of its episode it depends on the time alone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum SetPoint {
    /// It holds.
    Steps {
        /// Where it is.
        value: f64,
        /// Until when [s].
        until: f64,
        /// Farthest from 0.
        reach: f64,
        /// What the next are drawn from.
        draws: SplitMix64,
    },
    /// It moves.
    Sines {
        /// Amplitude, angular frequency [rad/s] and phase [rad] of each.
        waves: [[f64; 3]; 2],
    },
}

impl SetPoint {
    /// That of an episode, within `reach` of 0.
    pub fn begin(course: Course, reach: f64, episode: Episode) -> Self {
        let mut draws = episode.stream(SET_POINT);
        let moves = match course {
            Course::Steps => false,
            Course::Sines => true,
            Course::Mixed => draws.uniform() < 0.5,
        };
        if moves {
            let [slow, fast] = FREQUENCIES.map(f64::ln);
            let mut wave = || {
                let amplitude = 0.5 * reach * draws.between(0.2, 1.0);
                [amplitude, TAU * draws.between(slow, fast).exp(), draws.between(0.0, TAU)]
            };
            return Self::Sines { waves: [wave(), wave()] };
        }
        let value = draws.between(-reach, reach);
        let until = draws.between(HOLDS[0], HOLDS[1]);
        Self::Steps { value, until, reach, draws }
    }

    /// Where it is at `seconds` [s], no earlier than when it was asked for before, and how fast it moves.
    pub fn at(&mut self, seconds: f64) -> (f64, f64) {
        match self {
            Self::Steps { value, until, reach, draws } => {
                while seconds >= *until {
                    *value = draws.between(-*reach, *reach);
                    *until += draws.between(HOLDS[0], HOLDS[1]);
                }
                (*value, 0.0)
            }
            Self::Sines { waves } => waves.iter().fold((0.0, 0.0), |(value, rate), [amplitude, frequency, phase]| {
                let (sin, cos) = (frequency * seconds + phase).sin_cos();
                (value + amplitude * sin, rate + amplitude * frequency * cos)
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_hold_and_jump_within_reach() {
        let mut point = SetPoint::begin(Course::Steps, 0.8, Episode { seed: 4, number: 1 });
        let values: Vec<f64> = (0..10_000).map(|k| point.at(f64::from(k) * 0.01).0).collect();
        assert!(values.iter().all(|v| v.abs() <= 0.8));
        let jumps: Vec<usize> = (1..values.len()).filter(|k| values[*k] != values[*k - 1]).collect();
        assert!((70..140).contains(&jumps.len()), "{} jumps in 100 s", jumps.len());
        assert!(jumps.windows(2).all(|w| (49..=151).contains(&(w[1] - w[0]))));
    }

    #[test]
    fn sines_move_at_the_rate_they_say() {
        let mut point = SetPoint::begin(Course::Sines, 0.8, Episode { seed: 4, number: 1 });
        for k in 1..1_000 {
            let time = f64::from(k) * 0.01;
            let (value, rate) = point.at(time);
            let slope = (point.at(time + 1e-6).0 - point.at(time - 1e-6).0) / 2e-6;
            assert!(value.abs() <= 0.8 && (rate - slope).abs() < 1e-6);
        }
    }

    #[test]
    fn mixed_is_either() {
        let moving = (0..200).filter(|seed| {
            let episode = Episode { seed: *seed, number: 0 };
            matches!(SetPoint::begin(Course::Mixed, 1.0, episode), SetPoint::Sines { .. })
        });
        assert!((70..130).contains(&moving.count()));
    }
}
