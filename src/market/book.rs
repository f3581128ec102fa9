//! The book an order finds.

use crate::sim2real::Timestamp;

use super::Side;

/// A price and what is displayed at it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Level {
    /// Price [currency].
    pub price: f64,
    /// Displayed size [units]; infinite where the data do not know it.
    pub size: f64,
}

/// The displayed book at one instant: up to [`Book::DEPTH`] levels a side, the best first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Book {
    /// When it came to be.
    pub time: Timestamp,
    bids: [Level; Book::DEPTH],
    asks: [Level; Book::DEPTH],
    depth: [u8; 2],
}

impl Book {
    /// Most levels a side.
    pub const DEPTH: usize = 10;

    /// A book of the given levels, the best first; levels beyond [`Book::DEPTH`] are left out.
    #[must_use]
    pub fn new(time: Timestamp, bids: &[Level], asks: &[Level]) -> Self {
        let mut book = Self { time, bids: Default::default(), asks: Default::default(), depth: [0; 2] };
        for (side, (levels, own)) in [(bids, &mut book.bids), (asks, &mut book.asks)].into_iter().enumerate() {
            let count = levels.len().min(Self::DEPTH);
            own[..count].copy_from_slice(&levels[..count]);
            book.depth[side] = count as u8;
        }
        book
    }

    /// A book that offers any size at one price: all that is known where there are bars only.
    #[must_use]
    pub fn at_price(time: Timestamp, price: f64) -> Self {
        let level = [Level { price, size: f64::INFINITY }];
        Self::new(time, &level, &level)
    }

    /// The levels an order of `side` takes from, the best first.
    #[must_use]
    pub fn opposite(&self, side: Side) -> &[Level] {
        match side {
            Side::Buy => &self.asks[..usize::from(self.depth[1])],
            Side::Sell => &self.bids[..usize::from(self.depth[0])],
        }
    }

    /// The best price an order of `side` can take, where there is one.
    #[must_use]
    pub fn touch(&self, side: Side) -> Option<f64> {
        self.opposite(side).first().map(|level| level.price)
    }

    /// Midway between best bid and best ask, where there are both.
    #[must_use]
    pub fn mid(&self) -> Option<f64> {
        Some(0.5 * (self.touch(Side::Buy)? + self.touch(Side::Sell)?))
    }

    /// Half the distance between best bid and best ask [currency]; 0 where a side is empty.
    #[must_use]
    pub fn half_spread(&self) -> f64 {
        match (self.touch(Side::Buy), self.touch(Side::Sell)) {
            (Some(ask), Some(bid)) => 0.5 * (ask - bid),
            _ => 0.0,
        }
    }
}
