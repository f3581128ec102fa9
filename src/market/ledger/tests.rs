//! Accounts in several currencies: worked by hand, and reconciled over random operations.

use proptest::prelude::*;
use rand::RngExt;

use super::*;
use crate::market::{Quantity, Side};
use crate::sim2real::Seed;

fn cash(value: f64) -> Cash {
    Cash::nearest(value).unwrap()
}

fn price(value: f64) -> Price {
    Price::nearest(value).unwrap()
}

fn units(value: f64) -> Quantity {
    Quantity::nearest(value).unwrap()
}

fn trade(instrument: usize, side: Side, at: f64, quantity: f64) -> Trade {
    Trade { instrument, side, price: price(at), quantity: units(quantity), fee: Cash::ZERO }
}

fn in_currency(currency: usize) -> Terms {
    Terms { currency, ..Terms::default() }
}

#[test]
fn equity_is_the_sum_over_currencies_rounded_once() {
    let terms = vec![in_currency(0), in_currency(1), in_currency(2)];
    let mut ledger = Ledger::with_terms(&[cash(1_000.0), cash(500.0), Cash::ZERO], terms).unwrap();
    assert_eq!(ledger.equity(), Err(MoneyError::NoRate { currency: 1 }));
    ledger.set_rate(1, price(1.25)).unwrap();
    assert_eq!(ledger.equity().unwrap(), cash(1_625.0), "nothing in currency 2: no rate is needed");
    // 10 at 20 in currency 1, paid from its own cash; worth 21 now.
    ledger.book(&trade(1, Side::Buy, 20.0, 10.0)).unwrap();
    ledger.mark(1, price(21.0)).unwrap();
    assert_eq!((ledger.balances()[1].cash, ledger.balances()[1].holdings), (cash(300.0), cash(210.0)));
    assert_eq!(ledger.equity().unwrap(), cash(1_000.0 + 510.0 * 1.25));
    assert!((ledger.gross() - 262.5).abs() < 1e-9);
    // Two halves of the last unit, one in each currency, are one unit: rounded apart both would be lost.
    let mut ledger = Ledger::with_terms(&[Cash::ZERO, Cash(1), Cash(1)], vec![]).unwrap();
    ledger.set_rate(1, Price(500_000_000)).unwrap();
    ledger.set_rate(2, Price(500_000_000)).unwrap();
    assert_eq!(ledger.equity().unwrap(), Cash(1));
    ledger.set_rate(2, Price(499_999_999)).unwrap();
    assert_eq!(ledger.equity().unwrap(), Cash(0));
}

#[test]
fn what_a_conversion_leaves_goes_into_the_next() {
    let mut ledger = Ledger::with_terms(&[Cash(10), Cash::ZERO], vec![]).unwrap();
    let third = Conversion { from: 0, to: 1, amount: Cash(1), rate: Price(333_333_333) };
    let received: Vec<_> = (0..4).map(|_| ledger.convert(&third).unwrap().0).collect();
    assert_eq!((received, ledger.balances()[1].remainder), (vec![0, 0, 0, 1], 333_333_332));
    assert_eq!((ledger.balances()[0].cash, ledger.balances()[0].converted), (Cash(6), Cash(-4)));
    let hundred = Conversion { from: 1, to: 0, amount: Cash(1), rate: price(100.0) };
    assert_eq!(ledger.convert(&hundred).unwrap(), Cash(100));
}

#[test]
fn a_future_gains_its_multiplier_times_the_move() {
    let es = Terms { multiplier: Multiplier::new(50).unwrap(), ..Terms::default() };
    let mut ledger = Ledger::with_terms(&[cash(100_000.0)], vec![es]).unwrap();
    ledger.book(&trade(0, Side::Buy, 5_000.0, 2.0)).unwrap();
    ledger.mark(0, price(5_010.25)).unwrap();
    assert_eq!(ledger.equity().unwrap(), cash(100_000.0 + 2.0 * 50.0 * 10.25));
    assert_eq!(ledger.book(&trade(0, Side::Sell, 4_990.0, 2.0)).unwrap(), cash(-1_000.0));
    assert_eq!((ledger.cash(), ledger.is_flat()), (cash(99_000.0), true));
}

