//! The record of a run, one line of JSON a case: seals first, then what was said and what was true.

use serde::{Deserialize, Serialize};

use super::domain::Domain;
use super::score::Entry;
use super::seal::{Sealed, seal};
use super::trial::Trial;
use super::truth::Truth;

/// The schema the first line names.
pub const JOURNAL: &str = "trueup.proof-cases/1";

/// The first line: written before any case is diagnosed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Header {
    /// [`JOURNAL`].
    pub schema: String,
    /// What the cases are of.
    pub domain: Domain,
    /// The seed all cases are drawn from.
    pub seed: u64,
    /// How many they are.
    pub cases: usize,
    /// The version of trueup.
    pub version: String,
    /// The seal of each label.
    pub seals: Vec<String>,
}

/// A line for each case, written after its diagnosis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Line {
    /// Number of the case.
    pub index: usize,
    /// The label's salt.
    pub salt: String,
    /// The label, as the text that was sealed.
    pub label: String,
    /// What was said.
    pub trial: Trial,
}

/// A journal as far as it goes.
#[derive(Debug, Clone, PartialEq)]
pub struct Journal {
    /// Its first line.
    pub header: Header,
    /// Its cases, in order.
    pub lines: Vec<Line>,
    /// How much of the text is whole lines [bytes]: a last one may be torn.
    pub whole: usize,
}

/// What is wrong with a journal.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum JournalError {
    /// A line that is none.
    #[error("line {line}: {what}")]
    Line {
        /// Number of the line, from 1 on.
        line: usize,
        /// What was expected, or what the reader says.
        what: String,
    },
    /// A label that is not the one that was sealed.
    #[error("case {index}: the label is not the one that was sealed before the diagnosis")]
    Seal {
        /// Number of the case.
        index: usize,
    },
}

impl Journal {
    /// Reads what is whole of a journal.
    ///
    /// # Errors
    /// A first line that is no header of this schema; a line that is no case, unless it is the last and torn; cases that do
    /// not follow one another; labels that do not fit their seals.
    pub fn read(text: &str) -> Result<Self, JournalError> {
        let wrong = |line: usize, what: String| JournalError::Line { line, what };
        let whole = text.rfind('\n').map_or(0, |end| end + 1);
        let mut rows = text[..whole].lines();
        let header = rows.next().ok_or_else(|| wrong(1, "expected a header".to_owned()))?;
        let header: Header = serde_json::from_str(header).map_err(|error| wrong(1, error.to_string()))?;
        if header.schema != JOURNAL {
            return Err(wrong(1, format!("expected the schema {JOURNAL}, found {}", header.schema)));
        }
        let mut lines: Vec<Line> = Vec::new();
        for (number, row) in rows.enumerate() {
            let line: Line = serde_json::from_str(row).map_err(|error| wrong(number + 2, error.to_string()))?;
            if line.index != number || number >= header.seals.len() {
                return Err(wrong(number + 2, format!("expected case {number}, found {}", line.index)));
            }
            if seal(&line.salt, &line.label) != header.seals[number] {
                return Err(JournalError::Seal { index: number });
            }
            lines.push(line);
        }
        Ok(Self { header, lines, whole })
    }

    /// Its cases unsealed.
    ///
    /// # Errors
    /// A label that is sealed and yet none.
    pub fn entries(&self) -> Result<Vec<Entry>, JournalError> {
        let entry = |(number, line): (usize, &Line)| {
            let truth = Truth::of(self.header.domain, &line.label);
            let truth = truth.map_err(|error| JournalError::Line { line: number + 2, what: error.to_string() })?;
            Ok(Entry { truth, trial: line.trial.clone() })
        };
        self.lines.iter().enumerate().map(entry).collect()
    }
}

impl Header {
    /// The text of the first line, with its end.
    ///
    /// # Errors
    /// None but a bug.
    pub fn text(&self) -> Result<String, serde_json::Error> {
        Ok(format!("{}\n", serde_json::to_string(self)?))
    }
}

impl Line {
    /// The line of a case, its label unsealed.
    #[must_use]
    pub fn new(index: usize, sealed: &Sealed, trial: Trial) -> Self {
        Self { index, salt: sealed.salt.clone(), label: sealed.label.clone(), trial }
    }

    /// Its text, with its end.
    ///
    /// # Errors
    /// None but a bug.
    pub fn text(&self) -> Result<String, serde_json::Error> {
        Ok(format!("{}\n", serde_json::to_string(self)?))
    }
}

#[cfg(test)]
mod tests {
    use super::super::score::tests::entry;
    use super::super::truth::tests::joint_label;
    use super::*;
    use crate::conceal::Kind;
    use crate::sim2real::Seed;
    use crate::sim2real::diagnose::Verdict;

    fn journal(cases: usize) -> (String, Vec<Line>) {
        let lines: Vec<Line> = (0..cases)
            .map(|index| {
                let entry = entry(Kind::Single, &[("bias", 5.0)], Verdict::Named, &[("bias", 0.9)]);
                Line::new(index, &Sealed::new(&joint_label(index), index, Seed(7)).unwrap(), entry.trial)
            })
            .collect();
        let seals = lines.iter().map(|line| seal(&line.salt, &line.label)).collect();
        let header = Header { schema: JOURNAL.into(), domain: Domain::Robot, seed: 7, cases, version: "0".into(), seals };
        (header.text().unwrap() + &lines.iter().map(|line| line.text().unwrap()).collect::<String>(), lines)
    }

    #[test]
    fn what_is_written_is_read_wherever_it_is_torn() {
        let (text, lines) = journal(3);
        let whole = Journal::read(&text).unwrap();
        assert_eq!((&whole.lines, whole.whole), (&lines, text.len()));
        assert_eq!(whole.entries().unwrap()[2].truth.index, 2);
        let ends: Vec<usize> = text.match_indices('\n').map(|(at, _)| at + 1).collect();
        for cut in ends[0]..text.len() {
            let read = Journal::read(&text[..cut]).unwrap();
            let before = ends.iter().filter(|end| **end <= cut).count();
            assert_eq!((read.lines.len(), read.whole), (before - 1, ends[before - 1]), "cut at {cut}");
        }
        assert!(Journal::read(&text[..ends[0] - 1]).is_err() && Journal::read("").is_err());
    }

    #[test]
    fn numbers_are_read_to_the_last_bit() {
        let (text, mut lines) = journal(1);
        for seconds in [0.001_002_533_668_314_746_3, 0.096_235_399_270_900_12, 5e-324, f64::MAX] {
            lines[0].trial.seconds = seconds;
            let header = text.lines().next().unwrap();
            let again = Journal::read(&format!("{header}\n{}", lines[0].text().unwrap())).unwrap();
            assert_eq!(again.lines[0].trial.seconds.to_bits(), seconds.to_bits());
        }
    }

    #[test]
    fn a_label_that_was_changed_after_sealing_is_found_out() {
        let (text, _) = journal(2);
        let forged = text.replacen("1.6666666666666667", "1.7666666666666667", 1);
        assert_ne!(forged, text);
        assert_eq!(Journal::read(&forged), Err(JournalError::Seal { index: 0 }));
        let swapped = text.replace("\"index\":1,", "\"index\":5,");
        assert!(matches!(Journal::read(&swapped), Err(JournalError::Line { line: 3, .. })));
    }
}
