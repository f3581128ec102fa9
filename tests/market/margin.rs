//! Margin: orders it refuses, and what the broker closes.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use crate::account_scene::{buy, cash, minute, of, run, sell, split, with};
use crate::market_scene::{MINUTE, bars, event, fills, limit, quantity, quotes, run_plan};
use trueup::market::metric::Counts;
use trueup::market::{Account, Cash, Fraction, Latencies, Latency, OrderId, Reason, Sender, Settings, Side, Status, Terms};
use trueup::sim2real::Timestamp;

fn regulation_t() -> Account {
    of(&[Terms::default().with_regulation_t()])
}

#[test]
fn an_order_that_initial_margin_does_not_carry_is_refused_unless_it_reduces() {
    let flat = |k: usize| bars(&vec![(100.0, 100.0); k]);
    let plan = event(0).submit(buy(0, 2_001.0)).submit(buy(0, 2_000.0)).submit(buy(0, 1.0)).at(1).submit(sell(0, 5.0));
    let record = run(vec![flat(4)], &[], regulation_t(), plan);
    assert_eq!((record.blotter.rejected[&Reason::Margin], record.blotter.rejections[0].quantity), (2, quantity(2_001.0)));
    assert_eq!(fills(&record), [(MINUTE, 2_000.0, 100.0), (2 * MINUTE, 5.0, 100.0)]);
    assert_eq!((record.account.margin_calls.len(), Counts::of(&record).broker_orders), (0, 0));
}

/// 2,000 at 100 on 100,000 of equity. At 66 equity is 32,000 and 33,000 are required: 1,000 at 16.5 a share are 61. At 65
/// equity is 30,061 and 31,508.75 are required: 1,447.75 at 16.25 a share are 90.
#[test]
fn the_broker_closes_what_maintenance_takes_and_no_more() {
    let history = || vec![bars(&[(100.0, 100.0), (100.0, 66.0), (66.0, 66.0), (66.0, 65.0), (65.0, 65.0), (65.0, 65.0)])];
    let slow = Latencies { order: Latency::Constant { seconds: 30.0 }, ..Latencies::default() };
    let plan = || event(0).submit(buy(0, 2_000.0)).submit(limit(Side::Sell, 1.0, 200.0));
    let mut told = plan();
    let record = run_plan(history(), &[("commission", "per_share", 0.0)], with(regulation_t()), &mut told);
    assert_eq!(fills(&record), [(MINUTE, 2_000.0, 100.0), (2 * MINUTE, 61.0, 66.0), (4 * MINUTE, 90.0, 65.0)]);
    let senders: Vec<(u64, Sender, Status)> =
        record.blotter.orders.iter().map(|order| (order.order_id, order.sender, order.status)).collect();
    let (strategy, broker) = (Sender::Strategy, Sender::Broker);
    assert_eq!(
        senders,
        [
            (1, strategy, Status::Filled),
            (2, strategy, Status::Unfilled),
            (3, broker, Status::Filled),
            (4, broker, Status::Filled)
        ]
    );
    let calls: Vec<(Timestamp, Cash, Cash)> =
        record.account.margin_calls.iter().map(|call| (call.at, call.equity, call.required)).collect();
    assert_eq!(calls, [(minute(2), cash(32_000.0), cash(33_000.0)), (minute(4), cash(30_061.0), cash(31_508.75))]);
    let heard: Vec<OrderId> = told.notices.iter().map(|(_, notice)| notice.order_id).collect();
    assert_eq!(heard, [OrderId(1), OrderId(3), OrderId(4)]);
    // The broker needs no time that the strategy needs, which arrives half a bar later.
    let settings = Settings { latencies: slow, ..with(regulation_t()) };
    let late = run_plan(history(), &[], settings, &mut plan());
    let at: Vec<i64> = fills(&late).iter().map(|fill| fill.0).collect();
    assert_eq!(at, [2 * MINUTE], "the entry alone: 2,000 at 66 need no call");
}

/// What would add to the position is taken back before anything is closed; nobody but the broker takes back its orders.
#[test]
fn a_margin_call_takes_back_what_adds_and_is_the_brokers_own() {
    let history = vec![bars(&[(100.0, 100.0), (100.0, 66.0), (66.0, 66.0), (66.0, 66.0)])];
    let mut account = regulation_t();
    account.terms[0].long.initial = Fraction::percent(30);
    let plan = event(0).submit(buy(0, 2_000.0)).submit(limit(Side::Buy, 5.0, 50.0)).at(1).cancel(3);
    let record = run(history, &[], account, plan);
    let orders = &record.blotter.orders;
    assert_eq!((orders[1].status, orders[1].reason), (Status::Cancelled, Some(Reason::Liquidated)));
    assert_eq!((orders[2].sender, orders[2].filled), (Sender::Broker, quantity(61.0)));
    assert_eq!(record.blotter.rejected[&Reason::NotOwn], 1);
}

/// Where nothing can be sold the broker does not send an order an event; where nothing is left it sends none.
#[test]
fn a_margin_call_sends_no_order_twice() {
    // Quotes whose bid is empty from the fall on: the order waits.
    let mut rows = vec![(0, 99.9, 100.1), (10, 99.9, 100.1), (20, 54.9, 55.1)];
    rows.extend((3..50).map(|k| (10 * k, 0.0, 55.1)));
    rows.push((500, 54.9, 55.1));
    let constant = |seconds| Latency::Constant { seconds };
    let latencies = Latencies { response: constant(1e-7), ..Latencies::default() };
    let settings = Settings { latencies, ..with(regulation_t()) };
    let record = run_plan(vec![quotes(&rows)], &[], settings, &mut event(0).submit(buy(0, 1_990.0)));
    let by_broker = record.blotter.orders.iter().filter(|order| order.sender == Sender::Broker).count();
    assert_eq!((by_broker, record.account.margin_calls.len()), (1, 1));
    // Below 0 all is sold, once, and the debt stays.
    let gone = vec![bars(&[(100.0, 100.0), (100.0, 40.0), (40.0, 40.0), (40.0, 40.0), (40.0, 40.0)])];
    let record = run(gone, &[], regulation_t(), event(0).submit(buy(0, 2_000.0)));
    assert_eq!(fills(&record).len(), 2);
    assert_eq!((record.ledger.is_flat(), record.ledger.equity().unwrap()), (true, cash(-20_000.0)));
}

/// 2,000 at 100 are 4,000 at 50, and the broker can sell all of them.
#[test]
fn a_margin_call_after_a_split_closes_in_new_units() {
    let history = vec![bars(&[(100.0, 100.0), (100.0, 100.0), (50.0, 50.0), (50.0, 20.0), (20.0, 20.0), (20.0, 20.0)])];
    let account = Account { actions: vec![split(2, 2, 1)], ..regulation_t() };
    let record = run(history, &[], account, event(0).submit(buy(0, 2_000.0)));
    assert_eq!(fills(&record), [(MINUTE, 2_000.0, 100.0), (4 * MINUTE, 4_000.0, 20.0)]);
    assert_eq!((record.ledger.is_flat(), record.account.margin_calls.len()), (true, 1));
}
