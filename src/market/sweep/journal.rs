//! The record of a sweep under way, one line of JSON a run, in the order in which they came to their end.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::{Outcome, Sweep, Values, hexadecimal};

/// The schema the first line names.
pub const JOURNAL: &str = "trueup.sweep-runs/1";

/// The first line.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Header {
    /// [`JOURNAL`].
    pub schema: String,
    /// The version of trueup.
    pub version: String,
    /// SHA-256 of the run's document, its data and all values that are to be tried.
    pub plan: String,
    /// Number of runs.
    pub runs: usize,
}

/// A line for each run that came to its end.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Line {
    /// Number of the run.
    pub index: usize,
    /// What it came to.
    #[serde(flatten)]
    pub outcome: Outcome,
}

/// A journal as far as it goes.
#[derive(Debug, Clone, PartialEq)]
pub struct Journal {
    /// Its first line.
    pub header: Header,
    /// What runs came to, by their number.
    pub done: BTreeMap<usize, Outcome>,
    /// How much of the text is whole lines [bytes]: a last one may be torn.
    pub whole: usize,
}

/// A line that is none.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {what}")]
pub struct JournalError {
    /// Number of the line, from 1 on.
    pub line: usize,
    /// What was expected, or what the reader says.
    pub what: String,
}

impl Header {
    /// The header of a sweep of `all`.
    #[must_use]
    pub fn of(sweep: &Sweep<'_>, all: &[Values]) -> Self {
        let mut text: String = sweep.prepared.provenance.inputs.iter().map(|input| format!("{}\n", input.sha256)).collect();
        text += &format!("{}\n{all:?}", sweep.prepared.provenance.seed);
        let version = env!("CARGO_PKG_VERSION").to_owned();
        Self { schema: JOURNAL.to_owned(), version, plan: hexadecimal(&text), runs: all.len() }
    }

    /// The text of the first line, with its end.
    ///
    /// # Errors
    /// None but a bug.
    pub fn text(&self) -> Result<String, serde_json::Error> {
        Ok(format!("{}\n", serde_json::to_string(self)?))
    }
}

impl Line {
    /// Its text, with its end.
    ///
    /// # Errors
    /// None but a bug.
    pub fn text(&self) -> Result<String, serde_json::Error> {
        Ok(format!("{}\n", serde_json::to_string(self)?))
    }
}

impl Journal {
    /// Reads what is whole of a journal.
    ///
    /// # Errors
    /// A first line that is no header of this schema; a line that is no run, unless it is the last and torn.
    pub fn read(text: &str) -> Result<Self, JournalError> {
        let wrong = |line: usize, what: String| JournalError { line, what };
        let whole = text.rfind('\n').map_or(0, |end| end + 1);
        let mut rows = text[..whole].lines();
        let header = rows.next().ok_or_else(|| wrong(1, "expected a header".to_owned()))?;
        let header: Header = serde_json::from_str(header).map_err(|error| wrong(1, error.to_string()))?;
        if header.schema != JOURNAL {
            return Err(wrong(1, format!("expected the schema {JOURNAL}, found {}", header.schema)));
        }
        let mut done = BTreeMap::new();
        for (number, row) in rows.enumerate() {
            let line: Line = serde_json::from_str(row).map_err(|error| wrong(number + 2, error.to_string()))?;
            if line.index >= header.runs || done.contains_key(&line.index) {
                return Err(wrong(number + 2, format!("run {} is here twice, or is none of {}", line.index, header.runs)));
            }
            done.insert(line.index, line.outcome);
        }
        Ok(Self { header, done, whole })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_to_the_last_bit_wherever_it_is_torn() {
        let header = Header { schema: JOURNAL.into(), version: "0".into(), plan: "p".into(), runs: 3 };
        let metrics = [("sharpe".to_owned(), 0.1 + 0.2), ("cagr".to_owned(), 5e-324)].into_iter().collect();
        let lines = [
            Line { index: 2, outcome: Outcome::Done { metrics } },
            Line { index: 0, outcome: Outcome::Invalid { why: "`slow` must be\nabove `fast`".into() } },
        ];
        let text = header.text().unwrap() + &lines.iter().map(|line| line.text().unwrap()).collect::<String>();
        let whole = Journal::read(&text).unwrap();
        assert_eq!(whole.done, lines.iter().map(|line| (line.index, line.outcome.clone())).collect());
        let ends: Vec<usize> = text.match_indices('\n').map(|(at, _)| at + 1).collect();
        for cut in ends[0]..text.len() {
            let read = Journal::read(&text[..cut]).unwrap();
            let before = ends.iter().filter(|end| **end <= cut).count();
            assert_eq!((read.done.len(), read.whole), (before - 1, ends[before - 1]), "cut at {cut}");
        }
        let twice = format!("{text}{}", lines[0].text().unwrap());
        assert_eq!(Journal::read(&twice).unwrap_err().line, 4);
        assert!(Journal::read(&text[..ends[0] - 1]).is_err());
    }
}
