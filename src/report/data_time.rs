//! Time as a plot shows it: without the long stretches of which there are no data.

const DAY: f64 = 86_400.0;
/// Longer stretches without data are cut: a week, as the longest for which exchanges close.
const LONGEST: f64 = 7.0 * DAY;

/// The times of a series, with gaps of more than a week shortened by whole days, so that midnights stay where they are.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct DataTime {
    /// Each time, as a place on the axis [s]; before the first cut, seconds since the Unix epoch.
    pub places: Vec<f64>,
    /// What was cut, in order.
    pub cuts: Vec<Cut>,
}

/// A stretch of which there are no data.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Cut {
    /// Places of the data around it [s].
    pub around: (f64, f64),
    /// How much time was cut there and before, since the start [s].
    pub removed: f64,
}

impl DataTime {
    /// The times `time` [ns since the Unix epoch, UTC], increasing.
    pub(super) fn of(time: &[i64]) -> Self {
        let (mut shown, mut removed) = (Self::default(), 0.0);
        let mut before: Option<f64> = None;
        for seconds in time.iter().map(|ns| *ns as f64 * 1e-9) {
            if let Some(before) = before.filter(|before| seconds - before > LONGEST) {
                let left = before - removed;
                removed += ((seconds - before) / DAY - 1.0).floor() * DAY;
                shown.cuts.push(Cut { around: (left, seconds - removed), removed });
            }
            shown.places.push(seconds - removed);
            before = Some(seconds);
        }
        shown
    }
}

/// The instant shown at `place` [s since the Unix epoch], where `cuts` were made.
pub(super) fn instant(place: f64, cuts: &[Cut]) -> f64 {
    let cut = cuts.iter().rev().find(|cut| place >= cut.around.1);
    place + cut.map_or(0.0, |cut| cut.removed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_are_cut_by_whole_days_and_instants_found_again() {
        let day = |d: f64| (d * DAY * 1e9) as i64;
        let time = [day(0.25), day(0.75), day(3.25), day(400.5), day(401.0), day(900.0)];
        let shown = DataTime::of(&time);
        assert_eq!(shown.cuts.len(), 2);
        assert_eq!(shown.places[2], 3.25 * DAY, "a weekend is no gap");
        assert!(shown.places.windows(2).all(|p| p[0] < p[1] && p[1] - p[0] <= 2.5 * DAY), "{shown:?}");
        for (place, ns) in shown.places.iter().zip(time) {
            assert!((instant(*place, &shown.cuts) - ns as f64 * 1e-9).abs() < 1e-3);
        }
        assert!(shown.cuts.iter().all(|cut| cut.removed % DAY == 0.0));
        assert_eq!(DataTime::of(&[day(1.0), day(2.0)]).cuts, []);
    }
}
