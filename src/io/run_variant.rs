//! A run with other values at some of its keys.

use toml::{Table, Value};

use super::document::Document;
use super::error::{InputError, hint_among};
use super::run_file::RunFile;
use super::sweep_section::SweepSection;

/// What a range can be of: the data are read once.
const ROOTS: [&str; 4] = ["strategy", "mechanism", "run", "instrument"];
/// Keys of `[run]` that a range can be of.
const RUN_KEYS: [&str; 4] = ["seed", "cash", "max_leverage", "price"];

/// Values by path, as one run of a sweep has them.
pub type SweepValues = [(String, Value)];

impl RunFile {
    /// The same run with other `values`, and without its `[sweep]`. Where these set the strategy's `kind`, keys that
    /// `belongs` (kind, key) says it has not are left out.
    ///
    /// # Errors
    /// Paths that lead nowhere, and what [`RunFile::read`] refuses: at the range the value comes from.
    pub fn with_values(&self, values: &SweepValues, belongs: &dyn Fn(&str, &str) -> bool) -> Result<Self, InputError> {
        let mut table: Table = self.document().parse()?;
        table.remove("sweep");
        for (path, value) in values {
            *self.slot(&mut table, path)? = value.clone();
        }
        let kind = values.iter().find(|(path, _)| path == "strategy.kind").and_then(|(_, value)| value.as_str());
        if let (Some(kind), Some(Value::Table(strategy))) = (kind, table.get_mut("strategy")) {
            strategy.retain(|key, _| key == "kind" || belongs(kind, key));
        }
        // A table that was read can be written.
        let text = toml::to_string(&table).map_err(|error| self.error(&["sweep"], error.to_string()))?;
        let run = Self::parse(Document::from_text(self.document().path(), text));
        let mut run = run.map_err(|error| self.blamed(values, error))?;
        run.data.clone_from(&self.data);
        run.rates.clone_from(&self.rates);
        run.twin.clone_from(&self.twin);
        Ok(run)
    }

    /// `error`, which a run with `values` was refused for, at the range it comes from.
    #[must_use]
    pub fn blamed(&self, values: &SweepValues, error: InputError) -> InputError {
        let named = |path: &str| path.rsplit('.').next().is_some_and(|key| error.message.contains(key));
        let Some(sweep) = &self.sweep else { return error };
        let tried: Vec<String> = values.iter().map(|(path, value)| format!("{path} = {value}")).collect();
        let range = sweep.ranges.iter().find(|range| named(&range.path));
        let message = format!("{} (with {})", error.message, tried.join(", "));
        let mut blamed = match range.or(sweep.ranges.first().filter(|_| sweep.ranges.len() == 1)) {
            Some(range) => range.error(self.document(), message),
            None => self.error(&["sweep", "ranges"], message),
        };
        (blamed.found, blamed.hint) = (error.found, error.hint);
        if blamed.hint.is_none() {
            blamed = blamed.hint("correct the range, or the key it is of");
        }
        blamed
    }

    /// Holds every range to lead to a key that can be swept over.
    pub(super) fn check_sweep(&self, sweep: &SweepSection) -> Result<(), InputError> {
        let mut table: Table = self.document().parse()?;
        sweep.ranges.iter().try_for_each(|range| self.slot(&mut table, &range.path).map(|_| ()))
    }

    /// The place of the value at `path`.
    fn slot<'t>(&self, table: &'t mut Table, path: &str) -> Result<&'t mut Value, InputError> {
        let refuse = |message: String, hint: Option<String>| {
            let sweep = self.sweep.as_ref();
            let range = sweep.and_then(|sweep| sweep.ranges.iter().find(|range| range.path == path));
            let error = match range {
                Some(range) => range.error(self.document(), message),
                None => self.error(&["sweep", "ranges"], message),
            };
            error.maybe_hint(hint)
        };
        let (root, rest) = path.split_once('.').unwrap_or((path, ""));
        let (name, key) = rest.rsplit_once('.').unwrap_or(("", rest));
        let shape = match root {
            "strategy" | "run" => name.is_empty() && !key.is_empty(),
            "mechanism" | "instrument" => !name.is_empty() && !key.is_empty(),
            "data" => {
                return Err(refuse(
                    "the data cannot be swept over: they are read once".to_owned(),
                    Some("make a run of its own for other data".to_owned()),
                ));
            }
            _ => return Err(refuse(format!("`{path}` leads to nothing that can be swept over"), hint_among(root, &ROOTS))),
        };
        if !shape {
            let hint = "paths are strategy.KEY, run.KEY, mechanism.NAME.KEY and instrument.SYMBOL.KEY";
            return Err(refuse(format!("`{path}` is no path of a value"), Some(hint.to_owned())));
        }
        if root == "run" && !RUN_KEYS.contains(&key) {
            return Err(refuse(format!("`{path}` cannot be swept over"), hint_among(key, &RUN_KEYS)));
        }
        if name.is_empty() {
            let section = table.get_mut(root).and_then(Value::as_table_mut);
            let section = section.ok_or_else(|| refuse(format!("there is no section [{root}]"), None))?;
            return Ok(section.entry(key).or_insert(Value::Boolean(false)));
        }
        let label = if root == "mechanism" { "name" } else { "symbol" };
        let entries = table.get_mut(root).and_then(Value::as_array_mut).map(Vec::as_mut_slice).unwrap_or_default();
        let known: Vec<String> = entries.iter().filter_map(|entry| entry.get(label)?.as_str().map(str::to_owned)).collect();
        let entry = entries
            .iter_mut()
            .filter_map(Value::as_table_mut)
            .find(|entry| entry.get(label).and_then(Value::as_str) == Some(name));
        let Some(entry) = entry else {
            let none = format!("add a [[{root}]] with {label} = \"{name}\" to the run");
            let hint = hint_among(name, &known).filter(|hint| hint.starts_with("did you")).unwrap_or(none);
            return Err(refuse(format!("the run has no [[{root}]] `{name}`"), Some(hint)));
        };
        let slot = entry.entry(key).or_insert(Value::Boolean(false));
        // A quantity keeps its unit. Asked for twice, because a borrow that is returned on one way only is not given back.
        if slot.get("value").is_some() {
            return Ok(&mut slot["value"]);
        }
        Ok(slot)
    }
}
