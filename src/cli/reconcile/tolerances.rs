//! Bounds as they are given on the command line.

use std::path::Path;

use crate::io::{InputError, hint_among, read_toml};
use crate::market::reconcile::Tolerance;

/// The bounds of `given`, each `KEY=VALUE` or a TOML file; what is given later counts.
pub(super) fn read(given: &[String]) -> Result<Tolerance, InputError> {
    let mut all = Tolerance::default();
    for text in given {
        match text.split_once('=') {
            Some((key, value)) => set(&mut all, key.trim(), value.trim())?,
            None => {
                let path = Path::new(text);
                let file: Tolerance = read_toml(path)?;
                for (key, bound) in file.bounds() {
                    if let Some(bound) = bound {
                        set(&mut all, key, &bound.to_string()).map_err(|error| in_file(path, key, &error))?;
                    }
                }
            }
        }
    }
    Ok(all)
}

fn set(all: &mut Tolerance, key: &str, value: &str) -> Result<(), InputError> {
    let refused = |message: &str| InputError::new("--tolerance", message);
    let bound: f64 = value.parse().ok().filter(|bound: &f64| bound.is_finite() && *bound >= 0.0).ok_or_else(|| {
        refused(&format!("`{key}` has to be a number of at least 0")).found_text(value).hint(format!("such as {key}=0.5"))
    })?;
    if all.set(key, bound) {
        return Ok(());
    }
    Err(refused(&format!("there is no bound `{key}`"))
        .maybe_hint(hint_among(key, &Tolerance::KEYS).or_else(|| Some(format!("there are {}", Tolerance::KEYS.join(", "))))))
}

fn in_file(path: &Path, key: &str, error: &InputError) -> InputError {
    let text = error.to_string();
    InputError::new(path, format!("`{key}` has to be a number of at least 0: {text}"))
}
