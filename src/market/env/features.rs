//! What is observed of an instrument's market, row by row of its data, each row made of itself and those before it.
//!
//! A table is made once and shared by all lanes: a row of it depends on no later row, so that looking one up is not looking ahead.
//! Which rows count is the finest the data have: events of its book, else quotes, else trades, else bars. Of a row there are
//!
//! - log returns over windows of rows, divided by the slow volatility and the root of the window;
//! - the slow volatility of one row, and the logarithm of the fast over the slow one; both exponentially weighted, corrected for
//!   their beginning as in Kingma and Ba, "Adam" (2015), section 3;
//! - spread [bps of the mid] and imbalance (bid size - ask size) / (bid size + ask size) of the best prices, 0 for bars and trades;
//! - the logarithm of the volume over its weighted mean;
//! - the probability of each regime given all rows so far, by a hidden Markov model of returns over the volatility before them.

use crate::market::known::Known;
use crate::market::line::Line;
use crate::market::sources::RowKind;
use crate::market::{DepthBook, EventKind, Feed, History, Increments, Side};
use crate::sim2real::Timestamp;
use crate::sim2real::regime::{Emission, Filter, HiddenMarkov, RegimeError, Spread};

/// Largest size of a return, in volatilities.
const LARGEST_RETURN: f64 = 10.0;
/// Largest size of a logarithm of a ratio.
const LARGEST_LOG: f64 = 5.0;
/// Largest spread [bps].
const WIDEST_SPREAD: f64 = 1_000.0;
/// Least volatility a return is divided by.
const LEAST_VOLATILITY: f64 = 1e-9;

/// What features there are.
#[derive(Debug, Clone, PartialEq)]
pub struct FeatureSettings {
    /// Windows of returns [rows], each at least 1.
    pub windows: Vec<usize>,
    /// Half-life of the fast volatility [rows].
    pub fast: f64,
    /// Half-life of the slow volatility, and of the mean volume [rows].
    pub slow: f64,
    /// The model of regimes, of one column: returns over the slow volatility before them. None for no regimes.
    pub regimes: Option<HiddenMarkov>,
}

impl Default for FeatureSettings {
    /// Windows of 1, 5, 20 and 60 rows, half-lives of 20 and 250, and the regimes of [`calm_and_turbulent`].
    fn default() -> Self {
        Self { windows: vec![1, 5, 20, 60], fast: 20.0, slow: 250.0, regimes: calm_and_turbulent().ok() }
    }
}

/// Two regimes of returns that are measured in their own slow volatility: a calm one of 0.7 and a turbulent one of 1.8 of it, which
/// last 100 and 33 rows on average. It is fixed, and so knows nothing of the data; a model fitted to earlier data may take its
/// place.
///
/// # Errors
/// None: its numbers are a model.
pub fn calm_and_turbulent() -> Result<HiddenMarkov, RegimeError> {
    let state =
        |deviation: f64| Emission { mean: vec![0.0], spread: Spread::Diagonal(vec![deviation * deviation]), degrees: None };
    HiddenMarkov::new(vec![0.75, 0.25], vec![vec![0.99, 0.01], vec![0.03, 0.97]], vec![state(0.7), state(1.8)])
}

impl FeatureSettings {
    /// Name, unit and bounds of each, in their order.
    pub(super) fn components(&self) -> Vec<(String, &'static str, f32, f32)> {
        let (size, log) = (LARGEST_RETURN as f32, LARGEST_LOG as f32);
        let mut all: Vec<_> = self.windows.iter().map(|w| (format!("return_{w}"), "volatilities", -size, size)).collect();
        all.push(("volatility".into(), "", 0.0, 1.0));
        all.push(("volatility_ratio".into(), "ln", -log, log));
        all.push(("spread".into(), "bps", 0.0, WIDEST_SPREAD as f32));
        all.push(("imbalance".into(), "", -1.0, 1.0));
        all.push(("volume".into(), "ln", -log, log));
        let regimes = self.regimes.as_ref().map_or(0, HiddenMarkov::states);
        all.extend((0..regimes).map(|k| (format!("regime_{k}"), "", 0.0, 1.0)));
        all
    }
}

/// Features of all rows of an instrument.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Features {
    kind: EventKind,
    width: usize,
    /// Row after row.
    rows: Vec<f32>,
    /// When each row could be known.
    times: Vec<Timestamp>,
    /// Mean of volume, or of the size displayed at the best prices, over all rows: for sizes nobody states.
    mean_size: f64,
}

