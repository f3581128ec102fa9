//! The best division of a series into stretches, exactly: which changes there were, seen from the end.

use serde::{Deserialize, Serialize};

use super::RegimeError;

/// Least variance of a stretch [variance of the noise of the whole series]. Values are rounded somewhere: a few rows on one tick of a
/// price are no stretch without noise, and would be infinitely likely as one.
const FLOOR: f64 = 1e-2;

/// What stays the same within a stretch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Cost {
    /// The mean: the sum of squared deviations from it [units of the series, squared].
    Mean,
    /// Mean and variance: twice the negative logarithm of the Gaussian likelihood, without constants.
    MeanAndVariance,
    /// The rate of counts: twice the negative logarithm of the Poisson likelihood, without constants.
    Rate,
}

/// What a further change must gain, in units of the cost.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Penalty {
    /// Schwarz's: (parameters of a stretch + 1) ln(rows), the change itself being one. With [`Cost::Mean`] times the variance of
    /// the noise, found from differences of neighbouring rows, which a change of mean hardly touches.
    Bic,
    /// The modified one of N. R. Zhang and D. O. Siegmund (Biometrics 63, 2007): (parameters + 2) ln(rows), and the logarithm of
    /// each stretch's length, against stretches that are very short. Scaled as the other.
    Mbic,
    /// Given, above 0.
    Given(f64),
}

/// What to look for.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Division {
    /// What stays the same within a stretch.
    pub cost: Cost,
    /// What a change must gain.
    pub penalty: Penalty,
    /// Least length of a stretch [rows]: from 1, with a variance from 2.
    pub shortest: usize,
}

/// A series divided into stretches.
#[derive(Debug, Clone, PartialEq)]
pub struct Divided {
    /// Rows at which a new stretch begins, ascending; the first row is none.
    pub changes: Vec<usize>,
    /// Cost of all stretches, without penalties.
    pub cost: f64,
    /// What each change had to gain.
    pub penalty: f64,
}

impl Division {
    /// Finds the changes for which cost and penalties are least, of all there are: exact, in time that grows linearly with the
    /// series where changes come at a steady rate, and quadratically where there are none.
    ///
    /// Source: R. Killick, P. Fearnhead and I. A. Eckley, *Optimal detection of changepoints with a linear computational cost*,
    /// Journal of the American Statistical Association 107 (2012).
    ///
    /// # Errors
    /// A value that is not finite; a series shorter than two stretches; a penalty of 0 or less; a stretch too short for its
    /// cost; counts that are negative.
    pub fn divide(&self, series: &[f64]) -> Result<Divided, RegimeError> {
        let cost = Costs::new(self, series)?;
        let rows = series.len();
        // Least cost of the rows before each, and the beginning of the stretch that ends there.
        let mut least = vec![f64::INFINITY; rows + 1];
        let mut origin = vec![0_usize; rows + 1];
        least[0] = -cost.penalty;
        let mut candidates: Vec<Candidate> = vec![];
        for end in self.shortest..=rows {
            let newest = end - self.shortest;
            if least[newest].is_finite() {
                candidates.push(Candidate { begin: newest, until: usize::MAX, bound: 0.0 });
            }
            candidates.retain(|c| c.until > end);
            let (mut best, mut from) = (f64::INFINITY, 0);
            for candidate in &mut candidates {
                candidate.bound = least[candidate.begin] + cost.of(candidate.begin, end);
                if candidate.bound < best {
                    (best, from) = (candidate.bound, candidate.begin);
                }
            }
            least[end] = best + cost.penalty;
            origin[end] = from;
            // One that is beaten by a change here will be at all later ends that leave room for a stretch from here. Rounding of
            // sums that differ in the last digits must not drop the best.
            let bar = least[end] + 1e-12 * best.abs();
            for candidate in &mut candidates {
                if candidate.bound > bar
                    && candidate.until == usize::MAX
                    && candidate.bound > bar + cost.price_of_parting(end - candidate.begin, rows - end)
                {
                    candidate.until = end + self.shortest;
                }
            }
        }
        let mut changes = vec![];
        let mut end = rows;
        while origin[end] > 0 {
            end = origin[end];
            changes.push(end);
        }
        changes.reverse();
        let total = least[rows] - cost.penalty * changes.len() as f64;
        Ok(Divided { cost: total, changes, penalty: cost.penalty })
    }
}

