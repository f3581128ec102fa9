//! What is known of one instrument's market over time.

use std::sync::Arc;

use crate::sim2real::Timestamp;

use super::{Bar, DepthChange, OrderEvent, Price, Print, Quotes};

/// Bars and quotes of one instrument, in the order in which they could be known. It was made by its own checks, so that
/// what reads it need not check again. A clone shares them: many runs on the same data hold them once.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct History {
    bars: Arc<Vec<Bar>>,
    quotes: Arc<Quotes>,
    prints: Arc<Vec<Print>>,
    depth: Arc<Vec<DepthChange>>,
    orders: Arc<Vec<OrderEvent>>,
}

/// A history that cannot be.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum HistoryError {
    /// Time goes back, or stands still where it must not.
    #[error("{what} {row}: its time {found} does not follow {before}\nhint: sort by time and remove duplicates")]
    Time {
        /// "bar" or "quote".
        what: &'static str,
        /// Row, from 0.
        row: usize,
        /// Its time.
        found: Timestamp,
        /// The time before.
        before: Timestamp,
    },
    /// A bar that ends before it begins.
    #[error(
        "bar {row}: it begins at {open_at} and ends at {known_at}\nhint: `stamp` says which end of a bar its time names"
    )]
    Span {
        /// Row, from 0.
        row: usize,
        /// When it begins.
        open_at: Timestamp,
        /// When it ends.
        known_at: Timestamp,
    },
    /// Prices that cannot be those of one bar.
    #[error(
        "bar {row}: {column} is {value}\nhint: prices must be above 0, with low <= open, close <= high; volume must be finite, 0 or above"
    )]
    Bar {
        /// Row, from 0.
        row: usize,
        /// The column at fault.
        column: &'static str,
        /// What was found.
        value: f64,
    },
    /// A level that cannot be quoted, or sides that cross.
    #[error("quote {row}: {column} is {value}\nhint: {hint}")]
    Quote {
        /// Row, from 0.
        row: usize,
        /// The column at fault ("ask", "bid2_size").
        column: String,
        /// What was found.
        value: f64,
        /// The remedy.
        hint: &'static str,
    },
}

impl History {
    /// A history of the given bars and quotes.
    ///
    /// # Errors
    /// If times do not increase (strictly for bars, which must not overlap either), or a price or size cannot be.
    pub fn new(bars: Vec<Bar>, quotes: Quotes) -> Result<Self, HistoryError> {
        check_bars(&bars)?;
        check_quotes(&quotes)?;
        Ok(Self { bars: Arc::new(bars), quotes: Arc::new(quotes), ..Self::default() })
    }

    /// Its bars, oldest first.
    #[must_use]
    pub fn bars(&self) -> &[Bar] {
        &self.bars
    }

