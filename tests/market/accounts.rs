//! Accounts of runs: multipliers, currencies, dividends, splits and charges, by hand and to the last unit.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails where a value is missing")]

use crate::account_scene::{at, buy, cash, minute, of, run, sell, split, with};
use crate::market_scene::{MINUTE, Plan, bar, bars, event, fills, limit, quantity, quotes, run_plan, venue};
use trueup::market::metric::{Costs, Counts, CurrencySummary, Metrics, RoundTrip};
use trueup::market::{
    Account, ActionKind, Backtest, Cash, CorporateAction, Fraction, History, Latencies, Latency, Multiplier, News,
    OrderKind, Orders, Rate, Reason, Record, Settings, Side, Status, Strategy, Terms, View,
};
use trueup::sim2real::Timestamp;

fn fifty() -> Terms {
    Terms { multiplier: Multiplier::new(50).unwrap(), ..Terms::default() }
}

/// To 1e-9: the nearest float to an amount of cash is a little off.
fn equity(record: &Record) -> Vec<f64> {
    record.equity.iter().map(|point| nanos(point.equity)).collect()
}

fn nanos(amount: f64) -> f64 {
    (amount * 1e9).round() / 1e9
}

fn dividend(minutes: i64, per_unit: f64, percent: u8) -> CorporateAction {
    let kind = ActionKind::Dividend { per_unit: at(per_unit), withholding: Fraction::percent(percent) };
    CorporateAction { at: minute(minutes), instrument: 0, kind }
}

// Bars of open and close, a minute each: what is decided on bar k meets the open of bar k + 1.

/// Two contracts of 50 at 100 and a half spread of 0.10: 10,010 paid, worth 10,200 at 102.
#[test]
fn a_multiplier_is_in_values_costs_fees_and_leverage() {
    let history = || bars(&[(100.0, 100.0), (100.0, 101.0), (102.0, 102.0)]);
    let parts = [("half_spread", "bps", 10.0), ("commission", "bps", 1.0)];
    let record = run(vec![history()], &parts, of(&[fifty()]), event(0).submit(buy(0, 2.0)));
    // A hundredth of a percent of 10,010.
    assert_eq!(record.blotter.fills[0].fee, cash(1.001));
    assert_eq!(record.ledger.equity().unwrap(), cash(100_000.0 + 10_200.0 - 10_010.0 - 1.001));
    let costs = Costs::of(&record);
    assert!((costs.spread_and_impact - 10.0).abs() < 1e-9 && (costs.decided_value - 10_000.0).abs() < 1e-9);
    assert!((costs.mechanisms["half_spread"] - 10.0).abs() < 1e-9, "{costs:?}");
    let trips = RoundTrip::of(&record).unwrap();
    assert_eq!((trips[0].gross, trips[0].entry_price, trips[0].entry_value), (cash(190.0), 100.1, cash(10_010.0)));
    let metrics = Metrics::of(&record).unwrap();
    let mean = equity(&record).iter().sum::<f64>() / record.equity.len() as f64;
    assert!((metrics.turnover.unwrap() - 10_010.0 / mean).abs() < 1e-12);
    // Ten times the equity are 200 contracts of 5,000.
    let plan = event(0).submit(buy(0, 201.0)).submit(buy(0, 200.0)).submit(buy(0, 1.0));
    let most = run(vec![history()], &[], of(&[fifty()]), plan);
    assert_eq!(most.blotter.rejected[&Reason::Leverage], 2);
    assert_eq!(fills(&most), [(MINUTE, 200.0, 100.0)]);
    // By contract, not by what is in it; and a maker pays for a mechanism on its whole value.
    let each = run(vec![history()], &[("commission", "per_share", 2.25)], of(&[fifty()]), event(0).submit(buy(0, 2.0)));
    assert_eq!(each.blotter.fills[0].fee, cash(4.5));
    let sizes = market_of_lots(fifty());
    assert_eq!(sizes, [20.0, 20.0, 19.0]);
}

