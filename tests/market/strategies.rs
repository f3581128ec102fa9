//! The strategies that come with the crate: what they decide on series computed by hand, and what they never do.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]
use std::cell::RefCell;

use proptest::prelude::*;
use trueup::market::{
    Backtest, Bar, Cash, Execution, History, Instrument, MECHANISMS, Price, Quotes, Record, Settings, check_strategy,
};
use trueup::sim2real::{Assembly, Seed, Timestamp, Typical};
use trueup::strategies;

const MINUTE: i64 = 60 * Timestamp::NANOS;

/// A bar of minute `k`.
fn bar(k: i64, open: f64, close: f64, volume: f64) -> Bar {
    let [open, close] = [open, close].map(|p| Price::nearest(p).unwrap());
    let (open_at, known_at) = (Timestamp(k * MINUTE), Timestamp((k + 1) * MINUTE));
    Bar { open_at, known_at, open, high: open.max(close), low: open.min(close), close, volume }
}

fn history(bars: Vec<Bar>) -> History {
    History::new(bars, Quotes::default()).unwrap()
}

/// Bars a minute that open where the one before closed.
fn closes(closes: &[f64]) -> History {
    let before = |k: usize| closes[k.saturating_sub(1)];
    history(closes.iter().enumerate().map(|(k, close)| bar(k as i64, before(k), *close, 1_000.0)).collect())
}

fn volumes(volumes: &[f64]) -> History {
    history(volumes.iter().enumerate().map(|(k, volume)| bar(k as i64, 100.0, 100.0, *volume)).collect())
}

fn instrument(symbol: &str, lot_size: f64) -> Instrument {
    Instrument { symbol: symbol.into(), tick_size: 0.01, lot_size, average_daily_volume: None, daily_volatility: None }
}

/// A venue that fills at most a part of a bar's volume, where one is given.
fn venue(cap: Option<f64>) -> Assembly<Execution> {
    let venue = Assembly::new(Execution, MECHANISMS);
    let Some(cap) = cap else { return venue };
    let mechanism = *MECHANISMS.iter().find(|m| m.about().name == "participation_cap").unwrap();
    let mut parameters = mechanism.forms(&Typical::default())[0].parameters.clone();
    parameters[0].nominal = cap;
    venue.with_mechanism(mechanism, 0, parameters)
}

fn run_with(histories: Vec<History>, table: &str, lot: f64, cap: Option<f64>) -> Record {
    let instruments = ["A", "B", "C"][..histories.len()].iter().map(|s| instrument(s, lot)).collect();
    let settings = Settings { max_leverage: 10.0, ..Settings::with_cash(Cash::nearest(100_000.0).unwrap()) };
    let mut strategy = strategies::build(&toml::from_str(table).unwrap()).unwrap();
    Backtest::new(instruments, histories, venue(cap), settings).unwrap().run(strategy.as_mut()).unwrap()
}

fn run(histories: Vec<History>, table: &str) -> Record {
    run_with(histories, table, 1.0, None)
}

/// Minute of decision, instrument and quantity of all orders, negative for sells.
fn orders(record: &Record) -> Vec<(i64, usize, f64)> {
    let all = record.blotter.orders.iter();
    all.map(|o| (o.decided_at.0 / MINUTE, o.instrument, o.side.sign() * o.quantity.to_f64())).collect()
}

#[test]
fn mean_reversion_buys_far_below_and_sells_far_above() {
    let reversion =
        |short: bool| format!("kind = 'mean_reversion'\nwindow = 5\nentry = 1.9\nexit = 0\nweight = 0.9\nshort = {short}");
    // Windows end at scores of -2 (100, 100, 100, 100, 90), 0.11 (98), 2 (90, 98, 94, 94, 110 is 1.86), and so on.
    let series = [100.0, 100.0, 100.0, 100.0, 90.0, 98.0, 98.0, 98.0, 98.0, 98.0, 120.0, 99.0];
    let expected = [(5, 0, 1_000.0), (6, 0, -1_000.0), (11, 0, -750.0), (12, 0, 750.0)];
    // 0.9 of 100,000 at 90; filled at the next open, 90, and sold at 98: 108,000, of which 0.9 is 810 at 120.
    let found = orders(&run(vec![closes(&series)], &reversion(true)));
    assert_eq!(found[..2], expected[..2]);
    assert_eq!(found[2..], [(11, 0, -810.0), (12, 0, 810.0)]);
    assert_eq!(orders(&run(vec![closes(&series)], &reversion(false))), expected[..2]);
    // Beside an instrument that never moves it does the same with half the money.
    let both = vec![closes(&series), closes(&[50.0; 12])];
    assert_eq!(orders(&run(both, &reversion(false))), [(5, 0, 500.0), (6, 0, -500.0)]);
}

