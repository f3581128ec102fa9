//! Markets of a few rows, and strategies that do as they are told.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use std::collections::BTreeMap;

use trueup::market::{
    Backtest, Bar, Cash, Execution, History, Instrument, Level, MECHANISMS, News, Notice, OrderId, OrderKind, Orders, Price,
    Quantity, Quotes, Record, Settings, Side, Status, Strategy, Ticket, View,
};
use trueup::sim2real::{Assembly, Timestamp, Typical};

pub const MINUTE: i64 = 60 * Timestamp::NANOS;

/// A bar of minute `k` that goes straight from open to close.
pub fn bar(k: i64, open: f64, close: f64, volume: f64) -> Bar {
    whole_bar(k, [open, open.max(close), open.min(close), close], volume)
}

/// A bar of minute `k`: open, high, low, close.
pub fn whole_bar(k: i64, prices: [f64; 4], volume: f64) -> Bar {
    let [open, high, low, close] = prices.map(|price| Price::nearest(price).unwrap());
    let (open_at, known_at) = (Timestamp(k * MINUTE), Timestamp((k + 1) * MINUTE));
    Bar { open_at, known_at, open, high, low, close, volume }
}

/// Bars of open and close.
pub fn bars(prices: &[(f64, f64)]) -> History {
    let all = prices.iter().enumerate().map(|(k, (open, close))| bar(k as i64, *open, *close, 1_000.0)).collect();
    History::new(all, Quotes::default()).unwrap()
}

/// Bars of open, high, low and close.
pub fn of(prices: &[[f64; 4]]) -> History {
    let all = prices.iter().enumerate().map(|(k, prices)| whole_bar(k as i64, *prices, 1_000.0)).collect();
    History::new(all, Quotes::default()).unwrap()
}

/// One-level quotes: time [ns], bid and ask; a side at 0 is empty. 100 are displayed on each side.
pub fn quotes(rows: &[(i64, f64, f64)]) -> History {
    let sized: Vec<_> = rows.iter().map(|(time, bid, ask)| (*time, *bid, 100.0, *ask, 100.0)).collect();
    sized_quotes(&sized)
}

/// One-level quotes: time [ns], bid, its size, ask, its size.
pub fn sized_quotes(rows: &[(i64, f64, f64, f64, f64)]) -> History {
    let mut quotes = Quotes::with_depth(1);
    for (time, bid, bid_size, ask, ask_size) in rows {
        let side = |price: f64, size: f64| if price > 0.0 { vec![Level { price, size }] } else { Vec::new() };
        quotes.push(Timestamp(*time), &side(*bid, *bid_size), &side(*ask, *ask_size));
    }
    History::new(Vec::new(), quotes).unwrap()
}

/// The execution plant with mechanisms by id, form and value of the only parameter.
pub fn venue(parts: &[(&str, &str, f64)]) -> Assembly<Execution> {
    let mut venue = Assembly::new(Execution, MECHANISMS);
    for (name, form, value) in parts {
        let mechanism = *MECHANISMS.iter().find(|m| m.about().name == *name).unwrap();
        let forms = mechanism.forms(&Typical::default());
        let index = forms.iter().position(|f| f.name == *form).unwrap();
        let mut parameters = forms[index].parameters.clone();
        parameters[0].nominal = *value;
        venue = venue.with_mechanism(mechanism, index, parameters);
    }
    venue
}

pub fn instrument(symbol: &str) -> Instrument {
    Instrument { symbol: symbol.into(), tick_size: 0.01, lot_size: 1.0, average_daily_volume: None, daily_volatility: None }
}

pub fn settings() -> Settings {
    Settings { max_leverage: 10.0, ..Settings::with_cash(Cash::nearest(100_000.0).unwrap()) }
}

pub fn quantity(units: f64) -> Quantity {
    Quantity::nearest(units).unwrap()
}

pub fn limit(side: Side, units: f64, price: f64) -> Ticket {
    Ticket::limit(0, side, quantity(units), Price::nearest(price).unwrap())
}

pub fn stop(side: Side, units: f64, trigger: f64) -> Ticket {
    Ticket::new(0, side, quantity(units), OrderKind::Stop { trigger: Price::nearest(trigger).unwrap() })
}

#[derive(Clone)]
enum Step {
    Submit(Ticket),
    Bracket(Ticket, Price, Price),
    Group(Vec<Ticket>),
    Cancel(u64),
    Replace(u64, Option<f64>, Option<f64>),
}

/// Does what it is told at given events, and remembers what it learned.
#[derive(Clone, Default)]
pub struct Plan {
    steps: BTreeMap<usize, Vec<Step>>,
    next: usize,
    events: usize,
    pub positions: Vec<f64>,
    pub notices: Vec<(Timestamp, Notice)>,
}

/// A plan that begins with event `k`.
pub fn event(k: usize) -> Plan {
    Plan { next: k, ..Plan::default() }
}

