//! What was found on a tape: its orders, and how many rows could not be made into any, by reason.

use serde::Serialize;

use crate::market::{Level, Price, Print, Quantity, Side};
use crate::sim2real::Timestamp;

/// What kind of order somebody sent, as far as the tape tells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TapeOrderKind {
    /// All of it was executed when it came: whatever its limit, it did not bind.
    Market,
    /// Some of it was not executed when it came, for its limit bound it, or it was taken back [currency].
    Limit(Price),
}

/// One execution of an order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TapeFill {
    /// When.
    pub filled_at: Timestamp,
    /// Quantity [units].
    pub quantity: Quantity,
    /// Price [currency].
    pub price: Price,
}

/// Somebody's order that took what was displayed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TapeOrder {
    /// The name that the tape knows it by: the id of the order, or the number of its first trade.
    pub id: i64,
    /// Which way it trades.
    pub side: Side,
    /// Quantity [units]: all that was asked for where the tape tells it, else what was executed.
    pub quantity: Quantity,
    /// When it came. A nanosecond before its stamp, so that nothing of that stamp, which may be its own doing, is known to it.
    pub decided_at: Timestamp,
    /// What kind of order it was.
    pub kind: TapeOrderKind,
    /// Best bid and best ask strictly before it came [currency].
    pub touch: [Price; 2],
    /// Its executions, at least one, in order of time.
    pub fills: Vec<TapeFill>,
}

impl TapeOrder {
    /// What of it was executed [units].
    #[must_use]
    pub fn filled(&self) -> Quantity {
        Quantity(self.fills.iter().map(|fill| fill.quantity.0).fold(0, i64::saturating_add))
    }

    /// When it was executed last; when it came, where it was not.
    #[must_use]
    pub fn done_at(&self) -> Timestamp {
        self.fills.last().map_or(self.decided_at, |fill| fill.filled_at)
    }

    /// Where its first execution was beside the touch: `Less` where better, `Greater` where worse.
    #[must_use]
    pub fn first_fill_beside_touch(&self) -> std::cmp::Ordering {
        let [bid, ask] = self.touch;
        let Some(first) = self.fills.first() else { return std::cmp::Ordering::Equal };
        match self.side {
            Side::Buy => first.price.cmp(&ask),
            Side::Sell => bid.cmp(&first.price),
        }
    }
}

/// Where what is found on a tape goes, in order of time but for the orders: these come when they are done.
pub trait TapeSink {
    /// Why it can take no more.
    type Error;

    /// The book at `time`, once all of that stamp is in: levels of bids and asks, the best first.
    ///
    /// # Errors
    /// Where it can take no more.
    fn quote(&mut self, time: Timestamp, bids: &[Level], asks: &[Level]) -> Result<(), Self::Error>;

    /// A trade.
    ///
    /// # Errors
    /// Where it can take no more.
    fn print(&mut self, print: Print) -> Result<(), Self::Error>;

    /// An order.
    ///
    /// # Errors
    /// Where it can take no more.
    fn order(&mut self, order: TapeOrder) -> Result<(), Self::Error>;
}

/// Why what looks like an order, or a row, is left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum LeftOut {
    /// A trade of which nobody says who took.
    NoAggressor,
    /// A size or price beyond what exact numbers hold.
    Unfit,
    /// An order whose stamp is that of one before it: the book it met, which that one left, is not on the tape.
    SharedStamp,
    /// An order that comes so soon after a trade that the feed may not have told yet what that one left.
    TooSoon,
    /// An order before which the tape shows no book with two sides.
    NoBook,
    /// An order that was executed against one that is not in the file.
    UnknownCounterpart,
    /// An execution of a resting order without a taker in the file.
    UnknownTaker,
    /// An execution of an order that did not meet what was displayed when it came: the book is not complete.
    NotMarketable,
    /// An order that met the other side and was never executed.
    NotExecuted,
    /// An order that met, for seconds, resting orders that were never executed: the file does not tell that they left.
    Ghost,
    /// A trade before a gap in the numbers of trades, or after it: a part of the order may be missing.
    MissingTrade,
}

