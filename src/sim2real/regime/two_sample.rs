//! Whether two samples are of one distribution.

use rand::RngExt;
use rayon::prelude::*;

use super::RegimeError;
use crate::sim2real::Seed;

/// Up to so many pairs the distribution of the Kolmogorov-Smirnov distance is computed exactly.
const EXACT_PAIRS: usize = 250_000;

/// How far two samples lie apart, and how often samples of one distribution would lie as far.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Apart {
    /// The distance: Kolmogorov-Smirnov from 0 to 1, Wasserstein in units of the samples.
    pub distance: f64,
    /// Probability of this distance or more if both samples were of one distribution, their values independent.
    pub p_value: f64,
}

/// The Kolmogorov-Smirnov test: the largest difference of the two empirical distribution functions.
///
/// The p-value is exact for up to 250,000 pairs of values (by counting paths: J. L. Hodges, Arkiv för Matematik 3, 1957), and otherwise that
/// of Kolmogorov's limit for large samples, which is right to a tenth of itself there. Where values are tied it is too large rather
/// than too small.
///
/// # Errors
/// A sample that is empty, a value that is not finite.
pub fn kolmogorov_smirnov(one: &[f64], other: &[f64]) -> Result<Apart, RegimeError> {
    let (one, other) = (sorted(one)?, sorted(other)?);
    let distance = largest_gap(&one, &other);
    Ok(Apart { distance, p_value: p_value(distance, one.len(), other.len()) })
}

/// The Wasserstein distance of order 1: the area between the two empirical distribution functions, which is the least mean distance
/// by which values of one sample must be moved to become the other [units of the samples].
///
/// The p-value is found by permutation: all values are dealt anew into samples of the same sizes, `permutations` times, each
/// from its own stream of `seed`; it is never below 1 / (permutations + 1).
///
/// # Errors
/// A sample that is empty, a value that is not finite, no permutation.
pub fn wasserstein(one: &[f64], other: &[f64], permutations: usize, seed: Seed) -> Result<Apart, RegimeError> {
    RegimeError::setting("permutations", permutations as f64, permutations >= 1, "a whole number from 1, such as 999")?;
    let (first, second) = (sorted(one)?, sorted(other)?);
    let mut pooled: Vec<(f64, bool)> = first.iter().map(|x| (*x, true)).chain(second.iter().map(|x| (*x, false))).collect();
    pooled.sort_by(|a, b| a.0.total_cmp(&b.0));
    let values: Vec<f64> = pooled.iter().map(|(x, _)| *x).collect();
    let belongs: Vec<bool> = pooled.iter().map(|(_, of_first)| *of_first).collect();
    let distance = area(&values, &belongs, first.len());
    let few = first.len().min(second.len());
    // Rounding must not part what is the same deal.
    let reached = distance * (1.0 - 1e-12);
    let as_far: usize = (0..permutations)
        .into_par_iter()
        .map_init(
            || (Vec::new(), Vec::new()),
            |(order, dealt): &mut (Vec<u32>, Vec<bool>), number| {
                let mut draws = seed.stream(&format!("regime.permutation {number}"));
                order.clear();
                order.extend(0..values.len() as u32);
                dealt.clear();
                dealt.resize(values.len(), false);
                for drawn in 0..few {
                    order.swap(drawn, draws.random_range(drawn..values.len()));
                    dealt[order[drawn] as usize] = true;
                }
                usize::from(area(&values, dealt, few) >= reached)
            },
        )
        .sum();
    Ok(Apart { distance, p_value: (as_far + 1) as f64 / (permutations + 1) as f64 })
}

/// The values in ascending order.
pub(super) fn sorted(sample: &[f64]) -> Result<Vec<f64>, RegimeError> {
    if sample.is_empty() {
        return Err(RegimeError::TooShort { what: "a comparison of samples", found: 0, needed: 1 });
    }
    RegimeError::all_finite(sample)?;
    // 0 and -0 are one value.
    let mut sample: Vec<f64> = sample.iter().map(|x| x + 0.0).collect();
    sample.sort_unstable_by(f64::total_cmp);
    Ok(sample)
}

