//! Hours of trading: what orders do while their market is closed, when it opens and when it closes.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use std::sync::Arc;

use crate::market_scene::{
    MINUTE, Plan, event, fills, instrument, limit, quantity, quotes, run_plan, settings, status, stop, venue,
};
use trueup::market::{
    Backtest, Bar, Calendar, Condition, History, News, OrderKind, Orders, Price, Print, Quotes, Reason, Record, Settings,
    Side, Status, Strategy, Ticket, TimeInForce, View,
};
use trueup::sim2real::Timestamp;

/// An instant of RFC 3339.
fn at(text: &str) -> Timestamp {
    Timestamp(chrono::DateTime::parse_from_rfc3339(text).unwrap().timestamp_nanos_opt().unwrap())
}

fn price(value: f64) -> Price {
    Price::nearest(value).unwrap()
}

fn keeping(calendar: &str) -> Settings {
    Settings { calendars: vec![Some(Arc::new(Calendar::built_in(calendar).unwrap()))], ..settings() }
}

fn run_in(calendar: &str, history: History, mut plan: Plan) -> (Record, Plan) {
    let record = run_plan(vec![history], &[], keeping(calendar), &mut plan);
    (record, plan)
}

/// A bar of `length` from `open_at` on, from one price to another.
fn bar(open_at: &str, length: i64, [open, close]: [f64; 2]) -> Bar {
    let open_at = at(open_at);
    let (open, close) = (price(open), price(close));
    let (high, low) = (open.max(close), open.min(close));
    Bar { open_at, known_at: open_at + length, open, high, low, close, volume: 1e3 }
}

fn of(bars: Vec<Bar>) -> History {
    History::new(bars, Quotes::default()).unwrap()
}

/// Quotes of one unit around prices.
fn around(rows: &[(&str, f64)]) -> History {
    let rows: Vec<_> = rows.iter().map(|(time, mid)| (at(time).0, mid - 1.0, mid + 1.0)).collect();
    quotes(&rows)
}

/// When the orders of a plan ended unfilled, and why.
fn ended(plan: &Plan) -> Vec<(Timestamp, Reason)> {
    let of = |news| if let News::Ended(reason) = news { Some(reason) } else { None };
    plan.notices.iter().filter_map(|(_, notice)| Some((notice.at, of(notice.news)?))).collect()
}

fn order(kind: OrderKind) -> Ticket {
    Ticket::new(0, Side::Buy, quantity(1.0), kind)
}

/// A limit order far from the market.
fn far() -> Ticket {
    limit(Side::Buy, 1.0, 1.0)
}

/// When a day order ends that is sent at the first row; the last row is long after.
fn day_order_ends(calendar: &str, sent: &str) -> Timestamp {
    let later = at(sent) + 20 * 24 * 60 * MINUTE;
    let history = quotes(&[(at(sent).0, 99.0, 101.0), (later.0, 99.0, 101.0)]);
    let (_, plan) = run_in(calendar, history, event(0).submit(far().working(TimeInForce::Day)));
    let ended = ended(&plan);
    assert_eq!(ended.iter().map(|(_, reason)| *reason).collect::<Vec<_>>(), [Reason::TimeInForce], "{calendar} {sent}");
    ended[0].0
}

#[test]
fn a_day_order_ends_with_its_session_by_the_clocks_of_the_exchange() {
    for (calendar, sent, ends) in [
        ("nyse", "2024-11-01T15:00:00Z", "2024-11-01T20:00:00Z"),
        // Clocks are put back on 3 November.
        ("nyse", "2024-11-04T15:00:00Z", "2024-11-04T21:00:00Z"),
        // At the close itself the market is closed: the next session is that of Monday.
        ("nyse", "2024-11-01T20:00:00Z", "2024-11-04T21:00:00Z"),
        ("nyse", "2024-11-02T12:00:00Z", "2024-11-04T21:00:00Z"),
        // Before the open; on Thanksgiving; on the half day after it.
        ("nyse", "2024-11-27T13:00:00Z", "2024-11-27T21:00:00Z"),
        ("nyse", "2024-11-28T15:00:00Z", "2024-11-29T18:00:00Z"),
        ("nyse", "2024-11-29T15:00:00Z", "2024-11-29T18:00:00Z"),
        // The session that opens on Sunday evening is that of Monday.
        ("cme_globex", "2024-07-07T23:30:00Z", "2024-07-08T21:00:00Z"),
        ("cme_globex", "2024-07-08T21:30:00Z", "2024-07-09T21:00:00Z"),
        ("always", "2024-07-08T21:30:00Z", "2024-07-09T00:00:00Z"),
    ] {
        assert_eq!(day_order_ends(calendar, sent), at(ends), "{calendar} {sent}");
    }
}

