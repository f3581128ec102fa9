//! The whole book of one instrument, kept level by level as changes come.

use std::collections::BTreeMap;

use super::{DepthAction, DepthChange, Increments, Level, Price, Side};

/// What is displayed on both sides, at every price the data have named.
///
/// Levels near the best are kept in an array of ticks beside a map of bits, so that the next best level is found by words of
/// 64 ticks; those further off are kept in a tree. A change costs a few ns wherever it is.
#[derive(Debug, Clone, PartialEq)]
pub struct DepthBook {
    tick: i64,
    /// Ticks in one unit of price.
    per_unit: f64,
    bids: Ladder,
    asks: Ladder,
    /// Which side was changed last: where sides cross, the other one is out of date.
    newest: Side,
    crossed: u64,
}

impl DepthBook {
    /// An empty book of prices in ticks of `increments`.
    #[must_use]
    pub fn new(increments: Increments) -> Self {
        Self {
            tick: increments.tick().0,
            per_unit: 1.0 / increments.tick().0 as f64,
            bids: Ladder::new(Side::Buy),
            asks: Ladder::new(Side::Sell),
            newest: Side::Buy,
            crossed: 0,
        }
    }

    /// Takes in a change; a price between ticks counts to the nearest.
    #[inline]
    pub fn apply(&mut self, change: &DepthChange) {
        let tick = self.tick_of(change.price);
        self.newest = change.side;
        let ladder = self.side_mut(change.side);
        match change.action {
            DepthAction::Set => ladder.set(tick, change.size),
            DepthAction::Clear => ladder.clear(),
        }
    }

    /// Adds `by` [units] to what is displayed at a price, which never falls below 0: what by-order data do to the level.
    #[inline]
    pub fn add(&mut self, side: Side, price: Price, by: f64) {
        let tick = self.tick_of(price);
        self.newest = side;
        let ladder = self.side_mut(side);
        let size = ladder.size(tick) + by;
        // What is left of a sum of sizes that were taken away again is rounding.
        ladder.set(tick, if size > 1e-9 * by.abs() { size } else { 0.0 });
    }

    /// Takes away the levels of the side that is out of date where the sides cross: a level that a newer one crosses is gone.
    /// To be called when all changes of an instant are in.
    #[inline]
    pub fn settle(&mut self) {
        while let (Some(bid), Some(ask)) = (self.bids.best, self.asks.best)
            && bid >= ask
        {
            self.crossed += 1;
            match self.newest {
                Side::Buy => self.asks.set(ask, 0.0),
                Side::Sell => self.bids.set(bid, 0.0),
            }
        }
    }

    /// How many levels were taken away because a newer one crossed them.
    #[must_use]
    pub fn crossed(&self) -> u64 {
        self.crossed
    }

    /// The best price displayed on `side` (bids: [`Side::Buy`]).
    #[inline]
    #[must_use]
    pub fn best(&self, side: Side) -> Option<Price> {
        self.side(side).best.map(|tick| self.price(tick))
    }

    /// What is displayed on `side` at `price` [units].
    #[inline]
    #[must_use]
    pub fn size(&self, side: Side, price: Price) -> f64 {
        self.side(side).size(self.tick_of(price))
    }

    /// Levels of `side`, the best first.
    pub fn levels(&self, side: Side) -> impl Iterator<Item = Level> {
        self.side(side).iter().map(|(tick, size)| Level { price: self.price(tick).to_f64(), size })
    }

    /// The tick nearest to a price. A division of integers takes longer than all else that a change does, so the quotient is
    /// guessed in floating point, within a few of what it is, and put right.
    #[inline]
    fn tick_of(&self, price: Price) -> i64 {
        let mut whole = (price.0 as f64 * self.per_unit) as i64;
        let mut rest = price.0.wrapping_sub(whole.wrapping_mul(self.tick));
        while rest < 0 {
            (whole, rest) = (whole - 1, rest + self.tick);
        }
        while rest >= self.tick {
            (whole, rest) = (whole + 1, rest - self.tick);
        }
        whole + i64::from(rest >= self.tick - rest)
    }

    fn price(&self, tick: i64) -> Price {
        Price(tick.saturating_mul(self.tick))
    }

    fn side(&self, side: Side) -> &Ladder {
        match side {
            Side::Buy => &self.bids,
            Side::Sell => &self.asks,
        }
    }

