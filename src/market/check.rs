//! The contract of strategies as a function: no decision may depend on what came after it.

use rand::RngExt;

use crate::sim2real::{Assembly, Seed, Timestamp, Violation};

use super::{
    Backtest, BacktestError, Bar, Cash, Execution, History, Instrument, Level, MECHANISMS, Price, Quotes, Request, Settings,
    Strategy,
};

/// What a strategy asked for, and when.
type Decision = (Timestamp, Request);

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
    let decide = |backtest: &Backtest| {
        decisions(backtest, make(backtest.histories()).as_mut())
            .map_err(|error| fail(format!("the backtest fails: {error}")))
    };
    let as_it_was = decide(backtest)?;
    if decide(backtest)? != as_it_was {
        return Err(fail("two runs on the same data decide differently".into()));
    }
    let times = known_times(backtest.histories());
    for cut in 1..=CUTS {
        let now = times[(times.len() - 1) * cut / (CUTS + 1)];
        let before = |all: &[Decision]| -> Vec<Decision> { all.iter().take_while(|d| d.0 <= now).copied().collect() };
        let expected = before(&as_it_was);
        for (what, changed) in [
            ("changed", futures(backtest, |h, k| change(h, now, seed, k))),
            ("cut off", futures(backtest, |h, _| cut_off(h, now))),
        ] {
            let changed = changed.map_err(|error| fail(error.to_string()))?;
            let found = before(&decide(&changed)?);
            if found != expected {
                let first = found.iter().zip(&expected).position(|(a, b)| a != b).unwrap_or(found.len().min(expected.len()));
                let at = [&expected, &found].into_iter().filter_map(|all| all.get(first)).map(|d| d.0).min().unwrap_or(now);
                return Err(fail(format!(
                    "its decision at {at} changes when what is known after {now} is {what}: it saw the future"
                )));
            }
        }
    }
    Ok(())
}

/// All that `strategy` asks for in a run of `backtest`, refused or not.
fn decisions(backtest: &Backtest, strategy: &mut dyn Strategy) -> Result<Vec<Decision>, BacktestError> {
    struct Recorder<'a> {
        inner: &'a mut dyn Strategy,
        decisions: Vec<Decision>,
    }
    impl Strategy for Recorder<'_> {
        fn name(&self) -> &str {
            self.inner.name()
        }
        fn lookback(&self) -> usize {
            self.inner.lookback()
        }
        fn on_event(&mut self, view: &super::View<'_>, orders: &mut super::Orders) {
            self.inner.on_event(view, orders);
            self.decisions.extend(orders.requests().iter().map(|request| (view.now(), *request)));
        }
    }
    let mut recorder = Recorder { inner: strategy, decisions: Vec::new() };
    backtest.run(&mut recorder)?;
    Ok(recorder.decisions)
}

fn known_times(histories: &[History]) -> Vec<Timestamp> {
    let mut times: Vec<Timestamp> = histories
        .iter()
        .flat_map(|h| h.bars().iter().map(|bar| bar.known_at).chain(h.quotes().times().iter().copied()))
        .collect();
    times.sort_unstable();
    times
}

fn futures(backtest: &Backtest, future: impl Fn(&History, usize) -> History) -> Result<Backtest, BacktestError> {
    backtest.on(backtest.histories().iter().enumerate().map(|(k, history)| future(history, k)).collect())
}

fn cut_off(history: &History, now: Timestamp) -> History {
    history.within(Timestamp::MIN, now)
}

/// The same history with all that is known after `now` made up anew; an open before `now` had been seen and stays.
fn change(history: &History, now: Timestamp, seed: Seed, number: usize) -> History {
    let mut rng = seed.child("another future").stream(&number.to_string());
    let mut factor = || 0.5 + rng.random::<f64>();
    let mut bars = history.bars().to_vec();
    for bar in bars.iter_mut().filter(|bar| bar.known_at > now) {
        let close = scaled(bar.close, factor());
        let open = if bar.open_at < now { bar.open } else { scaled(bar.open, factor()) };
        *bar = Bar { open, close, high: open.max(close), low: open.min(close), volume: bar.volume * factor(), ..*bar };
    }
    let all = history.quotes().all();
    let mut quotes = Quotes::with_depth(history.quotes().depth());
    for quote in (0..all.len()).map_while(|k| all.get(k)) {
        let factor = if quote.time > now { factor() } else { 1.0 };
        let moved = |levels: &[Level]| -> Vec<Level> {
            levels.iter().map(|level| Level { price: level.price * factor, size: level.size }).collect()
        };
        quotes.push(quote.time, &moved(quote.bids), &moved(quote.asks));
    }
    // What it was made of was a history, and prices stay above 0 and in order.
    History::new(bars, quotes).unwrap_or_default()
}

fn scaled(price: Price, factor: f64) -> Price {
    Price(((price.0 as f64 * factor) as i64).max(1))
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
