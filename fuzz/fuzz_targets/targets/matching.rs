//! The matching engine: the first byte says which data there are, and each four that follow are a row of them or an order. Whatever is
//! asked, no more is filled than was ordered, none of it beyond its limit, and cash and positions are what the fills make of them.

use trueup::market::{
    Backtest, Bar, Cash, Condition, DepthAction, DepthChange, Execution, Fill, History, Instrument, Latencies, Latency,
    MECHANISMS, Matching, OrderAction, OrderEvent, OrderId, OrderKind, Orders, Price, Print, Quantity, QueueModel, Quotes,
    Record, Settings, Side, Strategy, Ticket, TimeInForce, View,
};
use trueup::sim2real::{Assembly, Timestamp};

use super::scene::{Scene, shown};

const TICK: i64 = 10_000_000;
/// Rows and orders beyond these would make the fuzzer slow, and show nothing new.
const MOST: usize = 256;

pub fn target(_: &Scene, bytes: &[u8]) {
    let Some((how, rest)) = bytes.split_first() else { return };
    let parts: Vec<[u8; 4]> = rest.chunks_exact(4).take(MOST).map(|four| [four[0], four[1], four[2], four[3]]).collect();
    let (asked, told): (Vec<[u8; 4]>, Vec<[u8; 4]>) = parts.into_iter().partition(|part| part[0] & 128 != 0);
    let Some(history) = shown(history(*how, &told)) else { return };
    let Some(backtest) = shown(backtest(*how, history)) else { return };
    let mut asks = Asks { asked, next: 0, replaced: Vec::new() };
    if let Some(record) = shown(backtest.run(&mut asks)) {
        check(&record, &asks.replaced);
        asks.next = 0;
        assert_eq!(backtest.run(&mut asks).expect("it ran before"), record);
    }
}

fn backtest(how: u8, history: History) -> Result<Backtest, trueup::market::BacktestError> {
    let instrument = Instrument {
        symbol: "A".into(),
        tick_size: 0.01,
        lot_size: 1.0,
        average_daily_volume: None,
        daily_volatility: None,
    };
    let order = Latency::Constant { seconds: f64::from(how >> 5) * 1e-9 };
    let latencies = Latencies { order: order.clone(), response: order, ..Latencies::default() };
    let queue = match how >> 3 & 3 {
        0 => QueueModel::Trades,
        1 => QueueModel::Proportional,
        2 => QueueModel::Log,
        _ => QueueModel::Power { exponent: 2.0 },
    };
    let matching = Matching { queue, ..Matching::default() };
    let cash = Cash::nearest(1e6).expect("a sum that can be");
    let settings = Settings { latencies, matching, max_leverage: 100.0, ..Settings::with_cash(cash) };
    Backtest::new(vec![instrument], vec![history], Assembly::new(Execution, MECHANISMS), settings)
}

/// The data: rows a few nanoseconds apart of what the first byte says, and trades among all but bars.
fn history(how: u8, told: &[[u8; 4]]) -> Result<History, trueup::market::HistoryError> {
    let (mut time, mut middle) = (0, 10_000_i64);
    let (mut bars, mut quotes, mut prints) = (Vec::new(), Quotes::with_depth(1), Vec::new());
    let (mut depth, mut events) = (Vec::new(), Vec::new());
    for [kind, a, b, c] in told {
        time += i64::from(kind >> 4);
        middle = (middle + i64::from(a % 7) - 3).max(1_000);
        let (at, size, side) = (Timestamp(time), f64::from(*c), if b & 1 == 0 { Side::Buy } else { Side::Sell });
        let price = |away: i64| Price((middle + away) * TICK);
        let near = price(i64::from(b >> 1 & 15) - 8);
        match (how & 3, kind & 3) {
            (0, _) => {
                let (open, close) = (price(0), price(i64::from(a % 9) - 4));
                let high = Price(open.max(close).0 + i64::from(b % 4) * TICK);
                let low = Price(open.min(close).0 - i64::from(c % 4) * TICK);
                bars.push(Bar { open_at: at, known_at: at + 1, open, high, low, close, volume: size });
                time += 1;
            }
            (_, 0) => prints.push(Print { time: at, price: near.to_f64(), size, aggressor: (b & 64 == 0).then_some(side) }),
            (1, _) => {
                let level = |away: i64, size: u8| match size {
                    0 => Vec::new(),
                    size => vec![trueup::market::Level { price: price(away).to_f64(), size: f64::from(size) }],
                };
                quotes.push(at, &level(-i64::from(b & 3) - 1, *c), &level(i64::from(b >> 2 & 3), b >> 4));
            }
            (2, _) => {
                let action = if kind & 12 == 12 { DepthAction::Clear } else { DepthAction::Set };
                depth.push(DepthChange { time: at, known_at: at, side, action, price: near, size });
            }
            (_, what) => {
                let action = [OrderAction::Add, OrderAction::Change, OrderAction::Delete][usize::from(what - 1)];
                events.push(OrderEvent { time: at, known_at: at, id: u64::from(a % 16), action, side, price: near, size });
            }
        }
    }
    match how & 3 {
        0 => History::new(bars, Quotes::default()),
        1 => History::new(Vec::new(), quotes)?.with_prints(prints),
        2 => History::default().with_depth(depth)?.with_prints(prints),
        _ => History::default().with_order_events(events)?.with_prints(prints),
    }
}