    fn side_mut(&mut self, side: Side) -> &mut Ladder {
        match side {
            Side::Buy => &mut self.bids,
            Side::Sell => &mut self.asks,
        }
    }
}

/// Ticks in the array of a side: a power of two.
const REACH: i64 = 8_192;
/// Ticks of it that are better than the best when the array is laid anew.
const HEADROOM: i64 = REACH / 4;

/// One side. Ranks count outward: a lower rank is a better price on either side.
#[derive(Debug, Clone, PartialEq)]
struct Ladder {
    side: Side,
    /// Rank of the first entry of the array.
    base: i64,
    sizes: Vec<f64>,
    occupied: Vec<u64>,
    /// Levels worse than those of the array, by rank.
    far: BTreeMap<i64, f64>,
    /// Tick of the best level.
    best: Option<i64>,
}

impl Ladder {
    fn new(side: Side) -> Self {
        Self { side, base: 0, sizes: Vec::new(), occupied: Vec::new(), far: BTreeMap::new(), best: None }
    }

    /// Rank of a tick, and the tick of a rank.
    #[inline]
    fn turn(&self, tick: i64) -> i64 {
        match self.side {
            Side::Buy => tick.saturating_neg(),
            Side::Sell => tick,
        }
    }

    fn size(&self, tick: i64) -> f64 {
        let rank = self.turn(tick);
        match self.place(rank) {
            Some(place) => self.sizes[place],
            None => self.far.get(&rank).copied().unwrap_or(0.0),
        }
    }

    #[inline]
    fn place(&self, rank: i64) -> Option<usize> {
        let place = rank.wrapping_sub(self.base);
        (0 <= place && place < self.sizes.len() as i64).then_some(place as usize)
    }

    #[inline]
    fn set(&mut self, tick: i64, size: f64) {
        let rank = self.turn(tick);
        if size > 0.0 && (self.sizes.is_empty() || rank < self.base) {
            self.lay(rank);
        }
        let Some(place) = self.place(rank) else {
            // Beyond the array: worse than all in it, or a level that was never there.
            if size > 0.0 {
                self.far.insert(rank, size);
            } else {
                self.far.remove(&rank);
            }
            if self.best.is_none() {
                self.find_from(0);
            }
            return;
        };
        let (word, bit) = (place / 64, 1_u64 << (place % 64));
        if size > 0.0 {
            self.sizes[place] = size;
            self.occupied[word] |= bit;
            if self.best.is_none_or(|best| rank < self.turn(best)) {
                self.best = Some(tick);
            }
        } else {
            self.sizes[place] = 0.0;
            self.occupied[word] &= !bit;
            if self.best == Some(tick) {
                self.find_from(place);
            }
        }
    }

    /// Finds the best level at or behind a place of the array.
    fn find_from(&mut self, place: usize) {
        let mut word = place / 64;
        while let Some(bits) = self.occupied.get(word) {
            if *bits != 0 {
                let rank = self.base + (word * 64) as i64 + i64::from(bits.trailing_zeros());
                self.best = Some(self.turn(rank));
                return;
            }
            word += 1;
        }
        match self.far.first_key_value().map(|(rank, _)| *rank) {
            Some(rank) => {
                self.lay(rank);
                self.best = Some(self.turn(rank));
            }
            None => self.best = None,
        }
    }

    /// Lays the array anew, so that `rank` is in it with room for better ones.
    fn lay(&mut self, rank: i64) {
        let old: Vec<(i64, f64)> = self.near().collect();
        self.far.extend(old);
        self.base = rank.saturating_sub(HEADROOM);
        self.sizes.clear();
        self.sizes.resize(REACH as usize, 0.0);
        self.occupied.clear();
        self.occupied.resize(REACH as usize / 64, 0);
        let behind = self.far.split_off(&self.base.saturating_add(REACH));
        for (rank, size) in std::mem::replace(&mut self.far, behind) {
            if let Some(place) = self.place(rank) {
                self.sizes[place] = size;
                self.occupied[place / 64] |= 1 << (place % 64);
            }
        }
    }

    fn clear(&mut self) {
        self.far.clear();
        for word in 0..self.occupied.len() {
            if self.occupied[word] != 0 {
                self.sizes[word * 64..(word + 1) * 64].fill(0.0);
                self.occupied[word] = 0;
            }
        }
        self.best = None;
    }

