//! A row of a feed as a line of JSON: an object of plain values.

use std::path::Path;

use serde_json::{Map, Value};

use super::csv::CsvText;
use super::error::{InputError, Place, hint_among};
use super::table::{Renames, Table};

/// An object of plain values, and the line it stands on.
#[derive(Debug, Clone, PartialEq)]
pub struct JsonRow {
    source: String,
    line: usize,
    values: Map<String, Value>,
}

impl JsonRow {
    /// Reads the object on line `line`, from 1, of `source`.
    ///
    /// # Errors
    /// What is no JSON, no object, or holds lists or objects.
    pub fn read(source: &str, line: usize, text: &str) -> Result<Self, InputError> {
        let wrong = |column: usize, message: String| {
            let error = InputError::new(source, message).at(Place::Line { line, column }).found_text(text.trim());
            error.hint("one JSON object a line, such as {\"symbol\": \"XYZ\", \"kind\": \"trade\", \"ts\": 0, \"price\": 1}")
        };
        let value: Value = serde_json::from_str(text).map_err(|error| {
            let told = error.to_string();
            wrong(error.column().max(1), format!("no JSON: {}", told.split(" at line").next().unwrap_or_default()))
        })?;
        let Value::Object(values) = value else { return Err(wrong(1, "expected an object".to_owned())) };
        let row = Self { source: source.to_owned(), line, values };
        match row.values.iter().find(|(_, value)| value.is_array() || value.is_object()) {
            Some((key, value)) => {
                let error = row.error(key, "expected a number, a text or null").found(value);
                Err(error.hint("levels of a book are keys of their own: bid, bid2, bid3"))
            }
            None => Ok(row),
        }
    }

    /// The text of a key that must be there.
    ///
    /// # Errors
    /// No such key, or none with a text.
    pub fn text(&self, key: &str) -> Result<&str, InputError> {
        match self.values.get(key) {
            Some(Value::String(text)) => Ok(text),
            Some(other) => Err(self.error(key, "expected a text").found(other).hint("put it in quotes")),
            None => {
                let keys: Vec<&str> = self.values.keys().map(String::as_str).collect();
                Err(self.error(key, "there is no such key").maybe_hint(hint_among(key, &keys)))
            }
        }
    }

    /// The whole number of a key that need not be there.
    ///
    /// # Errors
    /// Anything else than a whole number that is not negative.
    pub fn count(&self, key: &str) -> Result<Option<u64>, InputError> {
        match self.values.get(key) {
            None | Some(Value::Null) => Ok(None),
            Some(value) => value.as_u64().map(Some).ok_or_else(|| {
                self.error(key, "expected a whole number that is not negative").found(value).hint("number rows from 1 on")
            }),
        }
    }

    /// An error about a key.
    #[must_use]
    pub fn error(&self, key: &str, message: impl Into<String>) -> InputError {
        InputError::new(&self.source, message).at(Place::Row(self.line)).in_column(key)
    }

    /// An error of the row as a whole with its line; one that has a place keeps it.
    #[must_use]
    pub fn placed(&self, error: InputError) -> InputError {
        if error.place == Place::File { error.at(Place::Row(self.line)) } else { error }
    }

    /// The keys but for `others`, as the columns of a table of one row: its cells are what a file would hold, and errors name line
    /// and key.
    ///
    /// # Errors
    /// No key but those.
    pub fn table(&self, others: &[&str]) -> Result<Table, InputError> {
        let path = Path::new(&self.source);
        let cells = self.values.iter().filter(|(key, _)| !others.contains(&key.as_str()));
        let (mut names, mut values) = (Vec::new(), Vec::new());
        for (key, value) in cells {
            names.push(quoted(key));
            values.push(match value {
                Value::Null => String::new(),
                Value::String(text) => quoted(text),
                other => other.to_string(),
            });
        }
        if names.is_empty() {
            let error = InputError::new(path, "the row has no values").at(Place::Row(self.line));
            return Err(error.hint("the columns of its kind are its keys, such as ts, price and size"));
        }
        let text = format!("{}\n{}\n", names.join(","), values.join(","));
        let block = CsvText::first_block(path, text.into_bytes())?.at_line(self.line);
        if block.rows() != 1 {
            let error = InputError::new(path, "the row has no values").at(Place::Row(self.line));
            return Err(error.hint("give the columns of its kind values"));
        }
        Ok(Table::of_csv(path, &Renames::new(), block))
    }
}

/// A text as a cell of CSV (RFC 4180). A line feed within would be a line of its own to whoever counts them.
fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('"', "\"\"").replace(['\n', '\r'], " "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::TimeFormat;
    use proptest::prelude::*;

    #[test]
    fn a_row_is_a_table_whose_errors_name_line_and_key() {
        let text = r#"{"symbol": "A", "kind": "trade", "ts": 1709908200000000001, "price": 100.01, "size": "x", "seq": 3}"#;
        let row = JsonRow::read("standard input", 17, text).unwrap();
        assert_eq!((row.text("symbol").unwrap(), row.count("seq").unwrap()), ("A", Some(3)));
        let table = row.table(&["symbol", "kind", "seq"]).unwrap();
        let times = table.times_with_holes("ts", &TimeFormat::default()).unwrap();
        assert_eq!(times[0].unwrap().0, 1_709_908_200_000_000_001);
        assert_eq!(table.floats("price").unwrap(), [Some(100.01)]);
        let error = table.floats("size").unwrap_err().to_string();
        assert!(error.starts_with("standard input: row 17, column `size`: ") && error.contains("\"x\""), "{error}");
    }

    #[test]
    fn what_is_no_row_is_told_with_line_and_remedy() {
        for text in ["", "nonsense", "[1]", "3", "{\"a\": [1]}", "{\"a\": {}}", "{\"a\": 1} {}"] {
            let error = JsonRow::read("feed", 4, text).unwrap_err();
            assert!(error.to_string().starts_with("feed:") && error.to_string().contains('4'), "{error}");
            assert!(error.hint.is_some(), "{error}");
        }
        let row = JsonRow::read("feed", 4, "{\"sym\": \"A\", \"kind\": 3, \"seq\": -1}").unwrap();
        assert!(row.text("symbol").unwrap_err().to_string().contains("did you mean `sym`?"));
        assert!(row.text("kind").is_err() && row.count("seq").is_err() && row.table(&["sym", "kind", "seq"]).is_err());
    }

    proptest! {
        #[test]
        fn no_line_makes_it_panic(text in ".{0,80}", cell in "[\\PC\n\r]{0,20}", key in "[a-z\"\n,]{0,6}") {
            let _ = JsonRow::read("feed", 1, &text).map(|row| row.table(&[]).map(|table| table.rows()));
            let object = serde_json::json!({ key: cell }).to_string();
            if let Ok(table) = JsonRow::read("feed", 1, &object).unwrap().table(&[]) {
                prop_assert_eq!(table.rows(), 1);
            }
        }
    }
}
