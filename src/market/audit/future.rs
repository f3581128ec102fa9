//! Other futures: the same past, and something else after it.

use std::sync::Arc;

use rand::RngExt;
use serde::Serialize;

use crate::market::{Backtest, BacktestError, Bar, History, Level, Price, Quotes};
use crate::sim2real::{Seed, Timestamp};

/// What is done to all that becomes known after an instant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Change {
    /// It is not there.
    CutOff,
    /// Prices are moved by random factors between 0.5 and 1.5, volumes and sizes too; bars and quotes stay possible ones.
    Changed,
}

impl Change {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Changed, Self::CutOff];

    /// Its words in sentences.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Self::CutOff => "cut off",
            Self::Changed => "changed",
        }
    }
}

/// `backtest` with another future after `now`.
///
/// Of a bar that is under way at `now` the open was seen, and it stays; so does its volume, in which the venue lets orders
/// at the open take part. Its other prices do not.
///
/// # Errors
/// As [`Backtest::new`].
pub(in crate::market) fn with_future(
    backtest: &Backtest,
    now: Timestamp,
    change: Change,
    seed: Seed,
) -> Result<Backtest, BacktestError> {
    let of = |(number, history): (usize, &History)| match change {
        Change::CutOff => cut_off(history, now),
        Change::Changed => changed(history, now, seed, number),
    };
    let mut other = backtest.on(backtest.histories().iter().enumerate().map(of).collect())?;
    // Dividends, splits and rates of later never come.
    other.settings.account = other.settings.account.map(|account| Arc::new(account.until(now)));
    Ok(other)
}

fn cut_off(history: &History, now: Timestamp) -> History {
    let past = history.within(Timestamp::MIN, now);
    let next = history.bars().partition_point(|bar| bar.known_at <= now);
    let Some(bar) = history.bars().get(next).filter(|bar| bar.open_at < now) else { return past };
    // What of the bar under way had been seen.
    let begun = Bar { high: bar.open, low: bar.open, close: bar.open, ..*bar };
    let bars = past.bars().iter().copied().chain([begun]).collect();
    History::new(bars, Quotes::default()).map(|bars| bars.joined_with(past)).unwrap_or_default()
}

fn changed(history: &History, now: Timestamp, seed: Seed, number: usize) -> History {
    let mut rng = seed.child("another future").stream(&number.to_string());
    let mut factor = || 0.5 + rng.random::<f64>();
    let mut bars = history.bars().to_vec();
    let future = bars.partition_point(|bar| bar.known_at <= now);
    for bar in &mut bars[future..] {
        let under_way = bar.open_at < now;
        let [open, close, volume] = [factor(), factor(), factor()];
        let open = if under_way { bar.open } else { scaled(bar.open, open) };
        let volume = if under_way { bar.volume } else { bar.volume * volume };
        let close = scaled(bar.close, close);
        *bar = Bar { open, close, high: open.max(close), low: open.min(close), volume, ..*bar };
    }
    let all = history.quotes().all();
    let mut quotes = Quotes::with_depth(history.quotes().depth());
    for quote in (0..all.len()).map_while(|k| all.get(k)) {
        let [price, size] = if quote.time > now { [factor(), factor()] } else { [1.0, 1.0] };
        let moved = |levels: &[Level]| -> Vec<Level> {
            levels.iter().map(|level| Level { price: level.price * price, size: level.size * size }).collect()
        };
        quotes.push(quote.time, &moved(quote.bids), &moved(quote.asks));
    }
    let mut prints = history.prints().to_vec();
    let known: Vec<Timestamp> = (0..prints.len()).filter_map(|row| history.print_known_at(row)).collect();
    for (print, _) in prints.iter_mut().zip(&known).filter(|(_, known)| **known > now) {
        (print.price, print.size) = (print.price * factor(), print.size * factor());
    }
    let mut depth = history.depth().to_vec();
    for change in depth.iter_mut().filter(|change| change.known_at > now) {
        (change.price, change.size) = (scaled(change.price, factor()), change.size * factor());
    }
    let mut orders = history.order_events().to_vec();
    for event in orders.iter_mut().filter(|event| event.known_at > now) {
        (event.price, event.size) = (scaled(event.price, factor()), event.size * factor());
    }
    // What it was made of was a history, and prices stay above 0 and in order.
    History::new(bars, quotes)
        .and_then(|history| history.with_prints_known_at(prints, known))
        .and_then(|history| history.with_depth(depth))
        .and_then(|history| history.with_order_events(orders))
        .unwrap_or_default()
}

fn scaled(price: Price, factor: f64) -> Price {
    Price(((price.0 as f64 * factor) as i64).max(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn history() -> History {
        let price = |p: i64| Price(p * 1_000_000_000);
        let bar = |k: i64| Bar {
            open_at: Timestamp(10 * k),
            known_at: Timestamp(10 * k + 10),
            open: price(20 + k),
            high: price(29),
            low: price(11),
            close: price(21 + k),
            volume: 7.0,
        };
        let mut quotes = Quotes::with_depth(1);
        for t in [4, 9, 15, 25] {
            quotes.push(Timestamp(t), &[Level { price: 20.0, size: 3.0 }], &[Level { price: 21.0, size: 4.0 }]);
        }
        History::new((0..4).map(bar).collect(), quotes).unwrap()
    }

    #[test]
    fn of_a_bar_under_way_the_open_alone_is_kept() {
        let (whole, now) = (history(), Timestamp(15));
        let cut = cut_off(&whole, now);
        assert_eq!((cut.bars().len(), cut.quotes().len()), (2, 3));
        assert_eq!(cut.bars()[0], whole.bars()[0]);
        let (begun, was) = (cut.bars()[1], whole.bars()[1]);
        assert_eq!((begun.open, begun.high, begun.low, begun.close), (was.open, was.open, was.open, was.open));
        assert_eq!(cut_off(&whole, Timestamp(10)).bars(), &whole.bars()[..1]);

        let other = changed(&whole, now, Seed(1), 0);
        assert_eq!((other.bars().len(), other.quotes().len()), (4, 4));
        assert_eq!((other.bars()[0], other.bars()[1].open), (whole.bars()[0], was.open));
        assert!(other.bars()[1].close != was.close && other.bars()[2].open != whole.bars()[2].open);
        assert!(other.bars()[1].volume == 7.0 && other.bars()[2].volume != 7.0);
        let asked = |h: &History, k: usize| h.quotes().all().get(k).and_then(|q| q.ask());
        assert!(asked(&other, 2) == asked(&whole, 2) && asked(&other, 3) != asked(&whole, 3));
    }
}
