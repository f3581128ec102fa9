//! Where orders that rest stand: what the laws of the plant have for them, beside what the data display.

use crate::market::{ExecutionEffect, InFlight, Met, OrderKind, Role};
use crate::sim2real::{Tick, Timestamp};

use super::floor::Floor;
use super::queue::Place;

impl Floor {
    /// What the laws have for an order that rests, which meets `met`: it is asked for, and nothing happens. Laws remember those
    /// alone who take.
    pub(super) fn ask(&mut self, order: &InFlight, met: Met, at: Timestamp) -> ExecutionEffect {
        // No message: those that follow keep their numbers.
        let tick = Tick { index: self.messages, time: at.seconds_since(self.rules.origin), step: 0.0 };
        self.run.deliver(&[order.as_a(Role::Maker)]);
        let mut whole = ExecutionEffect::default();
        self.run.advance_seen(tick, |_| met, |_, effects| whole = effects.first().copied().unwrap_or_default());
        whole
    }

    /// What stands ahead of order `k` beside the `displayed` [units] where it joins [units].
    fn beyond(&mut self, k: usize, displayed: f64, at: Timestamp) -> f64 {
        // A run without a law of queues has nothing to ask for.
        let Some(limit) = self.resting[k].limit().filter(|_| self.asks_queue) else { return 0.0 };
        let order = self.resting[k].order;
        let met = Met { displayed, ..Met::at(self.shown.book(at), limit.to_f64(), f64::INFINITY) };
        self.ask(&order, met, at).ahead
    }

    /// Order `k`, if it has a limit and no place yet, joins the end of the queue at its price.
    pub(super) fn join(&mut self, k: usize, at: Timestamp) {
        let order = &self.resting[k];
        if let (OrderKind::Limit { price }, true) = (order.kind, order.place == Place::default()) {
            let displayed = self.shown.displayed_at(order.side, self.moved.level(order.side, price));
            let beyond = self.beyond(k, displayed, at);
            self.resting[k].place = Place::behind(displayed, beyond, self.others.events());
        }
    }

    /// The price of order `k` has come into view: no more of what is displayed can be ahead than is there.
    pub(super) fn come_into_view(&mut self, k: usize, displayed: f64, at: Timestamp) {
        let beyond = if self.resting[k].place.is_unknown() { Some(self.beyond(k, displayed, at)) } else { None };
        self.resting[k].place.in_view(displayed, beyond);
    }
}
