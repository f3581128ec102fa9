//! What is wrong with an input: where, what was found there, and what to do about it.

use std::fmt;
use std::path::{Path, PathBuf};

/// The place in a file an [`InputError`] speaks of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// The file as a whole.
    File,
    /// A row: of a CSV file the line an editor shows, the header being row 1; of Parquet or Arrow the data row, from 1.
    Row(usize),
    /// A line and a column of a text, both from 1.
    Line {
        /// Line.
        line: usize,
        /// Column of the line, in characters.
        column: usize,
    },
}

/// An input that cannot be used, with place, value found and remedy.
///
/// ```text
/// train.csv: row 17, column `q`: expected a number, found "abc"
///   hint: leave the cell empty where a sample was lost
/// ```
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub struct InputError {
    /// File the error is in.
    pub path: PathBuf,
    /// Where in the file.
    pub place: Place,
    /// Column, by the name it has in the file.
    pub column: Option<Box<str>>,
    /// What is wrong.
    pub message: String,
    /// The value found, as it is shown (text in quotes).
    pub found: Option<Box<str>>,
    /// What to do about it.
    pub hint: Option<Box<str>>,
}

impl InputError {
    /// An error of the whole file.
    #[must_use]
    pub fn new(path: impl AsRef<Path>, message: impl Into<String>) -> Self {
        Self {
            path: path.as_ref().to_path_buf(),
            place: Place::File,
            column: None,
            message: message.into(),
            found: None,
            hint: None,
        }
    }

    /// Says where.
    #[must_use]
    pub fn at(mut self, place: Place) -> Self {
        self.place = place;
        self
    }

    /// Names the column, as the file does.
    #[must_use]
    pub fn in_column(mut self, column: impl Into<String>) -> Self {
        self.column = Some(column.into().into());
        self
    }

    /// Gives the value found.
    #[must_use]
    pub fn found(mut self, value: impl fmt::Display) -> Self {
        self.found = Some(value.to_string().into());
        self
    }

    /// Gives the text found: it is shown in quotes, and cut where it is long.
    #[must_use]
    pub fn found_text(self, text: &str) -> Self {
        const SHOWN: usize = 60;
        let dots = if text.chars().nth(SHOWN).is_some() { "..." } else { "" };
        let shown: String = text.chars().take(SHOWN).collect();
        self.found(format_args!("{shown:?}{dots}"))
    }

    /// Gives the remedy.
    #[must_use]
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into().into());
        self
    }

    /// Gives the remedy, where there is one.
    #[must_use]
    pub fn maybe_hint(mut self, hint: Option<String>) -> Self {
        self.hint = hint.map(Into::into).or(self.hint);
        self
    }
}

impl fmt::Display for InputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.path.display())?;
        match (self.place, &self.column) {
            (Place::File, None) => {}
            (Place::File, Some(column)) => write!(f, ": column `{column}`")?,
            (Place::Row(row), None) => write!(f, ": row {row}")?,
            (Place::Row(row), Some(column)) => write!(f, ": row {row}, column `{column}`")?,
            (Place::Line { line, column }, _) => write!(f, ":{line}:{column}")?,
        }
        write!(f, ": {}", self.message)?;
        if let Some(found) = &self.found {
            write!(f, ", found {found}")?;
        }
        if let Some(hint) = &self.hint {
            write!(f, "\n  hint: {hint}")?;
        }
        Ok(())
    }
}

/// The candidate most like `word`, where one is like enough to be meant.
///
/// Likeness is the Damerau-Levenshtein distance, without regard to case: at most a third of the longer word may
/// differ (of very short words one letter, if another stays), or one word must begin with the other.
#[must_use]
pub fn did_you_mean<C: AsRef<str>>(word: &str, candidates: impl IntoIterator<Item = C>) -> Option<String> {
    // The distance takes the product of both lengths to compute; nobody mistypes a word that long.
    const LONGEST: usize = 100;
    if word.len() > LONGEST {
        return None;
    }
    let word = word.to_lowercase();
    candidates
        .into_iter()
        .filter(|candidate| candidate.as_ref().len() <= LONGEST)
        .filter_map(|candidate| {
            let other = candidate.as_ref().to_lowercase();
            let distance = strsim::damerau_levenshtein(&word, &other);
            let longer = word.chars().count().max(other.chars().count());
            let begins = word.len().min(other.len()) >= 3 && (word.starts_with(&other) || other.starts_with(&word));
            (distance < longer && 3 * distance <= longer.max(3) || begins).then(|| (distance, candidate.as_ref().to_owned()))
        })
        .min_by(|a, b| a.cmp(b))
        .map(|(_, candidate)| candidate)
}

/// A hint for a `word` that is none of `candidates`: the one that may be meant, or else all there are.
#[must_use]
pub fn hint_among<C: AsRef<str>>(word: &str, candidates: &[C]) -> Option<String> {
    match did_you_mean(word, candidates) {
        Some(meant) => Some(format!("did you mean `{meant}`?")),
        None if candidates.is_empty() => None,
        None => Some(format!("there are {}", listed(candidates))),
    }
}

/// Names as a list in prose: `` `a`, `b` and `c` ``, cut where it is long.
#[must_use]
pub fn listed<C: AsRef<str>>(names: &[C]) -> String {
    const SHOWN: usize = 20;
    let quoted: Vec<String> = names.iter().take(SHOWN).map(|n| format!("`{}`", n.as_ref())).collect();
    match quoted.as_slice() {
        _ if names.len() > SHOWN => format!("{} and {} more", quoted.join(", "), names.len() - SHOWN),
        [first @ .., last] if !first.is_empty() => format!("{} and {last}", first.join(", ")),
        all => all.concat(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_says_place_value_and_remedy() {
        let error = InputError::new("train.csv", "expected a number")
            .at(Place::Row(17))
            .in_column("q")
            .found_text("abc")
            .hint("leave the cell empty where a sample was lost");
        insta::assert_snapshot!(error, @r#"
        train.csv: row 17, column `q`: expected a number, found "abc"
          hint: leave the cell empty where a sample was lost
        "#);
        let error = InputError::new("twin.toml", "unknown key `modle`").at(Place::Line { line: 2, column: 1 });
        assert_eq!(error.to_string(), "twin.toml:2:1: unknown key `modle`");
        let long = InputError::new("a", "b").found_text(&"x".repeat(1000)).to_string();
        assert!(long.len() < 80 && long.ends_with("\"..."), "{long}");
    }

    #[test]
    fn the_nearest_word_is_meant_and_a_far_one_is_not() {
        let ids = ["coulomb_friction", "stribeck_friction", "command_delay"];
        assert_eq!(did_you_mean("coulomb_frcition", ids).as_deref(), Some("coulomb_friction"));
        assert_eq!(did_you_mean("Coulomb", ids).as_deref(), Some("coulomb_friction"));
        assert_eq!(did_you_mean("gravity", ids), None);
        assert_eq!(did_you_mean("t", ["q", "u", "time"]), None);
        assert_eq!(did_you_mean("pso", ["position", "velocity"]), None);
        assert_eq!(did_you_mean("bidd", ["ask", "bid", "bid2"]).as_deref(), Some("bid"));
        // Without regard to such words this would take minutes.
        assert_eq!(did_you_mean(&"a".repeat(1_000_000), ["b".repeat(1_000_000)]), None);
        assert_eq!(hint_among("zzz", &["a", "b", "c"]).as_deref(), Some("there are `a`, `b` and `c`"));
    }
}
