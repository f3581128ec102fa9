//! A folder for the files of one test of a reader.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may stop where it fails")]

use std::fs;
use std::path::PathBuf;

use tempfile::TempDir;
use trueup::io::InputError;

/// A folder with the files of a test, which errors are shown without.
pub struct Scene(pub TempDir);

impl Scene {
    pub fn new() -> Self {
        Self(TempDir::new().unwrap())
    }

    pub fn with(self, name: &str, content: impl AsRef<[u8]>) -> Self {
        fs::write(self.path(name), content).unwrap();
        self
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn shown<T>(&self, result: Result<T, InputError>) -> String {
        let error = result.err().expect("an error").to_string();
        error.replace(&format!("{}/", self.0.path().display()), "").replace(&self.0.path().display().to_string(), "FOLDER")
    }
}
