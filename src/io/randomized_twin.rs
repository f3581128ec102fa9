//! `[randomize]` beside the twin it is of: which parameters are meant, and what is drawn of each.

use super::document::Document;
use super::error::{InputError, hint_among};
use super::randomize_section::{RandomizeSection, RandomizedEntry};
use super::twin_file::TwinFile;
use super::unit::check_unit;
use crate::sim2real::randomize::{
    Correlation, DrawTable, Level, Posterior, Preset, RandomizeError, Randomized, Randomizer, Redraw, Target,
};
use crate::sim2real::{Assembly, Mechanism, Parameter, Plant, Seed, Simulator};

/// A twin whose parameters are drawn.
#[derive(Debug, Clone)]
pub struct RandomizedTwin<P: Plant> {
    /// The twin, with every mechanism that is randomized: those it did not list do nothing at their nominal values.
    pub assembly: Assembly<P>,
    /// What is drawn.
    pub randomizer: Randomizer,
    /// How much.
    pub level: Level,
    /// Which of the assembly's parameters each row of a table is.
    pub places: Vec<usize>,
    /// Ids of the mechanisms that the twin did not list.
    pub added: Vec<&'static str>,
    /// What a reader should know, a sentence each.
    pub notes: Vec<String>,
}

impl<P: Plant> RandomizedTwin<P> {
    /// Holds every parameter to be drawn once for a run: one that is drawn anew within needs an environment, which goes on from
    /// where it is.
    ///
    /// # Errors
    /// A parameter that is drawn every so often, or with a regime.
    pub fn check_drawn_once(&self, document: &Document) -> Result<(), InputError> {
        let within = |one: &&Randomized| !matches!(one.at, Redraw::Startup | Redraw::Reset);
        match self.randomizer.randomized().iter().find(within) {
            None => Ok(()),
            Some(one) => {
                let message = format!("`{}` is drawn anew within a run, which takes an environment", one.target);
                Err(document.error(&["randomize"], message).hint("say at = \"reset\": a value a run"))
            }
        }
    }

    /// The values of all of the assembly's parameters, a list each of `draws` draws.
    #[must_use]
    pub fn draw(&self, seed: Seed, draws: usize) -> (DrawTable, Vec<Vec<f64>>) {
        let table = self.randomizer.begin(seed, 0, draws, 0, self.level);
        let nominal: Vec<f64> = self.assembly.parameters().iter().map(|p| p.nominal).collect();
        let mut lanes = vec![nominal; draws];
        for (k, place) in self.places.iter().enumerate() {
            lanes.iter_mut().zip(table.row(k)).for_each(|(lane, value)| lane[*place] = *value);
        }
        (table, lanes)
    }
}

/// Where what is wanted of a parameter comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Origin {
    /// The `[[randomize.parameter]]` of this number.
    Entry(usize),
    /// A posterior, of which it is the parameter of this number.
    Posterior(usize),
    /// The preset and the row in it of these numbers.
    Preset(usize, usize),
}

/// The posterior that `section`, which is one of `document`, draws from; none where it names none.
///
/// # Errors
/// A document that is not there, or has no `[posterior]`.
pub fn posterior_of(document: &Document, section: &RandomizeSection) -> Result<Option<Posterior>, InputError> {
    let Some(named) = &section.posterior else { return Ok(None) };
    let keys = ["randomize", "posterior"];
    let path = document.resolve(named);
    if !path.is_file() {
        let error = document.error(&keys, "the document is not there").found_text(&named.to_string_lossy());
        return Err(error.hint("name the trued.toml that `trueup diagnose --out` has written"));
    }
    // A document may draw from its own posterior.
    let read = Document::read(&path)?;
    let file = if read.has("run") || read.has("twin") { TwinFile::parse(read)?.posterior } else { None };
    match file {
        Some(posterior) => Ok(Some(posterior)),
        None => {
            let error = document.error(&keys, format!("{} has no section [posterior]", named.display()));
            Err(error.hint("diagnose anew: trued.toml has it since posteriors are written"))
        }
    }
}

