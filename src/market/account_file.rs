//! How the account of a run is read: terms from its document, rates and corporate actions from files.

use std::sync::Arc;

use crate::io::{
    DataEntry, FeedKind, Increase, InputError, InstrumentEntry, MarginEntry, RateSource, RunFile, Table, check_increasing,
    check_positive,
};
use crate::sim2real::Timestamp;

use super::account::{Account, ActionKind, CorporateAction, Rate};
use super::{Fraction, MoneyError, Multiplier, Price, Requirement, Terms};

/// What files say of a run's account, and how many rows each has, in the order of the run's `[[data]]` and `[[rate]]`.
#[derive(Debug, Clone, Default)]
pub(super) struct AccountFiles {
    actions: Vec<CorporateAction>,
    rates: Vec<Option<Vec<(Timestamp, Price)>>>,
}

impl AccountFiles {
    /// Reads the files of rates, and makes room for actions.
    pub fn read_rates(run: &RunFile) -> Result<Self, InputError> {
        let rates = run.rates.iter().map(|entry| match &entry.source {
            RateSource::File { .. } => rates(&entry.source).map(Some),
            RateSource::Constant(_) | RateSource::PriceOf(_) => Ok(None),
        });
        Ok(Self { actions: Vec::new(), rates: rates.collect::<Result<_, _>>()? })
    }

    /// Rows of the file of rate `number`.
    pub fn rows_of_rate(&self, number: usize) -> Option<usize> {
        self.rates.get(number)?.as_ref().map(Vec::len)
    }

    /// Reads a file of actions, and gives its number of rows.
    pub fn read_actions(&mut self, run: &RunFile, entry: &DataEntry) -> Result<usize, InputError> {
        let instrument = run.instruments.iter().position(|instrument| instrument.symbol == entry.symbol);
        let before = self.actions.len();
        self.actions.extend(actions(entry, instrument.unwrap_or_default())?);
        Ok(self.actions.len() - before)
    }

    /// What was read for the run whose account `account` is.
    pub fn of(account: Option<&Arc<Account>>) -> Self {
        let Some(account) = account else { return Self::default() };
        let known = |rate: &Rate| match rate {
            Rate::Known(rates) => Some(rates.clone()),
            Rate::Constant(_) | Rate::PriceOf(_) => None,
        };
        // A variant of a run has the same rates in the same order.
        Self { actions: account.actions.clone(), rates: account.rates.iter().map(known).collect() }
    }
}

/// The account of `run`; none where it is cash in one currency, and nothing happens to what is held.
pub(super) fn account(run: &RunFile, files: AccountFiles) -> Result<Option<Arc<Account>>, InputError> {
    let has_terms = |i: &InstrumentEntry| i.currency.is_some() || i.multiplier.is_some() || i.margin.is_some();
    if run.rates.is_empty()
        && !run.instruments.iter().any(has_terms)
        && !run.data.iter().any(|d| d.kind == FeedKind::Actions)
    {
        return Ok(None);
    }
    let mut currencies = vec![run.run.currency.clone()];
    currencies.extend(run.rates.iter().map(|rate| rate.currency.clone()));
    let terms = run.instruments.iter().map(|instrument| terms(instrument, &currencies)).collect();
    let mut rates = Vec::with_capacity(run.rates.len());
    for (index, (entry, read)) in run.rates.iter().zip(files.rates).enumerate() {
        rates.push(match (&entry.source, read) {
            (RateSource::PriceOf(symbol), _) => {
                Rate::PriceOf(run.instruments.iter().position(|i| i.symbol == *symbol).unwrap_or_default())
            }
            (RateSource::Constant(value), _) => {
                Rate::Constant(Price::nearest(*value).ok().filter(|rate| rate.0 > 0).ok_or_else(|| {
                    let error = run.error(&["rate", &index.to_string(), "value"], "expected at least 1e-9").found(*value);
                    error.hint("take the other currency as that of the run")
                })?)
            }
            (RateSource::File { .. }, read) => Rate::Known(read.unwrap_or_default()),
        });
    }
    Ok(Some(Arc::new(Account { currencies, terms, rates, actions: files.actions })))
}

fn terms(instrument: &InstrumentEntry, currencies: &[String]) -> Terms {
    let named = |name: &String| currencies.iter().position(|currency| currency == name);
    let terms = Terms {
        currency: instrument.currency.as_ref().and_then(named).unwrap_or_default(),
        multiplier: instrument.multiplier.and_then(|units| Multiplier::new(units as i64)).unwrap_or_default(),
        ..Terms::default()
    };
    // Fractions were held to what they can be.
    let fraction = |value: f64| Fraction::nearest(value).unwrap_or_default();
    match instrument.margin {
        None => terms,
        Some(MarginEntry::RegulationT) => terms.with_regulation_t(),
        Some(MarginEntry::Fractions(of)) => Terms {
            long: Requirement { initial: fraction(of.initial), maintenance: fraction(of.maintenance) },
            short: Requirement {
                initial: fraction(of.short_initial.unwrap_or(of.initial)),
                maintenance: fraction(of.short_maintenance.unwrap_or(of.maintenance)),
            },
            ..terms
        },
    }
}

