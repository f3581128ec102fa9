//! The sections of a twin that is given as equations.

use std::collections::BTreeMap;

use serde::Deserialize;
use toml::Spanned;

use super::document::Document;
use super::error::InputError;
use super::toml_text::{float, section, text};

/// Equations, as a document declares them; each section in the order of the document.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct EquationSections {
    /// `[states]`.
    pub states: Vec<(String, StateEntry)>,
    /// `[inputs]`.
    pub inputs: Vec<(String, InputEntry)>,
    /// `[definitions]`.
    pub definitions: Vec<(String, String)>,
    /// `[derivatives]`.
    pub derivatives: Vec<(String, String)>,
    /// `[next]`.
    pub next: Vec<(String, String)>,
    /// `[outputs]`.
    pub outputs: Vec<(String, OutputEntry)>,
    /// `[attach]`.
    pub attach: Option<AttachEntry>,
}

/// One of `[states]`.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StateEntry {
    /// Its value where a recording starts, as far as measurements do not tell.
    #[serde(default)]
    pub initial: f64,
    /// Standard deviation of `initial` [`unit`]; 0 for known exactly.
    pub std: Option<f64>,
    /// Unit.
    pub unit: Option<String>,
}

/// One of `[inputs]`.
#[derive(Debug, Clone, PartialEq, Eq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InputEntry {
    /// Column of the recording.
    pub column: String,
    /// Unit of its values.
    pub unit: Option<String>,
    /// Whether it is the command; where none is, the first input.
    #[serde(default)]
    pub command: bool,
    /// Whether it goes straight from row to row; else a value holds until the next.
    #[serde(default)]
    pub interpolated: bool,
}

/// One of `[outputs]`.
#[derive(Debug, Clone, PartialEq, Eq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OutputEntry {
    /// What it is, in terms of states and parameters.
    pub expression: String,
    /// Column of the recording.
    pub column: String,
    /// Unit of its values.
    pub unit: Option<String>,
}

/// `[attach]`: where mechanisms of motion act.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AttachEntry {
    /// The state that is a position.
    pub position: String,
    /// The state that is its velocity.
    pub velocity: String,
    /// Inertia, an expression of parameters.
    pub inertia: String,
}

/// A section whose keys are names of the user's.
pub(super) type Named<T> = BTreeMap<String, Spanned<T>>;

/// The entries of a section in the order of the document.
pub(super) fn in_order<T>(section: Named<T>) -> Vec<(String, T)> {
    let mut entries: Vec<(String, Spanned<T>)> = section.into_iter().collect();
    entries.sort_by_key(|(_, entry)| entry.span().start);
    entries.into_iter().map(|(name, entry)| (name, entry.into_inner())).collect()
}

impl EquationSections {
    /// The first section that there is.
    pub(super) fn first(&self) -> Option<&'static str> {
        let sections = [
            ("states", self.states.is_empty()),
            ("inputs", self.inputs.is_empty()),
            ("definitions", self.definitions.is_empty()),
            ("derivatives", self.derivatives.is_empty()),
            ("next", self.next.is_empty()),
            ("outputs", self.outputs.is_empty()),
            ("attach", self.attach.is_none()),
        ];
        sections.into_iter().find(|(_, empty)| !empty).map(|(name, _)| name)
    }

    /// Holds numbers to be finite, and equations to be of one kind.
    pub(super) fn check(&self, document: &Document) -> Result<(), InputError> {
        for (name, state) in &self.states {
            if !state.initial.is_finite() {
                let error = document.error(&["states", name, "initial"], "expected a finite number").found(state.initial);
                return Err(error.hint("it is where the state starts, as far as measurements do not tell"));
            }
            if let Some(std) = state.std.filter(|std| !std.is_finite() || *std < 0.0) {
                let error = document.error(&["states", name, "std"], "expected a finite number of at least 0").found(std);
                return Err(error.hint("0 says that the initial value is known exactly; left out, it is unknown"));
            }
        }
        if let Some((second, _)) = self.inputs.iter().filter(|(_, input)| input.command).nth(1) {
            let error = document.error(&["inputs", second, "command"], "a second input is the command");
            return Err(error.hint("one input is shaped by delays and dead zones; the others are taken as measured"));
        }
        if !self.derivatives.is_empty() && !self.next.is_empty() {
            let error = document.error(&["next"], "there are [derivatives] too");
            return Err(error.hint("equations are integrated, or go from row to row: give one of the two"));
        }
        Ok(())
    }

    /// Adds the sections there are.
    pub(super) fn render(&self, out: &mut String) {
        let unit = |unit: &Option<String>| unit.as_ref().map(|unit| format!(", unit = {}", text(unit))).unwrap_or_default();
        let states = self.states.iter().map(|(name, state)| {
            let std = state.std.map(|std| format!(", std = {}", float(std))).unwrap_or_default();
            (name.as_str(), Some(format!("{{ initial = {}{std}{} }}", float(state.initial), unit(&state.unit))))
        });
        section(out, "[states]", states);
        let inputs = self.inputs.iter().map(|(name, input)| {
            let command = if input.command { ", command = true" } else { "" };
            let interpolated = if input.interpolated { ", interpolated = true" } else { "" };
            let column = text(&input.column);
            (name.as_str(), Some(format!("{{ column = {column}{}{command}{interpolated} }}", unit(&input.unit))))
        });
        section(out, "[inputs]", inputs);
        let sections = [("[definitions]", &self.definitions), ("[derivatives]", &self.derivatives), ("[next]", &self.next)];
        for (head, expressions) in sections {
            section(out, head, expressions.iter().map(|(name, expression)| (name.as_str(), Some(text(expression)))));
        }
        let outputs = self.outputs.iter().map(|(name, output)| {
            let (expression, column) = (text(&output.expression), text(&output.column));
            let entry = format!("{{ expression = {expression}, column = {column}{} }}", unit(&output.unit));
            (name.as_str(), Some(entry))
        });
        section(out, "[outputs]", outputs);
        if let Some(attach) = &self.attach {
            let keys = [("position", &attach.position), ("velocity", &attach.velocity), ("inertia", &attach.inertia)];
            section(out, "[attach]", keys.map(|(name, value)| (name, Some(text(value)))));
        }
    }
}