/// What is drawn of `assembly`, which `document` declares: what `section` says, and where there is none, the document's own
/// `posterior`. Presets are looked up in `presets`.
///
/// # Errors
/// Nothing to randomize; mechanisms, parameters, units and presets there are not; what [`Randomizer::new`] refuses, at the place
/// it comes from.
pub fn randomized_twin<P: Plant>(
    assembly: &Assembly<P>,
    document: &Document,
    section: Option<&RandomizeSection>,
    posterior: Option<&Posterior>,
    presets: &[Preset],
) -> Result<RandomizedTwin<P>, InputError> {
    let read = section.map(|section| posterior_of(document, section)).transpose()?.flatten();
    let (posterior, at) = match (section, posterior) {
        (Some(section), _) => (read.as_ref(), section.at),
        (None, Some(own)) => (Some(own), Redraw::Reset),
        (None, None) => {
            let error = document.error(&[], "there is nothing to draw from: neither [randomize] nor [posterior]");
            return Err(error.hint("add [[randomize.parameter]] sections, or take the trued.toml of a diagnosis"));
        }
    };
    let wanted = Wanted::of(document, section, posterior, presets)?;
    let mut out = Resolving { document, wanted, assembly: assembly.clone(), added: Vec::new(), notes: Vec::new() };
    out.add_mechanisms()?;
    let (randomized, origins, places) = out.randomized(at)?;
    let correlations = out.correlations(section, &randomized, &origins);
    let Resolving { wanted, assembly, added, mut notes, .. } = out;
    let randomizer =
        Randomizer::new(randomized, correlations).map_err(|error| explained(document, &wanted, &origins, &error))?;
    notes.extend(randomizer.oddities());
    let level = section.map_or(Level::FULL, |section| section.level);
    Ok(RandomizedTwin { assembly, randomizer, level, places, added, notes })
}

/// All that is wanted, what is nearest to the twin first.
struct Wanted<'a> {
    entries: &'a [RandomizedEntry],
    posterior: Option<&'a Posterior>,
    presets: Vec<&'a Preset>,
    /// Each parameter once.
    targets: Vec<(Target, Origin)>,
}

impl<'a> Wanted<'a> {
    fn of(
        document: &Document,
        section: Option<&'a RandomizeSection>,
        posterior: Option<&'a Posterior>,
        all: &'a [Preset],
    ) -> Result<Self, InputError> {
        let entries = section.map_or(&[][..], |section| &section.parameters);
        let mut presets = Vec::new();
        for (index, name) in section.iter().flat_map(|section| section.presets.iter().enumerate()) {
            let names: Vec<&str> = all.iter().map(|preset| preset.name).collect();
            let Some(preset) = all.iter().find(|preset| preset.name == name) else {
                let keys = ["randomize", "preset", &index.to_string()];
                let error = document.error(&keys, format!("there is no preset `{name}` for this model"));
                return Err(error.maybe_hint(hint_among(name, &names)));
            };
            presets.push(preset);
        }
        let mut targets: Vec<(Target, Origin)> = Vec::new();
        for (index, entry) in entries.iter().enumerate() {
            // One that is here twice is refused with all others.
            targets.push((entry.target.clone(), Origin::Entry(index)));
        }
        let told = posterior.map_or(0, |posterior| posterior.names.len());
        let of_posterior = (0..told).filter_map(|k| Some((posterior?.target(k), Origin::Posterior(k))));
        let of_presets = presets.iter().enumerate().flat_map(|(number, preset)| {
            preset.rows.iter().enumerate().map(move |(row, one)| (one.target.clone(), Origin::Preset(number, row)))
        });
        for (target, origin) in of_posterior.chain(of_presets) {
            if targets.iter().all(|(other, _)| *other != target) {
                targets.push((target, origin));
            }
        }
        Ok(Self { entries, posterior, presets, targets })
    }

    /// Where in the document it stands; `key` is that of an entry.
    fn error(&self, document: &Document, origin: Origin, key: &str, message: String) -> InputError {
        match origin {
            Origin::Entry(index) => document.error(&["randomize", "parameter", &index.to_string(), key], message),
            Origin::Posterior(_) if document.has("randomize") => document.error(&["randomize", "posterior"], message),
            Origin::Posterior(_) => document.error(&["posterior", "names"], message),
            Origin::Preset(..) => document.error(&["randomize", "preset"], message),
        }
    }
}

struct Resolving<'a, P: Plant> {
    document: &'a Document,
    wanted: Wanted<'a>,
    assembly: Assembly<P>,
    added: Vec<&'static str>,
    notes: Vec<String>,
}

