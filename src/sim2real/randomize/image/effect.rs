//! What an effect says of itself, and the registry of all of them.

use super::error::ImageError;
use super::{blur, brightness, contrast, exposure, hue_saturation, lens, noise, occlusion, shift, white_balance};

/// A number that an effect has.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EffectParameter {
    /// Its name, as ranges are given by.
    pub name: &'static str,
    /// Its unit; `1` where it has none.
    pub unit: &'static str,
    /// The value at which it does nothing.
    pub identity: f64,
    /// What [`Ranges::plausible`](super::Ranges::plausible) draws it from.
    pub plausible: [f64; 2],
    /// What it can be.
    pub bounds: [f64; 2],
}

/// What an effect says of itself. With all its parameters at their identities it changes no bit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effect {
    /// Its name, as ranges are given by.
    pub name: &'static str,
    /// In words.
    pub title: &'static str,
    /// What becomes of a value `x`, from 0 to 1.
    pub law: &'static str,
    /// Where the law is from.
    pub source: &'static str,
    /// Its numbers.
    pub parameters: &'static [EffectParameter],
}

/// All effects, in the order in which they act.
pub static EFFECTS: &[&Effect] = &[
    &blur::EFFECT,
    &lens::EFFECT,
    &shift::EFFECT,
    &exposure::EFFECT,
    &white_balance::EFFECT,
    &contrast::EFFECT,
    &hue_saturation::EFFECT,
    &brightness::EFFECT,
    &noise::EFFECT,
    &occlusion::EFFECT,
];

impl Effect {
    /// Sees that `values`, in the order of the parameters, are what the parameters can be.
    pub(super) fn check(&self, values: &[f32]) -> Result<(), ImageError> {
        for (parameter, value) in self.parameters.iter().zip(values) {
            let (found, [low, high]) = (f64::from(*value), parameter.bounds);
            // Bounds may be no `f32`: 0.7 as one is a little less, 0.1 a little more.
            let slack = 1e-6 * low.abs().max(high.abs());
            if !(found >= low - slack && found <= high + slack) {
                return Err(ImageError::Setting {
                    effect: self.name,
                    parameter: parameter.name,
                    found,
                    bounds: parameter.bounds,
                });
            }
        }
        Ok(())
    }
}