/// A break at noon ends no day.
#[test]
fn a_day_of_two_sessions_ends_with_the_second() {
    let text = "name = 'x'\nsource = 'a test'\nzone = 'UTC'\n[[session]]\ndays = ['mon']\nopen = '09:00'\nclose = '12:00'\n\
                [[session]]\ndays = ['mon']\nopen = '13:00'\nclose = '16:00'\n";
    let calendar = Arc::new(Calendar::parse(text).unwrap());
    let settings = || Settings { calendars: vec![Some(Arc::clone(&calendar))], ..settings() };
    let rows = ["08:00", "10:00", "12:30", "13:30", "17:00"].map(|t| (format!("2024-07-08T{t}:00Z"), 100.0));
    let rows: Vec<_> = rows.iter().map(|(time, mid)| (time.as_str(), *mid)).collect();
    let mut plan = event(1)
        .submit(far().working(TimeInForce::Day))
        .submit(order(OrderKind::MarketOnClose))
        .at(2)
        .submit(order(OrderKind::MarketOnOpen));
    let record = run_plan(vec![around(&rows)], &[], settings(), &mut plan);
    assert_eq!(ended(&plan), [(at("2024-07-08T16:00:00Z"), Reason::TimeInForce)]);
    assert_eq!(fills(&record), [(at("2024-07-08T16:00:00Z").0, 1.0, 101.0)], "the afternoon has no opening");
    assert_eq!(record.outside, [Some(3)]);
}

#[test]
fn what_comes_while_the_market_is_closed_waits_for_a_price_of_the_session_unless_it_cannot_wait() {
    let rows = [
        ("2024-07-05T19:59:00Z", 100.0),
        ("2024-07-06T12:00:00Z", 50.0),
        ("2024-07-08T13:29:59Z", 60.0),
        ("2024-07-08T13:30:01Z", 110.0),
        ("2024-07-08T13:30:02Z", 120.0),
    ];
    let sell = |units| Ticket::market(0, Side::Sell, quantity(units));
    let plan = event(1)
        .submit(Ticket::market(0, Side::Buy, quantity(1.0)))
        .submit(limit(Side::Buy, 2.0, 112.0))
        .submit(limit(Side::Buy, 3.0, 100.0).on(Condition::PostOnly))
        .submit(stop(Side::Buy, 4.0, 90.0))
        .submit(sell(5.0).working(TimeInForce::ImmediateOrCancel))
        .submit(sell(6.0).working(TimeInForce::FillOrKill));
    let (record, plan) = run_in("nyse", around(&rows), plan);
    let open = at("2024-07-08T13:30:01Z").0;
    assert_eq!(fills(&record), [(open, 1.0, 111.0), (open, 2.0, 111.0), (open, 4.0, 111.0)]);
    let sent = at("2024-07-06T12:00:00Z");
    assert_eq!(ended(&plan), [(sent, Reason::MarketClosed), (sent, Reason::MarketClosed)]);
    assert_eq!(status(&record)[4..], [Status::Rejected, Status::Rejected]);
    assert_eq!(record.outside, [Some(2)]);
}

#[test]
fn an_order_left_from_yesterday_gains_from_a_gap_and_loses_its_place() {
    let rows = [("2024-07-08T19:00:00Z", 100.0), ("2024-07-08T22:00:00Z", 90.0), ("2024-07-09T13:30:00Z", 92.0)];
    let (record, _) = run_in("nyse", around(&rows), event(0).submit(limit(Side::Buy, 1.0, 98.0)));
    assert_eq!(fills(&record), [(at("2024-07-09T13:30:00Z").0, 1.0, 93.0)], "neither at 98 nor overnight at 91");
}

