//! Cumulative sums: whether a mean has shifted, online, with a known rate of false alarms.

use serde::{Deserialize, Serialize};

use super::RegimeError;

/// What a random walk overshoots a bound by, on average, on both sides together (D. Siegmund, *Sequential analysis*, 1985).
const OVERSHOOT: f64 = 1.166;

/// A two-sided cumulative sum: sums of what exceeds the target by more than `slack`, upward and downward, each never below 0.
/// An alarm is raised where a sum exceeds `threshold`. All are in units of the standard deviation.
///
/// Source: E. S. Page, *Continuous inspection schemes*, Biometrika 41 (1954).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct CusumSettings {
    /// Mean while all is well [units of the series].
    pub target: f64,
    /// Standard deviation while all is well [units of the series], above 0.
    pub deviation: f64,
    /// Half the shift that is to be found soonest [standard deviations], 0 or above: 0.5 for a shift of 1.
    pub slack: f64,
    /// Sum at which an alarm is raised [standard deviations], above 0.
    pub threshold: f64,
}

impl CusumSettings {
    /// Settings that raise a false alarm every `rows` rows on average, as far as Siegmund's approximation goes (a few percent for
    /// 100 rows and more) and rows are independent and Gaussian.
    ///
    /// # Errors
    /// Settings out of range, fewer than 2 rows.
    pub fn for_false_alarms_every(rows: f64, target: f64, deviation: f64, slack: f64) -> Result<Self, RegimeError> {
        RegimeError::setting("rows between false alarms", rows, rows.is_finite() && rows >= 2.0, "2 or more, such as 500")?;
        let with = |threshold| Self { target, deviation, slack, threshold };
        with(1.0).check()?;
        let (mut low, mut high) = (0.0, 1.0);
        while with(high).run_length(0.0) < rows {
            high *= 2.0;
        }
        while high - low > 1e-12 * high {
            let middle = 0.5 * (low + high);
            if with(middle).run_length(0.0) < rows { low = middle } else { high = middle }
        }
        let found = with(0.5 * (low + high));
        found.check()?;
        Ok(found)
    }

    /// Expected number of rows to an alarm after the mean has shifted by `shift` [standard deviations]: with 0, between false
    /// alarms. By Siegmund's approximation, for independent Gaussian rows.
    #[must_use]
    pub fn run_length(&self, shift: f64) -> f64 {
        let one_sided = |drift: f64| {
            let bound = self.threshold + OVERSHOOT;
            let exponent = 2.0 * drift * bound;
            // The limit where nothing drifts: (e^-x + x - 1) / x^2 is 1/2.
            if exponent.abs() < 1e-4 {
                return bound * bound * (1.0 - exponent / 3.0);
            }
            ((-exponent).exp_m1() + exponent) / (2.0 * drift * drift)
        };
        1.0 / (1.0 / one_sided(shift - self.slack) + 1.0 / one_sided(-shift - self.slack))
    }

    fn check(&self) -> Result<(), RegimeError> {
        RegimeError::setting("target", self.target, self.target.is_finite(), "any finite number")?;
        let above = |x: f64| x.is_finite() && x > 0.0;
        RegimeError::setting("deviation", self.deviation, above(self.deviation), "above 0, in units of the series")?;
        let slack = self.slack.is_finite() && self.slack >= 0.0;
        RegimeError::setting("slack", self.slack, slack, "0 or above, such as 0.5 for a shift of 1 standard deviation")?;
        RegimeError::setting("threshold", self.threshold, above(self.threshold), "above 0, such as 4 or 5")
    }
}

/// Which way a mean has shifted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Shift {
    /// Upward.
    Up,
    /// Downward.
    Down,
}

/// An alarm of a [`Cusum`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Alarm {
    /// Which way.
    pub shift: Shift,
    /// Row at which it was raised, from 0.
    pub row: u64,
    /// Row from which the sum has been above 0: the estimate of when the mean shifted.
    pub since: u64,
}

/// A cumulative sum under way. After an alarm both sums begin anew. A NaN was lost, and changes nothing but the count of rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Cusum {
    settings: CusumSettings,
    /// Upward and downward, each with the row from which it has been above 0.
    sums: [(f64, u64); 2],
    rows: u64,
}

impl Cusum {
    /// Before the first row.
    ///
    /// # Errors
    /// Settings out of range.
    pub fn new(settings: CusumSettings) -> Result<Self, RegimeError> {
        settings.check()?;
        Ok(Self { settings, sums: [(0.0, 0); 2], rows: 0 })
    }

    /// Takes the next row.
    ///
    /// # Errors
    /// An infinite value; nothing is changed by it.
    #[inline]
    pub fn step(&mut self, value: f64) -> Result<Option<Alarm>, RegimeError> {
        if value.is_infinite() {
            let hint = "NaN stands for a sample that was lost";
            return Err(RegimeError::NotFinite { row: self.rows as usize, found: value, hint });
        }
        let row = self.rows;
        self.rows += 1;
        if value.is_nan() {
            return Ok(None);
        }
        let CusumSettings { target, deviation, slack, threshold } = self.settings;
        let white = (value - target) / deviation;
        for ((sum, since), stray) in self.sums.iter_mut().zip([white, -white]) {
            if *sum == 0.0 {
                *since = row;
            }
            *sum = (*sum + stray - slack).max(0.0);
        }
        let [(up, up_since), (down, down_since)] = self.sums;
        let (shift, since) = match (up > threshold, down > threshold) {
            (false, false) => return Ok(None),
            (true, _) => (Shift::Up, up_since),
            _ => (Shift::Down, down_since),
        };
        self.sums = [(0.0, 0); 2];
        Ok(Some(Alarm { shift, row, since }))
    }

