//! What is due: messages on their way, bars that open, orders that expire; in the order of time.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::sim2real::Timestamp;

use super::{OrderId, Price, Quantity};

/// What comes first at one instant.
///
/// What was sent earlier and arrives now meets the market as it was before the data of this instant; what is decided now, without a
/// delay, meets the market with all of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Phase {
    /// Before the data of the instant.
    Before,
    /// Dividends and splits; bars that end at the instant go before them.
    Acts,
    /// The data themselves.
    Data,
    /// The auction at the close of a day of trading: what the instant brought counts, what comes later does not.
    Closes,
    /// What ends with the instant.
    Ends,
    /// Messages that took no time.
    AtOnce,
    /// Bars that open.
    Opens,
    /// What became of orders: nothing that is decided at an instant rests on it.
    Notices,
}

/// Something due.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Due {
    /// An order arrives at the venue, with those that were sent with it.
    Arrive(OrderId),
    /// The request to take an order back arrives.
    Cancel(OrderId),
    /// The request to change an order arrives.
    Replace(OrderId, Option<Quantity>, Option<Price>),
    /// A bar of an instrument opens.
    Open(usize),
    /// The day of trading of an instrument closes.
    Close(usize),
    /// An order's time is over.
    Expire(OrderId),
    /// What became of an order is known to its owner: the place of the notice.
    Notice(usize),
    /// The strategy asked to be woken.
    Wake,
    /// The broker takes an order back.
    Revoke(OrderId),
    /// A dividend or a split, by its number.
    Action(usize),
    /// Parameters are drawn anew: the number of their group.
    Redraw(usize),
}

/// What is due, in the order of time, phase, and then in the order in which it was put down.
///
/// What is due first stands before a heap of the rest: nearly always there is no rest.
#[derive(Debug, Clone, Default)]
pub(super) struct Agenda {
    first: Option<Entry>,
    rest: BinaryHeap<Reverse<Entry>>,
    entries: u64,
}

/// Something due, and when. The number of an entry is its own, so that what is due never decides.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Entry {
    at: Timestamp,
    phase: Phase,
    number: u64,
    due: Due,
}

impl Agenda {
    pub fn put(&mut self, at: Timestamp, phase: Phase, due: Due) {
        self.entries += 1;
        let entry = Entry { at, phase, number: self.entries, due };
        match &mut self.first {
            None => self.first = Some(entry),
            Some(first) if entry < *first => self.rest.push(Reverse(std::mem::replace(first, entry))),
            Some(_) => self.rest.push(Reverse(entry)),
        }
    }

    /// So many things were due, one after the other with nothing between, and have happened.
    #[inline]
    pub fn passed(&mut self, count: u64) {
        self.entries += count;
    }

    /// Whether nothing is due.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.first.is_none()
    }

    /// When the next is due, and in which phase.
    #[inline]
    pub fn peek(&self) -> Option<(Timestamp, Phase)> {
        self.first.as_ref().map(|entry| (entry.at, entry.phase))
    }

    /// What is due next.
    pub fn next_due(&self) -> Option<Due> {
        self.first.as_ref().map(|entry| entry.due)
    }

    /// Changes what is due, and drops that of which nothing is left; all else stays in its order.
    pub fn revise(&mut self, mut revised: impl FnMut(Due) -> Option<Due>) {
        // Sorted, what is due first comes last.
        let all = std::mem::take(&mut self.rest).into_sorted_vec();
        let all = self.first.take().into_iter().chain(all.into_iter().rev().map(|Reverse(entry)| entry));
        let mut kept = all.filter_map(|entry| Some(Entry { due: revised(entry.due)?, ..entry }));
        self.first = kept.next();
        self.rest = kept.map(Reverse).collect();
    }

    #[inline]
    pub fn pop(&mut self) -> Option<(Timestamp, Due)> {
        let next = if self.rest.is_empty() { None } else { self.rest.pop().map(|Reverse(entry)| entry) };
        std::mem::replace(&mut self.first, next).map(|entry| (entry.at, entry.due))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn at_one_instant_phases_come_in_order_and_then_what_was_put_down_first() {
        let mut agenda = Agenda::default();
        let at = Timestamp;
        for (time, phase, id) in
            [(5, Phase::AtOnce, 1), (5, Phase::Before, 2), (4, Phase::Notices, 3), (5, Phase::AtOnce, 4)]
        {
            agenda.put(at(time), phase, Due::Arrive(OrderId(id)));
        }
        let order: Vec<Due> = std::iter::from_fn(|| agenda.pop().map(|(_, due)| due)).collect();
        assert_eq!(order, [3, 2, 1, 4].map(|id| Due::Arrive(OrderId(id))));
    }

    proptest! {
        #[test]
        fn it_is_a_list_in_order(steps in proptest::collection::vec((0..6_i64, 0..3_usize, any::<bool>()), 0..60)) {
            let (mut agenda, mut list) = (Agenda::default(), Vec::new());
            for (k, (time, phase, put)) in steps.into_iter().enumerate() {
                let (at, phase) = (Timestamp(time), [Phase::Before, Phase::Data, Phase::Notices][phase]);
                if put {
                    agenda.put(at, phase, Due::Notice(k));
                    list.push((at, phase, k));
                    list.sort();
                } else {
                    let first = if list.is_empty() { None } else { Some(list.remove(0)) };
                    prop_assert_eq!(agenda.pop(), first.map(|(at, _, k)| (at, Due::Notice(k))));
                }
                prop_assert_eq!(agenda.peek(), list.first().map(|(at, phase, _)| (*at, *phase)));
            }
        }
    }

    #[test]
    fn what_is_revised_stays_in_its_order_and_is_seen_in_it() {
        let mut agenda = Agenda::default();
        for (time, id) in [(5, 1), (3, 2), (5, 3), (4, 4)] {
            agenda.put(Timestamp(time), Phase::AtOnce, Due::Arrive(OrderId(id)));
        }
        let mut seen = Vec::new();
        agenda.revise(|due| {
            seen.push(due);
            match due {
                Due::Arrive(OrderId(4)) => None,
                Due::Arrive(OrderId(1)) => Some(Due::Revoke(OrderId(1))),
                other => Some(other),
            }
        });
        assert_eq!(seen, [2, 4, 1, 3].map(|id| Due::Arrive(OrderId(id))));
        assert_eq!(agenda.next_due(), Some(Due::Arrive(OrderId(2))));
        let order: Vec<Due> = std::iter::from_fn(|| agenda.pop().map(|(_, due)| due)).collect();
        assert_eq!(order, [Due::Arrive(OrderId(2)), Due::Revoke(OrderId(1)), Due::Arrive(OrderId(3))]);
    }
}
