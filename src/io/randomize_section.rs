//! `[randomize]` of a twin or a run: which parameters are drawn anew, and how.

use std::path::{Path, PathBuf};

use serde::de::value::MapAccessDeserializer;
use serde::de::{Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};
use toml::{Table, Value};

use super::document::{Document, HINT};
use super::error::{InputError, listed};
use super::relative_path::path_from;
use crate::sim2real::randomize::{Correlation, Distribution, Level, Redraw, Target};

/// `[randomize]`.
#[derive(Debug, Clone, PartialEq)]
pub struct RandomizeSection {
    /// How much is randomized, from 0 to 1.
    pub level: Level,
    /// The document whose `[posterior]` is drawn from, as the document names its file.
    pub posterior: Option<PathBuf>,
    /// Names of groups of parameters with ranges of the literature.
    pub presets: Vec<String>,
    /// `[[randomize.parameter]]`.
    pub parameters: Vec<RandomizedEntry>,
    /// `[[randomize.correlation]]`.
    pub correlations: Vec<Correlation>,
    /// When what a posterior tells is drawn.
    pub at: Redraw,
}

/// A `[[randomize.parameter]]`.
#[derive(Debug, Clone, PartialEq)]
pub struct RandomizedEntry {
    /// Which parameter.
    pub target: Target,
    /// The unit its numbers are claimed to have.
    pub unit: Option<String>,
    /// How it is distributed.
    pub distribution: Distribution,
    /// Whether what is drawn is a factor of the nominal value.
    pub relative: bool,
    /// When it is drawn.
    pub at: Redraw,
}

/// The section, as it is written.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RandomizeTable {
    level: Option<f64>,
    posterior: Option<PathBuf>,
    #[serde(default)]
    preset: Vec<String>,
    at: Option<At>,
    #[serde(default)]
    parameter: Vec<ParameterTable>,
    #[serde(default)]
    correlation: Vec<CorrelationTable>,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Kind {
    Constant,
    Uniform,
    LogUniform,
    Normal,
    TruncatedNormal,
    LogNormal,
    Choice,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct ParameterTable {
    mechanism: Option<String>,
    parameter: String,
    distribution: Kind,
    unit: Option<String>,
    #[serde(default)]
    relative: bool,
    at: Option<At>,
    value: Option<f64>,
    low: Option<f64>,
    high: Option<f64>,
    mean: Option<f64>,
    std: Option<f64>,
    median: Option<f64>,
    sigma: Option<f64>,
    values: Option<Vec<f64>>,
    weights: Option<Vec<f64>>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct CorrelationTable {
    between: [String; 2],
    coefficient: f64,
}

/// When a value is drawn: a word, or a table with how often.
#[derive(Debug, Clone, Copy, PartialEq)]
struct At(Redraw);

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Often {
    seconds: Option<f64>,
    steps: Option<u64>,
    regime: Option<usize>,
}

const WHEN: &str = "at = \"startup\", \"reset\", { seconds = 0.5 }, { steps = 100 } or { regime = 1 }";

impl<'de> Deserialize<'de> for At {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct When;
        impl<'de> Visitor<'de> for When {
            type Value = At;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("when it is drawn")
            }

            fn visit_str<E: Error>(self, word: &str) -> Result<At, E> {
                match word {
                    "startup" => Ok(At(Redraw::Startup)),
                    "reset" => Ok(At(Redraw::Reset)),
                    _ => Err(E::custom(format!("invalid value: {word:?}, expected when it is drawn{HINT}{WHEN}"))),
                }
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<At, A::Error> {
                let Often { seconds, steps, regime } = Often::deserialize(MapAccessDeserializer::new(map))?;
                match (seconds, steps, regime) {
                    (Some(seconds), None, None) => Ok(At(Redraw::EverySeconds(seconds))),
                    (None, Some(steps), None) => Ok(At(Redraw::EverySteps(steps))),
                    (None, None, Some(regime)) => Ok(At(Redraw::Regime(regime))),
                    _ => Err(A::Error::custom(format!(
                        "invalid value: a table with another number of keys, expected one of `seconds`, `steps` and `regime`{HINT}{WHEN}"
                    ))),
                }
            }
        }
        deserializer.deserialize_any(When)
    }
}

impl ParameterTable {
    fn given(&self) -> Vec<&'static str> {
        let all = [
            ("value", self.value.is_some()),
            ("low", self.low.is_some()),
            ("high", self.high.is_some()),
            ("mean", self.mean.is_some()),
            ("std", self.std.is_some()),
            ("median", self.median.is_some()),
            ("sigma", self.sigma.is_some()),
            ("values", self.values.is_some()),
            ("weights", self.weights.is_some()),
        ];
        all.into_iter().filter(|(_, given)| *given).map(|(key, _)| key).collect()
    }

    /// The distribution its keys make: each kind has keys of its own.
    fn distribution(&self, document: &Document, index: &str) -> Result<Distribution, InputError> {
        let (name, needed, optional): (&str, &[&str], &[&str]) = match self.distribution {
            Kind::Constant => ("constant", &["value"], &[]),
            Kind::Uniform => ("uniform", &["low", "high"], &[]),
            Kind::LogUniform => ("log_uniform", &["low", "high"], &[]),
            Kind::Normal => ("normal", &["mean", "std"], &[]),
            Kind::TruncatedNormal => ("truncated_normal", &["mean", "std", "low", "high"], &[]),
            Kind::LogNormal => ("log_normal", &["median", "sigma"], &[]),
            Kind::Choice => ("choice", &["values"], &["weights"]),
        };
        let given = self.given();
        let keys = |key| ["randomize", "parameter", index, key];
        if let Some(other) = given.iter().find(|key| !needed.contains(key) && !optional.contains(key)) {
            let error = document.error(&keys(other), format!("`{name}` has no `{other}`"));
            return Err(error.hint(format!("it is given by {}", listed(needed))));
        }
        if let Some(missing) = needed.iter().find(|key| !given.contains(key)) {
            let error = document.error(&keys("distribution"), format!("`{name}` needs `{missing}`"));
            return Err(error.hint(format!("it is given by {}", listed(needed))));
        }
        // All that is needed is there.
        let number = |value: Option<f64>| value.unwrap_or_default();
        let (low, high, mean, std) = (number(self.low), number(self.high), number(self.mean), number(self.std));
        Ok(match self.distribution {
            Kind::Constant => Distribution::Constant { value: number(self.value) },
            Kind::Uniform => Distribution::Uniform { low, high },
            Kind::LogUniform => Distribution::LogUniform { low, high },
            Kind::Normal => Distribution::Normal { mean, std },
            Kind::TruncatedNormal => Distribution::TruncatedNormal { mean, std, low, high },
            Kind::LogNormal => Distribution::LogNormal { median: number(self.median), sigma: number(self.sigma) },
            Kind::Choice => Distribution::Choice {
                values: self.values.clone().unwrap_or_default(),
                weights: self.weights.clone().unwrap_or_default(),
            },
        })
    }
}

