//! What became of orders, on its way to their owner.

use super::venue::Outcome;

/// Outcomes that are not known yet. A place is used again once its outcome is known, so that a run of any length holds no more
/// than is on its way at once.
#[derive(Debug, Clone, Default)]
pub(super) struct Mail {
    slots: Vec<Option<Outcome>>,
    free: Vec<usize>,
    /// What mechanisms added to the price of each fill: as many terms a place as there are mechanisms.
    terms: Vec<f64>,
    count: usize,
}

impl Mail {
    /// No mail, of fills that each have `count` terms.
    pub fn new(count: usize) -> Self {
        Self { count, ..Self::default() }
    }

    /// Puts an outcome on its way, and gives its place; what is no fill has no terms.
    pub fn put(&mut self, outcome: Outcome, terms: &[f64]) -> usize {
        let place = self.place(terms);
        self.slots[place] = Some(outcome);
        place
    }

    /// A fill of these terms is known as soon as it was made: it leaves the place that it would have had, as [taken](Self::take).
    pub fn pass(&mut self, terms: &[f64]) -> usize {
        let place = self.place(terms);
        self.free.push(place);
        place
    }

    /// A place that is free, with these terms.
    fn place(&mut self, terms: &[f64]) -> usize {
        let place = self.free.pop().unwrap_or_else(|| {
            self.slots.push(None);
            self.terms.resize(self.terms.len() + self.count, 0.0);
            self.slots.len() - 1
        });
        let own = &mut self.terms[place * self.count..(place + 1) * self.count];
        own[..terms.len()].copy_from_slice(terms);
        place
    }

    /// Takes the outcome at a place.
    pub fn take(&mut self, place: usize) -> Option<Outcome> {
        let outcome = self.slots.get_mut(place)?.take()?;
        self.free.push(place);
        Some(outcome)
    }

    /// Whether what is on its way at a place is of that instrument.
    pub fn is_of(&self, place: usize, instrument: usize) -> bool {
        self.slots.get(place).is_some_and(|slot| slot.is_some_and(|outcome| outcome.instrument == instrument))
    }

    /// The terms of the fill that was last at a place.
    pub fn terms(&self, place: usize) -> &[f64] {
        &self.terms[place * self.count..(place + 1) * self.count]
    }

    /// Whether nothing is on its way.
    pub fn is_empty(&self) -> bool {
        self.free.len() == self.slots.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::market::venue::What;
    use crate::market::{OrderId, Reason};
    use crate::sim2real::Timestamp;

    #[test]
    fn places_are_used_again_and_keep_their_own_terms() {
        let outcome = |id| Outcome { id: OrderId(id), instrument: 0, at: Timestamp(0), what: What::Ended(Reason::Asked) };
        let mut mail = Mail::new(2);
        for round in 0..1_000_u64 {
            let first = mail.put(outcome(round), &[round as f64, 1.0]);
            let second = mail.put(outcome(round + 1), &[-1.0, -2.0]);
            assert_eq!(mail.take(first), Some(outcome(round)));
            assert_eq!((mail.terms(first), mail.terms(second)), (&[round as f64, 1.0][..], &[-1.0, -2.0][..]));
            assert!(mail.take(first).is_none() && !mail.is_empty());
            mail.take(second);
        }
        assert!(mail.is_empty() && mail.slots.len() == 2);
    }
}
