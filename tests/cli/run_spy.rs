//! A crossover on SPY's minute bars of LEAN's sample data: six days of 2013 and one of 2023, hours before and after the
//! session included. The data are not part of the repository: without them the test says so and ends.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails where a value is missing")]

use std::collections::BTreeSet;
use std::path::Path;

use trueup::io::RunFile;
use trueup::market::{Bar, Record, RunOutputs, prepare_run};
use trueup::sim2real::Timestamp;
use trueup::strategies;

const RUN: &str = r#"
[run]
seed = 7
cash = 1_000_000
currency = "USD"

[[instrument]]
symbol = "SPY"
tick_size = 0.01

[[data]]
symbol = "SPY"
bars = "BARS"
stamp = "open"
zone = "America/New_York"
price_scale = 1e-4
columns = { ts = "ts_exchange_local" }

[strategy]
kind = "sma_cross"
fast = 10
slow = 50

[[mechanism]]
name = "half_spread"
bps = 1.0

[[mechanism]]
name = "commission"
per_share = 0.005
"#;

/// The bars, the record and the outputs; none where the data are not on this machine.
fn run() -> Option<(Vec<Bar>, Record, RunOutputs)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let bars = root.join("../shared/data/market/lean/spy_minute_trade_bars_x10000.parquet");
    if !bars.is_file() {
        println!("skipped: the minute bars of SPY are not on this machine");
        return None;
    }
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("run.toml"), RUN.replace("BARS", &bars.to_string_lossy())).unwrap();
    let file = RunFile::read(folder.path().join("run.toml")).unwrap();
    let mut table: toml::Table = file.strategy_settings().unwrap();
    table.insert("kind".to_owned(), file.strategy.clone().into());
    let prepared = prepare_run(&file).unwrap();
    let record = prepared.backtest.run(strategies::build(&table).unwrap().as_mut()).unwrap();
    let outputs = prepared.outputs(&record).unwrap();
    Some((prepared.backtest.histories()[0].bars().to_vec(), record, outputs))
}

/// Hours of the day in New York, without its summer time: October and August are both in it.
fn in_new_york(time: Timestamp) -> (i64, i64) {
    let seconds = time.0.div_euclid(Timestamp::NANOS) - 4 * 3_600;
    (seconds.div_euclid(86_400), seconds.rem_euclid(86_400))
}

#[test]
fn sma_cross_on_spy_adds_up() {
    let Some((bars, record, outputs)) = run() else { return };
    assert_eq!(bars.len(), 5_786);
    let days: BTreeSet<i64> = bars.iter().map(|bar| in_new_york(bar.open_at).0).collect();
    assert_eq!(days.len(), 7, "seven days, none cut by a wrong zone");
    assert!(bars.iter().all(|bar| (4 * 3_600..20 * 3_600).contains(&in_new_york(bar.open_at).1)), "from 4:00 to 20:00");
    assert!(bars.iter().all(|bar| (100.0..500.0).contains(&bar.close.to_f64())), "prices were scaled");

    let blotter = &record.blotter;
    assert!(blotter.fills.len() > 50 && blotter.rejected.is_empty(), "{} fills", blotter.fills.len());
    for fill in &blotter.fills {
        let order = blotter.order(fill.order_id).unwrap();
        assert!(fill.filled_at >= order.decided_at, "order {} was filled before it was decided", order.order_id);
        // It meets the first bar that opens once it is decided: at its open and a basis point, and not more than a tick.
        let met = bars.iter().find(|bar| bar.open_at >= order.decided_at).unwrap();
        assert_eq!(fill.filled_at, met.open_at);
        let decided = bars.iter().rfind(|bar| bar.known_at <= order.decided_at).unwrap();
        let (open, close) = (met.open.to_f64(), decided.close.to_f64());
        let beyond = fill.side.sign() * (fill.price.to_f64() - open) - 1e-4 * close;
        assert!((-1e-6..0.01 + 1e-6).contains(&beyond), "fill {} at {} from {open}", fill.fill_id, fill.price.to_f64());
        assert_eq!(fill.fee.0, i128::from(fill.quantity.0) * 5_000_000, "0.005 a share");
    }

    // What fills say and what the account holds are the same to the last unit.
    let (mut cash, mut held) = (record.ledger.opening().0, 0_i128);
    for fill in &blotter.fills {
        let signed = i128::from(fill.quantity.signed(fill.side).0);
        cash -= signed * i128::from(fill.price.0) + fill.fee.0;
        held += signed;
    }
    let position = &record.ledger.positions()[0];
    assert_eq!((record.ledger.cash().0, i128::from(position.quantity.0)), (cash, held));
    assert_eq!(record.ledger.equity().unwrap().0, cash + held * i128::from(bars.last().unwrap().close.0));

    let metrics = &outputs.summary.metrics;
    assert_eq!(outputs.summary.counts.events, bars.len());
    // Five days of neighbours and one a decade later make no year.
    let returns = metrics.returns;
    assert_eq!((returns.daily_returns, returns.gaps), (5, 1));
    assert_eq!((returns.sharpe, returns.annualised_volatility, metrics.cagr), (None, None, None));
    let spread = metrics.costs.mechanisms["half_spread"];
    assert!((spread / metrics.costs.decided_value * 1e4 - 1.0).abs() < 1e-9, "a basis point of the prices of decisions");
    assert!(metrics.total_return.unwrap().abs() < 0.2 && metrics.max_drawdown.unwrap().depth < 0.2, "{metrics:?}");
    let page = outputs.page.render().unwrap();
    assert!(page.contains("Not given for 5 daily returns") && page.contains("gaps in the data"));
}
