//! How the account of a run is kept beyond cash in one currency: terms, rates and corporate actions, and what became of
//! them.

use std::sync::Arc;

use crate::sim2real::Timestamp;

use super::agenda::{Agenda, Due, Phase};
use super::{
    BacktestError, Cash, Event, Fraction, History, Increments, Instrument, Ledger, LedgerError, MoneyError, Price, Quantity,
    Session, Settings, Terms,
};

/// How the account of a run is kept.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Account {
    /// Names of the currencies, first that of the run. Cash at the start is in that one, and there is none in others.
    pub currencies: Vec<String>,
    /// The terms each instrument is held on.
    pub terms: Vec<Terms>,
    /// What each currency but the first is worth, in their order.
    pub rates: Vec<Rate>,
    /// Dividends and splits. Those of one instant happen in the order in which they stand here.
    pub actions: Vec<CorporateAction>,
}

/// What one unit of a currency is worth in the base currency.
#[derive(Debug, Clone, PartialEq)]
pub enum Rate {
    /// Always the same.
    Constant(Price),
    /// In force from an instant on, at which it is known: in the order of time.
    Known(Vec<(Timestamp, Price)>),
    /// The latest price of an instrument of the run, by its number.
    PriceOf(usize),
}

/// Something that happens to every unit of an instrument.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CorporateAction {
    /// The ex-instant: from then on units are without the dividend, or split. Bars that end then are of the time before.
    pub at: Timestamp,
    /// Number of the instrument.
    pub instrument: usize,
    /// What happens.
    pub kind: ActionKind,
}

/// What can happen to every unit of an instrument.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ActionKind {
    /// A cash dividend. Who is long receives it, who is short pays it.
    Dividend {
        /// For one unit, in the instrument's currency.
        per_unit: Price,
        /// The part of it that is withheld as tax, from long positions alone.
        withholding: Fraction,
    },
    /// A split: `new` units for `old`.
    Split {
        /// New units, above 0,
        new: u32,
        /// for so many old ones, above 0.
        old: u32,
    },
}

/// A corporate action as it was booked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BookedAction {
    /// What happened.
    pub action: CorporateAction,
    /// What was held before, negative when short.
    pub before: Quantity,
    /// What was held after.
    pub after: Quantity,
    /// What was received: a dividend after tax, or what was no whole lot after a split; below 0 when short
    /// [currency of the instrument].
    pub received: Cash,
    /// Number of fills that were booked before.
    pub fills: usize,
}

/// The account fell below what it takes to keep its positions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MarginCall {
    /// When.
    pub at: Timestamp,
    /// Equity [base currency].
    pub equity: Cash,
    /// Maintenance margin [base currency].
    pub required: Cash,
}

/// What became of an account beyond its fills.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct AccountRecord {
    /// Names of the currencies in the order of the ledger's balances; none where there is only that of the run.
    pub currencies: Vec<String>,
    /// Corporate actions, in the order in which they happened.
    pub actions: Vec<BookedAction>,
    /// Margin calls: how often equity fell below maintenance.
    pub margin_calls: Vec<MarginCall>,
}

impl Account {
    /// The account as far as anybody can know it at `now`: without later actions and rates.
    pub(super) fn until(&self, now: Timestamp) -> Self {
        let known = |rate: &Rate| match rate {
            Rate::Known(rates) => Rate::Known(rates.iter().copied().filter(|(at, _)| *at <= now).collect()),
            rate => rate.clone(),
        };
        Self {
            currencies: self.currencies.clone(),
            terms: self.terms.clone(),
            rates: self.rates.iter().map(known).collect(),
            actions: self.actions.iter().copied().filter(|action| action.at <= now).collect(),
        }
    }

    /// Holds it to what it can be for `instruments`.
    pub(super) fn check(&self, instruments: &[Instrument]) -> Result<(), BacktestError> {
        let refuse = |place: String, error| Err(BacktestError::Account { place, error });
        if self.terms.len() != instruments.len() {
            return Err(BacktestError::Terms { terms: self.terms.len(), instruments: instruments.len() });
        }
        let there_are = self.currencies.len();
        if there_are == 0 {
            return refuse("the account".into(), LedgerError::NoCurrency);
        }
        for (terms, instrument) in self.terms.iter().zip(instruments) {
            if terms.currency >= there_are {
                let error = LedgerError::UnknownCurrency { currency: terms.currency, there_are };
                return refuse(instrument.symbol.clone(), error);
            }
        }
        if self.rates.len() + 1 != there_are {
            return Err(BacktestError::Rates { rates: self.rates.len(), currencies: there_are - 1 });
        }
        for (k, rate) in self.rates.iter().enumerate() {
            rate.check(k + 1, &self.currencies[k + 1], &self.terms)?;
        }
        Ok(())
    }

