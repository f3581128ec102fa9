//! The mechanisms that documents list, as an assembly of the plant every order meets.

use crate::io::{Assumptions, DEFAULT_UNCERTAINTY, Document, InputError, MechanismEntry, listed_mechanism};
use crate::sim2real::{Assembly, Mechanism};

use super::mechanism::Commission;
use super::{Execution, MECHANISMS};

/// A `[[mechanism]]` of a document: the document, its number there, and what it says.
pub(super) type Listed<'a> = (&'a Document, usize, &'a MechanismEntry);

/// A parameter that a mechanism has on top of what is listed: its id, and by how much.
pub(super) type Besides = (&'static str, f64);

/// The execution plant with the mechanisms `listed`, the commissions `assumed` and what there is `besides`.
///
/// # Errors
/// Mechanisms, keys, units or values the registry does not know, and what stands in two documents, or in two ways in one.
pub(super) fn assembly<'a>(
    listed: impl Iterator<Item = Listed<'a>>,
    assumed: impl Iterator<Item = (&'a Document, &'a Assumptions)>,
    besides: &[Besides],
) -> Result<Assembly<Execution>, InputError> {
    let mut assembly = Assembly::new(Execution, MECHANISMS);
    let mut seen: Vec<Listed<'a>> = Vec::new();
    for (document, index, entry) in listed {
        let number = index.to_string();
        if let Some((other, at, _)) = seen.iter().find(|(_, _, other)| other.name == entry.name) {
            let there = document.place_of(&["mechanism", &number, "name"]);
            let error = other
                .error(&["mechanism", &at.to_string(), "name"], format!("`{}` is listed here and in {there}", entry.name));
            return Err(error.hint("drop one of the two, or give one the effect of both"));
        }
        let (mechanism, form, mut parameters) = listed_mechanism(document, index, entry, &Execution, MECHANISMS)?;
        if let Some((_, more)) = besides.iter().find(|(id, _)| *id == entry.name)
            && let Some(first) = parameters.first_mut()
        {
            first.nominal += more;
        }
        assembly = assembly.with_mechanism(mechanism, form, parameters);
        seen.push((document, index, entry));
    }
    for (id, value) in besides {
        let row = MECHANISMS.iter().find(|row| row.about().name == *id && !seen.iter().any(|(.., entry)| entry.name == *id));
        if let Some(row) = row {
            assembly = with(assembly, *row, 0, *value);
        }
    }
    with_commissions(assembly, &seen, assumed)
}

/// The same with the commissions `assumed`.
fn with_commissions<'a>(
    mut assembly: Assembly<Execution>,
    listed: &[Listed<'a>],
    assumed: impl Iterator<Item = (&'a Document, &'a Assumptions)>,
) -> Result<Assembly<Execution>, InputError> {
    let mut before: Option<String> = None;
    for (document, assumptions) in assumed {
        let commissions =
            [("commission_bps", assumptions.commission_bps), ("commission_per_share", assumptions.commission_per_share)];
        for (form, (key, value)) in commissions.into_iter().enumerate() {
            let Some(value) = value.filter(|value| *value != 0.0) else { continue };
            let keys = ["assumptions", key];
            if let Some((other, at, _)) = listed.iter().find(|(_, _, entry)| entry.name == "commission") {
                let there = other.place_of(&["mechanism", &at.to_string(), "name"]);
                let message = if std::ptr::eq(*other, document) {
                    "there is a commission among the mechanisms too".to_owned()
                } else {
                    format!("there is a commission among the mechanisms too, in {there}")
                };
                return Err(document.error(&keys, message).hint("say it once"));
            }
            if let Some(there) = &before {
                let message = format!("there is a commission in {there} too");
                return Err(document.error(&keys, message).hint("say it once"));
            }
            before = Some(document.place_of(&keys));
            assembly = with(assembly, &Commission, form, value);
        }
    }
    Ok(assembly)
}

/// The same with `mechanism`, whose first parameter has this value, as uncertain as values of which nothing more is said.
fn with(
    assembly: Assembly<Execution>,
    mechanism: &'static dyn Mechanism<Execution>,
    form: usize,
    value: f64,
) -> Assembly<Execution> {
    let mut parameters = mechanism.forms(&Default::default()).swap_remove(form).parameters;
    for parameter in &mut parameters {
        parameter.nominal = value;
        parameter.prior = Some(DEFAULT_UNCERTAINTY * value.abs());
    }
    assembly.with_mechanism(mechanism, form, parameters)
}
