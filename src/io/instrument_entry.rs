//! `[[instrument]]`, as twins and runs declare it.

use std::collections::BTreeSet;

use serde::Deserialize;

use super::document::Document;
use super::error::InputError;
use super::margin_entry::MarginEntry;

/// An instrument of a document.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InstrumentEntry {
    /// Symbol.
    pub symbol: String,
    /// Smallest step of the price [currency].
    pub tick_size: f64,
    /// Smallest step of the quantity [units].
    #[serde(default = "one")]
    pub lot_size: f64,
    /// Units traded on an average day.
    pub average_daily_volume: Option<f64>,
    /// Standard deviation of the daily return (a fraction).
    pub daily_volatility: Option<f64>,
    /// When its market is open: the name of a calendar that comes with the program, or the path of a TOML table. Runs alone
    /// know it.
    pub calendar: Option<String>,
    /// Currency of its prices, fees and dividends; none for that of the run.
    pub currency: Option<String>,
    /// Units of the underlying in one unit traded, a whole number above 0; none for 1.
    pub multiplier: Option<f64>,
    /// What equity a position requires; none for nothing beyond the run's `max_leverage`.
    pub margin: Option<MarginEntry>,
}

impl InstrumentEntry {
    /// The file of its calendar, as the document names it; none where it has no calendar, or one that goes by name.
    #[must_use]
    pub fn calendar_file(&self) -> Option<&str> {
        self.calendar.as_deref().filter(|named| names_a_file(named))
    }
}

/// Whether a calendar is that of a file, and no name.
pub(super) fn names_a_file(calendar: &str) -> bool {
    calendar.ends_with(".toml") || calendar.contains(['/', '\\'])
}

fn one() -> f64 {
    1.0
}

/// Holds instruments to have sizes greater than 0 and symbols of their own.
pub(super) fn check_instruments(document: &Document, instruments: &[InstrumentEntry]) -> Result<(), InputError> {
    let mut seen = BTreeSet::new();
    for (index, instrument) in instruments.iter().enumerate() {
        let number = index.to_string();
        let sizes = [
            ("tick_size", Some(instrument.tick_size)),
            ("lot_size", Some(instrument.lot_size)),
            ("average_daily_volume", instrument.average_daily_volume),
            ("daily_volatility", instrument.daily_volatility),
        ];
        for (key, value) in sizes {
            if let Some(value) = value.filter(|v| !v.is_finite() || *v <= 0.0) {
                return Err(document
                    .error(&["instrument", &number, key], "expected a finite number greater than 0")
                    .found(value)
                    .hint("correct the value, or leave the key out where it may be"));
            }
        }
        if !seen.insert(instrument.symbol.as_str()) {
            let message = format!("the instrument `{}` is here twice", instrument.symbol);
            return Err(document.error(&["instrument", &number, "symbol"], message).hint("drop one of the two"));
        }
    }
    Ok(())
}

/// Holds the terms on which instruments of a run are held to what they can be.
pub(super) fn check_terms(document: &Document, instruments: &[InstrumentEntry]) -> Result<(), InputError> {
    for (index, instrument) in instruments.iter().enumerate() {
        let number = index.to_string();
        let whole = |multiplier: f64| multiplier.fract() == 0.0 && (1.0..=1e9).contains(&multiplier);
        if let Some(multiplier) = instrument.multiplier.filter(|multiplier| !whole(*multiplier)) {
            let error = document.error(&["instrument", &number, "multiplier"], "expected a whole number from 1 to 1e9");
            return Err(error.found(multiplier).hint("it is 50 of a future on 50 times an index; 1 of a share"));
        }
        if instrument.currency.as_ref().is_some_and(String::is_empty) {
            let error = document.error(&["instrument", &number, "currency"], "expected the name of a currency");
            return Err(error.found_text("").hint("leave it out where it is that of the run"));
        }
        if let Some(margin) = &instrument.margin {
            margin.check(document, &number)?;
        }
    }
    Ok(())
}

/// Holds the instruments of a twin to say nothing of the account, which it has none of.
pub(super) fn check_no_terms(document: &Document, instruments: &[InstrumentEntry]) -> Result<(), InputError> {
    for (index, instrument) in instruments.iter().enumerate() {
        let InstrumentEntry { calendar, currency, multiplier, margin, .. } = instrument;
        if calendar.is_some() {
            let error = document.error(&["instrument", &index.to_string(), "calendar"], "a twin has no use for a calendar");
            return Err(error.hint("leave it out: a recording says itself when orders were filled"));
        }
        let there = [("currency", currency.is_some()), ("multiplier", multiplier.is_some()), ("margin", margin.is_some())];
        if let Some((key, _)) = there.into_iter().find(|(_, there)| *there) {
            let error = document.error(&["instrument", &index.to_string(), key], format!("only a run has the key `{key}`"));
            return Err(error.hint("a twin knows prices and costs, and no account: drop the key"));
        }
    }
    Ok(())
}
