//! Seals: a label is fixed by its hash before its case is diagnosed, and shown after.

use serde::Serialize;
use sha2::{Digest, Sha256};

use crate::sim2real::Seed;

/// A label as text, and what seals it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Sealed {
    /// The label in JSON.
    pub label: String,
    /// What is hashed before it, so that nobody finds a label by hashing all there could be.
    pub salt: String,
    /// SHA-256 of salt and label, in hexadecimal.
    pub seal: String,
}

impl Sealed {
    /// Seals the label of case `index` of `seed`.
    ///
    /// # Errors
    /// None but a bug: a label is always JSON.
    pub fn new(label: &impl Serialize, index: usize, seed: Seed) -> Result<Self, serde_json::Error> {
        let salt = hexadecimal(&Sha256::digest(format!("salt of case {index} of seed {}", seed.0)));
        let salt = salt[..32].to_owned();
        let label = serde_json::to_string(label)?;
        Ok(Self { seal: seal(&salt, &label), label, salt })
    }
}

/// What seals `label` with `salt`: anyone can compute it, as `printf %s "$salt$label" | sha256sum`.
#[must_use]
pub fn seal(salt: &str, label: &str) -> String {
    hexadecimal(&Sha256::digest(format!("{salt}{label}")))
}

/// One hash for many seals: what is printed before anything is diagnosed.
#[must_use]
pub fn seal_of_all(seals: &[String]) -> String {
    hexadecimal(&Sha256::digest(seals.concat()))
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
