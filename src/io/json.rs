//! JSON as records: an array of objects, objects one after another, newline JSON, or a page that holds an array.

use std::path::Path;

use serde_json::Value;

use super::error::{InputError, Place};
use super::records::{Records, Unread};
use super::source::{bytes, open};

/// The keys under which services put the array of a page.
const PAGES: [&str; 8] = ["orders", "fills", "activities", "trades", "data", "result", "results", "rows"];

/// Reads a JSON file as records.
///
/// Objects within a record are taken apart: `{"o": {"s": 1}}` has the key `o.s`. Arrays stay the texts of their JSON, for
/// [`json_records`] to read. Numbers are texts: integers as written, others by the shortest digits that are the same 64 bits, which
/// are those written up to 15 of them. The row of a record is its number in its array, of newline JSON its line.
///
/// # Errors
/// A file that is missing, not UTF-8 or no JSON. Of newline JSON a line that cannot be read is an unread record.
pub fn read_json(path: impl AsRef<Path>) -> Result<Records, InputError> {
    let path = path.as_ref();
    let text = String::from_utf8(bytes(path, open(path)?)?)
        .map_err(|_| InputError::new(path, "expected UTF-8 text").hint("a JSON file is meant"))?;
    json_records(path, &text)
}

/// The records of a text that stands in the file `path`.
///
/// # Errors
/// As [`read_json`].
pub fn json_records(path: &Path, text: &str) -> Result<Records, InputError> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    if text.trim().is_empty() {
        return Err(InputError::new(path, "the file is empty").hint("expected JSON"));
    }
    let mut records = Records::new(path, None);
    match values(text) {
        Ok(values) => values.into_iter().for_each(|(line, value)| add(&mut records, line, value, true)),
        Err(error) => {
            let first = text.lines().find(|line| !line.trim().is_empty()).unwrap_or_default();
            let newline_json = serde_json::from_str::<Value>(first).is_ok_and(|value| value.is_object());
            if !newline_json {
                return Err(broken(path, &error));
            }
            lines(&mut records, text);
        }
    }
    Ok(records)
}

/// All values of the text, with the lines on which they begin.
fn values(text: &str) -> Result<Vec<(usize, Value)>, serde_json::Error> {
    let mut found = Vec::new();
    let mut stream = serde_json::Deserializer::from_str(text).into_iter::<Value>();
    let (mut line, mut counted) = (1, 0);
    loop {
        let after = stream.byte_offset();
        // Where the value begins: behind the blanks.
        let start = after + text[after..].len() - text[after..].trim_start().len();
        line += text[counted..start].matches('\n').count();
        counted = start;
        match stream.next() {
            None => return Ok(found),
            Some(value) => found.push((line, value?)),
        }
    }
}

fn lines(records: &mut Records, text: &str) {
    for (k, line) in text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty()) {
        match serde_json::from_str(line) {
            Ok(value) => add(records, k + 1, value, true),
            Err(error) => {
                let message = format!("expected a JSON object ({})", without_place(&error));
                records.push_unread(Unread { row: k + 1, message, found: line.chars().take(60).collect() });
            }
        }
    }
}

/// Adds a value: an object as a record, the elements of an array, those of a page.
fn add(records: &mut Records, row: usize, value: Value, outermost: bool) {
    match value {
        Value::Array(elements) if outermost => {
            elements.into_iter().enumerate().for_each(|(k, element)| add(records, k + 1, element, false));
        }
        Value::Object(mut object) => {
            let page = PAGES.iter().find(|key| object.get(**key).is_some_and(is_page)).filter(|_| outermost);
            // An order has a symbol, by whatever name; a page has none.
            let is_order = ["symbol", "s", "e", "pair"].iter().any(|key| object.contains_key(*key));
            if let Some(elements) = page.filter(|_| !is_order).and_then(|key| object.remove(*key)) {
                return add(records, row, elements, true);
            }
            let mut cells = Vec::new();
            object.into_iter().for_each(|(key, value)| flat(&mut cells, key, value));
            records.push(row, cells);
        }
        other => {
            let found = other.to_string().chars().take(60).collect();
            records.push_unread(Unread { row, message: "expected a JSON object".to_owned(), found });
        }
    }
}

fn is_page(value: &Value) -> bool {
    value.as_array().is_some_and(|elements| elements.iter().all(Value::is_object))
}

fn flat(cells: &mut Vec<(String, String)>, key: String, value: Value) {
    match value {
        Value::Null => {}
        Value::Object(object) => object.into_iter().for_each(|(inner, value)| flat(cells, format!("{key}.{inner}"), value)),
        Value::String(text) => cells.push((key, text)),
        other => cells.push((key, other.to_string())),
    }
}

fn without_place(error: &serde_json::Error) -> String {
    let text = error.to_string();
    text.rsplit_once(" at line ").map_or(text.clone(), |(message, _)| message.to_owned())
}

fn broken(path: &Path, error: &serde_json::Error) -> InputError {
    let hint = if error.is_eof() { "the file is cut off: fetch it again" } else { "is it JSON, and all of it?" };
    let place = Place::Line { line: error.line(), column: error.column() };
    InputError::new(path, format!("expected JSON ({})", without_place(error))).at(place).hint(hint)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Vec<(usize, Option<String>)>, String> {
        let records = json_records(Path::new("a.json"), text).map_err(|error| error.to_string())?;
        Ok(records.iter().map(|record| (record.row(), record.get("a").map(str::to_owned))).collect())
    }

    #[test]
    fn arrays_pages_and_lines_are_the_same_records() {
        let two = Ok(vec![(1, Some("x".to_owned())), (2, Some("1.5".to_owned()))]);
        for text in [
            r#"[{"a": "x"}, {"a": 1.5}]"#,
            r#"{"orders": [{"a": "x"}, {"a": 1.5}], "next_page_token": "n"}"#,
            "{\"a\": \"x\"}\n{\"a\": 1.5}\n",
            "\u{feff}{\"a\": \"x\"}\n{\"a\": 1.5}",
        ] {
            assert_eq!(read(text), two, "{text}");
        }
        assert_eq!(read("{\n \"a\": 1\n}\n\n{\"a\":\n 2}"), Ok(vec![(1, Some("1".into())), (5, Some("2".into()))]));
    }

    #[test]
    fn inner_objects_are_taken_apart_and_arrays_kept() {
        let text = r#"{"symbol": "S", "o": {"p": "1", "q": {"r": 12345678901234567}}, "trades": [{"x": 1}], "n": null}"#;
        let records = json_records(Path::new("a.json"), text).unwrap();
        let record = records.iter().next().unwrap();
        assert_eq!(record.get("o.q.r"), Some("12345678901234567"));
        assert_eq!((record.get("trades"), record.get("n")), (Some(r#"[{"x":1}]"#), None));
    }

    #[test]
    fn what_is_cut_off_is_said_with_its_place() {
        insta::assert_snapshot!(read("[\n{\"a\": 1},\n{\"a\"").unwrap_err(), @r"
        a.json:3:4: expected JSON (EOF while parsing an object)
          hint: the file is cut off: fetch it again
        ");
        let records = json_records(Path::new("a"), "{\"a\": 1}\n{\"a\": \n{\"a\": 3}\n4").unwrap();
        assert_eq!(records.iter().map(|r| r.row()).collect::<Vec<_>>(), [1, 3]);
        assert_eq!(records.unread().iter().map(|u| u.row).collect::<Vec<_>>(), [2, 4]);
        assert!(read("").is_err() && read("abc").is_err() && read(&"[".repeat(100_000)).is_err());
    }
}
