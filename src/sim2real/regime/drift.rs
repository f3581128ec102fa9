//! Whether the last rows are still of the distribution they once were, online.

use std::collections::VecDeque;

use super::RegimeError;
use super::two_sample::{Apart, largest_gap, p_value, sorted};

/// The last rows of a series beside a reference, row by row, by the Kolmogorov-Smirnov distance.
///
/// It knows the reference and the rows so far, never one to come. Windows that overlap say almost the same, so an alarm at
/// level `alpha` comes about as often as in one look for every window's length of rows, and somewhat more: where a rate of false
/// alarms is wanted, divide `alpha` by the number of such lengths that are watched. A NaN was lost, and is not counted.
#[derive(Debug, Clone, PartialEq)]
pub struct DriftWindow {
    /// In ascending order.
    reference: Vec<f64>,
    /// The last rows as they came.
    recent: VecDeque<f64>,
    /// The same in ascending order.
    ascending: Vec<f64>,
    window: usize,
    /// Least distance whose p-value is below `alpha`.
    bound: f64,
    rows: u64,
}

impl DriftWindow {
    /// Watches windows of `window` rows against `reference`, at level `alpha` in any one look.
    ///
    /// # Errors
    /// A reference that is empty or not finite, a window of less than 2 rows, a level outside of (0, 1), and one that no distance
    /// of samples so small can reach.
    pub fn new(reference: &[f64], window: usize, alpha: f64) -> Result<Self, RegimeError> {
        let reference = sorted(reference)?;
        RegimeError::setting("window", window as f64, window >= 2, "a whole number from 2, such as 100")?;
        RegimeError::setting("alpha", alpha, alpha > 0.0 && alpha < 1.0, "between 0 and 1, such as 0.001")?;
        let p = |distance| p_value(distance, reference.len(), window);
        RegimeError::setting("alpha", alpha, p(1.0) < alpha, "larger: samples of this size are never that improbable")?;
        let (mut low, mut high) = (0.0, 1.0);
        while high - low > 1e-9 {
            let middle = 0.5 * (low + high);
            if p(middle) < alpha { high = middle } else { low = middle }
        }
        Ok(Self {
            reference,
            recent: VecDeque::with_capacity(window),
            ascending: Vec::with_capacity(window),
            window,
            bound: high - 1e-9,
            rows: 0,
        })
    }

    /// Takes the next row: whether the last `window` rows are of another distribution than the reference. `false` until there are
    /// as many.
    ///
    /// # Errors
    /// An infinite value; nothing is changed by it.
    pub fn step(&mut self, value: f64) -> Result<bool, RegimeError> {
        if value.is_infinite() {
            let hint = "NaN stands for a sample that was lost";
            return Err(RegimeError::NotFinite { row: self.rows as usize, found: value, hint });
        }
        self.rows += 1;
        if value.is_nan() {
            return Ok(false);
        }
        let value = value + 0.0;
        if self.recent.len() == self.window
            && let Some(oldest) = self.recent.pop_front()
        {
            let at = self.ascending.partition_point(|x| *x < oldest);
            self.ascending.remove(at);
        }
        self.recent.push_back(value);
        let at = self.ascending.partition_point(|x| *x <= value);
        self.ascending.insert(at, value);
        Ok(self.distance().is_some_and(|distance| distance >= self.bound))
    }

    /// The Kolmogorov-Smirnov distance of the last rows from the reference; `None` until there are enough.
    #[must_use]
    pub fn distance(&self) -> Option<f64> {
        (self.recent.len() == self.window).then(|| largest_gap(&self.ascending, &self.reference))
    }

    /// The distance and its p-value in this one look; `None` until there are enough rows.
    #[must_use]
    pub fn apart(&self) -> Option<Apart> {
        let distance = self.distance()?;
        Some(Apart { distance, p_value: p_value(distance, self.reference.len(), self.window) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim2real::Seed;
    use crate::sim2real::regime::kolmogorov_smirnov;
    use proptest::prelude::*;
    use rand_distr::{Distribution, StandardNormal};

    fn noise(rows: usize, seed: u64) -> Vec<f64> {
        let mut draws = Seed(seed).stream("noise");
        (0..rows).map(|_| StandardNormal.sample(&mut *draws)).collect()
    }

    /// The window slid along gives what the test gives of the same rows, ties and lost rows among them.
    #[test]
    fn each_look_is_the_test_of_its_rows() {
        let reference = noise(150, 1);
        let mut series: Vec<f64> = noise(300, 2).iter().map(|x| (4.0 * x).round() / 4.0).collect();
        series[100..].iter_mut().for_each(|x| *x += 0.8);
        series[40] = f64::NAN;
        for window in [30, 120] {
            let mut drift = DriftWindow::new(&reference, window, 0.01).unwrap();
            let mut known = vec![];
            for value in &series {
                let alarm = drift.step(*value).unwrap();
                known.extend(Some(*value).filter(|x| !x.is_nan()));
                if known.len() < window {
                    assert_eq!((alarm, drift.apart()), (false, None));
                } else if !value.is_nan() {
                    let expected = kolmogorov_smirnov(&known[known.len() - window..], &reference).unwrap();
                    assert_eq!(drift.apart(), Some(expected));
                    assert_eq!(alarm, expected.p_value < 0.01);
                }
            }
            assert!(drift.step(9.0).unwrap(), "a shift of 0.8 is not seen in {window} rows");
        }
    }

    /// One look in a hundred at level 0.01: 20,000 rows hold 200 windows that do not overlap.
    #[test]
    fn false_alarms_keep_to_the_level() {
        let mut drift = DriftWindow::new(&noise(5_000, 3), 100, 0.01).unwrap();
        let alarms: Vec<bool> = noise(40_000, 4).iter().map(|x| drift.step(*x).unwrap()).collect();
        let share = alarms.iter().filter(|a| **a).count() as f64 / alarms.len() as f64;
        assert!((0.002..0.03).contains(&share), "{share}");
    }

    #[test]
    fn what_cannot_be_watched() {
        assert!(matches!(DriftWindow::new(&[], 10, 0.01), Err(RegimeError::TooShort { .. })));
        assert!(matches!(DriftWindow::new(&[1.0], 1, 0.01), Err(RegimeError::Setting { name: "window", .. })));
        for alpha in [0.0, 1.0, f64::NAN] {
            let told = DriftWindow::new(&[1.0, 2.0], 10, alpha).unwrap_err().to_string();
            assert!(told.contains("alpha = ") && told.contains("hint:"), "{told}");
        }
        // Three against three values: the least p-value is 0.1.
        let told = DriftWindow::new(&[1.0, 2.0, 3.0], 3, 0.05).unwrap_err().to_string();
        assert!(told.contains("never that improbable"), "{told}");
        assert!(DriftWindow::new(&[1.0, 2.0, 3.0], 3, 0.2).unwrap().step(f64::INFINITY).is_err());
    }

    proptest! {
        #[test]
        fn the_future_changes_nothing(
            past in prop::collection::vec(-2.0..2.0_f64, 10..80),
            one in prop::collection::vec(-50.0..50.0_f64, 1..20),
            other in prop::collection::vec(-50.0..50.0_f64, 1..20),
        ) {
            let reference = noise(30, 5);
            let follow = |future: &[f64]| {
                let mut drift = DriftWindow::new(&reference, 12, 0.05).unwrap();
                let said = past.iter().chain(future).map(|x| (drift.step(*x).unwrap(), drift.distance().map(f64::to_bits)));
                said.take(past.len()).collect::<Vec<_>>()
            };
            prop_assert_eq!(follow(&one), follow(&other));
        }
    }
}
