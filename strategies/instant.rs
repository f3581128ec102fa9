//! Instants as a `[strategy]` table writes them.

use serde::{Deserialize, Deserializer};

use crate::sim2real::{Timestamp, written_instant};

/// An instant: RFC 3339, as a text or as TOML writes it by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Instant(pub Timestamp);

impl<'de> Deserialize<'de> for Instant {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let refused =
            |found: &str| format!("{found} is no instant: write one with its zone, as 2024-03-08T09:30:00-05:00 (RFC 3339)");
        written_instant(deserializer, refused).map(Self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_and_dates_of_toml_are_instants_and_need_a_zone() {
        let read = |text: &str| toml::from_str::<toml::Table>(text).unwrap()["at"].clone().try_into::<Instant>();
        for text in ["at = 1970-01-01T01:00:00+01:00", "at = '1970-01-01T00:00:00Z'"] {
            assert_eq!(read(text), Ok(Instant(Timestamp(0))), "{text}");
        }
        for text in ["at = 1970-01-01T01:00:00", "at = '1970-01-01'", "at = 0"] {
            assert!(read(text).unwrap_err().to_string().contains("is no instant: write one with its zone"), "{text}");
        }
    }
}
