//! The sets that `trueup data make` writes: which files, with what in them, from which seeds.

use crate::sim2real::Seed;

use super::bars::{Bars, SESSION};
use super::exchange::Exchange;
use super::servo::{Excitation, Servo, ServoEffect};
use super::{Column, Table};

/// What a file holds.
#[derive(Debug, Clone, PartialEq)]
pub enum Content {
    /// Columns, written as the file's ending says (`.csv` or `.parquet`).
    Table(Table),
    /// Text as it is.
    Text(String),
}

/// A folder of `data/`.
#[derive(Debug, Clone, PartialEq)]
pub struct Set {
    /// Name of the folder.
    pub name: &'static str,
    /// Files by name.
    pub files: Vec<(&'static str, Content)>,
}

/// Seed of every set.
const SEED: Seed = Seed(20_240_805);
/// Sessions of the `bars` set.
const SESSIONS: usize = 20;

/// All sets. Made anew at each call; the same bits at each.
#[must_use]
pub fn catalogue() -> Vec<Set> {
    vec![servo(), execution(), bars()]
}

fn text(words: &str) -> Content {
    Content::Text(words.to_owned())
}

fn servo() -> Set {
    let seed = SEED.child("servo");
    let arm = Servo::default().with([ServoEffect::BristleFriction { coulomb: 0.18, breakaway: 0.18 }]);
    let train = arm.record(Excitation::SinesAndSteps, seed.child("train"));
    let test = arm.record(Excitation::ChirpAndSteps, seed.child("test"));
    Set {
        name: "servo",
        files: vec![
            ("README.md", text(include_str!("catalogue/servo.md"))),
            ("test.csv", Content::Table(test)),
            ("train.csv", Content::Table(train)),
            ("twin.toml", text(include_str!("catalogue/servo.toml"))),
        ],
    }
}

fn execution() -> Set {
    let exchange = Exchange::default();
    let [(_, orders), (_, fills), (_, quotes), (_, trades)] = exchange.day(SEED.child("execution")).tables(&exchange);
    Set {
        name: "execution",
        files: vec![
            ("README.md", text(include_str!("catalogue/execution.md"))),
            ("fills.csv", Content::Table(fills)),
            ("orders.csv", Content::Table(orders)),
            ("quotes.parquet", Content::Table(quotes)),
            ("trades.parquet", Content::Table(trades)),
            ("twin.toml", text(include_str!("catalogue/execution.toml"))),
        ],
    }
}

fn bars() -> Set {
    let table = Bars::default().minutes(SESSIONS * SESSION, SEED.child("bars"));
    Set {
        name: "bars",
        files: vec![
            ("README.md", text(include_str!("catalogue/bars.md"))),
            ("bars.parquet", Content::Table(table)),
            ("run.toml", text(include_str!("catalogue/bars.toml"))),
        ],
    }
}

impl Set {
    /// The table in the file called `name`, if that is one.
    #[must_use]
    pub fn table(&self, name: &str) -> Option<&Table> {
        self.files.iter().find(|(own, _)| *own == name).and_then(|(_, content)| match content {
            Content::Table(table) => Some(table),
            Content::Text(_) => None,
        })
    }

    /// Bytes of the tables at eight a number, a bound on what compressed files take.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let of = |content: &Content| match content {
            Content::Table(table) => table.columns().iter().map(|(_, column)| column_bytes(column)).sum(),
            Content::Text(words) => words.len(),
        };
        self.files.iter().map(|(_, content)| of(content)).sum()
    }
}

fn column_bytes(column: &Column) -> usize {
    match column {
        Column::Text(words) => words.iter().map(String::len).sum(),
        Column::Empty(_) => 0,
        numbers => 8 * numbers.len(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn digests(set: &Set) -> Vec<String> {
        let of = |(name, content): &(&'static str, Content)| match content {
            Content::Table(table) => Some(format!("{name} {} {}", table.rows(), table.digest())),
            Content::Text(_) => None,
        };
        set.files.iter().filter_map(of).collect()
    }

    /// Written down once: what changes these bits changes the committed data and every figure made from them.
    #[test]
    fn golden_sets() {
        insta::assert_debug_snapshot!(catalogue().iter().map(|set| (set.name, digests(set))).collect::<Vec<_>>());
    }

    #[test]
    fn every_set_says_what_it_is_and_what_it_conceals() {
        for set in catalogue() {
            let Some((_, Content::Text(readme))) = set.files.iter().find(|(name, _)| *name == "README.md") else {
                panic!("{} has no README", set.name)
            };
            assert!(readme.contains("## What is concealed") && readme.contains("seed 20240805"), "{}", set.name);
            for (name, content) in &set.files {
                assert!(*name == "README.md" || readme.contains(name), "{}: {name} is not described", set.name);
                let Content::Table(table) = content else { continue };
                assert!(table.rows() > 500 && table.columns().iter().all(|(_, column)| column.len() == table.rows()));
                for (column, _) in table.columns() {
                    let family = column.trim_end_matches("_size").trim_end_matches(char::is_numeric);
                    assert!(readme.contains(&format!("`{family}")), "{}: column {column} is not described", set.name);
                }
            }
        }
    }

    #[test]
    fn twins_do_not_tell() {
        for set in catalogue() {
            for (name, content) in &set.files {
                if let Content::Text(words) = content
                    && name.ends_with("twin.toml")
                {
                    let told = ["dry", "coulomb", "bristle", "delay", "latency", "half_spread", "book_walk"];
                    assert!(told.iter().all(|word| !words.contains(word)), "{}/{name} tells", set.name);
                }
            }
        }
    }

    #[test]
    fn sets_are_small() {
        let bytes: usize = catalogue().iter().map(Set::bytes).sum();
        assert!(bytes < 8_000_000, "{bytes} bytes before compression");
    }
}
