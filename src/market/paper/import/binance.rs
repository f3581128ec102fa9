//! Binance, spot and futures: orders and trades as the REST interface gives them, and the stream of a user's data.
//!
//! Source: Binance's references *Spot API: Account endpoints, User Data Streams* and *USD-M Futures: User Data Streams*.

use std::collections::HashMap;

use super::super::{FindingKind, Liquidity, OrderWords, PaperFill, PaperOrder, PaperStatus, TimeColumn, TimeMeaning};
use super::draft::{Draft, Entries};
use super::pair::pair_by_fee;
use super::row::{Row, side_of};
use super::stamp::Written;
use super::{Format, Stop};
use crate::io::{InputError, Records};
use crate::market::{Cash, Price, Quantity, Side};

pub(super) static FORMAT: Format = Format {
    id: "binance",
    title: "Binance's orders, trades and stream of user data as JSON, spot and futures",
    known_by: "`orderId` with `origQty` or with `commissionAsset`, or events `executionReport` or `ORDER_TRADE_UPDATE`",
    claims: |table| {
        table.has_all(&["orderId", "symbol", "origQty"])
            || table.has_all(&["orderId", "symbol", "commissionAsset"])
            || is_stream(table)
    },
    read,
    tables: &[],
};

/// Where an event keeps the fields of its order: futures in an object of its own, and both perhaps in an envelope.
const PREFIXES: [&str; 4] = ["", "o.", "data.", "data.o."];

fn is_stream(table: &Records) -> bool {
    PREFIXES.iter().any(|prefix| ["x", "X", "i", "S", "q"].iter().all(|key| table.has(&format!("{prefix}{key}"))))
}

/// Times are milliseconds.
const MILLISECONDS: Written = Written::Count(1_000_000);

fn read(tables: &[&Records], draft: &mut Draft<'_>) -> Result<(), InputError> {
    draft.clock(TimeColumn::DecidedAt, "time of the order, T of its first event", TimeMeaning::Accepted);
    draft.clock(TimeColumn::EndedAt, "updateTime of the order, T of its last event", TimeMeaning::Updated);
    let trades = tables.iter().any(|table| table.has("commissionAsset") || is_stream(table));
    let (source, meaning) =
        if trades { ("time of the trade, T", TimeMeaning::Executed) } else { ("updateTime", TimeMeaning::Updated) };
    draft.clock(TimeColumn::FilledAt, source, meaning);
    let mut events: HashMap<(String, String), PaperOrder> = HashMap::new();
    for table in tables {
        draft.each(table, |row, entries| {
            if row.text("orderId").is_some() {
                return if row.text("origQty").is_some() { order(row, entries) } else { trade(row, entries) };
            }
            match PREFIXES.into_iter().find(|prefix| row.text(&format!("{prefix}x")).is_some()) {
                Some(prefix) => event(&Event { prefix }, row, &mut events, entries),
                None => {
                    row.note(FindingKind::PassedOver, "an event that is none of an order");
                    Ok(())
                }
            }
        })?;
    }
    let mut orders: Vec<PaperOrder> = events.into_values().collect();
    orders.sort_by(|a, b| (&a.place, &a.id).cmp(&(&b.place, &b.id)));
    draft.log.orders.extend(orders);
    Ok(())
}

/// What an amount of cash is a unit of a quantity, to the nearest 1e-9; none where it is not known.
fn average(cash: Option<Cash>, quantity: Option<Quantity>) -> Option<Price> {
    let (cash, quantity) = (cash.filter(|cash| cash.0 > 0)?, quantity.filter(|quantity| quantity.0 > 0)?);
    let doubled = cash.0.checked_mul(2)? / i128::from(quantity.0);
    i64::try_from((doubled + 1) / 2).ok().map(Price)
}

fn kind(word: Option<&str>) -> Option<OrderWords> {
    word.map(OrderWords::of_word)
}

fn order(row: &mut Row<'_>, entries: &mut Entries) -> Result<(), Stop> {
    let mut order = row.order(row.need("orderId")?, row.need("symbol")?, row.need_side("side")?);
    order.client_id = row.owned("clientOrderId");
    order.quantity = row.quantity("origQty")?.filter(|quantity| quantity.0 > 0);
    if order.quantity.is_none() {
        let amount = row.text("origQuoteOrderQty").unwrap_or("an unknown amount");
        row.note(FindingKind::Notional, format!("order {} was for {amount} of the quote currency", order.id));
    }
    order.kind = kind(row.text_of(&["origType", "type"]));
    order.limit_price = row.price_above_zero("price")?;
    order.stop_price = row.price_above_zero("stopPrice")?;
    order.time_in_force = row.text("timeInForce").map(str::to_lowercase);
    order.decided_at = row.time("time", MILLISECONDS)?;
    order.status = row.text("status").map(PaperStatus::of_word);
    let updated = row.time("updateTime", MILLISECONDS)?;
    order.filled = row.quantity("executedQty")?;
    // Of orders before it was kept the amount is negative.
    let paid = if row.text("cummulativeQuoteQty").is_some() { "cummulativeQuoteQty" } else { "cumQuote" };
    let stated = row.price_above_zero("avgPrice")?;
    order.average_price = stated.or(average(row.cash(paid)?, order.filled));
    order.ended_at = updated.filter(|_| order.status.as_ref().is_some_and(PaperStatus::is_final));
    entries.total(&PaperOrder { ended_at: updated, ..order.clone() }, None);
    entries.orders.push(order);
    Ok(())
}

