//! Wilder's directional movement.

use crate::market::Bar;

use super::{Indicator, Period, WilderAverage, true_range};

/// Wilder's average directional index (J. W. Wilder, New Concepts in Technical Trading Systems, 1978).
///
/// A bar moves up by what its high rises, if that is above 0 and above what its low falls; down by what its low falls, the
/// other way about. Wilder's averages of both over that of true ranges are +DI and -DI; `|+DI - -DI| / (+DI + -DI)`, again
/// averaged, is the index. A bar at which neither has moved for all it remembers has no such ratio, and the index stays.
///
/// Averages begin with the means of the first `period`, as in the book; TA-Lib begins with one less.
#[derive(Debug, Clone, PartialEq)]
pub struct Adx {
    before: Option<Bar>,
    up: WilderAverage,
    down: WilderAverage,
    range: WilderAverage,
    index: WilderAverage,
}

/// What [`Adx`] gives, each from 0 to 100.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Direction {
    /// How strong the direction is, whichever way.
    pub index: f64,
    /// +DI: the part of true ranges that went up.
    pub up: f64,
    /// -DI: the part of true ranges that went down.
    pub down: f64,
}

impl Adx {
    /// The index over `period` bars; 14 is usual.
    #[must_use]
    pub fn new(period: Period) -> Self {
        let average = WilderAverage::new(period);
        Self { before: None, up: average.clone(), down: average.clone(), range: average.clone(), index: average }
    }

    /// +DI and -DI.
    fn indicators(&self) -> Option<(f64, f64)> {
        let range = self.range.value().filter(|range| *range > 0.0)?;
        Some((100.0 * self.up.value()? / range, 100.0 * self.down.value()? / range))
    }
}

impl Indicator for Adx {
    type Input = Bar;
    type Output = Direction;

    #[inline]
    fn update(&mut self, input: Bar) -> Option<Direction> {
        let before = self.before.replace(input)?;
        let rise = input.high.to_f64() - before.high.to_f64();
        let fall = before.low.to_f64() - input.low.to_f64();
        self.up.update(if rise > fall { rise.max(0.0) } else { 0.0 });
        self.down.update(if fall > rise { fall.max(0.0) } else { 0.0 });
        self.range.update(true_range(before.close.to_f64(), &input));
        let (up, down) = self.indicators()?;
        if up + down > 0.0 {
            self.index.update(100.0 * (up - down).abs() / (up + down));
        }
        self.value()
    }

    fn value(&self) -> Option<Direction> {
        let (up, down) = self.indicators()?;
        Some(Direction { index: self.index.value()?, up, down })
    }

    fn is_ready(&self) -> bool {
        self.index.is_ready()
    }

    fn reset(&mut self) {
        self.before = None;
        for average in [&mut self.up, &mut self.down, &mut self.range, &mut self.index] {
            average.reset();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::market::Price;
    use crate::sim2real::Timestamp;

    #[test]
    fn bars_that_rise_go_up_alone() {
        let bar = |k: i64| {
            let [high, low, close] = [11, 9, 10].map(|p| Price((p + k) * 1_000_000_000));
            Bar { open_at: Timestamp(k), known_at: Timestamp(k + 1), open: close, high, low, close, volume: 0.0 }
        };
        let mut adx = Adx::new(Period::new(3).unwrap());
        let values: Vec<_> = (0..7).map(|k| adx.update(bar(k))).collect();
        assert!(values[..5].iter().all(Option::is_none));
        // Each rises by 1 and reaches 2: half of it went up, and nothing down.
        assert_eq!(values[5], Some(Direction { index: 100.0, up: 50.0, down: 0.0 }));
        // Then one that falls by 2: up (2 * 1 + 0) / 3, down (0 + 2) / 3, ranges (2 * 2 + 3) / 3.
        let last = values[6].and(adx.update(bar(4))).unwrap();
        assert!((last.up - 200.0 / 7.0).abs() < 1e-12 && (last.down - 200.0 / 7.0).abs() < 1e-12, "{last:?}");
        assert!((last.index - 200.0 / 3.0).abs() < 1e-12, "{last:?}");
    }
}
