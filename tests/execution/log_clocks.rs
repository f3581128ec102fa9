//! Logs whose clock is not that of the tape: what is missing is to be named as with the right clock, and the clock is to be told. And logs
//! whose orders take a time of their own each.
#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use std::sync::Arc;

use trueup::market::{
    Execution, Instrument, Level, LogMarket, LoggedFill, LoggedOrder, MECHANISMS, OrderLog, OrderType, PriceAssumption,
    Print, Quotes, Side, Tape,
};
use trueup::sim2real::diagnose::{Diagnosis, Verdict, diagnose};
use trueup::sim2real::{Assembly, Seed, Timestamp};

use crate::draws::Draws;

/// The way of an order, and that of its report [s].
const WAY: f64 = 0.2;
const BACK: f64 = 0.02;

fn at(seconds: f64) -> Timestamp {
    Timestamp(1_722_951_000 * Timestamp::NANOS).plus_seconds(seconds)
}

/// What is found of 300 orders that are filled at the touch after a way of their own [s] each, in a log whose clock is so much behind that
/// of the tape [s].
fn diagnosed(behind: f64, way: impl Fn(&mut Draws) -> f64) -> Diagnosis {
    let mut draws = Draws(7);
    let (mut quotes, mut prints) = (Quotes::with_depth(1), Vec::new());
    let (mut orders, mut fills) = (Vec::new(), Vec::new());
    let (mut bid, mut next, mut on_its_way) = (5_000_i64, 3.0, None);
    for round in 0..60_000 {
        let now = f64::from(round) * 0.05;
        bid += [0, 0, 1, -1][(draws.uniform() * 4.0) as usize];
        let level = |ticks: i64| [Level { price: ticks as f64 * 0.01, size: 500.0 }];
        quotes.push(at(now), &level(bid), &level(bid + 2));
        if now >= next {
            let side = if draws.uniform() < 0.5 { Side::Buy } else { Side::Sell };
            let quantity = (20.0 + 300.0 * draws.uniform()).round();
            let when = now + 0.017;
            orders.push(LoggedOrder {
                id: orders.len().to_string(),
                side,
                quantity,
                decided_at: at(when - behind),
                kind: OrderType::Market,
                seen_mid: None,
            });
            on_its_way = Some((when + way(&mut draws), side, quantity));
            next = now + 4.0 + 12.0 * draws.uniform();
        }
        let arrives = on_its_way.take_if(|(time, ..): &mut (f64, Side, f64)| *time < now + 0.05);
        if let Some((time, side, size)) = arrives {
            let price = (if side == Side::Buy { bid + 2 } else { bid }) as f64 * 0.01;
            prints.push(Print { time: at(time), price, size, aggressor: Some(side) });
            let (order_id, filled_at) = ((orders.len() - 1).to_string(), at(time + BACK - behind));
            fills.push(LoggedFill { order_id, filled_at, quantity: size, price, fee: 0.0 });
        }
    }
    let instrument = Instrument {
        symbol: "XYZ".into(),
        tick_size: 0.01,
        lot_size: 1.0,
        average_daily_volume: Some(1e6),
        daily_volatility: Some(0.02),
    };
    let tape = Arc::new(Tape::new(quotes, prints, Vec::new()));
    let market = LogMarket { instrument, tape, price: PriceAssumption::Mid, shows_own_orders: None };
    let log = OrderLog::recording("clocks", market, &orders, &fills).unwrap();
    diagnose(&Assembly::new(Execution, MECHANISMS), &[log], &[], Seed(1), &|_, _, _| ()).diagnosis
}

fn names(diagnosis: &Diagnosis) -> Vec<&str> {
    let mut names: Vec<&str> = diagnosis.effects.iter().map(|effect| effect.mechanism.as_str()).collect();
    names.sort_unstable();
    names
}

#[test]
fn names_and_delay_are_those_of_the_right_clock() {
    for behind in [0.0, 1.27] {
        let diagnosis = diagnosed(behind, |_| WAY);
        assert_eq!(names(&diagnosis), ["command_delay", "half_spread"], "{diagnosis:#?}");
        assert_eq!(diagnosis.verdict, Verdict::Named);
        let delay = diagnosis.effects.iter().find_map(|effect| effect.parameters.get("seconds")).unwrap().value;
        println!("{behind} s behind: a delay of {delay} s");
        // Of a clock no more can be known than that trades come before their reports.
        assert!((delay - WAY).abs() < BACK + 0.02, "{delay}");
        let told = diagnosis.checks.notes.iter().any(|note| note.contains("the clock of the log is 1.250 s behind"));
        assert_eq!(told, behind != 0.0, "{:?}", diagnosis.checks.notes);
    }
}

#[test]
fn a_clock_that_is_ahead_hides_delays_and_nothing_else() {
    let diagnosis = diagnosed(-3.0, |_| WAY);
    assert_eq!((names(&diagnosis), diagnosis.verdict), (vec!["half_spread"], Verdict::Named), "{diagnosis:#?}");
    let notes = &diagnosis.checks.notes;
    assert!(notes.iter().any(|note| note.contains("s ahead of that of the tape")), "{notes:?}");
}

/// Orders that take .6 s in the median, and up to six times that: what is read at an order's own print speaks against no delay that is
/// too long, so that a fit alone says 3 s and more.
#[test]
fn a_delay_that_is_drawn_is_that_of_the_orders_own_prints() {
    let way = |draws: &mut Draws| {
        let normal: f64 = (0..12).map(|_| draws.uniform()).sum::<f64>() - 6.0;
        (0.6 * (0.8 * normal).exp()).clamp(0.05, 3.6)
    };
    let diagnosis = diagnosed(0.0, way);
    assert!(names(&diagnosis).contains(&"command_delay"), "{diagnosis:#?}");
    let delay = &diagnosis.effects.iter().find(|effect| effect.mechanism == "command_delay").unwrap().parameters["seconds"];
    assert!((delay.value - 0.6).abs() < 2.0 * delay.std && delay.std < 0.15, "{delay:?}");
    let told = diagnosis.checks.notes.iter().any(|note| note.contains("`command_delay.seconds` is the usual one"));
    assert!(told, "{:?}", diagnosis.checks.notes);
}
