//! Intervals of what a finite number of cases shows.

/// 97.5 % quantile of the normal distribution.
pub(super) const Z: f64 = 1.959_963_984_540_054;

/// The 95 % interval of a share of which `hits` in `of` were seen.
///
/// Source: Wilson, "Probable inference, the law of succession, and statistical inference", JASA 22 (1927).
#[must_use]
pub fn wilson(hits: usize, of: usize) -> [f64; 2] {
    if of == 0 {
        return [0.0, 1.0];
    }
    let (n, p) = (of as f64, hits as f64 / of as f64);
    let middle = (p + Z * Z / (2.0 * n)) / (1.0 + Z * Z / n);
    let half = Z / (1.0 + Z * Z / n) * (p * (1.0 - p) / n + Z * Z / (4.0 * n * n)).sqrt();
    [(middle - half).max(0.0), (middle + half).min(1.0)]
}

/// The `part`-quantile of sorted `values`, and its 95 % interval by ranks: that many of a binomial's draws lie below it.
pub(super) fn quantile(sorted: &[f64], part: f64) -> Option<(f64, [f64; 2])> {
    let last = sorted.len().checked_sub(1)?;
    let n = sorted.len() as f64;
    let rank = |rank: f64| sorted[(rank.max(0.0) as usize).min(last)];
    let between = |place: f64| {
        let low = place.floor();
        // Infinities have no middle.
        let (a, b) = (rank(low), rank(low + 1.0));
        if a == b { a } else { a + (place - low) * (b - a) }
    };
    let reach = Z * (n * part * (1.0 - part)).sqrt();
    Some((between(part * last as f64), [rank((n * part - reach).floor()), rank((n * part + reach).ceil())]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As R's `prop.test(..., correct = FALSE)` gives them.
    #[test]
    fn wilson_is_as_published() {
        let near = |found: [f64; 2], low: f64, high: f64| (found[0] - low).abs() < 1e-4 && (found[1] - high).abs() < 1e-4;
        assert!(near(wilson(81, 263), 0.2553, 0.3662), "{:?}", wilson(81, 263));
        assert!(near(wilson(15, 148), 0.0624, 0.1605));
        assert!(near(wilson(0, 20), 0.0, 0.1611));
        assert_eq!(wilson(0, 0), [0.0, 1.0]);
    }

    #[test]
    fn quantiles_lie_in_their_intervals() {
        let values: Vec<f64> = (0..101).map(f64::from).collect();
        let (median, [low, high]) = quantile(&values, 0.5).unwrap();
        assert_eq!((median, low, high), (50.0, 40.0, 61.0));
        assert_eq!(quantile(&[1.0, f64::INFINITY, f64::INFINITY], 0.5).unwrap().0, f64::INFINITY);
        assert_eq!(quantile(&[], 0.5), None);
    }
}
