//! Orders of every kind, drawn at random, and what must be true of their fills wherever they were sent.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use proptest::prelude::prop_assert;
use proptest::test_runner::TestCaseError;
use trueup::market::{
    Backtest, Condition, Fill, History, Latencies, Latency, Matching, Order, OrderKind, Orders, Price, Quantity, QueueModel,
    Record, Role, Settings, Side, Status, Strategy, Ticket, TimeInForce, View,
};
use trueup::sim2real::Timestamp;

use crate::market_scene::{instrument, quantity, settings, venue};

/// Draws that are the same at each call, from a linear congruential generator (Knuth's MMIX constants).
pub struct Draws(pub u64);

impl Draws {
    pub fn below(&mut self, below: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % below
    }
}

/// Asks for whatever it draws, and remembers which orders stand alone, unconditionally and as they were sent.
pub struct Anything {
    pub draws: Draws,
    pub alone: Vec<u64>,
}

impl Anything {
    fn draw(&mut self, below: u64) -> u64 {
        self.draws.below(below)
    }

    /// A price within ten ticks of `of`.
    fn near(&mut self, of: Price) -> Price {
        let tick = 10_000_000;
        Price(((of.0 / tick + self.draw(21) as i64 - 10) * tick).max(tick))
    }

    fn ticket(&mut self, view: &View<'_>) -> Option<Ticket> {
        let (mark, side) = (view.price(0)?, if self.draw(2) == 0 { Side::Buy } else { Side::Sell });
        let (price, trigger) = (self.near(mark), self.near(mark));
        let kind = match self.draw(12) {
            0 => OrderKind::Market,
            1 => OrderKind::Stop { trigger },
            2 => OrderKind::StopLimit { trigger, price },
            3 => OrderKind::TrailingStop { distance: Price(10_000_000 * (1 + self.draw(9) as i64)) },
            4 => OrderKind::MarketOnOpen,
            5 => OrderKind::LimitOnClose { price },
            _ => OrderKind::Limit { price },
        };
        let mut ticket = Ticket::new(0, side, quantity(1.0 + self.draw(60) as f64), kind);
        ticket.time_in_force = match self.draw(10) {
            0 => TimeInForce::Day,
            1 => TimeInForce::GoodTillDate(view.now() + 1 + self.draw(200) as i64),
            2 => TimeInForce::ImmediateOrCancel,
            3 => TimeInForce::FillOrKill,
            _ => TimeInForce::GoodTillCancelled,
        };
        ticket.condition = match self.draw(10) {
            0 => Condition::PostOnly,
            1 => Condition::ReduceOnly,
            _ => Condition::None,
        };
        Some(ticket)
    }
}

impl Strategy for Anything {
    fn name(&self) -> &str {
        "anything"
    }
    fn lookback(&self) -> usize {
        1
    }
    fn on_event(&mut self, view: &View<'_>, orders: &mut Orders) {
        let known = view.orders(0).len() as u64;
        match self.draw(8) {
            0..4 => {
                let Some(ticket) = self.ticket(view) else { return };
                let id = orders.submit(ticket);
                if ticket.condition == Condition::None {
                    self.alone.push(id.0);
                }
            }
            4 => {
                let (Some(entry), Some(mark)) = (self.ticket(view), view.price(0)) else { return };
                let (profit, loss) = (self.near(mark), self.near(mark));
                orders.bracket(entry, profit, loss);
            }
            5 => {
                let both: Vec<Ticket> = (0..2).filter_map(|_| self.ticket(view)).collect();
                orders.one_cancels_other(&both);
            }
            6 if known > 0 => orders.cancel(view.orders(0)[self.draw(known) as usize].id),
            7 if known > 0 => {
                let (id, size) = (view.orders(0)[self.draw(known) as usize].id, 1.0 + self.draw(60) as f64);
                let price = view.price(0).map(|mark| self.near(mark));
                orders.replace(id, Some(quantity(size)), price);
                self.alone.retain(|alone| *alone != id.0);
            }
            _ => {}
        }
    }
}

pub fn run(history: &History, settings: Settings, draws: u64) -> (Record, Vec<u64>) {
    let settings = Settings { max_leverage: 1e3, ..settings };
    let backtest = Backtest::new(vec![instrument("A")], vec![history.clone()], venue(&[]), settings).unwrap();
    let mut strategy = Anything { draws: Draws(draws), alone: Vec::new() };
    (backtest.run(&mut strategy).unwrap(), strategy.alone)
}

/// Queues by `model`, and messages that take `seconds` [s] each way.
pub fn queued(model: QueueModel, seconds: f64) -> Settings {
    let order = Latency::Constant { seconds };
    let latencies = Latencies { order: order.clone(), response: order, ..Latencies::default() };
    Settings { latencies, matching: Matching { queue: model, ..Matching::default() }, ..settings() }
}

/// Every fill is of an order that had arrived, within its limit; together they are what the order says was filled, and no more than
/// it asked for; nobody stands before the front of a queue.
pub fn fills_are_of_orders(record: &Record) -> Result<(), TestCaseError> {
    for fill in &record.blotter.fills {
        let order = record.blotter.order(fill.order_id).unwrap();
        prop_assert!(fill.quantity > Quantity::ZERO && fill.filled_at >= order.arrives_at, "{fill:?}");
        prop_assert!(fill.why.queued_behind >= 0.0, "{fill:?}");
    }
    for order in &record.blotter.orders {
        prop_assert!(
            filled_by(record, order, Timestamp::MAX) == order.filled && order.filled <= order.quantity,
            "{order:?}"
        );
    }
    Ok(())
}

pub fn filled_by(record: &Record, order: &Order, time: Timestamp) -> Quantity {
    let own = record.blotter.fills.iter().filter(|fill| fill.order_id == order.order_id && fill.filled_at <= time);
    own.fold(Quantity::ZERO, |sum, fill| sum + fill.quantity)
}

/// A limit order that nothing but the market can end.
pub fn plain(order: &Order, alone: &[u64]) -> Option<Price> {
    let OrderKind::Limit { price } = order.kind else { return None };
    let for_good = order.time_in_force == TimeInForce::GoodTillCancelled;
    let over = matches!(order.status, Status::Filled | Status::Unfilled);
    (for_good && over && alone.contains(&order.order_id)).then_some(price)
}

/// At each fill of an order that rested nobody with a better price was still waiting, nor anybody who came sooner with the same.
/// `there` says whether an order took part in what brought a fill.
pub fn served_in_turn(
    record: &Record,
    alone: &[u64],
    there: impl Fn(&Order, &Fill) -> bool,
) -> Result<usize, TestCaseError> {
    let mut compared = 0;
    for fill in record.blotter.fills.iter().filter(|fill| fill.why.role == Role::Maker) {
        let served = record.blotter.order(fill.order_id).unwrap();
        let Some(price) = plain(served, alone) else { continue };
        for other in record.blotter.orders.iter().filter(|o| o.side == served.side && o.order_id != served.order_id) {
            let Some(own) = plain(other, alone) else { continue };
            let ahead = match served.side {
                Side::Buy => own > price,
                Side::Sell => own < price,
            };
            if !(ahead || own == price && other.arrives_at < served.arrives_at) || !there(other, fill) {
                continue;
            }
            compared += 1;
            let served_too = filled_by(record, other, fill.filled_at) == other.quantity;
            prop_assert!(served_too, "{other:?} waits while {served:?} is served: {fill:?}");
        }
    }
    Ok(compared)
}
