//! A paper log in the form of this program's logs: `orders` and `fills`, and what was found.

use std::str::FromStr;

use serde::Serialize;

use super::{FindingSummary, PaperClock, PaperFill, PaperLog, PaperOrder, TimeColumn};
use crate::io::OutputTable;

/// `findings.json`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct PaperSummary {
    /// [`PaperSummary::SCHEMA`].
    pub schema: &'static str,
    /// Id of the format.
    pub format: String,
    /// Names of what was traded.
    pub symbols: Vec<String>,
    /// How many orders there are.
    pub orders: usize,
    /// How many fills.
    pub fills: usize,
    /// The first and the last time.
    pub span: Option<[String; 2]>,
    /// What the times are.
    pub clocks: Vec<PaperClock>,
    /// What was odd, kind by kind.
    pub findings: Vec<FindingSummary>,
}

impl PaperSummary {
    /// The schema, with its version.
    pub const SCHEMA: &'static str = "trueup.paper_log/1";
}

impl PaperLog {
    /// What the log is and what was found in it.
    #[must_use]
    pub fn summary(&self) -> PaperSummary {
        PaperSummary {
            schema: PaperSummary::SCHEMA,
            format: self.format.clone(),
            symbols: self.symbols().into_iter().map(str::to_owned).collect(),
            orders: self.orders.len(),
            fills: self.fills.len(),
            span: self.span().map(|span| span.map(|time| time.to_string())),
            clocks: self.clocks.clone(),
            findings: self.findings.summaries(),
        }
    }

    /// `orders`: `order_id, symbol, decided_at, side, qty, type, limit_price, submitted_at, strategy, seen_bid, seen_ask`, and beyond
    /// the contract's columns `status, filled_qty, average_price, stop_price, time_in_force, ended_at, client_order_id, replaced_by,
    /// parent, tag, source`, what the times are (`decided_at_is` and so on), and, where a number needs more digits than a
    /// floating-point number holds, all of its column as texts (`qty_exact` and so on).
    #[must_use]
    pub fn orders_table(&self) -> OutputTable {
        let of = &self.orders;
        let table = OutputTable::new()
            .texts("order_id", of.iter().map(|o| o.id.clone()))
            .texts("symbol", of.iter().map(|o| o.symbol.clone()))
            .times("decided_at", of.iter().map(|o| o.decided_at))
            .texts("side", of.iter().map(|o| o.side.word().to_owned()));
        let table = numbers(table, "qty", of.iter().map(|o| o.quantity))
            .texts("type", of.iter().map(|o| o.kind.as_ref().map(|kind| kind.word().to_owned())));
        let table = numbers(table, "limit_price", of.iter().map(|o| o.limit_price))
            .times("submitted_at", of.iter().map(|o| o.submitted_at))
            .texts("strategy", of.iter().map(|o| o.strategy.clone()));
        let table = numbers(table, "seen_bid", of.iter().map(|o| o.seen_bid));
        let table = numbers(table, "seen_ask", of.iter().map(|o| o.seen_ask))
            .texts("status", of.iter().map(|o| o.status.as_ref().map(|status| status.word().to_owned())));
        let table = numbers(table, "filled_qty", of.iter().map(|o| o.filled));
        let table = numbers(table, "average_price", of.iter().map(|o| o.average_price));
        let table = numbers(table, "stop_price", of.iter().map(|o| o.stop_price));
        let text = |table: OutputTable, name: &str, of_order: fn(&PaperOrder) -> &Option<String>| {
            table.texts(name, of.iter().map(|order| of_order(order).clone()))
        };
        let table = text(table, "time_in_force", |o| &o.time_in_force).times("ended_at", of.iter().map(|o| o.ended_at));
        let table = text(table, "client_order_id", |o| &o.client_id);
        let table = text(table, "replaced_by", |o| &o.replaced_by);
        let table = text(table, "parent", |o| &o.parent);
        let table = text(table, "tag", |o| &o.tag).texts("source", of.iter().map(|o| o.place.to_string()));
        self.meanings(table, &[TimeColumn::DecidedAt, TimeColumn::SubmittedAt, TimeColumn::EndedAt], of.len())
    }

    /// `fills`: `order_id, filled_at, qty, price, fee, liquidity, fill_id`, and beyond the contract's columns `symbol, side, currency,
    /// fee_charged, fee_currency, origin, source, filled_at_is` and the exact texts, as of [`orders_table`](Self::orders_table).
    /// `fee` is in the currency of the price, and empty where it is not known in that.
    #[must_use]
    pub fn fills_table(&self) -> OutputTable {
        let of = &self.fills;
        let text = |table: OutputTable, name: &str, of_fill: fn(&PaperFill) -> Option<String>| {
            table.texts(name, of.iter().map(of_fill))
        };
        let table = text(OutputTable::new(), "order_id", |f| f.order_id.clone());
        let table = table.times("filled_at", of.iter().map(|f| f.filled_at));
        let table = numbers(table, "qty", of.iter().map(|f| Some(f.quantity)));
        let table = numbers(table, "price", of.iter().map(|f| Some(f.price)));
        let table = numbers(table, "fee", of.iter().map(|f| f.fee));
        let table = text(table, "liquidity", |f| f.liquidity.map(|role| role.word().to_owned()));
        let table = text(table, "fill_id", |f| f.id.clone());
        let table = text(table, "symbol", |f| Some(f.symbol.clone()));
        let table = text(table, "side", |f| f.side.map(|side| side.word().to_owned()));
        let table = text(table, "currency", |f| f.currency.clone());
        let table = numbers(table, "fee_charged", of.iter().map(|f| f.charged.as_ref().map(|charge| charge.amount)));
        let table = text(table, "fee_currency", |f| f.charged.as_ref().and_then(|charge| charge.currency.clone()));
        let table = text(table, "origin", |f| Some(f.origin.word().to_owned()));
        let table = text(table, "source", |f| Some(f.place.to_string()));
        self.meanings(table, &[TimeColumn::FilledAt], of.len())
    }

    /// Adds what the times of `columns` are.
    fn meanings(&self, table: OutputTable, columns: &[TimeColumn], rows: usize) -> OutputTable {
        columns.iter().fold(table, |table, column| match self.clocks.iter().find(|clock| clock.column == *column) {
            Some(clock) => {
                let word = clock.meaning.word().to_owned();
                table.texts(&format!("{}_is", column.word()), std::iter::repeat_n(word, rows))
            }
            None => table,
        })
    }
}

/// Adds a column of exact numbers, each as the nearest floating-point number; where one of them does not come back from that,
/// all of them as texts beside.
fn numbers<T: FromStr + ToString + PartialEq + Copy>(
    table: OutputTable,
    name: &str,
    values: impl Iterator<Item = Option<T>>,
) -> OutputTable {
    let exact: Vec<Option<T>> = values.collect();
    let floats: Vec<Option<f64>> = exact.iter().map(|v| v.and_then(|v| v.to_string().parse().ok())).collect();
    let comes_back = |(value, float): (&Option<T>, &Option<f64>)| match (value, float) {
        (Some(value), Some(float)) => T::from_str(&float.to_string()).is_ok_and(|read| read == *value),
        (value, _) => value.is_none(),
    };
    let all = exact.iter().zip(&floats).all(comes_back);
    let table = table.floats(name, floats);
    if all {
        return table;
    }
    table.texts(&format!("{name}_exact"), exact.iter().map(|value| value.map(|value| value.to_string())))
}
