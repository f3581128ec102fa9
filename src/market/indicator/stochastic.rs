//! Lane's stochastic oscillator.

use crate::market::Bar;

use super::{Donchian, Indicator, Period, Sma};

/// Lane's stochastic oscillator, from 0 to 100: where the close lies between the lowest low and the highest high of the
/// last `period` bars, smoothed to %K and again to %D by simple averages; 14, 3 and 3 are usual, and a smoothing of 1 for
/// %K is the fast stochastic (G. C. Lane, "Lane's stochastics", Stocks & Commodities 2, 1984).
///
/// Where all of them have one price the close lies nowhere: such a bar does not count for the averages.
#[derive(Debug, Clone, PartialEq)]
pub struct Stochastic {
    channel: Donchian,
    slow: Sma,
    signal: Sma,
}

/// What [`Stochastic`] gives, each from 0 to 100.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Oscillator {
    /// %K.
    pub k: f64,
    /// %D, the average of %K.
    pub d: f64,
}

impl Stochastic {
    /// The oscillator over `period` bars, with %K smoothed over `slow` bars and %D over `signal` of these.
    #[must_use]
    pub fn new(period: Period, slow: Period, signal: Period) -> Self {
        Self { channel: Donchian::new(period), slow: Sma::new(slow), signal: Sma::new(signal) }
    }
}

impl Indicator for Stochastic {
    type Input = Bar;
    type Output = Oscillator;

    #[inline]
    fn update(&mut self, input: Bar) -> Option<Oscillator> {
        let channel = self.channel.update(input)?;
        let reach = channel.upper - channel.lower;
        if reach > 0.0
            && let Some(k) = self.slow.update(100.0 * (input.close.to_f64() - channel.lower) / reach)
        {
            self.signal.update(k);
        }
        self.value()
    }

    fn value(&self) -> Option<Oscillator> {
        Some(Oscillator { k: self.slow.value()?, d: self.signal.value()? })
    }

    fn is_ready(&self) -> bool {
        self.signal.is_ready()
    }

    fn reset(&mut self) {
        self.channel.reset();
        self.slow.reset();
        self.signal.reset();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::market::Price;
    use crate::sim2real::Timestamp;

    #[test]
    fn where_the_close_lies_in_the_channel() {
        let bar = |high: i64, low: i64, close: i64| {
            let [high, low, close] = [high, low, close].map(|p| Price(p * 1_000_000_000));
            Bar { open_at: Timestamp(0), known_at: Timestamp(1), open: close, high, low, close, volume: 0.0 }
        };
        let [one, two] = [1, 2].map(|n| Period::new(n).unwrap());
        let mut stochastic = Stochastic::new(two, one, two);
        let bars = [bar(10, 10, 10), bar(10, 10, 10), bar(14, 10, 13), bar(14, 12, 12), bar(20, 10, 20)];
        let values = bars.map(|bar| stochastic.update(bar));
        // 75, 50 and 100; the two bars of one price do not count.
        assert_eq!(values[..3], [None; 3]);
        assert_eq!(values[3..], [Some(Oscillator { k: 50.0, d: 62.5 }), Some(Oscillator { k: 100.0, d: 75.0 })]);
    }
}