#[test]
fn dividends_are_received_when_long_and_paid_when_short() {
    let mut ledger = Ledger::new(Cash::ZERO, 2);
    ledger.book(&trade(0, Side::Buy, 50.0, 100.0)).unwrap();
    ledger.book(&trade(1, Side::Sell, 50.0, 100.0)).unwrap();
    let dividend = |instrument| Dividend { instrument, per_unit: price(0.83), withholding: Fraction::percent(15) };
    assert_eq!(ledger.dividend(&dividend(0)).unwrap(), cash(83.0 - 12.45));
    assert_eq!(ledger.dividend(&dividend(1)).unwrap(), cash(-83.0), "no tax is withheld from what is paid");
    assert_eq!((ledger.income()[0].dividends, ledger.income()[0].withheld), (cash(83.0), cash(12.45)));
    assert_eq!(ledger.cash(), cash(-12.45));
    ledger.charge(1, cash(2.5), ChargeKind::Borrow).unwrap();
    ledger.charge(1, cash(-0.5), ChargeKind::Funding).unwrap();
    ledger.charge_cash(0, cash(1.0), ChargeKind::Interest).unwrap();
    let charges = ledger.income()[1].charges;
    assert_eq!((charges.borrow, charges.funding, charges.total().unwrap()), (cash(2.5), cash(-0.5), cash(2.0)));
    assert_eq!((ledger.balances()[0].charges.interest, ledger.cash()), (cash(1.0), cash(-15.45)));
}

/// 7 shares bought at 30, split 3 for 2 at 36: 10 shares at 24 and half a share for 12, which cost 10.
#[test]
fn a_split_keeps_the_basis_and_pays_out_what_is_no_whole_share() {
    for (side, sign) in [(Side::Buy, 1.0), (Side::Sell, -1.0)] {
        let mut ledger = Ledger::new(Cash::ZERO, 1);
        ledger.book(&trade(0, side, 30.0, 7.0)).unwrap();
        ledger.mark(0, price(36.0)).unwrap();
        let before = ledger.equity().unwrap();
        let split = Split { instrument: 0, new: 3, old: 2, lot: units(1.0) };
        assert_eq!(ledger.split(&split).unwrap(), cash(sign * 12.0));
        let position = ledger.positions()[0];
        assert_eq!((position.quantity, position.mark), (units(sign * 10.0), Some(price(24.0))));
        assert_eq!((position.basis, position.realised), (cash(sign * 200.0), cash(sign * 2.0)));
        assert_eq!((ledger.equity().unwrap(), ledger.cash()), (before, cash(sign * (12.0 - 210.0))));
    }
    // 3 shares, 1 for 10: nothing is left of them but cash.
    let mut ledger = Ledger::new(Cash::ZERO, 1);
    ledger.book(&trade(0, Side::Buy, 1.0, 3.0)).unwrap();
    assert_eq!(ledger.split(&Split { instrument: 0, new: 1, old: 10, lot: units(1.0) }).unwrap(), cash(3.0));
    assert_eq!((ledger.is_flat(), ledger.positions()[0].basis, ledger.cash()), (true, Cash::ZERO, Cash::ZERO));
}

/// 100 long at 100 and 100 short at 60 on 5,500 of equity: 5,000 + 3,000 to open, 2,500 + 1,800 to keep.
#[test]
fn regulation_t_by_hand_and_what_to_close() {
    let terms = Terms::default().with_regulation_t();
    let mut ledger = Ledger::with_terms(&[cash(5_500.0)], vec![terms; 2]).unwrap();
    ledger.book(&trade(0, Side::Buy, 100.0, 100.0)).unwrap();
    ledger.book(&trade(1, Side::Sell, 60.0, 100.0)).unwrap();
    let margin = ledger.margin().unwrap();
    assert_eq!((margin.required_initial, margin.required_maintenance), (cash(8_000.0), cash(4_300.0)));
    assert_eq!((margin.excess().unwrap(), margin.is_below_maintenance()), (cash(-2_500.0), false));
    let lots = [units(1.0); 2];
    assert_eq!(ledger.liquidation(&lots).unwrap(), []);
    // The short goes to 80: equity 3,500, and 2,500 + 2,400 are required. 1,400 at 25 a share are 56 shares.
    ledger.mark(1, price(80.0)).unwrap();
    assert!(ledger.margin().unwrap().is_below_maintenance());
    let closing = |instrument, side, quantity| Closing { instrument, side, quantity: units(quantity) };
    assert_eq!(ledger.liquidation(&lots).unwrap(), [closing(0, Side::Sell, 56.0)]);
    assert_eq!(ledger.liquidation(&[units(10.0); 2]).unwrap(), [closing(0, Side::Sell, 60.0)]);
    // At 90 equity is 2,500 and 2,500 + 2,700 are required: the short goes first, 100 of it, and nothing else.
    ledger.mark(1, price(90.0)).unwrap();
    assert_eq!(ledger.liquidation(&lots).unwrap(), [closing(1, Side::Buy, 100.0)]);
    // At 92 the short releases 2,760 of 2,960 that are missing; 200 are 8 of the long shares.
    ledger.mark(1, price(92.0)).unwrap();
    assert_eq!(ledger.liquidation(&lots).unwrap(), [closing(1, Side::Buy, 100.0), closing(0, Side::Sell, 8.0)]);
    // Below 0 nothing helps, and all goes.
    ledger.mark(1, price(200.0)).unwrap();
    assert_eq!(ledger.liquidation(&lots).unwrap(), [closing(1, Side::Buy, 100.0), closing(0, Side::Sell, 100.0)]);
}

