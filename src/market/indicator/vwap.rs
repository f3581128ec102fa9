//! The volume-weighted average price.

use super::double_double::DoubleDouble;
use super::{Indicator, is_taken};

/// The average price of all that was traded since it was anchored, weighted by volume [currency]: by the first input, or
/// anew by a [`reset`](Indicator::reset). Inputs are prices [currency] and volumes [units]; there is none before there is
/// volume.
///
/// S. A. Berkowitz, D. E. Logue and E. A. Noser, "The total cost of transactions on the NYSE", Journal of Finance 43 (1988).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Vwap {
    value: DoubleDouble,
    volume: DoubleDouble,
}

impl Vwap {
    /// Nothing seen yet.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// The volume it averages over [units].
    #[must_use]
    pub fn volume(&self) -> f64 {
        self.volume.to_f64()
    }
}

impl Indicator for Vwap {
    type Input = (f64, f64);
    type Output = f64;

    #[inline]
    fn update(&mut self, (price, volume): (f64, f64)) -> Option<f64> {
        if !is_taken(price) || !is_taken(volume) || volume < 0.0 {
            return None;
        }
        self.value += DoubleDouble::product(price, volume);
        self.volume += volume.into();
        self.value()
    }

    fn value(&self) -> Option<f64> {
        self.is_ready().then(|| self.value.to_f64() / self.volume())
    }

    fn is_ready(&self) -> bool {
        self.volume() > 0.0
    }

    fn reset(&mut self) {
        *self = Self::default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn volume_weighs() {
        let mut vwap = Vwap::new();
        let values = [(5.0, 0.0), (10.0, 1.0), (20.0, 3.0), (30.0, -1.0)].map(|input| vwap.update(input));
        assert_eq!(values, [None, Some(10.0), Some(17.5), None]);
        assert_eq!(vwap.value(), Some(17.5));
    }
}