#[test]
fn momentum_follows_the_sign_of_the_return_with_the_size_of_its_risk() {
    let table = "kind = 'momentum'\nlookback = 2\nrebalance = 2\nvolatility = 0.05\nvolatility_bars = 1\nbars_per_year = 1";
    // Moves of 10 % a bar: a volatility of 0.1, and an exposure of half. 0.5 * 100,000 / 121 = 413.2; two bars later
    // 413 * (98.01 - 121) are lost, and 0.5 * 90,505.13 / 98.01 = 461.7 are wanted short.
    let series = [100.0, 110.0, 121.0, 108.9, 98.01, 98.01];
    assert_eq!(orders(&run(vec![closes(&series)], table)), [(3, 0, 413.0), (5, 0, -874.0)]);
    let flat = format!("{table}\nshort = false");
    assert_eq!(orders(&run(vec![closes(&series)], &flat)), [(3, 0, 413.0), (5, 0, -413.0)]);
}

const FIXED: &str = "kind = 'pairs'\nwindow = 4\nhedge_ratio = 1.0\nentry = 1.5\nweight = 0.9";

#[test]
fn pairs_sell_what_is_dear_and_buy_what_is_cheap() {
    // The last of three equal spreads and one above is the root of 3 off; then it is 0.58 below the mean.
    let (a, b) = (closes(&[100.0, 100.0, 100.0, 110.0, 100.0]), closes(&[50.0; 5]));
    // 45,000 each: 409 at 110 and 900 at 50.
    let expected = [(4, 0, -409.0), (4, 1, 900.0), (5, 0, 409.0), (5, 1, -900.0)];
    assert_eq!(orders(&run(vec![a.clone(), b.clone()], FIXED)), expected);
    let swapped = run(vec![b, a], &format!("{FIXED}\nsymbols = ['B', 'A']"));
    assert_eq!(orders(&swapped), expected.map(|(minute, leg, quantity)| (minute, 1 - leg, quantity)));
}

#[test]
fn pairs_pass_over_bars_that_have_no_counterpart() {
    let of = |prices: &[f64], kept: &[i64]| {
        let all = kept.iter().map(|k| bar(*k, prices[*k as usize], prices[*k as usize], 1_000.0));
        history(all.collect())
    };
    let (a, b) = ([100.0, 100.0, 500.0, 100.0, 110.0, 100.0, 100.0], [50.0; 7]);
    let together = run(vec![of(&a, &[0, 1, 2, 3, 4, 5, 6]), of(&b, &[0, 1, 3, 4, 5, 6])], FIXED);
    assert_eq!(orders(&together), [(5, 0, -409.0), (5, 1, 900.0), (6, 0, 409.0), (6, 1, -900.0)]);
}

/// Without a ratio the second leg is the slope of the regression of logarithms times the first, in money.
#[test]
fn pairs_hedge_by_the_slope_of_the_window() {
    let second = [50.0, 51.0, 49.0, 52.0, 48.0, 51.0, 50.0, 49.0];
    let off = [1.0, 0.999, 1.001, 1.0, 0.999, 1.001, 1.0, 1.03];
    let first: Vec<f64> = second.iter().zip(off).map(|(b, off)| (0.04 * b * b * off * 100.0_f64).round() / 100.0).collect();
    let table = "kind = 'pairs'\nwindow = 8\nentry = 2.0\nweight = 0.9";
    let found = orders(&run(vec![closes(&first), closes(&second)], table));
    let (x, y): (Vec<f64>, Vec<f64>) = second.iter().zip(&first).map(|(b, a)| (b.ln(), a.ln())).unzip();
    let mean = |of: &[f64]| of.iter().sum::<f64>() / 8.0;
    let covary = |p: &[f64], q: &[f64]| p.iter().zip(q).map(|(a, b)| (a - mean(p)) * (b - mean(q))).sum::<f64>();
    let slope = covary(&x, &y) / covary(&x, &x);
    let value = 90_000.0 / (1.0 + slope);
    let expected = [(8, 0, -(value / first[7]).floor()), (8, 1, (slope * value / second[7]).floor())];
    assert!(slope > 1.5 && slope < 2.5, "{slope}");
    assert_eq!(found, expected);
}

