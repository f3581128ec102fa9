//! hftbacktest: a row an order, as a strategy that records its orders writes them.
//!
//! The engine has no log of its own; these are the fields of its `Order` under plain names, and the quotes it was decided on.

use super::super::{FindingKind, OrderWords, PaperStatus, TimeColumn, TimeMeaning};
use super::draft::{Draft, Entries};
use super::row::Row;
use super::stamp::Written;
use super::{Format, Stop};
use crate::io::{InputError, Records};
use crate::market::{Quantity, Side};

pub(super) static FORMAT: Format = Format {
    id: "hftbacktest",
    title: "orders recorded from hftbacktest as a table, a row an order",
    known_by: "`submit_local_ns`, `exec_px`, `exec_qty` and `leaves`",
    claims: |table| table.has_all(&["submit_local_ns", "side", "exec_px", "exec_qty", "status", "leaves"]),
    read,
    tables: &[],
};

/// Times are nanoseconds.
const NANOSECONDS: Written = Written::Count(1);

fn read(tables: &[&Records], draft: &mut Draft<'_>) -> Result<(), InputError> {
    draft.clock(TimeColumn::DecidedAt, "submit_local_ns", TimeMeaning::Decided);
    draft.clock(TimeColumn::SubmittedAt, "submit_local_ns", TimeMeaning::Submitted);
    draft.clock(TimeColumn::EndedAt, "exch_ns", TimeMeaning::Executed);
    draft.clock(TimeColumn::FilledAt, "exch_ns", TimeMeaning::Executed);
    for table in tables {
        let stem = table.path().file_name().unwrap_or_default().to_string_lossy();
        let symbol = stem.split('.').next().unwrap_or_default().to_owned();
        draft.note(FindingKind::Note, format!("the log names no symbol: {symbol:?}, the name of the file, stands for it"));
        draft.each(table, |row, entries| order(row, &symbol, entries))?;
    }
    draft.note(FindingKind::Note, "`exec_px` and `exec_qty` are the last execution of an order: earlier ones are in no row");
    draft.note(FindingKind::Note, "times are floating-point numbers: to 256 ns");
    Ok(())
}

fn order(row: &mut Row<'_>, symbol: &str, entries: &mut Entries) -> Result<(), Stop> {
    let side = match row.need("side")?.trim_end_matches(".0") {
        "1" => Side::Buy,
        "-1" => Side::Sell,
        _ => return Err(row.unread("side", "expected 1 or -1")),
    };
    let mut order = row.order(&row.number().to_string(), symbol, side);
    order.kind = Some(OrderWords::Limit);
    order.limit_price = row.price_above_zero("limit_px")?;
    order.decided_at = row.time("submit_local_ns", NANOSECONDS)?;
    order.submitted_at = order.decided_at;
    order.seen_bid = row.price_above_zero("seen_bid")?;
    order.seen_ask = row.price_above_zero("seen_ask")?;
    order.status = Some(match row.need("status")?.trim_end_matches(".0") {
        "1" | "5" => PaperStatus::Open,
        "2" => PaperStatus::Expired,
        "3" => PaperStatus::Filled,
        "4" => PaperStatus::Cancelled,
        "6" => PaperStatus::Rejected,
        other => PaperStatus::of_word(other),
    });
    order.ended_at = row.time("exch_ns", NANOSECONDS)?;
    let executed = row.quantity("exec_qty")?.filter(|executed| executed.0 > 0);
    let leaves = row.quantity("leaves")?.unwrap_or(Quantity::ZERO);
    order.filled = Some(executed.unwrap_or(Quantity::ZERO));
    order.average_price = executed.and(row.price_above_zero("exec_px")?);
    // What one execution filled and what is left are all of it only where there was no other.
    order.quantity = Some(order.filled.unwrap_or(Quantity::ZERO) + leaves);
    entries.total(&order, None);
    entries.orders.push(order);
    Ok(())
}
