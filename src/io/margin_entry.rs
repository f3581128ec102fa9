//! `margin` of an `[[instrument]]`: a rule by its name, or fractions of the value.

use std::fmt;

use serde::de::value::MapAccessDeserializer;
use serde::de::{Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};

use super::document::{Document, HINT};
use super::error::InputError;

/// What equity a position requires.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MarginEntry {
    /// The margin of US shares: `"regulation_t"`.
    RegulationT,
    /// Fractions of the value of a position.
    Fractions(MarginFractions),
}

/// Fractions of the value of a position: 0.5 is half of it.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MarginFractions {
    /// To open a long position, or any where nothing is said of short ones.
    pub initial: f64,
    /// To keep it.
    pub maintenance: f64,
    /// To open a short position.
    pub short_initial: Option<f64>,
    /// To keep it.
    pub short_maintenance: Option<f64>,
}

impl<'de> Deserialize<'de> for MarginEntry {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Margin;
        impl<'de> Visitor<'de> for Margin {
            type Value = MarginEntry;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("the name of a rule, or a table of fractions")
            }

            fn visit_str<E: Error>(self, rule: &str) -> Result<MarginEntry, E> {
                if rule == "regulation_t" {
                    return Ok(MarginEntry::RegulationT);
                }
                let hint = "the rule there is is \"regulation_t\"; others are { initial = 0.5, maintenance = 0.25 }";
                Err(E::custom(format!("unknown rule of margin `{rule}`{HINT}{hint}")))
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<MarginEntry, A::Error> {
                MarginFractions::deserialize(MapAccessDeserializer::new(map)).map(MarginEntry::Fractions)
            }
        }
        deserializer.deserialize_any(Margin)
    }
}

impl MarginEntry {
    /// Holds the fractions of instrument `number` to what they can be.
    pub(super) fn check(&self, document: &Document, number: &str) -> Result<(), InputError> {
        let Self::Fractions(of) = self else { return Ok(()) };
        let keys = [
            ("initial", Some(of.initial)),
            ("maintenance", Some(of.maintenance)),
            ("short_initial", of.short_initial),
            ("short_maintenance", of.short_maintenance),
        ];
        for (key, value) in keys {
            if let Some(value) = value.filter(|value| !(0.0..=4.0).contains(value)) {
                let error = document.error(&["instrument", number, "margin", key], "expected a fraction from 0 to 4");
                return Err(error.found(value).hint("0.25 is 25 % of the value of a position"));
            }
        }
        let short = (of.short_initial.unwrap_or(of.initial), of.short_maintenance.unwrap_or(of.maintenance));
        for (key, initial, maintenance) in
            [("maintenance", of.initial, of.maintenance), ("short_maintenance", short.0, short.1)]
        {
            if maintenance > initial {
                let message = format!("it takes {maintenance} to keep a position, and {initial} to open it");
                let error = document
                    .error(&["instrument", number, "margin"], message)
                    .hint(format!("`{key}` is no more than what opens the position: who opened it would be called at once"));
                return Err(error);
            }
        }
        Ok(())
    }
}