/// How many lots a strategy finds 100,000 to be worth at 100, 100 and 102.
fn market_of_lots(terms: Terms) -> Vec<f64> {
    struct Sizes(Vec<f64>);
    impl Strategy for Sizes {
        fn name(&self) -> &str {
            "sizes"
        }
        fn lookback(&self) -> usize {
            1
        }
        fn on_event(&mut self, view: &View<'_>, _: &mut Orders) {
            self.0.push(view.lots_worth(0, view.equity().to_f64()).to_f64());
            assert_eq!((view.terms(0).multiplier.get(), view.balances().len()), (50, 1));
        }
    }
    let history = bars(&[(100.0, 100.0), (100.0, 100.0), (102.0, 102.0)]);
    let instrument = crate::market_scene::instrument("A");
    let mut sizes = Sizes(Vec::new());
    Backtest::new(vec![instrument], vec![history], venue(&[]), with(of(&[terms]))).unwrap().run(&mut sizes).unwrap();
    sizes.0
}

fn in_euros(rate: Rate) -> Account {
    let terms = Terms { currency: 1, ..Terms::default() };
    let currencies = vec!["USD".into(), "EUR".into()];
    Account { currencies, terms: vec![terms], rates: vec![rate], ..Account::default() }
}

/// Ten at 20.00 EUR, which close at 21 and 22: a gain of 10 and 20 EUR.
#[test]
fn a_foreign_share_is_a_debt_in_its_currency_and_worth_its_rate() {
    let history = || vec![bars(&[(20.0, 20.0), (20.0, 21.0), (22.0, 22.0)])];
    let plan = || event(0).submit(buy(0, 10.0));
    let parts = [("commission", "per_share", 0.1)];
    let always = run(history(), &parts, in_euros(Rate::Constant(at(1.5))), plan());
    assert_eq!(equity(&always), [100_000.0, 100_000.0 + 1.5 * 9.0, 100_000.0 + 1.5 * 19.0]);
    let balances = always.ledger.balances();
    assert_eq!((balances[0].cash, balances[1].cash, balances[1].holdings), (cash(1e5), cash(-201.0), cash(220.0)));
    let costs = Costs::of(&always);
    assert_eq!((nanos(costs.fees), nanos(costs.decided_value)), (1.5, 300.0));
    let trip = RoundTrip::of(&always).unwrap()[0];
    assert_eq!((trip.gross, trip.rate), (cash(20.0), 1.5));
    let metrics = Metrics::of(&always).unwrap();
    assert_eq!((nanos(metrics.unrealised), nanos(metrics.final_equity)), (30.0, 100_028.5));
    let of = CurrencySummary::of(&always, "USD").unwrap();
    let (owed, held) = (nanos(of[1].cash), nanos(of[1].holdings));
    assert_eq!((of[1].currency.as_str(), owed, held, of[1].rate), ("EUR", -201.0, 220.0, Some(1.5)));
    // From its instant on, and not a nanosecond before.
    let known = |from: i64| Rate::Known(vec![(Timestamp(0), at(1.5)), (Timestamp(from), at(2.0))]);
    let gains = |rate| equity(&run(history(), &[], in_euros(rate), plan()))[1..].to_vec();
    assert_eq!(gains(known(2 * MINUTE)), [100_020.0, 100_040.0]);
    assert_eq!(gains(known(2 * MINUTE + 1)), [100_015.0, 100_040.0]);
    assert_eq!(gains(known(3 * MINUTE + 1)), [100_015.0, 100_030.0]);
}

#[test]
fn the_price_of_an_instrument_is_a_rate_and_a_currency_without_one_is_an_error() {
    let rates = bars(&[(1.2, 1.2), (1.2, 1.3), (1.3, 1.25)]);
    let account = Account {
        currencies: vec!["USD".into(), "EUR".into()],
        terms: vec![Terms::default(), Terms { currency: 1, ..Terms::default() }],
        rates: vec![Rate::PriceOf(0)],
        ..Account::default()
    };
    let share = bars(&[(20.0, 20.0), (20.0, 21.0), (22.0, 22.0)]);
    // Both bars end together, and the rate is known first: the order is decided at the share's.
    let record = run(vec![rates, share], &[], account, event(1).submit(buy(1, 10.0)));
    assert_eq!(equity(&record)[2..], [100_000.0, 100_013.0, 100_012.5, 100_025.0]);
    let late = in_euros(Rate::Known(vec![(minute(9), at(1.5))]));
    let instrument = crate::market_scene::instrument("A");
    let history = bars(&[(20.0, 20.0), (20.0, 21.0), (22.0, 22.0)]);
    let error = Backtest::new(vec![instrument], vec![history], venue(&[]), with(late))
        .unwrap()
        .run(&mut event(0).submit(buy(0, 10.0)))
        .unwrap_err();
    assert_eq!(
        error.to_string(),
        "A at 1970-01-01T00:02:00Z: there is something in EUR, and no rate of it is known yet\nhint: give [[rate]] a row \
         that is no later than the first trade in EUR, or a constant `value`"
    );
}

