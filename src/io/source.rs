//! Files as bytes: which format a name's ending says, and what is wrong with files that cannot be opened.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use sha2::{Digest, Sha256};

use super::columnar::Container;
use super::error::{InputError, did_you_mean};

/// The format that the ending of a name says.
#[derive(Debug, Clone, Copy)]
pub(super) enum Ending {
    Csv,
    CsvGz,
    Columnar(Container),
}

impl Ending {
    pub(super) fn of(path: &Path) -> Result<Self, InputError> {
        let name = path.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
        let endings = [
            (".csv", Self::Csv),
            (".csv.gz", Self::CsvGz),
            (".parquet", Self::Columnar(Container::Parquet)),
            (".arrow", Self::Columnar(Container::Arrow)),
            (".ipc", Self::Columnar(Container::Arrow)),
            (".feather", Self::Columnar(Container::Arrow)),
        ];
        let known = endings.into_iter().find(|(ending, _)| name.ends_with(ending)).map(|(_, ending)| ending);
        match known {
            Some(ending) => Ok(ending),
            // A missing file or a folder is the better thing to say.
            None => Err(open(path).err().unwrap_or_else(|| {
                InputError::new(path, "the ending of the name says no format that is read")
                    .hint("tables are .csv, .csv.gz, .parquet, .arrow, .ipc or .feather")
            })),
        }
    }
}

/// Whether the ending of a name says a columnar format, of which any rows and columns can be read without the others.
#[must_use]
pub fn is_columnar(path: &Path) -> bool {
    matches!(Ending::of(path), Ok(Ending::Columnar(_)))
}

/// Opens a file that exists and is no folder.
pub(super) fn open(path: &Path) -> Result<File, InputError> {
    if path.is_dir() {
        return Err(InputError::new(path, "expected a file, found a folder").hint("name a file in it"));
    }
    File::open(path).map_err(|error| match error.kind() {
        std::io::ErrorKind::NotFound => InputError::new(path, "there is no such file").maybe_hint(nearest_file(path)),
        _ => InputError::new(path, format!("cannot be opened ({error})")),
    })
}

/// Most files of a folder that a hint names.
const NAMED: usize = 5;

/// A hint for a missing file: the one in its folder that may be meant, or else what is there; or that the folder is missing too.
fn nearest_file(path: &Path) -> Option<String> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if !folder.is_dir() {
        return Some(format!("there is no folder {} either", folder.display()));
    }
    let mut names: Vec<String> =
        std::fs::read_dir(folder).ok()?.filter_map(|entry| entry.ok()?.file_name().into_string().ok()).collect();
    names.sort();
    if let Some(meant) = did_you_mean(&path.file_name()?.to_string_lossy(), &names) {
        return Some(format!("did you mean {}?", folder.join(meant).display()));
    }
    let there = match names.len() {
        0 => "nothing is there".to_owned(),
        count => {
            let more = if count > NAMED { format!(" and {} more", count - NAMED) } else { String::new() };
            names.truncate(NAMED);
            format!("there are {}{more}", names.join(", "))
        }
    };
    Some(format!("in the folder {} {there}", folder.display()))
}

/// All bytes of a file.
pub(super) fn bytes(path: &Path, mut file: File) -> Result<Vec<u8>, InputError> {
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes).map_err(|error| unreadable(path, &error))?;
    Ok(bytes)
}

/// SHA-256 of a file's bytes, in hexadecimal digits.
///
/// # Errors
/// A file that is missing, a folder or cannot be read.
pub fn file_hash(path: impl AsRef<Path>) -> Result<String, InputError> {
    let path = path.as_ref();
    let mut file = open(path)?;
    let mut hash = Sha256::new();
    let mut piece = vec![0; 1 << 16];
    loop {
        match file.read(&mut piece) {
            Ok(0) => return Ok(hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()),
            Ok(count) => hash.update(&piece[..count]),
            Err(error) => return Err(unreadable(path, &error)),
        }
    }
}

/// All bytes of a file, decompressed.
pub(super) fn unzip(path: &Path, file: File) -> Result<Vec<u8>, InputError> {
    let mut bytes = Vec::new();
    flate2::read::MultiGzDecoder::new(file).read_to_end(&mut bytes).map_err(|error| no_gzip(path, &error))?;
    Ok(bytes)
}

/// The error of a file that cannot be read.
pub(super) fn unreadable(path: &Path, error: &std::io::Error) -> InputError {
    InputError::new(path, format!("cannot be read ({error})"))
}

/// The error of a compressed file that cannot be read.
pub(super) fn no_gzip(path: &Path, error: &std::io::Error) -> InputError {
    InputError::new(path, format!("expected a whole gzip file ({error})"))
        .hint("the file is truncated, corrupt or not compressed: copy or write it again")
}
