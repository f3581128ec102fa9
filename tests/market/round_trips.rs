//! Round trips of a backtest: by hand, against the account, and as a table.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails where a value is missing")]
#![cfg(feature = "io")]

use std::collections::BTreeMap;
use std::sync::LazyLock;

use proptest::prelude::*;
use trueup::io::{RunFile, Values};
use trueup::market::metric::{Metrics, RoundTrip};
use trueup::market::{Cash, Orders, PreparedRun, Quantity, Record, Side, Strategy, View, prepare_run};
use trueup::sim2real::Timestamp;

const RUN: &str = "
[run]
seed = 3
cash = 100_000
currency = 'USD'
max_leverage = 50.0
[[instrument]]
symbol = 'A'
tick_size = 0.01
[[instrument]]
symbol = 'B'
tick_size = 0.01
[[data]]
symbol = 'A'
bars = 'a.csv'
stamp = 'open'
[[data]]
symbol = 'B'
bars = 'b.csv'
stamp = 'open'
[strategy]
kind = 'plan'
[[mechanism]]
name = 'commission'
per_share = 0.07
";

/// What A opens at; B opens at the same prices in the reverse order. Bars close where they open, a minute each.
const OPENS: [f64; 10] = [10.0, 10.0, 12.0, 13.0, 11.0, 9.0, 9.5, 14.0, 12.5, 12.25];

static RUN_OF_TEN_MINUTES: LazyLock<PreparedRun> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    let bars = |opens: &mut dyn Iterator<Item = f64>| {
        let row = |(k, p): (usize, f64)| format!("{},{p},{p},{p},{p},1000\n", k as i64 * 60 * Timestamp::NANOS);
        format!("ts,open,high,low,close,volume\n{}", opens.enumerate().map(row).collect::<String>())
    };
    std::fs::write(folder.path().join("a.csv"), bars(&mut OPENS.into_iter())).unwrap();
    std::fs::write(folder.path().join("b.csv"), bars(&mut OPENS.into_iter().rev())).unwrap();
    std::fs::write(folder.path().join("run.toml"), RUN).unwrap();
    prepare_run(&RunFile::read(folder.path().join("run.toml")).unwrap()).unwrap()
});

/// Orders by the minute whose close decides them: instrument, side, quantity.
struct Plan(BTreeMap<i64, Vec<(usize, Side, f64)>>);

impl Strategy for Plan {
    fn name(&self) -> &str {
        "plan"
    }
    fn lookback(&self) -> usize {
        1
    }
    fn on_event(&mut self, view: &View<'_>, orders: &mut Orders) {
        let minute = view.now().0 / (60 * Timestamp::NANOS);
        for (instrument, side, quantity) in self.0.remove(&minute).into_iter().flatten() {
            orders.market(instrument, side, Quantity::nearest(quantity).unwrap());
        }
    }
}

/// An order in the plan of minute `k` fills at the open of the bar of that minute.
fn record(plan: &[(i64, usize, Side, f64)]) -> Record {
    let mut orders = BTreeMap::<i64, Vec<_>>::new();
    for (minute, instrument, side, quantity) in plan {
        orders.entry(*minute).or_default().push((*instrument, *side, *quantity));
    }
    RUN_OF_TEN_MINUTES.backtest.run(&mut Plan(orders)).unwrap()
}

fn cash(value: f64) -> Cash {
    Cash::nearest(value).unwrap()
}

/// 10 and 10 bought at 10 and 12, 25 sold at 13: 20 at 11 on average gain 40, and 5 stay short at 13. 2 of them are bought
/// back at 9 and 3 at 14: 65 - 18 - 42 = 5. Fees are 0.07 a share.
const PLAN: [(i64, usize, Side, f64); 6] = [
    (1, 0, Side::Buy, 10.0),
    (2, 0, Side::Buy, 10.0),
    (3, 0, Side::Sell, 25.0),
    (5, 0, Side::Buy, 2.0),
    (7, 0, Side::Buy, 3.0),
    (8, 0, Side::Sell, 4.0),
];

#[test]
fn trips_by_hand() {
    let record = record(&PLAN);
    let trips = RoundTrip::of(&record).unwrap();
    let minute = |k: i64| Timestamp(k * 60 * Timestamp::NANOS);
    let [long, short, open] = trips.as_slice() else { panic!("{trips:?}") };
    assert_eq!((long.side, long.entered_at, long.exited_at), (Side::Buy, minute(1), Some(minute(3))));
    assert_eq!((long.quantity, long.entry_price, long.exit_price), (20.0, 11.0, Some(13.0)));
    assert_eq!((long.gross, long.fees, long.seconds.round(), long.fills), (cash(40.0), cash(2.8), 120.0, 3));
    assert_eq!(long.net, cash(37.2));
    assert!((long.growth().unwrap() - 37.2 / 220.0).abs() < 1e-15);
    assert_eq!((short.word(), short.entered_at, short.exited_at), ("short", minute(3), Some(minute(7))));
    assert_eq!((short.quantity, short.entry_price, short.exit_price), (5.0, 13.0, Some(12.0)));
    assert_eq!((short.gross, short.fees, short.fills), (cash(5.0), cash(0.7), 3));
    // Still held at the end, at the last close of 12.25: 0.25 gained on each of 4.
    assert_eq!((open.word(), open.exited_at, open.exit_price), ("short", None, None));
    assert_eq!((open.gross, open.fees, open.seconds.round()), (cash(1.0), cash(0.28), 120.0));
}

