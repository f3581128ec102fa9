//! Hours of trading on any data and with any calendar; and as a run declares them.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use std::sync::Arc;

use crate::market_scene::{MINUTE, instrument, quantity, settings, venue};
use crate::ways_scene::same_every_way;
use proptest::prelude::*;
use proptest::strategy::Strategy as _;
use trueup::market::{
    Arrival, AuditSettings, AuditVerdict, Backtest, BacktestError, Bar, Calendar, DepthAction, DepthChange, Feed, Fill,
    History, Level, OrderKind, Orders, Price, Print, Quotes, Record, Settings, Side, Strategy, Ticket, TimeInForce, View,
    audit,
};
use trueup::sim2real::{Seed, Timestamp};

/// Monday, 2024-07-01T00:00:00Z.
const MONDAY: i64 = 1_719_792_000 * Timestamp::NANOS;

fn price(cents: i64) -> Price {
    Price(cents * 10_000_000)
}

/// Asks for an order of any kind at most events, by a generator of its own.
#[derive(Clone)]
struct Busy(u64);

impl Busy {
    fn draw(&mut self, of: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % of
    }
}

impl Strategy for Busy {
    fn name(&self) -> &str {
        "busy"
    }
    fn lookback(&self) -> usize {
        1
    }
    fn on_event(&mut self, view: &View<'_>, orders: &mut Orders) {
        let side = [Side::Buy, Side::Sell][self.draw(2) as usize];
        let (kind, time) = (self.draw(8), self.draw(5));
        let off = Price(self.draw(200) as i64 * 10_000_000 - 1_000_000_000);
        let Some(mark) = view.price(0) else { return };
        let near = view.restable(0, side, mark.plus(off).to_f64()).unwrap_or(price(10_000));
        let kind = match kind {
            0 => OrderKind::Market,
            1 => OrderKind::Stop { trigger: near },
            2 => OrderKind::MarketOnOpen,
            3 => OrderKind::MarketOnClose,
            4 => OrderKind::LimitOnOpen { price: near },
            5 => OrderKind::LimitOnClose { price: near },
            6 => OrderKind::TrailingStop { distance: price(50) },
            _ => OrderKind::Limit { price: near },
        };
        let time = match time {
            0 => TimeInForce::ImmediateOrCancel,
            1 => TimeInForce::FillOrKill,
            2 | 3 => TimeInForce::Day,
            _ => TimeInForce::GoodTillCancelled,
        };
        if view.session(0).is_some() || kind != OrderKind::Market {
            orders.submit(Ticket::new(0, side, quantity(1.0), kind).working(time));
        }
    }
}

/// Sessions of some days of the week, once or twice a day or over night, a holiday and a half day.
fn calendars() -> impl proptest::strategy::Strategy<Value = Arc<Calendar>> {
    let zone = prop::sample::select(vec!["UTC", "America/New_York", "Asia/Tokyo"]);
    let hours = prop_oneof![
        3 => (0..16_u32, 1..8_u32).prop_map(|(open, length)| vec![(open, open + length)]),
        2 => (0..10_u32, 1..4_u32, 1..4_u32, 1..4_u32)
            .prop_map(|(open, one, between, two)| vec![(open, open + one), (open + one + between, open + one + between + two)]),
        1 => (17..24_u32, 1..17_u32).prop_map(|night| vec![night]),
        1 => Just(vec![(0, 24)]),
    ];
    let days = prop::sample::subsequence(vec!["mon", "tue", "wed", "thu", "fri"], 1..=5);
    (zone, hours, days, 1..6_u32, 2..22_u32).prop_map(|(zone, hours, days, holiday, half)| {
        let days = days.iter().map(|day| format!("'{day}'")).collect::<Vec<_>>().join(", ");
        let sessions = hours
            .iter()
            .map(|(open, close)| format!("[[session]]\ndays = [{days}]\nopen = '{open:02}:00'\nclose = '{close:02}:00'\n"));
        let text = format!(
            "name = 'x'\nsource = 'a test'\nzone = '{zone}'\n{}[[holiday]]\nname = 'h'\ndates = [2024-07-0{holiday}]\n\
             [[half_day]]\nname = 'e'\ndates = [2024-07-03]\nclose = '{half:02}:00'\n",
            sessions.collect::<String>()
        );
        Arc::new(Calendar::parse(&text).unwrap())
    })
}

