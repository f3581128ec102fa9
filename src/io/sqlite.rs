//! SQLite databases as records, read from a copy: nothing is ever written beside the user's file, and no lock is taken on it.

use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use rusqlite::types::ValueRef;
use rusqlite::{Connection, OpenFlags};
use tempfile::TempDir;

use super::error::InputError;
use super::records::Records;
use super::source::open;

/// How every SQLite file begins.
pub(super) const MAGIC: &[u8] = b"SQLite format 3\0";

/// What stands beside a database that is, or was, being written: its write-ahead log, or the journal by which a transaction that
/// was cut short is undone.
const BESIDE: [&str; 2] = ["-wal", "-journal"];

/// The tables of a database: those that were asked for, and the names of all.
#[derive(Debug, Clone)]
pub struct Database {
    /// The tables that were asked for and are there.
    pub tables: Vec<Records>,
    /// The names of all tables.
    pub names: Vec<String>,
}

/// Reads the tables of `path` whose names are among `wanted`, in any case. What its write-ahead log holds is read with it; the
/// log of a bot that still writes may be cut off, of which everything up to the last whole transaction is read.
///
/// # Errors
/// A file that is missing, no SQLite database, encrypted or damaged; a folder for the copy that cannot be made.
pub fn read_sqlite(path: impl AsRef<Path>, wanted: &[&str]) -> Result<Database, InputError> {
    let path = path.as_ref();
    let copy = copied(path)?;
    let read = || -> Result<Database, rusqlite::Error> {
        let flags = OpenFlags::SQLITE_OPEN_READ_WRITE | OpenFlags::SQLITE_OPEN_NO_MUTEX;
        let database = Connection::open_with_flags(copy.path().join(NAME), flags)?;
        let names = names(&database)?;
        let is_wanted = |name: &&String| wanted.iter().any(|wanted| name.eq_ignore_ascii_case(wanted));
        let tables = names.iter().filter(is_wanted).map(|name| table(&database, path, name)).collect::<Result<_, _>>()?;
        Ok(Database { tables, names })
    };
    let refused = |reason: &str| {
        let hint = "is it a whole SQLite database? Copy it with its `-wal` file, or let the bot end first";
        InputError::new(path, format!("expected an SQLite database ({reason})")).hint(hint)
    };
    // The library panics on names of columns that are no UTF-8, and a damaged log must not take the process with it.
    match catch_unwind(AssertUnwindSafe(read)) {
        Ok(result) => result.map_err(|error| refused(&error.to_string())),
        Err(_) => Err(refused("its contents contradict each other")),
    }
}

const NAME: &str = "copy";

/// How often a copy is made anew because the database changed meanwhile.
const TRIES: usize = 5;

/// The database and what stands beside it in a folder of their own.
///
/// A copy that is made while pages go from the log into the database may have old and new ones: it counts only where neither
/// file changed meanwhile.
fn copied(path: &Path) -> Result<TempDir, InputError> {
    // It exists, and is no folder.
    drop(open(path)?);
    let failed = |error: &std::io::Error| InputError::new(path, format!("cannot be copied to be read ({error})"));
    for _ in 0..TRIES {
        let before = state(path);
        let folder = tempfile::tempdir().map_err(|error| failed(&error))?;
        for (from, ending) in parts(path).filter(|(from, _)| from.is_file()) {
            copy_part(&from, &folder.path().join(format!("{NAME}{ending}"))).map_err(|error| failed(&error))?;
        }
        if state(path) == before {
            return Ok(folder);
        }
    }
    let error = InputError::new(path, "the database changes while it is copied to be read");
    Err(error.hint("let the bot pause, or copy it with `sqlite3 FILE \".backup copy.sqlite\"` and read that"))
}

/// The database, and the files that may stand beside it: their paths, and what these end with.
fn parts(path: &Path) -> impl Iterator<Item = (PathBuf, &'static str)> {
    [""].into_iter().chain(BESIDE).map(|ending| {
        let mut part = path.as_os_str().to_owned();
        part.push(ending);
        (PathBuf::from(part), ending)
    })
}

/// Length of each part [bytes], and when it changed; none of one that is not there.
fn state(path: &Path) -> impl PartialEq + use<> {
    let part = |(part, _)| fs::metadata(part).ok().map(|about| (about.len(), about.modified().ok()));
    parts(path).map(part).collect::<Vec<_>>()
}