/// Sends what the bytes ask for, one after the other.
struct Asks {
    asked: Vec<[u8; 4]>,
    next: usize,
    /// Orders that were changed: what they were filled at before is not held to the limit they have at the end.
    replaced: Vec<u64>,
}

impl Asks {
    fn ticket(&self, view: &View<'_>, [kind, a, b, c]: [u8; 4]) -> Option<Ticket> {
        let mark = view.price(0)?.0 / TICK;
        let near = |by: u8| Price((mark + i64::from(by % 16) - 8).max(1) * TICK);
        let kind = match kind & 15 {
            0 | 1 => OrderKind::Market,
            2 => OrderKind::Stop { trigger: near(a) },
            3 => OrderKind::StopLimit { trigger: near(a), price: near(b) },
            4 => OrderKind::TrailingStop { distance: Price(i64::from(a % 16 + 1) * TICK) },
            5 => OrderKind::MarketOnOpen,
            6 => OrderKind::LimitOnClose { price: near(a) },
            _ => OrderKind::Limit { price: near(a) },
        };
        let side = if c & 1 == 0 { Side::Buy } else { Side::Sell };
        let mut ticket = Ticket::new(0, side, Quantity(i64::from(b) * 1_000_000_000), kind);
        ticket.time_in_force = match c >> 1 & 7 {
            0 => TimeInForce::Day,
            1 => TimeInForce::GoodTillDate(view.now() + i64::from(a)),
            2 => TimeInForce::ImmediateOrCancel,
            3 => TimeInForce::FillOrKill,
            _ => TimeInForce::GoodTillCancelled,
        };
        ticket.condition = match c >> 4 & 7 {
            0 => Condition::PostOnly,
            1 => Condition::ReduceOnly,
            _ => Condition::None,
        };
        Some(ticket)
    }
}

impl Strategy for Asks {
    fn name(&self) -> &str {
        "asks"
    }
    fn lookback(&self) -> usize {
        1
    }
    fn on_event(&mut self, view: &View<'_>, orders: &mut Orders) {
        for _ in 0..2 {
            let Some(part) = self.asked.get(self.next).copied() else { return };
            self.next += 1;
            let known = view.orders(0);
            let own = known.get(usize::from(part[1]) % known.len().max(1)).map(|order| order.id);
            let ticket = self.ticket(view, part);
            match (part[0] >> 4 & 7, own, ticket) {
                (5, Some(id), _) => orders.cancel(id),
                (6, Some(id), ticket) => {
                    self.replaced.push(id.0);
                    let price = ticket.and_then(|ticket| ticket.kind.limit());
                    orders.replace(id, Some(Quantity(i64::from(part[2]) * 1_000_000_000)), price);
                }
                (7, _, Some(ticket)) => {
                    orders.one_cancels_other(&[ticket, ticket]);
                }
                (4, _, Some(ticket)) => {
                    let exit = ticket.kind.limit().unwrap_or(Price(10_000 * TICK));
                    let [gain, loss] = [exit.0 + 3 * TICK, exit.0 - 3 * TICK].map(|price| Price(price.max(TICK)));
                    orders.bracket(ticket, gain, loss);
                }
                (_, _, Some(ticket)) => {
                    let _: OrderId = orders.submit(ticket);
                }
                _ => {}
            }
        }
    }
}

fn check(record: &Record, replaced: &[u64]) {
    let fills = &record.blotter.fills;
    for order in &record.blotter.orders {
        let own = || fills.iter().filter(|fill| fill.order_id == order.order_id);
        let filled = own().fold(Quantity::ZERO, |sum, fill| sum + fill.quantity);
        assert!(filled == order.filled && filled <= order.quantity, "{order:?}");
        assert!(own().all(|fill| fill.quantity > Quantity::ZERO && fill.filled_at >= order.arrives_at), "{order:?}");
        if let Some(limit) = order.kind.limit().filter(|_| !replaced.contains(&order.order_id)) {
            assert!(own().all(|fill| fill.side.accepts(fill.price, limit)), "{order:?}");
        }
    }
    assert!(fills.iter().all(|fill| fill.why.queued_behind >= 0.0 && fill.price > Price(0)));
    let paid = |fill: &Fill| i128::from(fill.quantity.signed(fill.side).0) * i128::from(fill.price.0) + fill.fee.0;
    let cash = record.ledger.opening().0 - fills.iter().map(paid).sum::<i128>();
    assert_eq!(record.ledger.cash().0, cash);
    let held = fills.iter().fold(Quantity::ZERO, |sum, fill| sum + fill.quantity.signed(fill.side));
    assert_eq!(record.ledger.positions()[0].quantity, held);
}
