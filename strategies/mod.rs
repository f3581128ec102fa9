//! The strategies that come with the crate: one a file, one row each in [`STRATEGIES`], with an example beside it.

mod buy_and_hold;
mod instant;
mod market_making;
mod mean_reversion;
mod momentum;
mod pairs;
mod parent_order;
mod pov;
mod reversion;
mod schedule;
mod sma_cross;
mod twap;
mod volume_profile;
mod vwap;

pub use buy_and_hold::BuyAndHold;
pub use instant::Instant;
pub use market_making::{AvellanedaStoikov, MarketMaking, Quoting, TwoSided};
pub use mean_reversion::MeanReversion;
pub use momentum::Momentum;
pub use pairs::Pairs;
pub use parent_order::ParentOrder;
pub use pov::Pov;
pub use reversion::{Reversion, Thresholds};
pub use schedule::{Schedule, Slice};
pub use sma_cross::SmaCross;
pub use twap::Twap;
pub use volume_profile::{PastDays, Span, VolumeProfile};
pub use vwap::Vwap;

use crate::market::indicator::Period;
use crate::market::{Instrument, Strategy};

/// A row of the registry.
#[derive(Debug, Clone, Copy)]
pub struct Kind {
    /// Its id, as a run's `kind`.
    pub name: &'static str,
    /// What it does, in one sentence.
    pub about: &'static str,
    /// A `[strategy]` table to copy.
    pub example: &'static str,
    /// Names of its parameters.
    pub parameters: &'static [&'static str],
    /// Least number of instruments it needs.
    pub instruments: usize,
    /// Makes one from its parameters: the `[strategy]` table without `kind`.
    pub build: fn(toml::Table) -> Result<Box<dyn Strategy>, StrategyError>,
}

/// The strategies a run can name.
pub static STRATEGIES: &[Kind] = &[
    buy_and_hold::KIND,
    market_making::KIND,
    mean_reversion::KIND,
    momentum::KIND,
    pairs::KIND,
    pov::KIND,
    sma_cross::KIND,
    twap::KIND,
    vwap::KIND,
];

/// A `[strategy]` table that makes no strategy.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum StrategyError {
    /// No `kind`, or one that is no text.
    #[error("[strategy] does not say its `kind`\nhint: add kind = \"sma_cross\"; there are {0}")]
    NoKind(String),
    /// A kind that is not in the registry.
    #[error("[strategy] kind = \"{found}\" is not known\nhint: {hint}")]
    Unknown {
        /// What was found.
        found: String,
        /// What may be meant.
        hint: String,
    },
    /// A parameter that is missing, unknown or of the wrong type.
    #[error("[strategy] {kind}: {message}\nhint: its parameters are {parameters}")]
    Parameter {
        /// The strategy.
        kind: &'static str,
        /// What is wrong.
        message: String,
        /// The parameters it has.
        parameters: String,
    },
    /// A parameter whose value cannot be.
    #[error("[strategy] {kind}: {parameter} is {value}\nhint: {hint}")]
    Value {
        /// The strategy.
        kind: &'static str,
        /// The parameter.
        parameter: &'static str,
        /// What was found.
        value: String,
        /// The remedy.
        hint: &'static str,
    },
    /// An instrument the run does not have.
    #[error("[strategy] {kind}: {parameter} names `{found}`, which the run does not have\nhint: it has {known}")]
    Symbol {
        /// The strategy.
        kind: &'static str,
        /// The parameter.
        parameter: &'static str,
        /// What was found.
        found: String,
        /// The instruments there are.
        known: String,
    },
    /// A run of too few instruments.
    #[error(
        "[strategy] {kind} needs {needed} instruments, and the run has {found}\nhint: add an [[instrument]] and its [[data]]"
    )]
    TooFew {
        /// The strategy.
        kind: &'static str,
        /// How many it needs.
        needed: usize,
        /// How many there are.
        found: usize,
    },
}

/// The strategy a `[strategy]` table describes.
///
/// # Errors
/// If its kind is not known, or a parameter is missing, unknown, of the wrong type or of a value that cannot be.
pub fn build(table: &toml::Table) -> Result<Box<dyn Strategy>, StrategyError> {
    let mut parameters = table.clone();
    let found = match parameters.remove("kind") {
        Some(toml::Value::String(kind)) => kind,
        _ => return Err(StrategyError::NoKind(names())),
    };
    match STRATEGIES.iter().find(|kind| kind.name == found) {
        Some(kind) => (kind.build)(parameters),
        None => Err(StrategyError::Unknown { hint: hint(&found), found }),
    }
}

/// Holds a `[strategy]` table to the instruments of its run: those it names are there, and there are enough.
///
/// # Errors
/// The first instrument that is missing. A table [`build`] refuses is not looked into.
pub fn check_instruments(table: &toml::Table, instruments: &[Instrument]) -> Result<(), StrategyError> {
    let name = table.get("kind").and_then(toml::Value::as_str);
    let Some(kind) = STRATEGIES.iter().find(|kind| name == Some(kind.name)) else { return Ok(()) };
    let names: Vec<&str> = instruments.iter().map(|instrument| instrument.symbol.as_str()).collect();
    for parameter in ["symbol", "symbols"] {
        let found: Vec<&str> = match table.get(parameter) {
            Some(toml::Value::String(symbol)) => vec![symbol],
            Some(toml::Value::Array(symbols)) => symbols.iter().filter_map(toml::Value::as_str).collect(),
            _ => Vec::new(),
        };
        if let Some(found) = found.into_iter().find(|symbol| !names.contains(symbol)) {
            let (found, known) = (found.to_owned(), names.join(", "));
            return Err(StrategyError::Symbol { kind: kind.name, parameter, found, known });
        }
    }
    let (needed, found) = (kind.instruments, instruments.len());
    if found < needed { Err(StrategyError::TooFew { kind: kind.name, needed, found }) } else { Ok(()) }
}

