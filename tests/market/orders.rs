//! Orders of every kind: when they trade, at which prices, and what ends them.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use crate::market_scene::{
    MINUTE, bar, bars, event, fills, limit, of, quantity, quotes, run, run_with, settings, status, stop,
};
use trueup::market::{
    Condition, Intrabar, LimitFill, Matching, OrderKind, Price, Reason, Role, Settings, Side, Status, Ticket, TimeInForce,
};
use trueup::sim2real::Timestamp;

fn at(price: f64) -> Price {
    Price::nearest(price).unwrap()
}

fn matching(intrabar: Intrabar, limit_fill: LimitFill) -> Settings {
    Settings { matching: Matching { intrabar, limit_fill, ..Matching::default() }, ..settings() }
}

// Bars: open, high, low, close.

#[test]
fn a_limit_order_is_filled_a_tick_beyond_its_limit_and_at_its_limit() {
    let history = || of(&[[10.0, 10.0, 10.0, 10.0], [10.0, 10.5, 9.5, 10.0], [10.0, 10.2, 9.49, 10.1]]);
    let buy = || event(0).submit(limit(Side::Buy, 5.0, 9.5));
    // The second bar touches 9.50; the third goes through.
    let through = run(history(), &[], buy());
    assert_eq!(fills(&through), [(3 * MINUTE, 5.0, 9.5)]);
    assert_eq!(through.blotter.fills[0].why.role, Role::Maker);
    let touched = run_with(vec![history()], &[], matching(Intrabar::default(), LimitFill::Touch), buy());
    assert_eq!(fills(&touched), [(2 * MINUTE, 5.0, 9.5)]);
}

#[test]
fn a_limit_order_beyond_the_open_takes_the_open() {
    let history = of(&[[10.0, 10.0, 10.0, 10.0], [9.8, 10.5, 9.5, 10.0]]);
    let record = run(history, &[], event(0).submit(limit(Side::Buy, 5.0, 9.9)));
    assert_eq!(fills(&record), [(MINUTE, 5.0, 9.8)]);
    assert_eq!(record.blotter.fills[0].why.role, Role::Taker);
}

#[test]
fn a_mechanism_never_makes_a_limit_order_pay_more_than_its_limit() {
    let history = of(&[[10.0, 10.0, 10.0, 10.0], [9.89, 10.5, 9.5, 10.0]]);
    let record = run(history, &[("half_spread", "bps", 100.0)], event(0).submit(limit(Side::Buy, 5.0, 9.9)));
    assert_eq!(fills(&record), [(MINUTE, 5.0, 9.9)]);
}

#[test]
fn a_stop_is_set_off_within_the_bar_and_at_the_open_where_the_market_has_gone_past_it() {
    let history = || of(&[[10.0, 10.0, 10.0, 10.0], [10.0, 10.5, 9.5, 10.0], [11.0, 11.0, 11.0, 11.0]]);
    let within = run(history(), &[], event(0).submit(stop(Side::Buy, 5.0, 10.3)));
    assert_eq!(fills(&within), [(2 * MINUTE, 5.0, 10.3)]);
    let gap = run(history(), &[], event(0).submit(stop(Side::Buy, 5.0, 10.9)));
    assert_eq!(fills(&gap), [(2 * MINUTE, 5.0, 11.0)], "at the open beyond it, not at the trigger");
    let never = run(history(), &[], event(0).submit(stop(Side::Sell, 5.0, 9.4)));
    assert_eq!((fills(&never), status(&never)), (vec![], vec![Status::Unfilled]));
}

#[test]
fn a_stop_limit_becomes_a_limit_order_when_it_is_set_off() {
    let kind = OrderKind::StopLimit { trigger: at(10.3), price: at(10.4) };
    let buy = || event(0).submit(Ticket::new(0, Side::Buy, quantity(5.0), kind));
    let within = of(&[[10.0, 10.0, 10.0, 10.0], [10.0, 10.5, 9.5, 10.0]]);
    assert_eq!(fills(&run(within, &[], buy())), [(2 * MINUTE, 5.0, 10.3)]);
    // Beyond its limit at once: it waits until the market comes back through the limit.
    let gap = of(&[[10.0, 10.0, 10.0, 10.0], [11.0, 11.0, 10.9, 11.0], [10.8, 10.8, 10.2, 10.3]]);
    assert_eq!(fills(&run(gap, &[], buy())), [(3 * MINUTE, 5.0, 10.4)]);
}

