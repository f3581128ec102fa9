//! The orders of a log as the backtest's own simulator executes them.

use std::collections::{BTreeMap, HashMap, HashSet};

use crate::market::paper::OrderWords;
use crate::market::{
    BacktestError, Blotter, Cash, Condition, MoneyError, OrderId, OrderKind, Orders, Quantity, Rejection, Session, Strategy,
    Ticket, TimeInForce, View,
};
use crate::sim2real::Timestamp;

use super::{Life, Piece};

/// What the simulator made of the orders of a log.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Replay {
    /// Each order as it was executed, in the order of the log; none where the simulator could not work it.
    pub orders: Vec<Option<Life>>,
    /// Why it could not, and how often.
    pub notes: Vec<ReplayNote>,
}

/// What to say where a run does not make of `orders`, which are its own, what they say: it is another run, or it replaces orders,
/// which a replay does not. Of each order no more is kept than what it came to.
///
/// # Errors
/// As [`replay`].
pub fn differs(session: Session, symbols: &[&str], orders: &[Life]) -> Result<Option<String>, ReplayError> {
    let (strategy, blotter) = executed(session, symbols, orders, &mut |_, _| {})?;
    let known = places(&strategy, &blotter);
    let mut sums: Vec<Option<(Quantity, Cash, Cash)>> = vec![None; orders.len()];
    known.values().for_each(|place| sums[*place] = Some((Quantity::ZERO, Cash::ZERO, Cash::ZERO)));
    for fill in &blotter.fills {
        let Some((filled, notional, fees)) = known.get(&fill.order_id).and_then(|place| sums[*place].as_mut()) else {
            continue;
        };
        *filled = *filled + fill.quantity;
        *notional = notional.plus(fill.price * fill.quantity)?;
        *fees = fees.plus(fill.fee)?;
    }
    let same = |(sum, order): (&Option<_>, &Life)| *sum == Some((order.filled, order.notional, order.fees));
    let differ = orders.len() - sums.iter().zip(orders).filter(|pair| same(*pair)).count();
    Ok((differ > 0).then(|| {
        format!(
            "the run does not execute {differ} of the {} orders as the backtest has them: is it the run that made the backtest?",
            orders.len()
        )
    }))
}

/// Why orders were not replayed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ReplayNote {
    /// How many.
    pub orders: usize,
    /// Why.
    pub why: String,
    /// The first of them, by its id.
    pub first: String,
}