    /// Holds corporate actions to what they can be beside the bars of their instruments.
    pub(super) fn check_actions(&self, instruments: &[Instrument], histories: &[History]) -> Result<(), BacktestError> {
        let refuse = |place: String, error| Err(BacktestError::Account { place, error });
        for action in &self.actions {
            let place = |symbol: &str| format!("{symbol} at {}", action.at);
            let Some(instrument) = instruments.get(action.instrument) else {
                let error = LedgerError::UnknownInstrument { instrument: action.instrument, there_are: instruments.len() };
                return refuse(place("an action"), error);
            };
            match action.kind {
                ActionKind::Dividend { withholding, .. } if withholding > Fraction::ONE => {
                    return refuse(place(&instrument.symbol), LedgerError::Withholding { rate: withholding.to_f64() });
                }
                ActionKind::Split { new, old } if new == 0 || old == 0 => {
                    return refuse(place(&instrument.symbol), LedgerError::Split { new, old, lot: instrument.lot_size });
                }
                ActionKind::Dividend { .. } | ActionKind::Split { .. } => {}
            }
            let bars = histories.get(action.instrument).map_or(&[][..], History::bars);
            let next = bars.partition_point(|bar| bar.known_at <= action.at);
            if let Some(bar) = bars.get(next).filter(|bar| bar.open_at < action.at) {
                let (symbol, at) = (instrument.symbol.clone(), action.at);
                return Err(BacktestError::WithinBar { symbol, at, open_at: bar.open_at, known_at: bar.known_at });
            }
        }
        Ok(())
    }
}

impl Rate {
    fn check(&self, currency: usize, name: &str, terms: &[Terms]) -> Result<(), BacktestError> {
        let refuse = |error| Err(BacktestError::Account { place: format!("the rate of {name}"), error });
        match self {
            Self::Constant(rate) if rate.0 <= 0 => refuse(LedgerError::Rate { currency, rate: rate.to_f64() }),
            Self::Known(rates) => {
                if let Some((_, rate)) = rates.iter().find(|(_, rate)| rate.0 <= 0) {
                    return refuse(LedgerError::Rate { currency, rate: rate.to_f64() });
                }
                match rates.windows(2).find(|pair| pair[1].0 <= pair[0].0) {
                    Some(pair) => Err(BacktestError::RateOrder { currency: name.to_owned(), at: pair[1].0 }),
                    None => Ok(()),
                }
            }
            Self::PriceOf(instrument) => match terms.get(*instrument) {
                // A rate is told in the base currency.
                Some(Terms { currency: 0, .. }) => Ok(()),
                _ => refuse(LedgerError::UnknownInstrument { instrument: *instrument, there_are: terms.len() }),
            },
            Self::Constant(_) => Ok(()),
        }
    }
}

/// What a session keeps of an account under way.
#[derive(Debug, Clone)]
pub(super) struct Keeping {
    pub account: Arc<Account>,
    /// How many rows of each rate are in force.
    pub rows: Vec<usize>,
    /// When the next row of any rate is known.
    pub next_rate: Timestamp,
    /// The currency whose rate each instrument tells.
    pub tells: Vec<Option<usize>>,
    /// The last split of each instrument.
    pub split: Vec<Option<(Timestamp, Ratio)>>,
    /// Whether any instrument requires margin.
    pub margin: bool,
    /// Whether equity was below maintenance when it was last looked at.
    pub called: bool,
    pub record: AccountRecord,
}

impl Keeping {
    /// The account at the start and what is kept of it, with its actions from `origin` on put on the agenda.
    pub fn start(settings: &Settings, instruments: usize, origin: Timestamp, agenda: &mut Agenda) -> (Ledger, Option<Self>) {
        let plain = || Ledger::new(settings.cash, instruments);
        let Some(account) = &settings.account else { return (plain(), None) };
        let mut opening = vec![Cash::ZERO; account.currencies.len()];
        if let Some(base) = opening.first_mut() {
            *base = settings.cash;
        }
        // A backtest was held to both before.
        let mut ledger = Ledger::with_terms(&opening, account.terms.clone()).unwrap_or_else(|_| plain());
        let mut tells = vec![None; instruments];
        for (k, rate) in account.rates.iter().enumerate() {
            match rate {
                Rate::Constant(rate) => drop(ledger.set_rate(k + 1, *rate)),
                Rate::PriceOf(instrument) => tells[*instrument] = Some(k + 1),
                Rate::Known(_) => {}
            }
        }
        let mut order: Vec<usize> = (0..account.actions.len()).collect();
        order.sort_by_key(|k| (account.actions[*k].at, account.actions[*k].instrument, *k));
        for k in order {
            // Before the first data nothing is held, and nothing works.
            if account.actions[k].at >= origin {
                agenda.put(account.actions[k].at, Phase::Acts, Due::Action(k));
            }
        }
        let requires = |terms: &Terms| terms.long != Default::default() || terms.short != Default::default();
        let keeping = Self {
            rows: vec![0; account.rates.len()],
            next_rate: Timestamp::MIN,
            tells,
            split: vec![None; instruments],
            margin: account.terms.iter().any(requires),
            called: false,
            record: AccountRecord { currencies: account.currencies.clone(), ..AccountRecord::default() },
            account: Arc::clone(account),
        };
        (ledger, Some(keeping))
    }
}

