//! What happens to positions without a trade: dividends, splits, charges.

use crate::market::{Cash, MoneyError, Price, Quantity};

use super::{ChargeKind, Fraction, Ledger, LedgerError, Position};

/// A cash dividend. Who is long receives it, who is short pays it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Dividend {
    /// Number of the instrument.
    pub instrument: usize,
    /// For one unit, in the instrument's currency.
    pub per_unit: Price,
    /// The part of it that is withheld as tax, from long positions alone.
    pub withholding: Fraction,
}

/// A split: `new` units for `old`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Split {
    /// Number of the instrument.
    pub instrument: usize,
    /// New units, above 0,
    pub new: u32,
    /// for so many old ones, above 0.
    pub old: u32,
    /// What is held afterwards is a multiple of this, above 0; fractions are paid out.
    pub lot: Quantity,
}

impl Ledger {
    /// Books a dividend and gives what it brought after tax; below 0 when short.
    ///
    /// Tax is rounded towards 0 to 1e-18 of the currency.
    ///
    /// # Errors
    /// If there is no such instrument, more than all is withheld, or 128 bits do not hold a sum.
    pub fn dividend(&mut self, dividend: &Dividend) -> Result<Cash, LedgerError> {
        let Dividend { instrument, per_unit, withholding } = *dividend;
        let position = *self.position(instrument)?;
        if withholding > Fraction::ONE {
            return Err(LedgerError::Withholding { rate: withholding.to_f64() });
        }
        let gross = position.amount(per_unit, position.quantity)?;
        let tax = if gross.0 > 0 { withholding.of(gross)? } else { Cash::ZERO };
        let mut income = self.income[instrument];
        income.dividends = income.dividends.plus(gross)?;
        income.withheld = income.withheld.plus(tax)?;
        let net = gross.minus(tax)?;
        self.balances[position.currency].receive(net)?;
        self.income[instrument] = income;
        Ok(net)
    }

    /// Books a charge on what is held of `instrument`, in its currency; a credit is below 0.
    ///
    /// # Errors
    /// If there is no such instrument, or 128 bits do not hold a sum.
    pub fn charge(&mut self, instrument: usize, amount: Cash, kind: ChargeKind) -> Result<(), LedgerError> {
        let currency = self.position(instrument)?.currency;
        let charges = self.income[instrument].charges.with(amount, kind)?;
        self.balances[currency].pay(amount)?;
        self.income[instrument].charges = charges;
        Ok(())
    }

    /// Books a charge on the cash of `currency`, as interest is; a credit is below 0.
    ///
    /// # Errors
    /// If there is no such currency, or 128 bits do not hold a sum.
    pub fn charge_cash(&mut self, currency: usize, amount: Cash, kind: ChargeKind) -> Result<(), LedgerError> {
        let mut balance = *self.balance(currency)?;
        balance.charges = balance.charges.with(amount, kind)?;
        balance.pay(amount)?;
        self.balances[currency] = balance;
        Ok(())
    }

    /// Books a split and gives the cash paid for what is no whole lot; below 0 when short.
    ///
    /// The basis stays, but for the part of what is paid out, which is closed at the last mark: its value is exact up to
    /// the division by `new`, which is rounded towards 0 to 1e-18 of the currency. The basis of less than 1e-9 of a unit
    /// stays with the rest. The mark is scaled and rounded to the nearest 1e-9, half away from 0.
    ///
    /// # Errors
    /// If there is no such instrument, `new`, `old` or `lot` is not above 0, or an amount does not fit; the account is as it
    /// was.
    pub fn split(&mut self, split: &Split) -> Result<Cash, LedgerError> {
        let before = *self.position(split.instrument)?;
        let Split { new, old, lot, .. } = *split;
        if new == 0 || old == 0 || lot.0 <= 0 {
            return Err(LedgerError::Split { new, old, lot: lot.to_f64() });
        }
        let (after, paid) = after_split(&before, split)?;
        let mut balance = self.balances[before.currency];
        balance.holdings = balance.holdings.minus(before.value())?.plus(after.value())?;
        balance.receive(paid)?;
        self.open = self.open + usize::from(after.quantity.0 != 0) - usize::from(before.quantity.0 != 0);
        self.balances[before.currency] = balance;
        self.positions[split.instrument] = after;
        Ok(paid)
    }
}

/// The position after a split, and what is paid for the rest.
fn after_split(before: &Position, split: &Split) -> Result<(Position, Cash), MoneyError> {
    let (new, old) = (i128::from(split.new), i128::from(split.old));
    let fits = |number: i128| i64::try_from(number).map_err(|_| MoneyError::Overflow);
    let mut after = *before;
    after.mark = match before.mark {
        Some(mark) => Some(Price(fits(nearest(i128::from(mark.0) * old, new))?)),
        None => None,
    };
    // In 1 / `old` of the smallest unit nothing is rounded.
    let exact = i128::from(before.quantity.0) * new;
    let whole = fits(exact / old)?;
    let kept = whole - whole % split.lot.0;
    let rest = exact - i128::from(kept) * old;
    after.quantity = Quantity(kept);
    // So much old quantity is `rest / new`, and it goes at the old mark.
    let mark = i128::from(before.mark.unwrap_or_default().0);
    let paid = rest.checked_mul(mark).and_then(|paid| paid.checked_mul(before.multiplier.0.into()));
    let paid = Cash(paid.ok_or(MoneyError::Overflow)? / new);
    let released = match kept {
        0 => before.basis,
        _ => before.basis_of((whole - kept).saturating_abs(), whole.saturating_abs()),
    };
    after.basis = before.basis.minus(released)?;
    after.realised = before.realised.plus(paid.minus(released)?)?;
    after.amount(after.mark.unwrap_or_default(), after.quantity)?;
    Ok((after, paid))
}

/// `number / by`, to the nearest, half away from 0.
fn nearest(number: i128, by: i128) -> i128 {
    (2 * number.abs() + by) / (2 * by) * number.signum()
}
