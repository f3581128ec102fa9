//! The matching engine where the orders of others are known one by one: a small exchange of its own makes the data, and says to
//! the unit what own orders that waited in its queues would have been filled.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use std::collections::BTreeMap;

use crate::anything_scene::{Draws, fills_are_of_orders, queued, run, served_in_turn};
use crate::market_scene::{instrument, quantity, settings, venue};
use proptest::prelude::{
    Just, ProptestConfig, Strategy as Generated, any, prop_assert, prop_assert_eq, prop_oneof, proptest,
};
use trueup::market::{
    Backtest, Condition, History, Order, OrderAction, OrderEvent, OrderKind, Orders, Price, Print, QueueModel, Record, Role,
    Settings, Side, Status, Strategy, Ticket, View,
};
use trueup::sim2real::Timestamp;

const TICK: i64 = 10_000_000;

/// An order of others that rests: the lower its number of `since`, the sooner it is served.
#[derive(Debug, Clone, Copy)]
struct Other {
    side: Side,
    ticks: i64,
    size: i64,
    since: usize,
}

/// What happened at one instant: what was printed, and the orders of others that rest after it.
#[derive(Debug, Clone)]
struct Instant {
    time: i64,
    /// Side of who rested, price [ticks] and size of each trade.
    trades: Vec<(Side, i64, i64)>,
    before: BTreeMap<u64, Other>,
    after: BTreeMap<u64, Other>,
}

/// An exchange on which others trade with one another.
#[derive(Debug, Default)]
struct Exchange {
    others: BTreeMap<u64, Other>,
    next: u64,
    events: Vec<OrderEvent>,
    prints: Vec<Print>,
    instants: Vec<Instant>,
}

impl Exchange {
    fn best(&self, side: Side) -> Option<i64> {
        let all = self.others.values().filter(|other| other.side == side).map(|other| other.ticks);
        if side == Side::Buy { all.max() } else { all.min() }
    }

    fn tell(&mut self, time: i64, id: u64, action: OrderAction, other: Other) {
        let (time, price) = (Timestamp(time), Price(other.ticks * TICK));
        self.events.push(OrderEvent { time, known_at: time, id, action, side: other.side, price, size: other.size as f64 });
    }

    fn add(&mut self, time: i64, side: Side, ticks: i64, size: i64) {
        let room = match (side, self.best(side.opposite())) {
            (Side::Buy, Some(ask)) => ticks.min(ask - 1),
            (Side::Sell, Some(bid)) => ticks.max(bid + 1),
            (_, None) => ticks,
        };
        self.next += 1;
        let other = Other { side, ticks: room, size, since: self.events.len() };
        self.others.insert(self.next, other);
        self.tell(time, self.next, OrderAction::Add, other);
    }

    /// An order that rests shrinks, grows or goes.
    fn change(&mut self, time: i64, which: usize, by: i64) {
        let Some(id) = self.others.keys().copied().nth(which % self.others.len().max(1)) else { return };
        let other = self.others[&id];
        let size = other.size + by;
        if size <= 0 {
            self.others.remove(&id);
            return self.tell(time, id, OrderAction::Delete, Other { size: 0, ..other });
        }
        let since = if by > 0 { self.events.len() } else { other.since };
        let changed = Other { size, since, ..other };
        self.others.insert(id, changed);
        self.tell(time, id, OrderAction::Change, changed);
    }

    /// Somebody takes from `side`, order after order by price and time, which the data print one by one or price by price.
    fn take(&mut self, time: i64, side: Side, mut size: i64, one_by_one: bool) -> Vec<(Side, i64, i64)> {
        let mut trades: Vec<(Side, i64, i64)> = Vec::new();
        while size > 0 && self.others.values().filter(|other| other.side == side).count() > 1 {
            let Some(best) = self.best(side) else { break };
            let front = self.others.iter().filter(|(_, o)| o.side == side && o.ticks == best).min_by_key(|(_, o)| o.since);
            let (id, other) = front.map(|(id, other)| (*id, *other)).unwrap();
            let part = size.min(other.size);
            size -= part;
            match trades.last_mut().filter(|(_, ticks, _)| !one_by_one && *ticks == best) {
                Some((.., sum)) => *sum += part,
                None => trades.push((side, best, part)),
            }
            self.change_front(time, id, other, part);
        }
        for (side, ticks, size) in &trades {
            let (time, price) = (Timestamp(time), Price(ticks * TICK).to_f64());
            self.prints.push(Print { time, price, size: *size as f64, aggressor: Some(side.opposite()) });
        }
        trades
    }

    fn change_front(&mut self, time: i64, id: u64, other: Other, part: i64) {
        let left = Other { size: other.size - part, ..other };
        if left.size == 0 {
            self.others.remove(&id);
            return self.tell(time, id, OrderAction::Delete, left);
        }
        self.others.insert(id, left);
        self.tell(time, id, OrderAction::Change, left);
    }

    fn history(&self) -> History {
        History::default().with_order_events(self.events.clone()).unwrap().with_prints(self.prints.clone()).unwrap()
    }
}