fn names() -> String {
    STRATEGIES.iter().map(|kind| format!("`{}`", kind.name)).collect::<Vec<_>>().join(", ")
}

fn hint(found: &str) -> String {
    let distance = |kind: &&Kind| strsim::damerau_levenshtein(kind.name, &found.to_lowercase());
    match STRATEGIES.iter().min_by_key(distance).filter(|kind| distance(kind) <= kind.name.len() / 2) {
        Some(kind) => format!("did you mean `{}`?", kind.name),
        None => format!("there are {}", names()),
    }
}

/// Reads the parameters of `kind`, unknown keys being errors.
fn read<'de, P: serde::Deserialize<'de>>(kind: &Kind, parameters: toml::Table) -> Result<P, StrategyError> {
    P::deserialize(toml::Value::Table(parameters)).map_err(|error| StrategyError::Parameter {
        kind: kind.name,
        message: error.message().trim().to_owned(),
        parameters: kind.parameters.join(", "),
    })
}

/// Holds a weight to what a weight can be.
fn check_weight(kind: &Kind, weight: f64) -> Result<(), StrategyError> {
    if weight.is_finite() && weight > 0.0 {
        return Ok(());
    }
    let hint = "it is the part of equity to hold, above 0; above 1 needs `max_leverage` in [run]";
    Err(StrategyError::Value { kind: kind.name, parameter: "weight", value: weight.to_string(), hint })
}

/// Holds a number of bars to what an indicator can look back on, and to `least`.
fn check_period(kind: &Kind, parameter: &'static str, count: usize, least: usize) -> Result<Period, StrategyError> {
    let hint = match least {
        0 | 1 => "it is a number of bars from 1 to 1,000,000",
        2 | 3 => "it is a number of bars from 3 to 1,000,000",
        _ => "it is a number of bars from 4 to 1,000,000",
    };
    let error = StrategyError::Value { kind: kind.name, parameter, value: count.to_string(), hint };
    Period::new(count).ok().filter(|_| count >= least).ok_or(error)
}

/// What a switch is that is on where nothing is said.
fn yes() -> bool {
    true
}

/// All of the equity but for a part in a hundred: what a gap at the next open, the spread and fees may take.
fn most_of_it() -> f64 {
    0.99
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::market::check_strategy;
    use crate::sim2real::Seed;

    fn error(text: &str) -> String {
        build(&toml::from_str(text).unwrap()).err().unwrap().to_string()
    }

    #[test]
    fn every_row_is_built_from_its_example_and_keeps_the_contract() {
        for kind in STRATEGIES {
            let example: toml::Table = toml::from_str(kind.example).unwrap();
            let table = example["strategy"].as_table().unwrap().clone();
            assert_eq!(table["kind"].as_str(), Some(kind.name));
            for parameter in table.keys().filter(|key| *key != "kind") {
                assert!(kind.parameters.contains(&parameter.as_str()), "{parameter} of {}", kind.name);
            }
            assert_eq!(build(&table).unwrap().name(), kind.name);
            for seed in 0..3 {
                check_strategy(|_| build(&table).unwrap(), Seed(seed)).unwrap();
            }
        }
    }

    #[test]
    fn a_table_that_makes_no_strategy_says_why() {
        let there = format!("there are {}", names());
        assert!(there.contains("`mean_reversion`, `momentum`, `pairs`, `pov`, `sma_cross`, `twap`, `vwap`"), "{there}");
        for (table, expected) in [
            (
                "kind = 'sma_corss'\nfast = 1",
                "[strategy] kind = \"sma_corss\" is not known\nhint: did you mean `sma_cross`?".to_owned(),
            ),
            ("kind = 'moon'", format!("[strategy] kind = \"moon\" is not known\nhint: {there}")),
            ("fast = 1", format!("[strategy] does not say its `kind`\nhint: add kind = \"sma_cross\"; {there}")),
            (
                "kind = 'sma_cross'\nfast = 50\nslow = 10",
                "[strategy] sma_cross: slow is 10\nhint: `slow` must be above `fast`".to_owned(),
            ),
        ] {
            assert_eq!(error(table), expected);
        }
        let unknown = error("kind = 'sma_cross'\nfast = 10\nslow = 50\nwieght = 1.0");
        assert!(
            unknown.contains("`wieght`") && unknown.contains("its parameters are fast, slow, short, weight"),
            "{unknown}"
        );
        assert!(error("kind = 'sma_cross'\nfast = 10").contains("missing field `slow`"));
        assert!(error("kind = 'sma_cross'\nfast = -10\nslow = 5").contains("fast, slow"));
        assert!(error("kind = 'buy_and_hold'\nweight = nan").contains("weight is NaN"));
    }
}
