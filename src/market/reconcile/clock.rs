//! How the clocks of two logs differ, as far as their orders tell.

use std::collections::{BTreeMap, HashMap};

use serde::Serialize;

use crate::market::{Quantity, Side};
use crate::sim2real::Timestamp;

use super::Life;

/// The paper log's stamps beside the backtest's: `paper = backtest + offset + drift * (backtest - origin)`, for the same decision.
///
/// Orders alone do not tell a clock that is ahead from a strategy that decides late; whole quarters of an hour are a zone.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ClockDifference {
    /// By how much the paper log's stamps are later [s].
    pub offset: f64,
    /// By how much the paper log's clock runs faster [s/s].
    pub drift: f64,
    /// When the offset was this.
    pub origin: Timestamp,
    /// Median distance of a pair of orders from that [s].
    pub spread: f64,
    /// Pairs of orders it was estimated from.
    pub orders: usize,
    /// The offset is whole quarters of an hour, but for less than a second and the spread: times of another zone.
    pub is_a_zone: bool,
}

impl ClockDifference {
    /// No difference.
    pub(super) fn none(origin: Timestamp) -> Self {
        Self { offset: 0.0, drift: 0.0, origin, spread: 0.0, orders: 0, is_a_zone: false }
    }

    /// What the backtest's clock showed when the paper log's showed `at`.
    #[must_use]
    pub fn on_backtest(&self, at: Timestamp) -> Timestamp {
        let since = at.seconds_since(self.origin) - self.offset;
        at.plus_seconds(-(self.offset + self.drift * since))
    }
}

/// Offsets that are tried: quarters of an hour up to a day either way.
const QUARTER: f64 = 900.0;
const QUARTERS: i64 = 96;
/// How near two stamps are to be, in one round after the other [s].
const NEAR: [f64; 4] = [60.0, 10.0, 2.0, 0.5];
/// Widths of the bins in which differences of stamps are counted [s].
const BINS: [f64; 3] = [0.25, 2.0, 20.0];
/// Orders an offset is estimated from at most.
const SAMPLE: usize = 1_000;
/// The fewest pairs that tell of a drift.
const FEWEST: usize = 20;
/// How many standard deviations more slopes are of one sign than chance would have it.
const SURE: f64 = 4.0;

/// How the clocks of two logs differ. Orders are in the order of their times.
#[must_use]
pub fn clock_difference(backtest: &[Life], paper: &[Life]) -> ClockDifference {
    let Some(origin) = backtest.first().map(|order| order.at) else { return ClockDifference::none(Timestamp::default()) };
    let stamps = Stamps::of(paper, origin);
    let every = backtest.len().div_ceil(SAMPLE).max(1);
    let sampled = |order| Sampled { order, at: order.at.seconds_since(origin), like: stamps.like(order) };
    let sample: Vec<Sampled<'_>> = backtest.iter().step_by(every).map(sampled).collect();
    let gaps = |offset: f64, near: f64| -> Vec<(f64, f64)> {
        sample.iter().filter_map(|own| Some((own.at, own.gap(offset, near)?))).collect()
    };
    let zones = (-QUARTERS..=QUARTERS).map(|k| k as f64 * QUARTER);
    let tried = zones.chain(BINS.into_iter().filter_map(|width| commonest(&sample, width)));
    let rate = |near: f64| sample.iter().map(|own| own.by_chance(near)).sum::<f64>();
    let by_chance = NEAR.map(rate);
    // By how many standard deviations more orders lie that near than chance would have it.
    let sure = |offset: f64, level: usize| {
        let (found, expected) = (gaps(offset, NEAR[level]).len() as f64, by_chance[level]);
        (found - expected) / (expected * (1.0 - expected / sample.len() as f64).max(0.0) + 1.0).sqrt()
    };
    let rated = tried.flat_map(|offset| (0..NEAR.len()).map(move |level| (offset, level)));
    let rated = rated.map(|(offset, level)| (sure(offset, level), offset, level));
    // Of equally sure ones the smallest offset is the likeliest.
    let best = rated.max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.abs().total_cmp(&a.1.abs())));
    let Some((_, start, level)) = best else { return ClockDifference::none(origin) };
    let (mut offset, mut pairs, mut found) = (start, Vec::new(), 0);
    for near in &NEAR[level..] {
        let nearer = gaps(offset, *near);
        // Nearer than the logs agree at all there are only chance pairs.
        if nearer.is_empty() || 2 * nearer.len() < found {
            break;
        }
        found = nearer.len();
        offset += median(nearer.iter().map(|(_, gap)| *gap));
        pairs = gaps(offset, *near);
    }
    if pairs.is_empty() {
        return ClockDifference::none(origin);
    }
    let drift = drift(&pairs);
    let left: Vec<f64> = pairs.iter().map(|(at, gap)| gap - drift * at).collect();
    let middle = median(left.iter().copied());
    let spread = median(left.iter().map(|gap| (gap - middle).abs()));
    offset += middle;
    let zone = (offset / QUARTER).round() * QUARTER;
    let is_a_zone = zone != 0.0 && (offset - zone).abs() < 1.0 + 3.0 * spread;
    ClockDifference { offset, drift, origin, spread, orders: pairs.len(), is_a_zone }
}

