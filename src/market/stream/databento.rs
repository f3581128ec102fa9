//! Databento's market by order (MBO).
//!
//! Source: Databento's documentation of the schema `mbo`, and its example of building a book from it. `ts_event` is the
//! exchange's clock, `ts_recv` that of the capture server; prices are integers of 1e-9. A cancel takes `size` away, all of
//! it or a part; a modify gives the whole new size, and adds an order that is not there; a trade and a fill tell what
//! happened and leave the book to the cancels and modifies that follow; a clear empties it.

use crate::io::{FeedFormat, InputError, Table, TimeFormat, TimeUnit};
use crate::market::{Finding, OrderAction, OrderEvent, Price, Print, Side};
use crate::sim2real::Timestamp;

use super::Known;
use super::clocks::Clocks;
use super::decode::{Decode, Emit, Fault, size};
use super::order_rows::{Resting, id, rest_size};
use super::print_rows::above_zero;

fn clocks(format: &FeedFormat) -> Clocks {
    Clocks::of_layout(("ts_event", TimeUnit::Nanoseconds), ("ts_recv", TimeUnit::Nanoseconds), format)
}

/// The columns of a table.
struct Columns {
    actions: Vec<Option<String>>,
    sides: Vec<Option<String>>,
    prices: Vec<Option<i64>>,
    sizes: Vec<Option<f64>>,
    ids: Vec<Option<i64>>,
}

impl Columns {
    const NAMES: [&'static str; 5] = ["action", "side", "price", "size", "order_id"];

    fn of(table: &Table) -> Result<Self, InputError> {
        Ok(Self {
            actions: table.texts("action")?,
            sides: table.texts("side")?,
            prices: table.integers("price")?,
            sizes: table.floats("size")?,
            ids: table.integers("order_id")?,
        })
    }

    fn action(&self, row: usize) -> Result<char, Fault> {
        let word = self.actions.get(row).and_then(Option::as_deref);
        let action = word.and_then(|word| word.chars().next()).filter(|_| word.is_some_and(|word| word.len() == 1));
        let known = action.filter(|action| matches!(action, 'A' | 'C' | 'M' | 'R' | 'T' | 'F' | 'N'));
        known.ok_or_else(|| Fault::word("action", word, "one of A, C, M, R, T, F and N"))
    }

    /// The side of a row; none where it is `N`.
    fn side(&self, row: usize) -> Result<Option<Side>, Fault> {
        match self.sides.get(row).and_then(Option::as_deref) {
            Some("B") => Ok(Some(Side::Buy)),
            Some("A") => Ok(Some(Side::Sell)),
            Some("N") => Ok(None),
            word => Err(Fault::word("side", word, "one of A, B and N")),
        }
    }

    fn price(&self, row: usize) -> Result<Price, Fault> {
        // Where there is no price the largest integer stands.
        let value = self.prices.get(row).copied().flatten().filter(|value| *value != i64::MAX);
        let value = value.ok_or_else(|| Fault::missing("price", "a price"))?;
        if value > 0 {
            return Ok(Price(value));
        }
        let hint = "prices are integers of 1e-9; drop the row or correct it";
        Err(Fault::cell(Finding::Price, "price", "expected a price greater than 0", value, hint))
    }
}

/// Reads order events.
pub(in crate::market) struct DatabentoOrders {
    clocks: Clocks,
    resting: Resting,
}

impl DatabentoOrders {
    pub(in crate::market) fn new(format: &FeedFormat) -> Self {
        Self { clocks: clocks(format), resting: Resting::default() }
    }

