//! The tail of sizes.

/// The tail exponent of what is larger than a threshold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tail {
    /// `alpha` of `P(size > x) ~ x^-alpha`.
    pub exponent: f64,
    /// Its standard error, `alpha / sqrt(k)`: of sizes that are independent, which those of one decision are not.
    pub std_error: f64,
    /// The threshold.
    pub above: f64,
    /// How many are above it.
    pub count: usize,
}

/// Hill's estimate from the largest `part` of `sizes`; none where that are fewer than 20, or all alike.
///
/// Source: Hill, "A simple general approach to inference about the tail of a distribution", Annals of Statistics 3 (1975).
#[must_use]
pub fn hill(sizes: &[f64], part: f64) -> Option<Tail> {
    const FEWEST: usize = 20;
    let mut sizes: Vec<f64> = sizes.iter().copied().filter(|size| *size > 0.0 && size.is_finite()).collect();
    sizes.sort_by(|a, b| b.total_cmp(a));
    let count = (part.clamp(0.0, 1.0) * sizes.len() as f64).floor() as usize;
    let above = *sizes.get(count).filter(|_| count >= FEWEST)?;
    let mean = sizes[..count].iter().map(|size| (size / above).ln()).sum::<f64>() / count as f64;
    let exponent = 1.0 / mean;
    exponent.is_finite().then_some(Tail { exponent, std_error: exponent / (count as f64).sqrt(), above, count })
}

#[cfg(test)]
mod tests {
    use rand::RngExt;

    use super::*;
    use crate::sim2real::Seed;

    #[test]
    fn the_tail_of_a_pareto_distribution_is_found_within_its_error() {
        for (number, alpha) in [(1, 1.2), (2, 1.5), (3, 2.5)] {
            let mut draws = Seed(number).stream("sizes");
            let sizes: Vec<f64> = (0..20_000).map(|_| draws.random::<f64>().max(1e-12).powf(-1.0 / alpha)).collect();
            let found = hill(&sizes, 0.1).unwrap();
            assert_eq!(found.count, 2_000);
            assert!((found.exponent - alpha).abs() < 3.0 * found.std_error, "{found:?}, not {alpha}");
        }
    }

    #[test]
    fn too_few_or_all_alike_have_no_tail() {
        assert_eq!(hill(&[1.0; 1_000], 0.1), None);
        assert_eq!(hill(&(1..190).map(f64::from).collect::<Vec<_>>(), 0.1), None);
        assert_eq!(hill(&[], 0.5), None);
    }
}
