//! `[execution]` of RUN.toml: what is known of how its orders are executed.

use std::path::Path;

use serde::Deserialize;

use super::document::Document;
use super::error::InputError;
use super::feed_format::check_file;
use super::twin_file::TwinFile;

/// `[execution]`.
#[derive(Debug, Clone, PartialEq, Eq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ExecutionSection {
    /// The twin whose mechanisms and commission stand between decision and fill too, as the document names its file.
    pub twin: Option<String>,
}

#[derive(Deserialize)]
struct OnlyExecution {
    #[serde(default)]
    execution: ExecutionSection,
}

impl ExecutionSection {
    /// Reads the twin that the section, which is one of `document`, brings.
    ///
    /// # Errors
    /// A file that is not there; one of another model, or that brings a twin itself; and what [`TwinFile::read`] refuses.
    pub(super) fn read_twin(&self, document: &Document) -> Result<Option<TwinFile>, InputError> {
        let Some(named) = &self.twin else { return Ok(None) };
        let keys = ["execution", "twin"];
        check_file(document, &keys, named)?;
        let twin = Document::read(document.resolve(Path::new(named)))?;
        // Before all of it is read: it may well name the file it stands in.
        if twin.parse::<OnlyExecution>()?.execution.twin.is_some() {
            let error = document.error(&keys, format!("{named} brings a twin itself"));
            return Err(error.hint("name the file in which the [[mechanism]] sections stand"));
        }
        let twin = TwinFile::parse(twin)?;
        if twin.model != "execution" {
            let error = document.error(&keys, format!("{named} is a twin of the model `{}`", twin.model));
            return Err(error.hint("orders meet the mechanisms of a twin of the model `execution`"));
        }
        Ok(Some(twin))
    }
}
