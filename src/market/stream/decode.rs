//! From the rows of a table to rows of the market.

use crate::io::{Increase, InputError, OnBad, Place, Table, TimeFormat, not_increasing};
use crate::market::history_file::in_file;
use crate::market::{DataNotes, Finding, HistoryError, Price};
use crate::sim2real::Timestamp;

use super::Dated;
use super::sequence::{Placed, Sequence};

/// Reads the tables of one file, in the file's order.
pub(in crate::market) trait Decode<T>: Send {
    /// The columns it heeds, by the layout's names.
    fn columns(&self) -> Vec<&str>;

    /// The two clocks of a row, where there are two: the columns of the exchange's and of the local one.
    fn clocks(&self) -> Option<[(&str, TimeFormat); 2]> {
        None
    }

    /// The column whose times the rows are in order of.
    fn order_column(&self) -> &str;

    /// Hands the rows of `table` to `emit`.
    ///
    /// # Errors
    /// Columns that are missing or of the wrong type, and what `emit` refuses.
    fn decode(&mut self, table: &Table, emit: &mut Emit<'_, T>) -> Result<(), InputError>;

    /// What was held back until it was known that no more rows come.
    fn last(&mut self) -> Vec<T> {
        Vec::new()
    }
}

/// The error of a row of a table.
type Explain = dyn Fn(&Table, usize) -> InputError;

/// Why a row cannot be. Its words are made where they are asked for: a file may have many such rows.
pub(in crate::market) struct Fault {
    finding: Finding,
    explain: Box<Explain>,
}

impl Fault {
    pub(super) fn new(finding: Finding, explain: impl Fn(&Table, usize) -> InputError + 'static) -> Self {
        Self { finding, explain: Box::new(explain) }
    }

    /// A cell of `column` without a value.
    #[cold]
    pub(super) fn missing(column: &str, what: &'static str) -> Self {
        let column = column.to_owned();
        Self::new(Finding::Missing, move |table, row| table.missing(&column, row, what))
    }

    /// A cell of `column` that holds what it must not.
    pub(super) fn cell(
        finding: Finding,
        column: &str,
        message: &'static str,
        found: impl std::fmt::Display,
        hint: &'static str,
    ) -> Self {
        let (column, found) = (column.to_owned(), found.to_string());
        Self::new(finding, move |table, row| table.error(&column, row, message).found(&found).hint(hint))
    }

    /// A word of `column` that is none of the layout's.
    pub(super) fn word(column: &str, word: Option<&str>, expected: &'static str) -> Self {
        let (column, word) = (column.to_owned(), word.map(str::to_owned));
        Self::new(Finding::Word, move |table, row| match &word {
            None => table.missing(&column, row, expected),
            Some(word) => {
                table.error(&column, row, format!("expected {expected}")).found_text(word).hint("is the `layout` right?")
            }
        })
    }

    /// The error, of data row `row` of a table.
    pub(super) fn at(&self, table: &Table, row: usize) -> InputError {
        (self.explain)(table, row)
    }

    /// A row that breaks the rules of its kind; prices in the file are `scale` [currency] each.
    pub(super) fn broken(error: HistoryError, scale: f64) -> Self {
        let finding = match &error {
            HistoryError::Time { .. } | HistoryError::Span { .. } => Finding::Late,
            HistoryError::Bar { column: "volume", .. } => Finding::Size,
            HistoryError::Quote { column, .. } if column.ends_with("_size") => Finding::Size,
            HistoryError::Event { column: "size", .. } => Finding::Size,
            HistoryError::Quote { hint, .. } if hint.starts_with("a price") => Finding::Price,
            HistoryError::Quote { .. } => Finding::Crossed,
            HistoryError::Bar { .. } | HistoryError::Event { .. } => Finding::Price,
            HistoryError::Known { .. } => Finding::KnownEarly,
        };
        Self::new(finding, move |table, _| in_file(table, &error, scale))
    }
}

/// Where rows go: counted, held to the policy, and put in order.
pub(in crate::market) struct Emit<'a, T> {
    pub(super) table: &'a Table,
    pub(super) order_column: &'a str,
    pub(super) rows: &'a mut Kept<T>,
    pub(super) into: &'a mut dyn FnMut(T),
}

/// What is kept between the tables of a file.
pub(in crate::market) struct Kept<T> {
    pub(super) on_bad: OnBad,
    pub(super) max_gap: Option<i64>,
    pub(super) notes: DataNotes,
    pub(super) sequence: Sequence<T>,
    /// Where the row stands that was known latest of all so far: in a table before, or in the one at hand.
    newest_at: Place,
    newest_row: Option<usize>,
    last: Option<T>,
}

impl<T: Dated + Clone + PartialEq> Kept<T> {
    pub(super) fn new(notes: DataNotes, on_bad: OnBad, reorder: Option<i64>, max_gap: Option<i64>) -> Self {
        Self {
            on_bad,
            max_gap,
            notes,
            sequence: Sequence::new(reorder),
            newest_at: Place::File,
            newest_row: None,
            last: None,
        }
    }

    /// Gives out the rows before which none can come any more; at the `end` all that are left.
    pub(super) fn give(&mut self, end: bool, into: &mut dyn FnMut(T)) {
        while let Some(row) = self.sequence.pop(end) {
            self.give_one(row, into);
        }
    }

