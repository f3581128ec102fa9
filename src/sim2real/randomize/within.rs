//! What is drawn anew within an episode, together.

use super::{Randomizer, Redraw, Target};

/// Parameters that are drawn anew together within an episode: those of one interval, or of all regimes.
#[derive(Debug, Clone, PartialEq)]
pub struct Within {
    /// When. Of regimes it is the last that any is drawn in.
    pub at: Redraw,
    /// What is drawn.
    pub randomizer: Randomizer,
    /// Their rows among all.
    pub rows: Vec<usize>,
}

impl Randomizer {
    /// What is drawn anew within an episode, in groups that are drawn together.
    #[must_use]
    pub fn within(&self) -> Vec<Within> {
        let mut groups: Vec<Within> = Vec::new();
        let alike = |a: Redraw, b: Redraw| a == b || matches!((a, b), (Redraw::Regime(_), Redraw::Regime(_)));
        for one in self.randomized() {
            if matches!(one.at, Redraw::Startup | Redraw::Reset) || groups.iter().any(|group| alike(group.at, one.at)) {
                continue;
            }
            let members = |k: &usize| alike(self.randomized()[*k].at, one.at);
            let rows: Vec<usize> = (0..self.randomized().len()).filter(members).collect();
            let randomized: Vec<_> = rows.iter().map(|k| self.randomized()[*k].clone()).collect();
            let within = |target: &Target| randomized.iter().any(|one| one.target == *target);
            let correlations = self.correlations().iter().filter(|pair| pair.between.iter().all(within)).cloned().collect();
            // A part of what goes together goes together.
            let Ok(randomizer) = Randomizer::new(randomized.clone(), correlations) else { continue };
            // The last regime counts how many there are.
            let last = randomized.iter().filter_map(|one| if let Redraw::Regime(k) = one.at { Some(k) } else { None }).max();
            groups.push(Within { at: last.map_or(one.at, Redraw::Regime), randomizer, rows });
        }
        groups
    }
}
