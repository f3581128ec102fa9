//! Events of resting orders: `ts, order_id, action, side, price, size`.

use std::collections::BTreeMap;

use crate::io::{FeedFormat, InputError, Table, TimeFormat};
use crate::market::{Finding, OrderAction, OrderEvent, Price, Side};
use crate::sim2real::Timestamp;

use super::clocks::Clocks;
use super::decode::{Decode, Emit, Fault, price, size};
use super::depth_rows::book_side;
use super::{Dated, OrderStep};

/// What rests in the book, by order: so much as is needed to tell a change of what is there from one of what is not.
#[derive(Debug, Default)]
pub(super) struct Resting(BTreeMap<u64, Rest>);

/// One resting order.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rest {
    pub(super) side: Side,
    pub(super) price: Price,
    pub(super) size: f64,
}

impl Resting {
    /// The order of that id.
    pub(super) fn get(&self, id: u64) -> Option<Rest> {
        self.0.get(&id).copied()
    }

    /// Takes everything out, in order of ids.
    pub(super) fn clear(&mut self) -> impl Iterator<Item = (u64, Rest)> + use<> {
        std::mem::take(&mut self.0).into_iter()
    }

    /// Holds an event to what rests. One of an order that does not is left out and counted: it was placed before the file
    /// begins, or is gone. An order that rests already cannot be added.
    pub(super) fn take<T: From<OrderStep> + Dated + Clone + PartialEq>(
        &mut self,
        row: usize,
        id_column: &'static str,
        step: impl Into<OrderStep>,
        emit: &mut Emit<'_, T>,
    ) -> Result<(), InputError> {
        let step = step.into();
        let event = step.event;
        let known = self.0.contains_key(&event.id);
        match event.action {
            OrderAction::Add if known => {
                let hint = "an id names one order: was a part of the file appended twice?";
                let message = "expected an order that is not in the book yet";
                let fault = Fault::cell(Finding::Duplicate, id_column, message, event.id, hint);
                return emit.sound(row, Err::<(), Fault>(fault)).map(drop);
            }
            OrderAction::Change | OrderAction::Delete if !known => {
                emit.found(Finding::UnknownOrder);
                return Ok(());
            }
            OrderAction::Delete => drop(self.0.remove(&event.id)),
            _ => drop(self.0.insert(event.id, Rest { side: event.side, price: event.price, size: event.size })),
        }
        emit.push(row, step.into())
    }
}

/// The id in a row.
pub(super) fn id(column: &str, values: &[Option<i64>], row: usize) -> Result<u64, Fault> {
    let value = values.get(row).copied().flatten().ok_or_else(|| Fault::missing(column, "an id"))?;
    u64::try_from(value).map_err(|_| {
        Fault::cell(Finding::Word, column, "expected an id that is not negative", value, "is another column meant?")
    })
}

/// The size of an order that stays: above 0.
pub(super) fn rest_size(column: &str, values: &[Option<f64>], row: usize, scale: f64) -> Result<f64, Fault> {
    match size(column, values, row, scale)? {
        0.0 => {
            let hint = "an order of which nothing is left is deleted";
            Err(Fault::cell(Finding::Size, column, "expected a size above 0", 0, hint))
        }
        size => Ok(size),
    }
}

/// Reads order events in the contract's layout.
pub(in crate::market) struct OrderRows {
    clocks: Clocks,
    scale: f64,
    resting: Resting,
}

/// The columns of a table.
struct Columns {
    ids: Vec<Option<i64>>,
    actions: Vec<Option<String>>,
    sides: Vec<Option<String>>,
    prices: Vec<Option<f64>>,
    sizes: Vec<Option<f64>>,
}

impl OrderRows {
    pub(in crate::market) fn new(format: &FeedFormat) -> Self {
        Self { clocks: Clocks::declared("ts", format), scale: format.price_scale, resting: Resting::default() }
    }

    fn event(&self, of: &Columns, row: usize, time: Timestamp, known_at: Timestamp) -> Result<OrderEvent, Fault> {
        let action = match of.actions.get(row).and_then(Option::as_deref) {
            Some("add") => OrderAction::Add,
            Some("change") => OrderAction::Change,
            Some("delete") => OrderAction::Delete,
            word => return Err(Fault::word("action", word, "`add`, `change` or `delete`")),
        };
        let size = match action {
            OrderAction::Delete => 0.0,
            _ => rest_size("size", &of.sizes, row, 1.0)?,
        };
        Ok(OrderEvent {
            time,
            known_at,
            id: id("order_id", &of.ids, row)?,
            action,
            side: book_side("side", &of.sides, row)?,
            price: price("price", &of.prices, row, self.scale)?,
            size,
        })
    }
}

impl<T: From<OrderStep> + Dated + Clone + PartialEq> Decode<T> for OrderRows {
    fn columns(&self) -> Vec<&str> {
        self.clocks.columns().chain(["order_id", "action", "side", "price", "size"]).collect()
    }

    fn clocks(&self) -> Option<[(&str, TimeFormat); 2]> {
        self.clocks.both()
    }

    fn order_column(&self) -> &str {
        self.clocks.order_column()
    }

    fn decode(&mut self, table: &Table, emit: &mut Emit<'_, T>) -> Result<(), InputError> {
        let times = self.clocks.times(table)?;
        let columns = Columns {
            ids: table.integers("order_id")?,
            actions: table.texts("action")?,
            sides: table.texts("side")?,
            prices: table.floats("price")?,
            sizes: table.floats("size")?,
        };
        for row in 0..table.rows() {
            let Some((time, known_at)) = self.clocks.at(&times, row, emit)? else { continue };
            if let Some(event) = emit.sound(row, self.event(&columns, row, time, known_at))? {
                self.resting.take(row, "order_id", event, emit)?;
            }
        }
        Ok(())
    }
}