/// The slope of gaps over time, where it is no chance: the median of slopes between pairs half the time apart (Theil, 1950; Sen,
/// Journal of the American Statistical Association 63 (1968)).
fn drift(pairs: &[(f64, f64)]) -> f64 {
    let half = pairs.len() / 2;
    if pairs.len() < FEWEST {
        return 0.0;
    }
    let slope = |((t0, g0), (t1, g1)): (&(f64, f64), &(f64, f64))| (t1 > t0).then(|| (g1 - g0) / (t1 - t0));
    let slopes: Vec<f64> = pairs.iter().zip(&pairs[half..]).filter_map(slope).collect();
    let rising = slopes.iter().filter(|slope| **slope > 0.0).count() as f64;
    let falling = slopes.iter().filter(|slope| **slope < 0.0).count() as f64;
    if (rising - falling).abs() < SURE * (rising + falling).sqrt() {
        return 0.0;
    }
    median(slopes.into_iter())
}

/// The middle of `values`; 0 of none.
pub(super) fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// When an order was decided [s], and how much of it there was.
type Stamp = (f64, Option<Quantity>);

/// The stamps of a log's orders, by what they trade and which way.
struct Stamps<'a> {
    of: HashMap<(&'a str, Side), Vec<Stamp>>,
}

impl<'a> Stamps<'a> {
    fn of(orders: &'a [Life], origin: Timestamp) -> Self {
        let mut of: HashMap<_, Vec<_>> = HashMap::new();
        for order in orders {
            let stamp = (order.at.seconds_since(origin), order.ordered);
            of.entry((order.symbol.as_str(), order.side)).or_default().push(stamp);
        }
        Self { of }
    }

    fn like<'b>(&'b self, order: &'b Life) -> &'b [Stamp] {
        self.of.get(&(order.symbol.as_str(), order.side)).map_or(&[], Vec::as_slice)
    }
}

/// An order of the backtest, and the stamps of those like it in the paper log.
struct Sampled<'a> {
    order: &'a Life,
    /// When it was decided [s].
    at: f64,
    like: &'a [Stamp],
}

impl Sampled<'_> {
    /// How much later than its own time and `offset` the nearest order like it is [s], where that is no more than `near`.
    fn gap(&self, offset: f64, near: f64) -> Option<f64> {
        let at = self.at + offset;
        let behind = self.like.partition_point(|(stamp, _)| *stamp < at);
        let around = [behind.checked_sub(1), Some(behind)].into_iter().flatten();
        let gaps = around.filter_map(|k| Some(self.like.get(k)?.0 - at));
        gaps.min_by(|a, b| a.abs().total_cmp(&b.abs())).filter(|gap| gap.abs() <= near)
    }

    /// How likely it is that an order like it lies within `near` [s] of a time by chance.
    fn by_chance(&self, near: f64) -> f64 {
        let (Some(first), Some(last)) = (self.like.first(), self.like.last()) else { return 0.0 };
        1.0 - (-2.0 * near * self.like.len() as f64 / (last.0 - first.0).max(2.0 * near)).exp()
    }
}

/// By how much orders of the same size lie apart most often, within an hour [s], in bins of `width` [s].
fn commonest(sample: &[Sampled<'_>], width: f64) -> Option<f64> {
    const REACH: f64 = 3_600.0;
    const MOST: usize = 400;
    let mut votes: BTreeMap<i64, usize> = BTreeMap::new();
    for Sampled { order, at, like } in sample.iter().step_by(sample.len().div_ceil(MOST).max(1)) {
        // Of many the nearest.
        let middle = like.partition_point(|(stamp, _)| stamp < at);
        let around = &like[middle.saturating_sub(MOST)..like.len().min(middle + MOST)];
        let near = around.iter().filter(|(stamp, quantity)| (stamp - at).abs() <= REACH && *quantity == order.ordered);
        for (stamp, _) in near {
            *votes.entry(((stamp - at) / width).round() as i64).or_default() += 1;
        }
    }
    votes.into_iter().max_by_key(|(bin, count)| (*count, -bin.abs())).map(|(bin, _)| bin as f64 * width)
}
