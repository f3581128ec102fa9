//! On what terms an instrument is held: currency, multiplier and margin.

use crate::market::MoneyError;

use super::{Fraction, Multiplier};

/// The terms an instrument is held on. By default: in the base currency, one unit of the underlying, without margin.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Terms {
    /// Number of the currency its price, fees and dividends are in; 0 is the base currency.
    pub currency: usize,
    /// Units of the underlying in one unit traded.
    pub multiplier: Multiplier,
    /// What long positions require.
    pub long: Requirement,
    /// What short positions require.
    pub short: Requirement,
}

/// What equity a position requires, as fractions of its value at the mark.
///
/// Equity has the proceeds of a short sale and the debt of shares already in it. Where a rule counts the proceeds as part of
/// the deposit, as Regulation T does with its 150 % of a short sale, the fraction here is what remains: 0.5.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Requirement {
    /// To open it.
    pub initial: Fraction,
    /// To keep it.
    pub maintenance: Fraction,
}

impl Terms {
    /// These terms with the margin of US shares: 50 % to open, 25 % to keep; short, 150 % and 130 % of the value, of which
    /// the proceeds are 100 %.
    ///
    /// Sources: Regulation T, 12 CFR 220.12 (a) and (c) (initial); FINRA Rule 4210 (c) (maintenance, for shorts at 5 dollars
    /// and more).
    #[must_use]
    pub fn with_regulation_t(self) -> Self {
        Self {
            long: Requirement { initial: Fraction::percent(50), maintenance: Fraction::percent(25) },
            short: Requirement { initial: Fraction::percent(50), maintenance: Fraction::percent(30) },
            ..self
        }
    }
}

/// What an account refuses. It is then as it was.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LedgerError {
    /// An amount cannot be held.
    #[error(transparent)]
    Money(#[from] MoneyError),
    /// An account without a currency.
    #[error(
        "the account has no currency\nhint: give its opening cash, first that of the base currency, 0 where there is none"
    )]
    NoCurrency,
    /// A currency that the account does not have.
    #[error(
        "there is no currency {currency}: the account has {there_are}\nhint: give an opening cash, 0 too, for each currency"
    )]
    UnknownCurrency {
        /// Number of the currency.
        currency: usize,
        /// How many there are.
        there_are: usize,
    },
    /// An instrument that the account does not have.
    #[error("there is no instrument {instrument}: the account has {there_are}\nhint: give terms for each instrument")]
    UnknownInstrument {
        /// Number of the instrument.
        instrument: usize,
        /// How many there are.
        there_are: usize,
    },
    /// A rate that is not above 0, or of the base currency.
    #[error(
        "currency {currency} at a rate of {rate}\nhint: rates are base currency per unit, above 0; that of currency 0 is 1"
    )]
    Rate {
        /// Number of the currency.
        currency: usize,
        /// The rate found.
        rate: f64,
    },
    /// A conversion of nothing, or of a currency to itself.
    #[error(
        "a conversion of {amount} of currency {from} to currency {to}\nhint: convert an amount above 0 to another currency"
    )]
    Conversion {
        /// From which currency.
        from: usize,
        /// To which.
        to: usize,
        /// The amount found.
        amount: f64,
    },
    /// A rate of withholding above 1.
    #[error("a withholding of {rate} of a dividend\nhint: it is a fraction from 0 to 1: 0.15 is 15 %")]
    Withholding {
        /// The rate found.
        rate: f64,
    },
    /// A split without new or old units, or with no lot.
    #[error(
        "a split of {new} new for {old} old units in lots of {lot}\nhint: all three are above 0; 4 for 1 is a split, 1 for 10 a reverse split"
    )]
    Split {
        /// New units.
        new: u32,
        /// For so many old ones.
        old: u32,
        /// Lot [units].
        lot: f64,
    },
}
