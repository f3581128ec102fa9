//! What was found in market data while they were read: counted, so that a report can say it.

use serde::Serialize;

use crate::sim2real::Timestamp;

/// Something about a row of market data.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Finding {
    /// A cell without a time, or without a number where there must be one: empty, null or NaN.
    Missing,
    /// A word that the layout does not have, as an action or a side.
    Word,
    /// A price that cannot be, or prices that cannot be those of one bar.
    Price,
    /// A size or volume that cannot be: negative, or 0 where something must be.
    Size,
    /// A bid above the ask, or deeper levels at better prices.
    Crossed,
    /// A row after rows that were known later, or later than it may be put in order.
    Late,
    /// A row that is there already: a bar of the same stamp, a trade or an order of the same id.
    Duplicate,
    /// A row that was known before it happened; its time of being known becomes that of its happening.
    KnownEarly,
    /// A quote whose bid is its ask.
    Locked,
    /// A quote with one side only.
    OneSided,
    /// A quote with neither side: a halt.
    Halt,
    /// A row that says what the one before said.
    Repeated,
    /// A row that was put in order.
    Reordered,
    /// A row that happened before the one before it: the exchange's clock went back, or a message was overtaken.
    ClockBack,
    /// A silence longer than `max_gap`.
    Gap,
    /// A row that its source flags as suspicious.
    Suspicious,
    /// A row of a kind that does not change what is read here, such as a trade in a file of orders.
    OtherKind,
    /// A change of an order that is not in the book: it was placed before the file begins, or is gone.
    UnknownOrder,
    /// A change of the book that the snapshot holds already.
    BeforeSnapshot,
    /// A row that came before the snapshot did, and counts from then on.
    AwaitedSnapshot,
    /// A break in the numbers of updates: some are missing.
    MissedUpdates,
}

/// What is done with a row of which something was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Treatment {
    /// The file is refused; where `on_bad = "drop"`, the row is left out.
    Refused,
    /// The file is refused; where `on_bad = "drop"`, the row is mended and kept.
    Mended,
    /// The row is left out.
    LeftOut,
    /// The row is kept as it is.
    Kept,
}

impl Finding {
    /// All there are.
    pub const ALL: [Self; 21] = [
        Self::Missing,
        Self::Word,
        Self::Price,
        Self::Size,
        Self::Crossed,
        Self::Late,
        Self::Duplicate,
        Self::KnownEarly,
        Self::Locked,
        Self::OneSided,
        Self::Halt,
        Self::Repeated,
        Self::Reordered,
        Self::ClockBack,
        Self::Gap,
        Self::Suspicious,
        Self::OtherKind,
        Self::UnknownOrder,
        Self::BeforeSnapshot,
        Self::AwaitedSnapshot,
        Self::MissedUpdates,
    ];

    /// What is done with a row of which it is found: the policy, stated here once for every reader.
    #[must_use]
    pub fn treatment(self) -> Treatment {
        match self {
            Self::Missing | Self::Word | Self::Price | Self::Size | Self::Crossed | Self::Late | Self::Duplicate => {
                Treatment::Refused
            }
            Self::KnownEarly => Treatment::Mended,
            Self::Suspicious | Self::OtherKind | Self::UnknownOrder | Self::BeforeSnapshot => Treatment::LeftOut,
            Self::Locked
            | Self::OneSided
            | Self::Halt
            | Self::Repeated
            | Self::Reordered
            | Self::ClockBack
            | Self::Gap
            | Self::AwaitedSnapshot
            | Self::MissedUpdates => Treatment::Kept,
        }
    }

    /// What is said of a row: "3 rows ...".
    #[must_use]
    pub fn title(self) -> &'static str {
        match self {
            Self::Missing => "have no time or no number in a cell that needs one",
            Self::Word => "have a word that means nothing",
            Self::Price => "have a price that cannot be",
            Self::Size => "have a size that cannot be",
            Self::Crossed => "have a bid above the ask or levels out of order",
            Self::Late => "come after rows that were known later",
            Self::Duplicate => "are there already",
            Self::KnownEarly => "were known before they happened, and count as known when they happened",
            Self::Locked => "have a bid equal to the ask",
            Self::OneSided => "have one side only",
            Self::Halt => "have neither bid nor ask",
            Self::Repeated => "say what the one before says",
            Self::Reordered => "are put in order of time",
            Self::ClockBack => "happened before the one before them",
            Self::Gap => "follow a silence longer than max_gap",
            Self::Suspicious => "are flagged as suspicious by their source",
            Self::OtherKind => "tell of something else",
            Self::UnknownOrder => "change an order that is not in the book",
            Self::BeforeSnapshot => "are in the snapshot already",
            Self::AwaitedSnapshot => "came before the snapshot, and count as known with it",
            Self::MissedUpdates => "follow a break in the numbers of updates",
        }
    }
}

/// What was found in one file of market data.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct DataNotes {
    what: String,
    rows: u64,
    kept: u64,
    counts: [u64; Finding::ALL.len()],
    longest_silence: i64,
    clock_offset: Option<i64>,
    last: Option<Timestamp>,
    ended_early: bool,
}

