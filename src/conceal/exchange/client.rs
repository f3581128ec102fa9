//! The client: when it decides, how much, and when that reaches the exchange.

use std::collections::VecDeque;

use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};

use crate::sim2real::Seed;

use super::agents::Climate;
use super::order_book::Side;
use super::{ClientOrder, Exchange};

/// What the client does at a moment.
#[derive(Debug, Clone, Copy)]
pub(super) enum Intention {
    /// It decides on an order of this side and quantity [lots].
    Decide((Side, i64)),
    /// An order reaches the exchange.
    Arrive(ClientOrder),
}

/// A plan of decisions, drawn before the day begins, and the orders on their way.
#[derive(Debug)]
pub(super) struct Client {
    plan: VecDeque<(f64, (Side, i64), f64)>,
    travelling: Vec<(f64, ClientOrder)>,
    /// Latency of the order decided last [s], and when it was decided.
    leaving: (f64, f64),
}

impl Client {
    /// Decides more often while the crowd is busy, as one who follows the volume does; sides are drawn against the
    /// position, and know nothing of the hidden value.
    pub(super) fn new(exchange: &Exchange, climate: &Climate, seed: Seed) -> Self {
        let (mut rng, mut way) = (seed.stream("exchange client"), seed.stream("exchange latency"));
        let (low, high) = (exchange.sizes.0 as f64, exchange.sizes.1 as f64);
        let mut position = 0_i64;
        let plan = Self::times(exchange, climate, &mut rng)
            .into_iter()
            .map(|time| {
                let quantity = (low * (high / low).powf(rng.random::<f64>())).round() as i64;
                let buys = rng.random::<f64>() < 0.5 - (position as f64 / 6_000.0).clamp(-0.4, 0.4);
                let side = if buys { Side::Buy } else { Side::Sell };
                position += side.sign() * quantity;
                let wobble: f64 = StandardNormal.sample(&mut way);
                (time, (side, quantity), exchange.latency + exchange.jitter * wobble.abs().min(3.0))
            })
            .collect();
        Self { plan, travelling: Vec::new(), leaving: (0.0, 0.0) }
    }

    /// Decision times [s after the open], none in the first half minute or the last [`STOP`] seconds.
    fn times(exchange: &Exchange, climate: &Climate, rng: &mut impl rand::Rng) -> Vec<f64> {
        const STOP: f64 = 60.0;
        let seconds = (exchange.session - STOP) as usize;
        let busy: Vec<f64> = (30..seconds.max(31))
            .scan(0.0, |sum, second| {
                *sum += climate.activity(second as f64);
                Some(*sum)
            })
            .collect();
        let total = busy.last().copied().unwrap_or_default();
        let mut times: Vec<f64> = (0..exchange.orders)
            .map(|_| {
                let drawn = rng.random::<f64>() * total;
                let second = busy.partition_point(|sum| *sum < drawn);
                30.0 + second as f64 + rng.random::<f64>()
            })
            .collect();
        times.sort_by(f64::total_cmp);
        times
    }

    /// The next thing the client does before `until` [s after the open].
    pub(super) fn next_before(&mut self, until: f64) -> Option<(f64, Intention)> {
        let arriving =
            self.travelling.iter().enumerate().min_by(|a, b| a.1.0.total_cmp(&b.1.0)).map(|(place, order)| (place, order.0));
        let deciding = self.plan.front().map(|decision| decision.0);
        match (arriving, deciding) {
            (Some((place, time)), decision) if time < until && decision.is_none_or(|decision| time <= decision) => {
                Some((time, Intention::Arrive(self.travelling.remove(place).1)))
            }
            (_, Some(time)) if time < until => {
                let (_, what, latency) = self.plan.pop_front()?;
                self.leaving = (time, latency);
                Some((time, Intention::Decide(what)))
            }
            _ => None,
        }
    }

    /// The order decided last is on its way.
    pub(super) fn sent(&mut self, order: ClientOrder) {
        let (time, latency) = self.leaving;
        self.travelling.push((time + latency, order));
    }
}