#[test]
fn an_account_that_cannot_be_is_refused() {
    let said = |account: Account| {
        let history = bars(&[(20.0, 20.0), (20.0, 20.0)]);
        let made = Backtest::new(vec![crate::market_scene::instrument("A")], vec![history], venue(&[]), with(account));
        made.err().map(|error| error.to_string()).unwrap_or_default()
    };
    let known = |rows: &[(i64, f64)]| Rate::Known(rows.iter().map(|(t, price)| (Timestamp(*t), at(*price))).collect());
    for (account, words) in [
        (of(&[]), "there are terms for 0 of 1 instruments"),
        (Account { currencies: Vec::new(), ..of(&[fifty()]) }, "the account has no currency"),
        (Account { rates: vec![Rate::Constant(at(1.0))], ..of(&[fifty()]) }, "there are 1 rates for 0 foreign currencies"),
        (of(&[Terms { currency: 1, ..fifty() }]), "A: there is no currency 1"),
        (in_euros(Rate::Constant(at(0.0))), "the rate of EUR: currency 1 at a rate of 0"),
        (in_euros(known(&[(5, 1.0), (9, -1.0)])), "the rate of EUR: currency 1 at a rate of -1"),
        (in_euros(known(&[(5, 1.0), (5, 2.0)])), "the rate of EUR of 1970-01-01T00:00:00.000000005Z is not after"),
        (in_euros(Rate::PriceOf(0)), "the rate of EUR: there is no instrument 0"),
        (Account { actions: vec![split(1, 0, 1)], ..of(&[fifty()]) }, "a split of 0 new for 1 old"),
        (Account { actions: vec![dividend(1, 1.0, 101)], ..of(&[fifty()]) }, "a withholding of 1.01"),
        (
            Account { actions: vec![CorporateAction { instrument: 3, ..split(1, 2, 1) }], ..of(&[fifty()]) },
            "there is no instrument 3",
        ),
        (
            Account { actions: vec![CorporateAction { at: Timestamp(MINUTE + 1), ..split(0, 2, 1) }], ..of(&[fifty()]) },
            "lies within the bar from 1970-01-01T00:01:00Z",
        ),
    ] {
        let found = said(account);
        assert!(found.contains(words) && found.contains("\nhint: "), "{words}: {found}");
    }
}

/// Ten are held before the ex-instant, ten more are bought at the open of that instant.
#[test]
fn a_dividend_is_paid_to_who_held_before_the_ex_instant() {
    let history = || vec![bars(&[(20.0, 20.0), (20.0, 20.0), (19.5, 19.5), (19.5, 19.5)])];
    let account = || Account { actions: vec![dividend(2, 0.5, 15)], ..of(&[Terms::default()]) };
    let long = run(history(), &[], account(), event(0).submit(buy(0, 10.0)).at(1).submit(buy(0, 10.0)));
    assert_eq!(fills(&long), [(MINUTE, 10.0, 20.0), (2 * MINUTE, 10.0, 19.5)]);
    let booked = long.account.actions[0];
    assert_eq!((booked.before, booked.received, booked.fills), (quantity(10.0), cash(4.25), 1));
    // The bar that ends at the ex-instant is of the time before it.
    assert_eq!(equity(&long), [100_000.0, 100_000.0, 100_000.0 - 5.0 + 4.25, 99_999.25]);
    let short = run(history(), &[], account(), event(0).submit(sell(0, 10.0)));
    assert_eq!(short.account.actions[0].received, cash(-5.0), "the lender is owed all of it");
    assert_eq!(short.ledger.equity().unwrap(), cash(100_000.0));
    let metrics = Metrics::of(&long).unwrap();
    assert_eq!((metrics.dividends, metrics.withheld), (5.0, 0.75));
    assert_eq!(Counts::of(&long).corporate_actions, 1);
}

/// Hears of actions and of what becomes of its orders.
#[derive(Clone)]
struct Hearing(Plan, Vec<(Timestamp, CorporateAction, f64)>);

