//! A case: what a user would bring, and what is told after its diagnosis.

use serde::{Deserialize, Serialize};

use crate::conceal::{Concealed, Kind, Table};

/// Two days of orders, a twin, and the truth about them.
#[derive(Debug, Clone, PartialEq)]
pub struct TradingCase {
    /// What is traded.
    pub symbol: String,
    /// The price at which the twin fills orders.
    pub price: Assumed,
    /// Smallest step of the price [currency].
    pub tick: f64,
    /// Smallest step of the quantity that the twin knows of [units], where it says so.
    pub lot: Option<f64>,
    /// Units traded on an average day, as the twin has it.
    pub average_daily_volume: f64,
    /// Standard deviation of the daily return, as the twin has it (a fraction).
    pub daily_volatility: f64,
    /// The day to learn from.
    pub train: Day,
    /// The day to test on.
    pub test: Day,
    /// What is told after the diagnosis.
    pub label: Label,
}

/// The tables of one day, with the columns of a log of orders.
#[derive(Debug, Clone, PartialEq)]
pub struct Day {
    /// A row an order.
    pub orders: Table,
    /// A row a fill.
    pub fills: Table,
    /// Bids and offers as they were displayed.
    pub quotes: Table,
    /// Trades that were printed, where the data have them.
    pub trades: Option<Table>,
}

/// The price at which a twin fills orders, as it stands when they are decided.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Assumed {
    /// The best price of the other side.
    Touch,
    /// Midway between bid and offer.
    Mid,
}

impl Assumed {
    /// Its word in a twin.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Touch => "touch",
            Self::Mid => "mid",
        }
    }
}

/// Whether the recorded market took notice of the orders.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum World {
    /// The tape shows the orders: their prints, and the mid as they have moved it. A fill pays the market as it then is.
    Live,
    /// The tape does not react; a fill is charged what earlier orders would have left.
    Paper,
}

/// How much of the book the tape shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Depth {
    /// Five levels a side, with sizes.
    FiveLevels,
    /// The best level, with its size.
    Touch,
    /// No more than the mid at each decision.
    MidsOnly,
}

/// The truth about a case.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Label {
    /// Number of the case.
    pub index: usize,
    /// What it is for.
    pub kind: Kind,
    /// What is concealed, by registries' names. Sizes are in standard deviations of the noise of the channel that shows an effect:
    /// of `noise` for costs, fees and what was seen, of `mid_noise` for moves of the recorded mid, of 0.02 for the part filled.
    pub effects: Vec<Concealed>,
    /// What is concealed that no registry has, and its size.
    pub outside: Option<(String, f64)>,
    /// Names that are neither right nor wrong: what these data cannot tell from the truth, or what is a part of it.
    pub tolerated: Vec<String>,
    /// The form of each effect, in words.
    pub forms: Vec<String>,
    /// Whether the recorded market took notice of the orders.
    pub world: World,
    /// How much of the book the tape shows.
    pub depth: Depth,
    /// Whether stamps of orders and fills are cut to a second.
    pub rounded: bool,
    /// Standard deviation of the noise in a fill's price [bps of the mid].
    pub noise: f64,
    /// Noise in words.
    pub noise_kind: String,
    /// Standard deviation of the moves of the mid over ten seconds, own impact left out [bps].
    pub mid_noise: f64,
    /// Units traded on an average day, really.
    pub average_daily_volume: f64,
    /// Standard deviation of the daily return, really (a fraction).
    pub daily_volatility: f64,
    /// Orders on the day to learn from, and on the day to test on.
    pub orders: [usize; 2],
    /// What is peculiar about the orders to learn from, in words; empty where nothing is.
    pub peculiar: String,
}
