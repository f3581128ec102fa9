//! Quotes: what is bid and asked, with as many levels as the data know.

use crate::sim2real::Timestamp;

use super::{Book, Level, Side};

/// The quotes of one instrument, oldest first, in flat arrays.
#[derive(Debug, Clone, Default)]
pub struct Quotes {
    times: Vec<Timestamp>,
    /// `depth` bids, then `depth` asks, a quote; those beyond `counts` are not there.
    levels: Vec<Level>,
    /// Levels of each quote, bids and asks; none where all quotes have all levels.
    counts: Vec<[u8; 2]>,
    depth: usize,
}

impl PartialEq for Quotes {
    fn eq(&self, other: &Self) -> bool {
        self.all() == other.all()
    }
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

    /// The levels an order of `side` takes from, the best first.
    #[must_use]
    pub fn opposite(&self, side: Side) -> &[Level] {
        match side {
            Side::Buy => self.asks,
            Side::Sell => self.bids,
        }
    }

    /// What is displayed on the side an order of `side` takes from [units].
    #[must_use]
    pub fn displayed(&self, side: Side) -> f64 {
        self.opposite(side).iter().map(|level| level.size).sum()
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
        let (full, own) = ([depth as u8; 2], [bids.len().min(depth) as u8, asks.len().min(depth) as u8]);
        if own != full || !self.counts.is_empty() {
            self.counts.resize(self.times.len(), full);
            self.counts.push(own);
        }
        self.times.push(time);
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
        if !self.counts.is_empty() {
            self.counts.drain(..gone);
        }
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
            counts: if self.counts.is_empty() { &[] } else { &self.counts[start..end] },
            depth: self.depth,
        }
    }
}

/// Some quotes in a row, oldest first. It holds nothing of those before and after.
#[derive(Debug, Clone, Copy, Default)]
pub struct QuoteSlice<'a> {
    times: &'a [Timestamp],
    levels: &'a [Level],
    counts: &'a [[u8; 2]],
    depth: usize,
}

impl PartialEq for QuoteSlice<'_> {
    fn eq(&self, other: &Self) -> bool {
        self.len() == other.len() && (0..self.len()).all(|k| self.get(k) == other.get(k))
    }
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
        let time = *self.times.get(k)?;
        let [bids, asks] = self.counts.get(k).copied().unwrap_or([self.depth as u8; 2]);
        let levels = &self.levels[2 * self.depth * k..];
        Some(Quote { time, bids: &levels[..usize::from(bids)], asks: &levels[self.depth..self.depth + usize::from(asks)] })
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

    /// That some lack levels is kept of all only where some do; whoever reads sees no difference.
    #[test]
    fn what_quotes_have_does_not_depend_on_the_others() {
        let level = |price: f64| [Level { price, size: 10.0 }];
        let made = |asks: &[Option<f64>]| {
            let mut quotes = Quotes::with_depth(1);
            for (k, ask) in asks.iter().enumerate() {
                let ask: Vec<Level> = ask.iter().flat_map(|price| level(*price)).collect();
                quotes.push(Timestamp(k as i64), &level(99.0), &ask);
            }
            quotes
        };
        let (full, poor) = (made(&[Some(101.0), Some(102.0)]), made(&[Some(101.0), Some(102.0), None, Some(103.0)]));
        assert_eq!(full.all(), poor.between(0, 2));
        assert_ne!(full.all(), poor.between(1, 3));
        let asks: Vec<Option<f64>> = (0..4).map(|k| poor.all().get(k).unwrap().ask()).collect();
        assert_eq!(asks, [Some(101.0), Some(102.0), None, Some(103.0)]);
        let mut newest = poor.clone();
        newest.keep_newest(1);
        let mut alone = Quotes::with_depth(1);
        alone.push(Timestamp(3), &level(99.0), &level(103.0));
        assert_eq!(newest, alone);
        let mut other = full.clone();
        other.push(Timestamp(2), &level(99.0), &[]);
        assert_eq!(other.all(), poor.between(0, 3));
        assert_ne!(other, full);
    }
}
