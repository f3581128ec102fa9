//! Output files that appear whole or not at all.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use tempfile::TempDir;

use super::error::InputError;
use super::growing_table::GrowingTable;
use super::output_table::OutputTable;

/// Whether files that exist already may be replaced.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Overwrite {
    /// Nothing is written over.
    Refuse,
    /// The user has asked for it.
    Force,
}

/// The output files of one command. They are written aside and appear together at [`finish`](Self::finish); without
/// it, nothing is left of them.
#[derive(Debug)]
pub struct OutputFolder {
    folder: PathBuf,
    overwrite: Overwrite,
    aside: TempDir,
    names: Vec<String>,
}

impl OutputFolder {
    /// Prepares to write into `folder`, which is made at [`finish`](Self::finish) where it does not exist.
    ///
    /// # Errors
    /// A file in the place of the folder; a place where nothing can be written.
    pub fn create(folder: impl AsRef<Path>, overwrite: Overwrite) -> Result<Self, InputError> {
        let folder = folder.as_ref();
        let here = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        if here.exists() && !here.is_dir() {
            return Err(InputError::new(here, "expected a folder, found a file").hint("name another output folder"));
        }
        // Aside, but on the same file system, so that a rename is all that is left to do.
        let place = here.ancestors().map(or_current).find(|part| part.is_dir()).unwrap_or(Path::new("."));
        let aside = tempfile::Builder::new().prefix(".unfinished-").tempdir_in(place);
        let aside = aside.map_err(|error| InputError::new(place, format!("cannot be written into ({error})")))?;
        for inner in [NEW, OLD] {
            fs::create_dir(aside.path().join(inner)).map_err(|error| failed(here, &error))?;
        }
        Ok(Self { folder: here.to_path_buf(), overwrite, aside, names: Vec::new() })
    }

    /// Refuses now what would be refused later: to be asked before long work.
    ///
    /// # Errors
    /// A file of one of these names that exists, unless writing over is forced.
    pub fn check_free(&self, names: &[&str]) -> Result<(), InputError> {
        names.iter().try_for_each(|name| self.check_name(name))
    }

    /// Adds a file.
    ///
    /// # Errors
    /// A file of that name that exists, unless writing over is forced; a disk that is full.
    pub fn file(&mut self, name: &str, bytes: &[u8]) -> Result<(), InputError> {
        self.check_name(name)?;
        let write = || {
            let mut file = fs::File::create(self.aside.path().join(NEW).join(name))?;
            file.write_all(bytes)?;
            file.sync_all()
        };
        write().map_err(|error| failed(&self.folder.join(name), &error))?;
        self.remember(name);
        Ok(())
    }

    fn remember(&mut self, name: &str) {
        if !self.names.iter().any(|earlier| earlier == name) {
            self.names.push(name.to_owned());
        }
    }

    /// Adds a Parquet file that is written some rows at a time, with the columns of `like`.
    ///
    /// # Errors
    /// As [`file`](Self::file).
    pub fn grow(&mut self, name: &str, like: &OutputTable) -> Result<GrowingTable, InputError> {
        self.check_name(name)?;
        let table = GrowingTable::create(&self.aside.path().join(NEW).join(name), self.folder.join(name), like)?;
        self.remember(name);
        Ok(table)
    }

    /// Adds a table, as CSV or Parquet by the ending of the name.
    ///
    /// # Errors
    /// As [`file`](Self::file) and [`OutputTable::bytes`].
    pub fn table(&mut self, name: &str, table: &OutputTable) -> Result<(), InputError> {
        self.file(name, &table.bytes(&self.folder.join(name))?)
    }

    /// Lets the files appear; gives their paths.
    ///
    /// # Errors
    /// A file that has appeared meanwhile, unless writing over is forced; a rename that fails. Then none of the files
    /// is there, and those they were to replace are there again.
    pub fn finish(self) -> Result<Vec<PathBuf>, InputError> {
        self.names.iter().try_for_each(|name| self.check_name(name))?;
        let paths: Vec<PathBuf> = self.names.iter().map(|name| self.folder.join(name)).collect();
        if !self.folder.exists() {
            let parent = self.folder.parent().map(or_current).unwrap_or(Path::new("."));
            let renamed = fs::create_dir_all(parent).and_then(|()| fs::rename(self.aside.path().join(NEW), &self.folder));
            return renamed.map(|()| paths).map_err(|error| failed(&self.folder, &error));
        }
        for (done, name) in self.names.iter().enumerate() {
            if let Err(error) = self.put(name) {
                self.names[..done].iter().for_each(|name| self.take_back(name));
                return Err(failed(&self.folder.join(name), &error));
            }
        }
        Ok(paths)
    }

    /// Renames one file into its place, the one it replaces into the folder aside; on failure both are where they were.
    fn put(&self, name: &str) -> std::io::Result<()> {
        let (new, old) = (self.aside.path().join(NEW).join(name), self.aside.path().join(OLD).join(name));
        let target = self.folder.join(name);
        let replaces = target.exists();
        if replaces {
            fs::rename(&target, &old)?;
        }
        fs::rename(&new, &target).inspect_err(|_| {
            if replaces {
                let _ = fs::rename(&old, &target);
            }
        })
    }