#[test]
fn a_trailing_stop_follows_the_market_and_stays_while_it_comes_back() {
    let history = of(&[
        [10.0, 10.0, 10.0, 10.0],
        [10.0, 11.0, 10.0, 11.0],
        [11.0, 12.0, 11.0, 12.0],
        [12.0, 12.0, 11.6, 11.8],
        [11.8, 11.8, 11.0, 11.0],
    ]);
    let sell = Ticket::new(0, Side::Sell, quantity(5.0), OrderKind::TrailingStop { distance: at(0.5) });
    let record = run(history, &[], event(0).submit(sell));
    assert_eq!(fills(&record), [(5 * MINUTE, 5.0, 11.5)], "half a unit below the best of 12.00");
}

#[test]
fn a_bracket_leaves_by_one_exit_and_cancels_the_other() {
    let entry = || Ticket::market(0, Side::Buy, quantity(10.0));
    let up = of(&[[10.0, 10.0, 10.0, 10.0], [10.0, 10.4, 9.9, 10.2], [10.2, 11.1, 10.2, 11.0], [11.0, 11.0, 8.0, 8.0]]);
    let record = run(up, &[], event(0).bracket(entry(), at(11.0), at(9.5)));
    assert_eq!(fills(&record), [(MINUTE, 10.0, 10.0), (3 * MINUTE, 10.0, 11.0)]);
    assert_eq!(status(&record), [Status::Filled, Status::Filled, Status::Cancelled]);
    assert_eq!(record.blotter.orders[2].reason, Some(Reason::Linked));
    assert!(record.ledger.is_flat());
    let down = of(&[[10.0, 10.0, 10.0, 10.0], [10.0, 10.4, 9.9, 10.2], [10.2, 10.2, 9.2, 9.3], [9.3, 12.0, 9.3, 12.0]]);
    let record = run(down, &[], event(0).bracket(entry(), at(11.0), at(9.5)));
    assert_eq!(fills(&record), [(MINUTE, 10.0, 10.0), (3 * MINUTE, 10.0, 9.5)]);
}

/// Stop and target in one bar: which is filled is the rule's, and counted.
#[test]
fn stop_and_target_in_one_bar_are_resolved_by_the_stated_rule_and_counted() {
    let outcome = |rule| {
        let both = of(&[[10.0, 10.0, 10.0, 10.0], [10.0, 10.1, 9.9, 10.0], [10.0, 11.5, 9.0, 10.0], [10.0; 4]]);
        let entry = Ticket::market(0, Side::Buy, quantity(1.0));
        let plan = event(0).bracket(entry, at(11.0), at(9.5));
        let record = run_with(vec![both], &[], matching(rule, LimitFill::Through), plan);
        (fills(&record)[1].2, record.held.ambiguous_bars)
    };
    assert_eq!(outcome(Intrabar::Pessimistic), (9.5, 1));
    assert_eq!(outcome(Intrabar::Optimistic), (11.0, 1));
    assert_eq!(outcome(Intrabar::LowFirst), (9.5, 1));
    assert_eq!(outcome(Intrabar::HighFirst), (11.0, 1));
    assert_eq!(outcome(Intrabar::NearestFirst), (9.5, 1), "the low is 1.0 away, the high 1.5");
}

#[test]
fn exits_work_for_as_much_as_the_entry_has_filled() {
    // A tenth of 100 a bar: the entry takes three bars for 30.
    let all = (0..8).map(|k| bar(k, 10.0, 10.0, 100.0)).chain([bar(8, 11.5, 11.5, 1e6)]).collect();
    let history = trueup::market::History::new(all, Default::default()).unwrap();
    let plan = event(0).bracket(limit(Side::Buy, 30.0, 10.0), at(11.0), at(9.0));
    let record = run(history, &[("participation_cap", "", 0.1)], plan);
    let quantities: Vec<f64> = fills(&record).iter().map(|fill| fill.1).collect();
    assert_eq!(quantities, [10.0, 10.0, 10.0, 30.0]);
    assert!(record.ledger.is_flat());
}

