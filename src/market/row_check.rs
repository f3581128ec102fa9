//! What each row of market data must be, whether it is in memory or read from a file, whole or in pieces.

use crate::sim2real::Timestamp;

use super::{Bar, DepthAction, DepthChange, HistoryError, Level, OrderAction, OrderEvent, Price, Print};

/// Holds a bar to be one: it ends after it begins, its prices are above 0 with low <= open, close <= high, and its volume
/// is 0 or more.
#[inline(always)]
pub(super) fn check_bar(row: usize, bar: &Bar) -> Result<(), HistoryError> {
    if is_bar(bar) { Ok(()) } else { bar_fault(row, bar) }
}

/// Whether [`check_bar`] has nothing against a bar.
#[inline(always)]
pub(super) fn is_bar(bar: &Bar) -> bool {
    let within = |price: Price| bar.low <= price && price <= bar.high;
    let priced = bar.low.0 > 0 && within(bar.open) && within(bar.close);
    priced && bar.open_at < bar.known_at && (0.0..f64::INFINITY).contains(&bar.volume)
}

/// What [`check_bar`] has against a bar.
#[cold]
fn bar_fault(row: usize, bar: &Bar) -> Result<(), HistoryError> {
    if bar.known_at <= bar.open_at {
        return Err(HistoryError::Span { row, open_at: bar.open_at, known_at: bar.known_at });
    }
    let fault = |column, price: Price| Err(HistoryError::Bar { row, column, value: price.to_f64() });
    if bar.low.0 <= 0 {
        return fault("low", bar.low);
    }
    if bar.high < bar.low {
        return fault("high", bar.high);
    }
    if bar.open < bar.low || bar.open > bar.high {
        return fault("open", bar.open);
    }
    if bar.close < bar.low || bar.close > bar.high {
        return fault("close", bar.close);
    }
    if !bar.volume.is_finite() || bar.volume < 0.0 {
        return Err(HistoryError::Bar { row, column: "volume", value: bar.volume });
    }
    Ok(())
}

/// Holds the levels of a quote to be above 0, worse with each level, and not crossed.
pub(super) fn check_quote(row: usize, bids: &[Level], asks: &[Level]) -> Result<(), HistoryError> {
    for (side, levels, outward) in [("bid", bids, -1.0), ("ask", asks, 1.0)] {
        let mut best = f64::NEG_INFINITY;
        for (k, level) in levels.iter().enumerate() {
            let fault = |suffix: &str, value: f64, hint: &'static str| {
                let number = if k == 0 { String::new() } else { (k + 1).to_string() };
                Err(HistoryError::Quote { row, column: format!("{side}{number}{suffix}"), value, hint })
            };
            if !can_be_price(level.price) {
                return fault("", level.price, "a price must be above 0 and at most 9.2e9; leave an empty side out");
            }
            if level.size.is_nan() || level.size <= 0.0 {
                return fault("_size", level.size, "a displayed size must be above 0; leave an empty side out");
            }
            if outward * level.price <= best {
                return fault("", level.price, "deeper levels must have worse prices");
            }
            best = outward * level.price;
        }
    }
    if let (Some(bid), Some(ask)) = (bids.first(), asks.first())
        && bid.price > ask.price
    {
        let hint = "the bid is above the ask: remove crossed quotes, or check that the columns are not swapped";
        return Err(HistoryError::Quote { row, column: "ask".into(), value: ask.price, hint });
    }
    Ok(())
}

/// Holds a trade to have a price and a size above 0.
pub(super) fn check_print(row: usize, print: &Print) -> Result<(), HistoryError> {
    let fault = |column, value| {
        let hint = "prices and sizes of trades are finite and above 0, prices at most 9.2e9";
        Err(HistoryError::Event { what: "trade", row, column, value, hint })
    };
    if !can_be_price(print.price) {
        return fault("price", print.price);
    }
    if !print.size.is_finite() || print.size <= 0.0 {
        return fault("size", print.size);
    }
    Ok(())
}

/// Holds a change of the book to have a price above 0 and a size of 0 or more, and to be known no earlier than it happened.
pub(super) fn check_depth(row: usize, change: &DepthChange) -> Result<(), HistoryError> {
    check_known("change of the book", row, change.time, change.known_at)?;
    let fault = |column, value| {
        let hint = "prices are above 0, sizes are finite and 0 or more; 0 takes the level away";
        Err(HistoryError::Event { what: "change of the book", row, column, value, hint })
    };
    match change.action {
        DepthAction::Clear => Ok(()),
        DepthAction::Set if change.price.0 <= 0 => fault("price", change.price.to_f64()),
        DepthAction::Set if !change.size.is_finite() || change.size < 0.0 => fault("size", change.size),
        DepthAction::Set => Ok(()),
    }
}

/// Holds an order event to have a price above 0 and, where the order stays, a size above 0, and to be known no earlier than
/// it happened.
pub(super) fn check_order(row: usize, event: &OrderEvent) -> Result<(), HistoryError> {
    check_known("order event", row, event.time, event.known_at)?;
    let fault = |column, value| {
        let hint = "prices are above 0; so is what is left of an order that stays, and of one that leaves it is 0 or more";
        Err(HistoryError::Event { what: "order event", row, column, value, hint })
    };
    if event.price.0 <= 0 {
        return fault("price", event.price.to_f64());
    }
    let stays = event.action != OrderAction::Delete;
    if !event.size.is_finite() || event.size < 0.0 || (stays && event.size == 0.0) {
        return fault("size", event.size);
    }
    Ok(())
}

fn check_known(what: &'static str, row: usize, time: Timestamp, known_at: Timestamp) -> Result<(), HistoryError> {
    if known_at < time { Err(HistoryError::Known { what, row, time, known_at }) } else { Ok(()) }
}

/// Whether a number can be a price: above 0, and not beyond what [`Price`] holds.
pub(super) fn can_be_price(value: f64) -> bool {
    value > 0.0 && Price::nearest(value).is_ok()
}