#[test]
fn what_cannot_be_is_refused_and_changes_nothing() {
    let mut ledger = Ledger::with_terms(&[cash(10.0), cash(10.0)], vec![in_currency(1)]).unwrap();
    ledger.book(&trade(0, Side::Buy, 9.0, 1.0)).unwrap();
    let before = ledger.clone();
    let convert = |from, to, amount, rate| Conversion { from, to, amount: cash(amount), rate: price(rate) };
    for bad in [
        convert(0, 0, 1.0, 1.0),
        convert(0, 1, 0.0, 1.0),
        convert(0, 1, -1.0, 1.0),
        convert(0, 1, 1.0, 0.0),
        convert(0, 2, 1.0, 1.0),
    ] {
        assert!(ledger.convert(&bad).is_err(), "{bad:?}");
    }
    assert!(ledger.set_rate(0, price(1.0)).is_err() && ledger.set_rate(1, price(-1.0)).is_err());
    let split = |new, old, lot| Split { instrument: 0, new, old, lot: Quantity(lot) };
    for bad in [split(0, 1, 1), split(1, 0, 1), split(1, 1, 0), Split { instrument: 1, ..split(1, 1, 1) }] {
        assert!(ledger.split(&bad).is_err(), "{bad:?}");
    }
    // 4.3e9 for one fits, and 4.3e9 for each of those does not.
    let mut many = ledger.clone();
    many.split(&split(u32::MAX, 1, 1)).unwrap();
    let held = many.clone();
    assert!(many.split(&split(u32::MAX, 1, 1)).is_err() && many == held);
    let dividend = Dividend { instrument: 0, per_unit: price(1.0), withholding: Fraction::percent(101) };
    assert!(ledger.dividend(&dividend).is_err() && ledger.charge(7, Cash(1), ChargeKind::Other).is_err());
    assert!(ledger.charge(0, Cash(i128::MIN), ChargeKind::Other).is_err());
    assert_eq!(ledger, before);
    let none = Ledger::with_terms(&[Cash::ZERO], vec![in_currency(1)]).unwrap_err().to_string();
    assert_eq!(none, "there is no currency 1: the account has 1\nhint: give an opening cash, 0 too, for each currency");
    assert!(Ledger::with_terms(&[], vec![]).is_err() && Multiplier::new(0).is_none());
    assert!(Fraction::nearest(f64::NAN).is_none() && Fraction::nearest(-0.1).is_none());
}

const OPENING: [Cash; 3] = [Cash(1_000_000_000_000_000_000_000_000), Cash(777), Cash(-5_000_000_000_000_000_000_000)];
/// Currency and multiplier of each instrument.
const INSTRUMENTS: [(usize, i64); 4] = [(0, 1), (1, 1), (2, 50), (1, 7)];

/// What happens next: a kind, two choices and two sizes.
type Operation = (u8, u8, u8, i64, i64);

fn operation() -> impl Strategy<Value = Operation> {
    (any::<u8>(), any::<u8>(), any::<u8>(), 1..2_000_000_000_000_i64, 1..5_000_000_000_000_i64)
}

/// The account and, beside it, cash and quantities by plain sums.
struct Books {
    ledger: Ledger,
    cash: [i128; 3],
    held: [i128; 4],
    /// What conversions to a currency must have brought [1e-27], and what they did [1e-18].
    due: [i128; 3],
    received: [i128; 3],
    refused: usize,
}