/// A parent order of `kind` from minute 10 to minute 20.
fn parent(kind: &str, quantity: f64, rest: &str) -> String {
    let (start, end) = ("1970-01-01T00:10:00Z", "1970-01-01T00:20:00Z");
    format!("kind = '{kind}'\nside = 'buy'\nquantity = {quantity}\nstart = {start}\nend = {end}\n{rest}")
}

#[test]
fn twap_sends_equal_parts_and_what_was_cut_later() {
    let bars = volumes(&[100.0; 40]);
    let table = parent("twap", 100.0, "interval = 120");
    let expected = [(10, 0, 20.0), (12, 0, 20.0), (14, 0, 20.0), (16, 0, 20.0), (18, 0, 20.0)];
    assert_eq!(orders(&run(vec![bars.clone()], &table)), expected);
    // A tenth of a bar's volume is all that is filled: what is missing comes with the next part, and after the end.
    let capped = orders(&run_with(vec![bars.clone()], &table, 1.0, Some(0.1)));
    let expected = [(10, 20.0), (12, 30.0), (14, 40.0), (16, 50.0), (18, 60.0), (20, 50.0), (22, 40.0), (24, 30.0)];
    assert_eq!(capped[..8].iter().map(|(minute, _, quantity)| (*minute, *quantity)).collect::<Vec<_>>(), expected);
    // One for each instrument, or for the one that is named.
    let both = || vec![bars.clone(), bars.clone()];
    assert_eq!(orders(&run(both(), &table)).len(), 10);
    let named = orders(&run(both(), &format!("{table}\nsymbol = 'B'")));
    assert_eq!((named.len(), named[0]), (5, (10, 1, 20.0)));
}

#[test]
fn vwap_sends_parts_after_the_profile() {
    let profile = "profile = [{ from = '00:00', to = '00:15', weight = 9 }, { from = '00:15', to = '00:20', weight = 1 }]";
    let table = parent("vwap", 80.0, &format!("interval = 150\n{profile}"));
    // 9/15 and 1/5 a minute: 3, 3/2 + ... = 1.5, 1.5, 0.5 and 0.5 of 4.
    let found = orders(&run(vec![volumes(&[100.0; 40])], &table));
    assert_eq!(found, [(10, 0, 30.0), (13, 0, 30.0), (15, 0, 10.0), (18, 0, 10.0)]);
}

/// Two days of 300 and 100 a minute, a third to trade on; and equal parts where no day has ended.
#[test]
fn vwap_learns_from_days_that_have_ended() {
    const DAY: i64 = 1_440;
    let day = |day: i64| (0..40).map(move |k| bar(DAY * day + k, 100.0, 100.0, if k < 15 { 300.0 } else { 100.0 }));
    let bars = history((0..3).flat_map(day).collect());
    let table = |day: u32| {
        let at = |minute: u32| format!("1970-01-{day:02}T00:{minute}:00Z");
        format!(
            "kind = 'vwap'\nside = 'sell'\nquantity = 80\nstart = {}\nend = {}\ninterval = 150\ndays = 1",
            at(10),
            at(20)
        )
    };
    let parts = |day: u32| orders(&run(vec![bars.clone()], &table(day))).iter().map(|o| o.2).collect::<Vec<_>>();
    assert_eq!(parts(3), [-30.0, -30.0, -10.0, -10.0]);
    assert_eq!(parts(1), [-20.0; 4]);
}