    /// `table` has been read: of its rows the place of the newest is kept.
    pub(super) fn leave(&mut self, table: &Table) {
        if let Some(row) = self.newest_row.take() {
            self.newest_at = table.place(row);
        }
    }

    /// Gives out the next row.
    #[inline(always)]
    fn give_one(&mut self, row: T, into: &mut dyn FnMut(T)) {
        if let Some(before) = &self.last {
            if row.time() < before.time() {
                self.notes.found(Finding::ClockBack);
            }
            if row == *before {
                self.notes.found(Finding::Repeated);
            }
        }
        self.notes.gave(row.known_at(), self.max_gap);
        self.last = Some(row.clone());
        into(row);
    }
}

impl<T: Dated + Clone + PartialEq> Emit<'_, T> {
    /// Counts `finding`.
    pub(super) fn found(&mut self, finding: Finding) {
        self.rows.notes.found(finding);
    }

    /// The value, if there is one: a fault is an error or counted, as the policy has it.
    #[inline(always)]
    pub(super) fn sound<V>(&mut self, row: usize, value: Result<V, Fault>) -> Result<Option<V>, InputError> {
        match value {
            Ok(value) => Ok(Some(value)),
            Err(fault) => self.unsound(row, &fault).map(|()| None),
        }
    }

    #[cold]
    fn unsound(&mut self, row: usize, fault: &Fault) -> Result<(), InputError> {
        if self.rows.on_bad == OnBad::Refuse {
            return Err(fault.at(self.table, row));
        }
        self.rows.notes.found(fault.finding);
        Ok(())
    }

    /// Takes what came of data row `row` of the table.
    #[inline(always)]
    pub(super) fn push(&mut self, row: usize, item: T) -> Result<(), InputError> {
        if self.rows.sequence.passes(item.known_at()) {
            self.rows.newest_row = Some(row);
            self.rows.give_one(item, self.into);
            return Ok(());
        }
        self.put_in_order(row, item)
    }

    /// Takes what came of several data rows, each with its number.
    pub(super) fn push_all(&mut self, rows: &[(usize, T)]) -> Result<(), InputError> {
        rows.iter().try_for_each(|(row, item)| self.push(*row, item.clone()))
    }

    fn put_in_order(&mut self, row: usize, item: T) -> Result<(), InputError> {
        let known_at = item.known_at();
        let newest = self.rows.sequence.newest();
        match self.rows.sequence.push(item) {
            Placed::Last => self.rows.newest_row = Some(row),
            Placed::Between => self.rows.notes.found(Finding::Reordered),
            Placed::Late => {
                let newest_at = self.rows.newest_row.map_or(self.rows.newest_at, |row| self.table.place(row));
                let (column, before_at) = (self.order_column.to_owned(), newest_at);
                let late = move |table: &Table, row: usize| {
                    not_increasing(table, &column, row, &known_at, (&newest, before_at), Increase::OrStays)
                };
                self.sound(row, Err::<(), Fault>(Fault::new(Finding::Late, late)))?;
                return Ok(());
            }
        }
        self.rows.give(false, self.into);
        Ok(())
    }
}

/// The number in a cell of a column that must be complete.
#[inline(always)]
pub(super) fn number(column: &str, values: &[Option<f64>], row: usize) -> Result<f64, Fault> {
    values.get(row).copied().flatten().ok_or_else(|| Fault::missing(column, "a number"))
}

/// The price in such a cell, in `scale` [currency]: above 0.
#[inline(always)]
pub(super) fn price(column: &str, values: &[Option<f64>], row: usize, scale: f64) -> Result<Price, Fault> {
    let value = number(column, values, row)?;
    match Price::nearest(value * scale) {
        Ok(price) if value > 0.0 => Ok(price),
        _ => no_price(column, value, scale),
    }
}

#[cold]
fn no_price(column: &str, value: f64, scale: f64) -> Result<Price, Fault> {
    if value <= 0.0 {
        let hint = "drop the row, or name the column that holds the price in `columns`";
        return Err(Fault::cell(Finding::Price, column, "expected a price greater than 0", value, hint));
    }
    Price::nearest(value * scale).map_err(|_| {
        let hint = "is `price_scale` right?";
        Fault::cell(Finding::Price, column, "expected a price of at most 9.2e9", value * scale, hint)
    })
}

/// A price that is not exact, in `scale` [currency]: scaled, it is the nearest number to the decimal that was meant.
pub(super) fn scaled(value: f64, scale: f64) -> f64 {
    let product = value * scale;
    if scale == 1.0 { product } else { Price::nearest(product).map_or(product, Price::to_f64) }
}

/// The size in such a cell, in `scale` [units]: 0 or more.
pub(super) fn size(column: &str, values: &[Option<f64>], row: usize, scale: f64) -> Result<f64, Fault> {
    let value = number(column, values, row)?;
    if value < 0.0 {
        let hint = "drop the row or correct it; 0 is a size of nothing";
        return Err(Fault::cell(Finding::Size, column, "expected a size that is not negative", value, hint));
    }
    Ok(value * scale)
}

/// The time in a cell of a column that must be complete.
#[inline(always)]
pub(super) fn time(column: &str, values: &[Option<Timestamp>], row: usize) -> Result<Timestamp, Fault> {
    values.get(row).copied().flatten().ok_or_else(|| Fault::missing(column, "a time"))
}
