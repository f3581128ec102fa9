//! A chain of states as a recursion takes it: from its first row on, or from its last row back. A long series is taken from both ends at
//! once, and what is known of its halves is joined where they meet.

use std::marker::PhantomData;

use super::HiddenMarkov;

/// Rows from which on a series is taken from both ends, where a row takes some tens of nanoseconds: of fewer it takes longer to wake a
/// second thread.
pub(super) const LONG: usize = 4_096;

/// The same where a row takes some nanoseconds.
pub(super) const LONGER: usize = 16_384;

/// Which way a recursion goes: a type, because its innermost loops are compiled for each.
pub(super) trait Way: Send + Sync {
    /// Whether it goes from the last row back.
    const BACK: bool;
}

/// From the first row on.
pub(super) struct Onward;

/// From the last row back.
pub(super) struct Back;

impl Way for Onward {
    const BACK: bool = false;
}

impl Way for Back {
    const BACK: bool = true;
}

/// A model as seen from one end of a series. Back, transitions are those of the model transposed, and nothing is known of the state after
/// the last row.
pub(super) struct Chain<'a, W> {
    pub model: &'a HiddenMarkov,
    /// `[from][to]` in the order in which states are come by.
    pub transition: Vec<f64>,
    /// Of each state before any row.
    pub begin: Vec<f64>,
    way: PhantomData<W>,
}

impl<'a, W: Way> Chain<'a, W> {
    pub fn of(model: &'a HiddenMarkov) -> Self {
        let (transition, states) = (model.transition(), model.states());
        if W::BACK {
            let transposed = (0..states * states).map(|k| transition[k % states * states + k / states]).collect();
            Self { model, transition: transposed, begin: vec![1.0; states], way: PhantomData }
        } else {
            Self { model, transition: transition.to_vec(), begin: model.initial().to_vec(), way: PhantomData }
        }
    }
}

/// Where a series of so many rows is cut in two halves, of which the second is taken from the last row back; `None` where it is taken whole,
/// being shorter than `long`.
pub(super) fn middle(rows: usize, long: usize) -> Option<usize> {
    (rows >= long).then_some(rows / 2)
}

/// Does something in which threads are joined more than once: they are woken once only.
pub(super) fn awake<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    rayon::scope(|_| work())
}
