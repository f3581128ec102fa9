//! Records of whatever kind of file: keys and texts, for readers whose files come as CSV, JSON, XML or a database.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use super::Place;
use super::table::Table;

/// Records read from one file, or from one table of a file that has several. Cells are texts, as the file writes them; a record
/// has only the keys that it has values for.
#[derive(Debug, Clone, Default)]
pub struct Records {
    path: PathBuf,
    table: Option<String>,
    keys: Vec<String>,
    numbers: HashMap<String, u32>,
    rows: Vec<Row>,
    unread: Vec<Unread>,
}

#[derive(Debug, Clone)]
struct Row {
    number: usize,
    /// Key and value, sorted by the number of the key.
    cells: Vec<(u32, Box<str>)>,
}

/// A record that cannot be read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unread {
    /// Its row, from 1.
    pub row: usize,
    /// Why.
    pub message: String,
    /// How it begins.
    pub found: String,
}

/// One record.
#[derive(Debug, Clone, Copy)]
pub struct Record<'a> {
    of: &'a Records,
    row: &'a Row,
}

impl Records {
    /// No records yet, of `table` in the file `path`.
    #[must_use]
    pub fn new(path: impl AsRef<Path>, table: Option<&str>) -> Self {
        Self { path: path.as_ref().to_path_buf(), table: table.map(str::to_owned), ..Self::default() }
    }

    /// Adds a record: its row in the file, from 1, and its keys with their values. Of a key that is there twice the last counts.
    pub fn push(&mut self, number: usize, cells: impl IntoIterator<Item = (impl AsRef<str>, String)>) {
        let mut row: Vec<(u32, Box<str>)> =
            cells.into_iter().map(|(key, value)| (self.number(key.as_ref()), value.into_boxed_str())).collect();
        row.reverse();
        row.sort_by_key(|(key, _)| *key);
        row.dedup_by_key(|(key, _)| *key);
        self.rows.push(Row { number, cells: row });
    }

    /// Adds a record that cannot be read.
    pub fn push_unread(&mut self, unread: Unread) {
        self.unread.push(unread);
    }

    /// Declares a key, also where no record has a value for it.
    pub fn declare(&mut self, key: &str) {
        self.number(key);
    }

    fn number(&mut self, key: &str) -> u32 {
        if let Some(number) = self.numbers.get(key) {
            return *number;
        }
        let number = u32::try_from(self.keys.len()).unwrap_or(u32::MAX);
        self.keys.push(key.to_owned());
        self.numbers.insert(key.to_owned(), number);
        number
    }

    /// The file.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The table within the file, where that has several.
    #[must_use]
    pub fn table(&self) -> Option<&str> {
        self.table.as_deref()
    }

    /// The file, and the table in it.
    #[must_use]
    pub fn name(&self) -> String {
        match &self.table {
            Some(table) => format!("{}: {table}", self.path.display()),
            None => self.path.display().to_string(),
        }
    }

    /// Whether any record has that key, or the file declares it.
    #[must_use]
    pub fn has(&self, key: &str) -> bool {
        self.numbers.contains_key(key)
    }

    /// Whether it has all of `keys`.
    #[must_use]
    pub fn has_all(&self, keys: &[&str]) -> bool {
        keys.iter().all(|key| self.has(key))
    }

    /// The keys, in the order in which they were met.
    #[must_use]
    pub fn keys(&self) -> &[String] {
        &self.keys
    }

    /// The records, in the order of the file.
    pub fn iter(&self) -> impl Iterator<Item = Record<'_>> {
        self.rows.iter().map(|row| Record { of: self, row })
    }

    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// The records that cannot be read.
    #[must_use]
    pub fn unread(&self) -> &[Unread] {
        &self.unread
    }

    /// The rows of a table. Times by type become texts, without an offset where the file gives no zone; columns of other types, such
    /// as lists, are left out.
    #[must_use]
    pub fn of_table(table: &Table) -> Self {
        let texts = |name| Some((name, table.texts(name).ok().or_else(|| table.time_texts(name))?));
        let mut columns: Vec<(&str, Vec<Option<String>>)> = table.names().into_iter().filter_map(texts).collect();
        let mut records = Self::new(table.path(), None);
        columns.iter().for_each(|(name, _)| records.declare(name));
        for row in 0..table.rows() {
            let Place::Row(number) = table.place(row) else { continue };
            let cells = columns.iter_mut().filter_map(|(name, texts)| Some((*name, texts.get_mut(row)?.take()?)));
            records.push(number, cells.collect::<Vec<_>>());
        }
        records
    }
}

impl<'a> Record<'a> {
    /// The value of a key; none where the record has none, or an empty one.
    #[must_use]
    pub fn get(&self, key: &str) -> Option<&'a str> {
        let number = *self.of.numbers.get(key)?;
        let at = self.row.cells.binary_search_by_key(&number, |(key, _)| *key).ok()?;
        self.row.cells.get(at).map(|(_, value)| value.trim()).filter(|value| !value.is_empty())
    }

    /// Its row in the file, from 1.
    #[must_use]
    pub fn row(&self) -> usize {
        self.row.number
    }

    /// The records it is among.
    #[must_use]
    pub fn records(&self) -> &'a Records {
        self.of
    }
}

#[cfg(test)]
mod tests {
    use polars::prelude::{DataFrame, DataType, IntoColumn, NamedFrom, ParquetWriter, Series, TimeUnit, TimeZone};

    use super::*;

    #[test]
    fn times_by_type_have_a_zone_only_where_the_file_gives_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.parquet");
        let of = |name: &str, zone| {
            let counts = Series::new(name.into(), [Some(1_500_i64), None]);
            counts.cast(&DataType::Datetime(TimeUnit::Milliseconds, zone)).unwrap().into_column()
        };
        let columns = vec![of("naive", None), of("utc", Some(TimeZone::UTC))];
        let mut frame = DataFrame::new_infer_height(columns).unwrap();
        ParquetWriter::new(std::fs::File::create(&path).unwrap()).finish(&mut frame).unwrap();
        let records = Records::of_table(&Table::read(&path).unwrap());
        let rows: Vec<_> = records.iter().map(|row| (row.row(), row.get("naive"), row.get("utc"))).collect();
        let first = (1, Some("1970-01-01T00:00:01.500000000"), Some("1970-01-01T00:00:01.500Z"));
        assert_eq!(rows, [first, (2, None, None)]);
    }

    #[test]
    fn a_record_has_what_it_has_and_of_twins_the_last() {
        let mut records = Records::new("a.json", Some("orders"));
        records.push(1, [("b", "1".to_owned()), ("a", " 2 ".to_owned()), ("b", "3".to_owned())]);
        records.push(7, [("c", String::new())]);
        let [first, second] = records.iter().collect::<Vec<_>>().try_into().unwrap();
        assert_eq!((first.get("a"), first.get("b"), first.get("c"), first.row()), (Some("2"), Some("3"), None, 1));
        assert_eq!((second.get("a"), second.get("c"), second.get("d"), second.row()), (None, None, None, 7));
        assert!(records.has_all(&["a", "c"]) && !records.has("d"));
        assert_eq!(records.name(), "a.json: orders");
    }
}
