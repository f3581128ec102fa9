//! Files: the only file access below the command line. Reads and writes tables and TOML documents; what their rows
//! mean is the domains' business.

mod check;
mod columnar;
mod csv;
mod error;
mod source;
mod table;
mod time_format;

pub use check::{Increase, check_increasing, check_not_negative, check_positive};
pub use error::{InputError, Place, did_you_mean, hint_among, listed};
pub use table::{Renames, Table};
pub use time_format::{TimeFormat, TimeUnit};
