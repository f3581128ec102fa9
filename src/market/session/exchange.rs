//! What happens at the exchange: rows of data meet the orders that wait there.

use crate::market::agenda::{Due, Phase};
use crate::market::sources::RowKind;
use crate::market::{Arrival, BacktestError, Event, EventKind};

use super::Session;

impl Session {
    /// Something happens at the exchange: orders that wait there meet it.
    #[inline(always)]
    pub(super) fn happen(&mut self, arrival: &Arrival) -> Result<(), BacktestError> {
        let Event { time, instrument, kind } = arrival.event;
        if !self.timetable.is_empty() {
            self.keep_hours_of(arrival);
        }
        let line = self.feed.line(instrument);
        let floor = &mut self.venue.floors[instrument];
        match kind {
            EventKind::Bar => {
                if floor.by_bars() && !floor.is_idle() {
                    self.meet_bar(instrument, arrival.row);
                    self.expect_open(instrument);
                }
            }
            EventKind::Quote => {
                floor.at_row(1, arrival.row);
                if let Some(quote) = line.quote(arrival.row) {
                    floor.on_quote(&quote, time);
                }
            }
            EventKind::Trade => {
                floor.at_row(2, arrival.row);
                if let Some(print) = line.print(arrival.row) {
                    floor.on_print(print, time);
                }
            }
            EventKind::Depth => {
                floor.at_row(3, arrival.row);
                let rows = arrival.row..arrival.end;
                if line.tells(RowKind::Orders) {
                    line.order_events(rows).iter().for_each(|event| floor.on_order(event));
                } else {
                    line.depth(rows).iter().for_each(|change| floor.on_depth(change));
                }
                floor.look(time);
            }
            EventKind::Timer => {}
        }
        if !self.timetable.is_empty() {
            self.venue.floors[instrument].begin(time, kind == EventKind::Trade);
        }
        if self.venue.floors[instrument].is_quiet() { Ok(()) } else { self.settle(instrument) }
    }

    /// Puts the open of the next bar on the agenda, where an order waits for it.
    pub(in crate::market) fn expect_open(&mut self, instrument: usize) {
        let floor = &self.venue.floors[instrument];
        if !floor.by_bars() || floor.is_idle() {
            return;
        }
        let Some(row) = self.next_bar(instrument).filter(|row| self.expected[instrument] != Some(*row)) else { return };
        let Some(bar) = self.feed.line(instrument).bar(row).copied() else { return };
        let Some(opens_at) = self.opens_at(instrument, &bar) else { return };
        if self.venue.floors[instrument].awaits_open(opens_at) {
            self.expected[instrument] = Some(row);
            self.agenda.put(opens_at, Phase::Opens, Due::Open(instrument));
        }
    }

    /// The row of the next bar of an instrument, which is not over yet.
    pub(in crate::market) fn next_bar(&self, instrument: usize) -> Option<usize> {
        self.feed.next_bar(instrument)
    }

    /// The next bar of an instrument opens.
    pub(in crate::market) fn open_bar(&mut self, instrument: usize) {
        let Some(row) = self.expected[instrument] else { return };
        let Some((bar, first)) = self.opening_bar(instrument, row) else { return };
        let floor = &mut self.venue.floors[instrument];
        floor.at_row(0, row);
        floor.on_open(&bar, first);
    }
}
