//! A log of orders and fills, as a broker or a bot wrote it.
//!
//! Nothing is made up: what a log does not say is `None`. Numbers are exact; prices and fees have the currencies the log gives
//! them.

use serde::Serialize;

use crate::sim2real::Timestamp;

use super::super::{Cash, Price, Quantity, Side};
use super::{OrderWords, PaperClock, PaperFindings, PaperStatus, SourcePlace};

/// An order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PaperOrder {
    /// Its id in the log.
    pub id: String,
    /// The id the client gave it, where that is another.
    pub client_id: Option<String>,
    /// What it trades, by the name that the mapping of symbols gives it.
    pub symbol: String,
    /// Which way.
    pub side: Side,
    /// How much was ordered [units]; none where an amount of cash was.
    pub quantity: Option<Quantity>,
    /// What kind it was; none where the log does not say.
    pub kind: Option<OrderWords>,
    /// The worst price it trades at.
    pub limit_price: Option<Price>,
    /// The price that sets it off.
    pub stop_price: Option<Price>,
    /// For how long it works, in the log's word in lower case.
    pub time_in_force: Option<String>,
    /// The first known of it: what it is says the log's [`PaperClock`] of that column.
    pub decided_at: Option<Timestamp>,
    /// When it was sent or taken.
    pub submitted_at: Option<Timestamp>,
    /// When it was filled, withdrawn or refused.
    pub ended_at: Option<Timestamp>,
    /// What became of it; none where the log does not say.
    pub status: Option<PaperStatus>,
    /// How much of it the log says was filled [units]; none where it does not say.
    pub filled: Option<Quantity>,
    /// The average price it says it was filled at.
    pub average_price: Option<Price>,
    /// Id of the order that took its place.
    pub replaced_by: Option<String>,
    /// Id of the order whose place it took, or to which it belongs as a leg.
    pub parent: Option<String>,
    /// The strategy that sent it.
    pub strategy: Option<String>,
    /// What the strategy called it.
    pub tag: Option<String>,
    /// The best bid it was decided on.
    pub seen_bid: Option<Price>,
    /// The best ask it was decided on.
    pub seen_ask: Option<Price>,
    /// Where it stands in the source.
    pub place: SourcePlace,
}

impl PaperOrder {
    /// An order of which no more is known.
    #[must_use]
    pub fn new(id: &str, symbol: &str, side: Side, place: SourcePlace) -> Self {
        Self {
            id: id.to_owned(),
            client_id: None,
            symbol: symbol.to_owned(),
            side,
            quantity: None,
            kind: None,
            limit_price: None,
            stop_price: None,
            time_in_force: None,
            decided_at: None,
            submitted_at: None,
            ended_at: None,
            status: None,
            filled: None,
            average_price: None,
            replaced_by: None,
            parent: None,
            strategy: None,
            tag: None,
            seen_bid: None,
            seen_ask: None,
            place,
        }
    }

    /// The first time that is known of it.
    #[must_use]
    pub fn first_time(&self) -> Option<Timestamp> {
        self.decided_at.or(self.submitted_at).or(self.ended_at)
    }
}

/// As what a fill met the market.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Liquidity {
    /// It rested.
    Maker,
    /// It took.
    Taker,
}

impl Liquidity {
    /// Its word in the tables that are written.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Maker => "maker",
            Self::Taker => "taker",
        }
    }

    /// The role that `word` stands for, in any case.
    #[must_use]
    pub fn of_word(word: &str) -> Option<Self> {
        [Self::Maker, Self::Taker].into_iter().find(|role| word.trim().eq_ignore_ascii_case(role.word()))
    }
}

/// A fee as it was charged.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Charge {
    /// How much [its currency]: positive where it was paid, negative for a rebate.
    pub amount: Cash,
    /// In which currency; none where the log does not say, and it counts as that of the price.
    pub currency: Option<String>,
}

/// Whether a fill is one execution.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FillOrigin {
    /// The log states it as one.
    Execution,
    /// It stands for all executions of an order, of which the log keeps the total at an average price.
    OrderTotal,
}

impl FillOrigin {
    /// Its word in the tables that are written.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Execution => "execution",
            Self::OrderTotal => "order_total",
        }
    }
}

/// A fill.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PaperFill {
    /// Its id in the log.
    pub id: Option<String>,
    /// Id of the order it belongs to; none where the log does not say.
    pub order_id: Option<String>,
    /// What was traded, by the name that the mapping of symbols gives it.
    pub symbol: String,
    /// Which way; none where neither the fill nor its order says.
    pub side: Option<Side>,
    /// When: what it is says the log's [`PaperClock`] of that column.
    pub filled_at: Timestamp,
    /// How much [units].
    pub quantity: Quantity,
    /// At which price [its currency].
    pub price: Price,
    /// Currency of the price, where the log or the symbol says.
    pub currency: Option<String>,
    /// The fee in the currency of the price; none where it is unknown, or in a currency for which there is no rate.
    pub fee: Option<Cash>,
    /// The fee as it was charged.
    pub charged: Option<Charge>,
    /// As what it met the market.
    pub liquidity: Option<Liquidity>,
    /// Whether it is one execution.
    pub origin: FillOrigin,
    /// Where it stands in the source.
    pub place: SourcePlace,
}

impl PaperFill {
    /// A fill of which no more is known.
    #[must_use]
    pub fn new(symbol: &str, filled_at: Timestamp, quantity: Quantity, price: Price, place: SourcePlace) -> Self {
        Self {
            id: None,
            order_id: None,
            symbol: symbol.to_owned(),
            side: None,
            filled_at,
            quantity,
            price,
            currency: None,
            fee: None,
            charged: None,
            liquidity: None,
            origin: FillOrigin::Execution,
            place,
        }
    }
}

/// A log: orders in the order of their times, fills in the order of theirs, and what was odd.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct PaperLog {
    /// Id of the format it was read from.
    pub format: String,
    /// Orders.
    pub orders: Vec<PaperOrder>,
    /// Fills.
    pub fills: Vec<PaperFill>,
    /// What the times are.
    pub clocks: Vec<PaperClock>,
    /// What was odd.
    pub findings: PaperFindings,
}

impl PaperLog {
    /// The names of what was traded, sorted.
    #[must_use]
    pub fn symbols(&self) -> Vec<&str> {
        let orders = self.orders.iter().map(|order| order.symbol.as_str());
        let mut symbols: Vec<&str> = orders.chain(self.fills.iter().map(|fill| fill.symbol.as_str())).collect();
        symbols.sort_unstable();
        symbols.dedup();
        symbols
    }

    /// The first and the last time there is, of orders and fills.
    #[must_use]
    pub fn span(&self) -> Option<[Timestamp; 2]> {
        let orders = self.orders.iter().flat_map(|o| [o.decided_at, o.submitted_at, o.ended_at].into_iter().flatten());
        orders.chain(self.fills.iter().map(|fill| fill.filled_at)).fold(None, |span, time| match span {
            None => Some([time, time]),
            Some([first, last]) => Some([first.min(time), last.max(time)]),
        })
    }
}
