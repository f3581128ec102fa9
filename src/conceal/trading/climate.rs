//! What kind of market it is: how dear, how volatile, how wide, how deep.

use rand::{Rng, RngExt};

/// The smallest step of prices [currency].
pub(super) const TICK: f64 = 0.01;
/// Length of a session [s].
pub(super) const SESSION: f64 = 23_400.0;

/// A market, the client left out.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Climate {
    /// Price about which it begins [currency].
    pub level: f64,
    /// Standard deviation of the daily return (a fraction).
    pub volatility: f64,
    /// Usual spread [ticks].
    pub spread: f64,
    /// How much the spread varies; 0 for never.
    pub breathing: f64,
    /// What is added to the price of each change of the book alone [ticks].
    pub flicker: f64,
    /// Changes of the displayed book a second.
    pub rate: f64,
    /// Units traded a day.
    pub volume: f64,
    /// Trades a day.
    pub trades: f64,
}

impl Climate {
    /// A market in which orders of up to `largest` [units] are traded.
    pub fn draw(largest: f64, rng: &mut impl Rng) -> Self {
        let level = logarithmic(rng, 15.0, 300.0);
        let wide = logarithmic(rng, 1.5, 8.0);
        Self {
            level,
            volatility: logarithmic(rng, 0.007, 0.025),
            spread: (level * wide * 1e-4 / TICK).max(1.0),
            breathing: rng.random_range(0.2..0.5),
            flicker: 0.25,
            rate: logarithmic(rng, 0.7, 2.0),
            volume: largest * logarithmic(rng, 30.0, 300.0),
            trades: logarithmic(rng, 3_000.0, 9_000.0),
        }
    }
}

/// A number between `low` and `high`, evenly in its logarithm.
pub(super) fn logarithmic(rng: &mut impl Rng, low: f64, high: f64) -> f64 {
    low * (high / low).powf(rng.random::<f64>())
}
