//! A series as rows of one width.

use super::RegimeError;

/// Rows of a series, one after the other: `values[row * width + column]`.
///
/// A row in which any value is NaN was lost: it is taken as not observed, and says nothing of the state it was in. An
/// infinite value is an error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observations<'a> {
    values: &'a [f64],
    width: usize,
}

impl<'a> Observations<'a> {
    /// A series of one column.
    ///
    /// # Errors
    /// A value that is infinite.
    pub fn of(values: &'a [f64]) -> Result<Self, RegimeError> {
        Self::rows(values, 1)
    }

    /// A series of `width` columns, row after row.
    ///
    /// # Errors
    /// A width of 0, values that are no whole rows, a value that is infinite.
    pub fn rows(values: &'a [f64], width: usize) -> Result<Self, RegimeError> {
        if width == 0 || !values.len().is_multiple_of(width) {
            return Err(RegimeError::Width { width, found: values.len() });
        }
        match values.iter().position(|x| x.is_infinite()) {
            Some(at) => {
                let hint = "NaN stands for a sample that was lost";
                Err(RegimeError::NotFinite { row: at / width, found: values[at], hint })
            }
            None => Ok(Self { values, width }),
        }
    }

    /// Number of columns.
    #[must_use]
    pub fn width(&self) -> usize {
        self.width
    }

    /// Number of rows, lost ones among them.
    #[must_use]
    pub fn len(&self) -> usize {
        self.values.len() / self.width
    }

    /// Whether there is no row.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// A row, by its number below [`len`](Self::len).
    #[must_use]
    pub fn row(&self, row: usize) -> &'a [f64] {
        &self.values[row * self.width..][..self.width]
    }

    /// All rows in order.
    pub fn iter(&self) -> impl DoubleEndedIterator<Item = &'a [f64]> + ExactSizeIterator + use<'a> {
        self.values.chunks_exact(self.width)
    }

    /// All values, row after row.
    pub(super) fn values(&self) -> &'a [f64] {
        self.values
    }

    /// Rows `from` to `to`, the latter not among them, as far as there are rows.
    #[must_use]
    pub fn slice(&self, from: usize, to: usize) -> Self {
        let to = to.min(self.len());
        Self { values: &self.values[from.min(to) * self.width..to * self.width], width: self.width }
    }

    /// Number of rows that were not lost.
    #[must_use]
    pub fn observed(&self) -> usize {
        // Several values at once; seldom is one lost, and of one column that says it all.
        let lost: usize = self.values.iter().map(|x| usize::from(x.is_nan())).sum();
        if lost == 0 || self.width == 1 {
            return self.len() - lost;
        }
        self.iter().filter(|row| !is_lost(row)).count()
    }
}

/// Whether a row was lost.
#[inline(always)]
pub(super) fn is_lost(row: &[f64]) -> bool {
    row.iter().any(|x| x.is_nan())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_have_one_width() {
        let two = Observations::rows(&[1.0, 2.0, 3.0, f64::NAN, 5.0, 6.0], 2).unwrap();
        assert_eq!((two.len(), two.observed(), two.row(2)), (3, 2, [5.0, 6.0].as_slice()));
        assert_eq!(two.slice(1, 9).row(1), [5.0, 6.0]);
        assert!(two.slice(7, 9).is_empty() && two.slice(2, 1).is_empty());
        assert_eq!(Observations::rows(&[1.0; 5], 2), Err(RegimeError::Width { width: 2, found: 5 }));
        assert_eq!(Observations::rows(&[], 0), Err(RegimeError::Width { width: 0, found: 0 }));
    }

    #[test]
    fn infinite_values_are_told_by_row() {
        let told = Observations::rows(&[1.0, 2.0, 3.0, f64::INFINITY], 2).unwrap_err().to_string();
        assert!(told.starts_with("row 1: inf is no sample\nhint: "), "{told}");
    }
}
