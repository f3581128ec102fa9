//! The document of a twin after a fit, where it is more than the twin: a run, or one that names its tape by instrument.

use std::path::Path;

use serde::Deserialize;
use toml::{Table, Value};

use super::document_edit::Change;
use super::error::InputError;
use super::instrument_entry::names_a_file;
use super::posterior_section::posterior_values;
use super::quantity::{MechanismEntry, Quantity};
use super::relative_path::path_from;
use super::twin_file::TwinFile;

#[derive(Deserialize)]
struct OnlyMechanisms {
    #[serde(default)]
    mechanism: Vec<MechanismEntry>,
}

/// Where a document names files: a section, whether it is a list, and its keys.
const FILES: [(&str, bool, &[&str]); 8] = [
    ("data", true, &["bars", "quotes", "trades", "book", "actions", "snapshot"]),
    ("instrument", true, &["calendar"]),
    ("rate", true, &["file"]),
    ("halt", true, &["file"]),
    ("market", false, &["quotes", "trades", "bars"]),
    ("execution", false, &["twin"]),
    ("paper", false, &["kill_file"]),
    ("randomize", false, &["posterior"]),
];

impl TwinFile {
    /// The document, to be written into `folder`, with the mechanisms of this twin and without what they supersede.
    pub(super) fn changed_document(&self, folder: &Path) -> Result<String, InputError> {
        let document = self.document();
        let own: OnlyMechanisms = document.parse()?;
        let whole: Table = document.parse()?;
        let mut changes = self.mechanism_changes(&own.mechanism, &whole);
        changes.extend(self.superseded.iter().map(|keys| Change::Remove(keys.map(str::to_owned).into())));
        if let Some(price) = self.run.as_ref().and_then(|run| run.run.price)
            && whole["run"].get("price").is_none()
        {
            changes.push(Change::Set(path(&["run", "price"]), Value::String(price.word().to_owned())));
        }
        if let Some(shows) = self.run.as_ref().and_then(|run| run.run.shows_own_orders)
            && whole["run"].get("shows_own_orders").is_none()
        {
            changes.push(Change::Set(path(&["run", "shows_own_orders"]), Value::Boolean(shows)));
        }
        changes.extend(self.posterior_changes(&whole));
        let home = document.resolve("");
        if path_from(folder, &home.join("file")) != "file" {
            changes.extend(self.path_changes(&whole, folder));
        }
        document.changed(&changes)
    }

    /// What the posterior changes: there is one, or there is none any more.
    fn posterior_changes(&self, whole: &Table) -> Vec<Change> {
        let before = whole.get("posterior").and_then(Value::as_table);
        match (&self.posterior, before) {
            (None, None) => Vec::new(),
            (None, Some(_)) => vec![Change::Remove(path(&["posterior"]))],
            (Some(posterior), None) => vec![Change::Section("posterior", posterior_values(posterior))],
            (Some(posterior), Some(_)) => {
                let values = posterior_values(posterior).into_iter();
                values.map(|(key, value)| Change::Set(path(&["posterior", &key]), value)).collect()
            }
        }
    }

    /// What the mechanisms change where the document lists `own`.
    fn mechanism_changes(&self, own: &[MechanismEntry], whole: &Table) -> Vec<Change> {
        if !own.iter().all(|entry| self.mechanisms.iter().any(|kept| kept.name == entry.name)) {
            let entries = self.mechanisms.iter().map(|entry| Value::Table(pairs(entry).into_iter().collect())).collect();
            return vec![Change::Set(path(&["mechanism"]), Value::Array(entries))];
        }
        let mut changes = Vec::new();
        for entry in &self.mechanisms {
            let Some(index) = own.iter().position(|other| other.name == entry.name) else {
                changes.push(Change::Append("mechanism", pairs(entry)));
                continue;
            };
            let number = index.to_string();
            let changed = entry.parameters.iter().filter(|(key, quantity)| own[index].parameter(key) != Some(quantity));
            for (key, quantity) in changed {
                let keys = path(&["mechanism", &number, key]);
                // What is written as a table stays one.
                match whole["mechanism"].get(index).and_then(|entry| entry.get(key)) {
                    Some(Value::Table(_)) => changes.extend(
                        fields(quantity)
                            .into_iter()
                            .map(|(field, value)| Change::Set(keys.iter().cloned().chain([field]).collect(), value)),
                    ),
                    _ => changes.push(Change::Set(keys, number_of(quantity))),
                }
            }
        }
        changes
    }

    /// The paths from `folder` where the document names files from its own.
    fn path_changes(&self, whole: &Table, folder: &Path) -> Vec<Change> {
        let mut changes = Vec::new();
        let mut look = |table: &Value, before: &[&str], keys: &[&'static str]| {
            for key in keys.iter().filter(|key| before != ["execution"] || !self.superseded.contains(&["execution", key])) {
                let Some(named) = table.get(*key).and_then(Value::as_str) else { continue };
                if Path::new(named).is_relative() && (*key != "calendar" || names_a_file(named)) {
                    let to = path_from(folder, &self.document().resolve(named));
                    changes.push(Change::Set(path(&[before, &[*key]].concat()), Value::String(to)));
                }
            }
        };
        for (section, is_list, keys) in FILES {
            match whole.get(section) {
                Some(Value::Array(entries)) if is_list => {
                    for (number, entry) in entries.iter().enumerate() {
                        look(entry, &[section, &number.to_string()], keys);
                    }
                }
                Some(table) => look(table, &[section], keys),
                None => {}
            }
        }
        changes
    }
}

fn path(keys: &[&str]) -> Vec<String> {
    keys.iter().map(|key| (*key).to_owned()).collect()
}

/// The keys of a mechanism, its name first.
fn pairs(entry: &MechanismEntry) -> Vec<(String, Value)> {
    let parameters = entry.parameters.iter().map(|(key, quantity)| (key.clone(), number_of(quantity)));
    [("name".to_owned(), Value::String(entry.name.clone()))].into_iter().chain(parameters).collect()
}

/// A bare number where nothing more is known than that.
fn number_of(quantity: &Quantity) -> Value {
    if *quantity == Quantity::bare(quantity.value) {
        return Value::Float(quantity.value);
    }
    Value::Table(fields(quantity).into_iter().collect())
}

fn fields(quantity: &Quantity) -> Vec<(String, Value)> {
    let unit = quantity.unit.as_ref().map(|unit| ("unit".to_owned(), Value::String(unit.clone())));
    let number = |name: &str, value| (name.to_owned(), Value::Float(value));
    let fields = [Some(number("value", quantity.value)), unit, Some(number("uncertainty", quantity.uncertainty))];
    fields.into_iter().flatten().collect()
}
