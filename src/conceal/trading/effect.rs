//! What can be concealed in the way orders are executed, in the generator's own words and forms, all constants known.

use super::wake::Kernel;

/// Something between a decision and its fill that the twin leaves out.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Effect {
    /// A part of the half spread, to half ticks: rounded up or down by chance, so that the mean is right.
    Spread { fraction: f64 },
    /// Level after level of a book whose best level usually shows `usual` [units], and hides up to so much again at each.
    Walk { usual: f64, hidden: f64 },
    /// A concession of `bps` for an order of the middle size, and of other sizes by `growth`.
    Impact { bps: f64, growth: Growth },
    /// A displacement by `bps` for an order of the middle size, going as `(Q / middle)^power`, that goes on by `kernel`.
    Displacement { bps: f64, power: f64, kernel: Kernel },
    /// A fraction of the volatility of the last five minutes.
    Slippage { fraction: f64 },
    /// The way to the exchange: half the orders take at least `seconds`.
    Latency { seconds: f64, way: Way },
    /// What is charged, to the cent.
    Fee(Fee),
    /// At most so much of what is displayed, and that not exactly.
    Cap { fraction: f64, wobble: f64 },
    /// Whole lots [units].
    Lots { lot: f64 },
    /// Decisions are made on quotes of that age [s].
    Age { seconds: f64 },
    /// After an order that rested is filled the price goes against it by `bps` within a few times `time` [s].
    Toxic { bps: f64, time: f64 },
    /// Who rests stands behind so much more than is displayed, and that not exactly.
    Queue { ahead: f64, wobble: f64 },
    /// What no registry has.
    Foreign(Foreign),
}

/// How a concession grows with the size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Growth {
    /// `(Q / middle)^exponent`.
    Power(f64),
    /// `ln(1 + Q / size)`, with `size` in middle sizes.
    Logarithm(f64),
}

impl Growth {
    /// Of an order of `size` [middle sizes]; 1 at the middle.
    pub fn at(self, size: f64) -> f64 {
        match self {
            Self::Power(exponent) => size.powf(exponent),
            Self::Logarithm(scale) => (1.0 + size / scale).ln() / (1.0 + 1.0 / scale).ln(),
        }
    }

    /// In words.
    pub fn told(self) -> String {
        match self {
            Self::Power(exponent) => format!("Q^{exponent:.2}"),
            Self::Logarithm(scale) => format!("log(1 + Q / {scale:.2} of the middle size)"),
        }
    }
}

/// How latencies are distributed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Way {
    /// Lognormal, with this standard deviation of the logarithm.
    Lognormal(f64),
    /// The sum of two exponential ones.
    Twofold,
}

/// Fees of a broker.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Fee {
    /// Of the notional [bps].
    OfNotional(f64),
    /// Of each unit [currency].
    PerShare(f64),
    /// Of each unit, and at least so much an order [currency].
    Minimum(f64, f64),
    /// Of each order [currency].
    PerOrder(f64),
}

impl Fee {
    /// Of an order of so many units and that price [currency].
    pub fn of(self, quantity: f64, price: f64) -> f64 {
        match self {
            Self::OfNotional(bps) => 1e-4 * bps * quantity * price,
            Self::PerShare(amount) => amount * quantity,
            Self::Minimum(amount, least) => (amount * quantity).max(least),
            Self::PerOrder(amount) => amount,
        }
    }
}

/// What no registry has, so that the right answer is that something unknown is missing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Foreign {
    /// A cost that is high at the open and the close, and as much below its mean at noon [bps].
    TimeOfDay { bps: f64 },
    /// A dealer who looks again: what would have moved against it by more than `moved` [bps] within `look` [s] is refused.
    LastLook { moved: f64, look: f64 },
    /// Better prices where the touch is a multiple of `ticks`, worse ones elsewhere [bps].
    RoundPrices { bps: f64, ticks: i64 },
    /// A fee that falls by steps with what was traded so far on the day, from `bps` to an eighth of it.
    Turnover { bps: f64 },
    /// Others trade after each order, whatever its size: the price goes its way by `bps`, in about `time` [s].
    Followers { bps: f64, time: f64 },
    /// A cost that depends on where in a period [s] of the clock an order arrives [bps].
    ClockPhase { bps: f64, period: f64 },
    /// Purchases cost more than sales [bps].
    Side { bps: f64 },
    /// A cost that grows with what is displayed on the other side beside one's own [bps].
    Imbalance { bps: f64 },
}
