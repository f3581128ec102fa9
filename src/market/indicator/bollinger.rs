//! Bollinger's bands.

use super::{Indicator, IndicatorError, Period, StandardDeviation};

/// Bollinger's bands: the mean of the last `period` numbers, and `width` standard deviations of them above and below; 20
/// and 2 are usual (J. Bollinger, Bollinger on Bollinger Bands, 2001).
#[derive(Debug, Clone, PartialEq)]
pub struct Bollinger {
    deviation: StandardDeviation,
    width: f64,
}

/// A band about a mean, in the unit of the numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bands {
    /// The upper band.
    pub upper: f64,
    /// The mean.
    pub middle: f64,
    /// The lower band.
    pub lower: f64,
}

impl Bollinger {
    /// Bands of `width` standard deviations of the last `period` numbers.
    ///
    /// # Errors
    /// If the width is not above 0, or beyond a million.
    pub fn new(period: Period, width: f64) -> Result<Self, IndicatorError> {
        if !(width > 0.0 && width <= 1e6) {
            return Err(IndicatorError::Width(width));
        }
        Ok(Self { deviation: StandardDeviation::new(period), width })
    }
}

impl Indicator for Bollinger {
    type Input = f64;
    type Output = Bands;

    #[inline]
    fn update(&mut self, input: f64) -> Option<Bands> {
        let deviation = self.deviation.update(input)?;
        self.bands(deviation)
    }

    fn value(&self) -> Option<Bands> {
        self.bands(self.deviation.value()?)
    }

    fn is_ready(&self) -> bool {
        self.deviation.is_ready()
    }

    fn reset(&mut self) {
        self.deviation.reset();
    }
}

impl Bollinger {
    fn bands(&self, deviation: f64) -> Option<Bands> {
        let (middle, reach) = (self.deviation.mean()?, self.width * deviation);
        Some(Bands { upper: middle + reach, middle, lower: middle - reach })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_deviations_about_the_mean() {
        let mut bands = Bollinger::new(Period::new(4).unwrap(), 2.0).unwrap();
        let last = [1.0, 3.0, 1.0, 3.0].map(|x| bands.update(x))[3];
        assert_eq!(last, Some(Bands { upper: 4.0, middle: 2.0, lower: 0.0 }));
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(Bollinger::new(Period::new(4).unwrap(), bad).is_err(), "{bad}");
        }
    }
}
