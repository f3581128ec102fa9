//! How far costs scatter of themselves, where a log tells prices finer than ticks: what no rounding explains, nor anything that
//! orders are told apart by.

/// A price further from a whole tick than this is between ticks [ticks].
const WHOLE: f64 = 1e-3;
/// Prices are finer than ticks where this part of them lies between.
const FINER: f64 = 0.1;
/// With fewer orders nothing is told of how costs scatter.
const ENOUGH: usize = 50;

/// Whether `prices` of fills are told finer than in ticks, as those of venues that improve them are and of logs that tell of an order no more
/// than its average.
pub(super) fn finer_than(tick_size: f64, prices: impl Iterator<Item = f64>) -> bool {
    let (mut count, mut between) = (0, 0);
    for price in prices {
        let ticks = price / tick_size;
        count += 1;
        between += usize::from((ticks - ticks.round()).abs() > WHOLE);
    }
    f64::from(between as u32) > FINER * f64::from(count as u32) && between > 0
}

/// The standard deviation of what is left of `values` beside any smooth dependence on one of the `columns`: the least of those that
/// differences of neighbours give, in the order of each column and in the order in which they stand.
///
/// None of fewer than 50 values. Source: Rice, "Bandwidth choice for nonparametric regression", Annals of Statistics 12 (1984).
pub(super) fn least_scatter(values: &[Option<f64>], columns: &[Vec<f64>]) -> Option<f64> {
    let known: Vec<usize> = (0..values.len()).filter(|row| values[*row].is_some()).collect();
    if known.len() < ENOUGH {
        return None;
    }
    let own = known.iter().map(|row| *row as f64);
    let by_place: Vec<(f64, usize)> = own.zip(known.iter().copied()).collect();
    let by_column = columns.iter().map(|column| known.iter().map(|row| (column[*row], *row)).collect::<Vec<_>>());
    std::iter::once(by_place).chain(by_column).map(|order| of_neighbours(values, order)).reduce(f64::min)
}

/// The same of neighbours in one order.
fn of_neighbours(values: &[Option<f64>], mut order: Vec<(f64, usize)>) -> f64 {
    order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let sorted: Vec<f64> = order.iter().filter_map(|(_, row)| values[*row]).collect();
    let squares: f64 = sorted.windows(2).map(|pair| (pair[1] - pair[0]).powi(2)).sum();
    (0.5 * squares / (sorted.len().max(2) - 1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution, StandardNormal};

    use super::*;
    use crate::sim2real::Seed;

    #[test]
    fn prices_on_ticks_are_no_finer_and_a_few_averages_make_them_no_finer_either() {
        let mut prices: Vec<f64> = (0..100).map(|k| 0.01 * f64::from(4_000 + k)).collect();
        assert!(!finer_than(0.01, prices.iter().copied()));
        (0..10).for_each(|k| prices[k] += 0.003);
        assert!(!finer_than(0.01, prices.iter().copied()), "a tenth are averages");
        prices[10] += 0.0001;
        assert!(finer_than(0.01, prices.iter().copied()));
        assert!(!finer_than(0.01, std::iter::empty()));
    }

    #[test]
    fn what_depends_on_something_does_not_count_as_scatter() {
        let mut rng = Seed(3).stream("scatter");
        let mut draw = || -> f64 { StandardNormal.sample(&mut rng) };
        let size: Vec<f64> = (0..600).map(|_| draw()).collect();
        let other: Vec<f64> = (0..600).map(|_| draw()).collect();
        let values: Vec<Option<f64>> = size.iter().map(|size| Some(5.0 * size.atan() + 0.2 * draw())).collect();
        let of = |columns: &[Vec<f64>]| least_scatter(&values, columns).unwrap_or(f64::NAN);
        assert!(of(&[]) > 2.0 && of(std::slice::from_ref(&other)) > 2.0);
        let found = of(&[other, size]);
        assert!((found - 0.2).abs() < 0.05, "{found}");
        assert_eq!(least_scatter(&values[..49], &[]), None);
    }
}
