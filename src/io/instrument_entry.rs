//! `[[instrument]]`, as twins and runs declare it.

use std::collections::BTreeSet;

use serde::Deserialize;

use super::document::Document;
use super::error::InputError;

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
}

impl InstrumentEntry {
    /// The file of its calendar, as the document names it; none where it has no calendar, or one that goes by name.
    #[must_use]
    pub fn calendar_file(&self) -> Option<&str> {
        self.calendar.as_deref().filter(|named| named.ends_with(".toml") || named.contains(['/', '\\']))
    }
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

/// Holds the instruments of a twin to have no calendar.
pub(super) fn refuse_calendars(document: &Document, instruments: &[InstrumentEntry]) -> Result<(), InputError> {
    let Some(index) = instruments.iter().position(|instrument| instrument.calendar.is_some()) else { return Ok(()) };
    let error = document.error(&["instrument", &index.to_string(), "calendar"], "a twin has no use for a calendar");
    Err(error.hint("leave it out: a recording says itself when orders were filled"))
}