fn trade(row: &mut Row<'_>, entries: &mut Entries) -> Result<(), Stop> {
    let quantity = row.need_quantity("qty")?;
    let at = row.need_time("time", MILLISECONDS)?;
    let mut fill = PaperFill::new(row.need("symbol")?, at, quantity, row.need_price("price")?, row.place());
    fill.id = row.owned("id");
    fill.order_id = row.owned("orderId");
    let buyer = row.text_of(&["isBuyer", "buyer"]).map(|text| if text == "true" { Side::Buy } else { Side::Sell });
    fill.side = row.text("side").and_then(side_of).or(buyer);
    fill.liquidity = role(row.text_of(&["isMaker", "maker"]));
    charge(row, "commission", row.text("commissionAsset"), &mut fill)?;
    entries.fills.push(fill);
    Ok(())
}

fn role(maker: Option<&str>) -> Option<Liquidity> {
    maker.map(|text| if text == "true" { Liquidity::Maker } else { Liquidity::Taker })
}

/// The pair has no sign between its currencies: the fee tells where it parts, if it is taken in either.
fn charge(row: &mut Row<'_>, key: &str, currency: Option<&str>, fill: &mut PaperFill) -> Result<(), Stop> {
    let symbol = fill.symbol.clone();
    let (base, quote) = pair_by_fee(&symbol, currency.unwrap_or_default());
    fill.currency = quote.map(str::to_owned);
    if let Some(amount) = row.cash(key)? {
        row.charge(fill, amount, currency, base);
    }
    Ok(())
}

/// The fields of an event, by their letters.
struct Event {
    prefix: &'static str,
}

impl Event {
    fn key(&self, letter: &str) -> String {
        format!("{}{letter}", self.prefix)
    }
}

/// An event moves its order on, and may be a fill of it.
fn event(
    event: &Event,
    row: &mut Row<'_>,
    orders: &mut HashMap<(String, String), PaperOrder>,
    entries: &mut Entries,
) -> Result<(), Stop> {
    let key = |letter: &str| event.key(letter);
    let (id, symbol) = (row.need(&key("i"))?, row.need(&key("s"))?);
    let at = row.need_time(&key("T"), MILLISECONDS)?;
    let mut order = row.order(id, symbol, row.need_side(&key("S"))?);
    order.client_id = row.owned(&key("c"));
    order.quantity = row.quantity(&key("q"))?;
    // Futures keep the kind that a triggered order had in `ot`.
    order.kind = kind(row.text_of(&[&key("ot"), &key("o")]));
    order.limit_price = row.price_above_zero(&key("p"))?;
    // Futures have the stop price in `sp`; on spot `P` is that, on futures something else.
    let stop = if event.prefix.ends_with("o.") { key("sp") } else { key("P") };
    order.stop_price = row.price_above_zero(&stop)?;
    order.time_in_force = row.text(&key("f")).map(str::to_lowercase);
    order.status = row.text(&key("X")).map(PaperStatus::of_word);
    order.filled = row.quantity(&key("z"))?;
    order.average_price = row.price_above_zero(&key("ap"))?.or(average(row.cash(&key("Z"))?, order.filled));
    order.decided_at = Some(at);
    order.ended_at = order.status.as_ref().is_some_and(PaperStatus::is_final).then_some(at);
    if row.text(&key("x")) == Some("TRADE") {
        let quantity = row.need_quantity(&key("l"))?;
        let mut fill = PaperFill::new(symbol, at, quantity, row.need_price(&key("L"))?, row.place());
        fill.id = row.owned(&key("t"));
        fill.order_id = Some(id.to_owned());
        fill.side = Some(order.side);
        fill.liquidity = role(row.text(&key("m")));
        charge(row, &key("n"), row.text(&key("N")), &mut fill)?;
        entries.fills.push(fill);
    }
    match orders.get_mut(&(order.symbol.clone(), order.id.clone())) {
        Some(known) => {
            order.decided_at = known.decided_at.min(order.decided_at);
            order.place.clone_from(&known.place);
            *known = order;
        }
        None => {
            orders.insert((order.symbol.clone(), order.id.clone()), order);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_average_is_what_was_paid_a_unit() {
        let of = |cash: &str, quantity: &str| average(cash.parse().ok(), quantity.parse().ok());
        assert_eq!(of("48.000012", "12"), Some("4.000001".parse().unwrap()));
        assert_eq!(of("1", "3"), Some(Price(333_333_333)));
        assert_eq!(of("2", "3"), Some(Price(666_666_667)));
        assert_eq!((of("-1", "3"), of("1", "0"), of("100000000000", "0.000000001")), (None, None, None));
    }
}