/// The parameter that a name stands for: `coulomb_friction.torque`, `viscous_friction`.
fn target(name: &str) -> Target {
    match name.split_once('.') {
        // A controller's parameters are the twin's own, and have a dot.
        Some((mechanism, parameter)) if mechanism != "controller" => Target::of(mechanism, parameter),
        _ => Target::own(name),
    }
}

impl RandomizeSection {
    /// The section of `document`, held to what can be held without knowing what it is of.
    pub(super) fn of(document: &Document, table: RandomizeTable) -> Result<Self, InputError> {
        let level = Level::new(table.level.unwrap_or(1.0)).map_err(|error| {
            let words = error.to_string();
            let (message, hint) = words.split_once("\nhint: ").unwrap_or((&words, ""));
            document.error(&["randomize", "level"], message).hint(hint)
        })?;
        let at = table.at.unwrap_or(At(Redraw::Reset)).0;
        let entry = |(index, entry): (usize, ParameterTable)| {
            Ok(RandomizedEntry {
                distribution: entry.distribution(document, &index.to_string())?,
                target: Target { mechanism: entry.mechanism, parameter: entry.parameter },
                unit: entry.unit,
                relative: entry.relative,
                at: entry.at.map_or(at, |own| own.0),
            })
        };
        let parameters = table.parameter.into_iter().enumerate().map(entry).collect::<Result<Vec<_>, InputError>>()?;
        let section = Self {
            level,
            posterior: table.posterior,
            presets: table.preset,
            correlations: table
                .correlation
                .into_iter()
                .map(|c| Correlation { between: c.between.map(|name| target(&name)), coefficient: c.coefficient })
                .collect(),
            parameters,
            at,
        };
        if section.parameters.is_empty() && section.presets.is_empty() && section.posterior.is_none() {
            let error = document.error(&["randomize"], "there is nothing to randomize");
            return Err(error.hint("add [[randomize.parameter]], preset = [\"sensors\"] or posterior = \"trued.toml\""));
        }
        Ok(section)
    }

