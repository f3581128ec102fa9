//! Readers of logs: one file a format, a row each in [`FORMATS`].
//!
//! A reader is a pure function from records to a [`PaperLog`]; files are opened by `io` alone. What is wrong with a row makes a
//! finding and leaves the row out; what is wrong with a file stops the import.

mod alpaca;
mod binance;
mod ccxt;
mod cross_check;
mod draft;

mod freqtrade;
mod hftbacktest;
mod hummingbot;
mod ibkr_flex;
mod nautilus;
mod pair;
mod row;
mod settings;
mod stamp;
mod trueup;

use std::path::{Path, PathBuf};

use super::{FindingKind, PaperFinding, PaperLog, SourcePlace};
use crate::io::{InputError, Records, hint_among, read_records, record_files, table_in};
use draft::Draft;

pub use settings::{FeeRates, ImportSettings, NoRate, SymbolMap};

/// A kind of log.
pub struct Format {
    /// Its id, as `--format` takes it.
    pub id: &'static str,
    /// What it is.
    pub title: &'static str,
    /// By what it is recognized.
    pub known_by: &'static str,
    /// Whether a table is one of its.
    claims: fn(&Records) -> bool,
    /// Reads the tables that it claims.
    read: fn(&[&Records], &mut Draft<'_>) -> Result<(), InputError>,
    /// The tables of a database that it reads.
    tables: &'static [&'static str],
}

/// All formats, by their ids.
pub static FORMATS: [&Format; 9] = [
    &alpaca::FORMAT,
    &binance::FORMAT,
    &ccxt::FORMAT,
    &freqtrade::FORMAT,
    &hftbacktest::FORMAT,
    &hummingbot::FORMAT,
    &ibkr_flex::FORMAT,
    &nautilus::FORMAT,
    &trueup::FORMAT,
];

/// Why a row or a file is not read.
enum Stop {
    /// The row is left out.
    Row(Box<PaperFinding>),
    /// Nothing of the file can be read.
    File(InputError),
}

/// Reads the log in `paths`: files, or folders of which all files are read together.
///
/// # Errors
/// A file that cannot be read; a format that is not known, or that the content does not tell; a time without a zone where none is
/// given.
pub fn import(paths: &[PathBuf], settings: &ImportSettings) -> Result<PaperLog, InputError> {
    let mut source = Source::default();
    for path in paths {
        source.add(path)?;
    }
    let mut log = import_records(&source.tables, settings, paths.first().map_or(Path::new("."), PathBuf::as_path))?;
    source.passed_over.into_iter().for_each(|finding| log.findings.add(finding));
    Ok(log)
}

/// Reads the log that is in `tables`, which come from `path`.
///
/// # Errors
/// As [`import`], but for files.
pub fn import_records(tables: &[Records], settings: &ImportSettings, path: &Path) -> Result<PaperLog, InputError> {
    let format = format_of(tables, settings, path)?;
    let (claimed, others): (Vec<&Records>, Vec<&Records>) = tables.iter().partition(|table| (format.claims)(table));
    let mut draft = Draft::new(format.id, settings);
    for table in others.iter().filter(|table| !(table.is_empty() && table.unread().is_empty())) {
        let place = SourcePlace { table: table.name(), ..SourcePlace::default() };
        let message = format!("{} rows that are no orders or fills of {}", table.len(), format.id);
        draft.log.findings.add(PaperFinding::at(FindingKind::PassedOver, place, message));
    }
    (format.read)(&claimed, &mut draft)?;
    Ok(cross_check::finished(draft.log, settings))
}

