//! Whether bars are known before the quotes of their last moment exist.

use serde::Serialize;

use crate::market::{Backtest, History};
use crate::sim2real::Timestamp;

/// Bars that agree with the quotes of a later time than the one they are said to be known at.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct KnownEarly {
    /// Symbol of the instrument.
    pub instrument: String,
    /// By how much the bars are known early [s]: their closes are those of quotes this much later.
    pub seconds: f64,
    /// Bars whose close is nearer to the mid that much later than to the mid when it is said to be known.
    pub nearer_later: usize,
    /// Bars of which the opposite is true.
    pub nearer_then: usize,
}

const HOUR: i64 = 3_600 * Timestamp::NANOS;

/// What of `backtest` is known early, and the symbols of which that cannot be told: those without both bars and quotes.
pub(super) fn known_early(backtest: &Backtest) -> (Vec<KnownEarly>, Vec<String>) {
    let (mut early, mut untold) = (Vec::new(), Vec::new());
    for (instrument, history) in backtest.instruments().iter().zip(backtest.histories()) {
        let symbol = instrument.symbol.clone();
        if history.bars().is_empty() {
            continue;
        }
        match history.quotes().is_empty() {
            true => untold.push(symbol),
            false => early.extend(worst(history).map(|(by, then, later)| KnownEarly {
                instrument: symbol,
                seconds: by as f64 / Timestamp::NANOS as f64,
                nearer_later: later,
                nearer_then: then,
            })),
        }
    }
    (early, untold)
}

/// The shift at which most closes agree better than where they stand, where that is beyond chance: by bars, because a
/// stamp may name the other end, and by hours, because of zones.
fn worst(history: &History) -> Option<(i64, usize, usize)> {
    let length = history.bars().iter().map(|bar| bar.known_at - bar.open_at).min()?;
    let shifts = [length, 2 * length].into_iter().chain((1..=12).map(|hours| hours * HOUR));
    let found = shifts.map(|by| {
        let (then, later) = votes(history, by);
        (by, then, later)
    });
    found.filter(|(_, then, later)| beyond_chance(*then, *later)).max_by_key(|(by, then, later)| (later - then, -by))
}

/// How many closes are nearer to the mid when the bar is said to be known, and how many to the mid `by` later [ns].
fn votes(history: &History, by: i64) -> (usize, usize) {
    let all = history.quotes().all();
    // What carries the stamp of a bar's end may belong to the next: the last quote before it is what the close was made in.
    let mid = |time: Timestamp| all.get(all.times().partition_point(|t| *t < time).checked_sub(1)?)?.mid();
    let (mut then, mut later) = (0, 0);
    let end = all.times().last().copied().unwrap_or_default();
    for bar in history.bars().iter().take_while(|bar| bar.known_at + by <= end) {
        let (Some(a), Some(b)) = (mid(bar.known_at), mid(bar.known_at + by)) else { continue };
        let distance = |mid: f64| (bar.close.to_f64() - mid).abs();
        match distance(a).total_cmp(&distance(b)) {
            std::cmp::Ordering::Less => then += 1,
            std::cmp::Ordering::Greater => later += 1,
            std::cmp::Ordering::Equal => {}
        }
    }
    (then, later)
}

/// Sign test: were either as likely, so many more would be found less than once in a million (5 sigma, one side).
fn beyond_chance(then: usize, later: usize) -> bool {
    let (then, later) = (then as f64, later as f64);
    later - then > 5.0 * (then + later).sqrt()
}
