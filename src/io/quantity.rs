//! Numbers of documents, with unit and uncertainty, and the mechanisms made of them.

use std::collections::BTreeSet;
use std::fmt;

use serde::de::value::MapAccessDeserializer;
use serde::de::{Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};

use super::document::Document;
use super::error::InputError;

/// The relative uncertainty of a value for which none is given.
pub const DEFAULT_UNCERTAINTY: f64 = 0.3;

/// A number as a document gives it: bare, or as `{ value, unit, uncertainty }`.
#[derive(Debug, Clone, PartialEq)]
pub struct Quantity {
    /// The value, in `unit`.
    pub value: f64,
    /// The unit, where one is claimed.
    pub unit: Option<String>,
    /// Relative standard deviation (1 sigma, a fraction of the value); 0 for a value known exactly.
    pub uncertainty: f64,
}

impl Quantity {
    /// A bare number, as uncertain as numbers of which nothing more is said.
    #[must_use]
    pub fn bare(value: f64) -> Self {
        Self { value, unit: None, uncertainty: DEFAULT_UNCERTAINTY }
    }

    /// A value with its unit and standard deviation [the same unit]; 0 for one known exactly. The uncertainty of a
    /// value of 0 cannot be relative, so there the default is kept.
    #[must_use]
    pub fn with_std(value: f64, std: f64, unit: &str) -> Self {
        let relative = (std / value).abs();
        let uncertainty = if relative.is_finite() { relative } else { DEFAULT_UNCERTAINTY };
        Self { value, unit: Some(unit.to_owned()), uncertainty }
    }

    /// Standard deviation [`unit`].
    #[must_use]
    pub fn std(&self) -> f64 {
        (self.value * self.uncertainty).abs()
    }

    /// Holds value and uncertainty, which stand at `keys`, to be finite, and the uncertainty not to be negative.
    pub(super) fn check(&self, document: &Document, keys: &[&str]) -> Result<(), InputError> {
        if !self.value.is_finite() {
            return Err(document
                .error(keys, "expected a finite number")
                .found(self.value)
                .hint("a twin needs a nominal value, if only a rough one"));
        }
        if !self.uncertainty.is_finite() || self.uncertainty < 0.0 {
            let keys: Vec<&str> = keys.iter().copied().chain(["uncertainty"]).collect();
            return Err(document
                .error(&keys, "expected a finite uncertainty that is not negative")
                .found(self.uncertainty)
                .hint("it is the standard deviation as a fraction of the value: 0.2 for 20 %, 0 for known exactly"));
        }
        Ok(())
    }
}

impl<'de> Deserialize<'de> for Quantity {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Self::deserialize_with(deserializer, DEFAULT_UNCERTAINTY)
    }
}

impl Quantity {
    /// A number that is uncertain to `uncertainty` where the document does not say.
    fn deserialize_with<'de, D: Deserializer<'de>>(deserializer: D, uncertainty: f64) -> Result<Self, D::Error> {
        struct Number(f64);
        impl<'de> Visitor<'de> for Number {
            type Value = Quantity;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number or { value = ..., unit = \"...\", uncertainty = ... }")
            }

            fn visit_i64<E>(self, value: i64) -> Result<Quantity, E> {
                Ok(Quantity { uncertainty: self.0, ..Quantity::bare(value as f64) })
            }

            fn visit_f64<E>(self, value: f64) -> Result<Quantity, E> {
                Ok(Quantity { uncertainty: self.0, ..Quantity::bare(value) })
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Quantity, A::Error> {
                let table = QuantityTable::deserialize(MapAccessDeserializer::new(map))?;
                let uncertainty = table.uncertainty.unwrap_or(self.0);
                Ok(Quantity { value: table.value, unit: table.unit, uncertainty })
            }
        }
        deserializer.deserialize_any(Number(uncertainty))
    }
}

/// A number that is known exactly where a document does not say how uncertain it is.
#[derive(Debug, Clone, PartialEq)]
pub struct Exactly(pub Quantity);

impl<'de> Deserialize<'de> for Exactly {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Quantity::deserialize_with(deserializer, 0.0).map(Self)
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct QuantityTable {
    value: f64,
    unit: Option<String>,
    uncertainty: Option<f64>,
}

/// A `[[mechanism]]` of a document: a name, and numbers by their keys.
///
/// Which names and keys there are is the registry's business; `io` does not know it.
#[derive(Debug, Clone, PartialEq)]
pub struct MechanismEntry {
    /// The registry's name of the mechanism.
    pub name: String,
    /// Its parameters.
    pub parameters: Vec<(String, Quantity)>,
}

impl MechanismEntry {
    /// The parameter of that name.
    #[must_use]
    pub fn parameter(&self, name: &str) -> Option<&Quantity> {
        self.parameters.iter().find(|(key, _)| key == name).map(|(_, quantity)| quantity)
    }
}

impl<'de> Deserialize<'de> for MechanismEntry {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Entry;
        impl<'de> Visitor<'de> for Entry {
            type Value = MechanismEntry;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a table with the name of a mechanism and its parameters")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<MechanismEntry, A::Error> {
                let (mut name, mut parameters) = (None, Vec::new());
                while let Some(key) = map.next_key::<String>()? {
                    if key == "name" {
                        name = Some(map.next_value()?);
                    } else {
                        parameters.push((key, map.next_value()?));
                    }
                }
                let name = name.ok_or_else(|| A::Error::missing_field("name"))?;
                Ok(MechanismEntry { name, parameters })
            }
        }
        deserializer.deserialize_map(Entry)
    }
}

/// Holds the mechanisms of a document to be finite and each to stand there once.
pub(super) fn check_mechanisms(document: &Document, mechanisms: &[MechanismEntry]) -> Result<(), InputError> {
    let mut seen = BTreeSet::new();
    for (index, mechanism) in mechanisms.iter().enumerate() {
        let number = index.to_string();
        if !seen.insert(mechanism.name.as_str()) {
            return Err(document
                .error(&["mechanism", &number, "name"], format!("the mechanism `{}` is here twice", mechanism.name))
                .hint("drop one of the two, or give one the effect of both"));
        }
        for (key, quantity) in &mechanism.parameters {
            quantity.check(document, &["mechanism", &number, key])?;
        }
    }
    Ok(())
}
