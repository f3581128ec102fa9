//! The probability of each state given what is known by now, one observation at a time.

use super::course::Course;
use super::trellis::follow;
use super::{HiddenMarkov, Observations, RegimeError};

/// A model that follows a series as it comes. After each row it holds the probability of each state given all rows up to
/// this one, and nothing that comes later changes what it said: bit by bit the rows of [`HiddenMarkov::filter`].
///
/// A row with a NaN was lost: time goes on, and the states are predicted.
#[derive(Debug, Clone, PartialEq)]
pub struct Filter {
    model: HiddenMarkov,
    course: Course<Vec<f64>>,
    belief: Vec<f64>,
    weights: Vec<f64>,
    rows: u64,
}

impl Filter {
    /// Before the first row.
    #[must_use]
    pub fn new(model: HiddenMarkov) -> Self {
        let (belief, weights) = (model.initial().to_vec(), vec![0.0; model.states()]);
        Self { course: Course::new(&model, model.initial()), belief, weights, rows: 0, model }
    }

    /// Takes the next row, and gives the probability of each state.
    ///
    /// # Errors
    /// A row of another width than the model's, an infinite value; the filter stays as it was.
    #[inline]
    pub fn step(&mut self, row: &[f64]) -> Result<&[f64], RegimeError> {
        if row.len() != self.model.width() || row.iter().any(|x| x.is_infinite()) {
            return Err(self.refused(row));
        }
        self.rows += 1;
        if !self.model.mixes() {
            self.course.step_in_logs(&self.model, row, &mut self.belief, &mut self.weights);
            self.course.believe(&mut self.belief);
            return Ok(&self.belief);
        }
        self.model.densities().weights(row, &mut self.weights);
        self.course.step(&self.model, self.model.transition(), row, &mut self.weights);
        self.course.believe(&mut self.belief);
        Ok(&self.belief)
    }

    #[cold]
    fn refused(&self, row: &[f64]) -> RegimeError {
        match row.iter().copied().find(|x| x.is_infinite()) {
            Some(found) if row.len() == self.model.width() => {
                RegimeError::NotFinite { row: self.rows as usize, found, hint: "NaN stands for a sample that was lost" }
            }
            _ => RegimeError::Width { width: self.model.width(), found: row.len() },
        }
    }

    /// Probability of each state given the rows so far; before the first the model's initial ones.
    #[must_use]
    pub fn belief(&self) -> &[f64] {
        &self.belief
    }

    /// Logarithm of the density of all rows so far.
    #[must_use]
    pub fn log_likelihood(&self) -> f64 {
        self.course.log_likelihood(&self.model)
    }

    /// Number of rows so far.
    #[must_use]
    pub fn rows(&self) -> u64 {
        self.rows
    }

    /// The model.
    #[must_use]
    pub fn model(&self) -> &HiddenMarkov {
        &self.model
    }
}

impl HiddenMarkov {
    /// Probability of each state given the rows up to each, `[row][state]` row after row.
    ///
    /// # Errors
    /// A series of another width than the model's.
    pub fn filter(&self, series: Observations) -> Result<Vec<f64>, RegimeError> {
        self.check(series)?;
        let mut beliefs = Vec::with_capacity(series.len() * self.states());
        follow(self, series, |belief| beliefs.extend_from_slice(belief));
        Ok(beliefs)
    }
}
