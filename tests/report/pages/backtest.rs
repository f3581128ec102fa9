//! A backtest.

use trueup::report::{BacktestPage, Cost, Exposure, Fall, FigureGroup, Fill, InForce, Input, Metric, MonthReturn, Trade};

use super::Noise;

/// A day [ns].
const DAY: i64 = 86_400_000_000_000;

/// A year of a crossover.
pub fn backtest() -> BacktestPage {
    let mut noise = Noise(7);
    let start = 1_704_205_800_000_000_000_i64;
    // A year of days of 390 minutes.
    let time: Vec<i64> = (0..252_i64)
        .flat_map(|d| (0..390_i64).map(move |m| start + (d * 86_400 * 7 / 5 + m * 60) * 1_000_000_000))
        .collect();
    let mut equity = vec![1_000_000.0];
    let mut position = vec![0.0];
    for i in 1..time.len() {
        let held = if (i / 9_000) % 3 == 1 {
            -400.0
        } else if (i / 4_000) % 2 == 0 {
            1_200.0
        } else {
            0.0
        };
        equity.push(equity[i - 1] + 0.7 + held * 0.12 * noise.next());
        position.push(held);
    }
    let metric = |name: &str, value: Option<&str>, help: &str| Metric {
        name: name.into(),
        value: value.map(Into::into),
        help: help.into(),
    };
    let cost = |kind: &str, amount, bps| Cost { kind: kind.into(), amount, bps: Some(bps) };
    let fill = |i: i64| Fill {
        time: start + i * 3_600_000_000_000,
        symbol: "SPY".into(),
        side: if i % 2 == 0 { "buy" } else { "sell" }.into(),
        quantity: 1_200.0,
        price: 471.25 + 0.0125 * i as f64,
        fee: 28.28,
    };
    let bands = [1.0, -1.2].map(|each| equity.iter().enumerate().map(|(i, e)| e + each * i as f64 * 0.4).collect());
    BacktestPage {
        title:
            "sma_cross on SPY, 2 January to 20 December 2024: 6.9 % after costs, with a largest loss of 2.1 % on the way."
                .into(),
        currency: "USD".into(),
        metrics: vec![
            metric("Total return", Some("6.92 %"), "Final equity over first, less one."),
            metric("Sharpe ratio", Some("1.34"), "Mean over standard deviation of daily returns, times √252."),
            metric("Largest drawdown", Some("2.11 %"), "Deepest fall from a peak of equity."),
            metric("Volatility", Some("4.87 %"), "Standard deviation of daily returns, times √252."),
            metric("Turnover", Some("38.2 / year"), "Value traded over mean equity."),
            metric("Costs", Some("6,114.20 USD"), "Against the mid price at decision, fees included."),
            metric("Fills", Some("412"), "Of 412 orders sent."),
            metric("Sortino ratio", None, "Not defined: fewer than two losing days."),
        ],
        figures: vec![
            FigureGroup {
                title: "Return".into(),
                figures: vec![metric("Calmar ratio", Some("3.28"), "Return a year over the largest drawdown.")],
            },
            FigureGroup { title: "Risk".into(), figures: vec![metric("Kurtosis", None, "3 for a normal distribution.")] },
        ],
        months: (1..=12).map(|m| MonthReturn { year: 2024, month: m, growth: Some(0.01 - 0.002 * f64::from(m)) }).collect(),
        zone: "America/New_York".into(),
        drawdowns: vec![
            Fall {
                depth: 0.0211,
                peak_at: start,
                trough_at: start + DAY,
                recovered_at: Some(start + 9 * DAY),
                seconds: 777_600.0,
            },
            Fall {
                depth: 0.0102,
                peak_at: start + 300 * DAY,
                trough_at: start + 301 * DAY,
                recovered_at: None,
                seconds: 7_200.0,
            },
        ],
        trades: (0..50).map(|k| trade(start, k)).collect(),
        time,
        equity,
        bands: Some(bands),
        exposures: vec![Exposure { name: "SPY".into(), unit: "shares".into(), values: position }],
        fills: (0..260).map(fill).collect(),
        fill_count: 412,
        costs: vec![
            cost("half_spread", 3_912.11, 0.521),
            cost("commission", 1_706.6, 0.227),
            cost("sqrt_impact", 495.49, 0.066),
        ],
        in_force: vec![
            InForce { name: "half_spread".into(), setting: "1.0 bps of the price".into() },
            InForce { name: "commission".into(), setting: "0.5 bps of the value traded".into() },
            InForce { name: "bar stamp".into(), setting: "the open of the bar; known at its close".into() },
        ],
        inputs: vec![Input {
            name: "bars.parquet".into(),
            rows: Some(98_280),
            sha256: "9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08".into(),
        }],
        draws: None,
    }
}

/// Trips that gain and lose in turn, the later the more; the last is still under way.
fn trade(start: i64, k: i64) -> Trade {
    let net = if k % 2 == 0 { 10.5 } else { -7.25 } * k as f64;
    Trade {
        symbol: "SPY".into(),
        side: if k % 3 == 0 { "short" } else { "long" }.into(),
        entered_at: start + k * DAY,
        exited_at: (k < 49).then(|| start + (k + 1) * DAY),
        seconds: 86_400.0,
        quantity: 1_200.0,
        entry_price: 471.25,
        exit_price: (k < 49).then_some(471.5),
        fees: 28.28,
        net,
        growth: Some(net / 565_500.0),
    }
}
