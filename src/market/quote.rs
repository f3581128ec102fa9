//! Quotes: what is bid and asked, with as many levels as the data know.

use crate::sim2real::Timestamp;

use super::{Book, Level};

/// The quotes of one instrument, oldest first, in flat arrays.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Quotes {
    times: Vec<Timestamp>,
    /// `depth` bids, then `depth` asks, a quote; those beyond `counts` are not there.
    levels: Vec<Level>,
    counts: Vec<[u8; 2]>,
    depth: usize,
}

/// One quote; a side with no levels is empty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quote<'a> {
    /// When it came to be, and was known.
    pub time: Timestamp,
    /// Bids, the best first.
    pub bids: &'a [Level],
    /// Asks, the best first.
    pub asks: &'a [Level],
}

impl Quote<'_> {
    /// Best bid [currency], where there is one.
    #[must_use]
    pub fn bid(&self) -> Option<f64> {
        self.bids.first().map(|level| level.price)
    }

    /// Best ask [currency], where there is one.
    #[must_use]
    pub fn ask(&self) -> Option<f64> {
        self.asks.first().map(|level| level.price)
    }

    /// Midway between best bid and best ask [currency], where there are both.
    #[must_use]
    pub fn mid(&self) -> Option<f64> {
        Some(0.5 * (self.bid()? + self.ask()?))
    }

    /// The book an order finds here.
    #[must_use]
    pub fn book(&self) -> Book {
        Book::new(self.time, self.bids, self.asks)
    }
}

impl Quotes {
    /// No quotes yet, with room for `depth` levels a side: from 1 to [`Book::DEPTH`].
    #[must_use]
    pub fn with_depth(depth: usize) -> Self {
        Self { depth: depth.clamp(1, Book::DEPTH), ..Self::default() }
    }

    /// Adds a quote; levels beyond the depth are left out.
    pub fn push(&mut self, time: Timestamp, bids: &[Level], asks: &[Level]) {
        let depth = self.depth.max(1);
        self.depth = depth;
        for side in [bids, asks] {
            let count = side.len().min(depth);
            self.levels.extend_from_slice(&side[..count]);
            self.levels.resize(self.levels.len() + depth - count, Level::default());
        }
        self.times.push(time);
        self.counts.push([bids.len().min(depth) as u8, asks.len().min(depth) as u8]);
    }

    /// Number of quotes.
    #[must_use]
    pub fn len(&self) -> usize {
        self.times.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.times.is_empty()
    }

    /// Levels a side there is room for.
    #[must_use]
    pub fn depth(&self) -> usize {
        self.depth
    }

    /// The same in order of time; those of one time stay in their order.
    #[cfg(feature = "io")]
    pub(super) fn in_order(&self) -> Self {
        let mut order: Vec<usize> = (0..self.len()).collect();
        order.sort_by_key(|k| self.times[*k]);
        let mut sorted = Self::with_depth(self.depth);
        for quote in order.into_iter().filter_map(|k| self.all().get(k)) {
            sorted.push(quote.time, quote.bids, quote.asks);
        }
        sorted
    }

    /// Forgets all but the newest `count`.
    pub(super) fn keep_newest(&mut self, count: usize) {
        let gone = self.len().saturating_sub(count);
        self.times.drain(..gone);
        self.levels.drain(..2 * self.depth * gone);
        self.counts.drain(..gone);
    }

    /// Makes room for `depth` levels a side.
    pub(super) fn deepen(&mut self, depth: usize) {
        let mut deeper = Self::with_depth(depth);
        for quote in (0..self.len()).filter_map(|k| self.all().get(k)) {
            deeper.push(quote.time, quote.bids, quote.asks);
        }
        *self = deeper;
    }

    /// Their times.
    #[must_use]
    pub fn times(&self) -> &[Timestamp] {
        &self.times
    }

    /// All of them.
    #[must_use]
    pub fn all(&self) -> QuoteSlice<'_> {
        self.between(0, self.len())
    }

    /// Those from `start` to before `end`; an end beyond the last is cut.
    #[must_use]
    pub fn between(&self, start: usize, end: usize) -> QuoteSlice<'_> {
        let end = end.min(self.len());
        let start = start.min(end);
        QuoteSlice {
            times: &self.times[start..end],
            levels: &self.levels[2 * self.depth * start..2 * self.depth * end],
            counts: &self.counts[start..end],
            depth: self.depth,
        }
    }
}

/// Some quotes in a row, oldest first. It holds nothing of those before and after.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct QuoteSlice<'a> {
    times: &'a [Timestamp],
    levels: &'a [Level],
    counts: &'a [[u8; 2]],
    depth: usize,
}

impl<'a> QuoteSlice<'a> {
    /// Number of quotes.
    #[must_use]
    pub fn len(&self) -> usize {
        self.times.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.times.is_empty()
    }

    /// Their times.
    #[must_use]
    pub fn times(&self) -> &'a [Timestamp] {
        self.times
    }

    /// Quote `k`, from 0 for the oldest.
    #[must_use]
    pub fn get(&self, k: usize) -> Option<Quote<'a>> {
        let [bids, asks] = *self.counts.get(k)?;
        let levels = &self.levels[2 * self.depth * k..];
        Some(Quote {
            time: self.times[k],
            bids: &levels[..usize::from(bids)],
            asks: &levels[self.depth..self.depth + usize::from(asks)],
        })
    }

    /// The newest.
    #[must_use]
    pub fn last(&self) -> Option<Quote<'a>> {
        self.get(self.len().checked_sub(1)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quotes_come_back_as_they_went_in() {
        let level = |price: f64| Level { price, size: 10.0 };
        let mut quotes = Quotes::with_depth(2);
        quotes.push(Timestamp(1), &[level(99.0), level(98.0), level(97.0)], &[level(101.0)]);
        quotes.push(Timestamp(2), &[], &[level(102.0)]);
        let first = quotes.all().get(0).unwrap();
        assert_eq!((first.bids, first.asks), (&[level(99.0), level(98.0)][..], &[level(101.0)][..]));
        assert_eq!(first.mid(), Some(100.0));
        let last = quotes.all().last().unwrap();
        assert_eq!((last.bid(), last.ask(), last.mid()), (None, Some(102.0), None));
        assert_eq!(quotes.between(0, 1).last().unwrap().time, Timestamp(1));
        assert_eq!(quotes.between(1, 9).len(), 1);
        assert!(quotes.all().get(2).is_none() && Quotes::default().all().last().is_none());
    }
}
