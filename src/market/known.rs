//! What is known of one instrument: all that a strategy may see, and nothing that is still to come.

use super::line::Line;
use super::past::{Past, PastQuotes};
use super::sources::RowKind;
use super::venue::Others;
use super::{Arrival, Bar, DepthBook, OrderId, OrderKind, Price, Print, Quantity, Side};

/// An order of ours that works, as far as its owner knows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OpenOrder {
    /// Its id.
    pub id: OrderId,
    /// Which way.
    pub side: Side,
    /// When it trades, and at which prices.
    pub kind: OrderKind,
    /// How much of it is left.
    pub left: Quantity,
    /// It only closes what is held, so that it adds nothing to a position that is under way.
    pub(super) closes: bool,
}

/// What is known of one instrument.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Known {
    pub bars: Past<Bar>,
    pub quotes: PastQuotes,
    pub prints: Past<Print>,
    pub book: Option<DepthBook>,
    pub others: Others,
    /// The close of the last bar, the last mid, or the last trade where there is neither.
    pub mark: Option<Price>,
    /// What is on its way and would change the position: positive for buys.
    pub working: Quantity,
    pub orders: Vec<OpenOrder>,
    /// Of how many rows the strategy is shown the newest.
    pub keep: usize,
}

impl Known {
    /// Takes in what changed in the book, and gives its mid in whole 1e-9.
    pub fn learn_depth(&mut self, line: &Line, arrival: &Arrival) -> Option<Price> {
        let book = self.book.as_mut()?;
        let rows = arrival.row..arrival.end;
        if line.tells(RowKind::Orders) {
            line.order_events(rows).iter().for_each(|event| self.others.show(event, book));
        } else {
            line.depth(rows).iter().for_each(|change| book.apply(change));
        }
        book.settle();
        let (bid, ask) = (book.best(Side::Buy)?, book.best(Side::Sell)?);
        Some(Price(bid.0 + (ask.0 - bid.0) / 2))
    }

    /// An order was sent.
    pub fn opened(&mut self, order: OpenOrder) {
        if !order.closes {
            self.working = self.working + order.left.signed(order.side);
        }
        self.orders.push(order);
    }

    /// So much of an order is no longer under way: it was filled, or is over.
    pub fn less(&mut self, id: OrderId, by: Quantity) {
        let Some(k) = self.orders.iter().position(|order| order.id == id) else { return };
        let order = &mut self.orders[k];
        let by = by.min(order.left);
        order.left = order.left - by;
        if !order.closes {
            self.working = self.working - by.signed(order.side);
        }
        if order.left <= Quantity::ZERO {
            self.orders.remove(k);
        }
    }

    /// Nothing of an order is under way any more.
    pub fn closed(&mut self, id: OrderId) {
        self.less(id, Quantity(i64::MAX));
    }

    /// An order was changed: what is left of it now, and how.
    pub fn changed(&mut self, id: OrderId, left: Quantity, kind: OrderKind) {
        let Some(order) = self.orders.iter_mut().find(|order| order.id == id) else { return };
        if !order.closes {
            self.working = self.working + (left - order.left).signed(order.side);
        }
        (order.left, order.kind) = (left, kind);
    }
}
