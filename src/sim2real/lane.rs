//! What happens to one lane of laws that are under way in many: its parameters change, it begins anew, it goes on as another.

use std::any::Any;
use std::cell::RefCell;
use std::collections::VecDeque;
use std::slice;

use super::{Seed, SplitMix64};

/// A change of one lane. A law shows it everything it keeps by lanes, once each.
#[derive(Debug, Clone, Copy)]
pub enum LaneChange<'a> {
    /// The parameters have these values from now on, in the order of the law's form; what is remembered stays.
    Retune {
        /// The lane.
        lane: usize,
        /// The values.
        values: &'a [f64],
    },
    /// All is forgotten, as at the start of a run, and what is drawn from now on is this seed's.
    Forget {
        /// The lane.
        lane: usize,
        /// What its draws depend on.
        seed: Seed,
    },
    /// Nothing changes, and all that is kept is put into the image: parameters, memory and draws.
    Save {
        /// The lane.
        lane: usize,
        /// The image.
        image: &'a LaneImage,
    },
    /// The lane goes on as the one that was saved into the image.
    Load {
        /// The lane.
        lane: usize,
        /// The image.
        image: &'a LaneImage,
    },
}

/// All that is kept of one lane, in the order in which laws show it.
#[derive(Debug, Default)]
pub struct LaneImage(RefCell<VecDeque<Box<dyn Any + Send>>>);

impl LaneImage {
    fn save<T: Clone + Send + 'static>(&self, column: &[T], lane: usize) {
        if let Some(own) = column.get(lane) {
            self.0.borrow_mut().push_back(Box::new(own.clone()));
        }
    }

    fn load<T: Clone + Send + 'static>(&self, column: &mut [T], lane: usize) {
        if let Some(own) = column.get_mut(lane)
            && let Some(kept) = self.0.borrow_mut().pop_front()
            && let Ok(kept) = kept.downcast::<T>()
        {
            *own = *kept;
        }
    }
}

impl LaneChange<'_> {
    /// The lane whose parameters may be others after this change; what follows from them for more than a lane is made anew then.
    #[must_use]
    pub const fn retuned(&self) -> Option<usize> {
        match *self {
            Self::Retune { lane, .. } | Self::Load { lane, .. } => Some(lane),
            Self::Forget { .. } | Self::Save { .. } => None,
        }
    }

    /// `column` has the parameter numbered `parameter` of each lane.
    pub fn parameter(&self, parameter: usize, column: &mut [f64]) {
        self.derived(column, |values| values[parameter]);
    }

    /// `column` has what follows from the parameters of each lane, by `of`.
    pub fn derived<T: Clone + Send + 'static>(&self, column: &mut [T], of: impl FnOnce(&[f64]) -> T) {
        match *self {
            Self::Retune { lane, values } => {
                if let Some(own) = column.get_mut(lane) {
                    *own = of(values);
                }
            }
            Self::Forget { .. } => {}
            Self::Save { lane, image } => image.save(column, lane),
            Self::Load { lane, image } => image.load(column, lane),
        }
    }

    /// `column` has what is remembered of each lane; the default is nothing.
    pub fn memory<T: Clone + Default + Send + 'static>(&self, column: &mut [T]) {
        self.memory_from(column, &T::default());
    }

    /// The same of a memory that begins as `fresh`.
    pub fn memory_from<T: Clone + Send + 'static>(&self, column: &mut [T], fresh: &T) {
        match *self {
            Self::Retune { .. } => {}
            Self::Forget { lane, .. } => {
                if let Some(own) = column.get_mut(lane) {
                    own.clone_from(fresh);
                }
            }
            Self::Save { lane, image } => image.save(column, lane),
            Self::Load { lane, image } => image.load(column, lane),
        }
    }

    /// What each lane draws from.
    pub fn draws(&self, draws: &mut LaneDraws) {
        match *self {
            Self::Retune { .. } => {}
            Self::Forget { lane, seed } => {
                if let Some(own) = draws.lanes.get_mut(lane) {
                    *own = SplitMix64::new(seed, draws.key);
                }
            }
            Self::Save { lane, image } => image.save(&draws.lanes, lane),
            Self::Load { lane, image } => image.load(&mut draws.lanes, lane),
        }
    }

    /// What all lanes have in common, `anew` at the start of a run. It goes with whichever lane begins anew or is copied: laws that have
    /// such a thing do either only where they have one lane.
    pub fn shared<T: Clone + Send + 'static>(&self, own: &mut T, anew: impl FnOnce(Seed) -> T) {
        match *self {
            Self::Retune { .. } => {}
            Self::Forget { seed, .. } => *own = anew(seed),
            Self::Save { image, .. } => image.save(slice::from_ref(own), 0),
            Self::Load { image, .. } => image.load(slice::from_mut(own), 0),
        }
    }
}

