//! Documents with some of their values changed, and the rest kept to the letter: comments, order and spaces too.

use std::ops::Range;

use toml::de::{DeTable, DeValue};
use toml::{Table, Value};

use super::document::Document;
use super::error::InputError;
use super::toml_text::{float, key, section, text};

/// A change of a document.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Change {
    /// The value at these keys becomes another; where it is not there it is added to its table. Entries of lists go by number.
    Set(Vec<String>, Value),
    /// The key goes.
    Remove(Vec<String>),
    /// A list gets another entry, with these keys in their order.
    Append(&'static str, Vec<(String, Value)>),
    /// A section that is not there yet, with these keys in their order.
    Section(&'static str, Vec<(String, Value)>),
}

impl Document {
    /// The text with `changes`. Where a change cannot be made in the text as it is written (a list of inline tables that is to
    /// grow), the document is written anew: it says the same, without its comments.
    ///
    /// # Errors
    /// A document that is no TOML, and keys that lead nowhere.
    pub(super) fn changed(&self, changes: &[Change]) -> Result<String, InputError> {
        let mut meant: Table = self.parse()?;
        for change in changes {
            self.apply(change, &mut meant)?;
        }
        let edited = self.edited(changes).filter(|text| toml::from_str::<Table>(text).is_ok_and(|table| table == meant));
        edited.map_or_else(|| toml::to_string(&meant).map_err(|error| self.error(&[], error.to_string())), Ok)
    }

    /// Makes `change` in what the document says.
    fn apply(&self, change: &Change, table: &mut Table) -> Result<(), InputError> {
        let keys = match change {
            Change::Set(keys, _) | Change::Remove(keys) => keys,
            Change::Section(name, pairs) => {
                table.insert((*name).to_owned(), Value::Table(pairs.iter().cloned().collect()));
                return Ok(());
            }
            Change::Append(list, entry) => {
                let entries = table.entry(*list).or_insert_with(|| Value::Array(Vec::new()));
                let entries = entries.as_array_mut().ok_or_else(|| self.error(&[list], "expected a list of tables"))?;
                entries.push(Value::Table(entry.iter().cloned().collect()));
                return Ok(());
            }
        };
        let names: Vec<&str> = keys.iter().map(String::as_str).collect();
        let nowhere = || self.error(&names, "leads to nothing that can be changed");
        let (last, before) = keys.split_last().ok_or_else(nowhere)?;
        let step = |value: &mut Option<&mut Value>, key: &String| {
            *value = match value.take() {
                Some(Value::Table(table)) => table.get_mut(key),
                Some(Value::Array(entries)) => key.parse().ok().and_then(|k: usize| entries.get_mut(k)),
                _ => None,
            };
        };
        let Some((first, rest)) = before.split_first() else {
            match change {
                Change::Set(_, value) => drop(table.insert(last.clone(), value.clone())),
                _ => drop(table.remove(last)),
            }
            return Ok(());
        };
        let mut place = table.get_mut(first);
        rest.iter().for_each(|key| step(&mut place, key));
        let holder = place.and_then(Value::as_table_mut).ok_or_else(nowhere)?;
        match change {
            Change::Set(_, value) => drop(holder.insert(last.clone(), value.clone())),
            _ => drop(holder.remove(last)),
        }
        Ok(())
    }

    /// Makes the changes in the text, as far as it is written in a way in which they can be made.
    fn edited(&self, changes: &[Change]) -> Option<String> {
        let root = DeTable::parse(self.text()).ok()?;
        let mut edits: Vec<(Range<usize>, String)> = Vec::new();
        let mut added = String::new();
        for change in changes {
            match change {
                Change::Append(list, entry) => {
                    let keys = entry.iter().map(|(name, value)| (name.as_str(), Some(written(value))));
                    section(&mut added, &format!("[[{list}]]"), keys);
                    continue;
                }
                Change::Section(name, pairs) => {
                    let keys = pairs.iter().map(|(name, value)| (name.as_str(), Some(written(value))));
                    section(&mut added, &format!("[{name}]"), keys);
                    continue;
                }
                Change::Set(keys, value) => edits.push(self.set(root.get_ref(), keys, value)?),
                Change::Remove(keys) => edits.push(self.without(root.get_ref(), keys)?),
            }
        }
        edits.sort_by_key(|(range, _)| range.start);
        let mut out = self.text().to_owned();
        for (range, new) in edits.into_iter().rev() {
            out.replace_range(range, &new);
        }
        if !added.is_empty() {
            out.truncate(out.trim_end().len());
            out.push_str("\n\n");
            out.push_str(&added);
        }
        Some(out)
    }

    /// The edit that gives the key a value.
    fn set(&self, root: &DeTable<'_>, keys: &[String], value: &Value) -> Option<(Range<usize>, String)> {
        let (last, before) = keys.split_last()?;
        let holder = holder(root, before)?;
        if let Some((_, old)) = holder.iter().find(|(name, _)| name.get_ref() == last) {
            return Some((old.span(), written(value)));
        }
        // Behind the last key that has its value beside it.
        let within = |value: &DeValue<'_>, at: usize| match value {
            DeValue::Table(_) => self.text()[at..].starts_with('{'),
            DeValue::Array(_) => self.text()[at..].starts_with('[') && !self.text()[at..].starts_with("[["),
            _ => true,
        };
        let values = holder.iter().map(|(_, value)| value).filter(|value| within(value.get_ref(), value.span().start));
        let end = values.map(|value| value.span().end).max()?;
        let line_end = self.text()[end..].find('\n').map_or(self.text().len(), |newline| end + newline);
        let rest = self.text()[end..line_end].trim();
        let pair = format!("{} = {}", key(last), written(value));
        // What follows on the line is a comment, or it is an inline table that goes on.
        if rest.is_empty() || rest.starts_with('#') {
            return Some((line_end..line_end, format!("\n{pair}")));
        }
        Some((end..end, format!(", {pair}")))
    }

    /// The edit that takes the line of a key away.
    fn without(&self, root: &DeTable<'_>, keys: &[String]) -> Option<(Range<usize>, String)> {
        let (last, before) = keys.split_last()?;
        let (name, value) = holder(root, before)?.iter().find(|(name, _)| name.get_ref() == last)?;
        let start = self.text()[..name.span().start].rfind('\n').map_or(0, |newline| newline + 1);
        let end = value.span().end;
        let end = self.text()[end..].find('\n').map_or(self.text().len(), |newline| end + newline + 1);
        Some((start..end, String::new()))
    }
}

