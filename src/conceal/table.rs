//! Named columns of equal length: what the generator hands out, before any file format.

/// Values of one column.
#[derive(Debug, Clone, PartialEq)]
pub enum Column {
    /// Times [ns since the Unix epoch, UTC].
    Time(Vec<i64>),
    /// Whole numbers.
    Whole(Vec<i64>),
    /// Real numbers.
    Real(Vec<f64>),
    /// Words.
    Text(Vec<String>),
    /// Real numbers, some of which are not there.
    Sparse(Vec<Option<f64>>),
    /// As many rows as given, none with a value.
    Empty(usize),
}

impl Column {
    /// Number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Self::Time(values) | Self::Whole(values) => values.len(),
            Self::Real(values) => values.len(),
            Self::Text(values) => values.len(),
            Self::Sparse(values) => values.len(),
            Self::Empty(rows) => *rows,
        }
    }

    /// Whether it has no row.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Columns by name, in the order in which a file shows them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    columns: Vec<(String, Column)>,
}

impl Table {
    /// The same table with one column more on the right.
    #[must_use]
    pub fn with(mut self, name: impl Into<String>, column: Column) -> Self {
        self.columns.push((name.into(), column));
        self
    }

    /// The columns, left to right.
    #[must_use]
    pub fn columns(&self) -> &[(String, Column)] {
        &self.columns
    }

    /// Number of rows.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, |(_, column)| column.len())
    }

    /// The column called `name`, if there is one.
    #[must_use]
    pub fn column(&self, name: &str) -> Option<&Column> {
        self.columns.iter().find(|(own, _)| own == name).map(|(_, column)| column)
    }

    /// The real numbers of the column called `name`; none where it is absent or of another kind.
    #[must_use]
    pub fn real(&self, name: &str) -> Option<&[f64]> {
        match self.column(name)? {
            Column::Real(values) => Some(values),
            _ => None,
        }
    }
}

#[cfg(test)]
impl Table {
    /// The first sixteen hexadecimal digits of the SHA-256 over names, kinds and bits of all columns.
    pub(crate) fn digest(&self) -> String {
        use sha2::{Digest, Sha256};
        let mut hash = Sha256::new();
        for (name, column) in &self.columns {
            hash.update(name.as_bytes());
            match column {
                Column::Time(values) | Column::Whole(values) => values.iter().for_each(|v| hash.update(v.to_le_bytes())),
                Column::Real(values) => values.iter().for_each(|v| hash.update(v.to_bits().to_le_bytes())),
                Column::Text(values) => values.iter().for_each(|v| hash.update(v.as_bytes())),
                Column::Sparse(values) => values.iter().flatten().for_each(|v| hash.update(v.to_bits().to_le_bytes())),
                Column::Empty(rows) => hash.update(rows.to_le_bytes()),
            }
        }
        hash.finalize().iter().take(8).map(|byte| format!("{byte:02x}")).collect()
    }
}