/// Steps of time [min] and prices [cents] of some days.
fn walks() -> impl proptest::strategy::Strategy<Value = Vec<(i64, i64)>> {
    let steps = proptest::collection::vec((1..150_i64, -40..40_i64), 20..120);
    steps.prop_map(|steps| {
        let (mut minute, mut price) = (0, 10_000);
        let step = |(time, move_): (i64, i64)| {
            (minute, price) = (minute + time, (price + move_).max(5_000));
            (minute, price)
        };
        steps.into_iter().map(step).collect()
    })
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Data {
    Bars,
    Quotes,
    QuotesAndTrades,
    Trades,
    Book,
}

fn history(data: Data, walk: &[(i64, i64)]) -> History {
    let time = |minute: i64| Timestamp(MONDAY + minute * MINUTE);
    let bars = || {
        let one = |pair: &[(i64, i64)]| {
            let (open, close) = (price(pair[0].1), price(pair[1].1));
            let (high, low) = (open.max(close).plus(price(9)), open.min(close).minus(price(9)));
            Bar { open_at: time(pair[0].0), known_at: time(pair[1].0), open, high, low, close, volume: 1e3 }
        };
        walk.windows(2).map(one).collect::<Vec<_>>()
    };
    let quotes = || {
        let mut quotes = Quotes::with_depth(1);
        for (minute, cents) in walk {
            let side = |cents: i64| [Level { price: cents as f64 / 100.0, size: 100.0 }];
            quotes.push(time(*minute), &side(cents - 2), &side(cents + 2));
        }
        quotes
    };
    let prints = || {
        let print = |(minute, cents): &(i64, i64)| Print {
            time: time(*minute) + 7,
            price: *cents as f64 / 100.0,
            size: 30.0,
            aggressor: None,
        };
        walk.iter().step_by(2).map(print).collect::<Vec<_>>()
    };
    let depth = || {
        let level = |minute: i64, side: Side, cents: i64, size: f64| DepthChange {
            time: time(minute),
            known_at: time(minute),
            action: DepthAction::Set,
            side,
            price: price(cents),
            size,
        };
        let mut before: Option<i64> = None;
        let mut all = Vec::new();
        for (minute, cents) in walk {
            if let Some(old) = before.replace(*cents) {
                all.extend([level(*minute, Side::Buy, old - 2, 0.0), level(*minute, Side::Sell, old + 2, 0.0)]);
            }
            all.extend([level(*minute, Side::Buy, cents - 2, 100.0), level(*minute, Side::Sell, cents + 2, 100.0)]);
        }
        all
    };
    match data {
        Data::Bars => History::new(bars(), Quotes::default()),
        Data::Quotes => History::new(Vec::new(), quotes()),
        Data::QuotesAndTrades => History::new(Vec::new(), quotes()).and_then(|history| history.with_prints(prints())),
        Data::Trades => History::default().with_prints(prints()),
        Data::Book => History::default().with_depth(depth()),
    }
    .unwrap()
}

fn backtest(data: Data, walk: &[(i64, i64)], calendar: &Arc<Calendar>) -> Backtest {
    let settings = Settings { calendars: vec![Some(Arc::clone(calendar))], max_leverage: 1e3, ..settings() };
    Backtest::new(vec![instrument("A")], vec![history(data, walk)], venue(&[]), settings).unwrap()
}

/// Whether a fill was at a time at which its order may be filled.
fn allowed(fill: &Fill, record: &Record, calendar: &Calendar, data: Data) -> bool {
    let at = fill.filled_at;
    let order = record.blotter.order(fill.order_id).unwrap();
    let for_close = matches!(order.kind, OrderKind::MarketOnClose | OrderKind::LimitOnClose { .. });
    let closes = calendar.previous_close(at) == Some(at);
    let session = calendar.session_at(order.arrives_at).or_else(|| calendar.next_session(order.arrives_at)).unwrap();
    let day = calendar.day(session.date).unwrap();
    let in_hours = if for_close { closes } else { calendar.is_open(at) || (closes && data == Data::Bars) };
    in_hours && (order.time_in_force != TimeInForce::Day || at <= day.close)
}

proptest! {
    #[test]
    fn nothing_is_filled_while_the_market_is_closed(
        walk in walks(),
        calendar in calendars(),
        data in prop::sample::select(vec![Data::Bars, Data::Quotes, Data::QuotesAndTrades, Data::Trades, Data::Book]),
        seed in any::<u64>(),
    ) {
        let backtest = backtest(data, &walk, &calendar);
        let record = backtest.run(&mut Busy(seed)).unwrap();
        for fill in &record.blotter.fills {
            let order = record.blotter.order(fill.order_id).unwrap();
            prop_assert!(allowed(fill, &record, &calendar, data), "{data:?} {fill:?} of {order:?}");
            prop_assert!(fill.filled_at >= order.arrives_at, "{fill:?} of {order:?}");
            prop_assert!(order.kind.limit().is_none_or(|limit| fill.side.accepts(fill.price, limit)), "{fill:?} of {order:?}");
        }
        if data != Data::Bars {
            let rows = |arrival: &Arrival| if calendar.is_open(arrival.event.time) { 0 } else { arrival.end - arrival.row };
            let outside: usize = Feed::new(backtest.histories()).map(|arrival| rows(&arrival)).sum();
            prop_assert_eq!(&record.outside, &vec![Some(outside)]);
        }
        prop_assert_eq!(&record, &backtest.run(&mut Busy(seed)).unwrap());
        same_every_way(&backtest, &record, &Busy(seed), 1 + seed as usize % 7);
    }

    /// What comes after an instant changes nothing before it: no auction is filled from later prices.
    #[test]
    fn no_decision_and_no_fill_knows_the_future(
        walk in walks(),
        calendar in calendars(),
        data in prop::sample::select(vec![Data::Bars, Data::Quotes, Data::QuotesAndTrades]),
        seed in any::<u64>(),
    ) {
        let backtest = backtest(data, &walk, &calendar);
        let make = |_: &[History]| Ok::<Box<dyn Strategy>, BacktestError>(Box::new(Busy(seed)));
        let audit = audit(&backtest, make, AuditSettings { cuts: 6, seed: Seed(seed) }, &|_, _| {}).unwrap();
        prop_assert_eq!(audit.verdict, AuditVerdict::Clean, "{}", audit.summary);
    }

    /// A market that never closes, with bars that keep to its days, is as one without a calendar.
    #[test]
    fn a_market_that_never_closes_trades_as_one_without_hours(walk in walks(), seed in any::<u64>()) {
        let always = Arc::new(Calendar::built_in("always").unwrap());
        let mut with_hours = backtest(Data::Quotes, &walk, &always).run(&mut Plain(Busy(seed))).unwrap();
        let settings = Settings { max_leverage: 1e3, ..settings() };
        let plain = Backtest::new(vec![instrument("A")], vec![history(Data::Quotes, &walk)], venue(&[]), settings).unwrap();
        prop_assert_eq!(with_hours.outside, vec![Some(0)]);
        with_hours.outside = Vec::new();
        prop_assert_eq!(with_hours, plain.run(&mut Plain(Busy(seed))).unwrap());
    }
}

/// The same without orders for the open and the close, and without a look at the hours.
struct Plain(Busy);

impl Strategy for Plain {
    fn name(&self) -> &str {
        "plain"
    }
    fn lookback(&self) -> usize {
        1
    }
    fn on_event(&mut self, view: &View<'_>, orders: &mut Orders) {
        let Some(mark) = view.price(0) else { return };
        let side = [Side::Buy, Side::Sell][self.0.draw(2) as usize];
        let off = Price(self.0.draw(20) as i64 * 10_000_000 - 100_000_000);
        let near = view.restable(0, side, mark.plus(off).to_f64()).unwrap_or(mark);
        let kind = if self.0.draw(2) == 0 { OrderKind::Market } else { OrderKind::Limit { price: near } };
        let time = [TimeInForce::Day, TimeInForce::GoodTillCancelled][self.0.draw(2) as usize];
        orders.submit(Ticket::new(0, side, quantity(1.0), kind).working(time));
    }
}

#[cfg(feature = "cli")]
mod command {
    use std::fs;
    use std::path::Path;

    use assert_cmd::Command;
    use tempfile::TempDir;

    const OWN: &str = "name = 'mornings'\nsource = 'a test'\nzone = 'America/New_York'\nholds_from = 2030-01-01\n\
                       [[session]]\ndays = ['mon', 'tue', 'wed', 'thu', 'fri']\nopen = '09:30'\nclose = '12:00'\n";

    /// The run of data/bars with a calendar, in a folder that has one of its own.
    fn ran(calendar: &str, own: &str, arguments: &str) -> (i32, String, String) {
        let folder = TempDir::new().unwrap();
        let set = Path::new(env!("CARGO_MANIFEST_DIR")).join("data").join("bars");
        fs::copy(set.join("bars.parquet"), folder.path().join("bars.parquet")).unwrap();
        let text = fs::read_to_string(set.join("run.toml")).unwrap();
        let text = text.replacen("lot_size = 1\n", &format!("lot_size = 1\n{calendar}\n"), 1);
        fs::write(folder.path().join("run.toml"), text).unwrap();
        fs::write(folder.path().join("own.toml"), own).unwrap();
        let output = Command::new(assert_cmd::cargo::cargo_bin!("trueup"))
            .current_dir(folder.path())
            .args(arguments.split_whitespace())
            .env_remove("RUST_BACKTRACE")
            .output()
            .unwrap();
        let page = fs::read_to_string(folder.path().join("out").join("report.html")).unwrap_or_default();
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
        (output.status.code().unwrap(), text(output.stdout) + &page, text(output.stderr))
    }

    fn summary(calendar: &str) -> serde_json::Value {
        let (code, out, err) = ran(calendar, OWN, "backtest run.toml --json");
        assert_eq!((code, err.as_str()), (0, ""));
        serde_json::from_str(&out).unwrap()
    }

    #[test]
    fn a_run_keeps_the_hours_of_its_calendar_and_says_so() {
        let (plain, nyse, own) = (summary(""), summary("calendar = 'nyse'"), summary("calendar = './own.toml'"));
        assert!(plain.get("calendars").is_none() && plain["instruments"][0].get("rows_outside_sessions").is_none());
        assert_eq!((nyse["calendars"]["XYZ"].as_str(), own["calendars"]["XYZ"].as_str()), (Some("nyse"), Some("mornings")));
        assert_eq!(nyse["instruments"][0]["rows_outside_sessions"], 0);
        assert_eq!(nyse["inputs"].as_array().map(Vec::len), Some(2), "what comes with the program is no input");
        // Twenty sessions of 390 bars, of which 150 are before noon.
        assert_eq!(own["instruments"][0]["rows_outside_sessions"], 20 * 240);
        assert_eq!((own["inputs"][1]["path"].as_str(), own["inputs"][1]["rows"].as_u64()), (Some("./own.toml"), None));
        assert_eq!(own["inputs"][1]["sha256"].as_str().map(str::len), Some(64));
        let (code, page, _) = ran("calendar = './own.toml'", OWN, "backtest run.toml --out out");
        assert_eq!(code, 0);
        assert!(page.contains("hours of XYZ") && page.contains("4800 rows are from outside its sessions"));
        assert!(page.contains("its rules hold from 2030-01-01"));
        let (code, out, _) = ran("calendar = 'nyse'", OWN, "audit run.toml --cuts 6");
        assert_eq!((code, out.contains("No lookahead was found")), (0, true), "{out}");
    }

    #[test]
    fn a_twin_has_no_calendar() {
        let text = "[twin]\nmodel = 'execution'\n[[instrument]]\nsymbol = 'A'\ntick_size = 0.01\ncalendar = 'nyse'\n";
        let error = trueup::io::TwinFile::parse(trueup::io::Document::from_text("twin.toml", text)).unwrap_err().to_string();
        insta::assert_snapshot!(error, @r"
        twin.toml:6:1: a twin has no use for a calendar
          hint: leave it out: a recording says itself when orders were filled
        ");
    }

    #[test]
    fn a_calendar_that_is_none_is_refused_at_its_place() {
        let refused = |calendar: &str, own: &str| {
            let (code, out, err) = ran(calendar, own, "backtest run.toml");
            assert_eq!((code, out.as_str()), (2, ""));
            err
        };
        insta::assert_snapshot!(refused("calendar = 'nise'", OWN), @r"
        error: run.toml:11:1: there is no calendar `nise`
          hint: did you mean `nyse`?
        ");
        insta::assert_snapshot!(refused("calendar = 'tokyo'", OWN), @r#"
        error: run.toml:11:1: there is no calendar `tokyo`
          hint: there are `nyse`, `cme_globex` and `always`; a file of your own is named by its path: "./my_exchange.toml"
        "#);
        insta::assert_snapshot!(refused("calendar = './none.toml'", OWN), @r"
        error: run.toml:11:1: names the file ./none.toml, but there is no such file
          hint: did you mean ./own.toml?
        ");
        insta::assert_snapshot!(refused("calendar = 'own.toml'", &OWN.replace("12:00", "25:00")), @r#"
        error: own.toml:8:9: expected a local time, found "25:00"
          hint: write "09:30", from "00:00" to "24:00"
        "#);
        insta::assert_snapshot!(refused("calendar = 5", OWN), @r"
        error: run.toml:11:12: expected a text in quotes, found integer `5`
          hint: write texts in quotes
        ");
    }
}
