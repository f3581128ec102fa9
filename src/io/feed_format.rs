//! How market data files are written, as far as a document must say it.

use std::path::PathBuf;

use chrono_tz::{TZ_VARIANTS, Tz};
use serde::de::Error;
use serde::{Deserialize as _, Deserializer};

use super::document::{Document, HINT};
use super::error::{InputError, hint_among};
use super::feed_rules::{FeedClock, FeedRules};
use super::layout::Layout;
use super::source::open;
use super::stamp::Stamp;
use super::table::Renames;
use super::time_format::{TimeFormat, TimeUnit};

/// How market data files are written.
#[derive(Debug, Clone, PartialEq)]
pub struct FeedFormat {
    /// What the time of a bar is; bars have it always, other data never need it.
    pub stamp: Option<Stamp>,
    /// Unit and zone of times.
    pub time: TimeFormat,
    /// What one unit of a price in the file is worth [currency].
    pub price_scale: f64,
    /// Columns that are named otherwise.
    pub columns: Renames,
    /// Whose columns they are.
    pub layout: Layout,
    /// When rows were known.
    pub clock: FeedClock,
    /// What rows are held to.
    pub rules: FeedRules,
    /// The file of the book from which on a file of its changes counts, where the layout has one.
    pub snapshot: Option<PathBuf>,
}

impl Default for FeedFormat {
    fn default() -> Self {
        Self::of_layout(Layout::Trueup)
    }
}

impl FeedFormat {
    /// The format of a layout where nothing else is declared.
    #[must_use]
    pub fn of_layout(layout: Layout) -> Self {
        Self {
            stamp: layout.stamp(),
            time: TimeFormat::default(),
            price_scale: layout.price_scale(),
            columns: Renames::new(),
            layout,
            clock: FeedClock::default(),
            rules: FeedRules::default(),
            snapshot: None,
        }
    }

    /// The format that the optional keys of a section say.
    pub(super) fn of(
        stamp: Option<Stamp>,
        zone: Option<Tz>,
        unit: Option<TimeUnit>,
        price_scale: Option<f64>,
        columns: Renames,
    ) -> Self {
        let time = TimeFormat { unit: unit.unwrap_or_default(), zone: zone.unwrap_or(Tz::UTC) };
        Self { stamp, time, price_scale: price_scale.unwrap_or(1.0), columns, ..Self::default() }
    }

    /// Holds the section at `keys`, which may name bars, to what can be held without reading them.
    pub(super) fn check(&self, document: &Document, keys: &[&str], bars: bool) -> Result<(), InputError> {
        if bars && self.stamp.is_none() {
            let error = document.error(keys, "bars need a `stamp`, which is missing");
            return Err(error.hint("say what a bar's time is: stamp = \"open\" or stamp = \"close\" of the bar"));
        }
        if !self.price_scale.is_finite() || self.price_scale <= 0.0 {
            let keys: Vec<&str> = keys.iter().copied().chain(["price_scale"]).collect();
            return Err(document
                .error(&keys, "expected a finite number greater than 0")
                .found(self.price_scale)
                .hint("a price in the file times `price_scale` is the price: 1e-4 for prices x10000"));
        }
        Ok(())
    }
}

/// Holds the file that stands at `keys` of a document to exist.
pub(super) fn check_file(document: &Document, keys: &[&str], named: &str) -> Result<(), InputError> {
    open(&document.resolve(named)).map(drop).map_err(|error| {
        let start = "paths start from the folder of this document";
        let hint = match error.hint.map(String::from) {
            Some(meant) if meant.starts_with("did you mean") => meant,
            Some(there) => format!("{start}: {there}"),
            None => start.to_owned(),
        };
        document.error(keys, format!("names the file {named}, but {}", error.message)).hint(hint)
    })
}

/// Reads a time zone of the IANA database by its name.
pub(super) fn zone<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Tz>, D::Error> {
    let word = String::deserialize(deserializer)?;
    if let Ok(zone) = word.parse() {
        return Ok(Some(zone));
    }
    let names: Vec<&str> = TZ_VARIANTS.iter().map(|zone| zone.name()).collect();
    let city = format!("/{}", word.to_lowercase().replace(' ', "_"));
    let hint = match names.iter().find(|name| name.to_lowercase().ends_with(&city)) {
        Some(name) => format!("did you mean `{name}`?"),
        None => hint_among(&word, &names).filter(|hint| hint.starts_with("did")).unwrap_or_else(|| {
            "zones are called as in the IANA database: \"America/New_York\", \"Europe/London\", \"UTC\"".to_owned()
        }),
    };
    Err(D::Error::custom(format!("unknown time zone `{word}`{HINT}{hint}")))
}
