//! The tape: what the market showed while orders were sent to it.

use crate::sim2real::Timestamp;

use super::quote::Quote;
use super::time_index::TimeIndex;
use super::{Bar, Book, InFlight, Quotes, Side};

/// A trade the market printed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Print {
    /// When.
    pub time: Timestamp,
    /// Price [currency].
    pub price: f64,
    /// Size [units].
    pub size: f64,
    /// The side that took, where known.
    pub aggressor: Option<Side>,
}

/// What had happened by the time an order met the market: all up to and with its decision, and all strictly before it
/// arrived.
///
/// What carries the stamp of the arrival itself may be the order's own doing, so it is not part of what the order found;
/// what carries the stamp of the decision was known to whoever decided.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Seen {
    decided_at: Timestamp,
    until: Timestamp,
}

impl Seen {
    /// All up to and with `time`.
    #[must_use]
    pub fn at(time: Timestamp) -> Self {
        Self { decided_at: time, until: time }
    }

    /// What `order` finds where it arrives, never as late as the first print of its own: what follows that print is
    /// its impact, and reading it would look like latency.
    #[must_use]
    pub fn by(order: &InFlight, own_print: Option<Timestamp>) -> Self {
        let until = own_print.map_or(order.arrives_at, |print| order.arrives_at.min(print));
        Self { decided_at: order.decided_at, until }
    }

    /// The end of what was seen.
    #[must_use]
    pub fn end(self) -> Timestamp {
        self.decided_at.max(self.until)
    }

    /// How many of `rows`, oldest first, were seen.
    fn count<T>(self, rows: &[T], time: impl Fn(&T) -> Timestamp) -> usize {
        let known = rows.partition_point(|row| time(row) <= self.decided_at);
        known + rows[known..].partition_point(|row| time(row) < self.until)
    }
}

/// Quotes, trades and bars of one instrument; any of them may be missing, but not all.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Tape {
    quotes: Quotes,
    /// Where in time the quotes are.
    index: TimeIndex,
    prints: Vec<Print>,
    bars: Vec<Bar>,
    notes: Vec<String>,
}

impl Tape {
    /// A tape of quotes (oldest first), trades and bars. Trades and bars are put in order of time; those of one stamp
    /// stay in the order given.
    #[must_use]
    pub fn new(quotes: Quotes, mut prints: Vec<Print>, mut bars: Vec<Bar>) -> Self {
        prints.sort_by_key(|print| print.time);
        bars.sort_by_key(|bar| bar.known_at);
        Self { index: TimeIndex::of(quotes.times()), quotes, prints, bars, notes: Vec::new() }
    }

    /// Adds what a reader of results should know about the tape.
    #[must_use]
    pub fn with_note(mut self, note: impl Into<String>) -> Self {
        self.notes.push(note.into());
        self
    }

    /// What a reader of results should know about the tape.
    #[must_use]
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// The quotes.
    #[must_use]
    pub fn quotes(&self) -> &Quotes {
        &self.quotes
    }

    /// The trades, oldest first.
    #[must_use]
    pub fn prints(&self) -> &[Print] {
        &self.prints
    }

    /// The bars, oldest first.
    #[must_use]
    pub fn bars(&self) -> &[Bar] {
        &self.bars
    }

