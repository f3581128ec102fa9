//! Folders of tables.

use std::path::{Path, PathBuf};

use super::error::{InputError, listed};

/// The table named `stem` in `folder`, whatever its ending; none where there is none.
///
/// # Errors
/// A path that is no folder; several tables of that name.
pub fn table_in(folder: &Path, stem: &str) -> Result<Option<PathBuf>, InputError> {
    const ENDINGS: [&str; 6] = ["csv", "csv.gz", "parquet", "arrow", "ipc", "feather"];
    if !folder.is_dir() {
        let what = if folder.exists() { "expected a folder, found a file" } else { "there is no such folder" };
        return Err(InputError::new(folder, what).hint("name the folder the tables are in"));
    }
    let names = ENDINGS.map(|ending| format!("{stem}.{ending}"));
    let found: Vec<&String> = names.iter().filter(|name| folder.join(name).is_file()).collect();
    match found.as_slice() {
        [] => Ok(None),
        [name] => Ok(Some(folder.join(name))),
        several => Err(InputError::new(folder, format!("there are {}", listed(several))).hint("leave one of them there")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_one_table_of_a_name_is_found() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(table_in(folder.path(), "orders").unwrap(), None);
        let path = folder.path().join("orders.csv");
        std::fs::write(&path, "a\n1\n").unwrap();
        assert_eq!(table_in(folder.path(), "orders").unwrap(), Some(path.clone()));
        assert!(table_in(&path, "orders").unwrap_err().to_string().contains("expected a folder"));
        std::fs::write(folder.path().join("orders.parquet"), "").unwrap();
        assert!(table_in(folder.path(), "orders").unwrap_err().to_string().contains("`orders.csv` and `orders.parquet`"));
    }
}
