//! Which episode each lane is in.

use super::{Episode, Which};

/// Seed and episode of each lane, kept by the rule of [`VecEnv`](super::VecEnv).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Episodes {
    lanes: Vec<Episode>,
    /// Whether the lane has begun an episode with the seed it has.
    begun: Vec<bool>,
}

impl Episodes {
    /// So many lanes that have had no seed and no episode.
    #[must_use]
    pub fn new(lanes: usize) -> Self {
        Self { lanes: vec![Episode::default(); lanes], begun: vec![false; lanes] }
    }

    /// Goes on to the next episode of the lanes of `which`, or to the first of the seeds in their places of `seeds`.
    pub fn begin(&mut self, which: Which<'_>, seeds: Option<&[u64]>) {
        for lane in which.iter(self.lanes.len()) {
            self.begin_lane(lane, seeds.map(|seeds| seeds[lane]));
        }
    }

    /// The same of one lane, which gives the episode.
    pub fn begin_lane(&mut self, lane: usize, seed: Option<u64>) -> Episode {
        self.lanes[lane] = self.upcoming(lane, seed);
        self.begun[lane] = true;
        self.lanes[lane]
    }

    /// What [`begin_lane`](Self::begin_lane) would give.
    #[must_use]
    pub fn upcoming(&self, lane: usize, seed: Option<u64>) -> Episode {
        let now = self.lanes[lane];
        match seed {
            Some(seed) => Episode { seed, number: 0 },
            None => Episode { seed: now.seed, number: now.number + u64::from(self.begun[lane]) },
        }
    }

    /// The episode `lane` is in.
    #[must_use]
    pub fn lane(&self, lane: usize) -> Episode {
        self.lanes[lane]
    }

    /// Makes lane `to` a copy of lane `from`.
    pub fn copy_lane(&mut self, from: usize, to: usize) {
        self.lanes[to] = self.lanes[from];
        self.begun[to] = self.begun[from];
    }

    /// Makes lane `to` a copy of lane `from` of `other`.
    pub fn copy_lane_from(&mut self, other: &Self, from: usize, to: usize) {
        self.lanes[to] = other.lanes[from];
        self.begun[to] = other.begun[from];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seed_begins_anew_and_none_goes_on() {
        let mut episodes = Episodes::new(3);
        episodes.begin(Which::All, Some(&[7, 8, 9]));
        episodes.begin(Which::Mask(&[false, true, false]), None);
        let lanes = |episodes: &Episodes| [0, 1, 2].map(|lane| (episodes.lane(lane).seed, episodes.lane(lane).number));
        assert_eq!(lanes(&episodes), [(7, 0), (8, 1), (9, 0)]);
        episodes.begin(Which::Mask(&[true, true, false]), Some(&[7, 5, 0]));
        assert_eq!(lanes(&episodes), [(7, 0), (5, 0), (9, 0)]);
        episodes.copy_lane(2, 0);
        episodes.begin(Which::All, None);
        assert_eq!(lanes(&episodes), [(9, 1), (5, 1), (9, 1)]);
        let mut unseeded = Episodes::new(1);
        unseeded.begin(Which::All, None);
        assert_eq!(unseeded.lane(0), Episode { seed: 0, number: 0 });
        unseeded.copy_lane_from(&episodes, 1, 0);
        assert_eq!(unseeded.upcoming(0, None), Episode { seed: 5, number: 2 });
    }
}
