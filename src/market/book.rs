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

/// What an order pays that takes level after level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Walk {
    /// Price of the best level [currency].
    pub touch: f64,
    /// By how much its average price is worse than the touch [currency]; never negative.
    pub beyond_touch: f64,
    /// Whether it is larger than all that is displayed.
    pub exhausted: bool,
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

    /// What is displayed on the side an order of `side` takes from [units].
    #[must_use]
    pub fn displayed(&self, side: Side) -> f64 {
        self.opposite(side).iter().map(|level| level.size).sum()
    }

    /// An order of `side` over `quantity` [units] that takes level after level; none where that side is empty.
    ///
    /// An order larger than all that is displayed takes the rest at the last level: what lies behind it is not known.
    #[must_use]
    pub fn walk(&self, side: Side, quantity: f64) -> Option<Walk> {
        let levels = self.opposite(side);
        let touch = levels.first()?.price;
        let (mut left, mut excess, mut last) = (quantity, 0.0, touch);
        for level in levels {
            let taken = level.size.min(left);
            // Distances from the touch, not prices, are added up: an order within the touch pays it to the bit.
            excess += taken * (level.price - touch);
            last = level.price;
            left -= taken;
            if left <= 0.0 {
                break;
            }
        }
        let exhausted = left > 0.0;
        if exhausted {
            excess += left * (last - touch);
        }
        let beyond_touch = if quantity > 0.0 { side.sign() * excess / quantity } else { 0.0 };
        Some(Walk { touch, beyond_touch, exhausted })
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

#[cfg(test)]
mod tests {
    use super::*;

    fn book() -> Book {
        let level = |price, size| Level { price, size };
        Book::new(
            Timestamp(0),
            &[level(99.0, 10.0), level(98.0, 30.0)],
            &[level(101.0, 20.0), level(102.0, 20.0), level(105.0, 10.0)],
        )
    }

    fn walk(side: Side, quantity: f64) -> (f64, f64, bool) {
        let walk = book().walk(side, quantity).unwrap();
        (walk.touch, walk.beyond_touch, walk.exhausted)
    }

    #[test]
    fn a_walk_is_as_computed_by_hand() {
        assert_eq!(walk(Side::Buy, 20.0), (101.0, 0.0, false));
        // (20 * 101 + 20 * 102 + 10 * 105) / 50 = 102.2
        assert!((walk(Side::Buy, 50.0).1 - 1.2).abs() < 1e-12 && !walk(Side::Buy, 50.0).2);
        // 10 more at 105: 5110 + 1050 over 60 = 102.6667
        assert!((walk(Side::Buy, 60.0).1 - (6160.0 / 60.0 - 101.0)).abs() < 1e-12 && walk(Side::Buy, 60.0).2);
        // (10 * 99 + 10 * 98) / 20 = 98.5, half a unit worse than 99 for a seller.
        assert_eq!(walk(Side::Sell, 20.0), (99.0, 0.5, false));
        assert_eq!(book().displayed(Side::Sell), 40.0);
        assert_eq!(walk(Side::Buy, 0.0), (101.0, 0.0, false));
        assert!(Book::new(Timestamp(0), &[], &[]).walk(Side::Buy, 1.0).is_none());
    }

    #[test]
    fn a_book_at_one_price_is_never_exhausted() {
        let walk = Book::at_price(Timestamp(0), 50.0).walk(Side::Sell, 1e12).unwrap();
        assert_eq!((walk.touch, walk.beyond_touch, walk.exhausted), (50.0, 0.0, false));
    }
}