    /// Whether nothing is known.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.bars.is_empty()
            && self.quotes.is_empty()
            && self.prints.is_empty()
            && self.depth.is_empty()
            && self.orders.is_empty()
    }

    /// Whether bars are all that is known.
    #[must_use]
    pub fn shows_bars_alone(&self) -> bool {
        !self.bars.is_empty()
            && self.quotes.is_empty()
            && self.prints.is_empty()
            && self.depth.is_empty()
            && self.orders.is_empty()
    }

    /// Its bars alone, oldest first.
    #[must_use]
    pub fn into_bars(self) -> Vec<Bar> {
        Arc::unwrap_or_clone(self.bars)
    }

    /// Its quotes, oldest first.
    #[must_use]
    pub fn quotes(&self) -> &Quotes {
        &self.quotes
    }

    /// Its trades, oldest first.
    #[must_use]
    pub fn prints(&self) -> &[Print] {
        &self.prints
    }

    /// The changes of its book by price, oldest first.
    #[must_use]
    pub fn depth(&self) -> &[DepthChange] {
        &self.depth
    }

    /// What happened to the orders in its book, oldest first.
    #[must_use]
    pub fn order_events(&self) -> &[OrderEvent] {
        &self.orders
    }

    /// The same with trades.
    #[must_use]
    pub fn with_prints(self, prints: Vec<Print>) -> Self {
        Self { prints: Arc::new(prints), ..self }
    }

    /// The same with changes of the book by price.
    #[must_use]
    pub fn with_depth(self, depth: Vec<DepthChange>) -> Self {
        Self { depth: Arc::new(depth), ..self }
    }

    /// The same with what happened to the orders in the book.
    #[must_use]
    pub fn with_order_events(self, orders: Vec<OrderEvent>) -> Self {
        Self { orders: Arc::new(orders), ..self }
    }

    /// These bars with the quotes of `other`: each was checked when it was made.
    #[must_use]
    pub fn with_quotes_of(self, other: Self) -> Self {
        Self { quotes: other.quotes, ..self }
    }

    /// The same history without what was known before `start` or after `end`.
    #[must_use]
    pub fn within(&self, start: Timestamp, end: Timestamp) -> Self {
        let bars = self.bars.iter().filter(|bar| bar.known_at >= start && bar.known_at <= end).copied().collect();
        let all = self.quotes.all();
        let mut quotes = Quotes::with_depth(self.quotes.depth());
        let from = all.times().partition_point(|time| *time < start);
        for quote in (from..all.len()).map_while(|k| all.get(k)).take_while(|quote| quote.time <= end) {
            quotes.push(quote.time, quote.bids, quote.asks);
        }
        Self { bars: Arc::new(bars), quotes: Arc::new(quotes), ..Self::default() }
    }
}

fn check_bars(bars: &[Bar]) -> Result<(), HistoryError> {
    let mut before: Option<&Bar> = None;
    for (row, bar) in bars.iter().enumerate() {
        if let Some(before) = before
            && bar.open_at < before.known_at
        {
            return Err(HistoryError::Time { what: "bar", row, found: bar.open_at, before: before.known_at });
        }
        if bar.known_at <= bar.open_at {
            return Err(HistoryError::Span { row, open_at: bar.open_at, known_at: bar.known_at });
        }
        let fault = |column, price: Price| Err(HistoryError::Bar { row, column, value: price.to_f64() });
        if bar.low.0 <= 0 {
            return fault("low", bar.low);
        }
        if bar.high < bar.low {
            return fault("high", bar.high);
        }
        if bar.open < bar.low || bar.open > bar.high {
            return fault("open", bar.open);
        }
        if bar.close < bar.low || bar.close > bar.high {
            return fault("close", bar.close);
        }
        if !bar.volume.is_finite() || bar.volume < 0.0 {
            return Err(HistoryError::Bar { row, column: "volume", value: bar.volume });
        }
        before = Some(bar);
    }
    Ok(())
}