#[test]
fn orders_for_the_open_and_the_close_trade_there_and_nowhere_else() {
    // Two days of three bars.
    let day = 1_440;
    let all = [0, 1, 2, day, day + 1, day + 2]
        .iter()
        .enumerate()
        .map(|(k, m)| bar(*m, 10.0 + k as f64, 10.5 + k as f64, 1e3))
        .collect();
    let history = trueup::market::History::new(all, Default::default()).unwrap();
    let order = |kind| Ticket::new(0, Side::Buy, quantity(1.0), kind);
    let plan = event(0)
        .submit(order(OrderKind::MarketOnOpen))
        .submit(order(OrderKind::MarketOnClose))
        .submit(order(OrderKind::LimitOnClose { price: at(12.0) }))
        .submit(order(OrderKind::LimitOnOpen { price: at(13.0) }));
    let record = run(history, &[], plan);
    assert_eq!(fills(&record), [(3 * MINUTE, 1.0, 12.5), (day * MINUTE, 1.0, 13.0), (day * MINUTE, 1.0, 13.0)]);
    assert_eq!(record.blotter.orders[2].status, Status::Expired, "the close of 12.5 is beyond its limit");
}

#[test]
fn the_time_in_force_ends_what_is_left() {
    let cases = [
        (TimeInForce::ImmediateOrCancel, Status::Expired),
        (TimeInForce::FillOrKill, Status::Rejected),
        (TimeInForce::Day, Status::Expired),
        (TimeInForce::GoodTillDate(Timestamp(3 * MINUTE)), Status::Expired),
        (TimeInForce::GoodTillCancelled, Status::Filled),
    ];
    for (time_in_force, expected) in cases {
        // Below the limit only on the second day.
        let all =
            [0, 1, 2, 3, 1_440, 1_441].iter().map(|m| bar(*m, if *m < 1_440 { 10.0 } else { 8.0 }, 10.0, 1e3)).collect();
        let history = trueup::market::History::new(all, Default::default()).unwrap();
        let record = run(history, &[], event(0).submit(limit(Side::Buy, 1.0, 9.0).working(time_in_force)));
        assert_eq!(status(&record), [expected], "{time_in_force:?}");
    }
}

#[test]
fn conditions_are_kept() {
    let flat = || of(&[[10.0; 4], [10.0, 10.5, 9.5, 10.0], [10.0; 4], [10.0; 4]]);
    let post = run(flat(), &[], event(0).submit(limit(Side::Buy, 1.0, 10.2).on(Condition::PostOnly)));
    assert_eq!((status(&post), post.blotter.orders[0].reason), (vec![Status::Rejected], Some(Reason::PostOnly)));
    let reduce = run(
        flat(),
        &[],
        event(0)
            .submit(Ticket::market(0, Side::Buy, quantity(3.0)))
            .at(1)
            .submit(Ticket::market(0, Side::Sell, quantity(5.0)).on(Condition::ReduceOnly)),
    );
    assert_eq!(fills(&reduce), [(MINUTE, 3.0, 10.0), (2 * MINUTE, 3.0, 10.0)]);
    assert!(reduce.ledger.is_flat());
}

#[test]
fn an_order_is_cancelled_and_changed_on_request() {
    let history = || of(&[[10.0; 4], [10.0, 10.0, 9.8, 10.0], [10.0, 10.0, 9.0, 9.0], [9.0; 4]]);
    let cancelled = run(history(), &[], event(0).submit(limit(Side::Buy, 1.0, 9.5)).at(1).cancel(1));
    assert_eq!((status(&cancelled), cancelled.blotter.orders[0].reason), (vec![Status::Cancelled], Some(Reason::Asked)));
    let changed = run(history(), &[], event(0).submit(limit(Side::Buy, 1.0, 9.5)).at(1).replace(1, Some(4.0), Some(9.2)));
    assert_eq!(fills(&changed), [(3 * MINUTE, 4.0, 9.2)]);
    let unknown = run(history(), &[], event(0).cancel(77));
    assert_eq!(unknown.blotter.rejected[&Reason::UnknownOrder], 1);
}

#[test]
fn one_cancels_the_other() {
    let history = of(&[[10.0; 4], [10.0, 10.0, 9.0, 10.0], [10.0, 12.0, 10.0, 12.0]]);
    let plan = event(0).group(vec![limit(Side::Buy, 2.0, 9.5), stop(Side::Buy, 2.0, 11.0)]);
    let record = run(history, &[], plan);
    assert_eq!(fills(&record), [(2 * MINUTE, 2.0, 9.5)]);
    assert_eq!(status(&record), [Status::Filled, Status::Cancelled]);
}

