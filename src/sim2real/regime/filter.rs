//! The probability of each state given what is known by now, one observation at a time.

use super::course::Course;
use super::ends::PerState;
use super::observations::is_lost;
use super::trellis::follow;
use super::{HiddenMarkov, Observations, RegimeError, in_logs};

/// A model that follows a series as it comes. After each row it holds the probability of each state given all rows up to
/// this one, and nothing that comes later changes what it said: bit by bit the rows of [`HiddenMarkov::filter`].
///
/// A row with a NaN was lost: time goes on, and the states are predicted.
#[derive(Debug, Clone, PartialEq)]
pub struct Filter {
    model: HiddenMarkov,
    course: Kind,
    belief: Vec<f64>,
    rows: u64,
    observed: u64,
}

/// Where the recursion is: of a few states it is compiled for each number of them.
#[derive(Debug, Clone, PartialEq)]
enum Kind {
    Two(Course<[f64; 2]>),
    Three(Course<[f64; 3]>),
    Four(Course<[f64; 4]>),
    Many(Course<Vec<f64>>),
    InLogs(in_logs::Course),
}

impl Filter {
    /// Before the first row.
    #[must_use]
    pub fn new(model: HiddenMarkov) -> Self {
        let belief = model.initial().to_vec();
        let course = match model.states() {
            _ if !model.mixes() => Kind::InLogs(in_logs::Course::new(&model)),
            2 => Kind::Two(Course::new(&belief)),
            3 => Kind::Three(Course::new(&belief)),
            4 => Kind::Four(Course::new(&belief)),
            _ => Kind::Many(Course::new(&belief)),
        };
        Self { course, belief, rows: 0, observed: 0, model }
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
        self.observed += u64::from(!is_lost(row));
        let Self { model, belief, .. } = self;
        match &mut self.course {
            Kind::Two(course) => take(course, model, row, belief),
            Kind::Three(course) => take(course, model, row, belief),
            Kind::Four(course) => take(course, model, row, belief),
            Kind::Many(course) => take(course, model, row, belief),
            Kind::InLogs(course) => {
                course.step(model, row);
                course.believe(belief);
            }
        }
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
        let (model, observed) = (&self.model, self.observed);
        match &self.course {
            Kind::Two(course) => course.log_likelihood(model, observed),
            Kind::Three(course) => course.log_likelihood(model, observed),
            Kind::Four(course) => course.log_likelihood(model, observed),
            Kind::Many(course) => course.log_likelihood(model, observed),
            Kind::InLogs(course) => course.log_likelihood(model, observed),
        }
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

/// Takes a row, and writes what is believed then.
#[inline]
fn take<S: PerState<Of = f64>>(course: &mut Course<S>, model: &HiddenMarkov, row: &[f64], belief: &mut [f64]) {
    let mut weights = S::of(model.states(), |_| 0.0);
    model.densities().weights(row, weights.as_mut());
    course.step(model, model.transition(), &weights, |_| Some(row));
    course.believe(belief);
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
