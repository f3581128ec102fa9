//! Bounded parameters as unbounded ones, so that a fit can step anywhere.
//!
//! The maps are those of MINUIT (James & Roos, Computer Physics Communications 10 (1975), section 2): a sine between
//! two bounds, a hyperbola above one.

use crate::sim2real::Parameter;

/// The map of one parameter.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bounded {
    lower: f64,
    upper: f64,
    scale: f64,
}

impl Bounded {
    pub(super) fn new(parameter: &Parameter) -> Self {
        Self { lower: parameter.lower, upper: parameter.upper, scale: parameter.scale() }
    }

    /// From the parameter's value to the free one. Values at a bound are moved off it by a little: there the map has no
    /// slope and a fit could not leave.
    pub(super) fn free(&self, value: f64) -> f64 {
        match (self.lower.is_finite(), self.upper.is_finite()) {
            (true, true) => {
                let unit = 2.0 * (value - self.lower) / (self.upper - self.lower) - 1.0;
                unit.clamp(-1.0 + 1e-6, 1.0 - 1e-6).asin()
            }
            (true, false) => hyperbola((value - self.lower) / self.scale),
            (false, true) => hyperbola((self.upper - value) / self.scale),
            (false, false) => value / self.scale,
        }
    }

    /// From the free value to the parameter's.
    pub(super) fn value(&self, free: f64) -> f64 {
        match (self.lower.is_finite(), self.upper.is_finite()) {
            (true, true) => self.lower + 0.5 * (self.upper - self.lower) * (free.sin() + 1.0),
            (true, false) => self.lower + self.scale * (free.hypot(1.0) - 1.0),
            (false, true) => self.upper - self.scale * (free.hypot(1.0) - 1.0),
            (false, false) => free * self.scale,
        }
    }

    /// How fast the parameter's value moves with the free one.
    pub(super) fn slope(&self, free: f64) -> f64 {
        match (self.lower.is_finite(), self.upper.is_finite()) {
            (true, true) => 0.5 * (self.upper - self.lower) * free.cos(),
            (true, false) => self.scale * free / free.hypot(1.0),
            (false, true) => -self.scale * free / free.hypot(1.0),
            (false, false) => self.scale,
        }
    }
}

fn hyperbola(above: f64) -> f64 {
    ((above.max(1e-6) + 1.0).powi(2) - 1.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn maps_invert_and_have_the_slope_they_say() {
        let inf = f64::INFINITY;
        for (lower, upper) in [(-1.0, 2.0), (0.0, inf), (-inf, 3.0), (-inf, inf)] {
            let map = Bounded::new(&Parameter::new("p", "", 0.5).within(lower, upper));
            for value in [0.01, 0.4, 1.9] {
                let free = map.free(value);
                assert!((map.value(free) - value).abs() < 1e-9, "{lower} {upper} {value}");
                let slope = (map.value(free + 1e-6) - map.value(free - 1e-6)) / 2e-6;
                assert!((map.slope(free) - slope).abs() < 1e-5 * slope.abs().max(1.0));
            }
        }
    }

    #[test]
    fn no_free_value_leaves_the_bounds() {
        let map = Bounded::new(&Parameter::new("p", "", 0.0).within(0.0, 1.0));
        assert!([-1e9, -3.0, 0.0, 7.0, 1e9].iter().all(|z| (0.0..=1.0).contains(&map.value(*z))));
    }
}
