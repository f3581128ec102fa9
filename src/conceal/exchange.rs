//! One trading day of a small exchange: a crowd in an order book, and one client who sends market orders into it.
//!
//! What a backtest at the mid leaves out is here by construction: the spread, the walk through the book, and the way from
//! the client to the exchange. More can be concealed: a concession beyond the book, a cap on participation, fees.

mod agents;
mod client;
pub mod order_book;

use crate::sim2real::Seed;

use super::{Column, Table};
use agents::{Agents, Climate};
use client::{Client, Intention};
use order_book::{Match, OrderBook, Side};

/// Levels that the tape shows on each side.
pub const LEVELS: usize = 5;
/// Seconds before the open during which the crowd fills the book unseen.
const WARM_UP: f64 = 900.0;

/// What the client pays.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fees {
    /// Nothing.
    None,
    /// A part of the money that changes hands [bps].
    OfNotional(f64),
    /// An amount for each share [currency].
    PerShare(f64),
}

/// A maker behind the book who gives worse prices to larger orders.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Concession {
    /// What an order as large as a mean minute's volume gives up beyond the book [bps].
    pub bps: f64,
    /// Power of the participation; 0.6 in Almgren et al. 2005, "Direct estimation of equity market impact".
    pub exponent: f64,
}

/// An exchange, its crowd and its client.
#[derive(Debug, Clone, PartialEq)]
pub struct Exchange {
    /// Name of what is traded.
    pub symbol: &'static str,
    /// The open [ns since the Unix epoch].
    pub open: i64,
    /// Length of the session [s].
    pub session: f64,
    /// Ticks in one unit of currency.
    pub ticks_per_unit: i64,
    /// First value [ticks].
    pub level: f64,
    /// How much the hidden value moves [ticks per square root of a second].
    pub volatility: f64,
    /// Orders of the client.
    pub orders: usize,
    /// Smallest and largest order of the client [lots of one share].
    pub sizes: (i64, i64),
    /// One-way latency from decision to exchange [s].
    pub latency: f64,
    /// Standard deviation of what is added to the latency, at most three times this [s].
    pub jitter: f64,
    /// Fees.
    pub fees: Fees,
    /// Concession beyond the book.
    pub concession: Option<Concession>,
    /// Largest part of the five displayed levels that an order gets; what is beyond lapses.
    pub participation: Option<f64>,
}

impl Default for Exchange {
    /// The exchange of the `execution` set: 2024-08-06, 09:30 to 16:00 in New York.
    fn default() -> Self {
        Self {
            symbol: "XYZ",
            open: 1_722_951_000_000_000_000,
            session: 23_400.0,
            ticks_per_unit: 100,
            level: 5_000.0,
            volatility: 0.32,
            orders: 800,
            sizes: (20, 400),
            latency: 0.3,
            jitter: 0.0003,
            fees: Fees::OfNotional(0.4),
            concession: None,
            participation: None,
        }
    }
}

/// An order of the client as it was decided.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClientOrder {
    /// Number, from 1.
    pub id: u64,
    /// Time of the decision [ns].
    pub decided_at: i64,
    /// Side.
    pub side: Side,
    /// Quantity [lots].
    pub quantity: i64,
    /// Best bid and offer at the decision [ticks].
    pub seen: (i64, i64),
}

/// A fill of the client.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fill {
    /// The order.
    pub order: u64,
    /// Time at the exchange [ns].
    pub filled_at: i64,
    /// Quantity [lots].
    pub quantity: i64,
    /// Price in the book [ticks].
    pub ticks: i64,
    /// Price paid, concession included [currency].
    pub price: f64,
    /// Fee [currency].
    pub fee: f64,
}

/// The displayed book after a change.
#[derive(Debug, Clone, PartialEq)]
pub struct Quote {
    /// Time of the change [ns].
    pub ts: i64,
    /// Bids, best first [ticks, lots].
    pub bids: [(i64, i64); LEVELS],
    /// Offers, best first [ticks, lots].
    pub asks: [(i64, i64); LEVELS],
}

/// A trade of anyone with anyone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trade {
    /// Time [ns].
    pub ts: i64,
    /// Price [ticks].
    pub ticks: i64,
    /// Size [lots].
    pub size: i64,
    /// Who took.
    pub aggressor: Side,
}