/// An exchange and all that happened on it.
fn random_exchange() -> impl Generated<Value = Exchange> {
    let step = (1..50_i64, 0..9_u8, any::<bool>(), -2..9_i64, 1..60_i64, any::<usize>());
    proptest::collection::vec(step, 8..160).prop_map(|steps| {
        let mut exchange = Exchange::default();
        let (mut time, mut mid) = (0, 10_000_i64);
        for k in 0..5 {
            exchange.add(0, Side::Buy, mid - 1 - k, 20 + 7 * k);
            exchange.add(0, Side::Sell, mid + 1 + k, 15 + 9 * k);
        }
        for (gap, what, buys, away, size, which) in steps {
            time += gap;
            let before = exchange.others.clone();
            let side = if buys { Side::Buy } else { Side::Sell };
            let mut trades = Vec::new();
            match what {
                0..=3 => exchange.add(time, side, if buys { mid - away } else { mid + away }, size),
                4 => exchange.change(time, which, -60),
                5 => exchange.change(time, which, size - 30),
                _ => trades = exchange.take(time, side, 2 * size, which % 2 == 0),
            }
            let touches = [exchange.best(Side::Buy), exchange.best(Side::Sell)];
            if let [Some(bid), Some(ask)] = touches {
                mid = (bid + ask) / 2;
            }
            let after = exchange.others.clone();
            exchange.instants.push(Instant { time, trades, before, after });
        }
        exchange
    })
}

/// Sends orders that only rest, and takes some back.
struct Waits {
    draws: Draws,
    /// When it took back which.
    taken_back: Vec<(i64, u64)>,
    at: i64,
}

impl Strategy for Waits {
    fn name(&self) -> &str {
        "waits"
    }
    fn lookback(&self) -> usize {
        1
    }
    fn on_event(&mut self, view: &View<'_>, orders: &mut Orders) {
        // At one instant it acts once.
        if view.now().0 <= self.at {
            return;
        }
        self.at = view.now().0;
        let known = view.orders(0).len() as u64;
        match self.draws.below(6) {
            0..3 => {
                let side = if self.draws.below(2) == 0 { Side::Buy } else { Side::Sell };
                let Some(best) = view.best(0, side) else { return };
                let away = self.draws.below(5) as i64 - 1;
                let price = Price(best.0 - away * TICK * if side == Side::Buy { 1 } else { -1 });
                let size = 1.0 + self.draws.below(40) as f64;
                let mut ticket = Ticket::new(0, side, quantity(size), OrderKind::Limit { price });
                ticket.condition = Condition::PostOnly;
                orders.submit(ticket);
            }
            3 if known > 0 => {
                let id = view.orders(0)[self.draws.below(known) as usize].id;
                self.taken_back.push((self.at, id.0));
                orders.cancel(id);
            }
            _ => {}
        }
    }
}

/// An own order as the exchange would have it.
#[derive(Debug, Clone)]
struct Own {
    id: u64,
    side: Side,
    ticks: i64,
    left: i64,
    /// The orders of others that stand ahead of it.
    ahead: Vec<u64>,
}

/// What each own order is filled, and when, by the exchange's own record: with price, then time priority.
fn expected(exchange: &Exchange, orders: &[Order], taken_back: &[(i64, u64)]) -> Vec<(i64, u64, i64)> {
    let (mut waiting, mut fills): (Vec<Own>, Vec<(i64, u64, i64)>) = (Vec::new(), Vec::new());
    for Instant { time, trades, before, after } in &exchange.instants {
        let mut passed: BTreeMap<u64, i64> = BTreeMap::new();
        for order in &mut waiting {
            // The book before the instant stands ahead as far as it is of those.
            order.ahead.retain(|id| before.contains_key(id));
        }
        for k in 0..waiting.len() {
            let own = waiting[k].clone();
            let (buys, at_price) = (own.side == Side::Buy, |ticks: i64| ticks == own.ticks);
            let through = |ticks: i64| if buys { ticks < own.ticks } else { ticks > own.ticks };
            let here = trades.iter().filter(|(side, ..)| *side == own.side);
            let traded: i64 = here.clone().filter(|(_, ticks, _)| at_price(*ticks)).map(|(.., size)| size).sum();
            let beyond = here.clone().any(|(_, ticks, _)| through(*ticks));
            let others: i64 = own.ahead.iter().map(|id| before[id].size).sum();
            let ours: i64 = waiting[..k].iter().filter(|o| o.side == own.side && at_price(o.ticks)).map(|o| o.left).sum();
            let past = if beyond { own.left } else { (traded - others - ours).clamp(0, own.left) };
            // Who comes to our price from the other side would have met us.
            let facing = after.values().filter(|other| other.side != own.side).map(|other| other.ticks);
            let met = if buys {
                facing.min().is_some_and(|ask| ask <= own.ticks)
            } else {
                facing.max().is_some_and(|bid| bid >= own.ticks)
            };
            let filled = if met { own.left } else { past };
            if filled > 0 {
                passed.insert(own.id, filled);
            }
        }
        for own in &mut waiting {
            let filled = passed.get(&own.id).copied().unwrap_or_default();
            own.left -= filled;
            fills.extend((filled > 0).then_some((*time, own.id, filled)));
            // Whoever lost his place, by growing, stands ahead no more.
            own.ahead.retain(|id| after.get(id).is_some_and(|now| now.since == before[id].since));
        }
        let gone = |own: &Own| own.left <= 0 || taken_back.contains(&(*time, own.id));
        waiting.retain(|own| !gone(own));
        for order in orders.iter().filter(|order| order.arrives_at.0 == *time) {
            let ticks = order.kind.limit().unwrap().0 / TICK;
            let crosses = after.values().filter(|o| o.side != order.side).any(|o| match order.side {
                Side::Buy => o.ticks <= ticks,
                Side::Sell => o.ticks >= ticks,
            });
            if !crosses {
                let there = |other: &Other| other.side == order.side && other.ticks == ticks;
                let ahead = after.iter().filter(|(_, other)| there(other)).map(|(id, _)| *id).collect();
                let left = order.quantity.to_f64() as i64;
                waiting.push(Own { id: order.order_id, side: order.side, ticks, left, ahead });
            }
        }
    }
    fills
}

