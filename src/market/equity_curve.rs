//! The equity curve: a point an event, or so few that it stays small however many events there are.

use crate::sim2real::Timestamp;

use super::EquityPoint;

/// The points of equity that are kept.
#[derive(Debug, Clone)]
pub(super) struct EquityCurve {
    /// Of so long [ns], the first, lowest, highest and last point are kept; of no time, all.
    every: Option<i64>,
    points: Vec<EquityPoint>,
    /// The time that is under way.
    now: Option<Stretch>,
    /// Sum of all points, kept or not, and their number.
    sum: f64,
    count: usize,
}

/// A time of which few points are kept.
#[derive(Debug, Clone)]
struct Stretch {
    number: i64,
    first: EquityPoint,
    /// The lowest and the highest, in the order in which they came.
    extremes: [EquityPoint; 2],
    last: EquityPoint,
}

impl EquityCurve {
    /// No points yet, with room for those of `rows` rows of data.
    pub fn new(every: Option<i64>, rows: Option<usize>) -> Self {
        let room = if every.is_none() { rows.unwrap_or_default() + 1 } else { 0 };
        Self { every, points: Vec::with_capacity(room), now: None, sum: 0.0, count: 0 }
    }

    /// Goes on in the memory of points that are over, where that has more.
    pub fn reuse(&mut self, over: Vec<EquityPoint>) {
        reuse(&mut self.points, over);
    }

    /// All points so far, which it has no longer.
    pub fn take_points(&mut self) -> Vec<EquityPoint> {
        std::mem::take(&mut self.points)
    }

    /// The equity of now.
    #[inline(always)]
    pub fn push(&mut self, time: Timestamp, equity: f64) {
        let point = EquityPoint { time, equity };
        self.sum += equity;
        self.count += 1;
        match self.every {
            None => self.points.push(point),
            Some(every) => self.thin(point, every),
        }
    }

    /// When the last point was.
    pub fn end(&self) -> Option<Timestamp> {
        self.now.as_ref().map(|now| now.last.time).or(self.points.last().map(|point| point.time))
    }

    /// Mean of all points, kept or not; none where there is none.
    pub fn mean(&self) -> Option<f64> {
        (self.count > 0).then(|| self.sum / self.count as f64)
    }

    /// All points that are kept.
    pub fn finish(mut self) -> Vec<EquityPoint> {
        self.close();
        self.points
    }

    fn thin(&mut self, point: EquityPoint, every: i64) {
        let number = point.time.0.div_euclid(every);
        match &mut self.now {
            Some(now) if now.number == number => now.take(point),
            _ => {
                self.close();
                self.now = Some(Stretch { number, first: point, extremes: [point; 2], last: point });
            }
        }
    }

    /// Keeps what there is of the time under way, each point once.
    fn close(&mut self) {
        let Some(Stretch { first, extremes: [one, other], last, .. }) = self.now.take() else { return };
        self.points.push(first);
        for point in [one, other, last] {
            if self.points.last() != Some(&point) {
                self.points.push(point);
            }
        }
    }
}

/// `rows` go on in the memory of those of `over`, where that has as much: a run of any length leaves memory behind that the next one
/// would have to ask the system for.
pub(super) fn reuse<T>(rows: &mut Vec<T>, mut over: Vec<T>) {
    if over.capacity() >= rows.capacity() {
        over.clear();
        over.append(rows);
        *rows = over;
    }
}

impl Stretch {
    fn take(&mut self, point: EquityPoint) {
        let [one, other] = self.extremes;
        let (low, high) = (one.equity.min(other.equity), one.equity.max(other.equity));
        // A new extreme comes after the other one, which stays.
        if point.equity < low {
            self.extremes = [if one.equity >= other.equity { one } else { other }, point];
        } else if point.equity > high {
            self.extremes = [if one.equity <= other.equity { one } else { other }, point];
        }
        self.last = point;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Start, end, lowest and highest of each stretch are there, nothing else, in order.
        #[test]
        fn a_thin_curve_keeps_its_extremes(steps in proptest::collection::vec((0..40_i64, -50..50_i64), 1..300), every in 1..200_i64) {
            let (mut time, mut equity) = (0, 1_000_i64);
            let all: Vec<EquityPoint> = steps
                .iter()
                .map(|(wait, gain)| {
                    (time, equity) = (time + wait, equity + gain);
                    EquityPoint { time: Timestamp(time), equity: equity as f64 }
                })
                .collect();
            let (mut thin, mut whole) = (EquityCurve::new(Some(every), None), EquityCurve::new(None, Some(all.len())));
            for point in &all {
                thin.push(point.time, point.equity);
                whole.push(point.time, point.equity);
                prop_assert_eq!(thin.end(), whole.end());
            }
            prop_assert_eq!(&whole.finish(), &all);
            let kept = thin.finish();
            let mut rest = all.iter();
            prop_assert!(kept.iter().all(|point| rest.any(|other| other == point)), "a part of all, in order");
            let number = |point: &EquityPoint| point.time.0.div_euclid(every);
            for stretch in all.chunk_by(|a, b| number(a) == number(b)) {
                let own: Vec<&EquityPoint> = kept.iter().filter(|point| number(point) == number(&stretch[0])).collect();
                prop_assert!(own.len() <= 4);
                prop_assert_eq!((own[0], own[own.len() - 1]), (&stretch[0], &stretch[stretch.len() - 1]));
                let ends = |points: &mut dyn Iterator<Item = f64>| points.fold((f64::MAX, f64::MIN), |(l, h), e| (l.min(e), h.max(e)));
                prop_assert_eq!(ends(&mut own.iter().map(|p| p.equity)), ends(&mut stretch.iter().map(|p| p.equity)));
            }
        }
    }
}
