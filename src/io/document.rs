//! TOML documents, with errors that give line and column.

use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use toml::de::{DeTable, DeValue};

use super::error::{InputError, Place, hint_among};
use super::source::{bytes, open};

/// Reads a TOML file into `T`.
///
/// # Errors
/// A file that is missing or not UTF-8, and whatever TOML or `T` refuse: unknown keys with the one that may be meant,
/// missing keys, values of the wrong type.
pub fn read_toml<T: DeserializeOwned>(path: impl AsRef<Path>) -> Result<T, InputError> {
    Document::read(path)?.parse()
}

/// The text of a TOML file, kept so that later errors can say where in it a key stands.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Document {
    path: PathBuf,
    text: String,
}

impl Document {
    /// Reads the file.
    ///
    /// # Errors
    /// A file that is missing, a folder or not UTF-8.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, InputError> {
        let path = path.as_ref();
        let text = String::from_utf8(bytes(path, open(path)?)?)
            .map_err(|_| InputError::new(path, "expected UTF-8 text").hint("a TOML document is meant"))?;
        Ok(Self { path: path.to_path_buf(), text })
    }

    /// A document that is in memory; `path` stands in errors, and relative paths in it start from its folder.
    #[must_use]
    pub fn from_text(path: impl AsRef<Path>, text: impl Into<String>) -> Self {
        Self { path: path.as_ref().to_path_buf(), text: text.into() }
    }

    /// The file.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The text, as it was read.
    #[must_use]
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The path of a file that the document names: relative ones start from the folder of the document.
    #[must_use]
    pub fn resolve(&self, named: impl AsRef<Path>) -> PathBuf {
        self.path.parent().unwrap_or(Path::new("")).join(named)
    }

    /// The document as a `T`.
    ///
    /// # Errors
    /// As [`read_toml`].
    pub fn parse<T: DeserializeOwned>(&self) -> Result<T, InputError> {
        toml::from_str(&self.text).map_err(|error| self.explain(error.message(), error.span().map(|span| span.start)))
    }

    /// Whether it has a section, or a key outside of any, of that name.
    #[must_use]
    pub fn has(&self, section: &str) -> bool {
        DeTable::parse(&self.text).is_ok_and(|root| root.get_ref().iter().any(|(name, _)| name.get_ref() == section))
    }

    /// Where the key at `keys` stands, in words: `run.toml:3:1`.
    #[must_use]
    pub fn place_of(&self, keys: &[&str]) -> String {
        match self.error(keys, "").place {
            Place::Line { line, column } => format!("{}:{line}:{column}", self.path.display()),
            _ => self.path.display().to_string(),
        }
    }

    /// An error about the key at `keys`, such as `["mechanism", "0", "torque"]`; entries of lists go by number.
    #[must_use]
    pub fn error(&self, keys: &[&str], message: impl Into<String>) -> InputError {
        InputError::new(&self.path, message).at(self.find(keys).map_or(Place::File, |at| self.place(at)))
    }

    /// Byte at which the last key of `keys` stands, or else the last of them that is there.
    fn find(&self, keys: &[&str]) -> Option<usize> {
        let root = DeTable::parse(&self.text).ok()?;
        let mut at = None;
        let mut here: Option<&DeValue<'_>> = None;
        for key in keys {
            let table = match here {
                None => Some(root.get_ref()),
                Some(DeValue::Table(table)) => Some(table),
                Some(_) => None,
            };
            let next = match (table, here) {
                (Some(table), _) => table.iter().find(|(k, _)| k.get_ref() == key).map(|(k, value)| (k.span().start, value)),
                (None, Some(DeValue::Array(items))) => {
                    key.parse().ok().and_then(|k: usize| items.get(k)).map(|value| (value.span().start, value))
                }
                _ => None,
            };
            let Some((start, value)) = next else { break };
            at = Some(start);
            here = Some(value.get_ref());
        }
        at
    }

    fn place(&self, at: usize) -> Place {
        let before = self.text.get(..at.min(self.text.len())).unwrap_or_default();
        let start = before.rfind('\n').map_or(0, |newline| newline + 1);
        Place::Line { line: 1 + before.matches('\n').count(), column: 1 + before[start..].chars().count() }
    }

    /// The error of the TOML library in the words of the house.
    fn explain(&self, message: &str, at: Option<usize>) -> InputError {
        let place = at.map_or(Place::File, |at| self.place(at));
        let (message, own_hint) = match message.split_once(HINT) {
            Some((message, hint)) => (message, Some(hint.to_owned())),
            None => (message, None),
        };
        let error = |text: String| InputError::new(&self.path, text).at(place);
        let mut quoted = message.split('`').skip(1).step_by(2);
        if message.starts_with("unknown field") || message.starts_with("unknown variant") {
            let word = quoted.next().unwrap_or_default();
            let allowed: Vec<&str> = quoted.collect();
            let what = if message.starts_with("unknown field") { "key" } else { "value" };
            return error(format!("unknown {what} `{word}`")).maybe_hint(hint_among(word, &allowed));
        }
        if message.starts_with("missing field") {
            let word = quoted.next().unwrap_or_default();
            return error(format!("the key `{word}` is missing"))
                .hint(format!("add `{word} = ...` or a section `[{word}]`"));
        }
        if let Some(mismatch) = message.strip_prefix("invalid type: ").or_else(|| message.strip_prefix("invalid value: "))
            && let Some((found, expected)) = mismatch.split_once(", expected ")
        {
            return error(format!("expected {}", in_prose(expected)))
                .found(found)
                .maybe_hint(own_hint.or_else(|| remedy(found, expected)));
        }
        error(message.trim().replace('\n', ", ")).maybe_hint(own_hint)
    }
}

