//! What is wrong with a series, with settings, or with a model.

/// A series, settings or a model that cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RegimeError {
    /// Fewer samples than what is asked for needs.
    #[error(
        "{what}: {found} samples, where at least {needed} are needed\nhint: give a longer series, or ask for less of it"
    )]
    TooShort {
        /// What was to be done with them.
        what: &'static str,
        /// Number of samples that are there; lost ones do not count.
        found: usize,
        /// Number that is needed.
        needed: usize,
    },
    /// A value that is infinite, or NaN where no sample may be lost.
    #[error("row {row}: {found} is no sample\nhint: {hint}")]
    NotFinite {
        /// Row of the series, from 0.
        row: usize,
        /// The value.
        found: f64,
        /// What may be there.
        hint: &'static str,
    },
    /// A series in which nothing ever changes.
    #[error("column {column} of the series is {value} throughout\nhint: a constant has no regimes; leave it out")]
    Constant {
        /// Column of the series, from 0.
        column: usize,
        /// The value it has.
        value: f64,
    },
    /// More states than there are values to tell them apart.
    #[error("{states} states of a series that has {distinct} different values\nhint: ask for fewer states")]
    FewValues {
        /// Number of states asked for.
        states: usize,
        /// Number of different rows.
        distinct: usize,
    },
    /// Rows of another width than expected.
    #[error("{found} values, where rows are of {width}\nhint: give as many values as the series has columns, row after row")]
    Width {
        /// Values in a row.
        width: usize,
        /// Number of values found.
        found: usize,
    },
    /// A setting out of its range.
    #[error("{name} = {found} is out of range\nhint: {hint}")]
    Setting {
        /// Which.
        name: &'static str,
        /// Its value.
        found: f64,
        /// What it may be.
        hint: &'static str,
    },
    /// Probabilities that are none: negative, or of another sum than 1.
    #[error("{what} {row}: {found:?} are no probabilities\nhint: none is negative, and their sum is 1 (to 1e-6)")]
    NotProbabilities {
        /// Of what.
        what: &'static str,
        /// Of which state, from 0.
        row: usize,
        /// What was found.
        found: Vec<f64>,
    },
    /// Parts of a model that do not go together.
    #[error(
        "{what}: {found}, where {expected} are expected\nhint: a model has one row and one column of transitions a state, and all states have one width"
    )]
    Shape {
        /// Which part.
        what: &'static str,
        /// Number found.
        found: usize,
        /// Number expected.
        expected: usize,
    },
    /// A spread that is none: a variance of 0 or less, a covariance that is not positive definite.
    #[error(
        "state {state}: its {what} is {found}\nhint: variances and degrees of freedom are above 0, covariances positive definite"
    )]
    Spread {
        /// State, from 0.
        state: usize,
        /// "variance", "covariance" and so on.
        what: &'static str,
        /// What was found.
        found: f64,
    },
    /// A chain in which some states are never left for others has no one stationary distribution.
    #[error(
        "the chain does not lead from every state to every other\nhint: it has no one stationary distribution; fit fewer states"
    )]
    Reducible,
}

impl RegimeError {
    /// `value`, if `holds` of it.
    pub(super) fn setting(name: &'static str, found: f64, holds: bool, hint: &'static str) -> Result<(), Self> {
        if holds { Ok(()) } else { Err(Self::Setting { name, found, hint }) }
    }

    /// That all of `values` are finite, for what knows no lost samples.
    pub(super) fn all_finite(values: &[f64]) -> Result<(), Self> {
        match values.iter().position(|x| !x.is_finite()) {
            None => Ok(()),
            Some(row) => {
                let hint = "leave out rows that were lost: between them nothing is known here";
                Err(Self::NotFinite { row, found: values[row], hint })
            }
        }
    }
}
