//! Moving average convergence and divergence.

use super::{Ema, Indicator, IndicatorError, Period};

/// Moving average convergence and divergence: a fast exponential average less a slow one, and an exponential average of
/// that, the signal; 12, 26 and 9 are usual (G. Appel, Technical Analysis: Power Tools for Active Investors, 2005).
///
/// As in TA-Lib the fast average begins late, on the `fast` numbers before both can be had: both then begin on the same.
#[derive(Debug, Clone, PartialEq)]
pub struct Macd {
    fast: Ema,
    slow: Ema,
    signal: Ema,
    /// Numbers the fast average lets go by, and those it still has to.
    late: usize,
    wait: usize,
    value: Option<Convergence>,
}

/// What [`Macd`] gives, in the unit of the numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Convergence {
    /// The fast average less the slow one.
    pub line: f64,
    /// The average of the line.
    pub signal: f64,
    /// The line less its signal.
    pub histogram: f64,
}

impl Macd {
    /// Averages of the given periods.
    ///
    /// # Errors
    /// If the slow one is not above the fast one.
    pub fn new(fast: Period, slow: Period, signal: Period) -> Result<Self, IndicatorError> {
        if slow <= fast {
            return Err(IndicatorError::Order { fast: fast.get(), slow: slow.get() });
        }
        let late = slow.get() - fast.get();
        let [fast, slow, signal] = [fast, slow, signal].map(Ema::new);
        Ok(Self { fast, slow, signal, late, wait: late, value: None })
    }
}

impl Indicator for Macd {
    type Input = f64;
    type Output = Convergence;

    #[inline]
    fn update(&mut self, input: f64) -> Option<Convergence> {
        if !super::is_taken(input) {
            return None;
        }
        let slow = self.slow.update(input);
        let fast = if self.wait > 0 {
            self.wait -= 1;
            None
        } else {
            self.fast.update(input)
        };
        let line = fast? - slow?;
        let signal = self.signal.update(line)?;
        self.value = Some(Convergence { line, signal, histogram: line - signal });
        self.value
    }

    fn value(&self) -> Option<Convergence> {
        self.value
    }

    fn is_ready(&self) -> bool {
        self.value.is_some()
    }

    fn reset(&mut self) {
        self.fast.reset();
        self.slow.reset();
        self.signal.reset();
        (self.wait, self.value) = (self.late, None);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fast_average_less_a_slow_one() {
        let [one, two, three] = [1, 2, 3].map(|n| Period::new(n).unwrap());
        let mut macd = Macd::new(one, three, two).unwrap();
        // An average of 1 is the number itself; the slow one is 4, then 6 and 3.
        let values = [2.0, 4.0, 6.0, 8.0, 0.0].map(|x| macd.update(x));
        assert_eq!(values[..3], [None; 3]);
        assert_eq!(values[3], Some(Convergence { line: 2.0, signal: 2.0, histogram: 0.0 }));
        let signal = 2.0 + 2.0 / 3.0 * (-3.0 - 2.0);
        assert_eq!(values[4], Some(Convergence { line: -3.0, signal, histogram: -3.0 - signal }));
        assert_eq!(Macd::new(two, two, one), Err(IndicatorError::Order { fast: 2, slow: 2 }));
    }
}
