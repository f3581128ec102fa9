//! What is randomized: a parameter, when it is drawn, and how.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::{Distribution, DistributionError};
use crate::sim2real::Parameter;

/// A parameter of a mechanism, or of the plant itself.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Target {
    /// Id of the mechanism; none for a parameter of the plant.
    pub mechanism: Option<String>,
    /// Name of the parameter.
    pub parameter: String,
}

impl Target {
    /// The parameter of a mechanism.
    #[must_use]
    pub fn of(mechanism: &str, parameter: &str) -> Self {
        Self { mechanism: Some(mechanism.to_owned()), parameter: parameter.to_owned() }
    }

    /// A parameter of the plant.
    #[must_use]
    pub fn own(parameter: &str) -> Self {
        Self { mechanism: None, parameter: parameter.to_owned() }
    }
}

impl fmt::Display for Target {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.mechanism {
            Some(mechanism) => write!(f, "{mechanism}.{}", self.parameter),
            None => f.write_str(&self.parameter),
        }
    }
}

/// When a value is drawn anew.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Redraw {
    /// Once, when the environment is made.
    Startup,
    /// When an episode begins.
    #[default]
    Reset,
    /// When an episode begins, and every so many seconds of it [s].
    EverySeconds(f64),
    /// When an episode begins, and every so many steps of it.
    EverySteps(u64),
    /// When the regime of this index is entered; until then the value is nominal.
    Regime(usize),
}

impl Redraw {
    /// How often a value has been due within an episode after `seconds` [s] and `steps`, its beginning not counted.
    #[must_use]
    pub fn due(self, seconds: f64, steps: u64) -> u64 {
        match self {
            // A moment that is reached but for its last digits is reached.
            Self::EverySeconds(every) => (seconds / every * (1.0 + 1e-12)).floor().max(0.0) as u64,
            Self::EverySteps(every) => steps / every.max(1),
            Self::Startup | Self::Reset | Self::Regime(_) => 0,
        }
    }
}

/// A parameter that is randomized.
#[derive(Debug, Clone, PartialEq)]
pub struct Randomized {
    /// Which.
    pub target: Target,
    /// The parameter, with its nominal value and its bounds.
    pub parameter: Parameter,
    /// How its values are distributed.
    pub distribution: Distribution,
    /// Whether what is drawn is a factor of the nominal value.
    pub relative: bool,
    /// When a value is drawn.
    pub at: Redraw,
}

/// Why a parameter cannot be randomized as is asked.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Implausible {
    /// The distribution is none.
    #[error(transparent)]
    Distribution(#[from] DistributionError),
    /// A factor of nothing.
    #[error(
        "a factor of the nominal value {nominal} changes nothing\nhint: give the range in the parameter's unit, without `relative`"
    )]
    NothingToScale {
        /// The nominal value.
        nominal: f64,
    },
    /// Values the parameter cannot have.
    #[error("draws from {low} to {high} leave what the parameter can be, {lower} to {upper}\nhint: {hint}")]
    OutOfBounds {
        /// The least value that can be drawn.
        low: f64,
        /// The largest.
        high: f64,
        /// The least the parameter can be.
        lower: f64,
        /// The most.
        upper: f64,
        /// What to do.
        hint: &'static str,
    },
    /// A mass below nothing.
    #[error(
        "draws as low as {low} make no sense: {what} is {must}\nhint: draw from a range above 0, or by factors with relative = true"
    )]
    Unphysical {
        /// The least value that can be drawn.
        low: f64,
        /// What it is.
        what: &'static str,
        /// What it must be.
        must: &'static str,
    },
    /// A time between draws that is none.
    #[error(
        "expected a time between draws above 0, found {found}\nhint: at = {{ seconds = 0.5 }} or at = {{ steps = 100 }}"
    )]
    Interval {
        /// What was found.
        found: f64,
    },
}

/// Words in names of parameters that cannot be below 0, or not even 0, whatever the bounds are: the parameters of equations
/// have none.
const SIGNED: [(&str, &str, bool); 4] =
    [("mass", "a mass", true), ("inertia", "an inertia", true), ("length", "a length", true), ("gravity", "gravity", false)];

impl Randomized {
    /// The least and the largest value that can be drawn, in the parameter's unit.
    #[must_use]
    pub fn support(&self) -> [f64; 2] {
        let [low, high] = self.distribution.support();
        match self.relative {
            true if self.parameter.nominal < 0.0 => [high * self.parameter.nominal, low * self.parameter.nominal],
            true => [low * self.parameter.nominal, high * self.parameter.nominal],
            false => [low, high],
        }
    }

    /// Holds it to be plausible. Nothing is repaired: a range that reaches too far is refused, not cut.
    ///
    /// # Errors
    /// A distribution that is none; a factor of 0 or of infinity; draws beyond the parameter's bounds; masses, inertias and
    /// lengths of 0 or less and gravity that pulls upwards; a time between draws that is none.
    pub fn check(&self) -> Result<(), Implausible> {
        self.distribution.check()?;
        let nominal = self.parameter.nominal;
        if self.relative && (nominal == 0.0 || !nominal.is_finite()) {
            return Err(Implausible::NothingToScale { nominal });
        }
        let [low, high] = self.support();
        let tokens = || self.target.parameter.split('_');
        // The torque of gravity has a sign: that of where angles are counted from.
        let found = SIGNED.iter().find(|(word, ..)| match *word {
            "gravity" => self.target.parameter == "gravity",
            word => tokens().any(|token| token == word),
        });
        if let Some((_, what, strictly)) = found.filter(|(.., strictly)| low < 0.0 || *strictly && low <= 0.0)
            && self.target.mechanism.is_none()
        {
            let must = if *strictly { "above 0" } else { "not negative" };
            return Err(Implausible::Unphysical { low, what, must });
        }
        let (lower, upper) = (self.parameter.lower, self.parameter.upper);
        if low < lower || high > upper {
            let hint = match self.distribution {
                Distribution::Normal { .. } => "say distribution = \"truncated_normal\" with `low` and `high` within",
                _ => "draw from a range within",
            };
            return Err(Implausible::OutOfBounds { low, high, lower, upper, hint });
        }
        match self.at {
            Redraw::EverySeconds(found) if !found.is_finite() || found <= 0.0 => Err(Implausible::Interval { found }),
            Redraw::EverySteps(0) => Err(Implausible::Interval { found: 0.0 }),
            _ => Ok(()),
        }
    }

