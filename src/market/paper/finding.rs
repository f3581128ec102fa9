//! What was odd about a log: counted, with the places, so that nothing is dropped in silence.

use std::collections::BTreeMap;
use std::fmt;

use serde::Serialize;

/// A place in a source, for messages: `orders.csv: row 7, column \`price\``.
#[derive(Debug, Clone, PartialEq, Eq, Default, PartialOrd, Ord, Hash, Serialize)]
pub struct SourcePlace {
    /// File, and table in it where it has several.
    pub table: String,
    /// Row: the line of a CSV or newline JSON, else the number of the record in its table, from 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub row: Option<usize>,
    /// Column, or key.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub column: Option<String>,
}

impl fmt::Display for SourcePlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.table)?;
        match (self.row, &self.column) {
            (Some(row), Some(column)) => write!(f, ": row {row}, column `{column}`"),
            (Some(row), None) => write!(f, ": row {row}"),
            (None, Some(column)) => write!(f, ": column `{column}`"),
            (None, None) => Ok(()),
        }
    }
}

/// What kind of oddity it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FindingKind {
    /// A row that could not be read, and is left out.
    UnreadRow,
    /// A file or table that the format has no use for.
    PassedOver,
    /// Orders that never filled may have been deleted from the log.
    Survivorship,
    /// Times at which a bot asked, not at which something happened.
    PolledTimes,
    /// Times in whole seconds or coarser.
    RoundedTimes,
    /// Times with and without a zone in one column; those without are in the zone given.
    MixedZones,
    /// A local time that the clocks pass twice; the earlier is taken.
    DoubleHour,
    /// An order that was submitted before it was made, or filled before it was submitted, by the log's own stamps.
    TimesOutOfOrder,
    /// A number with digits below 1e-9, which are rounded off.
    RoundedNumber,
    /// A fee in another currency than the price, kept apart: it is in no sum.
    FeeInOtherCurrency,
    /// A fee in what was bought or sold, counted at the price of the fill.
    FeeInBase,
    /// A fee converted by a rate that was given.
    FeeConverted,
    /// A fee reckoned from a rate, not stated as an amount.
    FeeFromRate,
    /// A row that says what another says; it counts once.
    Duplicate,
    /// A fill of an id that another fill has, which says something else; the first counts.
    ConflictingFill,
    /// An order that is stated twice, differently; the later state counts.
    RestatedOrder,
    /// A fill whose order is not in the log.
    FillWithoutOrder,
    /// An order that was filled, by its own words, of which there is no fill.
    OrderWithoutFill,
    /// An order whose fills do not add up to what it says was filled.
    FilledOtherwise,
    /// Fills that add up to more than was ordered.
    Overfilled,
    /// An order that was replaced by another.
    Replaced,
    /// An order that names a successor or predecessor that is not in the log.
    BrokenChain,
    /// A fill that was taken back: it is not among the fills.
    Bust,
    /// A fill that was corrected: the corrected one is among the fills.
    Correction,
    /// A fill that stands for all executions of its order, at their average price.
    TotalsOnly,
    /// An order without an average price, whose fill is stated at the price of the order.
    PriceOfOrder,
    /// An order none of whose times is known.
    WithoutTime,
    /// An order whose quantity was asked for as an amount of cash.
    Notional,
    /// Quantities in contracts of more than one unit each; prices are of one unit.
    Multiplier,
    /// A symbol that the mapping given does not have; it keeps its name.
    Unmapped,
    /// Something that only this format has, and that its reader must know.
    Note,
}

impl FindingKind {
    /// Whether who compares the log with anything has to know it: what is missing, made up, or stamped by another clock than it seems.
    #[must_use]
    pub fn bears_on_comparison(self) -> bool {
        !matches!(
            self,
            Self::PassedOver | Self::RoundedNumber | Self::Duplicate | Self::Replaced | Self::Note | Self::Unmapped
        )
    }

    /// What it says of the log, as a sentence without its full stop.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Self::UnreadRow => "rows that could not be read are left out",
            Self::PassedOver => "files or tables that the format has no use for",
            Self::Survivorship => "orders that never filled may have been deleted from the log",
            Self::PolledTimes => "times are when a bot asked, not when it happened",
            Self::RoundedTimes => "times are rounded to whole seconds or coarser",
            Self::MixedZones => "times with and without a zone; those without are in the zone given",
            Self::DoubleHour => "local times that the clocks pass twice; the earlier is taken",
            Self::TimesOutOfOrder => "times that go backwards within an order",
            Self::RoundedNumber => "numbers with digits below 1e-9, rounded",
            Self::FeeInOtherCurrency => "fees in another currency than the price, kept apart and in no sum",
            Self::FeeInBase => "fees in what was traded, counted at the price of the fill",
            Self::FeeConverted => "fees converted by the rates given",
            Self::FeeFromRate => "fees reckoned from a rate, not stated as amounts",
            Self::Duplicate => "rows that are there twice count once",
            Self::ConflictingFill => "fills of one id that say different things; the first counts",
            Self::RestatedOrder => "orders stated twice, differently; the later state counts",
            Self::FillWithoutOrder => "fills whose order is not in the log",
            Self::OrderWithoutFill => "orders that were filled and have no fill in the log",
            Self::FilledOtherwise => "orders whose fills do not add up to what they say was filled",
            Self::Overfilled => "orders with more filled than ordered",
            Self::Replaced => "orders replaced by others",
            Self::BrokenChain => "orders whose successor or predecessor is not in the log",
            Self::Bust => "fills that were taken back, left out",
            Self::Correction => "fills that were corrected; the correction counts",
            Self::TotalsOnly => "fills that stand for all executions of an order, at their average price",
            Self::PriceOfOrder => "fills at the price of the order, for the log states no average",
            Self::WithoutTime => "orders without any time",
            Self::Notional => "orders of an amount of cash, not of a quantity",
            Self::Multiplier => "quantities in contracts of more than one unit; prices are of one unit",
            Self::Unmapped => "symbols that the mapping does not have keep their names",
            Self::Note => "peculiar to this format",
        }
    }
}

