//! Time, in the two forms the house uses: ticks of a run, in seconds, and instants of a market, in nanoseconds.

use std::fmt;
use std::ops::{Add, Sub};
use std::str::FromStr;

use chrono::DateTime;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize};

/// One step of a run: the interval `[time, time + step)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tick {
    /// The row of the recording it lies in, or the number of the event.
    pub index: usize,
    /// Start of the tick [s], on the recording's own clock.
    pub time: f64,
    /// Length of the tick [s]; 0 for a plant whose clock ticks with events.
    pub step: f64,
}

/// One step of many runs whose clocks are apart: all are equally long, and each lane has a time of its own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ticks<'a> {
    /// Length of each tick [s].
    pub step: f64,
    /// Start of the tick [s], one a lane.
    pub times: &'a [f64],
}

impl Ticks<'_> {
    /// That of lane `lane`; the time is 0 where there is no such lane.
    #[must_use]
    pub fn lane(&self, lane: usize) -> Tick {
        Tick { index: 0, time: self.times.get(lane).copied().unwrap_or_default(), step: self.step }
    }
}

/// An instant [ns since the Unix epoch, UTC].
///
/// Nanoseconds in 64 bits reach from 1677 to 2262.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Timestamp(pub i64);

impl Timestamp {
    /// Nanoseconds in a second.
    pub const NANOS: i64 = 1_000_000_000;
    /// The first instant there is.
    pub const MIN: Self = Self(i64::MIN);
    /// The last instant there is.
    pub const MAX: Self = Self(i64::MAX);

    /// Seconds from `origin` to this instant [s].
    #[must_use]
    pub fn seconds_since(self, origin: Self) -> f64 {
        self.0.saturating_sub(origin.0) as f64 * 1e-9
    }

    /// This instant moved by `seconds` [s], rounded to the nanosecond.
    #[must_use]
    pub fn plus_seconds(self, seconds: f64) -> Self {
        Self(self.0.saturating_add((seconds * 1e9).round() as i64))
    }
}

impl Add<i64> for Timestamp {
    type Output = Self;
    fn add(self, nanoseconds: i64) -> Self {
        Self(self.0.saturating_add(nanoseconds))
    }
}

impl Sub for Timestamp {
    type Output = i64;
    fn sub(self, earlier: Self) -> i64 {
        self.0.saturating_sub(earlier.0)
    }
}

impl fmt::Display for Timestamp {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let instant = chrono::DateTime::from_timestamp_nanos(self.0);
        f.write_str(&instant.to_rfc3339_opts(chrono::SecondsFormat::AutoSi, true))
    }
}

/// Reads an instant as documents write it: RFC 3339, as a text or as TOML writes it by itself. `refused` says what is wrong
/// with what was found instead.
///
/// # Errors
/// What is no text, or none of an instant with its zone.
pub fn written_instant<'de, D: Deserializer<'de>>(
    deserializer: D,
    refused: impl Fn(&str) -> String,
) -> Result<Timestamp, D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged)]
    enum Written {
        Text(String),
        Toml(toml::value::Datetime),
    }
    let refuse = |found: &str| D::Error::custom(refused(found));
    let text = match Written::deserialize(deserializer).map_err(|_| refuse("what is no text"))? {
        Written::Text(text) => text,
        Written::Toml(instant) => instant.to_string(),
    };
    text.parse().map_err(|_| refuse(&text))
}

/// A text that is no instant.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0:?} is no instant\nhint: such as \"2024-03-08T14:30:00Z\" (RFC 3339)")]
pub struct NotAnInstant(String);

impl FromStr for Timestamp {
    type Err = NotAnInstant;

    fn from_str(text: &str) -> Result<Self, NotAnInstant> {
        let instant = DateTime::parse_from_rfc3339(text).ok().and_then(|t| t.timestamp_nanos_opt());
        instant.map(Self).ok_or_else(|| NotAnInstant(text.to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seconds_and_nanoseconds_agree() {
        let origin = Timestamp(1_612_517_760_500_000_050);
        let later = origin.plus_seconds(0.25);
        assert_eq!(later - origin, 250_000_000);
        assert!((later.seconds_since(origin) - 0.25).abs() < 1e-12);
        assert_eq!(Timestamp(0).to_string(), "1970-01-01T00:00:00Z");
    }

    #[test]
    fn arithmetic_saturates_instead_of_wrapping() {
        assert_eq!(Timestamp::MAX + 1, Timestamp::MAX);
        assert_eq!(Timestamp::MAX.plus_seconds(1e30), Timestamp::MAX);
    }
}
