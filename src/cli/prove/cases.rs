//! The cases of a run: kept, or drawn again when they are needed.

use std::borrow::Cow;
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;

use crate::cli::screen::Progress;
use crate::proof::{Case, Domain, Sealed};
use crate::sim2real::Seed;

/// All cases.
pub(super) struct Cases {
    domain: Domain,
    seed: Seed,
    /// None for those that are quicker drawn again than kept.
    kept: Vec<Option<Case>>,
}

impl Cases {
    /// Draws `count` cases and seals their labels, all before the first is diagnosed.
    ///
    /// # Errors
    /// None but a bug: a label is always JSON.
    pub fn draw(
        domain: Domain,
        seed: Seed,
        count: usize,
        progress: &Progress,
    ) -> Result<(Self, Vec<Sealed>), serde_json::Error> {
        let done = AtomicUsize::new(0);
        progress.tell("drawing cases", 0, count);
        let one = |index: usize| {
            let case = Case::draw(domain, seed, index);
            let sealed = case.sealed(seed)?;
            progress.tell("drawing cases", done.fetch_add(1, Ordering::Relaxed) + 1, count);
            Ok((Some(case).filter(|case| !case.is_large()), sealed))
        };
        let drawn: Result<Vec<(Option<Case>, Sealed)>, serde_json::Error> = (0..count).into_par_iter().map(one).collect();
        let (kept, sealed) = drawn?.into_iter().unzip();
        Ok((Self { domain, seed, kept }, sealed))
    }

    /// How many they are.
    pub fn len(&self) -> usize {
        self.kept.len()
    }

    /// Case `index`.
    pub fn get(&self, index: usize) -> Cow<'_, Case> {
        match self.kept.get(index).and_then(Option::as_ref) {
            Some(case) => Cow::Borrowed(case),
            None => Cow::Owned(Case::draw(self.domain, self.seed, index)),
        }
    }
}
