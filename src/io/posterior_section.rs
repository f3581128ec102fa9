//! `[posterior]` of a twin or a run: what the fit that it comes from tells of its parameters together.

use toml::Value;

use super::document::Document;
use super::error::InputError;
use super::toml_text::{float, text};
use crate::sim2real::randomize::Posterior;

/// Holds the section to make sense, where there is one.
pub(super) fn check_posterior(document: &Document, posterior: Option<&Posterior>) -> Result<(), InputError> {
    let Some(Err(error)) = posterior.map(Posterior::check) else { return Ok(()) };
    let words = error.to_string();
    let (message, hint) = words.split_once("\nhint: ").unwrap_or((&words, "let `trueup diagnose` write it anew"));
    Err(document.error(&["posterior"], message).hint(hint))
}

/// The keys of the section, as they are written.
pub(super) fn posterior_keys(posterior: &Posterior) -> Vec<(&'static str, Option<String>)> {
    let list = |cells: Vec<String>| format!("[{}]", cells.join(", "));
    let numbers = |values: &[f64]| list(values.iter().copied().map(float).collect());
    let rows: Vec<String> = posterior.correlation.iter().map(|row| numbers(row)).collect();
    vec![
        ("names", Some(list(posterior.names.iter().map(|name| text(name)).collect()))),
        ("values", Some(numbers(&posterior.values))),
        ("std", Some(numbers(&posterior.std))),
        ("correlation", (!rows.is_empty()).then(|| list(rows))),
    ]
}

/// The same as values.
pub(super) fn posterior_values(posterior: &Posterior) -> Vec<(String, Value)> {
    let numbers = |values: &[f64]| Value::Array(values.iter().copied().map(Value::Float).collect());
    let names = posterior.names.iter().cloned().map(Value::String).collect();
    vec![
        ("names".to_owned(), Value::Array(names)),
        ("values".to_owned(), numbers(&posterior.values)),
        ("std".to_owned(), numbers(&posterior.std)),
        ("correlation".to_owned(), Value::Array(posterior.correlation.iter().map(|row| numbers(row)).collect())),
    ]
}
