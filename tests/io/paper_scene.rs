//! Logs to import: small ones written by hand, and a folder to put them into.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use std::fs;
use std::path::{Path, PathBuf};

use rusqlite::Connection;
use tempfile::TempDir;
use trueup::io::InputError;
use trueup::market::paper::import::{ImportSettings, import};
use trueup::market::paper::{FindingKind, PaperLog};

/// A sample, by its name.
pub fn sample(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/io/paper_samples").join(name)
}

/// A log recorded elsewhere; none where it is not on this machine.
pub fn recorded(name: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/market/logs").join(name);
    if path.exists() {
        return Some(path);
    }
    println!("skipped: there is no {}", path.display());
    None
}

/// Settings with a zone.
pub fn new_york() -> ImportSettings {
    ImportSettings { zone: Some(chrono_tz::Tz::America__New_York), ..ImportSettings::default() }
}

/// The log in these files, without settings.
pub fn read(paths: &[PathBuf]) -> PaperLog {
    import(paths, &ImportSettings::default()).map_err(|error| error.to_string()).unwrap()
}

/// How often each kind of finding was found.
pub fn counts(log: &PaperLog) -> Vec<(FindingKind, usize)> {
    log.findings.summaries().iter().map(|summary| (summary.kind, summary.count)).collect()
}

/// A folder with one log in it.
pub struct Written(pub TempDir);

impl Written {
    pub fn new(name: &str, bytes: impl AsRef<[u8]>) -> Self {
        let folder = TempDir::new().unwrap();
        fs::write(folder.path().join(name), bytes).unwrap();
        Self(folder)
    }

    /// The database that `script` makes.
    pub fn database(name: &str, script: &str) -> Self {
        let folder = TempDir::new().unwrap();
        Connection::open(folder.path().join(name)).unwrap().execute_batch(script).unwrap();
        Self(folder)
    }

    pub fn and(self, name: &str, bytes: impl AsRef<[u8]>) -> Self {
        fs::write(self.0.path().join(name), bytes).unwrap();
        self
    }

    pub fn path(&self) -> PathBuf {
        self.0.path().to_path_buf()
    }

    pub fn import(&self, settings: &ImportSettings) -> Result<PaperLog, InputError> {
        import(&[self.path()], settings)
    }

    /// The error of an import, without the path of the folder.
    pub fn error(&self, settings: &ImportSettings) -> String {
        self.import(settings).unwrap_err().to_string().replace(&format!("{}/", self.path().display()), "")
    }

    /// The rows that could not be read, without the path of the folder.
    pub fn unread(&self) -> Vec<String> {
        let log = self.import(&ImportSettings::default()).unwrap();
        let unread = log.findings.of(FindingKind::UnreadRow).iter();
        unread.map(|finding| finding.to_string().replace(&format!("{}/", self.path().display()), "")).collect()
    }
}
