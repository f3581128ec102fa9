//! Intervals by resampling blocks of what came one after the other.

use rand::RngExt;

use crate::sim2real::Seed;

/// A number and its 95 % interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimated {
    /// The estimate.
    pub value: f64,
    /// Its 95 % interval.
    pub ci95: [f64; 2],
}

/// The fewest blocks of which an interval is made: of fewer it is no more than the luck of a few.
pub(super) const FEWEST: usize = 8;

/// The most blocks that data are cut into.
const MOST: usize = 50;

const DRAWS: usize = 400;

/// How many blocks a stretch of `span` is cut into where what lies closer than `memory` depends on one another: none if there
/// are not [`FEWEST`] that are twice as long as that.
pub(super) fn block_count(span: f64, memory: f64) -> Option<usize> {
    let room = if memory > 0.0 { (span / (2.0 * memory)).floor() } else { MOST as f64 };
    let count = room.clamp(0.0, MOST as f64) as usize;
    (count >= FEWEST).then_some(count)
}

/// The 95 % interval of a statistic of blocks, resampled whole and with replacement; none where it is hardly ever defined.
///
/// Source: Künsch, "The jackknife and the bootstrap for general stationary observations", Annals of Statistics 17 (1989).
pub(super) fn interval(blocks: usize, seed: Seed, statistic: impl Fn(&[usize]) -> Option<f64>) -> Option<[f64; 2]> {
    if blocks < FEWEST {
        return None;
    }
    let mut draws = seed.stream("blocks");
    let mut found = Vec::with_capacity(DRAWS);
    let mut drawn = vec![0; blocks];
    for _ in 0..DRAWS {
        drawn.iter_mut().for_each(|block| *block = draws.random_range(0..blocks));
        found.extend(statistic(&drawn).filter(|value| value.is_finite()));
    }
    if found.len() < DRAWS * 9 / 10 {
        return None;
    }
    found.sort_by(f64::total_cmp);
    let quantile = |part: f64| found[((found.len() - 1) as f64 * part).round() as usize];
    Some([quantile(0.025), quantile(0.975)])
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    #[test]
    fn blocks_are_twice_as_long_as_the_memory_or_there_are_none() {
        assert_eq!((block_count(160.0, 10.0), block_count(159.0, 10.0)), (Some(8), None));
        assert_eq!((block_count(1e6, 1.0), block_count(1e6, 0.0), block_count(0.0, 1.0)), (Some(50), Some(50), None));
    }

    #[test]
    fn an_interval_covers_the_mean_as_often_as_it_says() {
        let (mut covered, trials) = (0, 200);
        for trial in 0..trials {
            let mut draws = Seed(trial).stream("numbers");
            let numbers: Vec<f64> = (0..40).map(|_| StandardNormal.sample(&mut draws)).collect();
            let mean = |blocks: &[usize]| Some(blocks.iter().map(|b| numbers[*b]).sum::<f64>() / blocks.len() as f64);
            let [low, high] = interval(40, Seed(trial), mean).unwrap();
            covered += usize::from(low <= 0.0 && 0.0 <= high);
        }
        assert!((180..=198).contains(&covered), "{covered} of {trials}");
        assert_eq!(interval(40, Seed(1), |_| None), None);
        assert_eq!(interval(7, Seed(1), |_| Some(1.0)), None);
    }
}