fn check_quotes(quotes: &Quotes) -> Result<(), HistoryError> {
    let all = quotes.all();
    for (row, pair) in all.times().windows(2).enumerate() {
        if pair[1] < pair[0] {
            return Err(HistoryError::Time { what: "quote", row: row + 1, found: pair[1], before: pair[0] });
        }
    }
    for (row, quote) in (0..all.len()).map_while(|k| all.get(k)).enumerate() {
        for (side, levels, outward) in [("bid", quote.bids, -1.0), ("ask", quote.asks, 1.0)] {
            let mut best = f64::NEG_INFINITY;
            for (k, level) in levels.iter().enumerate() {
                let column = if k == 0 { side.to_owned() } else { format!("{side}{}", k + 1) };
                if !level.price.is_finite() || level.price <= 0.0 || Price::nearest(level.price).is_err() {
                    let hint = "a price must be above 0 and at most 9.2e9; leave an empty side out";
                    return Err(HistoryError::Quote { row, column, value: level.price, hint });
                }
                if level.size.is_nan() || level.size <= 0.0 {
                    let hint = "a displayed size must be above 0; leave an empty side out";
                    return Err(HistoryError::Quote { row, column: format!("{column}_size"), value: level.size, hint });
                }
                if outward * level.price <= best {
                    let hint = "deeper levels must have worse prices";
                    return Err(HistoryError::Quote { row, column, value: level.price, hint });
                }
                best = outward * level.price;
            }
        }
        if let (Some(bid), Some(ask)) = (quote.bid(), quote.ask())
            && bid > ask
        {
            let hint = "the bid is above the ask: remove crossed quotes, or check that the columns are not swapped";
            return Err(HistoryError::Quote { row, column: "ask".into(), value: ask, hint });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::market::Level;

    fn bar(open_at: i64, prices: [i64; 4], volume: f64) -> Bar {
        let [open, high, low, close] = prices.map(|p| Price(p * 1_000_000_000));
        Bar { open_at: Timestamp(open_at), known_at: Timestamp(open_at + 10), open, high, low, close, volume }
    }

    fn of_bars(bars: &[Bar]) -> Result<History, HistoryError> {
        History::new(bars.to_vec(), Quotes::default())
    }

    #[test]
    fn bars_that_cannot_be_are_refused() {
        let good = bar(0, [10, 12, 9, 11], 5.0);
        assert!(of_bars(&[good, bar(10, [11, 11, 11, 11], 0.0)]).is_ok());
        assert!(matches!(of_bars(&[good, bar(9, [11, 11, 11, 11], 0.0)]), Err(HistoryError::Time { row: 1, .. })));
        assert!(matches!(of_bars(&[Bar { known_at: Timestamp(0), ..good }]), Err(HistoryError::Span { row: 0, .. })));
        for (prices, fault) in
            [([13, 12, 9, 11], "open"), ([10, 12, 9, 8], "close"), ([10, 8, 9, 10], "high"), ([0, 12, 0, 11], "low")]
        {
            assert!(
                matches!(of_bars(&[bar(0, prices, 1.0)]), Err(HistoryError::Bar { row: 0, column, .. }) if column == fault)
            );
        }
        for volume in [-1.0, f64::NAN, f64::INFINITY] {
            let found = of_bars(&[bar(0, [10, 12, 9, 11], volume)]);
            assert!(matches!(found, Err(HistoryError::Bar { column: "volume", .. })));
        }
    }

    #[test]
    fn quotes_that_cannot_be_are_refused() {
        let level = |price: f64, size: f64| Level { price, size };
        let fault = |rows: &[(i64, &[Level], &[Level])]| {
            let mut quotes = Quotes::with_depth(2);
            rows.iter().for_each(|(time, bids, asks)| quotes.push(Timestamp(*time), bids, asks));
            History::new(Vec::new(), quotes).map(|_| ()).map_err(|error| error.to_string())
        };
        let (bid, ask) = (level(99.0, 1.0), level(101.0, 1.0));
        assert_eq!(fault(&[(0, &[bid], &[ask]), (0, &[], &[ask]), (1, &[bid], &[])]), Ok(()));
        assert!(fault(&[(1, &[bid], &[ask]), (0, &[bid], &[ask])]).unwrap_err().starts_with("quote 1: its time"));
        assert!(fault(&[(0, &[ask], &[bid])]).unwrap_err().contains("the bid is above the ask"));
        assert!(fault(&[(0, &[level(0.0, 1.0)], &[ask])]).unwrap_err().starts_with("quote 0: bid is 0"));
        assert!(fault(&[(0, &[bid], &[level(101.0, 0.0)])]).unwrap_err().starts_with("quote 0: ask_size is 0"));
        assert!(fault(&[(0, &[bid], &[ask, level(100.5, 1.0)])]).unwrap_err().starts_with("quote 0: ask2 is 100.5"));
    }

    #[test]
    fn a_tape_is_cut_by_when_things_were_known() {
        let bars = [0, 10, 20, 30].map(|t| bar(t, [10, 12, 9, 11], 1.0));
        let history = of_bars(&bars).unwrap();
        assert_eq!(history.within(Timestamp(20), Timestamp(39)).bars(), &bars[1..3]);
    }
}