#[test]
fn pov_is_a_part_of_the_volume_and_catches_up_within_limits() {
    let mut traded = [100.0; 30];
    traded[11] = 0.0;
    let bars = volumes(&traded);
    let found = orders(&run(vec![bars.clone()], &parent("pov", 35.0, "rate = 0.1")));
    // The first bar that began after the start is known at minute 11; that of minute 11 had no volume.
    assert_eq!(found, [(11, 0, 10.0), (13, 0, 10.0), (14, 0, 10.0), (15, 0, 5.0)]);
    // Half of what is asked for is filled; behind, it asks for no more than 15 % of a bar.
    let slow = parent("pov", 1_000.0, "rate = 0.1\ncatch_up = 0.15\ncomplete = false");
    let capped = orders(&run_with(vec![volumes(&[100.0; 30])], &slow, 1.0, Some(0.05)));
    assert_eq!(capped.len(), 9);
    assert_eq!(capped.iter().map(|o| o.2).collect::<Vec<_>>()[..4], [10.0, 15.0, 15.0, 15.0]);
    // Left as it is at the end, or completed.
    assert!(orders(&run(vec![bars.clone()], &parent("pov", 1_000.0, "rate = 0.1"))).contains(&(20, 0, 920.0)));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// Whatever is filled of it, an execution strategy never holds more than its parent order, and has it at the end.
    #[test]
    fn a_parent_order_is_never_exceeded_and_always_completed(
        which in 0_usize..4,
        quantity in 1_u32..5_000,
        lot in 1_u32..50,
        interval in 20_u32..700,
        rate in 0.01..0.9_f64,
        cap in prop::option::of(0.05..1.0_f64),
        traded in prop::collection::vec(0.0..2_000.0_f64, 20),
        sell in any::<bool>(),
        gaps in prop::collection::vec(any::<bool>(), 20),
    ) {
        let rest = match which {
            0 => format!("interval = {interval}"),
            1 => format!("interval = {interval}\ndays = 3"),
            2 => format!("interval = {interval}\nprofile = [{{ from = '00:12', to = '00:17', weight = 2 }}]"),
            _ => format!("rate = {rate}"),
        };
        let kind = ["twap", "vwap", "vwap", "pov"][which];
        let mut table = parent(kind, f64::from(quantity), &rest);
        if sell {
            table = table.replace("'buy'", "'sell'");
        }
        // Bars may be missing up to the end; after it there are bars enough to fill what is left at the least rate.
        let during = (0..20_i64).filter(|k| gaps[*k as usize]).map(|k| bar(k, 100.0, 100.0, traded[k as usize]));
        let after = (20..200_i64).map(|k| bar(k, 100.0, 100.0, 50_000.0));
        let record = run_with(vec![history(during.chain(after).collect())], &table, f64::from(lot), cap);
        let whole = f64::from(quantity / lot * lot);
        let mut done = 0.0;
        for fill in &record.blotter.fills {
            done += fill.quantity.to_f64();
            prop_assert!(done <= whole);
        }
        prop_assert_eq!(done, whole);
        prop_assert!(record.blotter.rejections.is_empty());
        prop_assert!(orders(&record).iter().all(|(minute, ..)| *minute >= 10));
        // No order asks for more than is missing, whatever it fills.
        let mut filled = 0.0;
        for order in &record.blotter.orders {
            prop_assert!(filled + order.quantity.to_f64() <= whole);
            filled += order.filled.to_f64();
        }
    }
}

/// The check of the contract says something of those that trade in it: these do.
#[test]
fn every_kind_keeps_the_contract_where_it_trades() {
    let window = "side = 'buy'\nquantity = 500\nstart = 1970-01-03T00:10:00Z\nend = 1970-01-03T01:10:00Z";
    let profile = "profile = [{ from = '00:00', to = '02:00', weight = 1 }]";
    for table in [
        "kind = 'mean_reversion'\nwindow = 20\nentry = 1.5".to_owned(),
        "kind = 'momentum'\nlookback = 10\nrebalance = 3\nvolatility = 0.2\nvolatility_bars = 20\nbars_per_year = 98280"
            .to_owned(),
        "kind = 'pairs'\nwindow = 30\nentry = 1.5".to_owned(),
        "kind = 'pairs'\nwindow = 30\nhedge_ratio = 0.8\nentry = 1.5\nsymbols = ['TWO', 'ONE']".to_owned(),
        format!("kind = 'twap'\ninterval = 300\n{window}"),
        format!("kind = 'vwap'\ninterval = 300\n{window}"),
        format!("kind = 'vwap'\ninterval = 300\n{window}\n{profile}"),
        format!("kind = 'pov'\nrate = 0.1\n{window}"),
    ] {
        let parsed: toml::Table = toml::from_str(&table).unwrap();
        let seen = RefCell::new(Vec::new());
        let make = |histories: &[History]| {
            if seen.borrow().is_empty() {
                seen.replace(histories.to_vec());
            }
            strategies::build(&parsed).unwrap()
        };
        check_strategy(make, Seed(11)).unwrap();
        let instruments = vec![instrument("ONE", 1.0), instrument("TWO", 1.0)];
        let settings = Settings { max_leverage: 2.0, ..Settings::with_cash(Cash::nearest(1e6).unwrap()) };
        let backtest = Backtest::new(instruments, seen.into_inner(), venue(None), settings).unwrap();
        let record = backtest.run(strategies::build(&parsed).unwrap().as_mut()).unwrap();
        assert!(record.blotter.fills.len() >= 10, "{table}: {} fills", record.blotter.fills.len());
    }
}