/// A row at which the last stretch may begin.
struct Candidate {
    begin: usize,
    /// End from which it need not be looked at.
    until: usize,
    /// Cost with it at the end that is looked at.
    bound: f64,
}

/// Costs of all stretches, from running sums.
struct Costs {
    kind: Cost,
    /// Sums of values and of their squares before each row, each value less the mean of all.
    sums: Vec<(f64, f64)>,
    penalty: f64,
    /// Price of a unit of the logarithm of a stretch's length.
    length_price: f64,
    floor: f64,
}

impl Costs {
    fn new(division: &Division, series: &[f64]) -> Result<Self, RegimeError> {
        let Division { cost: kind, penalty, shortest } = *division;
        RegimeError::all_finite(series)?;
        let least = if kind == Cost::MeanAndVariance { 2 } else { 1 };
        let hint = "from 1; from 2 where stretches have a variance";
        RegimeError::setting("shortest", shortest as f64, shortest >= least, hint)?;
        let needed = (2 * shortest).max(3);
        if series.len() < needed {
            return Err(RegimeError::TooShort { what: "change points", found: series.len(), needed });
        }
        if let (Cost::Rate, Some(row)) = (kind, series.iter().position(|x| *x < 0.0)) {
            let hint = "counts are 0 or above";
            return Err(RegimeError::NotFinite { row, found: series[row], hint });
        }
        let count = series.len() as f64;
        // Rates are of sums as they are.
        let center = if kind == Cost::Rate { 0.0 } else { series.iter().sum::<f64>() / count };
        let mut sums = Vec::with_capacity(series.len() + 1);
        let (mut sum, mut squares) = (0.0, 0.0);
        sums.push((0.0, 0.0));
        for value in series {
            sum += value - center;
            squares += (value - center) * (value - center);
            sums.push((sum, squares));
        }
        let noise = noise_variance(series).unwrap_or(squares / count);
        let unit = if kind == Cost::Mean { noise } else { 1.0 };
        let parameters = if kind == Cost::MeanAndVariance { 2.0 } else { 1.0 };
        let (penalty, length_price) = match penalty {
            Penalty::Bic => ((parameters + 1.0) * count.ln() * unit, 0.0),
            Penalty::Mbic => ((parameters + 2.0) * count.ln() * unit, unit),
            Penalty::Given(given) => {
                RegimeError::setting("penalty", given, given.is_finite() && given > 0.0, "above 0, or by a criterion")?;
                (given, 0.0)
            }
        };
        let floor = (FLOOR * noise).max(f64::MIN_POSITIVE);
        Ok(Self { kind, sums, penalty, length_price, floor })
    }

    /// What a stretch of `rows` and one of up to `left` after it cost more than both as one, at most, but for what they gain: the
    /// price of their lengths, which grows with each.
    fn price_of_parting(&self, rows: usize, left: usize) -> f64 {
        if self.length_price == 0.0 || left == 0 {
            return 0.0;
        }
        let (rows, left) = (rows as f64, left as f64);
        self.length_price * (rows * left / (rows + left)).ln().max(0.0)
    }

    /// Cost of rows `from` to `to`, the latter not among them.
    #[inline]
    fn of(&self, from: usize, to: usize) -> f64 {
        let ((sum_before, squares_before), (sum, squares)) = (self.sums[from], self.sums[to]);
        let (count, sum, squares) = ((to - from) as f64, sum - sum_before, squares - squares_before);
        let cost = match self.kind {
            Cost::Mean => (squares - sum * sum / count).max(0.0),
            Cost::MeanAndVariance => {
                let mean = sum / count;
                let variance = (squares / count - mean * mean).max(0.0);
                // The most likely variance that is no less than the floor. What is not most likely could cost less as one stretch
                // than as two, and beginnings would be dropped that are the best later on.
                let allowed = variance.max(self.floor);
                count * (allowed.ln() + variance / allowed)
            }
            Cost::Rate if sum > 0.0 => -2.0 * sum * (sum / count).ln(),
            Cost::Rate => 0.0,
        };
        if self.length_price > 0.0 { cost + self.length_price * count.ln() } else { cost }
    }
}

