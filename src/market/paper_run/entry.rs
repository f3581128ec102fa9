//! What the journal of a paper run holds, a line an entry.

use serde::{Deserialize, Serialize};

use crate::market::{Blotter, Fill, Instrument, Order, Rejection};

use super::stored_row::StoredRow;

/// The form of the journal; a change of meaning is another.
pub(super) const SCHEMA: &str = "trueup.paper/1";

/// A line of the journal.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub(super) enum Entry {
    /// The first line: which run it is.
    Header(Header),
    /// A row of a file, before the engine has it; `stream` numbers the files.
    Row { stream: usize, row: StoredRow },
    /// A line of the feed on standard input, before it is read.
    Line { line: usize, text: String },
    /// The feed on standard input has ended.
    EndOfInput {},
    /// An order was sent.
    Order(OrderEntry),
    /// A fill became known.
    Fill(FillEntry),
    /// An order was refused.
    Refusal(RefusalEntry),
    /// Nothing more is shown to the strategy.
    Stop(Stop),
    /// The tables are written.
    Closed {},
}

/// Which run a journal is of.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Header {
    pub schema: String,
    /// Version of the program.
    pub version: String,
    /// SHA-256 of RUN.toml, in hexadecimal digits.
    pub run_sha256: String,
    pub seed: u64,
    pub feed: FeedFrom,
}

/// Where the rows come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FeedFrom {
    /// The files that RUN.toml names.
    Files,
    /// Lines of JSON.
    Lines,
}

/// An order that was sent. Amounts are exact decimals.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct OrderEntry {
    /// Events the strategy had seen when it was sent: what it followed from is the last of them.
    pub event: usize,
    pub order_id: u64,
    pub symbol: String,
    /// [ns since 1970, UTC]
    pub decided_at: i64,
    pub arrives_at: i64,
    pub side: String,
    /// In whole 1e-9.
    pub qty: i64,
    #[serde(rename = "type")]
    pub kind: String,
    pub limit_price: Option<i64>,
    pub stop_price: Option<i64>,
    pub time_in_force: String,
    pub decision_price: i64,
    pub sent_by: String,
}

/// A fill, in the same units.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FillEntry {
    /// Events the strategy had seen when it became known.
    pub event: usize,
    pub fill_id: u64,
    pub order_id: u64,
    pub symbol: String,
    pub filled_at: i64,
    pub side: String,
    pub qty: i64,
    pub price: i64,
    /// As a decimal.
    pub fee: String,
    pub liquidity: String,
    /// The kind of data that brought it about, and their row, from 0.
    pub data: String,
    pub data_row: usize,
}

/// An order that was refused.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RefusalEntry {
    pub event: usize,
    pub symbol: String,
    pub decided_at: i64,
    pub side: String,
    pub qty: i64,
    pub reason: String,
}

/// Why, and after how many steps, nothing more is shown to the strategy.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stop {
    /// Why.
    pub why: StopReason,
    /// Steps of the session up to it.
    pub after: u64,
}

/// Why a paper run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StopReason {
    /// The feed has no more rows.
    EndOfFeed,
    /// The kill file appeared.
    KillFile,
    /// Somebody pressed Ctrl-C, or asked the process to end.
    Interrupted,
}

impl StopReason {
    /// What it says of a session.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Self::EndOfFeed => "the feed has ended",
            Self::KillFile => "the kill file appeared",
            Self::Interrupted => "it was interrupted",
        }
    }
}

/// How much of a blotter is in the journal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Told {
    orders: usize,
    fills: usize,
    refusals: usize,
}

impl Told {
    /// What has come to a blotter since, as entries: what was sent, what was refused, what was filled.
    pub fn news(&mut self, blotter: &Blotter, instruments: &[Instrument], event: usize) -> Vec<Entry> {
        let Self { orders, fills, refusals } = *self;
        *self = Self { orders: blotter.orders.len(), fills: blotter.fills.len(), refusals: blotter.rejections.len() };
        if *self == (Self { orders, fills, refusals }) {
            return Vec::new();
        }
        let symbol = |k: usize| instruments.get(k).map_or_else(|| k.to_string(), |instrument| instrument.symbol.clone());
        let sent =
            blotter.orders.iter().skip(orders).map(|order| Entry::Order(of_order(order, symbol(order.instrument), event)));
        let refused = blotter.rejections.iter().skip(refusals);
        let refused = refused.map(|refusal| Entry::Refusal(of_refusal(refusal, symbol(refusal.instrument), event)));
        let filled = blotter.fills.iter().skip(fills).map(|fill| Entry::Fill(of_fill(fill, symbol(fill.instrument), event)));
        sent.chain(refused).chain(filled).collect()
    }
}

fn of_order(order: &Order, symbol: String, event: usize) -> OrderEntry {
    OrderEntry {
        event,
        order_id: order.order_id,
        symbol,
        decided_at: order.decided_at.0,
        arrives_at: order.arrives_at.0,
        side: order.side.word().to_owned(),
        qty: order.quantity.0,
        kind: order.kind.word().to_owned(),
        limit_price: order.kind.limit().map(|price| price.0),
        stop_price: order.kind.trigger().map(|price| price.0),
        time_in_force: order.time_in_force.word().to_owned(),
        decision_price: order.decision_price.0,
        sent_by: order.sender.word().to_owned(),
    }
}

fn of_fill(fill: &Fill, symbol: String, event: usize) -> FillEntry {
    FillEntry {
        event,
        fill_id: fill.fill_id,
        order_id: fill.order_id,
        symbol,
        filled_at: fill.filled_at.0,
        side: fill.side.word().to_owned(),
        qty: fill.quantity.0,
        price: fill.price.0,
        fee: fill.fee.to_string(),
        liquidity: fill.why.role.word().to_owned(),
        data: fill.why.data.word().to_owned(),
        data_row: fill.why.row,
    }
}

fn of_refusal(refusal: &Rejection, symbol: String, event: usize) -> RefusalEntry {
    RefusalEntry {
        event,
        symbol,
        decided_at: refusal.decided_at.0,
        side: refusal.side.word().to_owned(),
        qty: refusal.quantity.0,
        reason: refusal.reason.word().to_owned(),
    }
}
