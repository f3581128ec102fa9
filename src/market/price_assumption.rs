//! The price a backtest assumes its orders fill at.

use std::fmt;

use super::quote::Quote;
use super::{Seen, Side, Tape};

/// Which price a twin assumes, as `[assumptions] price` names it: the one in force when an order was decided.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum PriceAssumption {
    /// Midway between best bid and best ask.
    Mid,
    /// The best price on the side the order takes from.
    Touch,
    /// The last trade.
    Last,
    /// The close of the last bar known.
    BarClose,
    /// The open of the next bar.
    NextOpen,
}

impl PriceAssumption {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Mid, Self::Touch, Self::Last, Self::BarClose, Self::NextOpen];

    /// Its word in a twin.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Mid => "mid",
            Self::Touch => "touch",
            Self::Last => "last",
            Self::BarClose => "bar_close",
            Self::NextOpen => "next_open",
        }
    }

    /// The assumption `word` stands for.
    #[must_use]
    pub fn of_word(word: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|assumption| assumption.word() == word)
    }

    /// The part of a tape it needs and `tape` does not have.
    #[must_use]
    pub fn lacks(self, tape: &Tape) -> Option<&'static str> {
        let (name, missing) = match self {
            Self::Mid | Self::Touch => ("quotes", tape.quotes().is_empty()),
            Self::Last => ("trades", tape.prints().is_empty()),
            Self::BarClose | Self::NextOpen => ("bars", tape.bars().is_empty()),
        };
        missing.then_some(name)
    }

    /// The price as it stands for an order of `side` that has `seen` that much of `tape` [currency], where it is known.
    #[must_use]
    pub fn price(self, tape: &Tape, side: Side, seen: Seen) -> Option<f64> {
        self.price_beside(tape.quote(seen), tape, side, seen)
    }

    /// The same, for whoever has looked the quote up already.
    pub(super) fn price_beside(self, quote: Option<Quote<'_>>, tape: &Tape, side: Side, seen: Seen) -> Option<f64> {
        match self {
            Self::Mid => quote?.mid(),
            Self::Touch => Some(quote?.opposite(side).first()?.price),
            Self::Last => tape.last_price(seen),
            Self::BarClose => tape.bar_close(seen),
            Self::NextOpen => tape.next_open(seen),
        }
    }
}

impl fmt::Display for PriceAssumption {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.word())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_word_means_itself() {
        for assumption in PriceAssumption::ALL {
            assert_eq!(PriceAssumption::of_word(assumption.word()), Some(assumption));
            assert!(assumption.lacks(&Tape::default()).is_some());
        }
        assert_eq!(PriceAssumption::of_word("midd"), None);
    }
}
