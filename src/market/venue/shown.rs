//! What the market shows of one instrument at the moment.

use crate::market::{Book, DepthBook, Level, Price, Reference, Side};
use crate::sim2real::Timestamp;

/// What the market shows of one instrument at the moment, as far as its data know.
#[allow(clippy::large_enum_variant, reason = "a quote is replaced at every row: it must not be allocated")]
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Shown {
    /// Nothing yet.
    Nothing,
    /// A quote, with as many levels as it has.
    Quote(Book),
    /// The whole book.
    Depth(Box<DepthBook>),
    /// The price of the last trade: the data know no more.
    Last(Price),
}

impl Shown {
    /// Best price an order of `side` can take.
    #[inline]
    pub fn touch(&self, side: Side) -> Option<f64> {
        match self {
            Self::Nothing => None,
            Self::Quote(book) => book.touch(side),
            Self::Depth(depth) => depth.best(side.opposite()).map(Price::to_f64),
            Self::Last(price) => Some(price.to_f64()),
        }
    }

    /// Best price an order of `side` can take, exactly.
    #[inline]
    pub fn touch_price(&self, side: Side) -> Option<Price> {
        match self {
            Self::Nothing => None,
            Self::Quote(book) => Price::nearest(book.touch(side)?).ok(),
            Self::Depth(depth) => depth.best(side.opposite()),
            Self::Last(price) => Some(*price),
        }
    }

    pub fn mid(&self) -> Option<f64> {
        Some(0.5 * (self.touch(Side::Buy)? + self.touch(Side::Sell)?))
    }

    /// The price mechanisms start from.
    pub fn reference(&self, reference: Reference, side: Side) -> Option<f64> {
        match reference {
            Reference::Mid => self.mid(),
            Reference::Touch => self.touch(side),
        }
    }

    /// What is displayed at `price` where an order of `side` would rest [units]: 0 inside the spread, and infinite where the
    /// data do not reach so far or know no sizes.
    pub fn displayed_at(&self, side: Side, price: Price) -> f64 {
        match self {
            Self::Nothing => 0.0,
            Self::Last(_) => f64::INFINITY,
            Self::Depth(depth) => depth.size(side, price),
            Self::Quote(book) => {
                let levels = book.opposite(side.opposite());
                let own = levels.iter().find(|level| Price::nearest(level.price) == Ok(price));
                let behind = levels.last().is_some_and(|last| side.sign() * (last.price - price.to_f64()) > 0.0);
                match own {
                    Some(level) => level.size,
                    None if behind => f64::INFINITY,
                    None => 0.0,
                }
            }
        }
    }

    /// What an order of `side` finds displayed at its limit or better [units]; without a limit, all there is.
    pub fn takable(&self, side: Side, limit: Option<Price>) -> f64 {
        let within = |level: &Level| limit.is_none_or(|limit| side.sign() * (level.price - limit.to_f64()) <= 1e-9);
        match self {
            Self::Nothing => 0.0,
            Self::Last(price) => {
                if within(&Level { price: price.to_f64(), size: 0.0 }) {
                    f64::INFINITY
                } else {
                    0.0
                }
            }
            Self::Quote(book) => book.opposite(side).iter().take_while(|l| within(l)).map(|l| l.size).sum(),
            Self::Depth(depth) => depth.levels(side.opposite()).take_while(within).map(|level| level.size).sum(),
        }
    }

    /// The book as laws see it: as many levels as they look at.
    pub fn book(&self, at: Timestamp) -> Book {
        match self {
            Self::Nothing => Book::new(at, &[], &[]),
            Self::Quote(book) => *book,
            Self::Last(price) => Book::at_price(at, price.to_f64()),
            Self::Depth(depth) => {
                let mut sides = [[Level::default(); Book::DEPTH]; 2];
                let mut counts = [0; 2];
                for ((side, levels), count) in [Side::Buy, Side::Sell].into_iter().zip(&mut sides).zip(&mut counts) {
                    for (own, level) in levels.iter_mut().zip(depth.levels(side)) {
                        *own = level;
                        *count += 1;
                    }
                }
                Book::new(at, &sides[0][..counts[0]], &sides[1][..counts[1]])
            }
        }
    }
}
