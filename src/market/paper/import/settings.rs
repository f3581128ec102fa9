//! What a log does not say itself: names of symbols, a zone, what fees are worth.

use std::collections::BTreeMap;
use std::path::Path;

use chrono_tz::Tz;
use serde::Deserialize;

use crate::io::{InputError, Place, Table, read_toml};
use crate::market::{Cash, Price};

/// What the user adds to a log.
#[derive(Debug, Clone, Default)]
pub struct ImportSettings {
    /// Id of the format; none where the content says it.
    pub format: Option<String>,
    /// Names of symbols.
    pub symbols: SymbolMap,
    /// The zone of times that have none.
    pub zone: Option<Tz>,
    /// What fees in other currencies are worth.
    pub rates: FeeRates,
}

/// The log's names of symbols, and ours.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct SymbolMap(BTreeMap<String, String>);

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SymbolFile {
    symbols: BTreeMap<String, String>,
}

impl SymbolMap {
    /// The map that has these pairs: the log's name, and ours.
    #[must_use]
    pub fn of(pairs: impl IntoIterator<Item = (String, String)>) -> Self {
        Self(pairs.into_iter().collect())
    }

    /// Reads a map: a TOML file with a table `[symbols]`, or a table with the columns `log_symbol` and `symbol`.
    ///
    /// # Errors
    /// A file that cannot be read; a symbol of the log that is there twice; a name that is empty.
    pub fn read(path: &Path) -> Result<Self, InputError> {
        if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("toml")) {
            let map = read_toml::<SymbolFile>(path)?.symbols;
            if let Some((name, _)) = map.iter().find(|(_, ours)| ours.trim().is_empty()) {
                let error = InputError::new(path, format!("`{name}` has no name of ours"));
                return Err(error.at(Place::File).hint("write it as \"BTC/USDT\" = \"BTCUSDT\""));
            }
            return Ok(Self(map));
        }
        let table = Table::read(path)?;
        let (theirs, ours) = (table.texts_complete("log_symbol")?, table.texts_complete("symbol")?);
        let mut map = BTreeMap::new();
        for (row, (theirs, ours)) in theirs.into_iter().zip(ours).enumerate() {
            if map.contains_key(&theirs) {
                let error = table.error("log_symbol", row, "the symbol is there already").found_text(&theirs);
                return Err(error.hint("leave one of the rows"));
            }
            map.insert(theirs, ours);
        }
        Ok(Self(map))
    }

    /// Our name of a symbol, where there is one.
    #[must_use]
    pub fn get(&self, symbol: &str) -> Option<&str> {
        self.0.get(symbol).map(String::as_str)
    }

    /// Whether there is any.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

/// What one unit of a currency is worth in another.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct FeeRates(BTreeMap<(String, String), Price>);

/// A rate that cannot be.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0:?} is no rate of a currency\nhint: such as BNB/USDT=612.5, what one BNB is worth in USDT")]
pub struct NoRate(String);

impl FeeRates {
    /// Adds a rate, as `BNB/USDT=612.5`: what one unit of the first is worth in the second.
    ///
    /// # Errors
    /// Another form; a rate that is not above 0.
    pub fn add(&mut self, text: &str) -> Result<(), NoRate> {
        let refuse = || NoRate(text.to_owned());
        let (pair, rate) = text.split_once('=').ok_or_else(refuse)?;
        let (from, to) = pair.split_once('/').ok_or_else(refuse)?;
        let rate: Price = rate.parse().map_err(|_| refuse())?;
        if rate.0 <= 0 || from.trim().is_empty() || to.trim().is_empty() {
            return Err(refuse());
        }
        self.0.insert((from.trim().to_uppercase(), to.trim().to_uppercase()), rate);
        Ok(())
    }

    /// `amount` of `from` in `to`, to the nearest 1e-18; none without a rate, or where 128 bits do not hold it.
    #[must_use]
    pub fn convert(&self, amount: Cash, from: &str, to: &str) -> Option<Cash> {
        self.0.get(&(from.to_uppercase(), to.to_uppercase())).and_then(|rate| worth(amount, *rate))
    }
}

/// What `amount` is worth at `price`, to the nearest 1e-18, half away from 0; none where 128 bits do not hold it.
pub(super) fn worth(amount: Cash, price: Price) -> Option<Cash> {
    const NANO: i128 = 1_000_000_000;
    let product = amount.0.checked_mul(i128::from(price.0))?;
    let half = if product < 0 { -NANO / 2 } else { NANO / 2 };
    Some(Cash(product.checked_add(half)? / NANO))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_convert_exactly_and_nonsense_is_refused() {
        let mut rates = FeeRates::default();
        rates.add("BNB/USDT=612.5").unwrap();
        let cash = |text: &str| text.parse::<Cash>().unwrap();
        assert_eq!(rates.convert(cash("0.0001"), "bnb", "USDT"), Some(cash("0.06125")));
        assert_eq!(rates.convert(cash("-0.000000000000000001"), "BNB", "USDT"), Some(cash("-0.000000000000000613")));
        assert_eq!(rates.convert(cash("1"), "USDT", "BNB"), None);
        for text in ["BNB=1", "BNB/USDT", "BNB/USDT=x", "BNB/USDT=0", "/USDT=1", "BNB/USDT=-1"] {
            assert!(rates.add(text).unwrap_err().to_string().contains("hint:"), "{text}");
        }
    }

    #[test]
    fn symbols_are_mapped_by_toml_or_table() {
        let folder = tempfile::tempdir().unwrap();
        let (toml, csv) = (folder.path().join("a.toml"), folder.path().join("a.csv"));
        std::fs::write(&toml, "[symbols]\n\"BTC/USDT\" = \"BTCUSDT\"\n").unwrap();
        std::fs::write(&csv, "log_symbol,symbol\nBTC/USDT,BTCUSDT\n").unwrap();
        assert_eq!(SymbolMap::read(&toml), SymbolMap::read(&csv));
        assert_eq!(SymbolMap::read(&toml).unwrap().get("BTC/USDT"), Some("BTCUSDT"));
        std::fs::write(&csv, "log_symbol,symbol\nA,B\nA,C\n").unwrap();
        assert!(SymbolMap::read(&csv).unwrap_err().to_string().contains("row 3, column `log_symbol`"));
        std::fs::write(&toml, "[symbols]\nA = \"\"\n").unwrap();
        assert!(SymbolMap::read(&toml).is_err());
    }
}