impl Strategy for Hearing {
    fn name(&self) -> &str {
        "hearing"
    }
    fn lookback(&self) -> usize {
        1
    }
    fn on_event(&mut self, view: &View<'_>, orders: &mut Orders) {
        self.0.on_event(view, orders);
    }
    fn on_notice(&mut self, view: &View<'_>, notice: &trueup::market::Notice, orders: &mut Orders) {
        self.0.on_notice(view, notice, orders);
    }
    fn on_action(&mut self, view: &View<'_>, action: &CorporateAction, _: &mut Orders) {
        self.1.push((view.now(), *action, view.position(0).to_f64()));
    }
}

/// Two for one: 10 at 10 are 20 at 5. What was decided on the last bar before is met at the first open after.
#[test]
fn a_split_changes_positions_orders_and_marks_and_no_equity() {
    let history = || vec![bars(&[(10.0, 10.0), (10.0, 10.0), (5.0, 5.0), (5.0, 4.4), (4.4, 6.0)])];
    let account = || Account { actions: vec![split(2, 2, 1)], ..of(&[Terms::default()]) };
    let plan = event(0)
        .submit(buy(0, 10.0))
        .submit(limit(Side::Buy, 7.0, 9.0))
        .submit(limit(Side::Buy, 7.0, 9.01))
        .at(1)
        .submit(buy(0, 3.0));
    let mut hearing = Hearing(plan, Vec::new());
    let instruments = vec![crate::market_scene::instrument("A")];
    let record = Backtest::new(instruments, history(), venue(&[]), with(account())).unwrap().run(&mut hearing).unwrap();
    assert_eq!(fills(&record), [(MINUTE, 10.0, 10.0), (2 * MINUTE, 6.0, 5.0), (4 * MINUTE, 14.0, 4.5)]);
    assert_eq!(hearing.1, [(minute(2), split(2, 2, 1), 20.0)]);
    let orders = &record.blotter.orders;
    assert_eq!((orders[1].quantity, orders[1].kind), (quantity(14.0), OrderKind::Limit { price: at(4.5) }));
    assert_eq!((orders[2].status, orders[2].reason), (Status::Cancelled, Some(Reason::Split)), "9.01 would be 4.505");
    assert_eq!((orders[3].quantity, orders[3].filled, orders[3].decision_price), (quantity(6.0), quantity(6.0), at(5.0)));
    // 26 at 5 close at 4.4; then 26 gain 1 and 14 gain 1.5 each.
    assert_eq!(equity(&record), [100_000.0, 100_000.0, 100_000.0, 99_984.4, 100_047.0]);
    // What it cost is told in the units of the fill, and nothing of it is the split.
    assert!(record.blotter.fills.iter().take(2).all(|fill| fill.cost.timing == 0.0));
    let trips = RoundTrip::of(&record).unwrap();
    assert_eq!((trips.len(), trips[0].quantity, trips[0].gross), (1, 40.0, cash(47.0)));
    assert!((trips[0].entry_price - (100.0 + 30.0 + 63.0) / 40.0).abs() < 1e-12);
}

/// The last bar before a split, which the strategy sees a second after it, is told in new units, as what is held.
#[test]
fn a_price_that_was_on_its_way_at_a_split_is_of_before() {
    let history = vec![bars(&[(10.0, 10.0), (10.0, 10.0), (10.0, 10.0), (10.0, 10.0), (5.0, 5.0)])];
    let latencies = Latencies { feed: Latency::Constant { seconds: 1.0 }, ..Latencies::default() };
    let account = Account { actions: vec![split(4, 2, 1)], ..of(&[Terms::default()]) };
    let settings = Settings { latencies, ..with(account) };
    let record = run_plan(history, &[], settings, &mut event(0).submit(buy(0, 10.0)));
    assert_eq!(fills(&record), [(2 * MINUTE, 10.0, 10.0)], "decided a second after the open of the second bar");
    assert_eq!((equity(&record), record.ledger.positions()[0].quantity), (vec![100_000.0; 5], quantity(20.0)));
}

