//! Options: what can be set of an environment when it is made, and when an episode begins.

use std::collections::BTreeMap;
use std::fmt;

use super::EnvError;

/// The value of an option.
#[derive(Debug, Clone, PartialEq)]
pub enum OptionValue {
    /// A number, in the option's unit.
    Number(f64),
    /// On or off.
    Switch(bool),
    /// A choice, or any text.
    Text(String),
}

impl fmt::Display for OptionValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(value) => write!(f, "{value}"),
            Self::Switch(value) => write!(f, "{value}"),
            Self::Text(value) => write!(f, "`{value}`"),
        }
    }
}

impl From<f64> for OptionValue {
    fn from(value: f64) -> Self {
        Self::Number(value)
    }
}

impl From<bool> for OptionValue {
    fn from(value: bool) -> Self {
        Self::Switch(value)
    }
}

impl From<&str> for OptionValue {
    fn from(value: &str) -> Self {
        Self::Text(value.to_owned())
    }
}

impl From<String> for OptionValue {
    fn from(value: String) -> Self {
        Self::Text(value)
    }
}

/// When an option can be set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Occasion {
    /// When the environment is made.
    Make,
    /// When an episode begins.
    Reset,
}

/// What values an option can have, and which it has where nothing is said.
#[derive(Debug, Clone, PartialEq)]
pub enum OptionKind {
    /// A real number.
    Number {
        /// Where nothing is said, in the option's unit.
        nominal: f64,
        /// Smallest.
        lower: f64,
        /// Largest.
        upper: f64,
    },
    /// A whole number.
    Whole {
        /// Where nothing is said.
        nominal: u64,
        /// Smallest.
        lower: u64,
        /// Largest, at most 2^53.
        upper: u64,
    },
    /// On or off.
    Switch {
        /// Where nothing is said.
        nominal: bool,
    },
    /// One of some names.
    Choice {
        /// Where nothing is said: one of them.
        nominal: String,
        /// All of them.
        of: Vec<String>,
    },
    /// Any text, such as a name.
    Text {
        /// Where nothing is said.
        nominal: String,
    },
}

/// An option an environment has.
#[derive(Debug, Clone, PartialEq)]
pub struct OptionAbout {
    /// Its name.
    pub name: String,
    /// Its unit; empty for a pure number.
    pub unit: String,
    /// What it does, in one line.
    pub meaning: String,
    /// When it can be set.
    pub at: Occasion,
    /// What values it can have.
    pub kind: OptionKind,
}

impl OptionAbout {
    /// An option of this kind.
    #[must_use]
    pub fn new(at: Occasion, name: &str, unit: &str, kind: OptionKind, meaning: &str) -> Self {
        Self { name: name.into(), unit: unit.into(), meaning: meaning.into(), at, kind }
    }

    /// A real number within bounds.
    #[must_use]
    pub fn number(at: Occasion, name: &str, unit: &str, [nominal, lower, upper]: [f64; 3], meaning: &str) -> Self {
        Self::new(at, name, unit, OptionKind::Number { nominal, lower, upper }, meaning)
    }

    /// The value where nothing is said.
    #[must_use]
    pub fn nominal(&self) -> OptionValue {
        match &self.kind {
            OptionKind::Number { nominal, .. } => OptionValue::Number(*nominal),
            OptionKind::Whole { nominal, .. } => OptionValue::Number(*nominal as f64),
            OptionKind::Switch { nominal } => OptionValue::Switch(*nominal),
            OptionKind::Choice { nominal, .. } | OptionKind::Text { nominal } => OptionValue::Text(nominal.clone()),
        }
    }

