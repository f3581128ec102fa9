//! Orders out of a tape: every order that took from a book is somebody's real order, with real executions.
//!
//! [`TapeSources`] finds out what files are and reads them into a [`TapeSink`]; [`TapeFolder`] is one that writes a folder which
//! a diagnosis reads, with a twin beside it that knows nothing but the touch.

#[cfg(feature = "io")]
mod book;
#[cfg(feature = "io")]
mod by_order;
#[cfg(feature = "io")]
mod by_trade;
#[cfg(feature = "io")]
mod files;
#[cfg(feature = "io")]
mod folder;
mod found;
#[cfg(feature = "io")]
mod measured;
#[cfg(feature = "io")]
mod sample;
#[cfg(feature = "io")]
mod shown;
#[cfg(feature = "io")]
#[cfg(test)]
mod tests;

#[cfg(feature = "io")]
pub use files::{TapeReading, TapeSettings, TapeSources};
#[cfg(feature = "io")]
pub use folder::{TAPE_FILES, TapeFolder, TapeWritten, tape_findings};
pub use found::{LeftOut, TapeCounts, TapeFill, TapeOrder, TapeOrderKind, TapeSink};
#[cfg(feature = "io")]
pub use measured::MeasuredInstrument;
#[cfg(feature = "io")]
pub use sample::{Selection, Thinning};
