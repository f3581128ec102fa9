//! What screening found, kept for where the same is asked again: a selection begins with the twin that has nothing added, and the rivals of a
//! mechanism that was found alone are sought beside the same.

use std::sync::Arc;

use super::hypothesis::{Hypothesis, Inquiry};
use super::screen::Screened;
use super::weigh::squares;
use crate::sim2real::Twin;

/// What screening found beside one hypothesis.
#[derive(Debug, Clone)]
pub(super) struct Screening {
    values: Vec<f64>,
    left: f64,
    screened: Arc<[Screened]>,
}

impl Screening {
    /// Screens all candidates beside `parent`.
    pub fn beside<T: Twin>(inquiry: &Inquiry<'_, T>, parent: &Hypothesis<T>) -> Self {
        let screened = inquiry.screened(parent).into();
        Self { values: parent.fit.values.clone(), left: squares(parent), screened }
    }

    /// What screening finds beside `parent`: what is `known` already, if that is of the same hypothesis of the same `inquiry`.
    pub fn known_or_made<T: Twin>(known: Option<&Self>, inquiry: &Inquiry<'_, T>, parent: &Hypothesis<T>) -> Vec<Screened> {
        let same = |known: &&Self| known.values == parent.fit.values && known.left == squares(parent);
        known.filter(same).map_or_else(|| inquiry.screened(parent), |known| known.screened.to_vec())
    }
}
