//! What became of orders, and what a log of them would show.

use super::tape::LEVELS;

/// The displayed book at an instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Shown {
    /// Since when [s after the open].
    pub time: f64,
    /// The row of the tape it comes of.
    pub row: usize,
    /// Best bid [ticks].
    pub bid: i64,
    /// Best offer [ticks].
    pub ask: i64,
}

impl Shown {
    /// Midway between bid and offer [ticks].
    pub fn mid(&self) -> f64 {
        0.5 * (self.bid + self.ask) as f64
    }

    /// The best price for one who takes [ticks].
    pub fn touch(&self, buys: bool) -> i64 {
        if buys { self.ask } else { self.bid }
    }
}

/// Sizes displayed on one side, best first [units].
pub(super) type Sizes = [f64; LEVELS];

/// A part of a fill.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Piece {
    /// When [s after the open].
    pub time: f64,
    /// How much [units].
    pub quantity: f64,
    /// At what price [ticks].
    pub price: f64,
}

/// What became of an order.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Execution {
    /// The book at the decision.
    pub decided: Shown,
    /// The book the client took for that.
    pub seen: Shown,
    /// The book it met.
    pub met: Shown,
    /// When it met it [s after the open].
    pub arrived: f64,
    /// Its fills; none where it was refused or lapsed.
    pub pieces: Vec<Piece>,
    /// What was charged [currency].
    pub fee: f64,
    /// By how much it displaced the price, its own way [bps].
    pub kick: f64,
}

impl Execution {
    /// How much was filled [units].
    pub fn filled(&self) -> f64 {
        self.pieces.iter().map(|piece| piece.quantity).sum()
    }

    /// Average price [ticks], where anything was filled.
    pub fn price(&self) -> Option<f64> {
        let filled = self.filled();
        let paid: f64 = self.pieces.iter().map(|piece| piece.quantity * piece.price).sum();
        (filled > 0.0).then(|| paid / filled)
    }
}

/// A trade as the tape prints it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Print {
    /// When [s after the open].
    pub time: f64,
    /// At what price [ticks].
    pub price: f64,
    /// Size [units].
    pub size: f64,
    /// Whether the one who took bought.
    pub bought: bool,
}

/// A day with the client's orders in it.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Outcome {
    /// What became of each order, in the order of decisions.
    pub executions: Vec<Execution>,
    /// Every book that was displayed.
    pub shown: Vec<Shown>,
    /// Every trade that was printed.
    pub prints: Vec<Print>,
}
