//! A file of records of whatever kind: what it is says its content, and of tables the ending of its name.

use std::io::Read;
use std::path::{Path, PathBuf};

use super::error::InputError;
use super::json::read_json;
use super::records::Records;
use super::source::{Ending, open, unreadable};
use super::sqlite::{MAGIC, read_sqlite};
use super::table::{Renames, Table};
use super::xml::read_xml;

/// What a file holds, as records.
#[derive(Debug, Clone, Default)]
pub struct RecordFile {
    /// The tables that were read: one, but of XML and of databases.
    pub tables: Vec<Records>,
    /// The tables of a database that were not asked for.
    pub passed_over: Vec<String>,
}

/// Reads a file: CSV, Parquet or Arrow by the ending of its name, SQLite, JSON or XML by how it begins. Of a database only the
/// tables in `wanted` are read.
///
/// # Errors
/// As those of the readers, and a file that is none of these.
pub fn read_records(path: &Path, wanted: &[&str]) -> Result<RecordFile, InputError> {
    let whole = |tables: Vec<Records>| RecordFile { tables, passed_over: Vec::new() };
    let mut beginning = Vec::new();
    open(path)?.take(512).read_to_end(&mut beginning).map_err(|error| unreadable(path, &error))?;
    if beginning.starts_with(MAGIC) {
        let database = read_sqlite(path, wanted)?;
        let read: Vec<Option<&str>> = database.tables.iter().map(Records::table).collect();
        let passed_over = database.names.iter().filter(|name| !read.contains(&Some(name.as_str()))).cloned().collect();
        return Ok(RecordFile { passed_over, tables: database.tables });
    }
    if let Err(no_table) = Ending::of(path) {
        let text = beginning.strip_prefix("\u{feff}".as_bytes()).unwrap_or(&beginning);
        return match text.iter().find(|byte| !byte.is_ascii_whitespace()) {
            Some(b'<') => read_xml(path).map(whole),
            Some(b'{' | b'[') => read_json(path).map(|records| whole(vec![records])),
            _ => {
                Err(no_table.hint("a log is a table (.csv, .csv.gz, .parquet, .arrow, .ipc, .feather), JSON, XML or SQLite"))
            }
        };
    }
    let table = Table::read_even_empty(path, &Renames::new())?;
    Ok(whole(vec![Records::of_table(&table)]))
}

/// The files in a folder that may hold records, by the endings of their names, in order of these.
///
/// # Errors
/// A folder that cannot be read.
pub fn record_files(folder: &Path) -> Result<Vec<PathBuf>, InputError> {
    const ENDINGS: [&str; 16] = [
        ".csv", ".csv.gz", ".parquet", ".arrow", ".ipc", ".feather", ".json", ".jsonl", ".ndjson", ".xml", ".sqlite",
        ".sqlite3", ".db", ".log", ".txt", ".flex",
    ];
    let entries = std::fs::read_dir(folder).map_err(|error| unreadable(folder, &error))?;
    let mut paths: Vec<PathBuf> = entries
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| {
            let name = path.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
            path.is_file() && ENDINGS.iter().any(|ending| name.ends_with(ending))
        })
        .collect();
    paths.sort();
    Ok(paths)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_file_is_says_its_content() {
        let folder = tempfile::tempdir().unwrap();
        let read = |name: &str, text: &str| {
            let path = folder.path().join(name);
            std::fs::write(&path, text).unwrap();
            read_records(&path, &[]).map(|file| file.tables.iter().map(Records::len).collect::<Vec<_>>())
        };
        assert_eq!(read("a.csv", "x\n1\n2\n"), Ok(vec![2]));
        assert_eq!(read("b.csv", "x,y\n"), Ok(vec![0]));
        assert_eq!(read("a.log", " [{\"x\": 1}]"), Ok(vec![1]));
        assert_eq!(read("a.json", "\u{feff}{\"x\": 1}\n{\"x\": 2}"), Ok(vec![2]));
        assert_eq!(read("a", "<R><T a=\"1\"/></R>"), Ok(vec![1]));
        let error = read("a.txt", "x 1").unwrap_err().to_string();
        assert!(error.contains("hint: a log is a table"), "{error}");
        assert_eq!(record_files(folder.path()).unwrap().len(), 5);
    }
}
