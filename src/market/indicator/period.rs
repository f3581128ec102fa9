//! How many inputs an indicator looks back on.

/// A number of inputs: from 1 to [`Period::LONGEST`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Period(usize);

/// A parameter no indicator can have.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum IndicatorError {
    /// A period of nothing, or one too long.
    #[error("a period is {0}\nhint: give a number of bars from 1 to 1,000,000")]
    Period(usize),
    /// A factor that does not fade.
    #[error("a decay is {0}\nhint: give the part of a weight that is left after one bar: above 0 and below 1, as 0.94")]
    Decay(f64),
    /// A width that is none.
    #[error("a width is {0}\nhint: give a number of standard deviations above 0 and up to 1,000,000, as 2")]
    Width(f64),
    /// Periods in the wrong order.
    #[error("the slow period is {slow}\nhint: it must be above the fast one, {fast}")]
    Order {
        /// The fast period.
        fast: usize,
        /// The slow period.
        slow: usize,
    },
}

impl Period {
    /// One input.
    pub const ONE: Self = Self(1);
    /// The longest period.
    pub const LONGEST: usize = 1_000_000;

    /// A period of `count` inputs.
    ///
    /// # Errors
    /// If it is 0, or above [`Period::LONGEST`].
    pub fn new(count: usize) -> Result<Self, IndicatorError> {
        if (1..=Self::LONGEST).contains(&count) { Ok(Self(count)) } else { Err(IndicatorError::Period(count)) }
    }

    /// The number of inputs.
    #[must_use]
    pub fn get(self) -> usize {
        self.0
    }

    /// The number of inputs, as a divisor.
    pub(super) fn to_f64(self) -> f64 {
        self.0 as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_period_is_a_number_of_inputs() {
        assert_eq!(Period::new(1).map(Period::get), Ok(1));
        assert_eq!(Period::new(1_000_000).map(Period::get), Ok(1_000_000));
        for bad in [0, 1_000_001] {
            assert_eq!(Period::new(bad), Err(IndicatorError::Period(bad)));
        }
    }
}