impl LeftOut {
    /// All there are.
    pub const ALL: [Self; 11] = [
        Self::NoAggressor,
        Self::Unfit,
        Self::SharedStamp,
        Self::TooSoon,
        Self::NoBook,
        Self::UnknownCounterpart,
        Self::UnknownTaker,
        Self::NotMarketable,
        Self::NotExecuted,
        Self::Ghost,
        Self::MissingTrade,
    ];

    /// What is counted.
    #[must_use]
    pub fn says(self) -> &'static str {
        match self {
            Self::NoAggressor => "trades that do not say who took",
            Self::Unfit => "trades with a price or a size that exact numbers do not hold",
            Self::SharedStamp => "orders of the stamp of a trade before them: the book they met is not on the tape",
            Self::TooSoon => "orders so soon after a trade that the feed may not have told yet what that left",
            Self::NoBook => "orders before which the tape shows no book with two sides",
            Self::UnknownCounterpart => "orders executed against orders that are not in the file",
            Self::UnknownTaker => "executions of resting orders without a taker in the file",
            Self::NotMarketable => "executions of orders that met nothing displayed when they came",
            Self::NotExecuted => "orders that met the other side, and were withdrawn or left unexecuted",
            Self::Ghost => {
                "resting orders that were met for seconds and never executed: the file does not tell that they left"
            }
            Self::MissingTrade => "orders beside a gap in the numbers of trades",
        }
    }
}

/// Counts of what was found on a tape.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct TapeCounts {
    /// Orders that were found, and could be used.
    pub orders: u64,
    /// Of them, those that were executed whole when they came.
    pub market: u64,
    /// Executions of these orders.
    pub fills: u64,
    /// Trades on the tape.
    pub prints: u64,
    /// Instants at which the book changed.
    pub quotes: u64,
    /// First executions better than the touch: a hidden order, or a book that is not complete.
    pub better_than_touch: u64,
    /// First executions at the touch.
    pub at_touch: u64,
    /// First executions worse than the touch: what was displayed had gone.
    pub worse_than_touch: u64,
    #[serde(skip)]
    left: [u64; LeftOut::ALL.len()],
}

#[cfg(feature = "io")]
impl TapeCounts {
    /// One more is left out.
    pub(super) fn leave(&mut self, why: LeftOut) {
        if let Some(count) = self.left.get_mut(why as usize) {
            *count += 1;
        }
    }

    /// How many were left out for this reason.
    #[must_use]
    pub fn left_out(&self, why: LeftOut) -> u64 {
        self.left.get(why as usize).copied().unwrap_or_default()
    }

    /// Counts an order that can be used.
    pub(super) fn take(&mut self, order: &TapeOrder) {
        self.orders += 1;
        self.market += u64::from(order.kind == TapeOrderKind::Market);
        self.fills += order.fills.len() as u64;
        *match order.first_fill_beside_touch() {
            std::cmp::Ordering::Less => &mut self.better_than_touch,
            std::cmp::Ordering::Equal => &mut self.at_touch,
            std::cmp::Ordering::Greater => &mut self.worse_than_touch,
        } += 1;
    }

    /// What a reader should know of what was left out, a line each.
    #[must_use]
    pub fn lines(&self) -> Vec<String> {
        let told = |why: &LeftOut| {
            let count = self.left_out(*why);
            (count > 0).then(|| format!("{}: {count}", why.says()))
        };
        LeftOut::ALL.iter().filter_map(told).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_reason_has_its_own_count() {
        for (number, why) in LeftOut::ALL.into_iter().enumerate() {
            assert_eq!(why as usize, number, "the counts go by number");
            let mut counts = TapeCounts::default();
            counts.leave(why);
            assert!(LeftOut::ALL.into_iter().all(|other| counts.left_out(other) == u64::from(other == why)));
            assert_eq!(counts.lines(), [format!("{}: 1", why.says())]);
        }
    }
}