    /// Whether the option can have this value.
    ///
    /// # Errors
    /// [`EnvError::Option`] if it cannot.
    pub fn check(&self, value: &OptionValue) -> Result<(), EnvError> {
        let (must, good) = match (&self.kind, value) {
            (OptionKind::Number { lower, upper, .. }, value) => {
                let unit = if self.unit.is_empty() { String::new() } else { format!(" {}", self.unit) };
                let must = format!("a number within [{lower}, {upper}]{unit}");
                (must, matches!(value, OptionValue::Number(v) if v >= lower && v <= upper))
            }
            (OptionKind::Whole { lower, upper, .. }, value) => {
                let good = |v: f64| v.fract() == 0.0 && v >= *lower as f64 && v <= *upper as f64;
                (format!("a whole number from {lower} to {upper}"), matches!(value, OptionValue::Number(v) if good(*v)))
            }
            (OptionKind::Switch { .. }, value) => ("true or false".into(), matches!(value, OptionValue::Switch(_))),
            (OptionKind::Choice { of, .. }, value) => {
                (format!("one of {}", of.join(", ")), matches!(value, OptionValue::Text(text) if of.contains(text)))
            }
            (OptionKind::Text { .. }, value) => ("a text".into(), matches!(value, OptionValue::Text(_))),
        };
        if good {
            return Ok(());
        }
        let remedy = format!("leave it out for {}; it is: {}", self.nominal(), self.meaning);
        Err(EnvError::Option { name: self.name.clone(), value: value.to_string(), must, remedy })
    }
}

/// Options by name: those that are set. All others have their nominal value.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Options(BTreeMap<String, OptionValue>);

impl Options {
    /// None is set.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// The same with this one set.
    #[must_use]
    pub fn with(mut self, name: &str, value: impl Into<OptionValue>) -> Self {
        self.set(name, value);
        self
    }

    /// Sets one.
    pub fn set(&mut self, name: &str, value: impl Into<OptionValue>) {
        self.0.insert(name.to_owned(), value.into());
    }

    /// Takes one out.
    pub fn take(&mut self, name: &str) -> Option<OptionValue> {
        self.0.remove(name)
    }

    /// The value that is set, if any.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<&OptionValue> {
        self.0.get(name)
    }

    /// Whether none is set.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// All that are set, by name.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &OptionValue)> {
        self.0.iter().map(|(name, value)| (name.as_str(), value))
    }

    /// Whether the environment `id`, which has the options `known`, has all of these on this occasion.
    ///
    /// # Errors
    /// [`EnvError::UnknownOption`], [`EnvError::Option`].
    pub fn check(&self, id: &str, known: &[OptionAbout], at: Occasion) -> Result<(), EnvError> {
        for (name, value) in &self.0 {
            match known.iter().find(|one| one.name == *name && one.at == at) {
                Some(one) => one.check(value)?,
                None => return Err(unknown(id, name, known, at)),
            }
        }
        Ok(())
    }

    /// The number `name` of `known`: as it is set, else nominal.
    ///
    /// # Errors
    /// [`EnvError::UnknownOption`] if there is none of this name, [`EnvError::Option`] if it has a value it cannot have.
    pub fn number(&self, known: &[OptionAbout], name: &str) -> Result<f64, EnvError> {
        match self.value(known, name)? {
            OptionValue::Number(value) => Ok(value),
            OptionValue::Switch(value) => Ok(f64::from(u8::from(value))),
            OptionValue::Text(_) => Err(unknown("", name, known, Occasion::Make)),
        }
    }

    /// The switch `name` of `known`.
    ///
    /// # Errors
    /// As [`number`](Self::number).
    pub fn switch(&self, known: &[OptionAbout], name: &str) -> Result<bool, EnvError> {
        Ok(self.number(known, name)? != 0.0)
    }

    /// The choice or text `name` of `known`.
    ///
    /// # Errors
    /// As [`number`](Self::number).
    pub fn text(&self, known: &[OptionAbout], name: &str) -> Result<String, EnvError> {
        match self.value(known, name)? {
            OptionValue::Text(value) => Ok(value),
            OptionValue::Number(_) | OptionValue::Switch(_) => Err(unknown("", name, known, Occasion::Make)),
        }
    }

    fn value(&self, known: &[OptionAbout], name: &str) -> Result<OptionValue, EnvError> {
        let Some(one) = known.iter().find(|one| one.name == name) else {
            return Err(unknown("", name, known, Occasion::Make));
        };
        match self.0.get(name) {
            Some(value) => one.check(value).map(|()| value.clone()),
            None => Ok(one.nominal()),
        }
    }
}

