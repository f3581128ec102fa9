//! The mechanisms a twin or a run lists, looked up in a registry.

use super::document::Document;
use super::error::{InputError, hint_among};
use super::quantity::{DEFAULT_UNCERTAINTY, MechanismEntry};
use super::unit::{check_unit, unit_told};
use crate::sim2real::{Mechanism, Parameter, Plant, Registry};

/// A mechanism, its form and its parameters.
pub type ListedMechanism<P> = (&'static dyn Mechanism<P>, usize, Vec<Parameter>);

/// The row of `registry` that the `index`-th `[[mechanism]]` of `document` names, in the form its keys say, with its
/// values; `plant` says which units these have on it. One without keys stands for its customary values, if it has any.
///
/// # Errors
/// An id, a key, a unit or a value that the registry does not know; keys that make up no form.
pub fn listed_mechanism<P: Plant>(
    document: &Document,
    index: usize,
    entry: &MechanismEntry,
    plant: &P,
    registry: Registry<P>,
) -> Result<ListedMechanism<P>, InputError> {
    let number = index.to_string();
    let names: Vec<&str> = registry.iter().map(|mechanism| mechanism.about().name).collect();
    let Some(mechanism) = registry.iter().find(|mechanism| mechanism.about().name == entry.name) else {
        let error = document.error(&["mechanism", &number, "name"], format!("there is no mechanism `{}`", entry.name));
        return Err(error.maybe_hint(hint_among(&entry.name, &names)));
    };
    let forms = mechanism.forms(&Default::default());
    let known: Vec<&str> = forms.iter().flat_map(|form| &form.parameters).map(|parameter| parameter.name.as_ref()).collect();
    if let Some((key, _)) = entry.parameters.iter().find(|(key, _)| !known.contains(&key.as_str())) {
        let error = document.error(&["mechanism", &number, key], format!("`{}` has no parameter `{key}`", entry.name));
        return Err(error.maybe_hint(hint_among(key, &known)));
    }
    let whole = |parameters: &[Parameter]| {
        parameters.len() == entry.parameters.len() && parameters.iter().all(|p| entry.parameter(&p.name).is_some())
    };
    if let Some((form, values)) = mechanism.customary().filter(|_| entry.parameters.is_empty()) {
        let stated = forms[form].parameters.iter().cloned().zip(values);
        let prior = |value: f64| Some(DEFAULT_UNCERTAINTY * value.abs());
        let parameters = stated.map(|(p, value)| Parameter { nominal: value, prior: prior(value), ..p }).collect();
        return Ok((*mechanism, form, parameters));
    }
    let Some(form) = forms.iter().position(|form| whole(&form.parameters)) else {
        let ways: Vec<String> = forms
            .iter()
            .map(|form| form.parameters.iter().map(|p| format!("`{}`", p.name)).collect::<Vec<_>>().join(" and "))
            .collect();
        let error = document.error(&["mechanism", &number], format!("the parameters of `{}` are not complete", entry.name));
        return Err(error.hint(format!("give {}", ways.join(", or "))));
    };
    let site = mechanism.site(form);
    if !plant.open_to(site) {
        let message = format!("`{}` has nothing to act on: the twin does not say what moves", entry.name);
        return Err(document.error(&["mechanism", &number, "name"], message).hint("say it in a section `[attach]`"));
    }
    let mut parameters = forms[form].parameters.clone();
    for parameter in &mut parameters {
        let Some(quantity) = entry.parameter(&parameter.name) else { continue };
        let keys = ["mechanism", &number, parameter.name.as_ref()];
        let unit = plant.unit(&parameter.unit);
        check_unit(quantity.unit.as_deref(), &unit).map_err(|mismatch| {
            let error = document.error(&keys, format!("expected the unit `{}`", mismatch.expected));
            error.found(format_args!("`{}`", mismatch.found)).hint(mismatch.hint)
        })?;
        if !(parameter.lower..=parameter.upper).contains(&quantity.value) {
            let error = document.error(&keys, format!("expected a value from {} to {}", parameter.lower, parameter.upper));
            return Err(error.found(quantity.value).hint(unit_told(&unit)));
        }
        parameter.nominal = quantity.value;
        parameter.prior = Some(quantity.std());
    }
    Ok((*mechanism, form, parameters))
}