    /// Ranks and sizes within the array, the best first.
    fn near(&self) -> impl Iterator<Item = (i64, f64)> {
        self.occupied.iter().enumerate().filter(|(_, bits)| **bits != 0).flat_map(move |(word, bits)| {
            let bits = *bits;
            (0..64).filter(move |bit| bits >> bit & 1 == 1).map(move |bit| {
                let place = word * 64 + bit;
                (self.base + place as i64, self.sizes[place])
            })
        })
    }

    /// Ticks and sizes, the best first.
    fn iter(&self) -> impl Iterator<Item = (i64, f64)> {
        self.near().chain(self.far.iter().map(|(rank, size)| (*rank, *size))).map(|(rank, size)| (self.turn(rank), size))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::market::Instrument;
    use crate::sim2real::Timestamp;
    use proptest::prelude::*;

    fn book() -> DepthBook {
        let instrument = Instrument {
            symbol: "X".into(),
            tick_size: 0.1,
            lot_size: 1.0,
            average_daily_volume: None,
            daily_volatility: None,
        };
        DepthBook::new(Increments::of(&instrument).unwrap())
    }

    fn change(side: Side, tick: i64, size: f64) -> DepthChange {
        let price = Price(tick * 100_000_000);
        DepthChange { time: Timestamp(0), known_at: Timestamp(0), side, action: DepthAction::Set, price, size }
    }

    #[test]
    fn a_level_that_a_newer_one_crosses_is_gone() {
        let mut book = book();
        book.apply(&change(Side::Buy, 100, 5.0));
        book.apply(&change(Side::Sell, 101, 5.0));
        book.apply(&change(Side::Sell, 103, 5.0));
        book.apply(&change(Side::Buy, 102, 1.0));
        book.settle();
        assert_eq!(
            (book.best(Side::Buy), book.best(Side::Sell)),
            (Some(Price(10_200_000_000)), Some(Price(10_300_000_000)))
        );
        assert_eq!(book.crossed(), 1);
    }

    #[test]
    fn what_orders_add_and_take_leaves_nothing_behind() {
        let mut book = book();
        let price = Price(10_000_000_000);
        for size in [0.1, 0.2, 0.3] {
            book.add(Side::Buy, price, size);
        }
        for size in [0.3, 0.1, 0.2] {
            book.add(Side::Buy, price, -size);
        }
        assert_eq!((book.best(Side::Buy), book.size(Side::Buy, price)), (None, 0.0));
    }

    proptest! {
        /// Whatever comes, it is as a plain map of prices would have it, however far levels lie apart.
        #[test]
        fn a_book_is_a_map_of_prices(steps in proptest::collection::vec(
            (any::<bool>(), prop_oneof![-50..50_i64, -30_000..30_000_i64, -5_000_000..5_000_000_i64], 0..4_u8, 0..200_u8), 1..300)
        ) {
            let mut book = book();
            let mut plain = [BTreeMap::<i64, f64>::new(), BTreeMap::new()];
            for (buy, tick, size, clears) in steps {
                let side = if buy { Side::Buy } else { Side::Sell };
                let own = &mut plain[usize::from(!buy)];
                if clears == 0 {
                    book.apply(&DepthChange { action: DepthAction::Clear, ..change(side, tick, 0.0) });
                    own.clear();
                } else {
                    book.apply(&change(side, tick, f64::from(size)));
                    if size > 0 { own.insert(tick, f64::from(size)); } else { own.remove(&tick); }
                }
                let [bids, asks] = &plain;
                let price = |tick: &i64| Price(tick * 100_000_000);
                prop_assert_eq!(book.best(Side::Buy), bids.last_key_value().map(|(tick, _)| price(tick)));
                prop_assert_eq!(book.best(Side::Sell), asks.first_key_value().map(|(tick, _)| price(tick)));
                prop_assert_eq!(book.size(side, price(&tick)), plain[usize::from(!buy)].get(&tick).copied().unwrap_or(0.0));
            }
            let found: Vec<f64> = book.levels(Side::Buy).map(|level| level.size).collect();
            prop_assert_eq!(found, plain[0].values().rev().copied().collect::<Vec<_>>());
            let found: Vec<f64> = book.levels(Side::Sell).map(|level| level.size).collect();
            prop_assert_eq!(found, plain[1].values().copied().collect::<Vec<_>>());
        }
    }
}