/// The rates in a file: `ts, price`.
fn rates(source: &RateSource) -> Result<Vec<(Timestamp, Price)>, InputError> {
    let RateSource::File { path, time, columns, .. } = source else { return Ok(Vec::new()) };
    let table = Table::read_with(path, columns)?;
    table.check_renames(&["ts", "price"])?;
    let (times, prices) = (table.times("ts", time)?, table.floats_complete("price")?);
    check_increasing(&table, "ts", &times, Increase::Strictly)?;
    check_positive(&table, "price", &prices.iter().copied().map(Some).collect::<Vec<_>>())?;
    let row = |(row, (at, price)): (usize, (Timestamp, f64))| Ok((at, in_nanos(&table, "price", row, price)?));
    times.into_iter().zip(prices).enumerate().map(row).collect()
}

/// The columns of a file of actions.
const ACTION_COLUMNS: [&str; 6] = ["ts", "kind", "amount", "new", "old", "withholding"];

/// The actions in a file: `ts, kind`, of dividends `amount` and optionally `withholding`, of splits `new` and `old`.
fn actions(entry: &DataEntry, instrument: usize) -> Result<Vec<CorporateAction>, InputError> {
    let format = &entry.format;
    let table = Table::read_with(&entry.path, &format.columns)?;
    table.check_renames(&ACTION_COLUMNS)?;
    let times = table.times("ts", &format.time)?;
    check_increasing(&table, "ts", &times, Increase::OrStays)?;
    let kinds = table.texts_complete("kind")?;
    let optional = |name: &str| if table.has(name) { table.floats(name) } else { Ok(vec![None; times.len()]) };
    let row = ActionRow {
        table: &table,
        amounts: optional("amount")?,
        withholdings: optional("withholding")?,
        new: optional("new")?,
        old: optional("old")?,
    };
    let of = |(k, (at, kind)): (usize, (&Timestamp, &String))| {
        let kind = match kind.as_str() {
            "dividend" => row.dividend(k)?,
            "split" => row.split(k)?,
            other => {
                let error = table.error("kind", k, "expected a kind of action").found_text(other);
                return Err(error.hint("it is `dividend` or `split`"));
            }
        };
        Ok(CorporateAction { at: *at, instrument, kind })
    };
    times.iter().zip(&kinds).enumerate().map(of).collect()
}

/// The columns of a file of actions that not every kind has.
struct ActionRow<'t> {
    table: &'t Table,
    amounts: Vec<Option<f64>>,
    withholdings: Vec<Option<f64>>,
    new: Vec<Option<f64>>,
    old: Vec<Option<f64>>,
}

impl ActionRow<'_> {
    fn dividend(&self, k: usize) -> Result<ActionKind, InputError> {
        self.empty("new", &self.new, k, "a dividend")?;
        self.empty("old", &self.old, k, "a dividend")?;
        let amount = self.given("amount", &self.amounts, k, "a dividend")?;
        if amount.is_nan() || amount <= 0.0 {
            let error = self.table.error("amount", k, "expected an amount above 0").found(amount);
            return Err(error.hint("it is the dividend of one unit, before tax, in the instrument's currency"));
        }
        let per_unit = in_nanos(self.table, "amount", k, amount)?;
        let rate = self.withholdings[k].unwrap_or_default();
        let withholding = Fraction::nearest(rate).filter(|fraction| *fraction <= Fraction::ONE).ok_or_else(|| {
            let error = self.table.error("withholding", k, "expected a fraction from 0 to 1").found(rate);
            error.hint("0.15 is 15 %; leave it empty where no tax is withheld")
        })?;
        Ok(ActionKind::Dividend { per_unit, withholding })
    }

    fn split(&self, k: usize) -> Result<ActionKind, InputError> {
        self.empty("amount", &self.amounts, k, "a split")?;
        self.empty("withholding", &self.withholdings, k, "a split")?;
        let units = |name: &str, values: &[Option<f64>]| {
            let value = self.given(name, values, k, "a split")?;
            if value.fract() == 0.0 && (1.0..=f64::from(u32::MAX)).contains(&value) {
                return Ok(value as u32);
            }
            let error = self.table.error(name, k, "expected a whole number above 0").found(value);
            Err(error.hint("4 new for 1 old is a split, 1 new for 10 old a reverse split; 3 for 2 is new = 3, old = 2"))
        };
        Ok(ActionKind::Split { new: units("new", &self.new)?, old: units("old", &self.old)? })
    }

    fn given(&self, name: &str, values: &[Option<f64>], k: usize, what: &str) -> Result<f64, InputError> {
        values[k].ok_or_else(|| {
            let error = self.table.error(name, k, format!("{what} needs `{name}`, which is missing"));
            error.hint("dividends have `amount`, splits `new` and `old`")
        })
    }

    fn empty(&self, name: &str, values: &[Option<f64>], k: usize, what: &str) -> Result<(), InputError> {
        match values[k] {
            None => Ok(()),
            Some(value) => {
                let error = self.table.error(name, k, format!("{what} has no `{name}`")).found(value);
                Err(error.hint("dividends have `amount`, splits `new` and `old`: is another `kind` meant?"))
            }
        }
    }
}

/// A number of a file as a price in whole 1e-9, above 0.
fn in_nanos(table: &Table, column: &str, row: usize, value: f64) -> Result<Price, InputError> {
    let price = Price::nearest(value).map_err(|error: MoneyError| {
        let text = error.to_string();
        let (message, hint) = text.split_once("\nhint: ").unwrap_or((&text, ""));
        table.error(column, row, message).hint(hint)
    })?;
    if price.0 <= 0 {
        return Err(table.error(column, row, "expected at least 1e-9").found(value).hint("it is rounded to 1e-9"));
    }
    Ok(price)
}