impl Books {
    fn new() -> Self {
        let multiplier = |units| Multiplier::new(units).unwrap();
        let terms =
            INSTRUMENTS.map(|(currency, units)| Terms { currency, multiplier: multiplier(units), ..Terms::default() });
        let ledger = Ledger::with_terms(&OPENING, terms.to_vec()).unwrap();
        Self { ledger, cash: OPENING.map(|cash| cash.0), held: [0; 4], due: [0; 3], received: [0; 3], refused: 0 }
    }

    fn apply(&mut self, (kind, one, two, price, size): Operation) {
        let instrument = usize::from(one) % INSTRUMENTS.len();
        let (currency, multiplier) = INSTRUMENTS[instrument];
        let multiplier = i128::from(multiplier);
        let held = self.held[instrument];
        match kind % 8 {
            0..=3 => {
                let side = if two % 2 == 0 { Side::Buy } else { Side::Sell };
                let fee = Cash(i128::from(two) * 1_000_000_007 - 50);
                let (price, quantity) = (Price(price), Quantity(size));
                self.ledger.book(&Trade { instrument, side, price, quantity, fee }).unwrap();
                let signed = i128::from(size) * if two % 2 == 0 { 1 } else { -1 };
                self.held[instrument] += signed;
                self.cash[currency] -= signed * i128::from(price.0) * multiplier + fee.0;
            }
            4 => self.ledger.mark(instrument, Price(price)).unwrap(),
            5 => {
                let (from, to) = (usize::from(one) % 3, usize::from(two) % 3);
                let conversion = Conversion { from, to, amount: Cash(size.into()), rate: Price(price) };
                match self.ledger.convert(&conversion) {
                    Ok(received) => {
                        self.cash[from] -= i128::from(size);
                        self.cash[to] += received.0;
                        self.due[to] += i128::from(size) * i128::from(price);
                        self.received[to] += received.0;
                    }
                    Err(_) => self.refused += 1,
                }
            }
            6 if two % 2 == 0 => {
                let per_unit = Price(price / 1_000);
                let withholding = Fraction::percent(two / 3);
                let net = self.ledger.dividend(&Dividend { instrument, per_unit, withholding }).unwrap();
                let gross = held * i128::from(per_unit.0) * multiplier;
                let tax = gross.max(0) / 100 * i128::from(two / 3) + gross.max(0) % 100 * i128::from(two / 3) / 100;
                assert_eq!(net.0, gross - tax);
                self.cash[currency] += gross - tax;
            }
            6 => {
                let kinds = [ChargeKind::Borrow, ChargeKind::Funding, ChargeKind::Interest, ChargeKind::Other];
                let (amount, kind) = (Cash(i128::from(size) - 2_000_000_000_000), kinds[usize::from(two / 2) % 4]);
                let currency = if two % 4 == 1 {
                    self.ledger.charge(instrument, amount, kind).unwrap();
                    currency
                } else {
                    self.ledger.charge_cash(usize::from(one) % 3, amount, kind).unwrap();
                    usize::from(one) % 3
                };
                self.cash[currency] -= amount.0;
            }
            _ => self.split(instrument, two, size),
        }
    }

    fn split(&mut self, instrument: usize, ratio: u8, lot: i64) {
        let (currency, multiplier) = INSTRUMENTS[instrument];
        let (mut new, mut old) = (1 + u32::from(ratio) % 4, 1 + u32::from(ratio / 4) % 4);
        // Positions stay within bounds over a million splits.
        let held = self.held[instrument];
        let out_of_bounds = held.abs() > 100_000_000_000_000_000 && new > old || held.abs() < 1_000_000_000_000 && new < old;
        if out_of_bounds {
            (new, old) = (old, new);
        }
        let lot = if ratio.is_multiple_of(2) { 1 } else { 1 + lot % 3_000_000_000 };
        let mark = self.ledger.positions()[instrument].mark.unwrap_or_default();
        let paid = self.ledger.split(&Split { instrument, new, old, lot: Quantity(lot) }).unwrap();
        let kept = held * i128::from(new) / i128::from(old) / i128::from(lot) * i128::from(lot);
        let rest = held * i128::from(new) - kept * i128::from(old);
        assert_eq!(paid.0, rest * i128::from(mark.0) * i128::from(multiplier) / i128::from(new));
        self.held[instrument] = kept;
        self.cash[currency] += paid.0;
    }

