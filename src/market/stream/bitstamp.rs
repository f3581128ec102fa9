//! Order events of Bitstamp, as recorded for ob-analytics.
//!
//! Source: the documentation of `loadData` and of the data set `lob.data` of the R package ob-analytics (P. Stubbings): the
//! `timestamp` is local, in milliseconds; the `exchange.timestamp` is when the *order* was created, to the second: of changes
//! and deletions the exchange gives no time, and they count as happening when they became known. Volumes are in 1e-8.

use crate::io::{FeedFormat, InputError, Table, TimeFormat, TimeUnit};
use crate::market::{OrderAction, OrderEvent};

use super::clocks::Clocks;
use super::decode::{Decode, Emit, Fault, price};
use super::depth_rows::book_side;
use super::order_rows::{Resting, id, rest_size};
use super::{Dated, Departure, OrderStep};

/// What a unit of volume is worth [units].
const VOLUME: f64 = 1e-8;
const LOCAL: &str = "timestamp";

/// Reads order events.
pub(in crate::market) struct BitstampOrders {
    clocks: Clocks,
    scale: f64,
    resting: Resting,
}

impl BitstampOrders {
    pub(in crate::market) fn new(format: &FeedFormat) -> Self {
        let (event, local) = (("exchange.timestamp", TimeUnit::Milliseconds), (LOCAL, TimeUnit::Milliseconds));
        let clocks = Clocks::of_layout(event, local, format);
        Self { clocks, scale: format.price_scale, resting: Resting::default() }
    }
}

fn action(words: &[Option<String>], row: usize) -> Result<OrderAction, Fault> {
    match words.get(row).and_then(Option::as_deref) {
        Some("created") => Ok(OrderAction::Add),
        Some("changed") => Ok(OrderAction::Change),
        Some("deleted") => Ok(OrderAction::Delete),
        word => Err(Fault::word("action", word, "`created`, `changed` or `deleted`")),
    }
}

/// How an order left, by the volume of the row that deletes it: of a filled one nothing is left, a withdrawn one keeps what it had.
fn departure(action: OrderAction, volumes: &[Option<f64>], row: usize) -> Option<Departure> {
    let left = volumes.get(row).copied().flatten().filter(|_| action == OrderAction::Delete)?;
    Some(if left > 0.0 { Departure::Withdrawn } else { Departure::Filled })
}

impl<T: From<OrderStep> + Dated + Clone + PartialEq> Decode<T> for BitstampOrders {
    fn columns(&self) -> Vec<&str> {
        self.clocks.columns().chain(["id", "price", "volume", "action", "direction"]).collect()
    }

    fn clocks(&self) -> Option<[(&str, TimeFormat); 2]> {
        self.clocks.both()
    }

    fn order_column(&self) -> &str {
        LOCAL
    }

    fn decode(&mut self, table: &Table, emit: &mut Emit<'_, T>) -> Result<(), InputError> {
        let times = self.clocks.times(table)?;
        let (ids, actions, sides) = (table.integers("id")?, table.texts("action")?, table.texts("direction")?);
        let (prices, volumes) = (table.floats("price")?, table.floats("volume")?);
        for row in 0..table.rows() {
            let Some(action) = emit.sound(row, action(&actions, row))? else { continue };
            let both = match action {
                OrderAction::Add => self.clocks.at(&times, row, emit)?,
                _ => emit.sound(row, self.clocks.known_at(&times, row))?.map(|known_at| (known_at, known_at)),
            };
            let Some((time, known_at)) = both else { continue };
            let event = id("id", &ids, row).and_then(|id| {
                let size = match action {
                    OrderAction::Delete => 0.0,
                    _ => rest_size("volume", &volumes, row, VOLUME)?,
                };
                let (side, price) = (book_side("direction", &sides, row)?, price("price", &prices, row, self.scale)?);
                Ok(OrderEvent { time, known_at, id, action, side, price, size })
            });
            if let Some(event) = emit.sound(row, event)? {
                let step = OrderStep { event, departure: departure(action, &volumes, row) };
                self.resting.take(row, "id", step, emit)?;
            }
        }
        Ok(())
    }
}
