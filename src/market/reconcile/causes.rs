//! What made the difference: the gap of two orders' worth, split into causes that sum to it to the last unit.

use serde::Serialize;

use crate::market::{Cash, MoneyError, Price, Quantity};
use crate::sim2real::Timestamp;

use super::{Life, Showing};

/// What made a difference.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Cause {
    /// One of the two did not decide it at all.
    Signal,
    /// It was decided at another time or on other data, and so at another price.
    Data,
    /// Another quantity was ordered.
    Sizing,
    /// More or less of it was filled, or a resting order was filled at another price.
    QueueFill,
    /// The market moved between decision and execution.
    Latency,
    /// The quoted half spread was paid.
    Spread,
    /// Price beyond the best quote.
    Impact,
    /// Fees.
    Fees,
    /// Price of execution, where the data do not know quotes: latency, spread and impact together.
    Price,
}

impl Cause {
    /// All there are, in the order in which they come about.
    pub const ALL: [Self; 9] = [
        Self::Signal,
        Self::Data,
        Self::Sizing,
        Self::QueueFill,
        Self::Latency,
        Self::Spread,
        Self::Impact,
        Self::Price,
        Self::Fees,
    ];

    /// Its word in files.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Signal => "signal",
            Self::Data => "data",
            Self::Sizing => "sizing",
            Self::QueueFill => "queue_fill",
            Self::Latency => "latency",
            Self::Spread => "spread",
            Self::Impact => "impact",
            Self::Price => "price",
            Self::Fees => "fees",
        }
    }

    /// What it is, in words.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Self::Signal => "orders that only one of the two decided",
            Self::Data => "decided at another time, or on other prices",
            Self::Sizing => "another quantity ordered",
            Self::QueueFill => "more or less filled, resting orders filled at other prices",
            Self::Latency => "the market moved between decision and execution",
            Self::Spread => "half spread paid",
            Self::Impact => "paid beyond the best quote",
            Self::Price => {
                "price of execution: latency, spread and impact together, for there are no quotes to tell them apart"
            }
            Self::Fees => "fees",
        }
    }
}

/// An amount for each cause, in the order of [`Cause::ALL`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Split([Cash; Cause::ALL.len()]);

impl Split {
    /// That of one cause.
    #[must_use]
    pub fn of(&self, cause: Cause) -> Cash {
        self.0[place(cause)]
    }

    /// The sum.
    ///
    /// # Errors
    /// If 128 bits do not hold it.
    pub fn total(&self) -> Result<Cash, MoneyError> {
        self.0.iter().try_fold(Cash::ZERO, |sum, amount| sum.plus(*amount))
    }

    pub(super) fn add(&mut self, cause: Cause, amount: Cash) -> Result<(), MoneyError> {
        let own = &mut self.0[place(cause)];
        *own = own.plus(amount)?;
        Ok(())
    }

    pub(super) fn merge(&mut self, other: &Self) -> Result<(), MoneyError> {
        Cause::ALL.into_iter().try_for_each(|cause| self.add(cause, other.of(cause)))
    }
}

fn place(cause: Cause) -> usize {
    Cause::ALL.iter().position(|other| *other == cause).unwrap_or_default()
}

/// The gap between two executions of the same decision: worth of `after` less worth of `before`, with their instrument at `mark`.
///
/// What was filled differently counts at what `before` made of a unit; fees at its rate; the rest is the price. That is split
/// by what the market showed when each was decided and executed, where it is known: latency is how far the mid went between
/// the two, spread what was paid beyond the mid up to the best quote, impact what is left.
pub(super) fn of_execution(
    before: &Life,
    after: &Life,
    mark: Price,
    showing: &dyn Showing,
    split: &mut Split,
) -> Result<(), MoneyError> {
    let Some(parts) = Parts::of(before, after, mark)? else {
        let gap = after.worth(mark)?.minus(before.worth(mark)?)?;
        return split.add(Cause::QueueFill, gap);
    };
    split.add(Cause::QueueFill, parts.sizing.plus(parts.filled)?)?;
    split.add(Cause::Fees, parts.fees)?;
    // At the same price nothing made a difference, whatever the stamps say of when it was.
    if parts.price == Cash::ZERO {
        return Ok(());
    }
    if before.rests() || after.rests() {
        return split.add(Cause::QueueFill, parts.price);
    }
    let (Some(was), Some(is)) = (Course::of(before, showing), Course::of(after, showing)) else {
        return split.add(Cause::Price, parts.price);
    };
    let units = after.underlying();
    let latency = Cash::nearest(units * (was.moved - is.moved))?;
    let spread = Cash::nearest(units * (was.spread - is.spread))?;
    split.add(Cause::Latency, latency)?;
    split.add(Cause::Spread, spread)?;
    split.add(Cause::Impact, parts.price.minus(latency)?.minus(spread)?)
}

/// The gap between two decisions that are one: `after` as the same simulator would have executed it, less `before`.
pub(super) fn of_decision(before: &Life, after: &Life, mark: Price, split: &mut Split) -> Result<(), MoneyError> {
    let gap = after.worth(mark)?.minus(before.worth(mark)?)?;
    let sizing = Parts::of(before, after, mark)?.map_or(Cash::ZERO, |parts| parts.sizing);
    split.add(Cause::Sizing, sizing)?;
    split.add(Cause::Data, gap.minus(sizing)?)
}

