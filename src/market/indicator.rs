//! Indicators: figures made of prices as these become known, one at a time.
//!
//! Each is incremental: an update costs the same however long its window is, allocates nothing, and does not drift. Sums
//! over windows are kept in twice the precision of an `f64`, so that what enters and leaves them ten million times over
//! leaves an error of about 1e-24 of the largest sum held meanwhile; averages that forget (exponential, Wilder's) forget
//! their rounding errors too, which stay below their period times 1e-16.
//!
//! | indicator | of | gives |
//! |---|---|---|
//! | [`Sma`], [`Ema`], [`WilderAverage`] | numbers | an average |
//! | [`StandardDeviation`], [`ZScore`] | numbers | how much they vary, and how far off the last one is |
//! | [`Bollinger`] | numbers | a band of standard deviations about the mean |
//! | [`RollingMinimum`], [`RollingMaximum`] | numbers | the extremes of a window |
//! | [`RateOfChange`], [`Rsi`], [`Macd`] | prices | how they have moved |
//! | [`EwmaVolatility`] | returns | their volatility |
//! | [`Regression`], [`Correlation`] | pairs of numbers | how one goes with the other |
//! | [`Atr`], [`Adx`], [`Donchian`], [`Stochastic`] | bars | ranges and direction |
//! | [`Obv`], [`Vwap`], [`SessionVwap`] | prices and volumes, bars | where the volume went |

mod adx;
mod atr;
mod bollinger;
mod check;
mod co_moments;
mod correlation;
mod donchian;
mod double_double;
mod ema;
mod ewma_volatility;
mod macd;
mod obv;
mod period;
mod rate_of_change;
mod regression;
mod rolling_extreme;
mod rsi;
mod session_vwap;
mod sma;
mod standard_deviation;
mod stochastic;
mod vwap;
mod wilder_average;
mod window;
mod z_score;

pub use adx::{Adx, Direction};
pub use atr::{Atr, true_range};
pub use bollinger::{Bands, Bollinger};
pub use check::check_indicator;
pub use correlation::Correlation;
pub use donchian::{Channel, Donchian};
pub use ema::Ema;
pub use ewma_volatility::EwmaVolatility;
pub use macd::{Convergence, Macd};
pub use obv::Obv;
pub use period::{IndicatorError, Period};
pub use rate_of_change::RateOfChange;
pub use regression::{Line, Regression};
pub use rolling_extreme::{RollingMaximum, RollingMinimum};
pub use rsi::Rsi;
pub use session_vwap::SessionVwap;
pub use sma::Sma;
pub use standard_deviation::StandardDeviation;
pub use stochastic::{Oscillator, Stochastic};
pub use vwap::Vwap;
pub use wilder_average::WilderAverage;
pub use z_score::ZScore;

/// A figure made of what becomes known, one input at a time.
///
/// # Contract
/// - [`update`](Self::update) takes a finite input of size [`LARGEST`] at most and gives the value it leads to, which is
///   what [`value`](Self::value) gives until the next input. Any other input is refused: the answer is `None`, and the
///   indicator stays as it was, to the bit.
/// - There is no value before [`is_ready`](Self::is_ready), nor where the definition divides by 0.
/// - Once ready it stays ready, until a [`reset`](Self::reset), after which it is as new.
/// - Same inputs, same bits.
///
/// [`check_indicator`] runs it.
pub trait Indicator {
    /// What it takes.
    type Input: Copy;
    /// What it gives.
    type Output: Copy + PartialEq;

    /// Takes an input, and gives the value after it.
    fn update(&mut self, input: Self::Input) -> Option<Self::Output>;

    /// The value after the last input taken.
    fn value(&self) -> Option<Self::Output>;

    /// Whether it has seen as many inputs as its definition takes.
    fn is_ready(&self) -> bool;

    /// Forgets all it has seen.
    fn reset(&mut self);
}

/// Largest size of a number an indicator takes: its fourth power, times a million squared, is a number still.
pub const LARGEST: f64 = 1e60;

/// Whether `number` is one that indicators take: a NaN is not.
fn is_taken(number: f64) -> bool {
    number.abs() <= LARGEST
}