impl Plan {
    /// What follows is done at event `k`.
    pub fn at(mut self, k: usize) -> Self {
        self.next = k;
        self
    }

    pub fn submit(self, ticket: Ticket) -> Self {
        self.step(Step::Submit(ticket))
    }

    pub fn bracket(self, entry: Ticket, take_profit: Price, stop_loss: Price) -> Self {
        self.step(Step::Bracket(entry, take_profit, stop_loss))
    }

    pub fn group(self, tickets: Vec<Ticket>) -> Self {
        self.step(Step::Group(tickets))
    }

    pub fn cancel(self, id: u64) -> Self {
        self.step(Step::Cancel(id))
    }

    pub fn replace(self, id: u64, units: Option<f64>, price: Option<f64>) -> Self {
        self.step(Step::Replace(id, units, price))
    }

    fn step(mut self, step: Step) -> Self {
        self.steps.entry(self.next).or_default().push(step);
        self
    }
}

impl Strategy for Plan {
    fn name(&self) -> &str {
        "plan"
    }
    fn lookback(&self) -> usize {
        1
    }
    fn on_event(&mut self, view: &View<'_>, orders: &mut Orders) {
        self.positions.push(view.position(0).to_f64());
        for step in self.steps.get(&self.events).into_iter().flatten() {
            match step {
                Step::Submit(ticket) => drop(orders.submit(*ticket)),
                Step::Bracket(entry, gain, loss) => drop(orders.bracket(*entry, *gain, *loss)),
                Step::Group(tickets) => drop(orders.one_cancels_other(tickets)),
                Step::Cancel(id) => orders.cancel(OrderId(*id)),
                Step::Replace(id, units, price) => {
                    orders.replace(OrderId(*id), units.map(quantity), price.map(|p| Price::nearest(p).unwrap()));
                }
            }
        }
        self.events += 1;
    }
    fn on_notice(&mut self, view: &View<'_>, notice: &Notice, _orders: &mut Orders) {
        if let News::Filled { left, .. } = notice.news {
            assert!(left >= Quantity::ZERO);
        }
        self.notices.push((view.now(), *notice));
    }
}

/// Buys and sells by what it saw: market and limit orders, cancelled after a while.
#[derive(Clone, Default)]
pub struct Busy {
    pub events: u64,
    pub seen: u64,
}

impl Strategy for Busy {
    fn name(&self) -> &str {
        "busy"
    }
    fn lookback(&self) -> usize {
        7
    }
    fn on_event(&mut self, view: &View<'_>, orders: &mut Orders) {
        self.events += 1;
        for k in 0..view.instruments().len() {
            let closes: i64 = view.bars(k).iter().map(|bar| bar.close.0).sum();
            let bids: u64 = view.quotes(k).last().and_then(|quote| quote.bid()).map_or(0, f64::to_bits);
            let prints: u64 = view
                .prints(k)
                .iter()
                .fold(0, |sum, print| sum.rotate_left(3) ^ print.price.to_bits() ^ print.size.to_bits());
            self.seen = self.seen.rotate_left(5) ^ closes as u64 ^ bids ^ prints;
            let side = if self.seen.count_ones().is_multiple_of(2) { Side::Buy } else { Side::Sell };
            let Some(mark) = view.price(k) else { continue };
            match (self.events + self.seen) % 7 {
                0 => _ = orders.submit(Ticket::market(k, side, quantity(3.0))),
                1 | 2 => {
                    let price = Price(mark.0 / 10_000_000 * 10_000_000);
                    _ = orders.submit(Ticket::limit(k, side, quantity(5.0), price));
                }
                3 => view.orders(k).iter().take(2).for_each(|order| orders.cancel(order.id)),
                _ => {}
            }
        }
    }
    fn copied(&self) -> Option<Box<dyn Strategy>> {
        Some(Box::new(self.clone()))
    }
}

pub fn run_with(histories: Vec<History>, parts: &[(&str, &str, f64)], settings: Settings, mut plan: Plan) -> Record {
    run_plan(histories, parts, settings, &mut plan)
}

pub fn run_plan(histories: Vec<History>, parts: &[(&str, &str, f64)], settings: Settings, plan: &mut Plan) -> Record {
    let instruments = ["A", "B", "C"][..histories.len()].iter().map(|s| instrument(s)).collect();
    Backtest::new(instruments, histories, venue(parts), settings).unwrap().run(plan).unwrap()
}

pub fn run(history: History, parts: &[(&str, &str, f64)], plan: Plan) -> Record {
    run_with(vec![history], parts, settings(), plan)
}

/// Time, quantity and price of all fills.
pub fn fills(record: &Record) -> Vec<(i64, f64, f64)> {
    record.blotter.fills.iter().map(|f| (f.filled_at.0, f.quantity.to_f64(), f.price.to_f64())).collect()
}

/// How far each order came.
pub fn status(record: &Record) -> Vec<Status> {
    record.blotter.orders.iter().map(|order| order.status).collect()
}