    /// Undoes [`put`](Self::put) as far as that can be done; its own failure has nobody left to be told.
    fn take_back(&self, name: &str) {
        let (target, old) = (self.folder.join(name), self.aside.path().join(OLD).join(name));
        let _ = if old.exists() { fs::rename(old, target) } else { fs::remove_file(target) };
    }

    fn check_name(&self, name: &str) -> Result<(), InputError> {
        let path = self.folder.join(name);
        if Path::new(name).file_name() != Some(name.as_ref()) {
            return Err(InputError::new(path, "expected the plain name of a file").found_text(name));
        }
        if path.is_dir() {
            return Err(InputError::new(path, "a folder is in the place of an output file"));
        }
        if self.overwrite == Overwrite::Refuse && path.exists() {
            return Err(InputError::new(path, "the file exists already, and nothing is written over unasked")
                .hint("name another output with --out, or allow it with --force"));
        }
        Ok(())
    }
}

/// Writes a single file, whole or not at all.
///
/// # Errors
/// As [`OutputFolder`].
pub fn write_file(path: impl AsRef<Path>, bytes: &[u8], overwrite: Overwrite) -> Result<(), InputError> {
    let path = path.as_ref();
    let Some(name) = path.file_name().and_then(|name| name.to_str()) else {
        return Err(InputError::new(path, "expected the name of a file"));
    };
    let mut folder = OutputFolder::create(path.parent().unwrap_or(Path::new("")), overwrite)?;
    folder.file(name, bytes)?;
    folder.finish().map(drop)
}

/// Writes a single table, as CSV or Parquet by its ending, whole or not at all.
///
/// # Errors
/// As [`OutputFolder`] and [`OutputTable::bytes`].
pub fn write_table(path: impl AsRef<Path>, table: &OutputTable, overwrite: Overwrite) -> Result<(), InputError> {
    write_file(path.as_ref(), &table.bytes(path.as_ref())?, overwrite)
}

const NEW: &str = "new";
const OLD: &str = "old";

fn or_current(path: &Path) -> &Path {
    if path.as_os_str().is_empty() { Path::new(".") } else { path }
}

fn failed(path: &Path, error: &std::io::Error) -> InputError {
    InputError::new(path, format!("cannot be written ({error})")).hint("is there room, and the right to write there?")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> =
            fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn files_appear_together_and_nothing_is_left_without_finish() {
        let root = TempDir::new().unwrap();
        for existing in [false, true] {
            let out = root.path().join(format!("a{existing}/out"));
            if existing {
                fs::create_dir_all(&out).unwrap();
            }
            let mut folder = OutputFolder::create(&out, Overwrite::Refuse).unwrap();
            folder.file("x.txt", b"x").unwrap();
            folder.file("y.txt", b"y").unwrap();
            assert!(!out.join("x.txt").exists());
            assert_eq!(folder.finish().unwrap(), [out.join("x.txt"), out.join("y.txt")]);
            assert_eq!(names(&out), ["x.txt", "y.txt"]);
        }
        let before = names(root.path());
        let mut folder = OutputFolder::create(root.path().join("b/out"), Overwrite::Refuse).unwrap();
        folder.file("x.txt", b"x").unwrap();
        drop(folder);
        assert_eq!(names(root.path()), before);
    }

    #[test]
    fn nothing_is_written_over_unless_forced() {
        let root = TempDir::new().unwrap();
        let path = root.path().join("x.txt");
        fs::write(&path, "old").unwrap();
        let folder = OutputFolder::create(root.path(), Overwrite::Refuse).unwrap();
        assert!(folder.check_free(&["y.txt"]).is_ok() && folder.check_free(&["y.txt", "x.txt"]).is_err());
        let refused = write_file(&path, b"new", Overwrite::Refuse).unwrap_err();
        assert_eq!(refused.hint.as_deref(), Some("name another output with --out, or allow it with --force"));
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        write_file(&path, b"new", Overwrite::Force).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "new");
        drop(folder);
        assert_eq!(names(root.path()), ["x.txt"]);
    }

    #[test]
    fn a_failure_half_way_puts_everything_back() {
        let root = TempDir::new().unwrap();
        fs::write(root.path().join("a.txt"), "old").unwrap();
        let mut folder = OutputFolder::create(root.path(), Overwrite::Force).unwrap();
        for name in ["a.txt", "b.txt", "c.txt"] {
            folder.file(name, b"new").unwrap();
        }
        fs::remove_file(folder.aside.path().join(NEW).join("c.txt")).unwrap();
        assert!(folder.finish().is_err());
        assert_eq!(names(root.path()), ["a.txt"]);
        assert_eq!(fs::read_to_string(root.path().join("a.txt")).unwrap(), "old");
    }

    #[test]
    fn a_file_is_no_folder_and_a_folder_no_file() {
        let root = TempDir::new().unwrap();
        fs::write(root.path().join("a.txt"), "old").unwrap();
        fs::create_dir(root.path().join("b")).unwrap();
        assert!(OutputFolder::create(root.path().join("a.txt"), Overwrite::Force).is_err());
        let mut folder = OutputFolder::create(root.path(), Overwrite::Force).unwrap();
        assert!(folder.file("b", b"x").is_err() && folder.file("../c", b"x").is_err() && folder.file("", b"x").is_err());
    }
}