#[test]
fn prices_off_the_tick_and_orders_without_their_like_are_refused() {
    let plan = event(0)
        .submit(limit(Side::Buy, 1.0, 9.505))
        .submit(limit(Side::Buy, 1.0, -1.0))
        .submit(limit(Side::Buy, 1.0, 9.0).working(TimeInForce::GoodTillDate(Timestamp(5))))
        .submit(limit(Side::Buy, 1.0, 9.0).linked(trueup::market::Link::ChildOf { parent: trueup::market::OrderId(99) }));
    let record = run(bars(&[(10.0, 10.0), (10.0, 10.0)]), &[], plan);
    let reasons: Vec<Reason> = record.blotter.rejections.iter().map(|r| r.reason).collect();
    assert_eq!(reasons, [Reason::OffTick, Reason::OffTick, Reason::Late, Reason::Unlinked]);
}

// Quotes: time, bid, ask; 100 displayed on each side.

#[test]
fn a_resting_order_is_filled_when_others_show_its_price() {
    let rows = [(0, 99.0, 101.0), (1, 99.0, 101.0), (2, 98.0, 100.0), (3, 97.0, 99.0)];
    let record = run(quotes(&rows), &[], event(0).submit(limit(Side::Buy, 7.0, 99.0)));
    assert_eq!(fills(&record), [(3, 7.0, 99.0)]);
    assert_eq!(record.blotter.fills[0].why.queued_behind, 100.0);
}

#[test]
fn a_limit_order_takes_what_is_displayed_within_it_and_rests_with_the_rest() {
    let rows = [(0, 99.0, 101.0), (1, 99.0, 101.0), (2, 99.0, 102.0), (3, 99.0, 100.0)];
    let record = run(quotes(&rows), &[], event(0).submit(limit(Side::Buy, 150.0, 101.0)));
    assert_eq!(fills(&record), [(0, 100.0, 101.0), (3, 50.0, 101.0)]);
    let killed = limit(Side::Buy, 150.0, 101.0).working(TimeInForce::FillOrKill);
    assert_eq!(status(&run(quotes(&rows), &[], event(0).submit(killed))), [Status::Rejected]);
    let at_once = limit(Side::Buy, 150.0, 101.0).working(TimeInForce::ImmediateOrCancel);
    let record = run(quotes(&rows), &[], event(0).submit(at_once));
    assert_eq!((fills(&record), status(&record)), (vec![(0, 100.0, 101.0)], vec![Status::Expired]));
}

#[test]
fn a_stop_is_set_off_by_the_price_it_would_take() {
    let rows = [(0, 99.0, 101.0), (1, 100.0, 102.0), (2, 101.0, 103.0), (3, 102.0, 104.0)];
    let record = run(quotes(&rows), &[], event(0).submit(stop(Side::Buy, 1.0, 103.0)));
    assert_eq!(fills(&record), [(2, 1.0, 103.0)]);
}

/// A seller comes to 100, where nobody was: who bids more than that has waited for him, and the stop that his price sets off came first
/// but takes what is left.
#[test]
fn who_rests_is_met_before_what_a_price_sets_off() {
    let rows = [(0, 99.0, 101.0), (1, 99.0, 0.0), (2, 99.0, 100.0)];
    let plan = event(1).submit(stop(Side::Buy, 100.0, 99.5)).submit(limit(Side::Buy, 5.0, 100.5));
    assert_eq!(fills(&run(quotes(&rows), &[], plan)), [(2, 5.0, 100.5), (2, 100.0, 100.0)]);
}

/// 1,000 short at 10 from the second minute of the first day: charged at midnight, when it grows, and at the end.
#[test]
fn what_is_held_is_charged_for_the_time_it_was_held() {
    let day = 1_440;
    let all = [0, 1, 2, day, day + 1, 2 * day, 2 * day + 1].iter().map(|m| bar(*m, 10.0, 10.0, 1e6)).collect();
    let history = trueup::market::History::new(all, Default::default()).unwrap();
    let sell = |units: f64| Ticket::market(0, Side::Sell, quantity(units));
    let plan = event(0).submit(sell(1_000.0)).at(3).submit(sell(1_000.0));
    let record = run(history, &[("borrow_fee", "held", 0.36)], plan);
    // 0.36 a year of 360 days: 0.001 a day. 10,000 from minute 1 to minute 1,441, and 20,000 to minute 2,882.
    let minutes = f64::from(day as i32);
    let expected = 0.001 * (10_000.0 * (f64::from(1_441 - 1)) / minutes + 20_000.0 * f64::from(2_882 - 1_441) / minutes);
    let charged = record.ledger.income()[0].charges.total().unwrap().to_f64();
    assert!((charged - expected).abs() < 1e-6, "{charged} is not {expected}");
    let equity = record.ledger.equity().unwrap().to_f64();
    assert!((equity - (100_000.0 - charged)).abs() < 1e-9);
    assert_eq!(record.equity.last().unwrap().equity, equity);
}