/// Copies one of them. The copy of a read-only file may be written, for a log is read by taking it into the database.
fn copy_part(part: &Path, copy: &Path) -> std::io::Result<()> {
    fs::copy(part, copy)?;
    let mut rights = fs::metadata(copy)?.permissions();
    #[expect(clippy::permissions_set_readonly_false, reason = "the file is a copy in a folder of our own")]
    rights.set_readonly(false);
    fs::set_permissions(copy, rights)
}

fn names(database: &Connection) -> Result<Vec<String>, rusqlite::Error> {
    // A virtual table or a view runs what its author wrote.
    let text = "SELECT name FROM sqlite_master WHERE type = 'table' AND name NOT LIKE 'sqlite_%' \
                AND sql NOT LIKE 'CREATE VIRTUAL%' ORDER BY name";
    database.prepare(text)?.query_map([], |row| row.get(0))?.collect()
}

fn table(database: &Connection, path: &Path, name: &str) -> Result<Records, rusqlite::Error> {
    let mut statement = database.prepare(&format!("SELECT * FROM \"{}\"", name.replace('"', "\"\"")))?;
    let columns: Vec<String> = statement.column_names().map(str::to_owned).collect();
    let mut records = Records::new(path, Some(name));
    columns.iter().for_each(|column| records.declare(column));
    let mut rows = statement.query([])?;
    let mut number = 0;
    while let Some(row) = rows.next()? {
        number += 1;
        let mut cells = Vec::with_capacity(columns.len());
        for (k, column) in columns.iter().enumerate() {
            if let Some(text) = cell(row.get_ref(k)?) {
                cells.push((column.as_str(), text));
            }
        }
        records.push(number, cells);
    }
    Ok(records)
}

/// A value as a text: a binary number by the shortest digits that are the same bits, with a point or an exponent even where it
/// is whole, for some bots write integers where they mean millionths.
fn cell(value: ValueRef<'_>) -> Option<String> {
    match value {
        ValueRef::Null | ValueRef::Blob(_) => None,
        ValueRef::Integer(value) => Some(value.to_string()),
        ValueRef::Real(value) => Some(format!("{value:?}")),
        ValueRef::Text(bytes) => Some(String::from_utf8_lossy(bytes).into_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_database_is_read_with_its_write_ahead_log_and_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.sqlite");
        let bot = Connection::open(&path).unwrap();
        bot.pragma_update(None, "journal_mode", "WAL").unwrap();
        bot.pragma_update(None, "wal_autocheckpoint", 0).unwrap();
        bot.execute_batch("CREATE TABLE orders (id INTEGER, price REAL, word TEXT); CREATE TABLE other (x);").unwrap();
        bot.execute_batch("INSERT INTO orders VALUES (1, 4.217e-05, 'a'), (2, NULL, 'b');").unwrap();
        let state = || {
            let mut files: Vec<_> = fs::read_dir(folder.path())
                .unwrap()
                .map(|entry| entry.unwrap().path())
                .map(|path| (path.clone(), fs::read(path).unwrap()))
                .collect();
            files.sort();
            files
        };
        let before = state();
        assert!(before.iter().any(|(path, bytes)| path.ends_with("a.sqlite-wal") && !bytes.is_empty()));
        let database = read_sqlite(&path, &["ORDERS"]).unwrap();
        assert_eq!(state(), before);
        assert_eq!(database.names, ["orders", "other"]);
        let rows: Vec<_> = database.tables[0].iter().map(|r| (r.row(), r.get("price"), r.get("word"))).collect();
        assert_eq!(rows, [(1, Some("4.217e-5"), Some("a")), (2, None, Some("b"))]);
        // Without its log nothing is there yet.
        let alone = folder.path().join("alone.sqlite");
        fs::copy(&path, &alone).unwrap();
        assert!(read_sqlite(&alone, &["orders"]).unwrap().tables.is_empty());
    }

    #[test]
    fn what_is_no_database_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.sqlite");
        for bytes in [b"abc".to_vec(), [MAGIC, &[7; 200]].concat()] {
            fs::write(&path, bytes).unwrap();
            let error = read_sqlite(&path, &["orders"]).unwrap_err().to_string();
            assert!(error.contains("expected an SQLite database") && error.contains("hint:"), "{error}");
        }
        assert!(read_sqlite(folder.path().join("none"), &["orders"]).is_err());
    }
}