fn unknown(id: &str, name: &str, known: &[OptionAbout], at: Occasion) -> EnvError {
    let names: Vec<&str> = known.iter().filter(|one| one.at == at).map(|one| one.name.as_str()).collect();
    let nearest = names.iter().map(|other| (strsim::jaro_winkler(name, other), *other)).max_by(|a, b| a.0.total_cmp(&b.0));
    let elsewhere = known.iter().any(|one| one.name == name && one.at != at);
    let remedy = match (elsewhere, at, nearest) {
        (true, Occasion::Reset, _) => "it is set when the environment is made, not when it is reset".into(),
        (true, Occasion::Make, _) => "it is set at reset, not when the environment is made".into(),
        (false, _, Some((likeness, other))) if likeness > 0.8 => format!("did you mean `{other}`?"),
        (false, _, Some(_)) => format!("there are {}", names.join(", ")),
        (false, _, None) => "there are none".into(),
    };
    EnvError::UnknownOption { id: id.into(), name: name.into(), remedy }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn known() -> Vec<OptionAbout> {
        let choice = OptionKind::Choice { nominal: "sharpe".into(), of: vec!["sharpe".into(), "profit".into()] };
        vec![
            OptionAbout::number(Occasion::Make, "force", "N", [10.0, 0.0, 100.0], "size of a push"),
            OptionAbout::new(Occasion::Make, "steps", "", OptionKind::Whole { nominal: 5, lower: 1, upper: 9 }, "how many"),
            OptionAbout::new(Occasion::Make, "reward", "", choice, "what is rewarded"),
            OptionAbout::new(
                Occasion::Make,
                "noisy",
                "",
                OptionKind::Switch { nominal: false },
                "whether sensors are noisy",
            ),
            OptionAbout::number(Occasion::Reset, "low", "rad", [-0.05, -3.0, 3.0], "least angle at the start"),
        ]
    }

    #[test]
    fn what_is_not_set_is_nominal() {
        let (known, options) = (known(), Options::new().with("force", 3.0).with("noisy", true));
        assert_eq!(options.number(&known, "force").unwrap(), 3.0);
        assert_eq!(options.number(&known, "steps").unwrap(), 5.0);
        assert_eq!(options.text(&known, "reward").unwrap(), "sharpe");
        assert!(options.switch(&known, "noisy").unwrap());
        options.check("e", &known, Occasion::Make).unwrap();
    }

    #[test]
    fn what_cannot_be_is_refused_with_the_remedy() {
        let known = known();
        let refused = |options: Options, at| options.check("trueup/E-v0", &known, at).unwrap_err().to_string();
        let text = refused(Options::new().with("force", f64::NAN), Occasion::Make);
        assert_eq!(
            text,
            "option `force` is NaN, and must be a number within [0, 100] N\nhint: leave it out for 10; it is: size of a push"
        );
        assert!(refused(Options::new().with("steps", 2.5), Occasion::Make).contains("whole number from 1 to 9"));
        assert!(refused(Options::new().with("reward", "fame"), Occasion::Make).contains("one of sharpe, profit"));
        assert!(refused(Options::new().with("noisy", 1.0), Occasion::Make).contains("true or false"));
        let text = refused(Options::new().with("forse", 1.0), Occasion::Make);
        assert_eq!(text, "`trueup/E-v0` has no option `forse`\nhint: did you mean `force`?");
        assert!(refused(Options::new().with("force", 1.0), Occasion::Reset).contains("set when the environment is made"));
        assert!(refused(Options::new().with("low", 1.0), Occasion::Make).contains("set at reset"));
        assert!(refused(Options::new().with("zzz", 1.0), Occasion::Reset).contains("there are low"));
        assert!(Options::new().number(&known, "reward").is_err() && Options::new().text(&known, "force").is_err());
    }
}
