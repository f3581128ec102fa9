//! Orders of which a part alone is filled. What is shown bounds it, by a part that is another for each order: that is the cap, with
//! the part that it is in the middle. Where chance alone decides how much is filled, no cap is named.
#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use std::sync::Arc;

use trueup::market::{
    Execution, Instrument, Level, LogMarket, LoggedFill, LoggedOrder, MECHANISMS, OrderLog, OrderType, PriceAssumption,
    Quotes, Side, Tape,
};
use trueup::sim2real::diagnose::{Diagnosis, Verdict, diagnose};
use trueup::sim2real::{Assembly, Recording, Seed, Timestamp};

use crate::draws::Draws;

const ORDERS: usize = 300;
/// Price of a share [currency]; it moves by ticks of a hundredth.
const PRICE: i64 = 5_000;

/// A log of market orders of 50 to 400 shares, where 100 to 400 are shown: `filled` gives the part that is, of what is asked and shown.
fn log(seed: u64, filled: impl Fn(f64, f64, &mut Draws) -> f64) -> Recording<OrderLog> {
    let mut draws = Draws(seed);
    let at = |seconds: f64| Timestamp(1_722_951_000 * Timestamp::NANOS).plus_seconds(seconds);
    let (mut quotes, mut orders, mut fills) = (Quotes::with_depth(1), Vec::new(), Vec::new());
    let mut bid = PRICE;
    for number in 0..ORDERS {
        let time = 10.0 * number as f64;
        bid += [0, 0, 1, -1][(draws.uniform() * 4.0) as usize];
        let sizes = [(); 2].map(|()| draws.between(100.0, 400.0).round());
        let level = |ticks: i64, size: f64| [Level { price: ticks as f64 * 0.01, size }];
        quotes.push(at(time), &level(bid, sizes[0]), &level(bid + 1, sizes[1]));
        let quantity = draws.between(50.0, 400.0).round();
        let (side, ticks, shown) = match draws.uniform() < 0.5 {
            true => (Side::Buy, bid + 1, sizes[1]),
            false => (Side::Sell, bid, sizes[0]),
        };
        let (id, decided_at) = (number.to_string(), at(time + 2.0));
        let quantity_filled = filled(quantity, shown, &mut draws).floor().clamp(1.0, quantity);
        let price = ticks as f64 * 0.01;
        let filled_at = decided_at.plus_seconds(1e-6);
        fills.push(LoggedFill { order_id: id.clone(), filled_at, quantity: quantity_filled, price, fee: 0.0 });
        orders.push(LoggedOrder { id, side, quantity, decided_at, kind: OrderType::Market, seen_mid: None });
    }
    let instrument = Instrument {
        symbol: "XYZ".into(),
        tick_size: 0.01,
        lot_size: 1.0,
        average_daily_volume: Some(1e6),
        daily_volatility: Some(0.02),
    };
    let tape = Arc::new(Tape::new(quotes, Vec::new(), Vec::new()));
    let market = LogMarket { instrument, tape, price: PriceAssumption::Touch, shows_own_orders: None };
    OrderLog::recording("capped", market, &orders, &fills).unwrap()
}

fn diagnosed(log: Recording<OrderLog>) -> Diagnosis {
    let twin = Assembly::new(Execution, MECHANISMS);
    diagnose(&twin, &[log], &[], Seed(1), &|_, _, _| ()).diagnosis
}

#[test]
fn a_cap_that_varies_from_order_to_order_is_named_with_its_middle() {
    for (fraction, varies, seed) in [(0.5, 0.0, 1), (0.5, 0.08, 2), (0.3, 0.15, 3)] {
        let found =
            diagnosed(log(seed, |quantity, shown, draws| quantity.min(fraction * shown * (varies * draws.bell()).exp())));
        let names: Vec<&str> = found.effects.iter().map(|effect| effect.mechanism.as_str()).collect();
        assert_eq!((found.verdict, &names[..]), (Verdict::Named, &["participation_cap"][..]), "{}", found.summary);
        let estimate = &found.effects[0].parameters["fraction"];
        assert!((estimate.value / fraction - 1.0).abs() < 0.03, "{} for {fraction}", estimate.value);
    }
}

#[test]
fn what_chance_fills_has_no_cap() {
    let found = diagnosed(log(4, |quantity, _, draws| quantity * draws.between(0.2, 1.0)));
    assert_eq!(found.verdict, Verdict::Unexplained, "{}", found.summary);
}
