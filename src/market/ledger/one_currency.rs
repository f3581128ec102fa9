//! An account in one currency, trade by trade.

use super::*;
use crate::market::{Quantity, Side};
use proptest::prelude::*;

fn trade(side: Side, price: f64, quantity: f64) -> Trade {
    Trade {
        instrument: 0,
        side,
        price: Price::nearest(price).unwrap(),
        quantity: Quantity::nearest(quantity).unwrap(),
        fee: Cash::nearest(1.0).unwrap(),
    }
}

#[test]
fn a_round_trip_through_long_and_short() {
    let mut ledger = Ledger::new(Cash::nearest(1_000.0).unwrap(), 1);
    ledger.book(&trade(Side::Buy, 10.0, 10.0)).unwrap();
    ledger.book(&trade(Side::Buy, 12.0, 10.0)).unwrap();
    // 20 held at 11 on average; 30 sold at 13 close them with 40 gained and leave 10 short at 13.
    assert_eq!(ledger.book(&trade(Side::Sell, 13.0, 30.0)).unwrap(), Cash::nearest(40.0).unwrap());
    let position = ledger.positions()[0];
    assert_eq!((position.quantity.to_f64(), position.basis.to_f64()), (-10.0, -130.0));
    assert_eq!(ledger.book(&trade(Side::Buy, 12.5, 10.0)).unwrap(), Cash::nearest(5.0).unwrap());
    assert!(ledger.is_flat());
    assert_eq!(ledger.cash(), Cash::nearest(1_000.0 + 45.0 - 4.0).unwrap());
    assert_eq!(ledger.equity().unwrap(), ledger.cash());
}

/// 74 were paid for 7 of the smallest units: 2 of them cost 21 and a seventh, which the other 5 keep.
#[test]
fn what_a_division_leaves_stays_with_the_rest() {
    let mut ledger = Ledger::new(Cash::ZERO, 1);
    let trade = |side, price, quantity| {
        let (price, quantity) = (Price(price), Quantity(quantity));
        Trade { instrument: 0, side, price, quantity, fee: Cash::ZERO }
    };
    ledger.book(&trade(Side::Buy, 10, 3)).unwrap();
    ledger.book(&trade(Side::Buy, 11, 4)).unwrap();
    assert_eq!(ledger.book(&trade(Side::Sell, 20, 2)).unwrap(), Cash(40 - 21));
    assert_eq!(ledger.book(&trade(Side::Sell, 20, 5)).unwrap(), Cash(100 - 53));
    assert_eq!((ledger.positions()[0].basis, ledger.cash()), (Cash::ZERO, Cash(140 - 74)));
}

#[test]
fn an_amount_that_does_not_fit_leaves_the_account_as_it_was() {
    let mut ledger = Ledger::new(Cash(i128::MIN + 10), 1);
    let before = ledger.clone();
    assert_eq!(ledger.book(&trade(Side::Buy, 9e9, 9e9)), Err(MoneyError::Overflow));
    assert_eq!(ledger, before);
}

type Step = (usize, bool, i64, i64, i64, i64);

fn steps() -> impl Strategy<Value = Vec<Step>> {
    let one =
        (0..3_usize, any::<bool>(), 1..2_000_000_000_000_i64, 1..5_000_000_000_000_i64, -9..9_i64, 1..4_000_000_000_000_i64);
    proptest::collection::vec(one, 1..200)
}

proptest! {
    /// Over any orders, cash, positions, gains and fees reconcile to the last unit.
    #[test]
    fn the_account_adds_up(steps in steps()) {
        let opening = Cash::nearest(1_000_000.0).unwrap();
        let mut ledger = Ledger::new(opening, 3);
        let (mut cash, mut held, mut fees) = (opening.0, [0_i128; 3], 0_i128);
        for (instrument, buy, price, quantity, fee, mark) in steps {
            let side = if buy { Side::Buy } else { Side::Sell };
            let fee = Cash(i128::from(fee) * 1_000_000_000);
            ledger.book(&Trade { instrument, side, price: Price(price), quantity: Quantity(quantity), fee }).unwrap();
            let signed = if buy { i128::from(quantity) } else { -i128::from(quantity) };
            cash -= signed * i128::from(price) + fee.0;
            held[instrument] += signed;
            fees += fee.0;
            ledger.mark(instrument, Price(mark)).unwrap();
            let positions = ledger.positions();
            prop_assert_eq!(ledger.cash().0, cash);
            let worth: i128 = positions.iter().map(|p| p.value().0).sum();
            prop_assert_eq!(ledger.equity().unwrap().0, cash + worth);
            let realised: i128 = positions.iter().map(|p| p.realised.0).sum();
            let unrealised: i128 = positions.iter().map(|p| p.value().0 - p.basis.0).sum();
            prop_assert_eq!(ledger.equity().unwrap().0, opening.0 + realised + unrealised - fees);
            for (position, held) in positions.iter().zip(held) {
                prop_assert_eq!(i128::from(position.quantity.0), held);
                if held == 0 { prop_assert_eq!(position.basis, Cash::ZERO); }
            }
            prop_assert_eq!(ledger.is_flat(), held.iter().all(|h| *h == 0));
        }
    }
}
