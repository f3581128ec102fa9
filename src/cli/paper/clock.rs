//! The clock of a paper run: when what the feed says is shown.

use std::time::{Duration, Instant};

use crate::sim2real::Timestamp;

use super::stops::Stops;

/// How fast the time of a feed goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Speed {
    /// So many times as fast as a clock.
    Times(f64),
    /// Nothing is waited for.
    Max,
}

/// Reads a speed.
pub(super) fn speed(text: &str) -> Result<Speed, String> {
    if text == "max" {
        return Ok(Speed::Max);
    }
    let number = text.parse().ok().filter(|speed: &f64| speed.is_finite() && *speed > 0.0);
    number.map(Speed::Times).ok_or_else(|| format!("expected a number greater than 0, or max, found {text:?}"))
}

/// Longest time without a look at what may stop the run.
const LOOK: Duration = Duration::from_millis(50);

/// Turns times of the feed into times of the clock on the wall.
#[derive(Debug)]
pub(super) struct PaperClock {
    speed: Speed,
    /// An instant, and the time of the feed then.
    begun: Option<(Instant, Timestamp)>,
    due: Option<Instant>,
}

impl PaperClock {
    pub fn new(speed: Speed) -> Self {
        Self { speed, begun: None, due: None }
    }

    /// How long it is to `time`, from the first time asked for on; nothing where that is past.
    pub fn left(&mut self, time: Timestamp) -> Duration {
        let Speed::Times(speed) = self.speed else { return Duration::ZERO };
        let now = Instant::now();
        let (begun, from) = *self.begun.get_or_insert((now, time));
        let seconds = (time.0 as f64 - from.0 as f64) / Timestamp::NANOS as f64 / speed;
        // What is beyond what a clock can count is never.
        let after = Duration::try_from_secs_f64(seconds.max(0.0)).unwrap_or(Duration::MAX);
        self.due = begun.checked_add(after);
        self.due.map_or(Duration::MAX, |due| due.saturating_duration_since(now))
    }

    /// Waits for `time`, or until something stops the run.
    pub fn wait(&mut self, time: Timestamp, stops: &Stops) {
        loop {
            let left = self.left(time);
            if left.is_zero() || stops.asked().is_some() {
                return;
            }
            std::thread::sleep(left.min(LOOK));
        }
    }

    /// How far behind the clock the run is [s].
    pub fn lag(&self) -> f64 {
        self.due.map_or(0.0, |due| Instant::now().saturating_duration_since(due).as_secs_f64())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speeds_are_numbers_above_0_or_max() {
        assert_eq!((speed("max"), speed("2.5")), (Ok(Speed::Max), Ok(Speed::Times(2.5))));
        for wrong in ["", "0", "-1", "nan", "inf", "fast"] {
            assert!(speed(wrong).unwrap_err().contains("or max"), "{wrong}");
        }
    }

    #[test]
    fn time_goes_at_its_speed_from_the_first_that_was_asked_for() {
        let mut clock = PaperClock::new(Speed::Times(10.0));
        assert!(clock.left(Timestamp(5)).is_zero());
        let left = clock.left(Timestamp(5 + 100 * Timestamp::NANOS)).as_secs_f64();
        assert!((9.0..=10.0).contains(&left), "{left}");
        assert!(clock.left(Timestamp(i64::MAX)) > Duration::from_secs(60) && clock.left(Timestamp::MIN).is_zero());
        assert!(PaperClock::new(Speed::Max).left(Timestamp(7)).is_zero());
    }
}
