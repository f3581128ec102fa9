//! A folder of files in which the program is run.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use std::path::PathBuf;

use assert_cmd::Command;
use serde_json::Value;
use tempfile::TempDir;

pub struct Folder(TempDir);

impl Folder {
    /// A folder with files of these names and texts.
    pub fn with(files: &[(&str, &str)]) -> Self {
        let folder = Self(TempDir::new().unwrap());
        files.iter().for_each(|(name, text)| std::fs::write(folder.path(name), text).unwrap());
        folder
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn bytes(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap()
    }

    /// Exit code, standard output and standard error of the program.
    pub fn run(&self, arguments: &str) -> (i32, String, String) {
        let output = Command::new(assert_cmd::cargo::cargo_bin!("trueup"))
            .current_dir(self.0.path())
            .args(arguments.split_whitespace())
            .env_remove("RUST_BACKTRACE")
            .output()
            .unwrap();
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
        (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
    }

    /// What the program prints as JSON, having done what it was asked.
    pub fn json(&self, arguments: &str) -> Value {
        let (code, out, err) = self.run(&format!("{arguments} --json"));
        assert_eq!(code, 0, "{err}");
        serde_json::from_str(&out).unwrap()
    }

    /// What the program says of bad input, with a hint and nothing on standard output.
    pub fn refused(&self, arguments: &str) -> String {
        let (code, out, err) = self.run(arguments);
        assert_eq!((code, out.as_str()), (2, ""), "{err}");
        assert!(err.contains("\n  hint: "), "{err}");
        err
    }
}