impl<P: Plant> Resolving<'_, P> {
    /// Adds the mechanisms that are wanted and not listed, at their nominal values, in the first form that has all that is wanted.
    fn add_mechanisms(&mut self) -> Result<(), InputError> {
        let registry = self.assembly.registry();
        let names: Vec<&'static str> = registry.iter().map(|row| row.about().name).collect();
        let targets = self.wanted.targets.clone();
        for (target, origin) in &targets {
            let Some(id) = target.mechanism.as_deref() else { continue };
            // A factor of what does nothing does nothing either.
            if matches!(origin, Origin::Preset(number, row) if self.wanted.presets[*number].rows[*row].relative) {
                continue;
            }
            if self.assembly.mechanisms().any(|(row, ..)| row.about().name == id) {
                continue;
            }
            let Some(mechanism) = registry.iter().find(|row| row.about().name == id) else {
                if matches!(origin, Origin::Preset(..)) {
                    continue;
                }
                let message = format!("there is no mechanism `{id}`");
                let error = self.wanted.error(self.document, *origin, "mechanism", message);
                return Err(error.maybe_hint(hint_among(id, &names)));
            };
            let together = |(other, whence): &&(Target, Origin)| {
                let firm = !matches!(whence, Origin::Preset(..));
                other.mechanism.as_deref() == Some(id) && (firm || whence == origin)
            };
            let asked: Vec<&str> = targets.iter().filter(together).map(|(other, _)| other.parameter.as_str()).collect();
            match self.form(*mechanism, &asked) {
                Some((form, parameters)) => {
                    let assembly = self.assembly.clone().with_mechanism(*mechanism, form, parameters);
                    self.assembly = assembly;
                    self.added.push(mechanism.about().name);
                }
                None if matches!(origin, Origin::Preset(..)) => {}
                None => return Err(self.no_form(*mechanism, target, *origin, &asked)),
            }
        }
        Ok(())
    }

    /// The first form of a mechanism that has all these parameters and something to act on.
    fn form(&self, mechanism: &dyn Mechanism<P>, asked: &[&str]) -> Option<(usize, Vec<Parameter>)> {
        let forms = mechanism.forms(&Default::default());
        let whole = |parameters: &[Parameter]| asked.iter().all(|name| parameters.iter().any(|p| p.name == *name));
        let open = |form: usize| self.assembly.plant().open_to(mechanism.site(form));
        let mut fitting = forms.into_iter().enumerate().filter(|(k, form)| whole(&form.parameters) && open(*k));
        fitting.next().map(|(k, form)| (k, form.parameters))
    }

    fn no_form(&self, mechanism: &dyn Mechanism<P>, target: &Target, origin: Origin, asked: &[&str]) -> InputError {
        let forms = mechanism.forms(&Default::default());
        let mut known: Vec<&str> = Vec::new();
        for parameter in forms.iter().flat_map(|form| &form.parameters) {
            if !known.contains(&parameter.name.as_ref()) {
                known.push(&parameter.name);
            }
        }
        let id = mechanism.about().name;
        let error = |message: String| self.wanted.error(self.document, origin, "parameter", message);
        match asked.iter().find(|name| !known.contains(*name)) {
            Some(name) => error(format!("`{id}` has no parameter `{name}`")).maybe_hint(hint_among(name, &known)),
            None if asked.len() > 1 => {
                let ways: Vec<String> = forms
                    .iter()
                    .map(|form| form.parameters.iter().map(|p| format!("`{}`", p.name)).collect::<Vec<_>>().join(" and "))
                    .collect();
                error(format!("no form of `{id}` has all of `{}`", asked.join("`, `")))
                    .hint(format!("it has {}", ways.join(", or ")))
            }
            None => error(format!("`{target}` has nothing to act on: the twin does not say what moves"))
                .hint("say it in a section `[attach]`"),
        }
    }

    /// The assembly's parameters by name, in their order.
    fn known(&self) -> Vec<Target> {
        let own = self.assembly.own().iter().map(|p| Target::own(&p.name));
        let added = self
            .assembly
            .mechanisms()
            .flat_map(|(row, _, parameters)| parameters.iter().map(move |p| Target::of(row.about().name, &p.name)));
        own.chain(added).collect()
    }

    /// The parameters that are randomized, where each comes from, and its place among those of the assembly.
    #[allow(clippy::type_complexity, reason = "three lists of the same length")]
    fn randomized(&mut self, at: Redraw) -> Result<(Vec<Randomized>, Vec<Origin>, Vec<usize>), InputError> {
        let known = self.known();
        let targets = self.wanted.targets.clone();
        let (mut all, mut origins, mut places) = (Vec::new(), Vec::new(), Vec::new());
        for (target, origin) in targets {
            let Some(place) = known.iter().position(|other| *other == target) else {
                // A preset is of more than one twin has.
                if matches!(origin, Origin::Preset(..)) {
                    continue;
                }
                return Err(self.unknown(&known, &target, origin));
            };
            let parameter = self.assembly.parameters()[place].clone();
            let unit = match target.mechanism {
                Some(_) => self.assembly.plant().unit(&parameter.unit),
                None => parameter.unit.clone().into_owned(),
            };
            let Some(one) = self.one(target, origin, parameter, &unit, at)? else { continue };
            all.push(one);
            origins.push(origin);
            places.push(place);
        }
        if all.is_empty() {
            let error =
                self.document.error(&["randomize"], "there is nothing to randomize: no preset has a parameter of this twin");
            return Err(error.hint("add [[randomize.parameter]]"));
        }
        Ok((all, origins, places))
    }

    fn one(
        &mut self,
        target: Target,
        origin: Origin,
        parameter: Parameter,
        unit: &str,
        at: Redraw,
    ) -> Result<Option<Randomized>, InputError> {
        Ok(match origin {
            Origin::Entry(index) => {
                let entry = &self.wanted.entries[index];
                check_unit(entry.unit.as_deref(), if entry.relative { "" } else { unit }).map_err(|mismatch| {
                    let message = format!("expected the unit `{}`", mismatch.expected);
                    let error = self.wanted.error(self.document, origin, "unit", message);
                    error.found(format_args!("`{}`", mismatch.found)).hint(mismatch.hint)
                })?;
                let RandomizedEntry { distribution, relative, at, .. } = entry.clone();
                Some(Randomized { target, parameter, distribution, relative, at })
            }
            Origin::Posterior(k) => self.wanted.posterior.map(|posterior| posterior.randomized(k, parameter, at)),
            Origin::Preset(number, row) => {
                let preset = self.wanted.presets[number];
                let row = &preset.rows[row];
                let skipped = |why: String| format!("The preset `{}` leaves out `{target}`: {why}", preset.name);
                let whole = Randomized {
                    target: target.clone(),
                    parameter: parameter.clone(),
                    distribution: row.distribution.clone(),
                    relative: row.relative,
                    at: row.at,
                };
                if row.relative && (parameter.nominal == 0.0 || !parameter.nominal.is_finite()) {
                    self.notes.push(skipped(format!("it is told in factors, and the twin has {}", parameter.nominal)));
                    return Ok(None);
                }
                if !row.relative && check_unit(Some(row.unit), unit).is_err() {
                    self.notes.push(skipped(format!("it is told in `{}`, and the twin has it in `{unit}`", row.unit)));
                    return Ok(None);
                }
                Some(whole)
            }
        })
    }

    fn unknown(&self, known: &[Target], target: &Target, origin: Origin) -> InputError {
        let alike: Vec<String> =
            known.iter().filter(|other| other.mechanism == target.mechanism).map(|other| other.parameter.clone()).collect();
        let holder = match &target.mechanism {
            Some(id) => format!("`{id}`, as the twin lists it,"),
            None => format!("the model `{}`", self.assembly.name()),
        };
        let message = format!("{holder} has no parameter `{}`", target.parameter);
        let error = self.wanted.error(self.document, origin, "parameter", message);
        // A parameter of a mechanism may be named without it.
        let elsewhere = known.iter().find(|other| other.parameter == target.parameter && target.mechanism.is_none());
        match elsewhere.and_then(|other| other.mechanism.as_ref()) {
            Some(id) => error.hint(format!("`{id}` has one: add mechanism = \"{id}\"")),
            None => error.maybe_hint(hint_among(&target.parameter, &alike)),
        }
    }

    /// What goes together: as the section says, and as the posterior does of what is drawn from it.
    fn correlations(
        &mut self,
        section: Option<&RandomizeSection>,
        randomized: &[Randomized],
        origins: &[Origin],
    ) -> Vec<Correlation> {
        let mut all = section.map_or_else(Vec::new, |section| section.correlations.clone());
        let drawn = |target: &Target| {
            let at = randomized.iter().position(|one| one.target == *target)?;
            matches!(origins[at], Origin::Posterior(_)).then_some(())
        };
        let told = self.wanted.posterior.map_or_else(Vec::new, Posterior::correlations);
        all.extend(told.into_iter().filter(|pair| pair.between.iter().all(|target| drawn(target).is_some())));
        let replaced = self.wanted.posterior.map_or(0, |posterior| {
            let own = |k: &usize| {
                randomized
                    .iter()
                    .zip(origins)
                    .any(|(one, origin)| one.target == posterior.target(*k) && matches!(origin, Origin::Entry(_)))
            };
            (0..posterior.names.len()).filter(own).count()
        });
        if replaced > 0 {
            self.notes
                .push(format!("{replaced} of the posterior's parameters are drawn as [[randomize.parameter]] says instead"));
        }
        all
    }
}

/// The error of a randomizer at the place it comes from.
fn explained(document: &Document, wanted: &Wanted<'_>, origins: &[Origin], error: &RandomizeError) -> InputError {
    let words = error.to_string();
    let (message, hint) = words.split_once("\nhint: ").unwrap_or((&words, ""));
    let error = match error {
        RandomizeError::Parameter { index, .. } => {
            wanted.error(document, origins[*index], "distribution", message.to_owned())
        }
        RandomizeError::Twice { index, .. } => wanted.error(document, origins[*index], "parameter", message.to_owned()),
        RandomizeError::Correlation(_) => document.error(&["randomize", "correlation"], message),
    };
    if hint.is_empty() { error } else { error.hint(hint) }
}
