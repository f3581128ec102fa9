//! The regression line of a window.

use super::co_moments::CoMoments;
use super::double_double::DoubleDouble;
use super::{Indicator, Period};

/// The line through the last `period` pairs (x, y) that is closest to y by least squares (C. F. Gauss, Theoria motus, 1809).
/// There is none where x or y does not vary.
#[derive(Debug, Clone, PartialEq)]
pub struct Regression(CoMoments);

/// A line, `y = intercept + slope x`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// What y rises by as x rises by 1.
    pub slope: f64,
    /// y where x is 0.
    pub intercept: f64,
    /// How far the last y lies above the line.
    pub residual: f64,
    /// Standard deviation of all residuals of the window, as a population. Below 1e-12 of that of y it is rounding, and
    /// counts as 0.
    pub deviation: f64,
}

impl Regression {
    /// The line through the last `period` pairs.
    #[must_use]
    pub fn new(period: Period) -> Self {
        Self(CoMoments::new(period))
    }
}

impl Indicator for Regression {
    type Input = (f64, f64);
    type Output = Line;

    #[inline]
    fn update(&mut self, input: (f64, f64)) -> Option<Line> {
        if self.0.update(input) { self.value() } else { None }
    }

    fn value(&self) -> Option<Line> {
        let scatter = self.0.scatter()?;
        let (xx, yy) = (scatter.xx.to_f64(), scatter.yy.to_f64());
        let slope = scatter.xy.to_f64() / xx;
        let ([mean_x, mean_y], (x, y)) = (scatter.mean, self.0.last());
        // What y varies by, less what the line explains: a small difference of large numbers where the fit is good.
        let left: DoubleDouble = scatter.xx * scatter.yy - scatter.xy * scatter.xy;
        let unexplained = left.to_f64() / xx;
        let count = self.0.period().to_f64();
        let deviation = if unexplained > 1e-24 * yy { unexplained.sqrt() / count } else { 0.0 };
        Some(Line { slope, intercept: mean_y - slope * mean_x, residual: (y - mean_y) - slope * (x - mean_x), deviation })
    }

    fn is_ready(&self) -> bool {
        self.0.is_ready()
    }

    fn reset(&mut self) {
        self.0.reset();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_of_a_window() {
        let mut regression = Regression::new(Period::new(3).unwrap());
        let lines = [(9.0, 9.0), (0.0, 1.0), (1.0, 3.0), (2.0, 2.0), (3.0, 1.0)].map(|pair| regression.update(pair));
        // (0,1), (1,3), (2,2): slope 1/2, mean 2 at x = 1; residuals -1/2, 1, -1/2.
        let line = lines[3].unwrap();
        assert!((line.slope - 0.5).abs() < 1e-15 && (line.intercept - 1.5).abs() < 1e-15);
        assert!((line.residual + 0.5).abs() < 1e-15 && (line.deviation - 0.5_f64.sqrt()).abs() < 1e-15);
        assert_eq!(lines[4].unwrap(), Line { slope: -1.0, intercept: 4.0, residual: 0.0, deviation: 0.0 });
    }

    /// Two prices that go together, ten million times: the line is that of the last window alone.
    #[test]
    fn ten_million_updates_leave_no_drift() {
        let mut regression = Regression::new(Period::new(30).unwrap());
        let mut state = 1_u64;
        let mut last = [(0.0, 0.0); 30];
        for k in 0..10_000_000_usize {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let x = (5_000_000 + (state >> 59)) as f64 * 0.01;
            let y = 2.0 * x + ((state >> 50) & 15) as f64 * 0.01;
            last[k % 30] = (x, y);
            regression.update((x, y));
        }
        let mean = |of: fn(&(f64, f64)) -> f64| last.iter().map(of).sum::<f64>() / 30.0;
        let (x, y) = (mean(|p| p.0), mean(|p| p.1));
        let sum = |of: &dyn Fn(&(f64, f64)) -> f64| last.iter().map(of).sum::<f64>();
        let slope = sum(&|p| (p.0 - x) * (p.1 - y)) / sum(&|p| (p.0 - x).powi(2));
        let error = (regression.value().unwrap().slope / slope - 1.0).abs();
        assert!(error < 1e-9, "{error:e}");
    }
}
