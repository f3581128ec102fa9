//! How long a message takes.

use crate::rl::{About, SplitMix64};

/// How long messages are under way: a whole number of steps, or any time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Latency {
    /// Shortest and longest.
    range: [f64; 2],
    unit: Unit,
    redraw: Redraw,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Unit {
    Steps,
    Seconds,
}

/// For what a latency is drawn anew.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Redraw {
    /// For each message: jitter. What was sent later may arrive first; what is then late is not used.
    #[default]
    Message,
    /// When an episode begins: each lane has one latency throughout.
    Episode,
}

impl Latency {
    /// Always so many steps.
    #[must_use]
    pub fn steps(steps: u32) -> Self {
        Self::steps_between(steps, steps)
    }

    /// A whole number of steps, each as likely as any other from `low` to `high`, both included.
    #[must_use]
    pub fn steps_between(low: u32, high: u32) -> Self {
        Self { range: [low.into(), high.into()], unit: Unit::Steps, redraw: Redraw::Message }
    }

    /// A time [s], evenly spread from `mean - jitter` to `mean + jitter`.
    #[must_use]
    pub fn seconds(mean: f64, jitter: f64) -> Self {
        Self { range: [mean - jitter, mean + jitter], unit: Unit::Seconds, redraw: Redraw::Message }
    }

    /// Drawn on this occasion.
    #[must_use]
    pub fn drawn(self, redraw: Redraw) -> Self {
        Self { redraw, ..self }
    }

    /// As it is in `about`, or why it cannot be, and the remedy.
    pub(super) fn within(self, about: &About) -> Result<Steps, [String; 2]> {
        let [low, high] = self.range;
        let refuse = |why: &str, remedy: &str| Err([why.to_owned(), remedy.to_owned()]);
        if !(low >= 0.0 && high >= low && high.is_finite()) {
            return refuse(
                &format!("the latency is from {low} to {high}"),
                "give one of at least 0, and jitter up to the mean",
            );
        }
        let factor = match (self.unit, about.seconds_a_step) {
            (Unit::Steps, _) => 1.0,
            (Unit::Seconds, Some(seconds)) => seconds.recip(),
            (Unit::Seconds, None) => return refuse("its steps are not equally long", "give the latency in steps"),
        };
        let steps = Steps { low: low * factor, high: high * factor, whole: self.unit == Unit::Steps, redraw: self.redraw };
        if steps.high > LONGEST {
            let why = format!("the latency is up to {} steps, of which all messages would be kept", steps.high);
            return refuse(&why, &format!("give one of up to {LONGEST} steps"));
        }
        Ok(steps)
    }
}

/// The longest latency [steps]: memory for all messages under way is kept.
const LONGEST: f64 = 4096.0;

/// A latency in steps of an environment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Steps {
    low: f64,
    high: f64,
    whole: bool,
    pub redraw: Redraw,
}

impl Steps {
    /// The longest.
    pub fn longest(&self) -> usize {
        self.high.ceil() as usize
    }

    /// The latency, where all messages have the same.
    pub fn fixed(&self) -> Option<f64> {
        (self.low == self.high).then_some(self.low)
    }

    /// One that is drawn.
    #[inline]
    pub fn draw(&self, stream: &mut SplitMix64) -> f64 {
        if self.low == self.high {
            self.low
        } else if self.whole {
            (self.low + (stream.uniform() * (self.high - self.low + 1.0)) as u64 as f64).min(self.high)
        } else {
            stream.between(self.low, self.high)
        }
    }
}

/// The least whole number that is not below `steps`, which is positive.
///
/// Where the processor has no instruction for it, `ceil` is a call, and takes longer than all else of a message.
#[inline]
pub(super) fn rounded_up(steps: f64) -> u64 {
    let whole = steps as u64;
    whole + u64::from(steps > whole as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rl::walk::{Push, Walk};
    use crate::rl::{Episode, StreamName, VecEnv};

    #[test]
    fn draws_are_evenly_spread_over_what_was_asked_for() {
        let env = Walk::new(1);
        let mut stream = Episode::default().stream(StreamName::new("latency"));
        let whole = Latency::steps_between(1, 3).within(env.about()).unwrap();
        let mut counts = [0_u32; 5];
        (0..30_000).for_each(|_| counts[whole.draw(&mut stream) as usize] += 1);
        assert_eq!([counts[0], counts[4]], [0, 0]);
        // 10,000 each, within four standard deviations of the binomial.
        assert!(counts[1..4].iter().all(|count| count.abs_diff(10_000) < 330), "{counts:?}");
        // A step takes 0.05 s: from 0.6 to 1.4 steps.
        let time = Latency::seconds(0.05, 0.02).within(env.about()).unwrap();
        assert_eq!((time.longest(), time.fixed()), (2, None));
        let all: Vec<f64> = (0..10_000).map(|_| time.draw(&mut stream)).collect();
        let (low, high) = all.iter().fold((9.0_f64, 0.0_f64), |(low, high), d| (low.min(*d), high.max(*d)));
        assert!((low - 0.6).abs() < 1e-3 && (high - 1.4).abs() < 1e-3, "{low} {high}");
        assert!((all.iter().sum::<f64>() / 1e4 - 1.0).abs() < 4.0 * 0.8 / 12.0_f64.sqrt() / 100.0);
    }

    #[test]
    fn a_part_of_a_step_counts_as_one() {
        for (steps, expected) in [(0.0, 0), (1e-300, 1), (1.0, 1), (1.25, 2), (4096.0, 4096)] {
            assert_eq!(rounded_up(steps), expected);
        }
    }

    #[test]
    fn what_cannot_be_is_refused_with_a_remedy() {
        let env = Walk::new(1);
        let why = |latency: Latency| latency.within(env.about()).unwrap_err()[0].clone();
        assert!(why(Latency::seconds(0.01, 0.02)).contains("from -0.01"));
        assert!(why(Latency::seconds(f64::NAN, 0.0)).contains("NaN"));
        assert!(why(Latency::steps_between(3, 2)).contains("from 3 to 2"));
        assert!(why(Latency::steps(5000)).contains("up to 5000 steps"));
        assert!(Latency::seconds(0.1, 0.0).within(Push::new(1).about()).unwrap_err()[1].contains("in steps"));
    }
}
