//! Mean and variance of what was seen so far.

/// Running mean and variance of rows of numbers. Two can be merged, as those of two threads.
///
/// Sums are taken of differences to the mean so far, so that a mean far from 0 costs no digits: Welford, "Note on a method for
/// calculating corrected sums of squares and products", Technometrics 4(3), 1962; merged as in Chan, Golub and LeVeque, "Updating
/// formulae and a pairwise algorithm for computing sample variances", Stanford STAN-CS-79-773, 1979.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Moments {
    count: u64,
    mean: Vec<f64>,
    /// Sums of squared differences to the mean.
    squares: Vec<f64>,
    /// Sums of differences and of their squares of rows that are being added.
    sums: Vec<[f64; 2]>,
}

impl Moments {
    /// Of rows of `size` numbers, none of which was seen.
    #[must_use]
    pub fn new(size: usize) -> Self {
        Self { count: 0, mean: vec![0.0; size], squares: vec![0.0; size], sums: vec![[0.0; 2]; size] }
    }

    /// How many rows were seen.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.count
    }

    /// The mean of each number; 0 before any was seen.
    #[must_use]
    pub fn mean(&self) -> &[f64] {
        &self.mean
    }

    /// The variance of each number, over all rows that were seen; 0 before any was.
    pub fn variance(&self) -> impl Iterator<Item = f64> {
        let count = self.count.max(1) as f64;
        self.squares.iter().map(move |squares| squares / count)
    }

    /// Sees a row.
    pub fn add(&mut self, row: &[f64]) {
        self.count += 1;
        let weight = (self.count as f64).recip();
        for ((value, mean), squares) in row.iter().zip(&mut self.mean).zip(&mut self.squares) {
            let before = value - *mean;
            *mean += weight * before;
            *squares += before * (value - *mean);
        }
    }

    /// Sees those of `rows`, row after row, that `which` selects.
    pub fn add_rows(&mut self, rows: &[f32], which: impl Fn(usize) -> bool) {
        let size = self.mean.len();
        let mut selected = rows.chunks_exact(size.max(1)).enumerate().filter(|(row, _)| which(*row)).map(|(_, row)| row);
        if self.count == 0 {
            let Some(first) = selected.next() else { return };
            self.count = 1;
            self.mean.iter_mut().zip(first).for_each(|(mean, value)| *mean = (*value).into());
        }
        self.sums.fill([0.0; 2]);
        let mut count = 0_u64;
        for row in selected {
            count += 1;
            for ((value, mean), sums) in row.iter().zip(&self.mean).zip(&mut self.sums) {
                let difference = f64::from(*value) - mean;
                sums[0] += difference;
                sums[1] += difference * difference;
            }
        }
        if count == 0 {
            return;
        }
        let (before, now) = (self.count as f64, (self.count + count) as f64);
        for ((mean, squares), [sum, sum_of_squares]) in self.mean.iter_mut().zip(&mut self.squares).zip(&self.sums) {
            // The difference of the means of rows seen before and now is sum / count, so that of Chan's formula
            // (sum of squares about the new rows' mean) + difference^2 before count / now, this is left.
            *squares += (sum_of_squares - sum * sum / count as f64) + (sum / count as f64) * sum * (before / now);
            *mean += sum / now;
        }
        self.count += count;
    }

    /// Sees all that `other` saw.
    ///
    /// # Panics
    /// If rows of the two are not equally long: an error of the calling code, not of any input.
    pub fn merge(&mut self, other: &Self) {
        assert_eq!(self.mean.len(), other.mean.len(), "rows of different lengths");
        if other.count == 0 {
            return;
        }
        let (one, two) = (self.count as f64, other.count as f64);
        for k in 0..self.mean.len() {
            let difference = other.mean[k] - self.mean[k];
            self.mean[k] += difference * (two / (one + two));
            self.squares[k] += other.squares[k] + difference * difference * (one * two / (one + two));
        }
        self.count += other.count;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rl::{Episode, StreamName};

    fn rows(count: usize) -> Vec<f32> {
        let mut stream = Episode::default().stream(StreamName::new("rows"));
        // Far from 0 for its spread, where a sum of squares would lose all digits in single precision.
        (0..count).flat_map(|_| [stream.uniform() as f32, 1e4 + stream.uniform() as f32]).collect()
    }

    fn direct(rows: &[f32], k: usize) -> [f64; 2] {
        let values: Vec<f64> = rows.iter().skip(k).step_by(2).map(|v| f64::from(*v)).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        [mean, values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64]
    }

    fn agrees(moments: &Moments, rows: &[f32]) {
        assert_eq!(moments.count() as usize, rows.len() / 2);
        for (k, variance) in moments.variance().enumerate() {
            let [mean, expected] = direct(rows, k);
            assert!((moments.mean()[k] - mean).abs() < 1e-9 * mean.abs().max(1.0), "{k}: {} {mean}", moments.mean()[k]);
            assert!((variance - expected).abs() < 1e-9, "{k}: {variance} {expected}");
        }
    }

    #[test]
    fn one_by_one_in_batches_and_merged_they_are_what_two_passes_give() {
        let all = rows(1000);
        let mut single = Moments::new(2);
        all.chunks(2).for_each(|row| single.add(&[row[0].into(), row[1].into()]));
        agrees(&single, &all);
        let mut batches = Moments::new(2);
        all.chunks(2 * 17).for_each(|rows| batches.add_rows(rows, |_| true));
        agrees(&batches, &all);
        let (left, right) = all.split_at(2 * 300);
        let [mut one, mut two] = [Moments::new(2), Moments::new(2)];
        one.add_rows(left, |_| true);
        two.add_rows(right, |_| true);
        one.merge(&two);
        one.merge(&Moments::new(2));
        agrees(&one, &all);
        let mut from_nothing = Moments::new(2);
        from_nothing.merge(&one);
        agrees(&from_nothing, &all);
    }

    #[test]
    fn rows_that_are_not_selected_are_not_seen() {
        let all = rows(100);
        let mut odd = Moments::new(2);
        odd.add_rows(&all, |row| row % 2 == 1);
        let kept: Vec<f32> = all.chunks(2).skip(1).step_by(2).flatten().copied().collect();
        agrees(&odd, &kept);
        odd.add_rows(&all, |_| false);
        agrees(&odd, &kept);
        let mut none = Moments::new(2);
        none.add_rows(&all, |_| false);
        assert_eq!(none, Moments::new(2));
    }
}
