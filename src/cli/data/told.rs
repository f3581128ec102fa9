//! A paper log on the terminal.

use std::collections::BTreeMap;

use crate::market::paper::{PaperClock, PaperLog};
use crate::market::{Cash, Quantity};

use super::super::screen::{Screen, titled};

/// How many symbols and examples are shown.
const SHOWN: usize = 20;

/// All that is said of a log: orders, symbols, fees, times and findings.
pub(super) fn told(log: &PaperLog, screen: &Screen) -> String {
    let (orders, fills) = (log.orders.len(), log.fills.len());
    let span = log.span().map(|[first, last]| format!(", {first} to {last}")).unwrap_or_default();
    let head = format!("Log of {}: {orders} orders and {fills} fills{span}.", log.format);
    let mut text = format!("{}\n", screen.wrapped("", &head));
    if !log.orders.is_empty() {
        text += &titled("Orders", &order_table(log, screen));
    }
    if !log.symbols().is_empty() {
        text += &titled("Symbols", &symbol_table(log, screen));
    }
    if log.fills.iter().any(|fill| fill.charged.is_some()) {
        text += &titled("Fees", &fee_table(log, screen));
    }
    if !log.clocks.is_empty() {
        text += &titled("Times", &clock_table(&log.clocks, screen));
    }
    text + &findings(log, screen)
}

/// Orders by type and status.
fn order_table(log: &PaperLog, screen: &Screen) -> comfy_table::Table {
    let mut counts: BTreeMap<(&str, &str), usize> = BTreeMap::new();
    for order in &log.orders {
        let kind = order.kind.as_ref().map_or("not said", |kind| kind.word());
        let status = order.status.as_ref().map_or("not said", |status| status.word());
        *counts.entry((kind, status)).or_default() += 1;
    }
    let mut table = screen.table(["type", "status", ">orders"]);
    for ((kind, status), count) in counts {
        table.add_row([kind.to_owned(), status.to_owned(), count.to_string()]);
    }
    table
}

fn symbol_table(log: &PaperLog, screen: &Screen) -> comfy_table::Table {
    let mut table = screen.table(["symbol", ">orders", ">fills", ">traded"]);
    let symbols = log.symbols();
    let mut rows: BTreeMap<&str, (usize, usize, Quantity)> =
        symbols.iter().map(|name| (*name, Default::default())).collect();
    for order in &log.orders {
        if let Some(row) = rows.get_mut(order.symbol.as_str()) {
            row.0 += 1;
        }
    }
    for fill in &log.fills {
        if let Some(row) = rows.get_mut(fill.symbol.as_str()) {
            *row = (row.0, row.1 + 1, row.2 + fill.quantity);
        }
    }
    for (symbol, (orders, fills, traded)) in rows.iter().take(SHOWN) {
        table.add_row([(*symbol).to_owned(), orders.to_string(), fills.to_string(), traded.to_string()]);
    }
    if symbols.len() > SHOWN {
        table.add_row([format!("and {} more", symbols.len() - SHOWN)]);
    }
    table
}

/// Fees as they were charged, currency by currency.
fn fee_table(log: &PaperLog, screen: &Screen) -> comfy_table::Table {
    let mut sums: BTreeMap<&str, (usize, usize, Option<Cash>)> = BTreeMap::new();
    for fill in &log.fills {
        let Some(charge) = &fill.charged else { continue };
        let currency = charge.currency.as_deref().unwrap_or("not said");
        let sum = sums.entry(currency).or_insert((0, 0, Some(Cash::ZERO)));
        sum.0 += 1;
        sum.1 += usize::from(fill.fee.is_none());
        sum.2 = sum.2.and_then(|total| total.plus(charge.amount).ok());
    }
    let mut table = screen.table(["currency", ">fills", ">paid", ">kept apart"]);
    for (currency, (fills, apart, sum)) in sums {
        let sum = sum.map_or_else(|| "beyond 1.7e20".to_owned(), |sum| sum.to_string());
        table.add_row([currency.to_owned(), fills.to_string(), sum, apart.to_string()]);
    }
    table
}

fn clock_table(clocks: &[PaperClock], screen: &Screen) -> comfy_table::Table {
    let mut table = screen.table(["time", "read from", "what it is", ">steps of", ">values"]);
    for clock in clocks {
        table.add_row([
            clock.column.word().to_owned(),
            clock.source.clone(),
            clock.meaning.words().to_owned(),
            clock.resolution.map(step).unwrap_or_default(),
            clock.values.to_string(),
        ]);
    }
    table
}

/// A step of a clock [ns] in the unit it is one of.
fn step(nanoseconds: i64) -> String {
    let unit = match nanoseconds {
        60_000_000_000 => "1 min",
        1_000_000_000 => "1 s",
        1_000_000 => "1 ms",
        1_000 => "1 us",
        _ => "1 ns",
    };
    unit.to_owned()
}

/// Each kind of finding with its count and the first of them.
fn findings(log: &PaperLog, screen: &Screen) -> String {
    if log.findings.is_empty() {
        return "\nNothing was odd.\n".to_owned();
    }
    let mut text = "\nFindings\n\n".to_owned();
    for summary in log.findings.summaries() {
        text += &format!("{}\n", screen.wrapped(&format!("{:>6}  ", summary.count), summary.says));
        for finding in summary.findings.iter().take(2) {
            text += &format!("{}\n", screen.wrapped("        - ", &finding.to_string()));
        }
        if let Some(hint) = summary.hint {
            text += &format!("{}\n", screen.wrapped("        hint: ", hint));
        }
    }
    text
}