#[test]
fn bars_outside_sessions_are_seen_and_met_by_no_order() {
    let minutes = |from: &str, count: i64, price: f64| {
        let first = bar(from, MINUTE, [price; 2]);
        (0..count).map(move |k| Bar { open_at: first.open_at + k * MINUTE, known_at: first.known_at + k * MINUTE, ..first })
    };
    let before = minutes("2024-07-08T13:28:00Z", 2, 50.0);
    let day = minutes("2024-07-08T13:30:00Z", 2, 100.0).chain(minutes("2024-07-08T19:58:00Z", 2, 101.0));
    let after = minutes("2024-07-08T20:00:00Z", 2, 40.0).chain(minutes("2024-07-09T13:30:00Z", 2, 102.0));
    let history = of(before.chain(day).chain(after).collect());
    let market = || Ticket::market(0, Side::Buy, quantity(1.0));
    let plan = event(0)
        .submit(market())
        .submit(order(OrderKind::MarketOnClose))
        .submit(limit(Side::Buy, 1.0, 45.0))
        .at(5)
        .submit(market())
        .submit(order(OrderKind::MarketOnClose))
        .submit(order(OrderKind::MarketOnOpen));
    let (record, plan) = run_in("nyse", history, plan);
    let next = at("2024-07-09T13:30:00Z").0;
    let (open, close) = (at("2024-07-08T13:30:00Z").0, at("2024-07-08T20:00:00Z").0);
    assert_eq!(fills(&record), [(open, 1.0, 100.0), (close, 1.0, 101.0), (next, 1.0, 102.0), (next, 1.0, 102.0)]);
    assert_eq!(status(&record)[2], Status::Unfilled, "the low of 40 was outside");
    assert_eq!(status(&record)[4], Status::Unfilled, "decided at the close, for the next one");
    assert_eq!((record.outside, plan.positions.len()), (vec![Some(4)], 10));
}

#[test]
fn a_close_without_a_last_bar_fills_nothing_and_one_that_is_longer_does() {
    let on_close = || event(0).submit(order(OrderKind::MarketOnClose));
    let missing = of(vec![
        bar("2024-07-08T19:50:00Z", MINUTE, [100.0; 2]),
        bar("2024-07-08T19:57:00Z", MINUTE, [101.0; 2]),
        bar("2024-07-09T13:30:00Z", MINUTE, [102.0; 2]),
    ]);
    let (record, plan) = run_in("nyse", missing, on_close());
    assert_eq!((fills(&record), ended(&plan)), (vec![], vec![(at("2024-07-08T20:00:00Z"), Reason::NoAuction)]));
    let longer = of(vec![
        bar("2024-07-08T18:30:00Z", 60 * MINUTE, [100.0; 2]),
        bar("2024-07-08T19:30:00Z", 60 * MINUTE, [101.0, 103.0]),
        bar("2024-07-09T13:30:00Z", MINUTE, [102.0; 2]),
    ]);
    let (record, plan) = run_in("nyse", longer, on_close());
    assert_eq!(fills(&record), [(at("2024-07-08T20:00:00Z").0, 1.0, 103.0)]);
    assert_eq!(plan.notices[0].0, at("2024-07-08T20:30:00Z"), "its owner hears of it when the bar is known");
}

/// Bars of days by the calendar day hold the session whole: it opens and closes when the exchange does.
#[test]
fn daily_bars_open_and_close_with_their_session() {
    let day = |date: &str, prices| bar(&format!("{date}T00:00:00Z"), 24 * 60 * MINUTE, prices);
    let history = || {
        of(vec![
            day("2024-11-27", [100.0, 101.0]),
            // Thanksgiving, of which there should be no bar.
            day("2024-11-28", [90.0, 95.0]),
            day("2024-11-29", [102.0, 104.0]),
            day("2024-12-02", [105.0, 106.0]),
        ])
    };
    let plan = event(0)
        .submit(Ticket::market(0, Side::Buy, quantity(1.0)))
        .submit(order(OrderKind::MarketOnOpen))
        .submit(order(OrderKind::LimitOnClose { price: price(104.0) }))
        .submit(limit(Side::Buy, 1.0, 96.0).working(TimeInForce::Day))
        .submit(limit(Side::Sell, 1.0, 103.0).working(TimeInForce::Day));
    let (record, plan) = run_in("nyse", history(), plan);
    let (open, close) = (at("2024-11-29T14:30:00Z").0, at("2024-11-29T18:00:00Z").0);
    let mut all = fills(&record);
    all.sort_by_key(|fill| (fill.0, (fill.2 * 100.0) as i64));
    assert_eq!(all, [(open, 1.0, 102.0), (open, 1.0, 102.0), (close, 1.0, 103.0), (close, 1.0, 104.0)]);
    assert_eq!(ended(&plan)[0].1, Reason::TimeInForce);
    assert_eq!(record.outside, [Some(1)]);
    // Those of futures begin within their session, which opened the evening before.
    let (record, _) = run_in("cme_globex", history(), event(2).submit(order(OrderKind::MarketOnClose)));
    assert_eq!(fills(&record), [(at("2024-12-02T22:00:00Z").0, 1.0, 106.0)]);
}

