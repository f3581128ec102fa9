//! A session that is driven by a clock: it is asked what comes next and when, and goes no further.

use crate::market::{BacktestError, Event, Strategy};
use crate::sim2real::Timestamp;

use super::Session;

impl Session {
    /// When the next thing happens: a row of data, or a message that is due; none when the data have ended.
    #[must_use]
    pub fn next_due(&self) -> Option<Timestamp> {
        let next = self.next_time()?;
        Some(self.agenda.peek().map_or(next, |(at, _)| at.min(next)))
    }

    /// As [`step`](Self::step), but nothing happens that is later than `until`: none where the strategy sees nothing up to then.
    ///
    /// # Errors
    /// As [`Session::step`].
    #[inline(never)]
    pub fn step_up_to(&mut self, until: Timestamp, strategy: &mut dyn Strategy) -> Result<Option<Event>, BacktestError> {
        self.step_until(until, strategy)
    }
}
