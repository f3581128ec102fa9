//! Checkpoints and forks: a run goes on from where it was as if it had never stopped, and a fork differs by its fill alone.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use crate::market_scene::{Busy, MINUTE, bars, event, fills, instrument, limit, of, quantity, settings, venue};
use proptest::prelude::*;
use trueup::market::{
    AnotherFill, Backtest, Checkpoint, ForkError, History, Latencies, Latency, Moment, OrderId, Price, Record, Settings,
    Side, Strategy as Trader, Ticket,
};
use trueup::sim2real::{Seed, Timestamp};

fn price(value: f64) -> Price {
    Price::nearest(value).unwrap()
}

/// Random bars of a market whose messages take random times, and whose fills cost random amounts.
fn random(moves: &[(i32, u8)]) -> Backtest {
    let mut cents = 10_000;
    let rows: Vec<[f64; 4]> = moves
        .iter()
        .map(|(step, wide)| {
            let open = f64::from(cents) / 100.0;
            cents += step;
            let (close, wide) = (f64::from(cents) / 100.0, f64::from(*wide) / 100.0);
            [open, open.max(close) + wide, open.min(close) - wide, close]
        })
        .collect();
    let order = Latency::Exponential { least: 0.5, mean: 70.0 };
    let latencies = Latencies {
        feed: Latency::Uniform { least: 0.0, most: 90.0 },
        response: order.clone(),
        order,
        ..Latencies::default()
    };
    let parts = [("textbook_slippage", "", 5.0), ("adverse_selection", "", 1.0), ("transient_impact", "exponential", 9.0)];
    let about =
        trueup::market::Instrument { average_daily_volume: Some(1e5), daily_volatility: Some(0.02), ..instrument("A") };
    Backtest::new(vec![about], vec![of(&rows)], venue(&parts), Settings { seed: Seed(5), latencies, ..settings() }).unwrap()
}

fn to_the_end(mut session: trueup::market::Session, strategy: &mut dyn Trader) -> Record {
    while session.step(strategy).unwrap().is_some() {}
    session.finish().unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_run_goes_on_as_if_it_had_never_stopped(
        moves in proptest::collection::vec((-60..61_i32, 0..40_u8), 5..120),
        part in 0.0..1.0_f64,
    ) {
        let backtest = random(&moves);
        let whole = backtest.run(&mut Busy::default()).unwrap();
        let at = Moment::Events((part * moves.len() as f64) as usize);
        let (mut session, mut strategy) = (backtest.start(), Busy::default());
        prop_assert!(session.run_to(at, &mut strategy).unwrap());
        let saved = serde_json::to_string(&session.checkpoint()).unwrap();
        let (fork, mut copy) = (session.fork().unwrap(), strategy.copied().unwrap());
        prop_assert_eq!(&to_the_end(session, &mut strategy), &whole);
        prop_assert_eq!(&to_the_end(fork, copy.as_mut()), &whole);
        // Another process comes to the same moment by itself.
        let checkpoint: Checkpoint = serde_json::from_str(&saved).unwrap();
        let (mut session, mut strategy) = (backtest.start(), Busy::default());
        session.run_to(Moment::Events(checkpoint.events), &mut strategy).unwrap();
        prop_assert_eq!(session.check(&checkpoint), Ok(()));
        prop_assert_eq!(&to_the_end(session, &mut strategy), &whole);
    }
}

#[test]
fn a_run_on_other_data_does_not_go_on_from_a_checkpoint() {
    let moves: Vec<(i32, u8)> = (0..60).map(|k| (k * 7 % 31 - 15, 5)).collect();
    let mut others = moves.clone();
    others[8].0 += 1;
    let (backtest, other) = (random(&moves), random(&others));
    let (mut session, mut strategy) = (backtest.start(), Busy::default());
    session.run_to(Moment::Events(30), &mut strategy).unwrap();
    let checkpoint = session.checkpoint();
    let (mut session, mut strategy) = (other.start(), Busy::default());
    session.run_to(Moment::Events(30), &mut strategy).unwrap();
    assert_eq!(session.check(&checkpoint), Err(ForkError::Changed { events: 30 }));
    let (short, mut strategy) = (random(&moves[..20]), Busy::default());
    let mut session = short.start();
    assert!(!session.run_to(Moment::Events(30), &mut strategy).unwrap());
    assert_eq!(session.check(&checkpoint), Err(ForkError::Ended { events: 30, found: 20 }));
}

/// What is under way is part of the moment, though the account knows nothing of it yet.
#[test]
fn a_moment_is_another_where_another_order_works() {
    let history = || bars(&[(100.0, 101.0), (101.0, 102.0), (102.0, 103.0)]);
    let at = |plan: crate::market_scene::Plan| {
        let backtest = Backtest::new(vec![instrument("A")], vec![history()], venue(&[]), settings()).unwrap();
        let (mut session, mut plan) = (backtest.start(), plan);
        session.run_to(Moment::Events(2), &mut plan).unwrap();
        session.checkpoint()
    };
    let far = |price: f64| event(0).submit(limit(Side::Buy, 1.0, price));
    assert_eq!(at(far(50.0)), at(far(50.0)));
    assert!(at(far(50.0)).state != at(far(51.0)).state && at(far(50.0)).state != at(event(9)).state);
}