/// Quotes of a day and the next, and trades.
fn two_days(prints: &[(&str, f64, f64)]) -> History {
    let rows = [
        ("2024-07-08T13:00:00Z", 100.0),
        ("2024-07-08T13:30:00.5Z", 102.0),
        ("2024-07-08T19:59:59Z", 110.0),
        ("2024-07-08T20:00:00.5Z", 50.0),
        ("2024-07-09T13:30:00Z", 120.0),
    ];
    let prints = prints.iter().map(|(time, price, size)| {
        let time = at(time);
        Print { time, price: *price, size: *size, aggressor: None }
    });
    around(&rows).with_prints(prints.collect()).unwrap()
}

#[test]
fn auctions_with_quotes_meet_the_first_price_of_the_session_and_the_last() {
    let plan = event(0)
        .submit(order(OrderKind::MarketOnOpen))
        .submit(order(OrderKind::LimitOnOpen { price: price(102.9) }))
        .submit(order(OrderKind::MarketOnClose))
        .submit(order(OrderKind::LimitOnClose { price: price(110.9) }))
        .at(3)
        .submit(order(OrderKind::MarketOnClose));
    let (record, plan) = run_in("nyse", two_days(&[]), plan);
    let (open, close) = (at("2024-07-08T13:30:00.5Z"), at("2024-07-08T20:00:00Z"));
    assert_eq!(fills(&record), [(open.0, 1.0, 103.0), (close.0, 1.0, 111.0)]);
    assert_eq!(ended(&plan), [(open, Reason::TimeInForce), (close, Reason::TimeInForce)], "beyond their limits");
    assert_eq!(status(&record)[4], Status::Unfilled, "too late for the first close");
}

#[test]
fn auctions_with_trades_are_the_first_and_the_last_of_the_session() {
    let prints = [
        ("2024-07-08T13:10:00Z", 90.0, 5.0),
        ("2024-07-08T13:30:07Z", 103.5, 40.0),
        ("2024-07-08T20:00:00Z", 108.25, 70.0),
        ("2024-07-08T20:00:01Z", 108.75, 900.0),
    ];
    let plan = || {
        event(0).submit(Ticket::new(0, Side::Buy, quantity(30.0), OrderKind::MarketOnOpen)).submit(Ticket::new(
            0,
            Side::Sell,
            quantity(30.0),
            OrderKind::MarketOnClose,
        ))
    };
    let (open, close) = (at("2024-07-08T13:30:07Z").0, at("2024-07-08T20:00:00Z").0);
    let (record, _) = run_in("nyse", two_days(&prints), plan());
    assert_eq!(fills(&record), [(open, 30.0, 103.5), (close, 30.0, 108.25)]);
    let capped = run_plan(vec![two_days(&prints)], &[("participation_cap", "", 0.1)], keeping("nyse"), &mut plan());
    assert_eq!(fills(&capped), [(open, 4.0, 103.5), (close, 7.0, 108.25)], "a tenth of the trade");
    assert_eq!(status(&capped), [Status::Expired, Status::Expired]);
}

#[test]
fn without_a_price_or_a_calendar_there_is_no_auction() {
    let silent = [("2024-07-08T13:00:00Z", 100.0), ("2024-07-09T13:30:00Z", 120.0), ("2024-07-10T13:30:00Z", 120.0)];
    let (record, plan) = run_in("nyse", around(&silent), event(0).submit(order(OrderKind::MarketOnClose)));
    assert_eq!((fills(&record), ended(&plan)), (vec![], vec![(at("2024-07-08T20:00:00Z"), Reason::NoAuction)]));
    let refused = run_plan(vec![around(&silent)], &[], settings(), &mut event(0).submit(order(OrderKind::MarketOnClose)));
    assert_eq!((refused.blotter.rejected[&Reason::NoAuction], refused.outside.len()), (1, 0));
}

#[test]
fn an_empty_quote_opens_nothing() {
    let rows = [("13:00:00", 99.0, 101.0), ("13:30:00", 0.0, 0.0), ("13:30:02", 103.0, 105.0)];
    let rows = rows.map(|(time, bid, ask)| (at(&format!("2024-07-08T{time}Z")).0, bid, ask));
    let (record, _) = run_in("nyse", quotes(&rows), event(0).submit(order(OrderKind::MarketOnOpen)));
    assert_eq!(fills(&record), [(at("2024-07-08T13:30:02Z").0, 1.0, 105.0)]);
}

/// Buys, and is flat again five minutes before the close, as it is told when that is.
#[derive(Default)]
struct FlatByClose;