    /// Nothing was created and nothing lost, in each currency, to the last unit.
    fn reconcile(&self) {
        let ledger = &self.ledger;
        for (k, balance) in ledger.balances().iter().enumerate() {
            assert_eq!((balance.cash.0, balance.opening), (self.cash[k], OPENING[k]));
            assert_eq!(self.due[k], self.received[k] * 1_000_000_000 + i128::from(balance.remainder));
            let mut worth = balance.opening.0 + balance.converted.0 - balance.charges.total().unwrap().0;
            let mut holdings = 0;
            for (position, income) in ledger.positions().iter().zip(ledger.income()).filter(|(p, _)| p.currency == k) {
                let value = position.value().0;
                holdings += value;
                worth += position.realised.0 + value - position.basis.0 - position.fees.0;
                worth += income.dividends.0 - income.withheld.0 - income.charges.total().unwrap().0;
            }
            assert_eq!((balance.holdings.0, balance.worth().unwrap().0), (holdings, worth));
        }
        for (position, held) in ledger.positions().iter().zip(self.held) {
            assert_eq!(i128::from(position.quantity.0), held);
            assert!(held != 0 || position.basis == Cash::ZERO);
        }
        assert_eq!(ledger.is_flat(), self.held.iter().all(|held| *held == 0));
    }
}

proptest! {
    #[test]
    fn every_currency_reconciles_to_the_last_unit(operations in proptest::collection::vec(operation(), 1..200)) {
        let mut books = Books::new();
        for operation in operations {
            books.apply(operation);
            books.reconcile();
        }
    }

    /// After what it says is closed at the marks, an account that can be mended is above maintenance, and with a lot less of
    /// the last it would not be.
    #[test]
    fn liquidation_closes_enough_and_no_more(
        operations in proptest::collection::vec(operation(), 1..20), missing in 1..1_000_i64, rates in (1..5_000_000_000_i64, 1..5_000_000_000_i64),
    ) {
        let margin = |percent| Requirement { initial: Fraction::percent(percent), maintenance: Fraction::percent(percent) };
        let terms = INSTRUMENTS.map(|(currency, _)| Terms { currency, long: margin(30), short: margin(40), ..Terms::default() });
        let mut ledger = Ledger::with_terms(&[Cash::ZERO; 3], terms.to_vec()).unwrap();
        ledger.set_rate(1, Price(rates.0)).unwrap();
        ledger.set_rate(2, Price(rates.1)).unwrap();
        for (_, one, two, price, size) in operations {
            let side = if two % 2 == 0 { Side::Buy } else { Side::Sell };
            let (instrument, price, quantity) = (usize::from(one) % 4, Price(price), Quantity(size));
            ledger.book(&Trade { instrument, side, price, quantity, fee: Cash::ZERO }).unwrap();
        }
        // Cash is set so that equity is some thousandths of what is required.
        let before = ledger.margin().unwrap();
        let wanted = Cash(before.required_maintenance.0 / 1_000 * i128::from(missing));
        ledger.charge_cash(0, before.equity.minus(wanted).unwrap(), ChargeKind::Other).unwrap();
        let lots = [Quantity(1); 4];
        let close = |closings: &[Closing]| {
            let mut after = ledger.clone();
            for Closing { instrument, side, quantity } in closings.iter().filter(|closing| closing.quantity.0 > 0) {
                let price = after.positions()[*instrument].mark.unwrap();
                let trade = Trade { instrument: *instrument, side: *side, price, quantity: *quantity, fee: Cash::ZERO };
                after.book(&trade).unwrap();
            }
            after.margin().unwrap()
        };
        let mut closings = ledger.liquidation(&lots).unwrap();
        prop_assert!(!close(&closings).is_below_maintenance());
        if let Some(last) = closings.last_mut() {
            last.quantity = last.quantity - Quantity(1);
            prop_assert!(close(&closings).is_below_maintenance());
        }
    }
}

#[test]
fn a_million_random_operations_reconcile() {
    let mut stream = Seed(20_240_805).stream("ledger");
    let mut books = Books::new();
    for _ in 0..1_000_000 {
        let bits: u32 = stream.random();
        let [kind, one, two, _] = bits.to_le_bytes();
        books.apply((kind, one, two, stream.random_range(1..2_000_000_000_000), stream.random_range(1..5_000_000_000_000)));
        books.reconcile();
    }
    // A third of the conversions are of a currency to itself.
    assert!(books.refused < 60_000);
}