#[test]
fn a_run_stops_before_a_time_and_when_an_order_was_sent() {
    let history = bars(&[(100.0, 101.0), (101.0, 102.0), (102.0, 103.0), (103.0, 104.0)]);
    let backtest = Backtest::new(vec![instrument("A")], vec![history], venue(&[]), settings()).unwrap();
    let mut plan = event(2).submit(Ticket::market(0, Side::Buy, quantity(10.0)));
    let mut session = backtest.start();
    assert!(session.run_to(Moment::Before(Timestamp(2 * MINUTE)), &mut plan).unwrap());
    assert_eq!(session.events(), 1, "the second bar is over at the second minute");
    assert!(session.run_to(Moment::Sent(OrderId(1)), &mut plan).unwrap());
    assert_eq!(session.events(), 3);
    assert!(!session.run_to(Moment::Sent(OrderId(2)), &mut plan).unwrap());
}

/// The fork of a run at an order, with `instead`.
fn forked(history: History, plan: &crate::market_scene::Plan, instead: AnotherFill) -> (Record, Record) {
    let backtest =
        Backtest::new(vec![instrument("A")], vec![history], venue(&[("commission", "bps", 10.0)]), settings()).unwrap();
    let (mut session, mut strategy) = (backtest.start(), plan.clone());
    assert!(session.run_to(Moment::Sent(OrderId(1)), &mut strategy).unwrap());
    let (mut fork, mut other) = (session.fork().unwrap(), strategy.clone());
    fork.fill_instead(OrderId(1), instead).unwrap();
    (to_the_end(session, &mut strategy), to_the_end(fork, &mut other))
}

#[test]
fn a_fork_differs_by_its_fill_alone() {
    let history = bars(&[(100.0, 101.0), (101.5, 102.0), (102.5, 103.0), (103.5, 104.0)]);
    let plan = event(0).submit(Ticket::market(0, Side::Buy, quantity(10.0)));
    let (run, fork) = forked(history, &plan, AnotherFill { quantity: None, price: price(101.75) });
    assert_eq!((fills(&run), fills(&fork)), (vec![(MINUTE, 10.0, 101.5)], vec![(MINUTE, 10.0, 101.75)]));
    // A quarter more for each of ten; the fee is that of the fill it replaces.
    assert_eq!(run.blotter.fills[0].fee, fork.blotter.fills[0].fee);
    let cents = |gap: f64| (gap * 100.0).round();
    let gap: Vec<f64> = run.equity.iter().zip(&fork.equity).map(|(a, b)| cents(a.equity - b.equity)).collect();
    assert_eq!(gap, [0.0, 250.0, 250.0, 250.0]);
}

#[test]
fn what_another_fill_leaves_works_on() {
    // The low of the third bar is below the limit, too: there the rest is filled as it would be.
    let history = of(&[[100.0, 100.0, 100.0, 100.0], [99.5, 99.5, 98.0, 99.0], [99.0, 99.5, 98.0, 99.0], [99.0; 4]]);
    let plan = event(0).submit(limit(Side::Buy, 10.0, 98.5));
    let instead = AnotherFill { quantity: Some(quantity(4.0)), price: price(98.25) };
    let (run, fork) = forked(history, &plan, instead);
    assert_eq!(fills(&run).iter().map(|fill| (fill.1, fill.2)).collect::<Vec<_>>(), [(10.0, 98.5)]);
    assert_eq!(fills(&fork).iter().map(|fill| (fill.1, fill.2)).collect::<Vec<_>>(), [(4.0, 98.25), (6.0, 98.5)]);
}

#[test]
fn fills_that_cannot_be_are_refused() {
    let history = bars(&[(100.0, 101.0), (101.5, 102.0), (102.5, 103.0)]);
    let backtest = Backtest::new(vec![instrument("A")], vec![history], venue(&[]), settings()).unwrap();
    let mut plan = event(0).submit(Ticket::market(0, Side::Buy, quantity(10.0)));
    let mut session = backtest.start();
    let instead = |value: f64, units: Option<f64>| AnotherFill { quantity: units.map(quantity), price: price(value) };
    assert_eq!(session.fill_instead(OrderId(1), instead(100.0, None)), Err(ForkError::UnknownOrder(1)));
    session.run_to(Moment::Sent(OrderId(1)), &mut plan).unwrap();
    for (value, units, what) in
        [(100.001, None, "price"), (0.0, None, "price"), (100.0, Some(0.5), "quantity"), (100.0, Some(0.0), "quantity")]
    {
        let error = session.fill_instead(OrderId(1), instead(value, units)).unwrap_err();
        assert!(error.to_string().starts_with(what), "{error}");
    }
    assert_eq!(session.fill_instead(OrderId(1), instead(100.0, Some(3.0))), Ok(()));
}