#[test]
fn orders_for_an_auction_that_the_data_do_not_tell_are_refused() {
    let order = Ticket::new(0, Side::Buy, quantity(1.0), OrderKind::MarketOnClose);
    let record = run(quotes(&[(0, 99.0, 101.0), (1, 99.0, 101.0)]), &[], event(0).submit(order));
    assert_eq!(record.blotter.rejected[&Reason::NoAuction], 1);
}

#[test]
fn a_reduce_only_order_that_finds_nothing_to_close_says_so() {
    let order = || Ticket::market(0, Side::Sell, quantity(5.0)).on(Condition::ReduceOnly);
    for history in [bars(&[(10.0, 10.0); 4]), quotes(&[(0, 99.0, 101.0), (1, 99.0, 101.0)])] {
        let record = run(history, &[], event(0).submit(order()));
        assert_eq!((status(&record), record.blotter.orders[0].reason), (vec![Status::Cancelled], Some(Reason::ReduceOnly)));
    }
}

#[test]
fn an_order_that_is_moved_into_the_market_takes_there_and_a_post_only_one_is_refused() {
    let rows = [(0, 99.0, 101.0), (1, 99.0, 101.0), (2, 99.0, 101.0)];
    let moved = |condition| {
        let plan = event(0).submit(limit(Side::Buy, 5.0, 98.0).on(condition)).at(1).replace(1, None, Some(103.0));
        run(quotes(&rows), &[], plan)
    };
    let record = moved(Condition::None);
    assert_eq!(fills(&record), [(1, 5.0, 101.0)], "at what is asked, not at its limit");
    assert_eq!(record.blotter.fills[0].why.role, Role::Taker);
    assert_eq!(status(&moved(Condition::PostOnly)), [Status::Rejected]);
}

#[test]
fn what_buyers_took_is_still_there_for_sellers() {
    let rows = [(0, 99.0, 101.0), (1, 99.0, 101.0)];
    let at_once = |side, price| limit(side, 80.0, price).working(TimeInForce::ImmediateOrCancel);
    let plan =
        event(0).submit(at_once(Side::Buy, 101.0)).submit(at_once(Side::Sell, 99.0)).submit(at_once(Side::Buy, 101.0));
    assert_eq!(fills(&run(quotes(&rows), &[], plan)), [(0, 80.0, 101.0), (0, 80.0, 99.0), (0, 20.0, 101.0)]);
}

#[test]
fn quantities_that_are_changed_count_what_was_filled_and_no_sibling() {
    // 100 are displayed, which the first takes: 50 are left of the second, and then 30. The first fills the rest.
    let rows = [(0, 99.0, 101.0), (1, 99.0, 101.0), (2, 97.0, 98.0)];
    let plan = event(0).group(vec![limit(Side::Buy, 150.0, 101.0), limit(Side::Buy, 150.0, 97.5)]).at(1).replace(
        2,
        Some(30.0),
        None,
    );
    let record = run(quotes(&rows), &[], plan);
    let of = |k: usize| (record.blotter.orders[k].quantity.to_f64(), record.blotter.orders[k].filled.to_f64());
    assert_eq!((of(0), of(1)), ((150.0, 150.0), (30.0, 0.0)));
    assert_eq!(record.blotter.orders[1].reason, Some(Reason::Linked));
}

#[test]
fn a_message_about_an_order_that_is_over_is_counted() {
    let plan = event(0).submit(Ticket::market(0, Side::Buy, quantity(1.0))).at(2).cancel(1).replace(1, None, Some(9.0));
    assert_eq!(run(bars(&[(10.0, 10.0); 4]), &[], plan).blotter.rejected[&Reason::UnknownOrder], 2);
}
