//! Days of orders: what a user would bring, which is a twin and a log and nothing that tells what is concealed, and a baseline.

mod regression;

use std::sync::Arc;

use super::trial::Given;
use crate::conceal::trading::{Assumed, Day, TradingCase};
use crate::conceal::{Column, Table};
use crate::market::{
    Execution, Instrument, Level, LogError, LogMarket, LoggedFill, LoggedOrder, MECHANISMS, OrderLog, OrderType,
    PriceAssumption, Print, Quotes, Side, Tape,
};
use crate::sim2real::{Assembly, Recording, Timestamp};

pub(super) use regression::regression;

/// Most levels a side that the tables hold.
const LEVELS: usize = 5;

/// What a diagnosis is given of a case.
///
/// # Errors
/// None but a bug: what is generated can be read.
pub(super) fn given(case: &TradingCase) -> Result<Given<Execution>, LogError> {
    Ok(Given {
        twin: Assembly::new(Execution, MECHANISMS),
        train: [recording("train", case, &case.train)?],
        test: [recording("test", case, &case.test)?],
        channel: "cost",
    })
}

fn recording(name: &str, case: &TradingCase, day: &Day) -> Result<Recording<OrderLog>, LogError> {
    let instrument = Instrument {
        symbol: case.symbol.clone(),
        tick_size: case.tick,
        lot_size: case.lot.unwrap_or(1.0),
        average_daily_volume: Some(case.average_daily_volume),
        daily_volatility: Some(case.daily_volatility),
    };
    let price = match case.price {
        Assumed::Touch => PriceAssumption::Touch,
        Assumed::Mid => PriceAssumption::Mid,
    };
    let prints = day.trades.as_ref().map(prints).unwrap_or_default();
    let tape = Arc::new(Tape::new(quotes(&day.quotes), prints, Vec::new()));
    OrderLog::recording(
        name,
        LogMarket { instrument, tape, price, shows_own_orders: None },
        &orders(&day.orders),
        &fills(&day.fills),
    )
}

fn orders(table: &Table) -> Vec<LoggedOrder> {
    let (ids, times) = (whole(table, "order_id"), times(table, "decided_at"));
    let (sides, kinds) = (texts(table, "side"), texts(table, "type"));
    let quantities = whole(table, "qty");
    let seen = table.real("seen_bid").zip(table.real("seen_ask"));
    let one = |row: usize| LoggedOrder {
        id: ids[row].to_string(),
        side: side(&sides[row]),
        quantity: quantities[row] as f64,
        decided_at: times[row],
        kind: if kinds[row] == "market" { OrderType::Market } else { OrderType::Other(kinds[row].clone()) },
        seen_mid: seen.map(|(bids, asks)| 0.5 * (bids[row] + asks[row])),
    };
    (0..table.rows()).map(one).collect()
}

fn fills(table: &Table) -> Vec<LoggedFill> {
    let (ids, times, quantities) = (whole(table, "order_id"), times(table, "filled_at"), whole(table, "qty"));
    let (prices, fees) = (reals(table, "price"), reals(table, "fee"));
    let one = |row: usize| LoggedFill {
        order_id: ids[row].to_string(),
        filled_at: times[row],
        quantity: quantities[row] as f64,
        price: prices[row],
        fee: fees[row],
    };
    (0..table.rows()).map(one).collect()
}

fn quotes(table: &Table) -> Quotes {
    let numbered = |name: &str, level: usize| match level {
        0 => name.to_owned(),
        _ => format!("{name}{}", level + 1),
    };
    let levels = (0..LEVELS).take_while(|level| table.real(&numbered("bid", *level)).is_some()).count();
    let side = |name: &str| -> Vec<(&[f64], &[i64])> {
        let level = |level: usize| {
            let name = numbered(name, level);
            (reals(table, &name), whole(table, &format!("{name}_size")))
        };
        (0..levels).map(level).collect()
    };
    let (bids, asks) = (side("bid"), side("ask"));
    let at = |side: &[(&[f64], &[i64])], row: usize| -> Vec<Level> {
        // A table that knows no sizes offers any.
        let size = |sizes: &[i64]| sizes.get(row).map_or(f64::INFINITY, |size| *size as f64);
        side.iter().map(|(prices, sizes)| Level { price: prices[row], size: size(sizes) }).collect()
    };
    let mut quotes = Quotes::with_depth(levels);
    for (row, time) in times(table, "ts").iter().enumerate() {
        quotes.push(*time, &at(&bids, row), &at(&asks, row));
    }
    quotes
}

fn prints(table: &Table) -> Vec<Print> {
    let (times, prices, sizes) = (times(table, "ts"), reals(table, "price"), whole(table, "size"));
    let aggressors = texts(table, "aggressor");
    let one = |row: usize| Print {
        time: times[row],
        price: prices[row],
        size: sizes[row] as f64,
        aggressor: Some(side(&aggressors[row])),
    };
    (0..table.rows()).map(one).collect()
}

fn side(word: &str) -> Side {
    if word == "buy" { Side::Buy } else { Side::Sell }
}

fn times(table: &Table, name: &str) -> Vec<Timestamp> {
    match table.column(name) {
        Some(Column::Time(values)) => values.iter().copied().map(Timestamp).collect(),
        _ => Vec::new(),
    }
}

fn whole<'a>(table: &'a Table, name: &str) -> &'a [i64] {
    match table.column(name) {
        Some(Column::Whole(values)) => values,
        _ => &[],
    }
}

fn texts<'a>(table: &'a Table, name: &str) -> &'a [String] {
    match table.column(name) {
        Some(Column::Text(values)) => values,
        _ => &[],
    }
}

fn reals<'a>(table: &'a Table, name: &str) -> &'a [f64] {
    table.real(name).unwrap_or_default()
}
