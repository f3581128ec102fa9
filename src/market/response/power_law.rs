//! A power of something, fitted by weighted least squares.

/// A point: where, what was found there, and how much it counts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Point {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) weight: f64,
}

/// `y = factor * x^exponent`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PowerLaw {
    pub(super) factor: f64,
    pub(super) exponent: f64,
}

/// The exponent within `bounds` at which the smallest sum is left; none where that is at a bound, where the data say no more than
/// that it lies beyond.
pub(super) fn least(bounds: [f64; 2], left: impl Fn(f64) -> f64) -> Option<f64> {
    const STEP: f64 = 0.05;
    let steps = ((bounds[1] - bounds[0]) / STEP).round().max(2.0) as usize;
    let at = |k: usize| bounds[0] + (bounds[1] - bounds[0]) * k as f64 / steps as f64;
    let best = (0..=steps).min_by(|a, b| left(at(*a)).total_cmp(&left(at(*b))))?;
    if best == 0 || best == steps {
        return None;
    }
    // Golden section between its neighbours.
    let ratio = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut low, mut high) = (at(best - 1), at(best + 1));
    for _ in 0..20 {
        let (a, b) = (high - ratio * (high - low), low + ratio * (high - low));
        if left(a) < left(b) { high = b } else { low = a }
    }
    Some(0.5 * (low + high))
}

/// The power law nearest to the points. Values, not their logarithms, are compared: what is found may well be below 0.
pub(super) fn fit(points: &[Point], bounds: [f64; 2]) -> Option<PowerLaw> {
    let sound = |point: &&Point| point.x > 0.0 && point.y.is_finite() && point.weight > 0.0 && point.weight.is_finite();
    let points: Vec<Point> = points.iter().filter(sound).copied().collect();
    if points.len() < 3 {
        return None;
    }
    let factor = |exponent: f64| {
        let sums = points.iter().fold([0.0; 2], |[cross, square], point| {
            let power = point.x.powf(exponent);
            [cross + point.weight * power * point.y, square + point.weight * power * power]
        });
        if sums[1] > 0.0 { sums[0] / sums[1] } else { 0.0 }
    };
    let left = |exponent: f64| {
        let factor = factor(exponent);
        points.iter().map(|point| point.weight * (point.y - factor * point.x.powf(exponent)).powi(2)).sum()
    };
    let exponent = least(bounds, left)?;
    let factor = factor(exponent);
    (factor > 0.0).then_some(PowerLaw { factor, exponent })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(law: impl Fn(f64) -> f64) -> Vec<Point> {
        (0..12).map(|k| 0.1 * 2.0_f64.powi(k)).map(|x| Point { x, y: law(x), weight: 1.0 / x }).collect()
    }

    #[test]
    fn a_power_law_is_found_and_what_lies_beyond_the_bounds_is_not() {
        let found = fit(&points(|x| 3.0 * x.powf(0.4)), [-1.0, 2.0]).unwrap();
        assert!((found.exponent - 0.4).abs() < 1e-4 && (found.factor - 3.0).abs() < 1e-3, "{found:?}");
        let found = fit(&points(|x| 0.5 * x.powf(-0.7)), [-2.0, 0.0]).unwrap();
        assert!((found.exponent + 0.7).abs() < 1e-4, "{found:?}");
        assert_eq!(fit(&points(|x| x.powf(3.0)), [-1.0, 2.0]), None);
        assert_eq!(fit(&points(|x| -x.powf(0.5)), [-1.0, 2.0]), None);
        assert_eq!(fit(&points(|x| x)[..2], [-1.0, 2.0]), None);
    }
}