impl Strategy for FlatByClose {
    fn name(&self) -> &str {
        "flat_by_close"
    }
    fn lookback(&self) -> usize {
        1
    }
    fn on_event(&mut self, view: &View<'_>, orders: &mut Orders) {
        let Some(session) = view.session(0) else { return };
        let target = if session.close - view.now() > 5 * MINUTE { 1.0 } else { 0.0 };
        orders.to_position(view, 0, quantity(target));
    }
}

#[test]
fn a_strategy_knows_when_its_session_closes() {
    // The half day after Thanksgiving.
    let rows = ["14:00", "15:00", "17:54", "17:56", "18:30"].map(|t| (format!("2024-11-29T{t}:00Z"), 100.0));
    let rows: Vec<_> = rows.iter().map(|(time, mid)| (time.as_str(), *mid)).collect();
    let backtest = Backtest::new(vec![instrument("A")], vec![around(&rows)], venue(&[]), keeping("nyse")).unwrap();
    let record = backtest.run(&mut FlatByClose).unwrap();
    let fill = |t: &str, price| (at(&format!("2024-11-29T{t}:00Z")).0, 1.0, price);
    assert_eq!(fills(&record), [fill("15:00", 101.0), fill("17:56", 99.0)]);
    let plain = backtest.settings().clone();
    let plain = Settings { calendars: Vec::new(), ..plain };
    let backtest = Backtest::new(vec![instrument("A")], vec![around(&rows)], venue(&[]), plain).unwrap();
    assert_eq!(fills(&backtest.run(&mut FlatByClose).unwrap()), [], "without a calendar nobody knows");
}

#[test]
fn a_maker_is_flat_before_the_close_of_a_half_day() {
    let first = at("2024-11-29T14:30:00Z").0;
    let rows = (0..14_000).map(|k| {
        let jump = f64::from((k * 7_919) % 11 - 5);
        let bid = (10_000.0 + jump + 100.0 * (f64::from(k) / 300.0).sin()).round() / 100.0;
        (first + i64::from(k) * Timestamp::NANOS, bid, bid + 0.02)
    });
    let history = quotes(&rows.collect::<Vec<(i64, f64, f64)>>());
    let table: toml::Table = toml::from_str(include_str!("../../strategies/market_making.toml")).unwrap();
    let strategy = table["strategy"].as_table().unwrap();
    let ends_flat = |settings: Settings| {
        let backtest = Backtest::new(vec![instrument("A")], vec![history.clone()], venue(&[]), settings).unwrap();
        let record = backtest.run(trueup::strategies::build(strategy).unwrap().as_mut()).unwrap();
        assert!(record.blotter.fills.len() > 10, "{} fills", record.blotter.fills.len());
        let last = record.blotter.fills.last().unwrap().filled_at;
        (record.ledger.is_flat(), last <= at("2024-11-29T17:55:05Z"))
    };
    assert_eq!(ends_flat(keeping("nyse")), (true, true));
    assert!(!ends_flat(settings()).0, "without a calendar nobody knows of a close");
}

/// Short from Friday to Monday: of a year of 360 days 0.36 is 0.001 a day, and a lender counts Saturday and Sunday too.
#[test]
fn holding_is_charged_by_time_be_the_market_open_or_closed() {
    let opens = ["2024-03-15T13:30:00Z", "2024-03-15T13:31:00Z", "2024-03-18T13:30:00Z", "2024-03-18T13:31:00Z"];
    let charged_by = |form: &str, settings: Settings| {
        let history = of(opens.map(|open| bar(open, MINUTE, [100.0, 100.0])).into());
        let order = |side| Ticket::market(0, side, quantity(100.0));
        let mut plan = event(0).submit(order(Side::Sell)).at(2).submit(order(Side::Buy));
        let record = run_plan(vec![history], &[("borrow_fee", form, 0.36)], settings, &mut plan);
        assert_eq!(fills(&record).iter().map(|fill| fill.0).collect::<Vec<_>>(), [at(opens[1]).0, at(opens[3]).0]);
        record.ledger.income()[0].charges.borrow.to_f64()
    };
    let charged = |settings| charged_by("held", settings);
    assert!((charged(keeping("nyse")) - 3.0 * 0.001 * 10_000.0).abs() < 1e-8, "{}", charged(keeping("nyse")));
    assert_eq!(charged(keeping("nyse")), charged(settings()));
    // Held at three midnights, the fee falls due three times, and is the same here.
    assert!((charged_by("overnight", keeping("nyse")) - 30.0).abs() < 1e-8);
}
