//! A log while it is read: what readers add, row by row.

use std::collections::HashMap;

use super::super::{
    FillOrigin, FindingKind, PaperClock, PaperFill, PaperFinding, PaperLog, PaperOrder, SourcePlace, TimeColumn, TimeMeaning,
};
use super::row::Row;
use super::{ImportSettings, Stop};
use crate::io::{InputError, Records};
use crate::market::Quantity;

/// A log while it is read.
pub(super) struct Draft<'a> {
    pub settings: &'a ImportSettings,
    pub log: PaperLog,
}

/// What one row gives: all of it counts, or nothing where the row cannot be read.
#[derive(Default)]
pub(super) struct Entries {
    pub orders: Vec<PaperOrder>,
    pub fills: Vec<PaperFill>,
}

impl<'a> Draft<'a> {
    pub fn new(format: &str, settings: &'a ImportSettings) -> Self {
        Self { settings, log: PaperLog { format: format.to_owned(), ..PaperLog::default() } }
    }

    /// Reads every row of `records`. One that cannot be read becomes a finding.
    pub fn each(
        &mut self,
        records: &Records,
        mut read: impl FnMut(&mut Row<'_>, &mut Entries) -> Result<(), Stop>,
    ) -> Result<(), InputError> {
        let table = records.name();
        for unread in records.unread() {
            let place = SourcePlace { table: table.clone(), row: Some(unread.row), column: None };
            let finding = PaperFinding::at(FindingKind::UnreadRow, place, unread.message.as_str());
            self.log.findings.add(finding.found(&unread.found));
        }
        for record in records.iter() {
            let (mut row, mut entries) = (Row::new(record, &table, self.settings), Entries::default());
            match read(&mut row, &mut entries) {
                Ok(()) => {
                    self.log.orders.append(&mut entries.orders);
                    self.log.fills.append(&mut entries.fills);
                    row.found.into_iter().for_each(|finding| self.log.findings.add(finding));
                }
                Err(Stop::Row(finding)) => self.log.findings.add(*finding),
                Err(Stop::File(error)) => return Err(error),
            }
        }
        Ok(())
    }

    /// Says what a column of times is.
    pub fn clock(&mut self, column: TimeColumn, source: &str, meaning: TimeMeaning) {
        let known = |clock: &PaperClock| clock.column == column && clock.source == source;
        if !self.log.clocks.iter().any(known) {
            self.log.clocks.push(PaperClock { column, source: source.to_owned(), meaning, resolution: None, values: 0 });
        }
    }

    /// Says something about the log as a whole.
    pub fn note(&mut self, kind: FindingKind, message: impl Into<String>) {
        self.log.findings.add(PaperFinding::of_log(kind, message));
    }
}

impl Entries {
    /// Adds the fill that stands for all executions of `order`, where it says how much was filled, at which price and when. It
    /// counts only where the log has no executions of the order.
    pub fn total(&mut self, order: &PaperOrder, currency: Option<&str>) -> Option<&mut PaperFill> {
        let (quantity, price) = (order.filled.filter(|filled| filled.0 > 0)?, order.average_price?);
        let mut fill = PaperFill::new(&order.symbol, order.ended_at?, quantity, price, order.place.clone());
        fill.order_id = Some(order.id.clone());
        fill.side = Some(order.side);
        fill.currency = currency.map(str::to_owned);
        fill.origin = FillOrigin::OrderTotal;
        self.fills.push(fill);
        self.fills.last_mut()
    }
}

/// Joins the orders that executions state, one an execution, into one an order: the first time counts, and filled is what the
/// `fills` of it add up to, for some may have been taken back.
pub(super) fn join_orders(orders: Vec<PaperOrder>, fills: &[PaperFill]) -> Vec<PaperOrder> {
    let mut joined: Vec<PaperOrder> = Vec::new();
    let mut numbers = HashMap::new();
    for order in orders {
        let key = (order.symbol.clone(), order.id.clone());
        match numbers.get(&key).copied().and_then(|at: usize| joined.get_mut(at)) {
            Some(known) => {
                known.decided_at = [known.decided_at, order.decided_at].into_iter().flatten().min();
                known.ended_at = known.ended_at.max(order.ended_at);
            }
            None => {
                numbers.insert(key, joined.len());
                joined.push(PaperOrder { filled: Some(Quantity::ZERO), ..order });
            }
        }
    }
    for fill in fills {
        let key = fill.order_id.clone().map(|id| (fill.symbol.clone(), id));
        let order = key.and_then(|key| numbers.get(&key).copied()).and_then(|at| joined.get_mut(at));
        if let Some(order) = order {
            order.filled = order.filled.map(|filled| filled + fill.quantity);
        }
    }
    joined
}

/// The order of an execution, as far as that tells: its side. How much was ordered it does not.
pub(super) fn order_of_fill(fill: &PaperFill) -> Option<PaperOrder> {
    Some(PaperOrder::new(fill.order_id.as_deref()?, &fill.symbol, fill.side?, fill.place.clone()))
}
