//! What the market showed at an instant: what orders of two logs are held against.

use crate::market::{History, Price};
use crate::sim2real::Timestamp;

/// What the market showed. None where it is not known.
pub trait Showing {
    /// The mid [currency], or what stands in for it: the last trade, or the last close.
    fn mid(&self, symbol: &str, at: Timestamp) -> Option<f64>;
    /// Half the quoted spread [currency]; none where there are no quotes.
    fn half_spread(&self, symbol: &str, at: Timestamp) -> Option<f64>;
    /// The lowest and the highest price quoted, traded or within a bar, from one instant to another.
    fn band(&self, symbol: &str, from: Timestamp, to: Timestamp) -> Option<[Price; 2]>;
    /// The last price there is.
    fn last(&self, symbol: &str) -> Option<Price>;
}

/// Histories by the symbols they are of.
#[derive(Debug, Clone, Copy)]
pub struct Histories<'a> {
    symbols: &'a [&'a str],
    of: &'a [History],
}

impl<'a> Histories<'a> {
    /// Histories, one a symbol, in the same order.
    #[must_use]
    pub fn new(symbols: &'a [&'a str], of: &'a [History]) -> Self {
        Self { symbols, of }
    }

    fn of(&self, symbol: &str) -> Option<&'a History> {
        self.of.get(self.symbols.iter().position(|other| *other == symbol)?)
    }
}

impl Showing for Histories<'_> {
    fn mid(&self, symbol: &str, at: Timestamp) -> Option<f64> {
        let history = self.of(symbol)?;
        let quotes = history.quotes();
        if !quotes.times().is_empty() {
            let row = quotes.times().partition_point(|time| *time <= at);
            return quotes.all().get(row.checked_sub(1)?)?.mid();
        }
        let prints = history.prints();
        if !prints.is_empty() {
            return Some(prints[prints.partition_point(|print| print.time <= at).checked_sub(1)?].price);
        }
        let bars = history.bars();
        Some(bars.get(bars.partition_point(|bar| bar.known_at <= at).checked_sub(1)?)?.close.to_f64())
    }

    fn half_spread(&self, symbol: &str, at: Timestamp) -> Option<f64> {
        let quotes = self.of(symbol)?.quotes();
        let row = quotes.times().partition_point(|time| *time <= at).checked_sub(1)?;
        let quote = quotes.all().get(row)?;
        Some(0.5 * (quote.ask()? - quote.bid()?))
    }

    fn band(&self, symbol: &str, from: Timestamp, to: Timestamp) -> Option<[Price; 2]> {
        let history = self.of(symbol)?;
        let mut band = Band::default();
        let quotes = history.quotes();
        if !quotes.times().is_empty() {
            // The quote that stood at the beginning counts.
            let first = quotes.times().partition_point(|time| *time <= from).saturating_sub(1);
            let end = quotes.times().partition_point(|time| *time <= to);
            for quote in (first..end).filter_map(|row| quotes.all().get(row)) {
                [quote.bid(), quote.ask()].into_iter().flatten().for_each(|price| band.see(price));
            }
        }
        let prints = history.prints();
        let first = prints.partition_point(|print| print.time < from);
        prints[first..].iter().take_while(|print| print.time <= to).for_each(|print| band.see(print.price));
        let bars = history.bars();
        let first = bars.partition_point(|bar| bar.known_at <= from);
        for bar in bars[first..].iter().take_while(|bar| bar.open_at <= to) {
            band.see(bar.low.to_f64());
            band.see(bar.high.to_f64());
        }
        band.0.map(|[low, high]| [low, high].map(|price| Price::nearest(price).unwrap_or_default()))
    }

    fn last(&self, symbol: &str) -> Option<Price> {
        let history = self.of(symbol)?;
        let mid = self.mid(symbol, Timestamp::MAX).and_then(|mid| Price::nearest(mid).ok());
        history.bars().last().map(|bar| bar.close).filter(|_| history.quotes().times().is_empty()).or(mid)
    }
}

#[derive(Default)]
struct Band(Option<[f64; 2]>);

impl Band {
    fn see(&mut self, price: f64) {
        let [low, high] = self.0.unwrap_or([price; 2]);
        self.0 = Some([low.min(price), high.max(price)]);
    }
}