    /// Whether nothing is on it.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.quotes.is_empty() && self.prints.is_empty() && self.bars.is_empty()
    }

    /// The displayed book last `seen`.
    #[must_use]
    pub fn book(&self, seen: Seen) -> Option<Book> {
        Some(self.quote(seen)?.book())
    }

    /// The quote last `seen`.
    pub(super) fn quote(&self, seen: Seen) -> Option<Quote<'_>> {
        self.quote_after(self.known(seen.decided_at), seen)
    }

    /// Number of quotes up to and with `time`.
    pub(super) fn known(&self, time: Timestamp) -> usize {
        self.index.count(self.quotes.times(), time, |row| *row <= time)
    }

    /// The quote last `seen`, for whoever has counted those that were `known` at the decision.
    pub(super) fn quote_after(&self, known: usize, seen: Seen) -> Option<Quote<'_>> {
        let met = if seen.until > seen.decided_at {
            self.index.count(self.quotes.times(), seen.until, |time| *time < seen.until)
        } else {
            known
        };
        self.quotes.all().get(known.max(met).checked_sub(1)?)
    }

    /// Price of the last trade `seen` [currency].
    #[must_use]
    pub fn last_price(&self, seen: Seen) -> Option<f64> {
        let last = seen.count(&self.prints, |print| print.time).checked_sub(1)?;
        Some(self.prints[last].price)
    }

    /// Close of the last bar known by the end of what was `seen` [currency].
    #[must_use]
    pub fn bar_close(&self, seen: Seen) -> Option<f64> {
        let last = seen.count(&self.bars, |bar| bar.known_at).checked_sub(1)?;
        Some(self.bars[last].close.to_f64())
    }

    /// Open of the first bar that begins no earlier than the end of what was `seen` [currency].
    #[must_use]
    pub fn next_open(&self, seen: Seen) -> Option<f64> {
        let next = self.bars.partition_point(|bar| bar.open_at < seen.end());
        self.bars.get(next).map(|bar| bar.open.to_f64())
    }

    /// Midway between bid and ask [currency]; where there are no quotes the last trade, else the last close, else the
    /// next open.
    #[must_use]
    pub fn mid(&self, seen: Seen) -> Option<f64> {
        if !self.quotes.is_empty() {
            return self.quote(seen)?.mid();
        }
        self.last_price(seen).or_else(|| self.bar_close(seen)).or_else(|| self.next_open(seen))
    }

    /// Volume an order of `side` can take part in [units], infinite where the tape does not know it.
    ///
    /// Where there are bars it is the volume of the bar in which the order arrives, as in the volume-share slippage of
    /// zipline (Quantopian); else what is displayed on the side it takes from, on all levels the quotes have; else what
    /// is traded in the minute that begins with its arrival.
    #[must_use]
    pub fn volume(&self, side: Side, seen: Seen) -> f64 {
        self.volume_beside(self.quote(seen), side, seen)
    }

    /// The same, for whoever has looked the quote up already.
    pub(super) fn volume_beside(&self, quote: Option<Quote<'_>>, side: Side, seen: Seen) -> f64 {
        const MINUTE: i64 = 60 * Timestamp::NANOS;
        let end = seen.end();
        if !self.bars.is_empty() {
            let within = self.bars.partition_point(|bar| bar.known_at <= end);
            return self.bars.get(within).filter(|bar| bar.open_at <= end).map_or(0.0, |bar| bar.volume);
        }
        if !self.quotes.is_empty() {
            return quote.map_or(0.0, |quote| quote.displayed(side));
        }
        if self.prints.is_empty() {
            return f64::INFINITY;
        }
        let from = self.prints.partition_point(|print| print.time < end);
        self.prints[from..].iter().take_while(|print| print.time < end + MINUTE).map(|print| print.size).sum()
    }

    /// First and last instant it tells of.
    #[must_use]
    pub fn span(&self) -> Option<(Timestamp, Timestamp)> {
        let ends = [
            self.quotes.times().first().copied().zip(self.quotes.times().last().copied()),
            self.prints.first().map(|p| p.time).zip(self.prints.last().map(|p| p.time)),
            self.bars.first().map(|b| b.open_at).zip(self.bars.last().map(|b| b.known_at)),
        ];
        ends.into_iter().flatten().reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
    }

    /// Longest time between two neighbours on the most frequent of its parts [ns].
    #[must_use]
    pub fn longest_silence(&self) -> i64 {
        let longest = |times: &mut dyn Iterator<Item = Timestamp>| {
            let mut previous = None;
            times.fold(0, |gap, time| gap.max(previous.replace(time).map_or(0, |before| time - before)))
        };
        if !self.quotes.is_empty() {
            return longest(&mut self.quotes.times().iter().copied());
        }
        if !self.prints.is_empty() {
            return longest(&mut self.prints.iter().map(|print| print.time));
        }
        longest(&mut self.bars.iter().map(|bar| bar.known_at))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::market::{Level, Price};

    fn level(price: f64, size: f64) -> Level {
        Level { price, size }
    }

    /// One quote at each time, with mids 100, 101, 102 …
    fn tape(times: &[i64]) -> Tape {
        let mut quotes = Quotes::with_depth(1);
        for (k, time) in times.iter().enumerate() {
            let mid = 100.0 + k as f64;
            quotes.push(Timestamp(*time), &[level(mid - 0.5, 10.0)], &[level(mid + 0.5, 20.0)]);
        }
        Tape::new(quotes, Vec::new(), Vec::new())
    }

    fn order(decided: i64, arrives: i64) -> InFlight {
        InFlight::market(Side::Buy, 1.0, Timestamp(decided), 100.0, 100.0).arriving(Timestamp(arrives))
    }

    #[test]
    fn an_order_finds_what_was_known_when_it_was_decided_and_what_came_strictly_before_it_arrived() {
        let tape = tape(&[0, 100, 100, 200, 300]);
        let mid = |decided, arrives, own: Option<i64>| tape.mid(Seen::by(&order(decided, arrives), own.map(Timestamp)));
        assert_eq!(mid(100, 100, None), Some(102.0), "of rows with the stamp of the decision the last is known");
        assert_eq!(mid(99, 99, None), Some(100.0));
        assert_eq!(mid(50, 100, None), Some(100.0), "rows with the stamp of the arrival are not met");
        assert_eq!(mid(50, 101, None), Some(102.0));
        assert_eq!(mid(100, 101, None), Some(102.0));
        assert_eq!(mid(100, 200, None), Some(102.0));
        assert_eq!(mid(100, 400, None), Some(104.0));
        assert_eq!(mid(100, 400, Some(300)), Some(103.0), "the own print caps what is met");
        assert_eq!(mid(100, 150, Some(300)), Some(102.0), "and never extends it");
        assert_eq!(mid(-1, -1, None), None);
    }

    #[test]
    fn bars_know_their_close_only_when_they_end() {
        let units = |price: i64| Price(price * 1_000_000_000);
        let bar = |k: i64| Bar {
            open_at: Timestamp(k * 60),
            known_at: Timestamp((k + 1) * 60),
            open: units(10 + k),
            high: units(20 + k),
            low: units(10 + k),
            close: units(20 + k),
            volume: 100.0 * (k + 1) as f64,
        };
        let tape = Tape::new(Quotes::default(), Vec::new(), vec![bar(0), bar(1), bar(2)]);
        let at = |t| Seen::at(Timestamp(t));
        assert_eq!(
            (tape.bar_close(at(59)), tape.bar_close(at(60)), tape.bar_close(at(119))),
            (None, Some(20.0), Some(20.0))
        );
        assert_eq!(
            (tape.next_open(at(60)), tape.next_open(at(61)), tape.next_open(at(121))),
            (Some(11.0), Some(12.0), None)
        );
        assert_eq!((tape.volume(Side::Buy, at(59)), tape.volume(Side::Buy, at(60))), (100.0, 200.0));
        assert_eq!(tape.span(), Some((Timestamp(0), Timestamp(180))));
        assert_eq!(tape.mid(at(10)), Some(11.0), "before the first bar is known its successor's open is nearest");
    }

    #[test]
    fn volume_is_what_is_displayed_or_traded() {
        assert_eq!(tape(&[0]).volume(Side::Buy, Seen::at(Timestamp(5))), 20.0);
        assert_eq!(tape(&[0]).volume(Side::Sell, Seen::at(Timestamp(5))), 10.0);
        let print = |time, size| Print { time: Timestamp(time), price: 1.0, size, aggressor: None };
        let second = Timestamp::NANOS;
        let prints = vec![print(0, 1.0), print(10 * second, 2.0), print(60 * second, 4.0), print(70 * second, 8.0)];
        let tape = Tape::new(Quotes::default(), prints, Vec::new());
        assert_eq!(tape.volume(Side::Buy, Seen::at(Timestamp(10 * second))), 6.0);
        assert_eq!(tape.longest_silence(), 50 * second);
        assert_eq!(Tape::default().volume(Side::Buy, Seen::at(Timestamp(0))), f64::INFINITY);
    }
}
