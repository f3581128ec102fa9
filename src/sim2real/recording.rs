//! What was measured, and what a simulator says of the same rows: two types, never mixed up.

use std::ops::Range;

/// One measured channel of a recording; `None` where the sample was lost.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// Channel name, as the plant calls it.
    pub channel: String,
    /// Unit of the samples.
    pub unit: String,
    /// One entry a row.
    pub samples: Vec<Option<f64>>,
}

/// One simulated channel: complete, for a simulator loses no samples.
#[derive(Debug, Clone, PartialEq)]
pub struct Simulated {
    /// Channel name, as the plant calls it.
    pub channel: String,
    /// One entry a row of the recording that was followed.
    pub samples: Vec<f64>,
}

/// All channels of one simulated run.
pub type Trajectory = Vec<Simulated>;

/// A recording of a real system: what drove it, and what was measured.
///
/// # Row convention
/// A command in row `i` is in force from `time[i]`. Where the clock is [sampled](super::Clock::Sampled), the
/// observation in row `i` is taken at `time[i]`, before that command has acted; where it ticks with
/// [events](super::Clock::Event), row `i` is a message and its observation is the reply to it.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording<S> {
    /// What to call it in reports: most often the file it was read from.
    pub name: String,
    /// Time of each row [s]; increasing, and strictly so for a sampled clock.
    pub time: Vec<f64>,
    /// Commands and inputs, row by row.
    pub stimulus: S,
    /// The measured channels, each as long as `time`.
    pub measured: Vec<Measured>,
}

impl<S> Recording<S> {
    /// Number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.time.len()
    }

    /// Whether there are no rows.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.time.is_empty()
    }

    /// The measured channel of that name.
    #[must_use]
    pub fn channel(&self, name: &str) -> Option<&Measured> {
        self.measured.iter().find(|m| m.channel == name)
    }

    /// The first row whose time lies `fraction` of the way from first to last.
    #[must_use]
    pub fn row_at_fraction(&self, fraction: f64) -> usize {
        let (Some(first), Some(last)) = (self.time.first(), self.time.last()) else { return 0 };
        let cut = first + fraction * (last - first);
        self.time.partition_point(|t| *t < cut)
    }
}

/// The rows of a recording that count: a fit sees these and no others.
#[derive(Debug)]
pub struct Part<'a, S> {
    /// The whole recording.
    pub recording: &'a Recording<S>,
    /// The row a run starts from, with an initial state of its own.
    pub start: usize,
    /// The rows whose residuals count, none before `start`.
    pub rows: Range<usize>,
}

impl<'a, S> Part<'a, S> {
    /// All rows of `recording`.
    #[must_use]
    pub fn whole(recording: &'a Recording<S>) -> Self {
        Self { recording, start: 0, rows: 0..recording.len() }
    }

    /// The rows a run has to follow: from `start` to the last row that counts.
    #[must_use]
    pub fn followed(&self) -> Range<usize> {
        self.start..self.rows.end
    }

    /// Consecutive windows of at least `seconds` [s], each started afresh, that together cover the rows that count.
    #[must_use]
    pub fn windows(&self, seconds: f64) -> Vec<Self> {
        let time = &self.recording.time[self.rows.clone()];
        let span = time.last().unwrap_or(&0.0) - time.first().unwrap_or(&0.0);
        let count = ((span / seconds).floor() as usize).max(1);
        let cut = |k: usize| match k {
            0 => self.rows.start,
            k if k == count => self.rows.end,
            k => self.rows.start + time.partition_point(|t| *t < time[0] + span * k as f64 / count as f64),
        };
        (0..count).map(|k| Self { recording: self.recording, start: cut(k), rows: cut(k)..cut(k + 1) }).collect()
    }

    /// The rows before `fraction` of the time has passed, and those after, which a run reaches through the first.
    #[must_use]
    pub fn split(recording: &'a Recording<S>, fraction: f64) -> (Self, Self) {
        let cut = recording.row_at_fraction(fraction);
        (Self { recording, start: 0, rows: 0..cut }, Self { recording, start: 0, rows: cut..recording.len() })
    }
}

impl<S> Clone for Part<'_, S> {
    fn clone(&self) -> Self {
        Self { recording: self.recording, start: self.start, rows: self.rows.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recording() -> Recording<()> {
        let samples = vec![Some(0.0), None, Some(2.0), Some(3.0)];
        Recording {
            name: "test".into(),
            time: vec![0.0, 1.0, 2.0, 10.0],
            stimulus: (),
            measured: vec![Measured { channel: "position".into(), unit: "rad".into(), samples }],
        }
    }

    #[test]
    fn a_split_is_in_time_not_in_rows() {
        let recording = recording();
        let (fit, held) = Part::split(&recording, 0.7);
        assert_eq!((fit.rows.clone(), held.rows.clone()), (0..3, 3..4));
        assert_eq!(Part::whole(&recording).rows, 0..4);
        assert_eq!(held.followed(), 0..4);
    }

    #[test]
    fn windows_cover_each_row_once() {
        let recording = recording();
        let windows = Part::whole(&recording).windows(3.0);
        assert_eq!(windows.iter().map(|w| w.rows.len()).sum::<usize>(), 4);
        assert!(windows.iter().all(|w| w.start == w.rows.start));
        assert_eq!(Part::whole(&recording).windows(100.0).len(), 1);
    }

    #[test]
    fn channels_are_found_by_name() {
        assert!(recording().channel("position").is_some());
        assert!(recording().channel("velocity").is_none());
        assert_eq!((recording().len(), recording().is_empty()), (4, false));
    }
}
