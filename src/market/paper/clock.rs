//! What the times of a log are: whose clock they come from, what they stamp, and how fine they are.

use serde::Serialize;

use crate::sim2real::Timestamp;

/// A column of times of a [`PaperLog`](super::PaperLog).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum TimeColumn {
    /// [`PaperOrder::decided_at`](super::PaperOrder::decided_at).
    DecidedAt,
    /// [`PaperOrder::submitted_at`](super::PaperOrder::submitted_at).
    SubmittedAt,
    /// [`PaperOrder::ended_at`](super::PaperOrder::ended_at).
    EndedAt,
    /// [`PaperFill::filled_at`](super::PaperFill::filled_at).
    FilledAt,
}

impl TimeColumn {
    /// All there are.
    pub const ALL: [Self; 4] = [Self::DecidedAt, Self::SubmittedAt, Self::EndedAt, Self::FilledAt];

    /// Its name in the tables that are written.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::DecidedAt => "decided_at",
            Self::SubmittedAt => "submitted_at",
            Self::EndedAt => "ended_at",
            Self::FilledAt => "filled_at",
        }
    }
}

/// What a time stamps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum TimeMeaning {
    /// When the strategy decided, on its own clock.
    Decided,
    /// When the client made or sent the order, on its own clock.
    Submitted,
    /// When the broker or exchange took the order, on its clock.
    Accepted,
    /// When the exchange executed, on its clock.
    Executed,
    /// When the client was told, on its own clock: later than it happened by the latency of the report.
    Reported,
    /// When a bot asked and found it had happened: later by up to the time between two questions.
    Polled,
    /// When the record was changed last, for whatever reason: no earlier than it happened.
    Updated,
}

impl TimeMeaning {
    /// All there are.
    pub const ALL: [Self; 7] =
        [Self::Decided, Self::Submitted, Self::Accepted, Self::Executed, Self::Reported, Self::Polled, Self::Updated];

    /// Its word in the tables that are written.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Decided => "decided",
            Self::Submitted => "submitted",
            Self::Accepted => "accepted",
            Self::Executed => "executed",
            Self::Reported => "reported",
            Self::Polled => "polled",
            Self::Updated => "updated",
        }
    }

    /// The meaning that `word` stands for.
    #[must_use]
    pub fn of_word(word: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|meaning| meaning.word() == word)
    }

    /// What it says, to be put after "it is".
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Self::Decided => "when it was decided",
            Self::Submitted => "when the client made it",
            Self::Accepted => "when the broker took it",
            Self::Executed => "when it was executed",
            Self::Reported => "when the client was told",
            Self::Polled => "when the bot asked and found it",
            Self::Updated => "when the record changed last",
        }
    }
}

/// One column of times: where it comes from, and what it is.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct PaperClock {
    /// The column.
    pub column: TimeColumn,
    /// The name of the column or columns of the source it was read from.
    pub source: String,
    /// What it stamps.
    pub meaning: TimeMeaning,
    /// The finest step the values show [ns]; none where there are no values.
    pub resolution: Option<i64>,
    /// How many values there are.
    pub values: usize,
}

/// The coarsest of 1 minute, 1 s, 1 ms, 1 us and 1 ns of which all `times` are multiples [ns]: what their clock, or whoever
/// rounded them, shows at most. None where there are no times.
#[must_use]
pub fn resolution(times: impl Iterator<Item = Timestamp>) -> Option<i64> {
    const STEPS: [i64; 4] = [60_000_000_000, 1_000_000_000, 1_000_000, 1_000];
    let mut left = None;
    for time in times {
        let fits = |step: usize| STEPS.get(step).is_none_or(|step| time.0 % step == 0);
        let mut step = left.unwrap_or(0);
        while !fits(step) {
            step += 1;
        }
        left = Some(step);
    }
    left.map(|step| STEPS.get(step).copied().unwrap_or(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_resolution_is_the_coarsest_that_all_share() {
        let of = |times: &[i64]| resolution(times.iter().map(|t| Timestamp(*t)));
        assert_eq!(of(&[]), None);
        assert_eq!(of(&[0, 120_000_000_000]), Some(60_000_000_000));
        assert_eq!(of(&[60_000_000_000, 61_000_000_000]), Some(1_000_000_000));
        assert_eq!(of(&[1_000_000_000, 1_000_000, -3_000_000]), Some(1_000_000));
        assert_eq!(of(&[1_000_000_000, 7_000]), Some(1_000));
        assert_eq!(of(&[1_000_000_000, 7_001]), Some(1));
    }
}
