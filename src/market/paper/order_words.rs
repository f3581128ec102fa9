//! The words that logs have for kinds of orders and for what became of them.

/// What kind of order it was.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum OrderWords {
    /// Takes what there is.
    Market,
    /// Trades at its limit or better.
    Limit,
    /// Becomes a market order at its stop price.
    Stop,
    /// Becomes a limit order at its stop price.
    StopLimit,
    /// A stop that follows the market.
    TrailingStop,
    /// Takes part in the opening.
    MarketOnOpen,
    /// Takes part in the opening, at its limit or better.
    LimitOnOpen,
    /// Takes part in the close.
    MarketOnClose,
    /// Takes part in the close, at its limit or better.
    LimitOnClose,
    /// A limit order that never takes.
    PostOnly,
    /// Any other, by the log's word in lower case.
    Other(String),
}

impl OrderWords {
    /// Those with a word of their own.
    pub const NAMED: [Self; 10] = [
        Self::Market,
        Self::Limit,
        Self::Stop,
        Self::StopLimit,
        Self::TrailingStop,
        Self::MarketOnOpen,
        Self::LimitOnOpen,
        Self::MarketOnClose,
        Self::LimitOnClose,
        Self::PostOnly,
    ];

    /// Its word in the tables that are written; the same words as a backtest's.
    #[must_use]
    pub fn word(&self) -> &str {
        match self {
            Self::Market => "market",
            Self::Limit => "limit",
            Self::Stop => "stop",
            Self::StopLimit => "stop_limit",
            Self::TrailingStop => "trailing_stop",
            Self::MarketOnOpen => "market_on_open",
            Self::LimitOnOpen => "limit_on_open",
            Self::MarketOnClose => "market_on_close",
            Self::LimitOnClose => "limit_on_close",
            Self::PostOnly => "post_only",
            Self::Other(word) => word,
        }
    }

    /// The kind that `word` stands for, in any case: the words of [`word`](Self::word), and those of brokers that mean the same.
    #[must_use]
    pub fn of_word(word: &str) -> Self {
        let word = word.trim().to_lowercase().replace([' ', '-'], "_");
        match word.as_str() {
            "market" | "mkt" => Self::Market,
            "limit" | "lmt" => Self::Limit,
            "stop" | "stp" | "stop_market" | "stop_loss" | "take_profit_market" | "stoploss" => Self::Stop,
            "stop_limit" | "stp_lmt" | "stplmt" | "stop_loss_limit" | "take_profit_limit" => Self::StopLimit,
            "trailing_stop" | "trail" | "trailing_stop_market" => Self::TrailingStop,
            "market_on_open" | "moo" => Self::MarketOnOpen,
            "limit_on_open" | "loo" => Self::LimitOnOpen,
            "market_on_close" | "moc" => Self::MarketOnClose,
            "limit_on_close" | "loc" => Self::LimitOnClose,
            "post_only" | "limit_maker" => Self::PostOnly,
            _ => Self::Other(word),
        }
    }
}

/// What became of an order. Some of it may be filled, whatever its end.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum PaperStatus {
    /// It works still.
    Open,
    /// All of it is filled.
    Filled,
    /// It was withdrawn.
    Cancelled,
    /// Broker or exchange refused it.
    Rejected,
    /// Its time is over.
    Expired,
    /// Another order took its place.
    Replaced,
    /// Any other, by the log's word in lower case.
    Other(String),
}

impl PaperStatus {
    /// Its word in the tables that are written.
    #[must_use]
    pub fn word(&self) -> &str {
        match self {
            Self::Open => "open",
            Self::Filled => "filled",
            Self::Cancelled => "cancelled",
            Self::Rejected => "rejected",
            Self::Expired => "expired",
            Self::Replaced => "replaced",
            Self::Other(word) => word,
        }
    }

    /// The status that `word` stands for, in any case.
    #[must_use]
    pub fn of_word(word: &str) -> Self {
        let word = word.trim().to_lowercase().replace([' ', '-'], "_");
        match word.as_str() {
            "open"
            | "new"
            | "accepted"
            | "working"
            | "partially_filled"
            | "pending_new"
            | "submitted"
            | "initialized"
            | "held"
            | "triggered"
            | "pending_cancel"
            | "pending_replace"
            | "accepted_for_bidding"
            | "pending_update" => Self::Open,
            "filled" | "closed" => Self::Filled,
            "cancelled" | "canceled" => Self::Cancelled,
            "rejected" | "denied" | "failed" => Self::Rejected,
            "expired" | "expired_in_match" => Self::Expired,
            "replaced" => Self::Replaced,
            _ => Self::Other(word),
        }
    }

    /// Whether nothing more can happen to the order; not known of other words.
    #[must_use]
    pub fn is_final(&self) -> bool {
        !matches!(self, Self::Open | Self::Other(_))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_words_that_are_written_are_read_again() {
        for kind in OrderWords::NAMED {
            assert_eq!(OrderWords::of_word(kind.word()), kind);
        }
        assert_eq!(OrderWords::of_word("STP LMT"), OrderWords::StopLimit);
        assert_eq!(OrderWords::of_word("Iceberg"), OrderWords::Other("iceberg".into()));
        use PaperStatus::{Cancelled, Expired, Filled, Open, Rejected, Replaced};
        for status in [Open, Filled, Cancelled, Rejected, Expired, Replaced] {
            assert_eq!(PaperStatus::of_word(status.word()), status);
        }
        assert_eq!(PaperStatus::of_word("CANCELED"), Cancelled);
        assert!(!PaperStatus::of_word("calculated").is_final());
    }
}
