//! Orders as the market felt them, and the mid as it was shown.

use crate::market::Side;
use crate::sim2real::Timestamp;

/// An order as the market felt it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Felt {
    /// The last instant at which nothing of it was known.
    pub came_at: Timestamp,
    /// When it was executed last.
    pub done_at: Timestamp,
    /// Which way it traded.
    pub side: Side,
    /// What of it was executed [units].
    pub volume: f64,
}

/// The mid of a market over time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MidTrack {
    times: Vec<Timestamp>,
    mids: Vec<f64>,
}

impl MidTrack {
    /// Adds a mid [currency] that holds from `time` on. What comes out of order is left out.
    pub fn push(&mut self, time: Timestamp, mid: f64) {
        if self.times.last().is_none_or(|last| *last <= time) && mid > 0.0 && mid.is_finite() {
            self.times.push(time);
            self.mids.push(mid);
        }
    }

    /// The mid at `time` [currency]: the last that was shown by then. None before the first, and after the last, when nobody
    /// knows what came.
    #[must_use]
    pub fn at(&self, time: Timestamp) -> Option<f64> {
        if self.times.last().is_none_or(|last| *last < time) {
            return None;
        }
        let next = self.times.partition_point(|shown| *shown <= time);
        self.mids.get(next.checked_sub(1)?).copied()
    }

    /// How far the mid goes from `from` to `to`, with an order of `side` [bps].
    #[must_use]
    pub fn signed_move(&self, side: Side, from: Timestamp, to: Timestamp) -> Option<f64> {
        let (before, after) = (self.at(from)?, self.at(to)?);
        Some(side.sign() * (after - before) / before * 1e4)
    }

    /// From the first to the last [s].
    #[must_use]
    pub fn span(&self) -> f64 {
        self.times.first().zip(self.times.last()).map_or(0.0, |(first, last)| last.seconds_since(*first))
    }

    /// The first instant.
    pub(super) fn begin(&self) -> Timestamp {
        self.times.first().copied().unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mid_holds_until_the_next_and_nothing_is_known_beyond_the_last() {
        let mut track = MidTrack::default();
        for (time, mid) in [(10, 100.0), (20, 101.0), (15, 5.0), (20, 102.0), (30, f64::NAN), (40, 100.0)] {
            track.push(Timestamp(time), mid);
        }
        let at = |time| track.at(Timestamp(time));
        assert_eq!(
            (at(9), at(10), at(19), at(20), at(39), at(40)),
            (None, Some(100.0), Some(100.0), Some(102.0), Some(102.0), Some(100.0))
        );
        assert_eq!(at(41), None);
        assert_eq!(track.signed_move(Side::Sell, Timestamp(10), Timestamp(20)), Some(-200.0));
        assert!((track.span() - 3e-8).abs() < 1e-15 && MidTrack::default().span() == 0.0);
    }
}
