//! Columns of a recording that its twin does not read.

use std::path::PathBuf;

use super::recording_name;
use crate::io::{TIME_COLUMN, Table, TwinFile};
use crate::sim2real::diagnose::Unread;

/// The columns of numbers, in the recordings at `paths`, that `twin` does not read: they may tell when it errs. What cannot be read has
/// none; whoever needs the recordings says why.
#[must_use]
pub fn unread_columns(twin: &TwinFile, paths: &[PathBuf]) -> Vec<Unread> {
    let sections = &twin.equations;
    let channels = twin.channels.values().map(|entry| &entry.column);
    let inputs = sections.inputs.iter().map(|(_, entry)| &entry.column);
    let outputs = sections.outputs.iter().map(|(_, entry)| &entry.column);
    let read: Vec<&String> = channels.chain(inputs).chain(outputs).collect();
    let mut unread = Vec::new();
    for path in paths {
        let Ok(table) = Table::read(path) else { continue };
        let Ok(time) = table.floats_complete(TIME_COLUMN) else { continue };
        let others = table.names().into_iter().filter(|name| *name != TIME_COLUMN && !read.iter().any(|own| own == name));
        // What is no number is nothing to set an error beside.
        unread.extend(others.filter_map(|name| {
            let values = table.floats(name).ok()?;
            Some(Unread {
                recording: recording_name(path),
                name: name.to_owned(),
                time: time.clone(),
                values: values.into_iter().map(|value| value.unwrap_or(f64::NAN)).collect(),
            })
        }));
    }
    unread
}