    /// The sums, upward and downward [standard deviations].
    #[must_use]
    pub fn sums(&self) -> [f64; 2] {
        self.sums.map(|(sum, _)| sum)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim2real::Seed;
    use proptest::prelude::*;
    use rand_distr::{Distribution, StandardNormal};

    fn settings(threshold: f64) -> CusumSettings {
        CusumSettings { target: 10.0, deviation: 2.0, slack: 0.5, threshold }
    }

    /// D. C. Montgomery, *Introduction to statistical quality control*, gives 338.2 and 10.34 for one side (k = 1/2, h = 4 and
    /// h = 5), and 469 between false alarms for both at h = 5; 168 at h = 4 is the exact value, here within a percent.
    #[test]
    fn run_lengths_as_published() {
        assert!((settings(5.0).run_length(0.0) - 469.1).abs() < 0.1);
        assert!((settings(4.0).run_length(0.0) - 168.0).abs() < 1.7);
        assert!((settings(5.0).run_length(1.0) - 10.34).abs() < 0.01);
        let none = CusumSettings { slack: 0.0, ..settings(3.0) };
        let nearly = CusumSettings { slack: 1e-4, ..none };
        assert!((none.run_length(0.0) / nearly.run_length(0.0) - 1.0).abs() < 1e-3);
        let wanted = CusumSettings::for_false_alarms_every(469.1, 10.0, 2.0, 0.5).unwrap();
        assert!((wanted.threshold - 5.0).abs() < 1e-3, "{wanted:?}");
    }

    /// 4 million rows: about 8,000 runs, so 1.1 % of chance.
    #[test]
    fn false_alarms_come_as_often_as_asked_for() {
        let settings = CusumSettings::for_false_alarms_every(500.0, 10.0, 2.0, 0.5).unwrap();
        let mut cusum = Cusum::new(settings).unwrap();
        let mut draws = Seed(2).stream("noise");
        let mut alarms = 0;
        for _ in 0..4_000_000 {
            let noise: f64 = StandardNormal.sample(&mut *draws);
            alarms += u32::from(cusum.step(10.0 + 2.0 * noise).unwrap().is_some());
        }
        let between = 4e6 / f64::from(alarms);
        assert!((between / 500.0 - 1.0).abs() < 0.06, "{between}");
    }

    #[test]
    fn shifts_are_told_with_their_begin() {
        let mut cusum = Cusum::new(settings(4.0)).unwrap();
        // Deviations of -0.5 bring no sum above 0; from row 20 on each adds 1.5.
        let series = [9.0; 20].into_iter().chain([14.0; 5]);
        let alarms: Vec<Alarm> = series.filter_map(|x| cusum.step(x).unwrap()).collect();
        assert_eq!(alarms, [Alarm { shift: Shift::Up, row: 22, since: 20 }]);
        let mut cusum = Cusum::new(settings(4.0)).unwrap();
        let alarms: Vec<Alarm> =
            [10.0, f64::NAN, 6.0, 6.0, 6.0].into_iter().filter_map(|x| cusum.step(x).unwrap()).collect();
        assert_eq!(alarms, [Alarm { shift: Shift::Down, row: 4, since: 2 }]);
        assert_eq!(cusum.sums(), [0.0, 0.0]);
    }

    #[test]
    fn settings_out_of_range() {
        let wrong = [
            CusumSettings { deviation: 0.0, ..settings(4.0) },
            CusumSettings { slack: -0.1, ..settings(4.0) },
            CusumSettings { target: f64::NAN, ..settings(4.0) },
            settings(0.0),
        ];
        for settings in wrong {
            assert!(Cusum::new(settings).unwrap_err().to_string().contains("hint:"));
        }
        assert!(CusumSettings::for_false_alarms_every(1.0, 0.0, 1.0, 0.5).is_err());
        let told = Cusum::new(settings(4.0)).unwrap().step(f64::NEG_INFINITY).unwrap_err();
        assert!(matches!(told, RegimeError::NotFinite { row: 0, .. }));
    }

    proptest! {
        #[test]
        fn the_future_changes_nothing(
            past in prop::collection::vec(5.0..15.0_f64, 1..80),
            one in prop::collection::vec(-50.0..50.0_f64, 1..20),
            other in prop::collection::vec(-50.0..50.0_f64, 1..20),
        ) {
            let follow = |future: &[f64]| {
                let mut cusum = Cusum::new(settings(2.0)).unwrap();
                let said = past.iter().chain(future).map(|x| (cusum.step(*x).unwrap(), cusum.sums().map(f64::to_bits)));
                said.take(past.len()).collect::<Vec<_>>()
            };
            prop_assert_eq!(follow(&one), follow(&other));
        }
    }
}