/// The table at `keys`.
fn holder<'t, 'd>(root: &'t DeTable<'d>, keys: &[String]) -> Option<&'t DeTable<'d>> {
    let (first, rest) = keys.split_first()?;
    let of = |table: &'t DeTable<'d>, key: &String| {
        table.iter().find(|(name, _)| name.get_ref() == key).map(|(_, value)| value.get_ref())
    };
    let mut here = of(root, first)?;
    for key in rest {
        here = match here {
            DeValue::Table(table) => of(table, key)?,
            DeValue::Array(entries) => entries.get(key.parse::<usize>().ok()?)?.get_ref(),
            _ => return None,
        };
    }
    match here {
        DeValue::Table(table) => Some(table),
        _ => None,
    }
}

/// A value as it stands behind `=`.
fn written(value: &Value) -> String {
    let pairs = |table: &Table| {
        let mut entries: Vec<(&String, &Value)> = table.iter().collect();
        // A value comes before what is said of it.
        entries.sort_by_key(|(name, _)| std::cmp::Reverse(name.as_str()));
        let pairs: Vec<String> = entries.iter().map(|(name, value)| format!("{} = {}", key(name), written(value))).collect();
        format!("{{ {} }}", pairs.join(", "))
    };
    match value {
        Value::String(words) => text(words),
        Value::Float(number) => float(*number),
        Value::Array(values) => format!("[{}]", values.iter().map(written).collect::<Vec<_>>().join(", ")),
        Value::Table(table) => pairs(table),
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keys(path: &str) -> Vec<String> {
        path.split('.').map(str::to_owned).collect()
    }

    fn changed(text: &str, changes: &[Change]) -> String {
        let out = Document::from_text("run.toml", text).changed(changes).unwrap();
        let read: Table = toml::from_str(&out).unwrap();
        for change in changes {
            if let Change::Set(keys, value) = change {
                let found = keys[1..].iter().try_fold(&read[&keys[0]], |at, key| match at {
                    Value::Array(entries) => entries.get(key.parse::<usize>().unwrap()),
                    at => at.get(key),
                });
                assert_eq!(found, Some(value), "{out}");
            }
        }
        out
    }

    const RUN: &str = "# A run.\n[run]\nseed = 7 # as ever\n\n[[mechanism]] # dear\nname = \"half_spread\"\nbps = 1.0   # a guess\n\n\
                       [latency]\norder = 0.1\nfeed = 0.0\n";

    #[test]
    fn what_does_not_change_is_kept_to_the_letter() {
        let fitted = Value::Table([("value".to_owned(), Value::Float(1.25))].into_iter().collect());
        let changes = [
            Change::Set(keys("mechanism.0.bps"), fitted),
            Change::Set(keys("run.price"), Value::String("touch".to_owned())),
            Change::Remove(keys("latency.order")),
            Change::Append("mechanism", vec![("name".to_owned(), Value::String("commission".to_owned()))]),
        ];
        insta::assert_snapshot!(changed(RUN, &changes), @r#"
        # A run.
        [run]
        seed = 7 # as ever
        price = "touch"

        [[mechanism]] # dear
        name = "half_spread"
        bps = { value = 1.25 }   # a guess

        [latency]
        feed = 0.0

        [[mechanism]]
        name = "commission"
        "#);
        assert_eq!(changed(RUN, &[]), RUN);
    }

    #[test]
    fn inline_tables_grow_and_what_cannot_be_edited_is_written_anew() {
        let inline = "run = { seed = 7 } # so\n";
        assert_eq!(
            changed(inline, &[Change::Set(keys("run.cash"), Value::Float(1.0))]),
            "run = { seed = 7, cash = 1.0 } # so\n"
        );
        let listed = "mechanism = [{ name = \"half_spread\" }] # one\n";
        let more = changed(listed, &[Change::Append("mechanism", vec![("name".to_owned(), Value::String("x".to_owned()))])]);
        assert_eq!(more.matches("name = ").count(), 2, "{more}");
        assert!(Document::from_text("run.toml", RUN).changed(&[Change::Set(keys("none.here"), Value::Float(1.0))]).is_err());
    }
}