    /// The section of `document` as TOML, to be written into `folder`.
    pub(super) fn render(&self, document: &Document, folder: &Path) -> String {
        #[derive(Deserialize)]
        struct Only {
            randomize: Table,
        }
        let Ok(Only { mut randomize }) = document.parse::<Only>() else { return String::new() };
        if let Some(named) = self.posterior.as_ref().filter(|named| named.is_relative()) {
            let path = path_from(folder, &document.resolve(named));
            randomize.insert("posterior".to_owned(), Value::String(path));
        }
        let whole: Table = [("randomize".to_owned(), Value::Table(randomize))].into_iter().collect();
        // A table that was read can be written.
        toml::to_string(&whole).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::super::TwinFile;
    use super::*;

    const HEAD: &str = "[twin]\nmodel = \"joint\"\n[parameters]\ninertia = 0.1\nviscous_friction = 0.2\n[channels]\n\
                        command = { column = \"u\" }\nposition = { column = \"q\", unit = \"rad\" }\n";

    fn read(text: &str) -> Result<TwinFile, InputError> {
        TwinFile::parse(Document::from_text("twin.toml", format!("{HEAD}{text}")))
    }

    #[test]
    fn a_section_is_read_and_written_again_as_it_was() {
        let text = "[randomize]\nlevel = 0.5\nposterior = \"trued.toml\"\npreset = [\"sensors\"]\nat = \"startup\"\n\
                    [[randomize.parameter]]\nmechanism = \"coulomb_friction\"\nparameter = \"torque\"\n\
                    distribution = \"uniform\"\nlow = 0.05\nhigh = 0.3\nat = { seconds = 0.5 }\n\
                    [[randomize.parameter]]\nparameter = \"inertia\"\ndistribution = \"choice\"\nvalues = [0.5, 2.0]\n\
                    relative = true\n\
                    [[randomize.correlation]]\nbetween = [\"coulomb_friction.torque\", \"inertia\"]\ncoefficient = 0.4\n";
        let file = read(text).unwrap();
        let section = file.randomize.as_ref().unwrap();
        assert_eq!(section.level.get(), 0.5);
        assert_eq!(section.parameters[0].at, Redraw::EverySeconds(0.5));
        assert_eq!((section.parameters[1].at, section.parameters[1].relative), (Redraw::Startup, true));
        assert_eq!(section.correlations[0].between[0], Target::of("coulomb_friction", "torque"));
        let again = TwinFile::parse(Document::from_text("twin.toml", file.render(Path::new(".")).unwrap())).unwrap();
        assert_eq!(again.randomize.unwrap(), *section);
    }

    #[test]
    fn what_makes_no_sense_is_refused_at_its_place() {
        let refused = |text: &str| read(&format!("[randomize]\n{text}")).unwrap_err().to_string();
        insta::assert_snapshot!(refused("level = 1.5\n"), @"
        twin.toml:10:1: expected a level from 0 to 1, found 1.5
          hint: 0 randomizes nothing, 1 as much as is declared
        ");
        insta::assert_snapshot!(refused("levle = 1.5\n"), @"
        twin.toml:10:1: unknown key `levle`
          hint: did you mean `level`?
        ");
        insta::assert_snapshot!(refused("level = 1.0\n"), @r#"
        twin.toml:9:2: there is nothing to randomize
          hint: add [[randomize.parameter]], preset = ["sensors"] or posterior = "trued.toml"
        "#);
        let one = |text: &str| refused(&format!("[[randomize.parameter]]\nparameter = \"inertia\"\n{text}"));
        insta::assert_snapshot!(one("distribution = \"unifrom\"\n"), @"
        twin.toml:12:16: unknown value `unifrom`
          hint: did you mean `uniform`?
        ");
        insta::assert_snapshot!(one("distribution = \"uniform\"\nlow = 1.0\n"), @"
        twin.toml:12:1: `uniform` needs `high`
          hint: it is given by `low` and `high`
        ");
        insta::assert_snapshot!(one("distribution = \"uniform\"\nlow = 1.0\nhigh = 2.0\nstd = 1.0\n"), @"
        twin.toml:15:1: `uniform` has no `std`
          hint: it is given by `low` and `high`
        ");
        insta::assert_snapshot!(one("distribution = \"uniform\"\nlow = 1.0\nhigh = 2.0\nat = \"never\"\n"), @r#"
        twin.toml:15:6: expected when it is drawn, found "never"
          hint: at = "startup", "reset", { seconds = 0.5 }, { steps = 100 } or { regime = 1 }
        "#);
        assert!(
            one("distribution = \"uniform\"\nlow = 1.0\nhigh = 2.0\nat = { seconds = 1.0, steps = 2 }\n")
                .contains("one of `seconds`")
        );
    }

    #[test]
    fn a_posterior_reads_back_and_a_wrong_one_is_refused() {
        let text = "[posterior]\nnames = [\"inertia\", \"coulomb_friction.torque\"]\nvalues = [0.1, 0.2]\nstd = [0.01, 0.02]\n\
                    correlation = [[-0.3]]\n";
        let file = read(text).unwrap();
        let again = TwinFile::parse(Document::from_text("twin.toml", file.render(Path::new("")).unwrap())).unwrap();
        assert_eq!(again.posterior, file.posterior);
        insta::assert_snapshot!(read(&text.replace("[0.01, 0.02]", "[0.01]")).unwrap_err(), @"
        twin.toml:9:2: expected 2 `std`, one a name, found 1
          hint: let `trueup diagnose` write it anew
        ");
    }
}