/// Draws of each lane by itself, for laws whose lanes are environments of their own.
#[derive(Debug, Clone)]
pub struct LaneDraws {
    key: u64,
    lanes: Vec<SplitMix64>,
}

impl LaneDraws {
    /// Those of the stream called `name`, for so many lanes, none of which has begun.
    #[must_use]
    pub fn new(name: &str, lanes: usize) -> Self {
        let key = Seed(0).child(name).0;
        Self { key, lanes: vec![SplitMix64::new(Seed(0), key); lanes] }
    }

    /// The draws of lane `lane`.
    ///
    /// # Panics
    /// If there is no such lane: an error of the calling code, not of any input.
    pub fn lane(&mut self, lane: usize) -> &mut SplitMix64 {
        &mut self.lanes[lane]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_change_concerns_its_lane_and_what_it_is_of() {
        let mut parameters = vec![1.0, 2.0, 3.0];
        let mut memory = vec![Some(7), None, Some(9)];
        let retune = LaneChange::Retune { lane: 1, values: &[4.0, 5.0] };
        retune.parameter(1, &mut parameters);
        retune.memory(&mut memory);
        assert_eq!((&parameters[..], &memory[..]), (&[1.0, 5.0, 3.0][..], &[Some(7), None, Some(9)][..]));
        let forget = LaneChange::Forget { lane: 0, seed: Seed(1) };
        forget.parameter(0, &mut parameters);
        forget.memory(&mut memory);
        assert_eq!((&parameters[..], &memory[..]), (&[1.0, 5.0, 3.0][..], &[None, None, Some(9)][..]));
        let image = LaneImage::default();
        for copy in [LaneChange::Save { lane: 2, image: &image }, LaneChange::Load { lane: 0, image: &image }] {
            copy.parameter(0, &mut parameters);
            copy.memory(&mut memory);
        }
        assert_eq!((&parameters[..], &memory[..]), (&[3.0, 5.0, 3.0][..], &[Some(9), None, Some(9)][..]));
    }

    #[test]
    fn what_lanes_share_begins_anew_and_is_copied_with_any_of_them() {
        let (mut one, mut other) = (7_u64, 8_u64);
        let image = LaneImage::default();
        LaneChange::Retune { lane: 0, values: &[] }.shared(&mut one, |_| 0);
        LaneChange::Save { lane: 0, image: &image }.shared(&mut one, |_| 0);
        LaneChange::Load { lane: 3, image: &image }.shared(&mut other, |_| 0);
        assert_eq!((one, other), (7, 7));
        LaneChange::Forget { lane: 0, seed: Seed(5) }.shared(&mut one, |seed| seed.0);
        assert_eq!(one, 5);
    }

    #[test]
    fn draws_are_those_of_the_seed_and_the_name_and_go_on_in_a_copy() {
        let mut draws = LaneDraws::new("noise", 3);
        LaneChange::Forget { lane: 1, seed: Seed(5) }.draws(&mut draws);
        let first = draws.lane(1).bits();
        let image = LaneImage::default();
        LaneChange::Save { lane: 1, image: &image }.draws(&mut draws);
        LaneChange::Load { lane: 2, image: &image }.draws(&mut draws);
        assert_eq!(draws.lane(1).bits(), draws.lane(2).bits());
        LaneChange::Forget { lane: 2, seed: Seed(5) }.draws(&mut draws);
        assert_eq!(draws.lane(2).bits(), first);
        let mut other = LaneDraws::new("dropout", 1);
        LaneChange::Forget { lane: 0, seed: Seed(5) }.draws(&mut other);
        assert_ne!(other.lane(0).bits(), first);
        LaneChange::Forget { lane: 0, seed: Seed(6) }.draws(&mut draws);
        assert_ne!(draws.lane(0).bits(), first);
    }
}
