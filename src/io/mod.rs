//! Files: the only file access below the command line. Reads and writes tables and TOML documents; what their rows
//! and keys mean is the domains' business: nothing here knows a joint or an order.

mod arrow_buffers;
mod check;
mod columnar;
mod controller_entry;
mod csv;
mod document;
mod equation_sections;
mod error;
mod feed_format;
mod folder;
mod instrument_entry;
mod output_folder;
mod output_table;
mod parquet_pages;
mod quantity;
mod relative_path;
mod run_file;
mod source;
mod stamp;
mod table;
mod time_format;
mod trajectory;
mod twin_file;
mod twin_mechanism;
mod unit;

pub use check::{Increase, check_increasing, check_not_negative, check_positive};
pub use controller_entry::{ControllerEntry, ControllerKind};
pub use document::{Document, read_toml};
pub use equation_sections::{AttachEntry, EquationSections, InputEntry, OutputEntry, StateEntry};
pub use error::{InputError, Place, did_you_mean, hint_among, listed};
pub use feed_format::FeedFormat;
pub use folder::table_in;
pub use instrument_entry::InstrumentEntry;
pub use output_folder::{OutputFolder, Overwrite, write_file, write_table};
pub use output_table::{OutputTable, Values};
pub use quantity::{DEFAULT_UNCERTAINTY, Exactly, MechanismEntry, Quantity};
pub use run_file::{DataEntry, FeedKind, RunFile, RunSection};
pub use source::file_hash;
pub use stamp::{Stamp, common_spacing};
pub use table::{Renames, Table};
pub use time_format::{TimeFormat, TimeUnit};
pub use trajectory::{Need, TIME_COLUMN, TrajectoryTable, read_trajectory};
pub use twin_file::{AssumedPrice, Assumptions, ChannelEntry, MarketFiles, TwinFile};
pub use twin_mechanism::{ListedMechanism, listed_mechanism};
pub use unit::{UnitMismatch, check_unit};