/// Why there is no replay.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// The simulator failed.
    #[error(transparent)]
    Run(#[from] BacktestError),
    /// A sum that 128 bits do not hold.
    #[error(transparent)]
    Money(#[from] MoneyError),
}

/// Sends the orders of a log at the times of their decisions in a run under way, and takes them back when the log says they were;
/// `symbols` are those of the run's instruments. Orders are in the order of their times.
///
/// # Errors
/// What fails in the run; sums beyond 128 bits.
pub fn replay(session: Session, symbols: &[&str], orders: &[Life]) -> Result<Replay, ReplayError> {
    let mut why_not: BTreeMap<String, (usize, usize)> = BTreeMap::new();
    let mut left_out = |place: usize, why: String| {
        let own = why_not.entry(why).or_insert((0, place));
        *own = (own.0 + 1, own.1.min(place));
    };
    let (strategy, blotter) = executed(session, symbols, orders, &mut left_out)?;
    let mut lives: Vec<Option<Life>> = vec![None; orders.len()];
    let known = places(&strategy, &blotter);
    for place in known.values() {
        let order = orders[*place].clone();
        lives[*place] =
            Some(Life { filled: Quantity::ZERO, notional: Cash::ZERO, fees: Cash::ZERO, pieces: Vec::new(), ..order });
    }
    for fill in &blotter.fills {
        let Some(life) = known.get(&fill.order_id).and_then(|place| lives[*place].as_mut()) else { continue };
        life.filled = life.filled + fill.quantity;
        life.notional = life.notional.plus(fill.price * fill.quantity)?;
        life.fees = life.fees.plus(fill.fee)?;
        // Most have but one.
        if life.pieces.is_empty() {
            life.pieces.reserve_exact(1);
        }
        life.pieces.push(Piece { at: fill.filled_at, quantity: fill.quantity, price: fill.price });
    }
    let refused = |order: &Life, ticket: &Ticket| {
        let asked = |rejection: &&Rejection| {
            let Rejection { decided_at, instrument, side, quantity, .. } = **rejection;
            (decided_at, instrument, side, quantity) == (order.at, ticket.instrument, ticket.side, ticket.quantity)
        };
        let reason = blotter.rejections.iter().find(asked).map(|rejection| rejection.reason.word());
        format!("the simulator refused it{}", reason.map_or_else(String::new, |reason| format!(" ({reason})")))
    };
    let sent: HashSet<usize> = strategy.sent.values().copied().collect();
    for (_, place, ticket, _) in strategy.due.iter().filter(|due| lives[due.1].is_none()) {
        let why = if sent.contains(place) {
            refused(&orders[*place], ticket)
        } else {
            "decided outside the data of the run".to_owned()
        };
        left_out(*place, why);
    }
    let note =
        |(why, (count, first)): (String, (usize, usize))| ReplayNote { orders: count, why, first: orders[first].id.clone() };
    Ok(Replay { orders: lives, notes: why_not.into_iter().map(note).collect() })
}

/// Sends the orders in a run until it is over: who sent them, and what became of them. Those that cannot be asked for are `left_out`.
fn executed(
    session: Session,
    symbols: &[&str],
    orders: &[Life],
    left_out: &mut dyn FnMut(usize, String),
) -> Result<(Replayer, Blotter), ReplayError> {
    let mut session = session.without_equity();
    let mut strategy = Replayer::default();
    for (place, order) in orders.iter().enumerate() {
        match ticket(order, symbols) {
            Ok(ticket) => strategy.due.push((order.at, place, ticket, order.withdrawn_at)),
            Err(why) => left_out(place, why),
        }
    }
    while session.advance(&mut strategy, usize::MAX)? {}
    Ok((strategy, session.finish()?.blotter))
}

/// The places in the log of the orders that the simulator took, by its own ids.
fn places(strategy: &Replayer, blotter: &Blotter) -> HashMap<u64, usize> {
    let taken = blotter.orders.iter();
    taken.filter_map(|order| Some((order.order_id, *strategy.sent.get(&OrderId(order.order_id))?))).collect()
}

/// What the simulator is asked for, or why it cannot be asked.
fn ticket(order: &Life, symbols: &[&str]) -> Result<Ticket, String> {
    let instrument = symbols.iter().position(|symbol| *symbol == order.symbol);
    let instrument = instrument.ok_or("the run has no such instrument")?;
    let quantity = order.ordered.filter(|quantity| *quantity > Quantity::ZERO).ok_or("no quantity is known")?;
    let limit = || order.limit.ok_or("no limit is known");
    let trigger = || order.stop.ok_or("no stop price is known");
    let kind = match &order.kind {
        // Nobody says: an order with a limit is one.
        None => order.limit.map_or(OrderKind::Market, |price| OrderKind::Limit { price }),
        Some(OrderWords::Market) => OrderKind::Market,
        Some(OrderWords::Limit | OrderWords::PostOnly) => OrderKind::Limit { price: limit()? },
        Some(OrderWords::Stop) => OrderKind::Stop { trigger: trigger()? },
        Some(OrderWords::StopLimit) => OrderKind::StopLimit { trigger: trigger()?, price: limit()? },
        Some(OrderWords::MarketOnOpen) => OrderKind::MarketOnOpen,
        Some(OrderWords::LimitOnOpen) => OrderKind::LimitOnOpen { price: limit()? },
        Some(OrderWords::MarketOnClose) => OrderKind::MarketOnClose,
        Some(OrderWords::LimitOnClose) => OrderKind::LimitOnClose { price: limit()? },
        Some(other) => return Err(format!("orders of the kind \"{}\" are not replayed", other.word())),
    };
    let time_in_force = match order.time_in_force.as_deref() {
        Some("ioc") => TimeInForce::ImmediateOrCancel,
        Some("fok") => TimeInForce::FillOrKill,
        // What ended with the day is taken back when the log says so.
        _ => TimeInForce::GoodTillCancelled,
    };
    let condition = if order.kind == Some(OrderWords::PostOnly) { Condition::PostOnly } else { Condition::default() };
    Ok(Ticket { kind, time_in_force, condition, ..Ticket::market(instrument, order.side, quantity) })
}

/// Sends the orders of a log when they are due.
#[derive(Debug, Clone, Default)]
struct Replayer {
    /// Time, place in the log, what is asked for, and when it is taken back.
    due: Vec<(Timestamp, usize, Ticket, Option<Timestamp>)>,
    next: usize,
    under_way: bool,
    sent: HashMap<OrderId, usize>,
    withdrawals: BTreeMap<(Timestamp, OrderId), ()>,
    woken_at: Option<Timestamp>,
}

impl Strategy for Replayer {
    fn name(&self) -> &str {
        "replay"
    }
    fn lookback(&self) -> usize {
        1
    }
    fn copied(&self) -> Option<Box<dyn Strategy>> {
        Some(Box::new(self.clone()))
    }

    fn on_event(&mut self, view: &View<'_>, orders: &mut Orders) {
        let now = view.event().time;
        // What was decided before there were any data is not decided on the first of them.
        if !std::mem::replace(&mut self.under_way, true) {
            self.next = self.due.partition_point(|due| due.0 < now);
        }
        while let Some((_, place, ticket, withdrawn_at)) = self.due.get(self.next).filter(|due| due.0 <= now).copied() {
            let id = orders.submit(ticket);
            self.sent.insert(id, place);
            if let Some(at) = withdrawn_at {
                self.withdrawals.insert((at, id), ());
            }
            self.next += 1;
        }
        while let Some(((at, id), ())) = self.withdrawals.first_key_value().map(|(key, ())| (*key, ())) {
            if at > now {
                break;
            }
            orders.cancel(id);
            self.withdrawals.remove(&(at, id));
        }
        let soonest = self.due.get(self.next).map(|due| due.0);
        let soonest = soonest.into_iter().chain(self.withdrawals.first_key_value().map(|((at, _), ())| *at)).min();
        if let Some(at) = soonest.filter(|at| self.woken_at.is_none_or(|woken| woken <= now || *at < woken)) {
            orders.wake_at(at);
            self.woken_at = Some(at);
        }
    }
}
