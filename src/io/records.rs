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
    numbers: HashMap<String, usize>,
    /// All values, one after the other: a text of its own for each would be most of what a long log takes.
    texts: String,
    /// Where the values of each key are, row by row, as far as there is any.
    columns: Vec<Vec<Cell>>,
    /// The rows in the file, from 1.
    rows: Vec<usize>,
    unread: Vec<Unread>,
}

/// Where a value begins and ends among the texts; none where they are the same, for an empty one is no value.
type Cell = (usize, usize);

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
    place: usize,
}

impl Records {
    /// No records yet, of `table` in the file `path`.
    #[must_use]
    pub fn new(path: impl AsRef<Path>, table: Option<&str>) -> Self {
        Self { path: path.as_ref().to_path_buf(), table: table.map(str::to_owned), ..Self::default() }
    }

    /// Adds a record: its row in the file, from 1, and its keys with their values. Of a key that is there twice the last counts.
    pub fn push(&mut self, number: usize, cells: impl IntoIterator<Item = (impl AsRef<str>, String)>) {
        let place = self.rows.len();
        self.rows.push(number);
        for (key, value) in cells {
            let key = self.number(key.as_ref());
            self.put(key, place, &value);
        }
    }

    /// Sets the value of the key of that number in the newest row, or in one for which that key has none yet.
    fn put(&mut self, key: usize, place: usize, value: &str) {
        let column = &mut self.columns[key];
        column.truncate(place);
        // What is the same row after row is kept once.
        let same = column.last().copied().filter(|(from, to)| self.texts[*from..*to] == *value);
        column.resize(place, (0, 0));
        let cell = same.unwrap_or_else(|| {
            let from = self.texts.len();
            self.texts.push_str(value);
            (from, self.texts.len())
        });
        column.push(cell);
    }

    /// Adds a record that cannot be read.
    pub fn push_unread(&mut self, unread: Unread) {
        self.unread.push(unread);
    }

    /// Declares a key, also where no record has a value for it.
    pub fn declare(&mut self, key: &str) {
        self.number(key);
    }

    fn number(&mut self, key: &str) -> usize {
        if let Some(number) = self.numbers.get(key) {
            return *number;
        }
        let number = self.keys.len();
        self.keys.push(key.to_owned());
        self.columns.push(Vec::new());
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
        (0..self.rows.len()).map(|place| Record { of: self, place })
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
        let mut records = Self::new(table.path(), None);
        let placed = |row| match table.place(row) {
            Place::Row(number) => Some((row, number)),
            _ => None,
        };
        let rows: Vec<(usize, usize)> = (0..table.rows()).filter_map(placed).collect();
        records.rows = rows.iter().map(|(_, number)| *number).collect();
        for name in table.names() {
            let Some(texts) = table.texts(name).ok().or_else(|| table.time_texts(name)) else { continue };
            let key = records.number(name);
            for (place, (row, _)) in rows.iter().enumerate() {
                if let Some(value) = texts.get(*row).and_then(Option::as_deref) {
                    records.put(key, place, value);
                }
            }
        }
        records
    }
}

impl<'a> Record<'a> {
    /// The value of a key; none where the record has none, or an empty one.
    #[must_use]
    pub fn get(&self, key: &str) -> Option<&'a str> {
        let (from, to) = *self.of.columns[*self.of.numbers.get(key)?].get(self.place)?;
        Some(self.of.texts[from..to].trim()).filter(|value| !value.is_empty())
    }

    /// Its row in the file, from 1.
    #[must_use]
    pub fn row(&self) -> usize {
        self.of.rows[self.place]
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
        // What is the same again is the same, and what is missing in between stays so.
        records.push(8, [("a", "2".to_owned()), ("b", "3".to_owned())]);
        records.push(9, [("b", "3".to_owned()), ("a", "2".to_owned()), ("a", "4".to_owned())]);
        let of = |key| records.iter().map(|row| row.get(key)).collect::<Vec<_>>();
        assert_eq!(of("a"), [Some("2"), None, Some("2"), Some("4")]);
        assert_eq!(of("b"), [Some("3"), None, Some("3"), Some("3")]);
        assert_eq!(of("c"), [None; 4]);
    }
}