/// By which a split changes quantities, and by whose inverse it changes prices.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Ratio {
    pub new: u32,
    pub old: u32,
}

impl Ratio {
    /// New units for one old one.
    pub fn to_f64(self) -> f64 {
        f64::from(self.new) / f64::from(self.old)
    }

    /// A price after the split, to the nearest 1e-9, half away from 0.
    pub fn price(self, price: Price) -> Price {
        Price(nearest(price.0, self.old, self.new))
    }

    /// A quantity after the split, to the nearest 1e-9.
    pub fn quantity(self, quantity: Quantity) -> Quantity {
        Quantity(nearest(quantity.0, self.new, self.old))
    }

    /// A price after the split, where it is on a tick to the last unit.
    pub fn price_on_tick(self, price: Price, increments: Increments) -> Option<Price> {
        let exact = i128::from(price.0) * i128::from(self.old) % i128::from(self.new) == 0;
        Some(self.price(price)).filter(|price| exact && price.0 > 0 && increments.on_tick(*price))
    }

    /// A quantity after the split, where it is a whole number of lots to the last unit.
    pub fn whole_lots(self, quantity: Quantity, increments: Increments) -> Option<Quantity> {
        let exact = i128::from(quantity.0) * i128::from(self.new) % i128::from(self.old) == 0;
        Some(self.quantity(quantity)).filter(|quantity| exact && increments.holds(*quantity))
    }
}

/// `number * by / over`, to the nearest, half away from 0, as far as 64 bits reach.
fn nearest(number: i64, by: u32, over: u32) -> i64 {
    let (exact, over) = (i128::from(number) * i128::from(by), i128::from(over));
    let size = (2 * exact.abs() + over) / (2 * over) * exact.signum();
    i64::try_from(size).unwrap_or(if size > 0 { i64::MAX } else { i64::MIN })
}

impl Session {
    /// The error of an amount at an event.
    pub(super) fn money(&self, event: Event, error: MoneyError) -> BacktestError {
        let symbol = &self.setup.instruments[event.instrument].symbol;
        self.amount(format!("{symbol} at {}", event.time), error)
    }

    /// The error of an amount at `place`: a currency without a rate is told by its name.
    pub(super) fn amount(&self, place: String, error: MoneyError) -> BacktestError {
        let account = self.setup.settings.account.as_ref();
        match error {
            MoneyError::NoRate { currency } => {
                let name = account.and_then(|account| account.currencies.get(currency)).cloned().unwrap_or_default();
                BacktestError::NoRate { place, currency: name }
            }
            error => BacktestError::Money { place, error },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three for two at 10.01: a third is no whole 1e-9, and 1.5 units are no whole lot.
    #[test]
    fn a_ratio_is_exact_or_says_so() {
        let ratio = Ratio { new: 3, old: 2 };
        let instrument = Instrument {
            symbol: "A".into(),
            tick_size: 0.01,
            lot_size: 1.0,
            average_daily_volume: None,
            daily_volatility: None,
        };
        let steps = Increments::of(&instrument).unwrap();
        assert_eq!(ratio.price(Price(10_010_000_000)), Price(6_673_333_333));
        assert_eq!(ratio.price(Price(-5)), Price(-3), "half away from 0");
        assert_eq!(ratio.price_on_tick(Price(10_010_000_000), steps), None);
        assert_eq!(ratio.price_on_tick(Price(12_000_000_000), steps), Some(Price(8_000_000_000)));
        assert_eq!(ratio.whole_lots(Quantity(1_000_000_000), steps), None);
        assert_eq!(ratio.whole_lots(Quantity(4_000_000_000), steps), Some(Quantity(6_000_000_000)));
        assert_eq!(ratio.quantity(Quantity(i64::MAX)), Quantity(i64::MAX), "as far as 64 bits reach");
    }
}
