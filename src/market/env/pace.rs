//! How often an environment takes a step.

use crate::market::{EventKind, Orders, View};
use crate::sim2real::Timestamp;

/// When a step is due.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pace {
    /// At every so many events of data, at least 1.
    Events(u32),
    /// When bars became known: of several instruments, when all bars of the instant are.
    Bars,
    /// Every so many seconds, at least a nanosecond, in which there was an event.
    Seconds(f64),
}

/// A pace under way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pacer {
    pace: Pace,
    /// Whether bars of several instruments come at one instant.
    several: bool,
    /// Events that still go by before anybody decides.
    warm_up: usize,
    events: u32,
    /// When it is to be woken; none before it first was.
    wakes_at: Option<Timestamp>,
}

impl Pacer {
    pub fn new(pace: Pace, several: bool, warm_up: usize) -> Self {
        Self { pace, several, warm_up, events: 0, wakes_at: None }
    }

    /// Sees an event, and says whether a step is due at it. It may ask to be woken.
    #[inline]
    pub fn sees(&mut self, view: &View<'_>, orders: &mut Orders) -> bool {
        let event = view.event();
        let of_data = event.kind != EventKind::Timer;
        if of_data && self.warm_up > 0 {
            self.warm_up -= 1;
            return false;
        }
        match self.pace {
            Pace::Events(every) if of_data => {
                self.events += 1;
                let due = self.events >= every;
                if due {
                    self.events = 0;
                }
                due
            }
            Pace::Events(_) => false,
            Pace::Bars if self.several => self.after_the_instant(event.kind, event.time, orders),
            Pace::Bars => event.kind == EventKind::Bar,
            Pace::Seconds(seconds) => self.by_the_clock(seconds, of_data, event.time, orders),
        }
    }

    /// Is woken once all bars of an instant are known.
    fn after_the_instant(&mut self, kind: EventKind, now: Timestamp, orders: &mut Orders) -> bool {
        if kind == EventKind::Timer {
            return self.wakes_at == Some(now);
        }
        if kind == EventKind::Bar && self.wakes_at != Some(now) {
            self.wakes_at = Some(now);
            orders.wake_at(now);
        }
        false
    }

    /// Is woken by the clock, and sleeps on where nothing happened meanwhile.
    fn by_the_clock(&mut self, seconds: f64, of_data: bool, now: Timestamp, orders: &mut Orders) -> bool {
        let next = || now + ((seconds * Timestamp::NANOS as f64) as i64).max(1);
        if of_data {
            self.events = self.events.saturating_add(1);
            if self.wakes_at.is_none_or(|at| now > at) {
                // The first event, or the first after a silence: the clock begins anew.
                let first = self.wakes_at.is_none();
                if first {
                    self.events = 0;
                }
                self.wakes_at = Some(next());
                orders.wake_at(next());
                return first;
            }
            return false;
        }
        if self.wakes_at != Some(now) || self.events == 0 {
            return false;
        }
        self.events = 0;
        self.wakes_at = Some(next());
        orders.wake_at(next());
        true
    }
}
