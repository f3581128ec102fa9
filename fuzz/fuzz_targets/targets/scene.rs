//! The folder that a target reads from.

use std::fs;
use std::path::{Path, PathBuf};

use tempfile::TempDir;

/// A folder with files, which goes with the process.
pub struct Scene(TempDir);

impl Scene {
    /// An empty one.
    pub fn new() -> Self {
        Self(tempfile::tempdir().expect("room for a folder"))
    }

    /// Writes a file; gives its path.
    pub fn write(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.path(name);
        fs::write(&path, bytes).expect("room for a file");
        path
    }

    /// As [`write`](Self::write), unless the file is there.
    pub fn once(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.path(name);
        if !path.exists() {
            fs::create_dir_all(path.parent().unwrap_or(Path::new("."))).expect("room for a folder");
            fs::write(&path, bytes).expect("room for a file");
        }
        path
    }

    /// The path of a file.
    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }
}

/// Shows an error, as the user would see it; gives the value where there is none.
pub fn shown<T, E: std::fmt::Display>(result: Result<T, E>) -> Option<T> {
    result.map_err(|error| error.to_string()).ok()
}