    /// What a row of action A, C or M does to an order; none of an order that is not there.
    fn event(
        &self,
        of: &Columns,
        row: usize,
        action: char,
        (time, known_at): (Timestamp, Timestamp),
    ) -> Result<Option<OrderEvent>, Fault> {
        let id = id("order_id", &of.ids, row)?;
        let rests = self.resting.get(id);
        if action == 'C' {
            let taken = size("size", &of.sizes, row, 1.0)?;
            let Some(rest) = rests else { return Ok(None) };
            let left = rest.size - taken;
            let (action, size) = if left > 0.0 { (OrderAction::Change, left) } else { (OrderAction::Delete, 0.0) };
            return Ok(Some(OrderEvent { time, known_at, id, action, side: rest.side, price: rest.price, size }));
        }
        let action = if action == 'M' && rests.is_some() { OrderAction::Change } else { OrderAction::Add };
        let Some(side) = of.side(row)? else { return Err(Fault::word("side", Some("N"), "the side of an order, A or B")) };
        let (price, size) = (of.price(row)?, rest_size("size", &of.sizes, row, 1.0)?);
        Ok(Some(OrderEvent { time, known_at, id, action, side, price, size }))
    }
}

impl Decode<OrderEvent> for DatabentoOrders {
    fn columns(&self) -> Vec<&str> {
        self.clocks.columns().chain(Columns::NAMES).collect()
    }

    fn clocks(&self) -> Option<[(&str, TimeFormat); 2]> {
        self.clocks.both()
    }

    fn order_column(&self) -> &str {
        self.clocks.order_column()
    }

    fn decode(&mut self, table: &Table, emit: &mut Emit<'_, OrderEvent>) -> Result<(), InputError> {
        let (times, columns) = (self.clocks.times(table)?, Columns::of(table)?);
        for row in 0..table.rows() {
            let Some(action) = emit.sound(row, columns.action(row))? else { continue };
            if matches!(action, 'T' | 'F' | 'N') {
                emit.found(Finding::OtherKind);
                continue;
            }
            let Some((time, known_at)) = self.clocks.at(&times, row, emit)? else { continue };
            if action == 'R' {
                for (id, rest) in self.resting.clear() {
                    let (side, price) = (rest.side, rest.price);
                    let action = OrderAction::Delete;
                    emit.push(row, OrderEvent { time, known_at, id, action, side, price, size: 0.0 })?;
                }
                continue;
            }
            match emit.sound(row, self.event(&columns, row, action, (time, known_at)))? {
                Some(Some(event)) => self.resting.take(row, "order_id", event, emit)?,
                Some(None) => emit.found(Finding::UnknownOrder),
                None => {}
            }
        }
        Ok(())
    }
}

/// Reads the trades among the messages; their side is that of the order that took.
pub(in crate::market) struct DatabentoPrints {
    clocks: Clocks,
}

impl DatabentoPrints {
    pub(in crate::market) fn new(format: &FeedFormat) -> Self {
        Self { clocks: clocks(format) }
    }
}

impl Decode<Known<Print>> for DatabentoPrints {
    fn columns(&self) -> Vec<&str> {
        self.clocks.columns().chain(Columns::NAMES).collect()
    }

    fn clocks(&self) -> Option<[(&str, TimeFormat); 2]> {
        self.clocks.both()
    }

    fn order_column(&self) -> &str {
        self.clocks.order_column()
    }

    fn decode(&mut self, table: &Table, emit: &mut Emit<'_, Known<Print>>) -> Result<(), InputError> {
        let (times, columns) = (self.clocks.times(table)?, Columns::of(table)?);
        for row in 0..table.rows() {
            match emit.sound(row, columns.action(row))? {
                Some('T') => {}
                Some(_) => {
                    emit.found(Finding::OtherKind);
                    continue;
                }
                None => continue,
            }
            let Some((time, known_at)) = self.clocks.at(&times, row, emit)? else { continue };
            let print = columns.side(row).and_then(|aggressor| {
                let size = above_zero(Finding::Size, "size", &columns.sizes, row)?;
                Ok(Print { time, price: columns.price(row)?.to_f64(), size, aggressor })
            });
            if let Some(what) = emit.sound(row, print)? {
                emit.push(row, Known { known_at, what })?;
            }
        }
        Ok(())
    }
}