#[test]
fn values_that_cannot_be_say_why() {
    let error = |table: &str| strategies::build(&toml::from_str(table).unwrap()).err().unwrap().to_string();
    let parent = |rest: &str| parent("twap", 10.0, rest);
    for (table, expected) in [
        ("kind = 'mean_reversion'\nwindow = 2\nentry = 1".to_owned(), "window is 2\nhint: it is a number of bars from 3"),
        ("kind = 'mean_reversion'\nwindow = 5\nentry = 2".to_owned(), "entry is 2\nhint: the last of n closes"),
        (
            "kind = 'momentum'\nlookback = 0\nrebalance = 1\nvolatility = 1\nvolatility_bars = 1\nbars_per_year = 1"
                .to_owned(),
            "lookback is 0\nhint: ",
        ),
        (
            "kind = 'momentum'\nlookback = 1\nrebalance = 1\nvolatility = 0\nvolatility_bars = 1\nbars_per_year = 1"
                .to_owned(),
            "volatility is 0\nhint: ",
        ),
        (format!("{FIXED}\nsymbols = ['A', 'A']"), "symbols is A twice\nhint: a pair is of two instruments"),
        (format!("{FIXED}\nstop = 1"), "stop is 1\nhint: "),
        (parent("interval = 0"), "interval is 0\nhint: it is a number of seconds above 0"),
        (parent("interval = 60").replace("buy", "hold"), "side is \"hold\"\nhint: write \"buy\" or \"sell\""),
        (parent("interval = 60").replace("= 10", "= -1"), "quantity is -1\nhint: "),
        (
            parent("interval = 60").replace("00:20:00Z", "00:10:00Z"),
            "end is 1970-01-01T00:10:00Z\nhint: it must be after `start`",
        ),
        (parent("interval = 60").replace("00:20:00Z", "00:20:00"), "is no instant: write one with its zone"),
        (parent("interval = 60\nzone = 'Mars'").replace("twap", "vwap"), "zone is \"Mars\"\nhint: "),
        (
            parent("interval = 60").replace("twap", "vwap").replace("1970-01-01T00:20", "1970-01-02T00:20"),
            "end is 1970-01-02T00:20:00Z\nhint: it must be on the day",
        ),
        (
            parent("interval = 60\nprofile = [{ from = '01:00', to = '02:00', weight = 1 }]").replace("twap", "vwap"),
            "profile is empty there\nhint: ",
        ),
        (
            parent("interval = 60\nprofile = [{ from = '01:00', to = '00:00', weight = 1 }]").replace("twap", "vwap"),
            "profile is 01:00 to 00:00\nhint: ",
        ),
        (
            parent("interval = 60\nprofile = [{ from = '1 am', to = '02:00', weight = 1 }]").replace("twap", "vwap"),
            "profile is \"1 am\"\nhint: ",
        ),
        (parent("rate = 0").replace("twap", "pov"), "rate is 0\nhint: "),
        (parent("rate = 0.5\ncatch_up = 0.4").replace("twap", "pov"), "catch_up is 0.4\nhint: "),
    ] {
        let found = error(&table);
        assert!(found.contains(expected), "{table}: {found}");
    }
}

#[test]
fn a_run_has_the_instruments_its_strategy_names() {
    let check = |table: &str, symbols: &[&str]| {
        let instruments: Vec<Instrument> = symbols.iter().map(|symbol| instrument(symbol, 1.0)).collect();
        strategies::check_instruments(&toml::from_str(table).unwrap(), &instruments).map_err(|error| error.to_string())
    };
    assert_eq!(check("kind = 'pairs'\nsymbols = ['A', 'B']", &["B", "A"]), Ok(()));
    let unknown = "[strategy] twap: symbol names `C`, which the run does not have\nhint: it has A, B";
    assert_eq!(check("kind = 'twap'\nsymbol = 'C'", &["A", "B"]), Err(unknown.to_owned()));
    let few = "[strategy] pairs needs 2 instruments, and the run has 1\nhint: add an [[instrument]] and its [[data]]";
    assert_eq!(check("kind = 'pairs'", &["A"]), Err(few.to_owned()));
}
