//! Observations that are lost.

use super::layer::{Layer, copy_row, refused};
use crate::rl::{About, Actions, EnvError, Episodes, Out, SplitMix64, StreamName, Which};

/// What is shown in the place of what was lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Lost {
    /// What was shown a step before.
    #[default]
    Hold,
    /// 0.
    Zero,
}

/// Loses observations, each with the same probability and by itself. That of the reset is never lost.
#[derive(Debug, Clone)]
pub struct Dropout {
    probability: f64,
    of: Of,
    lost: Lost,
    name: StreamName,
    size: usize,
    streams: Vec<SplitMix64>,
    shown: Vec<f32>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Of {
    Messages,
    Components,
}

impl Dropout {
    /// Loses whole observations.
    #[must_use]
    pub fn of_messages(probability: f64) -> Self {
        Self::of(Of::Messages, probability)
    }

    /// Loses components of observations, each by itself.
    #[must_use]
    pub fn of_components(probability: f64) -> Self {
        Self::of(Of::Components, probability)
    }

    fn of(of: Of, probability: f64) -> Self {
        let name = StreamName::new("dropout");
        Self { probability, of, lost: Lost::Hold, name, size: 0, streams: Vec::new(), shown: Vec::new() }
    }

    /// The same that shows this in the place of what was lost.
    #[must_use]
    pub fn showing(self, lost: Lost) -> Self {
        Self { lost, ..self }
    }

    /// The same with draws from the stream of this name, to tell two of them apart.
    #[must_use]
    pub fn named(self, name: &str) -> Self {
        Self { name: StreamName::new(name), ..self }
    }
}

impl Layer for Dropout {
    const NAME: &'static str = "dropout of observations";

    fn prepare(&mut self, about: &mut About, lanes: usize) -> Result<(), EnvError> {
        if !(0.0..=1.0).contains(&self.probability) {
            return Err(refused::<Self>(about, format!("the probability is {}", self.probability), "give one from 0 to 1"));
        }
        self.size = about.observation.size();
        if self.lost == Lost::Zero {
            about.observation.low.iter_mut().for_each(|low| *low = low.min(0.0));
            about.observation.high.iter_mut().for_each(|high| *high = high.max(0.0));
        }
        self.streams = vec![SplitMix64::default(); lanes];
        // Where nothing is held, this stays 0 and is what is shown.
        self.shown = vec![0.0; lanes * self.size];
        Ok(())
    }

    fn begin(&mut self, which: Which<'_>, episodes: &Episodes, observations: &mut [f32]) {
        for lane in which.iter(self.streams.len()) {
            self.streams[lane] = episodes.lane(lane).stream(self.name);
            if self.lost == Lost::Hold {
                let range = lane * self.size..(lane + 1) * self.size;
                self.shown[range.clone()].copy_from_slice(&observations[range]);
            }
        }
    }

    fn sense(&mut self, _: Actions<'_>, out: &mut Out<'_>) {
        let size = self.size.max(1);
        let rows = out.observations.chunks_exact_mut(size).zip(self.shown.chunks_exact_mut(size));
        for ((row, shown), stream) in rows.zip(&mut self.streams) {
            match self.of {
                Of::Messages => {
                    if stream.uniform() < self.probability {
                        row.copy_from_slice(shown);
                    }
                }
                Of::Components => {
                    for (value, shown) in row.iter_mut().zip(&*shown) {
                        if stream.uniform() < self.probability {
                            *value = *shown;
                        }
                    }
                }
            }
            if self.lost == Lost::Hold {
                shown.copy_from_slice(row);
            }
        }
    }

    fn copy_lane(&mut self, other: Option<&Self>, from: usize, to: usize) {
        copy_row(&mut self.streams, other.map(|other| other.streams.as_slice()), 1, from, to);
        copy_row(&mut self.shown, other.map(|other| other.shown.as_slice()), self.size, from, to);
    }
}

#[cfg(test)]
mod tests {
    use super::super::Wrap;
    use super::*;
    use crate::rl::walk::Walk;
    use crate::rl::{Buffers, Options, VecEnv};

    /// Rows shown and rows there were, lane 0, over 4,000 steps.
    fn shown(dropout: Dropout) -> Vec<[[f32; 2]; 2]> {
        let (mut plain, mut lossy) = (Walk::new(2), Walk::new(2).with(dropout).unwrap());
        let (mut one, mut other) = (Buffers::of(&plain), Buffers::of(&lossy));
        plain.reset(Which::All, Some(&[4, 5]), &Options::new(), &mut one.observations).unwrap();
        lossy.reset(Which::All, Some(&[4, 5]), &Options::new(), &mut other.observations).unwrap();
        assert_eq!(one.observations, other.observations);
        let row = |buffers: &Buffers| [buffers.observations[0], buffers.observations[1]];
        let mut rows = vec![[row(&other), row(&one)]];
        for _ in 0..4000 {
            plain.step(Actions::Continuous(&[0.0; 2]), &mut one.out()).unwrap();
            lossy.step(Actions::Continuous(&[0.0; 2]), &mut other.out()).unwrap();
            rows.push([row(&other), row(&one)]);
        }
        rows
    }

    fn close(share: f64, probability: f64) -> bool {
        (share - probability).abs() < 4.0 * (probability * (1.0 - probability) / 4000.0).sqrt()
    }

    #[test]
    fn a_lost_message_shows_the_last_that_was_shown() {
        let rows = shown(Dropout::of_messages(0.3));
        let mut lost = 0;
        for pair in rows.windows(2) {
            let [before, [shown, real]] = [pair[0], pair[1]];
            assert!(shown == real || shown == before[0]);
            lost += usize::from(shown != real);
        }
        assert!(close(lost as f64 / 4000.0, 0.3), "{lost}");
    }

    #[test]
    fn components_are_lost_by_themselves_and_zero_is_shown_where_asked_for() {
        let rows = shown(Dropout::of_components(0.25).showing(Lost::Zero));
        let lost = |k: usize| rows[1..].iter().filter(|[shown, real]| shown[k] != real[k]).count() as f64 / 4000.0;
        let both = rows[1..].iter().filter(|[shown, _]| *shown == [0.0; 2]).count() as f64 / 4000.0;
        assert!(rows.iter().all(|[shown, real]| (0..2).all(|k| shown[k] == real[k] || shown[k] == 0.0)));
        assert!(close(lost(0), 0.25) && close(lost(1), 0.25) && close(both, 0.0625), "{} {} {both}", lost(0), lost(1));
    }

    #[test]
    fn what_is_no_probability_is_refused() {
        for bad in [-0.1, 1.1, f64::NAN] {
            let error = Walk::new(1).with(Dropout::of_messages(bad)).unwrap_err().to_string();
            assert!(error.contains(&format!("the probability is {bad}")), "{error}");
        }
    }
}
