//! Orders on their way to the market.

use crate::sim2real::{Command, DelayLine, Tick, Timestamp};

use serde::Serialize;

use super::{Multiplier, Price};

/// Which way an order trades.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Side {
    /// Takes from the asks.
    Buy,
    /// Takes from the bids.
    Sell,
}

impl Side {
    /// Its word in logs.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Buy => "buy",
            Self::Sell => "sell",
        }
    }

    /// The side `word` stands for: `buy` or `sell`, in any case.
    #[must_use]
    pub fn of_word(word: &str) -> Option<Self> {
        [Self::Buy, Self::Sell].into_iter().find(|side| word.eq_ignore_ascii_case(side.word()))
    }

    /// The side it trades with.
    #[must_use]
    pub fn opposite(self) -> Self {
        match self {
            Self::Buy => Self::Sell,
            Self::Sell => Self::Buy,
        }
    }

    /// Whether an order of this side with the limit `limit` may trade at `price`.
    #[must_use]
    pub fn accepts(self, price: Price, limit: Price) -> bool {
        match self {
            Self::Buy => price <= limit,
            Self::Sell => price >= limit,
        }
    }

    /// +1 for a buy, -1 for a sell.
    #[must_use]
    pub fn sign(self) -> f64 {
        match self {
            Self::Buy => 1.0,
            Self::Sell => -1.0,
        }
    }
}

/// As what an order meets the market: what it costs depends on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Role {
    /// It takes what others display, at once.
    #[default]
    Taker,
    /// It rests at its limit until others take it.
    Maker,
    /// No order at all: a position that is held, charged for the time since it was charged last.
    Holder,
    /// No order at all: a look at the market between orders.
    Watcher,
}

impl Role {
    /// Its word in logs.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Taker => "taker",
            Self::Maker => "maker",
            Self::Holder => "holder",
            Self::Watcher => "watcher",
        }
    }
}

/// An order between decision and fill: the command of the [execution](super::Execution) plant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InFlight {
    /// Which way it trades.
    pub side: Side,
    /// As what it meets the market.
    pub role: Role,
    /// How much of it is left to fill [units].
    pub quantity: f64,
    /// When it was decided.
    pub decided_at: Timestamp,
    /// When it meets the market.
    pub arrives_at: Timestamp,
    /// Until when whoever decided it had seen the market.
    pub seen_until: Timestamp,
    /// The price the twin assumes it fills at [currency].
    pub assumed: f64,
    /// The mid, or the nearest to it the data know, when it was decided [currency]: the unit of its costs in bps.
    pub mid: f64,
    /// The largest part of the volume it meets that it may take; infinite where nothing limits it.
    pub participation_limit: f64,
    /// Units of the underlying in one unit traded.
    pub multiplier: f64,
    /// Units traded on an average day, where known.
    pub average_daily_volume: Option<f64>,
    /// Standard deviation of the daily return (a fraction), where known.
    pub daily_volatility: Option<f64>,
    /// Standard deviation of the return over five minutes, as it was when the order was decided (a fraction), where known.
    pub recent_volatility: Option<f64>,
}

impl InFlight {
    /// A market order that arrives when it is decided, with nothing that limits it and nothing known of its
    /// instrument's volume and volatility.
    #[must_use]
    pub fn market(side: Side, quantity: f64, decided_at: Timestamp, assumed: f64, mid: f64) -> Self {
        Self {
            side,
            role: Role::Taker,
            quantity,
            decided_at,
            arrives_at: decided_at,
            seen_until: decided_at,
            assumed,
            mid,
            participation_limit: f64::INFINITY,
            multiplier: 1.0,
            average_daily_volume: None,
            daily_volatility: None,
            recent_volatility: None,
        }
    }

    /// The same order in another role.
    #[must_use]
    pub fn as_a(mut self, role: Role) -> Self {
        self.role = role;
        self
    }

    /// The same order of units that each are so many of the underlying.
    #[must_use]
    pub fn of(mut self, multiplier: Multiplier) -> Self {
        self.multiplier = multiplier.get() as f64;
        self
    }

    /// Whether it takes: what it takes it pays for.
    #[must_use]
    pub fn takes(&self) -> bool {
        self.role == Role::Taker
    }

    /// The same order, arriving at another time.
    #[must_use]
    pub fn arriving(mut self, at: Timestamp) -> Self {
        self.arrives_at = at;
        self
    }

    /// What of it can be filled where it meets `volume` [units].
    #[must_use]
    pub fn fillable(&self, volume: f64) -> f64 {
        // No limit is no limit, even where nothing is displayed: infinity times 0 is not a number.
        if self.participation_limit == f64::INFINITY {
            self.quantity
        } else {
            self.quantity.min(self.participation_limit * volume)
        }
    }

    /// Part of an average day's volume that it is where it meets `volume` [units]; 0 where a day's is not known.
    #[must_use]
    pub fn participation(&self, volume: f64) -> f64 {
        self.average_daily_volume.map_or(0.0, |daily| self.fillable(volume) / daily)
    }
}

impl Command for InFlight {
    type Line = Posted;
}

/// The delay of a message: it arrives later, and nothing else changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Posted;

impl DelayLine<InFlight> for Posted {
    fn pass(&mut self, _tick: Tick, seconds: f64, order: &mut InFlight) {
        order.arrives_at = order.arrives_at.plus_seconds(seconds);
    }
}
