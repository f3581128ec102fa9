//! `[controller]` of a twin: what closes the loop in which it was recorded.

use serde::Deserialize;

use super::document::Document;
use super::error::InputError;
use super::quantity::{Exactly, Quantity};
use super::toml_text::{exact_form, float, section, text};
use crate::sim2real::DerivativeOf;

/// `[controller]`: numbers without an uncertainty are known exactly, for a controller is what somebody has set.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ControllerEntry {
    /// Its kind.
    pub kind: ControllerKind,
    /// Proportional gain [unit of the command/unit of the first channel].
    pub kp: Exactly,
    /// Integral gain [the same/s].
    pub ki: Option<Exactly>,
    /// Derivative gain [the same s].
    pub kd: Option<Exactly>,
    /// What the output saturates at [unit of the command].
    pub limit: Option<Exactly>,
    /// How often it acts [s]; left out, at every step, or in a diagnosis once a row where that explains the recordings better.
    pub period: Option<f64>,
    /// What its derivative is taken of.
    #[serde(default)]
    pub derivative: DerivativeOf,
}

/// The kinds of controllers there are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ControllerKind {
    /// Proportional, integral and derivative.
    Pid,
}

impl ControllerEntry {
    /// Its parameters, by their keys.
    #[must_use]
    pub fn parameters(&self) -> Vec<(&'static str, &Quantity)> {
        let optional = [("ki", &self.ki), ("kd", &self.kd), ("limit", &self.limit)];
        let given = optional.into_iter().filter_map(|(key, quantity)| Some((key, &quantity.as_ref()?.0)));
        [("kp", &self.kp.0)].into_iter().chain(given).collect()
    }

    /// The parameter of that key, to be changed.
    pub fn parameter_mut(&mut self, key: &str) -> Option<&mut Quantity> {
        match key {
            "kp" => Some(&mut self.kp.0),
            "ki" => self.ki.as_mut().map(|q| &mut q.0),
            "kd" => self.kd.as_mut().map(|q| &mut q.0),
            "limit" => self.limit.as_mut().map(|q| &mut q.0),
            _ => None,
        }
    }

    /// Holds numbers to what they can be.
    pub(super) fn check(&self, document: &Document) -> Result<(), InputError> {
        for (key, quantity) in self.parameters() {
            quantity.check(document, &["controller", key])?;
        }
        if let Some(limit) = self.limit.as_ref().filter(|limit| limit.0.value <= 0.0) {
            let error = document.error(&["controller", "limit"], "expected a limit above 0").found(limit.0.value);
            return Err(error.hint("the output is cut to between -limit and limit; left out, it is not"));
        }
        if let Some(period) = self.period.filter(|period| !period.is_finite() || *period <= 0.0) {
            let error = document.error(&["controller", "period"], "expected a period above 0").found(period);
            return Err(error.hint(
                "it is in seconds; left out, the controller acts at every step, or once a row where recordings show it",
            ));
        }
        Ok(())
    }

    /// Adds the section.
    pub(super) fn render(&self, out: &mut String) {
        let kind = match self.kind {
            ControllerKind::Pid => "pid",
        };
        let parameters = self.parameters().into_iter().map(|(key, quantity)| (key, Some(exact_form(quantity))));
        let derivative = match self.derivative {
            DerivativeOf::Measurement => None,
            DerivativeOf::Error => Some(text("error")),
        };
        let rest = [("period", self.period.map(float)), ("derivative", derivative)];
        section(out, "[controller]", [("kind", Some(text(kind)))].into_iter().chain(parameters).chain(rest));
    }
}
