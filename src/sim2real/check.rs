//! The contracts of the core traits as functions: run over every registry row by the tests, and public, so that a plant
//! or mechanism written elsewhere can be held to them too.

use std::fmt;

use super::{
    Assembly, Form, Mechanism, Parameter, Plant, Recording, Registry, Seed, Simulator, Thetas, Trajectory, Typical,
};

/// A broken line of a contract.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Violation {
    /// Who broke it.
    pub subject: String,
    /// What was broken, with what was found.
    pub what: String,
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.subject, self.what)
    }
}

impl std::error::Error for Violation {}

/// Runs the contract of [`Plant`] on `plant`, following `recording`.
///
/// # Errors
/// The first line of the contract that is broken.
pub fn check_plant<P: Plant>(plant: &P, registry: Registry<P>, recording: &Recording<P::Stimulus>) -> Result<(), Violation> {
    let fail = |what: String| Err(Violation { subject: plant.name().to_owned(), what });
    let assembly = Assembly::new(plant.clone(), registry);
    check_parameters(plant.name(), &plant.parameters())?;
    let lane = start(&assembly, recording, &[]);
    let alone = follow(&assembly, recording, std::slice::from_ref(&lane));
    let names: Vec<&str> = alone[0].iter().map(|s| s.channel.as_str()).collect();
    if names != plant.channels().iter().map(|c| c.name.as_ref()).collect::<Vec<_>>() {
        return fail(format!("channels are {names:?}"));
    }
    if alone[0].iter().any(|s| s.samples.len() != recording.len()) {
        return fail("a channel does not have one sample a row".into());
    }
    if follow(&assembly, recording, std::slice::from_ref(&lane)) != alone {
        return fail("two runs differ".into());
    }
    lanes_are_independent(plant.name(), &assembly, recording, &lane)
}

/// Runs the contract of [`Mechanism`] on `mechanism` in each of its forms, on `plant` following `recording`, which must
/// move the plant enough for the mechanism to act.
///
/// # Errors
/// The first line of the contract that is broken.
pub fn check_mechanism<P: Plant>(
    mechanism: &'static dyn Mechanism<P>,
    plant: &P,
    registry: Registry<P>,
    recording: &Recording<P::Stimulus>,
) -> Result<(), Violation> {
    let about = mechanism.about();
    let fail = |what: String| Err(Violation { subject: about.name.to_owned(), what });
    if [about.title, about.law, about.source, about.remedy].iter().any(|text| text.trim().is_empty()) {
        return fail("a title, law, source or remedy is empty".into());
    }
    let typical = plant.typical(std::slice::from_ref(recording));
    let bare = Assembly::new(plant.clone(), registry);
    let without = follow(&bare, recording, &[start(&bare, recording, &[])]);
    let plain = mechanism.forms(&Typical::default());
    let forms = mechanism.forms(&typical);
    if plain.len() != forms.len() || forms.is_empty() {
        return fail(format!("{} forms, but {} for a recording", plain.len(), forms.len()));
    }
    if let Some(form) = forms.iter().enumerate().find_map(|(k, form)| forms[..k].iter().find(|other| alike(form, other))) {
        return fail(format!("the parameters of form `{}` are those of another: a twin could not say which", form.name));
    }
    for (index, form) in forms.into_iter().enumerate() {
        check_parameters(about.name, &form.parameters)?;
        if form.parameters.len() != plain[index].parameters.len() {
            return fail(format!("form {index} changes its number of parameters with the recording"));
        }
        if !plant.open_to(mechanism.site(index)) || !mechanism.applies(index, plant, &recording.stimulus) {
            continue;
        }
        let with = bare.clone().with_mechanism(mechanism, index, form.parameters.clone());
        let nominal: Vec<f64> = form.parameters.iter().map(|p| p.nominal).collect();
        if follow(&with, recording, &[start(&with, recording, &nominal)]) != without {
            return fail(format!("form `{}` changes the output at its nominal values", form.name));
        }
        let acting: Vec<f64> = form.parameters.iter().map(|p| *p.starts.last().unwrap_or(&p.nominal)).collect();
        let lane = start(&with, recording, &acting);
        let changed = follow(&with, recording, std::slice::from_ref(&lane));
        if changed == without {
            return fail(format!("form `{}` changes nothing at its start {acting:?}", form.name));
        }
        if changed[0].iter().any(|s| s.samples.iter().any(|v| !v.is_finite())) {
            return fail(format!("form `{}` gives values that are not finite at its start {acting:?}", form.name));
        }
        lanes_are_independent(about.name, &with, recording, &lane)?;
    }
    Ok(())
}

/// Whether two forms have parameters of the same names.
fn alike(one: &Form, other: &Form) -> bool {
    let has = |form: &Form, name: &str| form.parameters.iter().any(|p| p.name == name);
    one.parameters.len() == other.parameters.len() && one.parameters.iter().all(|p| has(other, &p.name))
}

/// The values all parameters begin with: the plant's nominal, then `mechanism`, then the initial state's nominal.
fn start<P: Plant>(assembly: &Assembly<P>, recording: &Recording<P::Stimulus>, mechanism: &[f64]) -> Vec<f64> {
    let plant = assembly.plant().parameters().into_iter().map(|p| p.nominal);
    let initial = assembly.initial_parameters(recording, 0).into_iter().map(|p| p.nominal);
    plant.chain(mechanism.iter().copied()).chain(initial).collect()
}

fn follow<P: Plant>(assembly: &Assembly<P>, recording: &Recording<P::Stimulus>, lanes: &[Vec<f64>]) -> Vec<Trajectory> {
    assembly.rollout(&Thetas::from_lanes(lanes), recording, 0..recording.len(), Seed(1))
}

fn lanes_are_independent<P: Plant>(
    subject: &str,
    assembly: &Assembly<P>,
    recording: &Recording<P::Stimulus>,
    lane: &[f64],
) -> Result<(), Violation> {
    let alone = follow(assembly, recording, &[lane.to_vec()]);
    let other: Vec<f64> = lane.iter().map(|v| if v.is_finite() { v * 1.1 } else { *v }).collect();
    let beside = follow(assembly, recording, &[other.clone(), lane.to_vec(), other.clone(), other, lane.to_vec()]);
    for k in [1, 4] {
        if beside[k] != alone[0] {
            return Err(Violation {
                subject: subject.to_owned(),
                what: format!("lane {k} of 5 differs from the same lane alone"),
            });
        }
    }
    Ok(())
}

fn check_parameters(subject: &str, parameters: &[Parameter]) -> Result<(), Violation> {
    for p in parameters {
        let fail =
            |what: &str| Err(Violation { subject: subject.to_owned(), what: format!("parameter `{}` {what}", p.name) });
        if p.lower > p.upper || !(p.lower..=p.upper).contains(&p.nominal) {
            return fail("has a nominal value outside its bounds");
        }
        if p.starts.iter().any(|s| !(p.lower..=p.upper).contains(s) || *s == p.nominal) {
            return fail("has a start outside its bounds, or one that does nothing");
        }
        if p.name.is_empty() || parameters.iter().filter(|other| other.name == p.name).count() > 1 {
            return fail("has no name of its own");
        }
    }
    Ok(())
}
