//! What an environment is made of: its plant with mechanisms, and what is randomized of them, as options say.

use super::draws::Randomization;
use crate::rl::{About, EnvError, Occasion, OptionAbout, OptionKind, Options};
use crate::sim2real::{Assembly, Plant};

/// A plant with its mechanisms, and what is randomized.
#[derive(Debug, Clone)]
pub(super) struct Setting<P: Plant> {
    pub assembly: Assembly<P>,
    pub randomization: Option<Randomization>,
}

/// Names the option that holds sections of a twin.
const TWIN: &str = "twin";
/// Names the option of how long regimes last.
const REGIME_SECONDS: &str = "regime_seconds";

/// The options by which a plant is given mechanisms; `own` is the plant where the twin says nothing of its parameters.
pub(super) fn twin_options(model: &str, own: &str) -> [OptionAbout; 2] {
    let meaning = format!(
        "sections of a twin document (TOML): [[mechanism]], [[randomize.parameter]], [posterior] and, of the model `{model}`, [twin] \
         and [parameters]; without the last two the plant is {own}"
    );
    let text = OptionKind::Text { nominal: String::new() };
    let lasting = "how long a regime lasts in the mean, where parameters are drawn with regimes";
    [
        OptionAbout::new(Occasion::Make, TWIN, "", text, &meaning),
        OptionAbout::number(Occasion::Make, REGIME_SECONDS, "s", [2.0, 1e-3, 1e6], lasting),
    ]
}

/// A plant as a twin knows it.
#[cfg_attr(not(feature = "io"), expect(dead_code, reason = "only documents name models"))]
pub(super) struct Model<'a> {
    /// Name, as a twin's `model`.
    pub name: &'a str,
    /// The section `[channels]` where a twin says nothing of them.
    pub channels: &'a str,
}

#[cfg(feature = "io")]
mod documents {
    use super::{About, EnvError, Model, Options, REGIME_SECONDS, Randomization, Setting, TWIN};
    use crate::io::{Document, InputError, TwinFile, hint_among, randomized_twin};
    use crate::robot::{Signal, robot_presets};
    use crate::sim2real::{Assembly, Plant};

    impl<P: Plant<Command = Signal>> Setting<P> {
        /// The setting that `options` ask for. Where no twin is given it is `own`; where one is that says nothing of the plant, its
        /// mechanisms are put on `bare`; else `read` reads it.
        pub fn of(
            options: &Options,
            about: &About,
            model: &Model<'_>,
            (own, bare): (Assembly<P>, P),
            read: impl FnOnce(&TwinFile) -> Result<Assembly<P>, InputError>,
        ) -> Result<Self, EnvError> {
            let text = options.text(&about.options, TWIN)?;
            if text.trim().is_empty() {
                return Ok(Self { assembly: own, randomization: None });
            }
            let regime_seconds = options.number(&about.options, REGIME_SECONDS)?;
            let registry = own.registry();
            let made = || {
                let given = Document::from_text(TWIN, text.as_str());
                let whole = given.has("twin") || given.has("parameters");
                let mut all = text.clone();
                for (section, content) in
                    [("twin", format!("model = \"{}\"", model.name)), ("channels", model.channels.into())]
                {
                    if !given.has(section) {
                        all.push_str(&format!("\n[{section}]\n{content}\n"));
                    }
                }
                let file = TwinFile::parse(Document::from_text(TWIN, all))?;
                if file.model != model.name {
                    let known = [model.name];
                    let error = file.error(&["twin", "model"], format!("expected the model `{}`", model.name));
                    return Err(error.found_text(&file.model).maybe_hint(hint_among(&file.model, &known)));
                }
                let assembly = match whole {
                    true => read(&file)?,
                    false => crate::robot::twin_assembly(&file, bare, registry)?,
                };
                if file.randomize.is_none() && file.posterior.is_none() {
                    return Ok(Self { assembly, randomization: None });
                }
                let (section, posterior) = (file.randomize.as_ref(), file.posterior.as_ref());
                let twin = randomized_twin(&assembly, file.document(), section, posterior, &robot_presets())?;
                let randomization =
                    Randomization { randomizer: twin.randomizer, places: twin.places, level: twin.level, regime_seconds };
                Ok(Self { assembly: twin.assembly, randomization: Some(randomization) })
            };
            made().map_err(|error| refused(&error))
        }
    }

    fn refused(error: &InputError) -> EnvError {
        let words = error.to_string();
        let (message, hint) = words.split_once("\n  hint: ").unwrap_or((&words, "see the documentation of twins"));
        EnvError::Option {
            name: TWIN.into(),
            value: format!("a text with a mistake ({message})"),
            must: "sections of a twin document".into(),
            remedy: hint.into(),
        }
    }
}

#[cfg(not(feature = "io"))]
impl<P: Plant> Setting<P> {
    /// The setting that `options` ask for: `own`, since documents cannot be read.
    pub fn of(
        options: &Options,
        about: &About,
        _model: &Model<'_>,
        (own, _bare): (Assembly<P>, P),
    ) -> Result<Self, EnvError> {
        let text = options.text(&about.options, TWIN)?;
        let _ = options.number(&about.options, REGIME_SECONDS)?;
        if text.trim().is_empty() {
            return Ok(Self { assembly: own, randomization: None });
        }
        Err(EnvError::Option {
            name: TWIN.into(),
            value: "a document".into(),
            must: "left out: this build reads no documents".into(),
            remedy: "build with the cargo feature `io`".into(),
        })
    }
}
