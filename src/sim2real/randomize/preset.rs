//! Ranges that others have used, each with its source.

use super::{Distribution, Redraw, Target};

/// A parameter of a preset.
#[derive(Debug, Clone, PartialEq)]
pub struct PresetRow {
    /// Which parameter.
    pub target: Target,
    /// How it is distributed.
    pub distribution: Distribution,
    /// Whether what is drawn is a factor of the nominal value.
    pub relative: bool,
    /// When it is drawn.
    pub at: Redraw,
    /// Unit of its numbers, as the parameter has it; empty for a pure number and for factors.
    pub unit: &'static str,
    /// Where the range comes from.
    pub source: &'static str,
}

/// A group of parameters, with ranges that others have used.
#[derive(Debug, Clone, PartialEq)]
pub struct Preset {
    /// Its name in documents: `sensors`.
    pub name: &'static str,
    /// What it is of, in a sentence.
    pub about: &'static str,
    /// Its parameters; those a plant does not have do not concern it.
    pub rows: Vec<PresetRow>,
}

/// All presets of a domain.
pub type Presets = fn() -> Vec<Preset>;
