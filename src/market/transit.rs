//! Data on their way from the exchange to the strategy.

use std::collections::VecDeque;

use crate::sim2real::Timestamp;

use super::{Arrival, Event, EventKind};

/// Data on their way, in the order in which they will be known. What comes by one line does not overtake: rows of one kind of one
/// instrument arrive in their order.
#[derive(Debug, Clone, Default)]
pub(super) struct Transit {
    way: VecDeque<(Timestamp, Arrival)>,
    /// When the last of each line arrives.
    last: Vec<Timestamp>,
}

impl Transit {
    /// Lines of one instrument.
    const KINDS: usize = 5;

    pub fn new(instruments: usize) -> Self {
        Self { way: VecDeque::new(), last: vec![Timestamp::MIN; Self::KINDS * instruments] }
    }

    /// When the next is known.
    #[inline]
    pub fn peek(&self) -> Option<Timestamp> {
        self.way.front().map(|(at, _)| *at)
    }

    pub fn pop(&mut self) -> Option<(Timestamp, Arrival)> {
        self.way.pop_front()
    }

    /// The oldest row on its way of those of the kind and instrument of `event`.
    pub fn oldest(&self, event: &Event) -> Option<usize> {
        let same = |other: &Event| (other.instrument, other.kind) == (event.instrument, event.kind);
        self.way.iter().find(|(_, arrival)| same(&arrival.event)).map(|(_, arrival)| arrival.row)
    }

    /// Puts data on their way that would be known at `at` if nothing were ahead of them.
    pub fn put(&mut self, at: Timestamp, arrival: Arrival) {
        let kind = match arrival.event.kind {
            EventKind::Bar => 0,
            EventKind::Trade => 1,
            EventKind::Depth => 2,
            EventKind::Quote => 3,
            EventKind::Timer => 4,
        };
        let line = &mut self.last[Self::KINDS * arrival.event.instrument + kind];
        let at = at.max(*line);
        *line = at;
        // Nearly always the latest of all.
        let behind = self.way.iter().rev().take_while(|(other, _)| *other > at).count();
        self.way.insert(self.way.len() - behind, (at, arrival));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::market::Event;

    #[test]
    fn a_line_does_not_overtake_itself_but_others() {
        let mut transit = Transit::new(2);
        let arrival = |row: usize, instrument, kind| {
            let event = Event { time: Timestamp(row as i64), instrument, kind };
            Arrival { event, row, end: row + 1, known_at: Timestamp(0) }
        };
        for (at, row, instrument) in [(10, 0, 0), (5, 1, 0), (7, 2, 1), (12, 3, 0), (12, 4, 1)] {
            transit.put(Timestamp(at), arrival(row, instrument, EventKind::Quote));
        }
        let order: Vec<(i64, usize)> = std::iter::from_fn(|| transit.pop()).map(|(at, a)| (at.0, a.row)).collect();
        assert_eq!(order, [(7, 2), (10, 0), (10, 1), (12, 3), (12, 4)]);
    }
}
