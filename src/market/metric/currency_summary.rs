//! What an account had of each currency, and what came and went without a trade.

use serde::Serialize;

use crate::market::{Balance, Cash, Charges, MoneyError, Price, Record};

/// One currency of an account; amounts are in it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CurrencySummary {
    /// Its name.
    pub currency: String,
    /// Cash at the end; below 0 where it is owed.
    pub cash: f64,
    /// What is held of instruments in it, at their last prices.
    pub holdings: f64,
    /// What one unit of it is worth at the end [currency of the run]; none where it has no rate.
    pub rate: Option<f64>,
    /// Dividends before tax, less those paid when short.
    pub dividends: f64,
    /// Tax withheld from them.
    pub withheld: f64,
    /// Charged on what was held and on cash, by kind; credits are below 0.
    pub charges: ChargeSummary,
}

/// Charges by kind.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct ChargeSummary {
    /// Borrowing of what was sold short.
    pub borrow: f64,
    /// Funding of perpetual futures.
    pub funding: f64,
    /// Interest.
    pub interest: f64,
    /// Others.
    pub other: f64,
}

impl ChargeSummary {
    fn add(&mut self, charges: &Charges) {
        self.borrow += charges.borrow.to_f64();
        self.funding += charges.funding.to_f64();
        self.interest += charges.interest.to_f64();
        self.other += charges.other.to_f64();
    }
}

impl CurrencySummary {
    /// One summary a currency, first that of the run, which is called `base`.
    ///
    /// # Errors
    /// If an amount of cash is beyond what can be held.
    pub fn of(record: &Record, base: &str) -> Result<Vec<Self>, MoneyError> {
        let one = |(number, balance): (usize, &Balance)| -> Result<Self, MoneyError> {
            let ledger = &record.ledger;
            let of_it = ledger.positions().iter().zip(ledger.income()).filter(|(p, _)| p.currency == number);
            let mut charges = ChargeSummary::default();
            charges.add(&balance.charges);
            let (mut dividends, mut withheld) = (Cash::ZERO, Cash::ZERO);
            for (_, income) in of_it {
                charges.add(&income.charges);
                (dividends, withheld) = (dividends.plus(income.dividends)?, withheld.plus(income.withheld)?);
            }
            let name = record.account.currencies.get(number).map_or(base, String::as_str);
            Ok(Self {
                currency: name.to_owned(),
                cash: balance.cash.to_f64(),
                holdings: balance.holdings.to_f64(),
                rate: if number == 0 { Some(1.0) } else { balance.rate.map(Price::to_f64) },
                dividends: dividends.to_f64(),
                withheld: withheld.to_f64(),
                charges,
            })
        };
        record.ledger.balances().iter().enumerate().map(one).collect()
    }
}