/// Three for seven: 10 shares are 4.28, of which 4 are whole; 2 / 7 of a new share are paid for at the old mark.
#[test]
fn fractions_of_a_split_are_paid_out_and_leave_the_round_trip() {
    let history = vec![bars(&[(12.0, 12.0), (12.0, 12.0), (28.0, 28.0), (28.0, 30.0)])];
    let account = Account { actions: vec![split(2, 3, 7)], ..of(&[Terms::default()]) };
    for (order, sign) in [(buy(0, 10.0), 1.0), (sell(0, 10.0), -1.0)] {
        let record = run(
            history.clone(),
            &[],
            account.clone(),
            event(0).submit(order).at(2).submit(match order.side {
                Side::Buy => sell(0, 4.0),
                Side::Sell => buy(0, 4.0),
            }),
        );
        let booked = record.account.actions[0];
        assert_eq!((booked.after, booked.received), (quantity(sign * 4.0), cash(sign * 8.0)));
        assert!(record.ledger.is_flat());
        let gain = record.ledger.equity().unwrap().minus(cash(100_000.0)).unwrap();
        assert_eq!(gain, cash(sign * (4.0 * 28.0 + 8.0 - 120.0)));
        let trips = RoundTrip::of(&record).unwrap();
        assert_eq!((trips.len(), trips[0].net, trips[0].exited_at), (1, gain, Some(minute(3))));
    }
}

/// With quotes, word of a fill that is under way at the ex-instant is in by then; a dividend and a split of one instant happen
/// in their order.
#[test]
fn what_is_under_way_at_a_split_is_booked_in_the_units_of_before() {
    let rows = [(0, 9.9, 10.1), (10, 9.9, 10.1), (1_000, 4.9, 5.1), (2_000, 4.9, 5.1)];
    let actions = vec![
        CorporateAction { at: Timestamp(20), ..dividend(0, 1.0, 0) },
        CorporateAction { at: Timestamp(20), ..split(0, 2, 1) },
    ];
    let constant = |seconds| Latency::Constant { seconds };
    let response = constant(1e-6);
    let latencies = Latencies { response, ..Latencies::default() };
    let settings = Settings { latencies, ..with(Account { actions, ..of(&[Terms::default()]) }) };
    let mut plan = event(0).submit(buy(0, 10.0)).submit(limit(Side::Sell, 10.0, 12.0)).at(1).replace(2, Some(6.0), None);
    let record = run_plan(vec![quotes(&rows)], &[], settings, &mut plan);
    assert_eq!(fills(&record), [(0, 10.0, 10.1)]);
    let received: Vec<Cash> = record.account.actions.iter().map(|booked| booked.received).collect();
    assert_eq!(received, [cash(10.0), Cash::ZERO], "ten of before, not twenty of after");
    assert_eq!(record.ledger.positions()[0].quantity, quantity(20.0));
    assert_eq!(record.ledger.equity().unwrap(), cash(100_000.0 + 10.0 + 20.0 * 5.0 - 101.0));
    let (known, notice) = plan.notices[0];
    assert_eq!((known, matches!(notice.news, News::Filled { .. })), (Timestamp(20), true));
    // Six of before are twelve now.
    assert_eq!(record.blotter.orders[1].quantity, quantity(12.0));
    assert_eq!(record.blotter.orders[1].kind, OrderKind::Limit { price: at(6.0) });
}

#[test]
fn what_is_charged_is_told_by_kind() {
    let day = 1_440;
    let all = (0..4).map(|k| bar(k * day, 100.0, 100.0, 1e3)).collect();
    let history = History::new(all, Default::default()).unwrap();
    let parts = [("funding", "continuous", 1e-4), ("borrow_fee", "held", 0.036), ("commission", "bps", 1.0)];
    let account = of(&[fifty()]);
    let record = run(vec![history], &parts, account, event(0).submit(sell(0, 1.0)));
    let charges = record.ledger.income()[0].charges;
    // 5,000 short for two days and a minute: 1e-4 of it every 8 h is received, and 0.036 a year of 360 days is paid.
    let days = 2.0 + 1.0 / 1_440.0;
    assert!((charges.borrow.to_f64() - 5_000.0 * 0.036 * days / 360.0).abs() < 1e-8, "{charges:?}");
    assert!((charges.funding.to_f64() + 5_000.0 * 1e-4 * 3.0 * days).abs() < 1e-8, "{charges:?}");
    assert_eq!((charges.other, charges.interest), (Cash::ZERO, Cash::ZERO));
    let of = CurrencySummary::of(&record, "USD").unwrap();
    assert_eq!((of[0].charges.borrow, of[0].charges.funding), (charges.borrow.to_f64(), charges.funding.to_f64()));
}