/// Trips of 37.2 and 4.3, and in B one that loses: bought at 14 (its third open), sold at 9: 50 and 1.4 of fees.
#[test]
fn figures_of_trips_by_hand() {
    let mut plan = PLAN.to_vec();
    plan.extend([(2, 1, Side::Buy, 10.0), (4, 1, Side::Sell, 10.0)]);
    let record = record(&plan);
    let t = Metrics::of(&record).unwrap().trading;
    assert_eq!((t.closed, t.open, t.long, t.short), (3, 1, 2, 1));
    let close = |found: Option<f64>, expected: f64| assert!((found.unwrap() - expected).abs() < 1e-12, "{t:?}: {expected}");
    close(t.hit_rate, 2.0 / 3.0);
    close(t.profit_factor, 41.5 / 51.4);
    close(t.expectancy, (41.5 - 51.4) / 3.0);
    close(t.mean_return, (37.2 / 220.0 + 4.3 / 65.0 - 51.4 / 140.0) / 3.0);
    close(t.average_win, 41.5 / 2.0);
    close(t.average_loss, -51.4);
    close(t.largest_win, 37.2);
    close(t.largest_loss, -51.4);
    close(t.mean_seconds, (120.0 + 240.0 + 120.0) / 3.0);
}

#[test]
fn without_trips_nothing_is_defined() {
    let t = Metrics::of(&record(&[])).unwrap().trading;
    assert_eq!((t.closed, t.hit_rate, t.profit_factor, t.expectancy, t.largest_win), (0, None, None, None, None));
    let won = Metrics::of(&record(&[(1, 0, Side::Buy, 1.0), (2, 0, Side::Sell, 1.0)])).unwrap().trading;
    assert_eq!((won.hit_rate, won.profit_factor, won.average_loss), (Some(1.0), None, None));
}

#[test]
fn the_table_has_a_row_a_trip() {
    let outputs = RUN_OF_TEN_MINUTES.outputs(&record(&PLAN)).unwrap();
    let column = |name: &str| outputs.trades.columns().iter().find(|(n, _)| n == name).unwrap().1.clone();
    assert_eq!(column("trade_id"), Values::Integers(vec![Some(1), Some(2), Some(3)]));
    let Values::Floats(net) = column("net") else { panic!("{:?}", column("net")) };
    for (found, expected) in net.into_iter().zip([37.2, 4.3, 0.72]) {
        assert!((found.unwrap() - expected).abs() < 1e-12, "{found:?} is not {expected}");
    }
    assert_eq!(column("exit_price"), Values::Floats(vec![Some(13.0), Some(12.0), None]));
    assert_eq!(outputs.page.trades.len(), 3);
    let json: serde_json::Value = serde_json::from_str(&outputs.json().unwrap()).unwrap();
    assert_eq!((json["metrics"]["trading"]["closed"].as_u64(), json["zone"].as_str()), (Some(2), Some("UTC")));
    for null in ["sortino", "calmar", "value_at_risk_95", "probabilistic_sharpe", "turnover_per_year"] {
        assert!(json["metrics"].get(null).unwrap().is_null(), "{null} of ten minutes");
    }
}

proptest! {
    /// Whatever is traded, trips gain what the account gained and pay what it paid, to the last unit, and of each
    /// instrument one at most is under way.
    #[test]
    fn trips_add_up_to_the_account(
        plan in proptest::collection::vec((1..9_i64, 0..2_usize, any::<bool>(), 1..300_i32), 0..60),
    ) {
        let side = |buy| if buy { Side::Buy } else { Side::Sell };
        let plan: Vec<_> = plan.into_iter().map(|(m, k, buy, lots)| (m, k, side(buy), f64::from(lots))).collect();
        let record = record(&plan);
        let trips = RoundTrip::of(&record).unwrap();
        let net: i128 = trips.iter().map(|trip| trip.net.0).sum();
        prop_assert_eq!(net, record.ledger.equity().unwrap().0 - record.ledger.opening().0);
        for (k, position) in record.ledger.positions().iter().enumerate() {
            let own: Vec<&RoundTrip> = trips.iter().filter(|trip| trip.instrument == k).collect();
            prop_assert_eq!(own.iter().map(|trip| trip.fees.0).sum::<i128>(), position.fees.0);
            let open = own.iter().filter(|trip| trip.exited_at.is_none()).count();
            prop_assert_eq!(open, usize::from(position.quantity.0 != 0));
            prop_assert!(own.windows(2).all(|pair| pair[0].exited_at.is_some_and(|at| at <= pair[1].entered_at)));
        }
    }
}