/// A gap where nobody knows how the simulator would have executed the second order: decision and execution in one.
pub(super) fn of_both(
    before: &Life,
    after: &Life,
    mark: Price,
    showing: &dyn Showing,
    split: &mut Split,
) -> Result<(), MoneyError> {
    let mut own = Split::default();
    of_execution(before, after, mark, showing, &mut own)?;
    if let Some(parts) = Parts::of(before, after, mark)? {
        own.add(Cause::Sizing, parts.sizing)?;
        own.add(Cause::QueueFill, Cash::ZERO.minus(parts.sizing)?)?;
        let mids = |life: &Life| showing.mid(&life.symbol, life.at);
        let told = parts.price != Cash::ZERO && !before.rests() && !after.rests();
        if let (Some(was), Some(is), true) = (mids(before), mids(after), told) {
            // The order was decided where the mid was another; what followed counts from there.
            let moved = after.side.sign() * (was - is) * after.underlying();
            let data = Cash::nearest(moved)?;
            let from = if own.of(Cause::Price) == Cash::ZERO { Cause::Impact } else { Cause::Price };
            own.add(Cause::Data, data)?;
            own.add(from, Cash::ZERO.minus(data)?)?;
        }
    }
    split.merge(&own)
}

/// A gap by what was filled, by fees and by price, exactly.
struct Parts {
    sizing: Cash,
    filled: Cash,
    fees: Cash,
    price: Cash,
}

impl Parts {
    /// None where one of the two was not filled at all.
    fn of(before: &Life, after: &Life, mark: Price) -> Result<Option<Self>, MoneyError> {
        if before.filled <= Quantity::ZERO || after.filled <= Quantity::ZERO {
            return Ok(None);
        }
        let (was, is) = (before.worth(mark)?, after.worth(mark)?);
        let scaled = match (before.ordered, after.ordered) {
            (Some(a), Some(b)) if a != b && a > Quantity::ZERO => {
                let units = share(Cash(b.0.into()), before.filled, a)?.0;
                Quantity(i64::try_from(units).map_err(|_| MoneyError::Overflow)?)
            }
            _ => before.filled,
        };
        let sizing = share(was, scaled - before.filled, before.filled)?;
        let filled = share(was, after.filled - scaled, before.filled)?;
        let fees = share(before.fees, after.filled, before.filled)?.minus(after.fees)?;
        let price = is.minus(was)?.minus(sizing)?.minus(filled)?.minus(fees)?;
        Ok(Some(Self { sizing, filled, fees, price }))
    }
}

/// `amount * part / whole`, rounded towards 0 to its last unit.
fn share(amount: Cash, part: Quantity, whole: Quantity) -> Result<Cash, MoneyError> {
    let (part, whole) = (i128::from(part.0), i128::from(whole.0));
    let (each, over) = (amount.0 / whole, amount.0 % whole);
    let whole_part = each.checked_mul(part).ok_or(MoneyError::Overflow)?;
    Cash(whole_part).plus(Cash(over * part / whole))
}

/// How the market went while an order was executed, on average over what was filled; against the order positive.
struct Course {
    /// From the mid at decision to that at execution [currency].
    moved: f64,
    /// What was paid beyond the mid at execution, up to the best quote [currency].
    spread: f64,
}

impl Course {
    fn of(life: &Life, showing: &dyn Showing) -> Option<Self> {
        let decided = showing.mid(&life.symbol, life.at)?;
        let (mut moved, mut spread, sign) = (0.0, 0.0, life.side.sign());
        for piece in &life.pieces {
            let part = piece.quantity.to_f64() / life.filled.to_f64();
            let mid = showing.mid(&life.symbol, piece.at)?;
            moved += part * sign * (mid - decided);
            let beyond = sign * (piece.price.to_f64() - mid);
            spread += part * beyond.min(showing.half_spread(&life.symbol, piece.at)?);
        }
        Some(Self { moved, spread })
    }
}

/// The last price of each symbol in either log, which stands in for a mark where no data are known.
pub(super) fn last_price(symbol: &str, logs: [&[Life]; 2]) -> Option<Price> {
    let pieces = logs.into_iter().flatten().filter(|life| life.symbol == symbol).flat_map(|life| &life.pieces);
    pieces.max_by_key(|piece| (piece.at, piece.price)).map(|piece| piece.price)
}

/// Nothing is known of the market.
#[derive(Debug, Clone, Copy)]
pub(super) struct Unknown;

impl Showing for Unknown {
    fn mid(&self, _: &str, _: Timestamp) -> Option<f64> {
        None
    }
    fn half_spread(&self, _: &str, _: Timestamp) -> Option<f64> {
        None
    }
    fn band(&self, _: &str, _: Timestamp, _: Timestamp) -> Option<[Price; 2]> {
        None
    }
    fn last(&self, _: &str) -> Option<Price> {
        None
    }
}