/// What each own order was filled at each instant.
fn met(record: &Record) -> Vec<(i64, u64, i64)> {
    let mut sums: BTreeMap<(i64, u64), i64> = BTreeMap::new();
    for fill in &record.blotter.fills {
        *sums.entry((fill.filled_at.0, fill.order_id)).or_default() += fill.quantity.to_f64() as i64;
    }
    sums.into_iter().map(|((time, id), size)| (time, id, size)).collect()
}

fn wait_in(exchange: &Exchange, draws: u64) -> (Record, Waits) {
    let settings = Settings { max_leverage: 1e4, ..settings() };
    let backtest = Backtest::new(vec![instrument("A")], vec![exchange.history()], venue(&[]), settings).unwrap();
    let mut strategy = Waits { draws: Draws(draws), taken_back: Vec::new(), at: 0 };
    (backtest.run(&mut strategy).unwrap(), strategy)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(600))]

    #[test]
    fn who_waits_is_filled_when_and_as_far_as_the_exchange_would_have(exchange in random_exchange(), draws in any::<u64>()) {
        let (record, strategy) = wait_in(&exchange, draws);
        fills_are_of_orders(&record)?;
        let mut expected = expected(&exchange, &record.blotter.orders, &strategy.taken_back);
        expected.sort_unstable();
        prop_assert_eq!(met(&record), expected);
    }

    #[test]
    fn nothing_is_filled_off_the_book_or_out_of_turn(
        exchange in random_exchange(),
        draws in any::<u64>(),
        order in prop_oneof![Just(0.0), 0.0..3e-7_f64],
    ) {
        let (record, alone) = run(&exchange.history(), queued(QueueModel::Trades, order), draws);
        fills_are_of_orders(&record)?;
        for fill in &record.blotter.fills {
            let at = exchange.instants.partition_point(|instant| instant.time <= fill.filled_at.0).checked_sub(1);
            let Some(Instant { time, trades, before, after }) = at.map(|at| &exchange.instants[at]) else { continue };
            let now = *time == fill.filled_at.0;
            let ticks = |all: &BTreeMap<u64, Other>, side| {
                let own = all.values().filter(|other| other.side == side).map(|other| other.ticks);
                if side == Side::Buy { own.max() } else { own.min() }
            };
            let facing = |side: Side| [Some(after), now.then_some(before)].into_iter().flatten().filter_map(move |all| ticks(all, side));
            let price = fill.price.0 / TICK;
            let printed = || trades.iter().filter(|_| now).map(|(_, ticks, _)| *ticks);
            let reached = match (fill.why.role, fill.side) {
                (Role::Taker, side) => facing(side.opposite()).any(|ticks| ticks == price),
                (_, Side::Buy) => printed().chain(facing(Side::Sell)).any(|ticks| ticks <= price),
                (_, Side::Sell) => printed().chain(facing(Side::Buy)).any(|ticks| ticks >= price),
            };
            prop_assert!(reached, "{fill:?}");
        }
        served_in_turn(&record, &alone, |order, fill| order.arrives_at < fill.filled_at)?;
    }
}

/// What is drawn brings about what is compared.
#[test]
fn the_draws_bring_orders_forward_in_queues() {
    use proptest::strategy::ValueTree;
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    let (mut filled, mut in_part, mut behind) = (0, 0, 0);
    for draws in 0..200 {
        let exchange = random_exchange().new_tree(&mut runner).unwrap().current();
        let (record, _) = wait_in(&exchange, draws);
        filled += record.blotter.fills.len();
        behind += record.blotter.fills.iter().filter(|fill| fill.why.queued_behind > 0.0).count();
        in_part += record.blotter.orders.iter().filter(|o| o.filled < o.quantity && o.filled.to_f64() > 0.0).count();
        assert!(record.blotter.orders.iter().all(|order| order.status != Status::Filled || order.filled == order.quantity));
    }
    println!("{filled} fills, {behind} of them behind others; {in_part} orders filled in part");
    assert!(filled > 1_000 && behind > 300 && in_part > 30, "{filled} fills, {behind} behind others, {in_part} in part");
}
