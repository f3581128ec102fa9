//! Which end of a bar its time names, and the span of a bar that follows from it.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::sim2real::Timestamp;

/// Which end of a bar its time names. There is no default: guessing wrong shows a strategy the future.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Stamp {
    /// The time is the start of the bar, which is known at its end.
    Open,
    /// The time is the end of the bar, when it is known.
    Close,
}

impl Stamp {
    /// The word for it in documents.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Open => "open",
            Self::Close => "close",
        }
    }

    /// When each bar opened and when it was known, for bars stamped at `times` (strictly increasing).
    ///
    /// A bar is `interval` [ns] long; where that is not declared, as long as the most common distance between two bars.
    /// It is never longer than the distance to its neighbour, so that a missing bar, a night or a weekend leaves a gap
    /// and a change of daylight saving time does not make two bars overlap. None where there is neither an interval nor
    /// a second bar.
    #[must_use]
    pub fn spans(self, times: &[Timestamp], interval: Option<i64>) -> Option<Vec<(Timestamp, Timestamp)>> {
        let length = interval.or_else(|| common_spacing(times))?;
        let span = |k: usize| match self {
            Self::Open => {
                let end = times[k] + length;
                (times[k], times.get(k + 1).map_or(end, |next| end.min(*next)))
            }
            Self::Close => {
                let start = times[k] + -length;
                (if k > 0 { start.max(times[k - 1]) } else { start }, times[k])
            }
        };
        Some((0..times.len()).map(span).collect())
    }
}

/// How often each distance between neighbouring times occurs, as the times are told one by one.
#[derive(Debug, Clone, Default)]
pub struct Spacings {
    before: Option<Timestamp>,
    /// The distance that came last, and how often in a row: nearly always the same.
    row: (i64, usize),
    counts: BTreeMap<i64, usize>,
}

impl Spacings {
    /// Another time, after the ones before it.
    #[inline]
    pub fn add(&mut self, time: Timestamp) {
        if let Some(before) = self.before.replace(time) {
            let spacing = time - before;
            if spacing != self.row.0 {
                self.count();
                self.row = (spacing, 0);
            }
            self.row.1 += 1;
        }
    }

    fn count(&mut self) {
        if self.row.1 > 0 {
            *self.counts.entry(self.row.0).or_default() += self.row.1;
        }
    }

    /// The distance that occurs most often [ns], the shortest of them where several do; none of fewer than two times.
    #[must_use]
    pub fn most_common(mut self) -> Option<i64> {
        self.count();
        let mut best: Option<(usize, i64)> = None;
        for (spacing, count) in self.counts {
            if best.is_none_or(|(most, _)| count > most) {
                best = Some((count, spacing));
            }
        }
        best.map(|(_, spacing)| spacing)
    }
}

/// The distance between neighbours that occurs most often [ns], the shortest of them where several do.
#[must_use]
pub fn common_spacing(times: &[Timestamp]) -> Option<i64> {
    let mut spacings = Spacings::default();
    times.iter().for_each(|time| spacings.add(*time));
    spacings.most_common()
}

#[cfg(test)]
mod tests {
    use super::*;

    const MINUTE: i64 = 60 * Timestamp::NANOS;

    fn minutes(at: &[i64]) -> Vec<Timestamp> {
        at.iter().map(|m| Timestamp(m * MINUTE)).collect()
    }

    fn in_minutes(spans: Option<Vec<(Timestamp, Timestamp)>>) -> Vec<(i64, i64)> {
        spans.unwrap().into_iter().map(|(from, to)| (from.0 / MINUTE, to.0 / MINUTE)).collect()
    }

    #[test]
    fn a_bar_stamped_at_its_open_is_known_at_its_end() {
        let times = minutes(&[0, 1, 2, 100, 101]);
        assert_eq!(in_minutes(Stamp::Open.spans(&times, None)), [(0, 1), (1, 2), (2, 3), (100, 101), (101, 102)]);
        assert_eq!(in_minutes(Stamp::Close.spans(&times, None)), [(-1, 0), (0, 1), (1, 2), (99, 100), (100, 101)]);
    }

    #[test]
    fn bars_never_overlap() {
        let times = minutes(&[0, 60, 119, 180]);
        assert_eq!(in_minutes(Stamp::Open.spans(&times, Some(60 * MINUTE))), [(0, 60), (60, 119), (119, 179), (180, 240)]);
        assert_eq!(in_minutes(Stamp::Close.spans(&times, Some(60 * MINUTE))), [(-60, 0), (0, 60), (60, 119), (120, 180)]);
    }

    #[test]
    fn one_bar_alone_has_no_length_unless_it_is_declared() {
        assert_eq!(Stamp::Open.spans(&minutes(&[5]), None), None);
        assert_eq!(in_minutes(Stamp::Open.spans(&minutes(&[5]), Some(MINUTE))), [(5, 6)]);
        assert_eq!(common_spacing(&minutes(&[0, 2, 4, 5, 6])), Some(MINUTE));
    }
}
