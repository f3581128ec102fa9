//! Whose columns a file of market data has.

use serde::{Deserialize, Serialize};

use super::data_table::FeedKind;
use super::stamp::Stamp;

/// Whose columns a file of market data has: what they are called, in which units, and what a row means. It is declared,
/// and never guessed from a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Layout {
    /// The contract's: `ts` and what else a kind of data has; of books, changes by price.
    #[default]
    Trueup,
    /// The contract's, of books by order.
    TrueupOrders,
    /// Differential depth of a Binance futures stream, and a snapshot.
    BinanceDepth,
    /// Best bid and ask of a Binance stream.
    BinanceBookTicker,
    /// Trades of a Binance stream.
    BinanceTrades,
    /// What QuantConnect's Lean keeps: local times, prices x10000.
    Lean,
    /// Databento's market by order.
    DatabentoMbo,
    /// Order events of Bitstamp, as recorded for the package ob-analytics.
    BitstampL3,
}

impl Layout {
    /// All there are.
    pub const ALL: [Self; 8] = [
        Self::Trueup,
        Self::TrueupOrders,
        Self::BinanceDepth,
        Self::BinanceBookTicker,
        Self::BinanceTrades,
        Self::Lean,
        Self::DatabentoMbo,
        Self::BitstampL3,
    ];

    /// The word for it in documents.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Trueup => "trueup",
            Self::TrueupOrders => "trueup_orders",
            Self::BinanceDepth => "binance_depth",
            Self::BinanceBookTicker => "binance_book_ticker",
            Self::BinanceTrades => "binance_trades",
            Self::Lean => "lean",
            Self::DatabentoMbo => "databento_mbo",
            Self::BitstampL3 => "bitstamp_l3",
        }
    }

    /// Whether its books are told order by order, and not price by price.
    #[must_use]
    pub fn tells_orders(self) -> bool {
        matches!(self, Self::TrueupOrders | Self::DatabentoMbo | Self::BitstampL3)
    }

    /// The kinds of data a file of it can hold.
    #[must_use]
    pub fn kinds(self) -> &'static [FeedKind] {
        match self {
            Self::Trueup => &[FeedKind::Bars, FeedKind::Quotes, FeedKind::Trades, FeedKind::Book, FeedKind::Actions],
            Self::TrueupOrders | Self::BinanceDepth | Self::BitstampL3 => &[FeedKind::Book],
            Self::BinanceBookTicker => &[FeedKind::Quotes],
            Self::BinanceTrades => &[FeedKind::Trades],
            Self::Lean => &[FeedKind::Bars, FeedKind::Quotes, FeedKind::Trades],
            Self::DatabentoMbo => &[FeedKind::Trades, FeedKind::Book],
        }
    }

    /// Whether its books are told order by order (L3), and not price by price (L2).
    #[must_use]
    pub fn is_by_order(self) -> bool {
        matches!(self, Self::TrueupOrders | Self::DatabentoMbo | Self::BitstampL3)
    }

    /// Whether it is one of the contract's own, whose columns and clocks are for the document to declare.
    #[must_use]
    pub fn is_own(self) -> bool {
        matches!(self, Self::Trueup | Self::TrueupOrders)
    }

    /// Whether each of its rows has the time of a second clock, that of whoever recorded it.
    #[must_use]
    pub fn has_local_clock(self) -> bool {
        !matches!(self, Self::Trueup | Self::TrueupOrders | Self::Lean)
    }

    /// What one unit of a price in the file is worth where nothing else is declared [currency]: 1, but in Lean's files of
    /// stocks, where prices are integers x10000 (those of crypto need `price_scale = 1`), and in Databento's, in 1e-9.
    #[must_use]
    pub fn price_scale(self) -> f64 {
        match self {
            Self::Lean => 1e-4,
            Self::DatabentoMbo => 1e-9,
            _ => 1.0,
        }
    }

    /// What the time of a bar is, where the layout says it.
    #[must_use]
    pub fn stamp(self) -> Option<Stamp> {
        (self == Self::Lean).then_some(Stamp::Open)
    }
}
