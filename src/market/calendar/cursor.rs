//! A calendar asked at every event: it remembers until when its last answer holds.

use std::sync::Arc;

use crate::sim2real::Timestamp;

use super::{Calendar, Hours};

/// A place in a calendar, which moves with the times it is asked for.
///
/// As long as these stay between an open and a close, or a close and an open, an answer is two comparisons. Times may go
/// back: answers never depend on what was asked before.
#[derive(Debug, Clone)]
pub struct Trading {
    calendar: Arc<Calendar>,
    /// Answers hold from here,
    from: Timestamp,
    /// to before here.
    until: Timestamp,
    session: Option<Hours>,
    next: Option<Hours>,
    previous_close: Option<Timestamp>,
}

impl Trading {
    /// A place in `calendar`.
    #[must_use]
    pub fn new(calendar: Arc<Calendar>) -> Self {
        // Nothing is known yet: no time is from the last instant to before the first.
        let (from, until) = (Timestamp::MAX, Timestamp::MIN);
        Self { calendar, from, until, session: None, next: None, previous_close: None }
    }

    /// Whether the market is open; as [`Calendar::is_open`].
    #[inline]
    pub fn is_open(&mut self, time: Timestamp) -> bool {
        self.move_to(time);
        self.session.is_some()
    }

    /// The session at `time`; as [`Calendar::session_at`].
    #[inline]
    pub fn session_at(&mut self, time: Timestamp) -> Option<Hours> {
        self.move_to(time);
        self.session
    }

    /// The next session; as [`Calendar::next_session`].
    #[inline]
    pub fn next_session(&mut self, after: Timestamp) -> Option<Hours> {
        self.move_to(after);
        self.next
    }

    /// The last close; as [`Calendar::previous_close`].
    #[inline]
    pub fn previous_close(&mut self, time: Timestamp) -> Option<Timestamp> {
        self.move_to(time);
        self.previous_close
    }

    /// The session at `time`, without moving there: for whoever may only look.
    #[must_use]
    pub fn seen_at(&self, time: Timestamp) -> Option<Hours> {
        if time < self.from || time >= self.until { self.calendar.session_at(time) } else { self.session }
    }

    /// The calendar.
    #[must_use]
    pub fn calendar(&self) -> &Calendar {
        &self.calendar
    }

    #[inline]
    fn move_to(&mut self, time: Timestamp) {
        if time < self.from || time >= self.until {
            self.seek(time);
        }
    }

    #[cold]
    fn seek(&mut self, time: Timestamp) {
        self.session = self.calendar.session_at(time);
        self.next = self.calendar.next_session(time);
        self.previous_close = self.calendar.previous_close(time);
        (self.from, self.until) = match self.session {
            Some(Hours { open, close, .. }) => (open, close),
            None => {
                let next = self.next.map_or(Timestamp::MAX, |hours| hours.open);
                (self.previous_close.unwrap_or(Timestamp::MIN), next)
            }
        };
    }
}