/// The largest difference of the empirical distribution functions of two samples in ascending order.
pub(super) fn largest_gap(one: &[f64], other: &[f64]) -> f64 {
    let (share, other_share) = (1.0 / one.len() as f64, 1.0 / other.len() as f64);
    let (mut i, mut j, mut gap) = (0, 0, 0.0_f64);
    while i < one.len() && j < other.len() {
        let value = one[i].min(other[j]);
        while i < one.len() && one[i] <= value {
            i += 1;
        }
        while j < other.len() && other[j] <= value {
            j += 1;
        }
        gap = gap.max((i as f64 * share - j as f64 * other_share).abs());
    }
    gap
}

/// The area between the empirical distribution functions; `values` ascend, and `count` of them are of the sample marked.
fn area(values: &[f64], marked: &[bool], count: usize) -> f64 {
    let (share, other_share) = (1.0 / count as f64, 1.0 / (values.len() - count) as f64);
    let (mut difference, mut area) = (0.0_f64, 0.0);
    for (pair, of_first) in values.windows(2).zip(marked) {
        difference += if *of_first { share } else { -other_share };
        area += difference.abs() * (pair[1] - pair[0]);
    }
    area
}

/// Probability that samples of one distribution, of these sizes, lie as far apart.
pub(super) fn p_value(distance: f64, one: usize, other: usize) -> f64 {
    if one * other <= EXACT_PAIRS { exact(distance, one, other) } else { limit(distance, one, other) }
}

/// Probability that a random path from corner to corner of a grid strays as far as `distance` from the diagonal.
fn exact(distance: f64, one: usize, other: usize) -> f64 {
    let (rows, columns) = (one as f64, other as f64);
    // Differences are whole multiples of 1 / (rows columns): half of one less, so that the distance itself counts as far.
    let bound = ((distance * rows * columns).round() - 0.5) / (rows * columns);
    let inside = |i: usize, j: usize| (i as f64 / rows - j as f64 / columns).abs() <= bound;
    // Probability to have stayed inside so far, of all paths to (i, j).
    let mut stayed: Vec<f64> = vec![0.0; other + 1];
    for i in 0..=one {
        for j in 0..=other {
            let total = (i + j) as f64;
            stayed[j] = match (i, j) {
                _ if !inside(i, j) => 0.0,
                (0, 0) => 1.0,
                (0, _) => stayed[j - 1],
                (_, 0) => stayed[0],
                // The last step was down with probability i / (i + j).
                _ => stayed[j] * (i as f64 / total) + stayed[j - 1] * (j as f64 / total),
            };
        }
    }
    (1.0 - stayed[other]).clamp(0.0, 1.0)
}

