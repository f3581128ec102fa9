//! Days on which an effect is there and cannot be seen for what it is.

use super::client::Habits;
use super::climate::Climate;
use super::plan::Circumstances;

/// What is peculiar about the day to learn from, or about both.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Peculiar {
    /// Orders of one size: how a cost grows with it is not to be seen.
    OneSize,
    /// Orders so far apart that nothing is left of the last when the next comes.
    FarApart,
    /// A market that hardly moves.
    Calm,
    /// Orders too small to be cut.
    Small,
    /// Quantities that are whole lots anyway.
    WholeLots,
    /// No word of what was seen.
    Unsaid,
    /// A spread that is the same all day.
    OneSpread,
}

impl Peculiar {
    /// What conceals `id`.
    pub fn of(id: &str) -> Self {
        match id {
            "transient_impact" => Self::FarApart,
            "command_delay" => Self::Calm,
            "participation_cap" => Self::Small,
            "lot_size" => Self::WholeLots,
            "stale_quotes" => Self::Unsaid,
            "half_spread" => Self::OneSpread,
            _ => Self::OneSize,
        }
    }

    /// In words.
    pub fn told(self) -> &'static str {
        match self {
            Self::OneSize => "orders of one size",
            Self::FarApart => "orders far apart",
            Self::Calm => "a market that hardly moves",
            Self::Small => "orders too small to be cut",
            Self::WholeLots => "quantities in whole lots",
            Self::Unsaid => "no word of what was seen",
            Self::OneSpread => "one spread all day",
        }
    }

    /// Whether the day to test on is as peculiar.
    fn lasts(self) -> bool {
        matches!(self, Self::OneSize | Self::FarApart | Self::Calm | Self::Unsaid | Self::OneSpread)
    }

    /// Makes a market and what is known of it peculiar.
    pub fn shape(self, climate: &mut Climate, circumstances: &mut Circumstances) {
        match self {
            Self::Calm => (climate.volatility, climate.breathing, climate.flicker) = (4e-5, 0.0, 0.0),
            Self::OneSpread => climate.breathing = 0.0,
            Self::Unsaid => circumstances.tells_seen = false,
            _ => {}
        }
    }

    /// The habits of a client on one of the days, where they are `usual` otherwise.
    pub fn habits(self, usual: &Habits, learnt: bool, middle: f64, lot: f64) -> Habits {
        let mut habits = usual.clone();
        if !learnt && !self.lasts() {
            return habits;
        }
        match self {
            Self::OneSize => habits.sizes = (middle, middle),
            Self::FarApart => (habits.count, habits.haste) = (usual.count / 2, 0.0),
            Self::Small => habits.sizes = (usual.sizes.0 * 0.1, usual.sizes.0 * 0.5),
            Self::WholeLots => habits.whole = lot,
            Self::Calm | Self::Unsaid | Self::OneSpread => {}
        }
        habits
    }
}

/// What may be there and not be seen.
pub(super) const UNREACHED: [&str; 8] = [
    "sqrt_impact",
    "transient_impact",
    "command_delay",
    "participation_cap",
    "linear_impact",
    "lot_size",
    "stale_quotes",
    "half_spread",
];
