//! Limit orders that rest, in queues made by arithmetic: how far back they stood is to be named from what traded before they were
//! filled, and neither the moves that fill them nor others who give up their places are to be taken for it.
#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use std::sync::Arc;

use trueup::market::{
    Execution, Instrument, Level, LogMarket, LoggedFill, LoggedOrder, MECHANISMS, OrderLog, OrderType, PriceAssumption,
    Print, Quotes, Side, Tape,
};
use trueup::sim2real::diagnose::{Diagnosis, Verdict, diagnose};
use trueup::sim2real::{Assembly, Recording, Seed, Timestamp};

use crate::draws::Draws;

/// Time between rounds [s]: in each the quotes may move, somebody may trade, and the client may send an order.
const ROUND: f64 = 0.25;
const ROUNDS: usize = 60_000;
/// What is displayed at the best prices, at the least and at the most [units].
const DISPLAYED: (f64, f64) = (60.0, 240.0);
/// How long an order waits [rounds].
const PATIENCE: usize = 240;

/// The client's order that waits.
struct Waiting {
    number: usize,
    side: Side,
    limit: i64,
    left: f64,
    ahead: f64,
    until: usize,
}

/// The client's log while it is written, in ticks of a hundredth.
#[derive(Default)]
struct Written {
    orders: Vec<LoggedOrder>,
    fills: Vec<LoggedFill>,
    prints: Vec<Print>,
    waiting: Option<Waiting>,
}

fn at(round: usize) -> Timestamp {
    Timestamp(1_722_951_000 * Timestamp::NANOS).plus_seconds(round as f64 * ROUND)
}

/// Whoever trades comes after the quotes of the round, and the client after that.
fn traded_at(round: usize) -> Timestamp {
    at(round).plus_seconds(0.1)
}

impl Written {
    fn filled(&mut self, filled_at: Timestamp, quantity: f64) {
        let Some(order) = &mut self.waiting else { return };
        order.left -= quantity;
        let (order_id, price) = (order.number.to_string(), order.limit as f64 * 0.01);
        self.fills.push(LoggedFill { order_id, filled_at, quantity, price, fee: 0.0 });
        self.waiting.take_if(|order| order.left < 1.0);
    }

    /// What the market does to the order that waits by moving to `bid`.
    fn moved(&mut self, round: usize, bid: i64) {
        let reached = |order: &Waiting| match order.side {
            Side::Buy => bid < order.limit,
            Side::Sell => bid + 1 > order.limit,
        };
        self.waiting.take_if(|order| round > order.until);
        if let Some(left) = self.waiting.as_ref().filter(|order| reached(order)).map(|order| order.left) {
            self.filled(at(round), left);
        }
    }

    fn traded(&mut self, round: usize, aggressor: Side, price: i64, size: f64) {
        self.prints.push(Print { time: traded_at(round), price: price as f64 * 0.01, size, aggressor: Some(aggressor) });
        let met = |order: &&mut Waiting| order.side != aggressor && order.limit == price;
        let Some(order) = self.waiting.as_mut().filter(met) else { return };
        let used = size.min(order.ahead);
        order.ahead -= used;
        let quantity = order.left.min((size - used).floor());
        if quantity >= 1.0 {
            self.filled(traded_at(round), quantity);
        }
    }
}

/// Charges `per_share` [currency], to the cent, for all that was filled of an order, beside its first fill.
fn charge(fills: &mut [LoggedFill], per_share: f64) {
    for of_order in fills.chunk_by_mut(|a, b| a.order_id == b.order_id) {
        let filled: f64 = of_order.iter().map(|fill| fill.quantity).sum();
        of_order[0].fee = (100.0 * per_share * filled).round() / 100.0;
    }
}

