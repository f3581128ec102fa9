//! How numbers, texts and sections are written in TOML.

use std::fmt::Write as _;

use super::quantity::Quantity;

/// Adds a section, unless it has no keys; keys without a value are left out.
pub(super) fn section<'a>(out: &mut String, head: &str, keys: impl IntoIterator<Item = (&'a str, Option<String>)>) {
    let lines: Vec<String> =
        keys.into_iter().filter_map(|(name, value)| Some(format!("{} = {}\n", key(name), value?))).collect();
    if lines.is_empty() {
        return;
    }
    let blank = if out.is_empty() { "" } else { "\n" };
    // Writing to a String cannot fail.
    let _ = write!(out, "{blank}{head}\n{}", lines.concat());
}

/// A number with its unit and its uncertainty.
pub(super) fn table_form(quantity: &Quantity) -> String {
    let unit = quantity.unit.as_ref().map(|unit| format!(", unit = {}", text(unit))).unwrap_or_default();
    format!("{{ value = {}{unit}, uncertainty = {} }}", float(quantity.value), float(quantity.uncertainty))
}

/// A bare number where it is known exactly.
pub(super) fn exact_form(quantity: &Quantity) -> String {
    let bare = quantity.unit.is_none() && quantity.uncertainty == 0.0;
    if bare { float(quantity.value) } else { table_form(quantity) }
}

/// A bare number where nothing more is known than that.
pub(super) fn short_form(quantity: &Quantity) -> String {
    if *quantity == Quantity::bare(quantity.value) { float(quantity.value) } else { table_form(quantity) }
}

/// A finite number, in the shortest form that reads back as the same bits.
pub(super) fn float(value: f64) -> String {
    format!("{value:?}")
}

/// A basic string of one line, which may be a key too.
pub(super) fn text(value: &str) -> String {
    let mut out = String::from('"');
    for c in value.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            c if c.is_control() => {
                // Writing to a String cannot fail.
                let _ = write!(out, "\\u{:04x}", u32::from(c));
            }
            c => out.push(c),
        }
    }
    out.push('"');
    out
}

/// A key: bare where it may be.
pub(super) fn key(name: &str) -> String {
    let bare = !name.is_empty() && name.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_' || b == b'-');
    if bare { name.to_owned() } else { text(name) }
}