/// Variance of the noise, from the median of absolute differences of neighbouring rows, which changes and outliers hardly touch;
/// `None` where more than half of them are 0.
fn noise_variance(series: &[f64]) -> Option<f64> {
    let mut differences: Vec<f64> = series.windows(2).map(|w| (w[1] - w[0]).abs()).collect();
    let middle = differences.len() / 2;
    let (_, median, _) = differences.select_nth_unstable_by(middle, f64::total_cmp);
    // Of Gaussian noise, the median of absolute deviations is 0.6745 standard deviations, and differences have twice the variance.
    let deviation = *median / (0.674_489_750_196_081_7 * std::f64::consts::SQRT_2);
    (deviation > 0.0).then_some(deviation * deviation)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim2real::Seed;
    use proptest::prelude::*;
    use rand_distr::{Distribution, StandardNormal};

    /// Every stretch at every end: exact, in quadratic time.
    fn by_all_pairs(division: &Division, series: &[f64]) -> (f64, Vec<usize>) {
        let costs = Costs::new(division, series).unwrap();
        let mut least = vec![f64::INFINITY; series.len() + 1];
        let mut origin = vec![0; series.len() + 1];
        least[0] = -costs.penalty;
        for end in division.shortest..=series.len() {
            for from in 0..=end - division.shortest {
                let total = least[from] + costs.of(from, end) + costs.penalty;
                if total < least[end] {
                    (least[end], origin[end]) = (total, from);
                }
            }
        }
        let (mut changes, mut end) = (vec![], series.len());
        while origin[end] > 0 {
            end = origin[end];
            changes.insert(0, end);
        }
        (least[series.len()], changes)
    }

    fn check(division: Division, series: &[f64]) {
        let found = division.divide(series).unwrap();
        let (total, changes) = by_all_pairs(&division, series);
        let ours = found.cost + found.penalty * found.changes.len() as f64;
        assert!((ours - total).abs() <= 1e-9 * (1.0 + total.abs()), "{division:?}: {ours} and {total}");
        assert_eq!(found.changes, changes, "{division:?}");
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]
        #[test]
        fn it_is_exact(
            levels in prop::collection::vec((-5.0..5.0_f64, 0.2..3.0_f64, 1..40_usize), 1..8),
            seed in 0..u64::MAX,
            shortest in 2..12_usize,
            given in 0.5..30.0_f64,
        ) {
            let mut draws = Seed(seed).stream("noise");
            let series: Vec<f64> = levels.iter().flat_map(|(level, spread, rows)| {
                (0..*rows).map(|_| { let e: f64 = StandardNormal.sample(&mut *draws); level + spread * e }).collect::<Vec<_>>()
            }).collect();
            prop_assume!(series.len() >= 2 * shortest);
            for cost in [Cost::Mean, Cost::MeanAndVariance] {
                for penalty in [Penalty::Bic, Penalty::Mbic, Penalty::Given(given)] {
                    check(Division { cost, penalty, shortest }, &series);
                    if cost == Cost::Mean {
                        check(Division { cost, penalty, shortest: 1 }, &series);
                    }
                }
            }
            let counts: Vec<f64> = series.iter().map(|x| x.abs().floor()).collect();
            for penalty in [Penalty::Bic, Penalty::Mbic, Penalty::Given(given)] {
                check(Division { cost: Cost::Rate, penalty, shortest: shortest - 1 }, &counts);
            }
        }
    }

    /// Rows so near to each other that their variance is below the least, where two stretches are still no dearer than one.
    #[test]
    fn it_is_exact_where_the_noise_is_below_the_least() {
        let mut draws = Seed(14).stream("noise");
        for _ in 0..300 {
            let series: Vec<f64> = (0..60)
                .map(|row| {
                    let e: f64 = StandardNormal.sample(&mut *draws);
                    if row / 4 % 3 == 0 { 0.02 * e } else { e }
                })
                .collect();
            check(Division { cost: Cost::MeanAndVariance, penalty: Penalty::Given(0.5), shortest: 2 }, &series);
        }
    }

    #[test]
    fn changes_are_found_where_they_are() {
        let mut draws = Seed(11).stream("noise");
        let mut series: Vec<f64> = (0..900).map(|_| StandardNormal.sample(&mut *draws)).collect();
        series[300..600].iter_mut().for_each(|x| *x += 3.0);
        series[600..].iter_mut().for_each(|x| *x = 3.0 + 4.0 * *x);
        let division = Division { cost: Cost::MeanAndVariance, penalty: Penalty::Mbic, shortest: 5 };
        let found = division.divide(&series).unwrap().changes;
        assert!(found.len() == 2 && found[0].abs_diff(300) <= 3 && found[1].abs_diff(600) <= 6, "{found:?}");
        // What does not depend on the units of the series.
        let scaled: Vec<f64> = series.iter().map(|x| 1e-4 * x + 1e3).collect();
        assert_eq!(division.divide(&scaled).unwrap().changes, found);
        let mean = Division { cost: Cost::Mean, penalty: Penalty::Bic, shortest: 1 };
        let found = mean.divide(&series[..600]).unwrap();
        assert!(found.changes.len() == 1 && found.changes[0].abs_diff(300) <= 3, "{found:?}");
    }

    #[test]
    fn the_noise_is_found_under_changes() {
        let mut draws = Seed(12).stream("noise");
        let steps = (0..20_000).map(|row| 10.0 * f64::from(row / 1_000 % 2));
        let series: Vec<f64> = steps
            .map(|level| {
                let e: f64 = StandardNormal.sample(&mut *draws);
                level + 3.0 * e
            })
            .collect();
        let variance = noise_variance(&series).unwrap();
        assert!((variance / 9.0 - 1.0).abs() < 0.05, "{variance}");
        assert_eq!(noise_variance(&[1.0, 1.0, 1.0, 2.0]), None);
    }

    /// Rounded to steps as wide as the noise, so that rows in a row are equal by chance.
    #[test]
    fn rows_on_one_tick_are_no_stretch() {
        let mut draws = Seed(13).stream("noise");
        let rounded = |_| {
            let e: f64 = StandardNormal.sample(&mut *draws);
            e.round()
        };
        let series: Vec<f64> = (0..5_000).map(rounded).collect();
        assert!(series.windows(5).any(|w| w.iter().all(|x| *x == w[0])));
        let division = Division { cost: Cost::MeanAndVariance, penalty: Penalty::Mbic, shortest: 5 };
        assert_eq!(division.divide(&series).unwrap().changes, Vec::<usize>::new());
    }

    #[test]
    fn a_constant_has_no_changes() {
        for cost in [Cost::Mean, Cost::MeanAndVariance, Cost::Rate] {
            for penalty in [Penalty::Given(1.0), Penalty::Bic, Penalty::Mbic] {
                let found = Division { cost, penalty, shortest: 2 }.divide(&[4.0; 100]).unwrap();
                assert_eq!(found.changes, Vec::<usize>::new(), "{cost:?}, {penalty:?}");
            }
        }
    }

    #[test]
    fn what_cannot_be_divided() {
        let division = |penalty, shortest| Division { cost: Cost::MeanAndVariance, penalty, shortest };
        for wrong in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let told = division(Penalty::Given(wrong), 2).divide(&[1.0; 10]).unwrap_err().to_string();
            assert!(told.contains("penalty = ") && told.contains("hint: above 0"), "{told}");
        }
        let series = [1.0, 2.0, f64::NAN, 3.0];
        assert!(matches!(division(Penalty::Bic, 2).divide(&series), Err(RegimeError::NotFinite { row: 2, .. })));
        assert!(matches!(division(Penalty::Bic, 1).divide(&[1.0; 9]), Err(RegimeError::Setting { .. })));
        let short = division(Penalty::Bic, 5).divide(&[1.0; 9]).unwrap_err();
        assert_eq!(short, RegimeError::TooShort { what: "change points", found: 9, needed: 10 });
        assert!(matches!(division(Penalty::Bic, 2).divide(&[]), Err(RegimeError::TooShort { .. })));
        let counts = Division { cost: Cost::Rate, penalty: Penalty::Bic, shortest: 1 };
        assert!(counts.divide(&[1.0, -1.0, 2.0]).unwrap_err().to_string().contains("row 1: -1"));
    }
}
