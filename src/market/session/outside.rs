//! A session whose decisions are made outside of it: it stops at an event, is looked at, and is told later what is asked for
//! there.
//!
//! [`Session::step`] with a strategy that asks for nothing, and then [`Session::tell`] of the same event, is to the last bit what a
//! step is with a strategy that asks at once: nothing happens between what a strategy is shown and what it asks for.

use crate::market::equity_curve::reuse;
use crate::market::spare::Rows;
use crate::market::venue::Others;
use crate::market::{Blotter, DepthBook, Event, MoneyError, Price, Side, View};

use super::Session;

impl Session {
    /// What a strategy sees at `event`, which must be the last there was, with its equity.
    ///
    /// # Errors
    /// If the account's worth is beyond what can be held, or cannot be told.
    #[inline]
    pub(in crate::market) fn seen(&self, event: Event) -> Result<View<'_>, MoneyError> {
        Ok(View {
            event,
            known: &self.known,
            instruments: &self.setup.instruments,
            increments: &self.setup.increments,
            ledger: &self.ledger,
            equity: self.ledger.equity()?,
            hours: self.timetable.each(),
            halts: self.timetable.halts(),
        })
    }

    /// What became of orders, as far as it is known.
    #[must_use]
    pub fn blotter(&self) -> &Blotter {
        &self.blotter
    }

    /// Whether all data have been seen: nothing happens any more.
    #[inline]
    pub(in crate::market) fn is_over(&self) -> bool {
        self.next_time().is_none()
    }

    /// How often the broker had to close what the account could not carry.
    #[inline]
    pub(in crate::market) fn margin_calls(&self) -> usize {
        self.keeping.as_ref().map_or(0, |keeping| keeping.record.margin_calls.len())
    }

    /// Goes on in the memory of a session that is over.
    pub(in crate::market) fn reuse(&mut self, over: &mut Self) {
        let (equity, blotter) = (over.equity.take_points(), &mut over.blotter);
        let (orders, fills) = (std::mem::take(&mut blotter.orders), std::mem::take(&mut blotter.fills));
        self.go_on_in(Rows { equity, orders, fills, terms: std::mem::take(&mut blotter.terms) });
    }

    /// Goes on in the memory of rows that nobody reads any more.
    pub(in crate::market) fn go_on_in(&mut self, over: Rows) {
        self.equity.reuse(over.equity);
        reuse(&mut self.blotter.orders, over.orders);
        reuse(&mut self.blotter.fills, over.fills);
        reuse(&mut self.blotter.terms, over.terms);
    }

    /// Before the first event: the book of an instrument is there already, as the rows before the first made it.
    ///
    /// # Errors
    /// If what is held, which is nothing, cannot be valued.
    pub(in crate::market) fn begin_with_book(
        &mut self,
        instrument: usize,
        book: DepthBook,
        others: Others,
    ) -> Result<(), MoneyError> {
        let (bid, ask) = (book.best(Side::Buy), book.best(Side::Sell));
        self.venue.floors[instrument].begin_with_book(book.clone(), others.clone());
        let known = &mut self.known[instrument];
        (known.book, known.others) = (Some(book), others);
        if let (Some(bid), Some(ask)) = (bid, ask) {
            let mid = Price(bid.0 + (ask.0 - bid.0) / 2);
            known.mark = Some(mid);
            self.ledger.mark(instrument, mid)?;
        }
        Ok(())
    }
}