/// Divides message and hint in errors that the documents' own types raise within the TOML library.
pub(super) const HINT: &str = "\nhint: ";

/// What to do about a value of the wrong type, where that is clear.
fn remedy(found: &str, expected: &str) -> Option<String> {
    let number = matches!(expected, "f64" | "i64" | "u64" | "u32" | "usize") || expected.starts_with("a number");
    match found {
        text if text.starts_with("string") && number => Some("write numbers without quotes and without a unit".to_owned()),
        _ if expected == "a string" => Some("write texts in quotes".to_owned()),
        _ => None,
    }
}

/// Rust's names of types in words a user knows.
fn in_prose(expected: &str) -> &str {
    match expected {
        "f64" => "a number",
        "i64" => "an integer",
        "u64" | "usize" | "u32" => "an integer, 0 or more",
        "a string" => "a text in quotes",
        "a boolean" => "true or false",
        _ if expected.starts_with("struct ") || expected == "a map" => "a table",
        _ => expected,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code, reason = "read for its errors")]
    struct Section {
        seed: u64,
        cash: f64,
        currency: Option<String>,
    }

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code, reason = "read for its errors")]
    struct Whole {
        run: Section,
    }

    fn error(text: &str) -> String {
        Document::from_text("run.toml", text).parse::<Whole>().unwrap_err().to_string()
    }

    #[test]
    fn errors_give_line_column_and_the_word_that_may_be_meant() {
        insta::assert_snapshot!(error("[run]\nseed = 1\ncash = 1\ncurency = 'USD'\n"), @"
        run.toml:4:1: unknown key `curency`
          hint: did you mean `currency`?
        ");
        insta::assert_snapshot!(error("[run]\nseed = 1\n"), @"
        run.toml:1:1: the key `cash` is missing
          hint: add `cash = ...` or a section `[cash]`
        ");
        insta::assert_snapshot!(error("[run]\nseed = 1\ncash = 'much'\n"), @r#"
        run.toml:3:8: expected a number, found string "much"
          hint: write numbers without quotes and without a unit
        "#);
        insta::assert_snapshot!(error("[run]\nseed = -1\ncash = 1\n"), @"run.toml:2:8: expected an integer, 0 or more, found integer `-1`");
        insta::assert_snapshot!(error("[run\nseed = 1\n"), @"run.toml:1:5: unclosed table, expected `]`");
        insta::assert_snapshot!(error("run = 3\n"), @"run.toml:1:7: expected a table, found integer `3`");
        insta::assert_snapshot!(error("[run]\nseed = 1\nseed = 2\n"), @"run.toml:3:1: duplicate key");
    }

    #[test]
    fn keys_are_found_again_after_reading() {
        let document = Document::from_text("a.toml", "[x]\ny = 1\n[[m]]\nname = 'a'\n[[m]]\nname = 'ä'  \nz = { w = 1 }\n");
        let place = |keys: &[&str]| document.error(keys, "").place;
        assert_eq!(place(&["x", "y"]), Place::Line { line: 2, column: 1 });
        assert_eq!(place(&["m", "1", "name"]), Place::Line { line: 6, column: 1 });
        assert_eq!(place(&["m", "1", "z", "w"]), Place::Line { line: 7, column: 7 });
        assert_eq!(place(&["x", "none"]), Place::Line { line: 1, column: 2 });
        assert_eq!(place(&["none"]), Place::File);
        assert_eq!(Document::from_text("a/b.toml", "").resolve("c.csv"), Path::new("a/c.csv"));
    }
}