/// What was recorded of one day.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Day {
    /// The client's orders, by decision.
    pub orders: Vec<ClientOrder>,
    /// The client's fills, in time.
    pub fills: Vec<Fill>,
    /// The book after every change of its five levels.
    pub quotes: Vec<Quote>,
    /// All trades.
    pub trades: Vec<Trade>,
}

impl Exchange {
    /// One day.
    #[must_use]
    pub fn day(&self, seed: Seed) -> Day {
        let climate = Climate::new(-WARM_UP, self.session, self.level, self.volatility, seed);
        let mut client = Client::new(self, &climate, seed);
        let mut floor = Floor { exchange: self, book: OrderBook::default(), day: Day::default() };
        let mut agents = Agents::new(seed);
        agents.open(&mut floor.book, &climate, -WARM_UP);
        let mut now = -WARM_UP;
        loop {
            let until = now + agents.wait(&climate, now);
            while let Some((time, intention)) = client.next_before(until) {
                match intention {
                    Intention::Decide(size) => client.sent(floor.decide(time, size)),
                    Intention::Arrive(order) => floor.execute(time, order),
                }
            }
            if until > self.session {
                return floor.day;
            }
            let trades = agents.act(&mut floor.book, &climate, until);
            floor.record(self.stamp(until), trades, now < 0.0);
            now = until;
        }
    }

    /// Seconds after the open as a time stamp [ns].
    fn stamp(&self, time: f64) -> i64 {
        self.open + (time * 1e9).round() as i64
    }

    fn fee(&self, price: f64, quantity: i64) -> f64 {
        let fee = match self.fees {
            Fees::None => 0.0,
            Fees::OfNotional(bps) => price * quantity as f64 * bps * 1e-4,
            Fees::PerShare(amount) => quantity as f64 * amount,
        };
        (fee * 1e6).round() / 1e6
    }
}

/// The trading floor while the day lasts.
struct Floor<'a> {
    exchange: &'a Exchange,
    book: OrderBook,
    day: Day,
}

impl Floor<'_> {
    fn decide(&mut self, time: f64, (side, quantity): (Side, i64)) -> ClientOrder {
        let order = ClientOrder {
            id: self.day.orders.len() as u64 + 1,
            decided_at: self.exchange.stamp(time),
            side,
            quantity,
            seen: (self.book.best_bid().unwrap_or_default(), self.book.best_ask().unwrap_or_default()),
        };
        self.day.orders.push(order);
        order
    }

    fn execute(&mut self, time: f64, order: ClientOrder) {
        let ts = self.exchange.stamp(time);
        let displayed: i64 = self.book.depth(order.side.opposite(), LEVELS).iter().map(|level| level.1).sum();
        let cap = self.exchange.participation.map_or(i64::MAX, |part| (part * displayed as f64) as i64);
        let matches = self.book.market(order.side, order.quantity.min(cap.max(1)));
        let concession = self.conceded(order.quantity, ts);
        // The client hears of one fill a price, however many orders it met there.
        for level in matches.chunk_by(|a, b| a.ticks == b.ticks) {
            let (ticks, quantity) = (level[0].ticks, level.iter().map(|met| met.quantity).sum());
            let unit = ticks as f64 / self.exchange.ticks_per_unit as f64;
            let price = (unit * (1.0 + order.side.sign() as f64 * concession) * 1e6).round() / 1e6;
            let fee = self.exchange.fee(price, quantity);
            self.day.fills.push(Fill { order: order.id, filled_at: ts, quantity, ticks, price, fee });
        }
        self.record(ts, Some((order.side, matches)), false);
    }

    /// What an order gives up beyond the book, as a fraction of the price.
    fn conceded(&self, quantity: i64, ts: i64) -> f64 {
        let Some(Concession { bps, exponent }) = self.exchange.concession else { return 0.0 };
        let minutes = ((ts - self.exchange.open) as f64 / 60e9).max(1.0);
        let traded: i64 = self.day.trades.iter().map(|trade| trade.size).sum();
        bps * 1e-4 * (quantity as f64 / (traded as f64 / minutes).max(1.0)).powf(exponent)
    }

    /// Writes down trades, and the book where its displayed part has changed. Before the open nothing is written but the
    /// book as it opens.
    fn record(&mut self, ts: i64, trades: Option<(Side, Vec<Match>)>, before_open: bool) {
        if ts < self.exchange.open {
            return;
        }
        if let Some((aggressor, matches)) = trades {
            let trade = |met: Match| Trade { ts, ticks: met.ticks, size: met.quantity, aggressor };
            self.day.trades.extend(matches.into_iter().map(trade));
        }
        let ts = if before_open { self.exchange.open } else { ts };
        let quote = Quote { ts, bids: self.levels(Side::Buy), asks: self.levels(Side::Sell) };
        match self.day.quotes.last_mut() {
            Some(last) if last.bids == quote.bids && last.asks == quote.asks => {}
            Some(last) if last.ts >= ts => *last = Quote { ts: last.ts, ..quote },
            _ => self.day.quotes.push(quote),
        }
    }

    fn levels(&self, side: Side) -> [(i64, i64); LEVELS] {
        let depth = self.book.depth(side, LEVELS);
        std::array::from_fn(|k| depth.get(k).copied().unwrap_or_default())
    }
}