/// A log of orders that each join a queue in which so many times what is displayed stands ahead of them.
fn log(times: f64, per_share: f64, seed: u64) -> Recording<OrderLog> {
    let mut draws = Draws(seed);
    let (mut quotes, mut written) = (Quotes::with_depth(1), Written::default());
    let mut bid = 5_000_i64;
    for round in 0..ROUNDS {
        let dice = draws.uniform();
        bid += i64::from(dice < 0.006) - i64::from(dice > 0.994);
        let sizes = [(); 2].map(|()| draws.between(DISPLAYED.0, DISPLAYED.1).round());
        let level = |ticks: i64, size: f64| [Level { price: ticks as f64 * 0.01, size }];
        quotes.push(at(round), &level(bid, sizes[0]), &level(bid + 1, sizes[1]));
        written.moved(round, bid);
        if draws.uniform() < 0.35 {
            let size = (8.0 / draws.between(0.05, 1.0)).round();
            let (aggressor, price) = if draws.uniform() < 0.5 { (Side::Buy, bid + 1) } else { (Side::Sell, bid) };
            written.traded(round, aggressor, price, size);
        }
        if round % 120 == 119 && written.waiting.is_none() {
            let (side, limit, displayed) =
                if draws.uniform() < 0.5 { (Side::Buy, bid, sizes[0]) } else { (Side::Sell, bid + 1, sizes[1]) };
            let (number, quantity) = (written.orders.len(), draws.between(20.0, 90.0).round());
            let chance = draws.between(0.8, 1.2);
            let (ahead, until) = ((displayed * (1.0 + (times - 1.0) * chance)).round(), round + PATIENCE);
            written.waiting = Some(Waiting { number, side, limit, left: quantity, ahead, until });
            written.orders.push(LoggedOrder {
                id: number.to_string(),
                side,
                quantity,
                decided_at: at(round).plus_seconds(0.2),
                kind: OrderType::Other("limit".into()),
                seen_mid: None,
            });
        }
    }
    charge(&mut written.fills, per_share);
    let instrument = Instrument {
        symbol: "XYZ".into(),
        tick_size: 0.01,
        lot_size: 1.0,
        average_daily_volume: Some(1e6),
        daily_volatility: Some(0.02),
    };
    let tape = Arc::new(Tape::new(quotes, written.prints, Vec::new()));
    let market = LogMarket { instrument, tape, price: PriceAssumption::Touch, shows_own_orders: None };
    OrderLog::recording("queues", market, &written.orders, &written.fills).unwrap()
}

fn diagnosed(log: Recording<OrderLog>) -> Diagnosis {
    let twin = Assembly::new(Execution, MECHANISMS);
    diagnose(&twin, &[log], &[], Seed(1), &|_, _, _| ()).diagnosis
}

fn names(diagnosis: &Diagnosis) -> Vec<&str> {
    diagnosis.effects.iter().map(|effect| effect.mechanism.as_str()).collect()
}

#[test]
fn places_further_back_are_named_with_how_far() {
    for (times, seed) in [(1.3, 1), (1.8, 2), (3.0, 3)] {
        let diagnosis = diagnosed(log(times, 0.0, seed));
        assert_eq!((names(&diagnosis), diagnosis.verdict), (vec!["queue_position"], Verdict::Named), "{diagnosis:#?}");
        let ahead = &diagnosis.effects[0].parameters["ahead"];
        println!("ahead {} +- {}, in truth {}: {}", ahead.value, ahead.std, times - 1.0, diagnosis.summary);
        assert!((ahead.value - (times - 1.0)).abs() < 0.1 * (times - 1.0), "{ahead:?}, in truth {}", times - 1.0);
        let fit = diagnosis.fit.iter().find(|fit| fit.channel == "ahead").unwrap();
        assert!(fit.improvement_ci95[0] > 0.3, "{fit:?}");
    }
}

#[test]
fn orders_that_stand_behind_what_is_displayed_leave_nothing_to_be_told() {
    for seed in [11, 12, 13] {
        let diagnosis = diagnosed(log(1.0, 0.0, seed));
        assert_eq!(names(&diagnosis), [""; 0], "{}", diagnosis.summary);
        // A few hundred fills may be too few to tell what a mid does of itself.
        assert!(matches!(diagnosis.verdict, Verdict::NoMismatch | Verdict::NotExcited), "{}", diagnosis.summary);
    }
}

#[test]
fn that_others_give_up_their_places_is_said_and_not_called_a_mechanism() {
    let diagnosis = diagnosed(log(0.4, 0.0, 21));
    assert_eq!(names(&diagnosis), [""; 0], "{}", diagnosis.summary);
    let notes = &diagnosis.checks.notes;
    assert!(notes.iter().any(|note| note.contains("had not traded: others gave up their places")), "{notes:?}");
}

#[test]
fn what_is_charged_for_an_order_beside_its_first_fill_is_named_as_what_it_is() {
    let log = log(1.0, 0.037, 31);
    let diagnosis = diagnosed(log);
    assert_eq!((names(&diagnosis), diagnosis.verdict), (vec!["commission"], Verdict::Named), "{}", diagnosis.summary);
    let effect = &diagnosis.effects[0];
    assert_eq!(effect.parameters.keys().collect::<Vec<_>>(), ["per_share"], "{effect:?}");
    let per_share = &effect.parameters["per_share"];
    assert!((per_share.value / 0.037 - 1.0).abs() < 0.01, "{per_share:?}");
}
