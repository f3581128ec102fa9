//! The two clocks of a row: the exchange's, and that of whoever recorded it.

use crate::io::{ClockOffset, FeedFormat, InputError, Renames, Table, TableChunks, TimeFormat, TimeUnit};
use crate::market::Finding;
use crate::sim2real::Timestamp;

use super::Dated;
use super::decode::{Emit, Fault, time};

/// The columns in which the clocks are.
#[derive(Debug, Clone)]
pub(super) struct Clocks {
    event: (String, TimeFormat),
    local: Option<(String, TimeFormat)>,
    /// Added to the local clock [ns].
    offset: i64,
}

/// The times of a table.
pub(super) struct Times {
    event: Vec<Option<Timestamp>>,
    local: Option<Vec<Option<Timestamp>>>,
}

impl Clocks {
    /// Those of the contract's own layouts: `ts`, and the column declared as `known_at`.
    pub(super) fn declared(event: &str, format: &FeedFormat) -> Self {
        let local = format.clock.known_at.clone().map(|column| (column, format.time));
        Self { event: (event.to_owned(), format.time), local, offset: declared_offset(format) }
    }

    /// Those of a layout that has both.
    pub(super) fn of_layout(event: (&str, TimeUnit), local: (&str, TimeUnit), format: &FeedFormat) -> Self {
        let clock = |(column, unit): (&str, TimeUnit)| (column.to_owned(), TimeFormat { unit, ..TimeFormat::default() });
        Self { event: clock(event), local: Some(clock(local)), offset: declared_offset(format) }
    }

    /// The columns of both, where there are two.
    pub(super) fn both(&self) -> Option<[(&str, TimeFormat); 2]> {
        let (local, format) = self.local.as_ref()?;
        Some([(&self.event.0, self.event.1), (local, *format)])
    }

    /// The columns there are.
    pub(super) fn columns(&self) -> impl Iterator<Item = &str> {
        std::iter::once(self.event.0.as_str()).chain(self.local.iter().map(|(column, _)| column.as_str()))
    }

    /// The column whose times rows are in order of.
    pub(super) fn order_column(&self) -> &str {
        self.local.as_ref().map_or(&self.event.0, |(column, _)| column)
    }

    /// Reads the times of a table.
    pub(super) fn times(&self, table: &Table) -> Result<Times, InputError> {
        let event = table.times_with_holes(&self.event.0, &self.event.1)?;
        let local = self.local.as_ref().map(|(column, format)| table.times_with_holes(column, format)).transpose()?;
        Ok(Times { event, local })
    }

    /// When row `row` happened.
    pub(super) fn happened_at(&self, times: &Times, row: usize) -> Result<Timestamp, Fault> {
        time(&self.event.0, &times.event, row)
    }

    /// When row `row` was known.
    pub(super) fn known_at(&self, times: &Times, row: usize) -> Result<Timestamp, Fault> {
        match (&times.local, &self.local) {
            (Some(local), Some((column, _))) => Ok(time(column, local, row)? + self.offset),
            _ => self.happened_at(times, row),
        }
    }

    /// When row `row` happened, and when it was known. One that was known before it happened is an error or, as the policy
    /// has it, becomes known when it happened: later than it was, and never too early.
    pub(super) fn at<T: Dated + Clone + PartialEq>(
        &self,
        times: &Times,
        row: usize,
        emit: &mut Emit<'_, T>,
    ) -> Result<Option<(Timestamp, Timestamp)>, InputError> {
        let both = self.happened_at(times, row).and_then(|event| Ok((event, self.known_at(times, row)?)));
        let Some((event, known_at)) = emit.sound(row, both)? else { return Ok(None) };
        if known_at >= event {
            return Ok(Some((event, known_at)));
        }
        let column = self.order_column().to_owned();
        emit.sound(
            row,
            Err::<(), Fault>(Fault::new(Finding::KnownEarly, move |table, row| {
                let hint = "the local clock runs behind: declare clock_offset = \"estimate\", or seconds to add to it";
                let message = format!("expected a time no earlier than {event}, when it happened");
                table.error(&column, row, message).found(known_at).hint(hint)
            })),
        )?;
        Ok(Some((event, event)))
    }
}

fn declared_offset(format: &FeedFormat) -> i64 {
    match format.clock.offset {
        ClockOffset::Declared(offset) => offset,
        ClockOffset::Estimated => 0,
    }
}

/// The least offset that lets no row of a file be known before it happened [ns], 0 or more.
///
/// It is the largest difference between the exchange's clock and the local one: were the fastest message to have taken no
/// time, the clocks would differ by so much. What it really took cannot be told from one direction alone (Cristian,
/// "Probabilistic clock synchronization", 1989); it is missing from every latency that follows.
pub(super) fn estimated_offset(
    path: &std::path::Path,
    renames: &Renames,
    [event, local]: [(&str, TimeFormat); 2],
) -> Result<i64, InputError> {
    let mut chunks = TableChunks::open(path, renames, TableChunks::ROWS)?;
    let mut largest = 0;
    while let Some(table) = chunks.next_table()? {
        let happened = table.times_with_holes(event.0, &event.1)?;
        let known = table.times_with_holes(local.0, &local.1)?;
        let differences = happened.into_iter().zip(known).filter_map(|(happened, known)| Some(happened? - known?));
        largest = differences.fold(largest, i64::max);
    }
    Ok(largest)
}