impl DataNotes {
    /// Notes on a file of `what` ("bars", "quotes").
    #[must_use]
    pub fn of(what: impl Into<String>) -> Self {
        Self { what: what.into(), ..Self::default() }
    }

    /// What the file holds.
    #[must_use]
    pub fn what(&self) -> &str {
        &self.what
    }

    /// Rows that were read.
    #[must_use]
    pub fn rows(&self) -> u64 {
        self.rows
    }

    /// Rows that came of them: fewer where some are left out, more where a row means several changes.
    #[must_use]
    pub fn kept(&self) -> u64 {
        self.kept
    }

    /// Of how many rows `finding` was found.
    #[must_use]
    pub fn count(&self, finding: Finding) -> u64 {
        self.counts.get(finding as usize).copied().unwrap_or_default()
    }

    /// The longest time between two rows [ns].
    #[must_use]
    pub fn longest_silence(&self) -> i64 {
        self.longest_silence
    }

    /// What was added to the local clock [ns]; none where there is no such clock.
    #[must_use]
    pub fn clock_offset(&self) -> Option<i64> {
        self.clock_offset
    }

    /// When the last row was known.
    #[must_use]
    pub fn last(&self) -> Option<Timestamp> {
        self.last
    }

    /// Whether the data end more than `max_gap` before they should: the symbol has vanished.
    #[must_use]
    pub fn ended_early(&self) -> bool {
        self.ended_early
    }

    /// `rows` more rows were read.
    pub fn read(&mut self, rows: u64) {
        self.rows += rows;
    }

    /// `finding` was found of a row.
    pub fn found(&mut self, finding: Finding) {
        if let Some(count) = self.counts.get_mut(finding as usize) {
            *count += 1;
        }
    }

    /// So much is added to the local clock [ns].
    pub fn set_clock_offset(&mut self, offset: i64) {
        self.clock_offset = Some(offset);
    }

    /// A row that is kept was known at `time`; a silence before it of more than `max_gap` [ns] is counted.
    pub fn gave(&mut self, time: Timestamp, max_gap: Option<i64>) {
        self.kept += 1;
        if let Some(before) = self.last.replace(time) {
            let silence = time - before;
            self.longest_silence = self.longest_silence.max(silence);
            if max_gap.is_some_and(|most| silence > most) {
                self.found(Finding::Gap);
            }
        }
    }

    /// The data are at their end, and should have reached to `until`, or up to `max_gap` [ns] before.
    pub fn end(&mut self, until: Option<Timestamp>, max_gap: Option<i64>) {
        let late = |last: Timestamp| until.is_some_and(|until| until - last > max_gap.unwrap_or(i64::MAX));
        self.ended_early = self.last.is_some_and(late);
    }

    /// What a reader of results should know, a sentence each; nothing where nothing was found.
    #[must_use]
    pub fn lines(&self) -> Vec<String> {
        let what = &self.what;
        let counted = Finding::ALL.into_iter().filter(|finding| self.count(*finding) > 0).map(|finding| {
            let left_out = match finding.treatment() {
                Treatment::Refused | Treatment::LeftOut => ", and are left out",
                Treatment::Mended | Treatment::Kept => "",
            };
            format!("{what}: {} of {} rows {}{left_out}", self.count(finding), self.rows, finding.title())
        });
        let mut lines: Vec<String> = counted.collect();
        if self.count(Finding::Gap) > 0 {
            lines.push(format!("{what}: the longest silence is {} s", self.longest_silence as f64 / 1e9));
        }
        if let Some(offset) = self.clock_offset.filter(|offset| *offset != 0) {
            lines.push(format!("{what}: {} s are added to the local clock", offset as f64 / 1e9));
        }
        if let (true, Some(last)) = (self.ended_early, self.last) {
            lines.push(format!("{what}: they end early, at {last}"));
        }
        lines
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_finding_has_its_own_count_and_line() {
        for (number, finding) in Finding::ALL.into_iter().enumerate() {
            assert_eq!(finding as usize, number, "the counts go by number");
            let mut notes = DataNotes::of("quotes");
            notes.read(7);
            notes.found(finding);
            assert!(Finding::ALL.into_iter().all(|other| notes.count(other) == u64::from(other == finding)));
            assert!(notes.lines()[0].starts_with(&format!("quotes: 1 of 7 rows {}", finding.title())));
        }
        assert!(DataNotes::of("bars").lines().is_empty());
    }

    #[test]
    fn silences_and_an_early_end_are_told() {
        let mut notes = DataNotes::of("trades");
        for second in [0, 1, 11, 12] {
            notes.gave(Timestamp(second * Timestamp::NANOS), Some(5 * Timestamp::NANOS));
        }
        assert_eq!((notes.count(Finding::Gap), notes.longest_silence(), notes.kept()), (1, 10 * Timestamp::NANOS, 4));
        notes.end(Some(Timestamp(17 * Timestamp::NANOS)), Some(5 * Timestamp::NANOS));
        assert!(!notes.ended_early());
        notes.end(Some(Timestamp(18 * Timestamp::NANOS)), Some(5 * Timestamp::NANOS));
        assert!(notes.ended_early() && notes.lines().last().unwrap().contains("they end early, at 1970-01-01T00:00:12Z"));
    }
}
