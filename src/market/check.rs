//! The contract of strategies as a function: no decision may depend on what came after it.

use rand::RngExt;

use crate::sim2real::{Assembly, Seed, Timestamp, Violation};

use super::audit::{Change, Trace, difference, known_times, trace, with_future};
use super::{
    Backtest, BacktestError, Bar, Cash, Execution, History, Instrument, Level, MECHANISMS, Price, Quotes, Settings, Strategy,
};

/// Runs the contract of [`Strategy`] on the strategies `make` gives, each fresh: on random bars and quotes of two
/// instruments it must decide the same twice; and when all that becomes known after some instant is changed, or cut off,
/// all it decided up to that instant must stay the same, to the last bit.
///
/// `make` is given the data the strategy will run on; one that keeps its contract has no use for them, and one that looks
/// them up is found out.
///
/// # Errors
/// The first line of the contract that is broken.
pub fn check_strategy<F>(make: F, seed: Seed) -> Result<(), Violation>
where
    F: Fn(&[History]) -> Box<dyn Strategy>,
{
    let histories = [random_history(seed, "one", true), random_history(seed, "two", false)].map(Result::ok);
    let histories: Vec<History> = histories.into_iter().flatten().collect();
    let subject = make(&histories).name().to_owned();
    let fail = |what: String| Violation { subject: subject.clone(), what };
    let backtest = random_backtest(histories).map_err(|error| fail(error.to_string()))?;
    check_strategy_on(&backtest, make, seed)
}

/// As [`check_strategy`], on a backtest given.
///
/// # Errors
/// The first line of the contract that is broken.
pub fn check_strategy_on<F>(backtest: &Backtest, make: F, seed: Seed) -> Result<(), Violation>
where
    F: Fn(&[History]) -> Box<dyn Strategy>,
{
    const CUTS: usize = 8;
    let subject = make(backtest.histories()).name().to_owned();
    let fail = |what: String| Violation { subject: subject.clone(), what };
    let run = |backtest: &Backtest| -> Result<Trace, Violation> {
        let trace = trace(&|backtest, strategy| backtest.run(strategy), backtest, make(backtest.histories()).as_mut());
        match &trace.record {
            Ok(_) => Ok(trace),
            Err(error) => Err(fail(format!("the backtest fails: {error}"))),
        }
    };
    let as_it_was = run(backtest)?;
    if run(backtest)?.decisions != as_it_was.decisions {
        return Err(fail("two runs on the same data decide differently".into()));
    }
    let times = known_times(backtest.histories());
    for cut in 1..=CUTS {
        let now = times[(times.len() - 1) * cut / (CUTS + 1)];
        for change in Change::ALL {
            let changed = with_future(backtest, now, change, seed).map_err(|error| fail(error.to_string()))?;
            if let Some(found) = difference(&as_it_was, &run(&changed)?, now, backtest.instruments()) {
                let (subject, at, how) = (found.subject.word(), found.time, change.words());
                return Err(fail(format!(
                    "its {subject} at {at} changes when what is known after {now} is {how}: it saw the future"
                )));
            }
        }
    }
    Ok(())
}

/// Bars of a random walk with nights between, and quotes or none.
fn random_history(seed: Seed, symbol: &str, quoted: bool) -> Result<History, super::HistoryError> {
    const MINUTE: i64 = 60 * Timestamp::NANOS;
    let mut rng = seed.child("data").stream(symbol);
    let mut bars = Vec::new();
    let mut quotes = Quotes::with_depth(2);
    let mut price = 100.0_f64;
    for day in 0..4_i64 {
        for minute in 0..120 {
            let open_at = Timestamp((day * 1440 + minute) * MINUTE);
            let open = Price((price * 100.0).round() as i64 * 10_000_000);
            price *= (0.01 * (rng.random::<f64>() - 0.5)).exp();
            let close = Price((price * 100.0).round() as i64 * 10_000_000);
            let (high, low) = (open.max(close), open.min(close));
            let volume = 1_000.0 * rng.random::<f64>();
            bars.push(Bar { open_at, known_at: open_at + MINUTE, open, high, low, close, volume });
            if quoted {
                let level =
                    |ticks: f64| Level { price: close.to_f64() + 0.01 * ticks, size: 1.0 + 100.0 * rng_size(minute) };
                quotes.push(open_at + MINUTE / 2, &[level(-1.0), level(-2.0)], &[level(1.0), level(3.0)]);
            }
        }
    }
    History::new(bars, quotes)
}

fn rng_size(minute: i64) -> f64 {
    (minute % 7) as f64
}

fn random_backtest(histories: Vec<History>) -> Result<Backtest, BacktestError> {
    let instrument = |symbol: &str| Instrument {
        symbol: symbol.to_owned(),
        tick_size: 0.01,
        lot_size: 1.0,
        average_daily_volume: None,
        daily_volatility: None,
    };
    let cash = Cash::nearest(1e6).unwrap_or_default();
    let venue = Assembly::new(Execution, MECHANISMS);
    let settings = Settings { max_leverage: 2.0, ..Settings::with_cash(cash) };
    Backtest::new(vec![instrument("ONE"), instrument("TWO")], histories, venue, settings)
}