impl Day {
    /// Orders, fills, quotes and trades with the contract's columns, prices in currency.
    #[must_use]
    pub fn tables(&self, exchange: &Exchange) -> [(&'static str, Table); 4] {
        let unit = |ticks: i64| ticks as f64 / exchange.ticks_per_unit as f64;
        let reals = |values: &mut dyn Iterator<Item = i64>| Column::Real(values.map(unit).collect());
        let orders = &self.orders;
        let order_table = Table::default()
            .with("order_id", Column::Whole(orders.iter().map(|o| o.id as i64).collect()))
            .with("symbol", Column::Text(vec![exchange.symbol.to_owned(); orders.len()]))
            .with("decided_at", Column::Time(orders.iter().map(|o| o.decided_at).collect()))
            .with("side", Column::Text(orders.iter().map(|o| o.side.word().to_owned()).collect()))
            .with("qty", Column::Whole(orders.iter().map(|o| o.quantity).collect()))
            .with("type", Column::Text(vec!["market".to_owned(); orders.len()]))
            .with("limit_price", Column::Empty(orders.len()))
            .with("seen_bid", reals(&mut orders.iter().map(|o| o.seen.0)))
            .with("seen_ask", reals(&mut orders.iter().map(|o| o.seen.1)));
        let fills = &self.fills;
        let fill_table = Table::default()
            .with("order_id", Column::Whole(fills.iter().map(|f| f.order as i64).collect()))
            .with("filled_at", Column::Time(fills.iter().map(|f| f.filled_at).collect()))
            .with("qty", Column::Whole(fills.iter().map(|f| f.quantity).collect()))
            .with("price", Column::Real(fills.iter().map(|f| f.price).collect()))
            .with("fee", Column::Real(fills.iter().map(|f| f.fee).collect()));
        let trades = &self.trades;
        let trade_table = Table::default()
            .with("ts", Column::Time(trades.iter().map(|t| t.ts).collect()))
            .with("price", reals(&mut trades.iter().map(|t| t.ticks)))
            .with("size", Column::Whole(trades.iter().map(|t| t.size).collect()))
            .with("aggressor", Column::Text(trades.iter().map(|t| t.aggressor.word().to_owned()).collect()));
        [("orders", order_table), ("fills", fill_table), ("quotes", self.quote_table(&unit)), ("trades", trade_table)]
    }

    fn quote_table(&self, unit: &dyn Fn(i64) -> f64) -> Table {
        let mut table = Table::default().with("ts", Column::Time(self.quotes.iter().map(|q| q.ts).collect()));
        for level in 0..LEVELS {
            let suffix = if level == 0 { String::new() } else { (level + 1).to_string() };
            for (side, name) in [(Side::Buy, "bid"), (Side::Sell, "ask")] {
                let at = |quote: &Quote| if side == Side::Buy { quote.bids[level] } else { quote.asks[level] };
                let prices = self.quotes.iter().map(|quote| unit(at(quote).0)).collect();
                let sizes = self.quotes.iter().map(|quote| at(quote).1).collect();
                let size_name = if level == 0 { format!("{name}_size") } else { format!("{name}{suffix}_size") };
                table = table.with(format!("{name}{suffix}"), Column::Real(prices)).with(size_name, Column::Whole(sizes));
            }
        }
        table
    }
}

#[cfg(test)]
mod tests;