/// The same for large samples: 2 * sum of (-1)^(k-1) exp(-2 k² x²).
fn limit(distance: f64, one: usize, other: usize) -> f64 {
    let size = (one as f64 * other as f64 / (one + other) as f64).sqrt();
    let x = size * distance;
    if x < 0.2 {
        // The series does not converge; the probability is 1 to 1e-11.
        return 1.0;
    }
    let mut sum = 0.0;
    let mut sign = 1.0;
    for k in 1..=100 {
        let term = (-2.0 * f64::from(k * k) * x * x).exp();
        sum += sign * term;
        if term < 1e-17 {
            break;
        }
        sign = -sign;
    }
    (2.0 * sum).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_distr::{Distribution, StandardNormal};

    fn noise(rows: usize, seed: u64) -> Vec<f64> {
        let mut draws = Seed(seed).stream("noise");
        (0..rows).map(|_| StandardNormal.sample(&mut *draws)).collect()
    }

    /// All 20 deals of six values into two samples of three: 2 of them are 1 apart, 10 are 2/3 or more.
    #[test]
    fn exact_probabilities_by_counting() {
        let apart = kolmogorov_smirnov(&[1.0, 2.0, 3.0], &[4.0, 5.0, 6.0]).unwrap();
        assert_eq!(apart.distance, 1.0);
        assert!((apart.p_value - 0.1).abs() < 1e-15);
        for one in 1..=6_usize {
            for other in 1..=6_usize {
                let total = one + other;
                let mut gaps = vec![];
                for set in 0..1_u32 << total {
                    if set.count_ones() as usize == one {
                        let (a, b): (Vec<usize>, Vec<usize>) = (0..total).partition(|k| set >> k & 1 == 1);
                        let float = |v: Vec<usize>| v.into_iter().map(|x| x as f64).collect::<Vec<_>>();
                        gaps.push(largest_gap(&float(a), &float(b)));
                    }
                }
                for gap in &gaps {
                    let expected = gaps.iter().filter(|g| **g >= gap - 1e-12).count() as f64 / gaps.len() as f64;
                    assert!((exact(*gap, one, other) - expected).abs() < 1e-12, "{one}, {other}, {gap}");
                }
            }
        }
    }

    #[test]
    fn the_limit_joins_on() {
        for gap in [0.06, 0.08, 0.1] {
            for other in [500, 601, 1_300] {
                let (exact, limit) = (exact(gap, 500, other), limit(gap, 500, other));
                assert!((exact - limit).abs() < 0.1 * exact, "{gap}, {other}: {exact}, {limit}");
            }
        }
        // The 5 % point of Kolmogorov's distribution is 1.3581.
        let size = (5e9_f64).sqrt();
        assert!((limit(1.3581 / size, 10_000_000_000, 10_000_000_000) - 0.05).abs() < 1e-4);
        assert_eq!(limit(0.0, 1_000, 1_000), 1.0);
    }

    /// Samples of one distribution are told apart as often as p-values say.
    #[test]
    fn p_values_are_uniform_without_a_difference() {
        let count = |reject: &dyn Fn(u64) -> bool, trials: u64| (0..trials).filter(|k| reject(*k)).count();
        let small = count(&|k| kolmogorov_smirnov(&noise(40, 2 * k), &noise(50, 2 * k + 1)).unwrap().p_value < 0.1, 2_000);
        assert!((140..=230).contains(&small), "{small} of 2000");
        let large = count(&|k| kolmogorov_smirnov(&noise(500, 2 * k), &noise(600, 2 * k + 1)).unwrap().p_value < 0.1, 1_000);
        assert!((70..=130).contains(&large), "{large} of 1000");
        let area =
            count(&|k| wasserstein(&noise(20, 2 * k), &noise(30, 2 * k + 1), 99, Seed(k)).unwrap().p_value <= 0.1, 1_000);
        assert!((70..=130).contains(&area), "{area} of 1000");
    }

    /// A sample that is shifted lies apart by its shift.
    #[test]
    fn wasserstein_by_hand() {
        let one = [0.0, 1.0, 5.0];
        let shifted = wasserstein(&one, &one.map(|x| x + 2.5), 9, Seed(0)).unwrap();
        assert!((shifted.distance - 2.5).abs() < 1e-12);
        // Of two against three values: |F - G| is 1/2, 1/6, 1/3 and 1/3 between 0, 1, 2, 3 and 4.
        let uneven = wasserstein(&[0.0, 2.0], &[1.0, 3.0, 4.0], 9, Seed(0)).unwrap();
        assert!((uneven.distance - (0.5 + 1.0 / 6.0 + 2.0 / 3.0 + 1.0 / 3.0)).abs() < 1e-12, "{uneven:?}");
        assert_eq!(wasserstein(&one, &one, 99, Seed(0)).unwrap(), Apart { distance: 0.0, p_value: 1.0 });
        let far = wasserstein(&noise(100, 1), &noise(100, 2).iter().map(|x| 2.0 * x).collect::<Vec<_>>(), 999, Seed(3));
        assert!(far.unwrap().p_value < 0.01);
    }

    #[test]
    fn the_same_seed_gives_the_same_bits_at_any_number_of_threads() {
        let (one, other) = (noise(200, 1), noise(150, 2));
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| wasserstein(&one, &other, 500, Seed(4)).unwrap())
        };
        assert_eq!(with(1), with(3));
    }

    #[test]
    fn samples_that_are_none() {
        assert!(matches!(kolmogorov_smirnov(&[], &[1.0]), Err(RegimeError::TooShort { found: 0, .. })));
        assert!(matches!(wasserstein(&[1.0], &[], 9, Seed(0)), Err(RegimeError::TooShort { .. })));
        assert!(matches!(kolmogorov_smirnov(&[1.0, f64::NAN], &[1.0]), Err(RegimeError::NotFinite { row: 1, .. })));
        assert!(matches!(wasserstein(&[1.0], &[2.0], 0, Seed(0)), Err(RegimeError::Setting { .. })));
        // One value all over: no difference, and no division by 0.
        assert_eq!(kolmogorov_smirnov(&[3.0; 5], &[3.0; 9]).unwrap(), Apart { distance: 0.0, p_value: 1.0 });
        assert_eq!(kolmogorov_smirnov(&[0.0], &[-0.0]).unwrap().distance, 0.0);
    }
}