impl FindingKind {
    /// What to do about it; none where nothing can be done but to know it.
    #[must_use]
    pub fn hint(self) -> Option<&'static str> {
        Some(match self {
            Self::UnreadRow => "mend these rows and import again; findings.json has all of them",
            Self::FeeInOtherCurrency => "say what they are worth with --fee-rate, such as BNB/USDT=612.5",
            Self::FillWithoutOrder => "give the log of orders too, or a longer span of it",
            Self::OrderWithoutFill | Self::FilledOtherwise => "give the log of fills too, or a longer span of it",
            Self::TotalsOnly => "give the log of executions too, where there is one",
            Self::ConflictingFill | Self::RestatedOrder => "are the files of several runs or accounts given together?",
            Self::BrokenChain => "give a longer span of the log",
            Self::Unmapped => "add them to the file of --symbols, if they are to have other names",
            _ => return None,
        })
    }
}

/// One of them, with its place.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct PaperFinding {
    /// What kind.
    pub kind: FindingKind,
    /// Where; none where the whole log is meant.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub place: Option<SourcePlace>,
    /// What is said of it.
    pub message: String,
    /// The value found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub found: Option<String>,
}

impl PaperFinding {
    /// A finding about the log as a whole.
    #[must_use]
    pub fn of_log(kind: FindingKind, message: impl Into<String>) -> Self {
        Self { kind, place: None, message: message.into(), found: None }
    }

    /// A finding at `place`.
    #[must_use]
    pub fn at(kind: FindingKind, place: SourcePlace, message: impl Into<String>) -> Self {
        Self { kind, place: Some(place), message: message.into(), found: None }
    }

    /// Gives the value found, cut where it is long.
    #[must_use]
    pub fn found(mut self, value: &str) -> Self {
        const SHOWN: usize = 60;
        let dots = if value.chars().nth(SHOWN).is_some() { "..." } else { "" };
        self.found = Some(format!("{:?}{dots}", value.chars().take(SHOWN).collect::<String>()));
        self
    }
}

impl fmt::Display for PaperFinding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(place) = &self.place {
            write!(f, "{place}: ")?;
        }
        f.write_str(&self.message)?;
        match &self.found {
            Some(found) => write!(f, ", found {found}"),
            None => Ok(()),
        }
    }
}

/// All findings of one kind.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct FindingSummary {
    /// What kind.
    pub kind: FindingKind,
    /// What it says.
    pub says: &'static str,
    /// How many.
    pub count: usize,
    /// What to do about it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hint: Option<&'static str>,
    /// The first of them; of rows that could not be read all.
    pub findings: Vec<PaperFinding>,
}

/// What was found while a log was read, kind by kind.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct PaperFindings {
    kinds: BTreeMap<FindingKind, (usize, Vec<PaperFinding>)>,
}

impl PaperFindings {
    /// How many findings of a kind are kept with their places; of rows that could not be read all are.
    pub const KEPT: usize = 20;

    /// Adds a finding.
    pub fn add(&mut self, finding: PaperFinding) {
        let (count, kept) = self.kinds.entry(finding.kind).or_default();
        *count += 1;
        if finding.kind == FindingKind::UnreadRow || kept.len() < Self::KEPT {
            kept.push(finding);
        }
    }

    /// How many there are of a kind.
    #[must_use]
    pub fn count(&self, kind: FindingKind) -> usize {
        self.kinds.get(&kind).map_or(0, |(count, _)| *count)
    }

    /// The findings of a kind that were kept, in the order in which they were found.
    #[must_use]
    pub fn of(&self, kind: FindingKind) -> &[PaperFinding] {
        self.kinds.get(&kind).map_or(&[], |(_, kept)| kept)
    }

    /// Whether nothing was found.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.kinds.is_empty()
    }

    /// Kind by kind, worst first.
    #[must_use]
    pub fn summaries(&self) -> Vec<FindingSummary> {
        let summary = |(kind, (count, findings)): (&FindingKind, &(usize, Vec<PaperFinding>))| FindingSummary {
            kind: *kind,
            says: kind.words(),
            count: *count,
            hint: kind.hint(),
            findings: findings.clone(),
        };
        self.kinds.iter().map(summary).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn findings_are_counted_and_the_unread_rows_all_kept() {
        let mut findings = PaperFindings::default();
        for row in 1..=100 {
            let place = |column: &str| SourcePlace { table: "a.csv".into(), row: Some(row), column: Some(column.into()) };
            findings.add(PaperFinding::at(FindingKind::UnreadRow, place("qty"), "expected a number").found("abc"));
            findings.add(PaperFinding::at(FindingKind::Duplicate, place("id"), "as in row 1"));
        }
        assert_eq!(findings.count(FindingKind::Duplicate), 100);
        assert_eq!(findings.of(FindingKind::Duplicate).len(), PaperFindings::KEPT);
        assert_eq!(findings.of(FindingKind::UnreadRow).len(), 100);
        let told = findings.of(FindingKind::UnreadRow)[6].to_string();
        assert_eq!(told, "a.csv: row 7, column `qty`: expected a number, found \"abc\"");
        assert_eq!(findings.summaries()[0].kind, FindingKind::UnreadRow);
    }
}