    /// What is odd about it and yet may be meant, in a sentence; none where nothing is.
    #[must_use]
    pub fn oddity(&self) -> Option<String> {
        let [low, high] = self.support();
        let nominal = self.parameter.nominal;
        if low == high {
            return Some(match low == nominal {
                true => format!("`{}` is always drawn as {low}, its nominal value: nothing is randomized", self.target),
                false => format!("`{}` is always drawn as {low}: its range has no width", self.target),
            });
        }
        let outside = nominal.is_finite() && !(low..=high).contains(&nominal);
        outside
            .then(|| format!("The nominal value {nominal} of `{}` lies outside what is drawn, {low} to {high}", self.target))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn uniform(parameter: Parameter, low: f64, high: f64) -> Randomized {
        Randomized {
            target: Target::own(&parameter.name),
            parameter,
            distribution: Distribution::Uniform { low, high },
            relative: false,
            at: Redraw::Reset,
        }
    }

    #[test]
    fn the_implausible_is_refused_and_not_repaired() {
        let refused = |randomized: &Randomized, words: &str| {
            let text = randomized.check().unwrap_err().to_string();
            assert!(text.contains(words) && text.contains("\nhint: "), "{text}");
        };
        let torque = || Parameter::new("torque", "N m", 0.1).within(0.0, 10.0);
        assert_eq!(uniform(torque(), 0.0, 10.0).check(), Ok(()));
        refused(&uniform(torque(), -0.1, 1.0), "leave what the parameter can be, 0 to 10");
        refused(&uniform(torque(), 1.0, 11.0), "draws from 1 to 11");
        let normal = Distribution::Normal { mean: 1.0, std: 0.2 };
        refused(&Randomized { distribution: normal.clone(), ..uniform(torque(), 0.0, 1.0) }, "truncated_normal");
        let narrow = Distribution::Normal { mean: 1.0, std: 0.1 };
        assert_eq!(Randomized { distribution: narrow, ..uniform(torque(), 0.0, 1.0) }.check(), Ok(()));
        for (name, low) in [("pole_mass", 0.0), ("inertia", -1.0), ("half_length", 0.0), ("gravity", -9.81)] {
            refused(&uniform(Parameter::new(name, "", 1.0), low, 1.0), "make no sense");
        }
        assert_eq!(uniform(Parameter::new("gravity", "", 9.81), 0.0, 9.81).check(), Ok(()));
        assert_eq!(uniform(Parameter::new("gravity_torque", "", 1.0), -1.0, 1.0).check(), Ok(()));
        refused(&Randomized { relative: true, ..uniform(Parameter::new("bias", "", 0.0), 0.9, 1.1) }, "changes nothing");
        let limit = Parameter::new("limit", "", f64::INFINITY);
        refused(&Randomized { relative: true, ..uniform(limit, 0.9, 1.1) }, "value inf");
        refused(&uniform(torque(), 2.0, 1.0), "`low` below `high`");
        refused(&Randomized { at: Redraw::EverySeconds(0.0), ..uniform(torque(), 0.0, 1.0) }, "between draws");
        refused(&Randomized { at: Redraw::EverySteps(0), ..uniform(torque(), 0.0, 1.0) }, "between draws");
    }

    #[test]
    fn factors_of_negative_values_keep_their_ends_in_order() {
        let parameter = Parameter::new("gravity_torque", "N m", -2.0);
        let randomized = Randomized { relative: true, ..uniform(parameter, 0.5, 1.5) };
        assert_eq!(randomized.support(), [-3.0, -1.0]);
        assert_eq!(randomized.check(), Ok(()));
    }

    #[test]
    fn the_odd_is_said() {
        let parameter = || Parameter::new("torque", "N m", 0.1);
        assert_eq!(uniform(parameter(), 0.0, 1.0).oddity(), None);
        assert!(uniform(parameter(), 0.2, 1.0).oddity().unwrap().contains("lies outside"));
        let constant =
            |value| Randomized { distribution: Distribution::Constant { value }, ..uniform(parameter(), 0.0, 1.0) };
        assert!(constant(0.1).oddity().unwrap().contains("nothing is randomized"));
        assert!(constant(0.2).oddity().unwrap().contains("no width"));
    }

    #[test]
    fn intervals_are_counted() {
        let counts = |at: Redraw| [0.0, 0.49, 0.5, 1.6].map(|t| at.due(t, (t * 100.0) as u64));
        assert_eq!(counts(Redraw::EverySeconds(0.5)), [0, 0, 1, 3]);
        assert_eq!(counts(Redraw::EverySteps(50)), [0, 0, 1, 3]);
        assert_eq!(counts(Redraw::Reset), [0; 4]);
        assert_eq!(Redraw::EverySeconds(0.1).due(0.1 + 0.2, 0), 3);
    }
}
