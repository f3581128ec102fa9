//! What was taken for what.

use serde::{Deserialize, Serialize};

use super::score::{Entry, Method};
use crate::conceal::Kind;

/// Counts of answers by truth.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Confusion {
    /// What was concealed: a row each.
    pub truths: Vec<String>,
    /// What was said first: a column each.
    pub answers: Vec<String>,
    /// How often, row by row.
    pub counts: Vec<Vec<usize>>,
}

/// Answers that are no names.
const NOTHING: &str = "nothing";
const UNKNOWN: &str = "unexplained";

impl Confusion {
    /// Of all cases but pairs, which have no one answer.
    #[must_use]
    pub fn of(entries: &[Entry]) -> Self {
        let pairs: Vec<(String, String)> = entries.iter().filter_map(|entry| Some((truth(entry)?, answer(entry)))).collect();
        let listed = |names: &mut dyn Iterator<Item = &String>, last: &[&str]| -> Vec<String> {
            let mut names: Vec<String> = names.filter(|name| !last.contains(&name.as_str())).cloned().collect();
            names.sort();
            names.dedup();
            names.extend(last.iter().map(|name| (*name).to_owned()));
            names
        };
        let truths = listed(&mut pairs.iter().map(|(truth, _)| truth), &[NOT_EXCITED, OUTSIDE, NOTHING]);
        let mut both = pairs.iter().flat_map(|(truth, answer)| [truth, answer]);
        let answers =
            listed(&mut both.by_ref().filter(|name| ![NOT_EXCITED, OUTSIDE].contains(&name.as_str())), &[UNKNOWN, NOTHING]);
        let mut counts = vec![vec![0; answers.len()]; truths.len()];
        for (truth, answer) in &pairs {
            let place = |names: &[String], name: &String| names.iter().position(|other| other == name);
            if let (Some(row), Some(column)) = (place(&truths, truth), place(&answers, answer)) {
                counts[row][column] += 1;
            }
        }
        Self { truths, answers, counts }
    }

    /// Whether an answer is the right one for a truth.
    #[must_use]
    pub fn right(&self, row: usize, column: usize) -> bool {
        let (truth, answer) = (self.truths[row].as_str(), self.answers[column].as_str());
        match truth {
            OUTSIDE => answer == UNKNOWN,
            NOT_EXCITED => answer == NOTHING,
            _ => truth == answer,
        }
    }
}

const NOT_EXCITED: &str = "not excited";
const OUTSIDE: &str = "outside the library";

fn truth(entry: &Entry) -> Option<String> {
    match entry.truth.kind {
        Kind::Single => entry.truth.effects.first().map(|effect| effect.id.clone()),
        Kind::Pair => None,
        Kind::Null(_) => Some(NOTHING.to_owned()),
        Kind::Outside => Some(OUTSIDE.to_owned()),
        Kind::NotExcited => Some(NOT_EXCITED.to_owned()),
    }
}

fn answer(entry: &Entry) -> String {
    let answer = entry.answer(Method::Diagnosis);
    match answer.names.first() {
        _ if answer.unknown => UNKNOWN.to_owned(),
        Some(name) => name.clone(),
        None => NOTHING.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::score::tests::entry;
    use super::*;
    use crate::sim2real::diagnose::Verdict;

    #[test]
    fn answers_are_counted_by_truth() {
        let entries = [
            entry(Kind::Single, &[("bias", 5.0)], Verdict::Named, &[("bias", 0.9)]),
            entry(Kind::Single, &[("bias", 5.0)], Verdict::Named, &[("drift", 0.9)]),
            entry(Kind::Outside, &[("shaking", 5.0)], Verdict::Unexplained, &[("bias", 0.2)]),
            entry(Kind::Pair, &[("bias", 5.0), ("drift", 5.0)], Verdict::Named, &[("bias", 0.9)]),
        ];
        let confusion = Confusion::of(&entries);
        let count = |truth: &str, answer: &str| {
            let row = confusion.truths.iter().position(|name| name == truth).unwrap();
            let column = confusion.answers.iter().position(|name| name == answer).unwrap();
            (confusion.counts[row][column], confusion.right(row, column))
        };
        assert_eq!(count("bias", "bias"), (1, true));
        assert_eq!(count("bias", "drift"), (1, false));
        assert_eq!(count("outside the library", "unexplained"), (1, true));
        assert_eq!(confusion.counts.iter().flatten().sum::<usize>(), 3);
    }
}
