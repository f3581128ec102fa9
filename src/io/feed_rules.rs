//! What is done with rows of market data that cannot be, and with clocks that do not agree.

use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize};

use super::document::HINT;
use crate::sim2real::Timestamp;

/// What is done with a row that cannot be: a crossed quote, a price of NaN, a time before the one before.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum OnBad {
    /// The file is refused, with row, column, value and remedy.
    #[default]
    Refuse,
    /// The row is left out and counted.
    Drop,
}

impl OnBad {
    /// The word for it in documents.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Refuse => "refuse",
            Self::Drop => "drop",
        }
    }
}

/// How rows of market data are held to what they can be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FeedRules {
    /// What is done with those that cannot be.
    pub on_bad: OnBad,
    /// By how much a row may come after rows that were known later [ns], and is put in order; none for not at all.
    pub reorder: Option<i64>,
    /// The longest silence that is none to be told of [ns]; none where silences are not looked at.
    pub max_gap: Option<i64>,
    /// The last instant at which there should be data: a file that ends more than `max_gap` before it is told of.
    pub until: Option<Timestamp>,
}

/// What is to be added to the clock of whoever recorded the data, so that it agrees with the exchange's.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ClockOffset {
    /// So much [ns].
    Declared(i64),
    /// The least that lets nothing be known before it happened, and 0 where nothing is: an assumption of a fastest message
    /// that took no time. The file is read twice. Each file is estimated by itself: to compare the times of several files of
    /// one recorder, declare the same number for all.
    Estimated,
}

impl Default for ClockOffset {
    fn default() -> Self {
        Self::Declared(0)
    }
}

/// When rows were known: the clock of whoever recorded them.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct FeedClock {
    /// The column with its time, in the contract's own layouts; where there is none, a row is known when it happens.
    pub known_at: Option<String>,
    /// What is to be added to it.
    pub offset: ClockOffset,
}

/// Reads `clock_offset`: a number of seconds, or "estimate".
pub(super) fn clock_offset<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<ClockOffset>, D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged)]
    enum Written {
        Whole(i64),
        Seconds(f64),
        Word(String),
    }
    let refuse = |found: String| {
        let hint = "seconds to add to the local clock, such as 1.28, or \"estimate\"";
        D::Error::custom(format!("invalid value: {found}, expected a clock offset{HINT}{hint}"))
    };
    let seconds = match Written::deserialize(deserializer).map_err(|_| refuse("neither number nor text".to_owned()))? {
        Written::Word(word) if word == "estimate" => return Ok(Some(ClockOffset::Estimated)),
        Written::Word(word) => return Err(refuse(format!("{word:?}"))),
        Written::Whole(seconds) => seconds as f64,
        Written::Seconds(seconds) => seconds,
    };
    // A clock that is a year off is no clock.
    const MOST: f64 = 366.0 * 86_400.0;
    if !seconds.is_finite() || seconds.abs() > MOST {
        return Err(refuse(format!("{seconds}")));
    }
    Ok(Some(ClockOffset::Declared((seconds * 1e9).round() as i64)))
}

/// Reads a span of time [ns]: a whole number and one of ms, s, m, h, d.
pub(super) fn span<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<i64>, D::Error> {
    let text = String::deserialize(deserializer)?;
    let units = [("ms", 1_000_000), ("s", Timestamp::NANOS), ("m", 60 * Timestamp::NANOS)];
    let longer = [("h", 3_600 * Timestamp::NANOS), ("d", 86_400 * Timestamp::NANOS)];
    let length = units.iter().chain(&longer).find_map(|(unit, nanoseconds)| {
        let count: i64 = text.strip_suffix(unit)?.trim().parse().ok().filter(|count| *count > 0)?;
        count.checked_mul(*nanoseconds)
    });
    length.map(Some).ok_or_else(|| {
        let hint = "a whole number and a unit: \"500ms\", \"1s\", \"5m\", \"1h\", \"1d\"";
        D::Error::custom(format!("invalid value: {text:?}, expected a span of time{HINT}{hint}"))
    })
}