/// The format that is asked for, or else the one that claims any of the tables.
fn format_of(tables: &[Records], settings: &ImportSettings, path: &Path) -> Result<&'static Format, InputError> {
    let claims = |format: &&&Format| tables.iter().any(|table| (format.claims)(table));
    if let Some(id) = &settings.format {
        let ids = FORMATS.map(|format| format.id);
        let Some(format) = FORMATS.iter().find(|format| format.id == id) else {
            return Err(InputError::new(path, format!("there is no format `{id}`")).maybe_hint(hint_among(id, &ids)));
        };
        return match claims(&format) {
            true => Ok(format),
            false => Err(InputError::new(path, format!("this is no log of {id}"))
                .found(found(tables))
                .hint(format!("{id} is {}; known by {}", format.title, format.known_by))),
        };
    }
    let claiming: Vec<&&Format> = FORMATS.iter().filter(claims).collect();
    match claiming.as_slice() {
        [format] => Ok(format),
        [] => Err(InputError::new(path, "the log is of no format that is known").found(found(tables)).hint(looked_for())),
        several => {
            let claims: Vec<String> = several.iter().map(|format| claim(format, tables)).collect();
            let message = format!("the log is of several formats: {}", claims.join("; "));
            Err(InputError::new(path, message).hint("name the files of one log, or its format with --format"))
        }
    }
}

fn claim(format: &Format, tables: &[Records]) -> String {
    let claimed = tables.iter().filter(|table| (format.claims)(table));
    format!("{} ({})", format.id, claimed.map(Records::name).collect::<Vec<_>>().join(", "))
}

/// What is there, in a line.
fn found(tables: &[Records]) -> String {
    const SHOWN: usize = 3;
    let of = |table: &Records| {
        let keys: Vec<&str> = table.keys().iter().take(8).map(String::as_str).collect();
        format!("{} with the keys {}", table.name(), keys.join(", "))
    };
    let mut shown: Vec<String> = tables.iter().take(SHOWN).map(of).collect();
    if tables.len() > SHOWN {
        shown.push(format!("{} more", tables.len() - SHOWN));
    }
    if shown.is_empty() { "no tables".to_owned() } else { shown.join("; ") }
}

fn looked_for() -> String {
    let each = FORMATS.iter().map(|format| format!("{} by {}", format.id, format.known_by));
    format!("looked for: {}", each.collect::<Vec<_>>().join("; "))
}

/// What is read, and what is not.
#[derive(Default)]
struct Source {
    tables: Vec<Records>,
    passed_over: Vec<PaperFinding>,
}

impl Source {
    fn add(&mut self, path: &Path) -> Result<(), InputError> {
        if !path.is_dir() {
            return self.add_file(path);
        }
        // A log in the form of this program may have its whole market beside it.
        if let (Some(orders), Some(fills)) = (table_in(path, "orders")?, table_in(path, "fills")?) {
            self.add_file(&orders)?;
            return self.add_file(&fills);
        }
        let files = record_files(path)?;
        if files.is_empty() {
            let error = InputError::new(path, "there is no file in the folder that may be a log");
            return Err(error.hint("logs are .csv, .parquet, .json, .jsonl, .xml, .sqlite or .db"));
        }
        for file in files {
            let name = file.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
            if ["quotes", "bars", "candles", "book", "depth"].iter().any(|market| name.starts_with(market)) {
                self.pass_over(&file, "market data");
            } else {
                self.add_file(&file)?;
            }
        }
        Ok(())
    }

    fn add_file(&mut self, path: &Path) -> Result<(), InputError> {
        let wanted: Vec<&str> = FORMATS.iter().flat_map(|format| format.tables.iter().copied()).collect();
        let mut file = read_records(path, &wanted)?;
        self.tables.append(&mut file.tables);
        if !file.passed_over.is_empty() {
            self.pass_over(path, &format!("tables that hold no orders or fills: {}", file.passed_over.join(", ")));
        }
        Ok(())
    }

    fn pass_over(&mut self, path: &Path, message: &str) {
        let place = SourcePlace { table: path.display().to_string(), ..SourcePlace::default() };
        self.passed_over.push(PaperFinding::at(FindingKind::PassedOver, place, message));
    }
}