impl Features {
    /// Those of `history`.
    ///
    /// # Errors
    /// A model of regimes of more than one column.
    pub fn of(history: &History, increments: Increments, settings: &FeatureSettings) -> Result<Self, RegimeError> {
        let line = Line::whole(history);
        let kind = kind(&line);
        let mut track = Track::new(settings);
        let mut known = Known { book: Some(DepthBook::new(increments)), ..Known::default() };
        let mut all = Self { kind, width: settings.components().len(), rows: Vec::new(), times: Vec::new(), mean_size: 0.0 };
        for arrival in Feed::new(std::slice::from_ref(history)).filter(|arrival| arrival.event.kind == kind) {
            let shown = match kind {
                EventKind::Bar => line.bar(arrival.row).map(|bar| Shown::price(bar.close.to_f64(), bar.volume)),
                EventKind::Trade => line.print(arrival.row).map(|print| Shown::price(print.price, print.size)),
                EventKind::Quote => line.quote(arrival.row).map(|quote| {
                    let best = |levels: &[crate::market::Level]| levels.first().map(|level| (level.price, level.size));
                    Shown::best(best(quote.bids), best(quote.asks))
                }),
                EventKind::Depth => {
                    known.learn_depth(&line, &arrival);
                    known.book.as_ref().map(|book| {
                        let best = |side| {
                            let price = book.best(side)?;
                            Some((price.to_f64(), book.size(side, price)))
                        };
                        Shown::best(best(Side::Buy), best(Side::Sell))
                    })
                }
                EventKind::Timer => None,
            };
            track.see(&shown.unwrap_or_default(), &mut all.rows)?;
            all.times.push(arrival.known_at);
            all.mean_size += shown.map_or(0.0, |shown| shown.volume.max(shown.displayed));
        }
        all.mean_size /= all.times.len().max(1) as f64;
        Ok(all)
    }

    /// The kind of row that counts.
    pub fn kind(&self) -> EventKind {
        self.kind
    }

    /// Number of features.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.times.len()
    }

    /// Mean volume of a row, or size displayed at the best prices [units].
    pub fn mean_size(&self) -> f64 {
        self.mean_size
    }

    /// When row `row` could be known.
    pub fn time(&self, row: usize) -> Option<Timestamp> {
        self.times.get(row).copied()
    }

    /// Number of rows known before `time`.
    pub fn before(&self, time: Timestamp) -> usize {
        self.times.partition_point(|known| *known < time)
    }

    /// When the most probable of so many regimes, the last features of a row, becomes another, and which: the lower of those that are
    /// equally probable. Before the first row there is none.
    pub fn regimes(&self, count: usize) -> Vec<(Timestamp, usize)> {
        let first = self.width - count.min(self.width);
        let mut begun: Vec<(Timestamp, usize)> = Vec::new();
        for (row, known) in self.rows.chunks_exact(self.width.max(1)).zip(&self.times) {
            let likelier = |best: usize, k: usize| if row[first + k] > row[first + best] { k } else { best };
            let Some(now) = (0..count).reduce(likelier) else { break };
            if begun.last().is_none_or(|(_, before)| *before != now) {
                begun.push((*known, now));
            }
        }
        begun
    }

    /// Writes what is observed when so many rows have been seen; nothing but zeros before the first.
    #[inline]
    pub fn write(&self, seen: usize, into: &mut [f32]) {
        match seen.checked_sub(1).and_then(|row| self.rows.get(row * self.width..(row + 1) * self.width)) {
            Some(row) => into.copy_from_slice(row),
            None => into.fill(0.0),
        }
    }
}

/// The finest kind of row that says what an instrument is worth.
fn kind(line: &Line) -> EventKind {
    let order = [
        (RowKind::Orders, EventKind::Depth),
        (RowKind::Depth, EventKind::Depth),
        (RowKind::Quotes, EventKind::Quote),
        (RowKind::Bars, EventKind::Bar),
        (RowKind::Trades, EventKind::Trade),
    ];
    order.into_iter().find(|(kind, _)| line.tells(*kind)).map_or(EventKind::Bar, |(_, kind)| kind)
}

/// What a row shows.
#[derive(Debug, Clone, Copy, Default)]
struct Shown {
    price: Option<f64>,
    spread: f64,
    imbalance: f64,
    volume: f64,
    displayed: f64,
}

impl Shown {
    fn price(price: f64, volume: f64) -> Self {
        Self { price: Some(price), volume, ..Self::default() }
    }

    fn best(bid: Option<(f64, f64)>, ask: Option<(f64, f64)>) -> Self {
        let (Some((bid, bid_size)), Some((ask, ask_size))) = (bid, ask) else { return Self::default() };
        let all = bid_size + ask_size;
        Self {
            price: Some(0.5 * (bid + ask)),
            spread: ask - bid,
            imbalance: if all > 0.0 { (bid_size - ask_size) / all } else { 0.0 },
            volume: 0.0,
            displayed: 0.5 * all,
        }
    }
}

/// A mean with weights that fall by half over so many rows.
#[derive(Debug, Clone, Copy)]
struct Weighted {
    rate: f64,
    sum: f64,
    weight: f64,
}

impl Weighted {
    fn of_half_life(rows: f64) -> Self {
        Self { rate: 1.0 - 0.5_f64.powf(1.0 / rows.max(1e-3)), sum: 0.0, weight: 0.0 }
    }

    fn see(&mut self, value: f64) {
        self.sum += self.rate * (value - self.sum);
        self.weight += self.rate * (1.0 - self.weight);
    }

    fn mean(&self) -> f64 {
        if self.weight > 0.0 { self.sum / self.weight } else { 0.0 }
    }
}

/// Features under way.
struct Track {
    windows: Vec<usize>,
    /// Logarithms of prices, all so far.
    prices: Vec<f64>,
    fast: Weighted,
    slow: Weighted,
    volume: Weighted,
    regimes: Option<Filter>,
}

impl Track {
    fn new(settings: &FeatureSettings) -> Self {
        let [fast, slow, volume] = [settings.fast, settings.slow, settings.slow].map(Weighted::of_half_life);
        let regimes = settings.regimes.clone().map(Filter::new);
        Self { windows: settings.windows.clone(), prices: Vec::new(), fast, slow, volume, regimes }
    }

    /// Takes the next row in, and adds its features to `rows`.
    fn see(&mut self, shown: &Shown, rows: &mut Vec<f32>) -> Result<(), RegimeError> {
        let before = self.prices.last().copied();
        // A row without a price leaves the last one in force.
        let price = shown.price.filter(|price| *price > 0.0).map(f64::ln).or(before);
        let expected = self.slow.mean().sqrt().max(LEAST_VOLATILITY);
        let moved = before.zip(price).map(|(before, price)| price - before);
        self.prices.extend(price);
        if let Some(moved) = moved {
            self.fast.see(moved * moved);
            self.slow.see(moved * moved);
        }
        let (fast, slow) = (self.fast.mean().sqrt(), self.slow.mean().sqrt());
        let own = slow.max(LEAST_VOLATILITY);
        for window in &self.windows {
            let last = self.prices.len().wrapping_sub(1);
            let then = last.checked_sub(*window).and_then(|k| self.prices.get(k));
            let change = then.map_or(0.0, |then| self.prices[last] - then);
            rows.push(bounded(change / (own * (*window as f64).sqrt()), LARGEST_RETURN));
        }
        rows.push(bounded(slow, 1.0));
        rows.push(bounded(ratio(fast, slow), LARGEST_LOG));
        let mid = price.map_or(0.0, f64::exp);
        rows.push(if mid > 0.0 { bounded(shown.spread / mid * 1e4, WIDEST_SPREAD).max(0.0) } else { 0.0 });
        rows.push(bounded(shown.imbalance, 1.0));
        rows.push(bounded(ratio(shown.volume, self.volume.mean()), LARGEST_LOG));
        if shown.volume > 0.0 {
            self.volume.see(shown.volume);
        }
        if let Some(filter) = &mut self.regimes {
            // The first rows have no volatility to be measured by: time goes on, and nothing is learned.
            let row = moved.filter(|_| self.slow.weight > self.slow.rate).map_or(f64::NAN, |moved| moved / expected);
            let belief = filter.step(&[row.clamp(-20.0, 20.0)])?;
            rows.extend(belief.iter().map(|p| *p as f32));
        }
        Ok(())
    }
}

/// The logarithm of a ratio; 0 where there is none.
fn ratio(above: f64, below: f64) -> f64 {
    if above > 0.0 && below > 0.0 { (above / below).ln() } else { 0.0 }
}

/// `value` within `size` of 0; 0 for what is no number.
fn bounded(value: f64, size: f64) -> f32 {
    if value.is_nan() { 0.0 } else { value.clamp(-size, size) as f32 }
}
