//! A backtest as the report and the terminal show it.

use chrono::DateTime;

use crate::market::metric::Sampling;
use crate::market::{Record, Reference};
use crate::report::quantity::{UNDEFINED, decimals, number, percent, significant, with_unit};
use crate::report::{BacktestPage, Cost, Exposure, Fill, InForce, Input, Metric};
use crate::sim2real::{Simulator, Timestamp};

use super::Ran;

/// The page of the report.
pub(super) fn page(ran: &Ran) -> BacktestPage {
    let record = &ran.record;
    BacktestPage {
        title: title(ran),
        currency: ran.file.run.currency.clone(),
        metrics: metrics(ran),
        time: record.equity.iter().map(|point| point.time.0).collect(),
        equity: record.equity.iter().map(|point| point.equity).collect(),
        exposures: exposures(ran),
        fills: record.blotter.fills.iter().map(|fill| shown_fill(ran, fill)).collect(),
        fill_count: record.blotter.fills.len(),
        costs: costs(ran),
        in_force: in_force(ran),
        inputs: inputs(ran),
    }
}

/// What was traded, when, and how it went, in one sentence.
pub(super) fn title(ran: &Ran) -> String {
    let symbols: Vec<&str> = ran.backtest.instruments().iter().map(|i| i.symbol.as_str()).collect();
    let day = |time: Timestamp| DateTime::from_timestamp_nanos(time.0).format("%-d %B %Y").to_string();
    let equity = &ran.record.equity;
    let span = match (equity.first(), equity.last()) {
        (Some(first), Some(last)) => format!(", {} to {}", day(first.time), day(last.time)),
        _ => String::new(),
    };
    let metrics = &ran.summary.metrics;
    let gained = metrics.total_return.map_or_else(|| UNDEFINED.to_owned(), percent);
    let fall =
        metrics.max_drawdown.map_or_else(|| "no loss".to_owned(), |d| format!("a largest loss of {}", percent(d.depth)));
    format!("{} on {}{span}: {gained} after costs, with {fall} on the way.", ran.file.strategy, symbols.join(", "))
}

/// The key figures.
pub(super) fn metrics(ran: &Ran) -> Vec<Metric> {
    let (m, counts) = (&ran.summary.metrics, &ran.summary.counts);
    let currency = &ran.file.run.currency;
    let money = |amount: f64| with_unit(&decimals(amount, 2), currency);
    let sampled = match m.returns.sampling {
        Sampling::Daily => "daily returns",
        Sampling::Event => "returns from event to event, as there are fewer than 20 days",
    };
    let rejected: usize = counts.rejected.values().sum();
    let figure = |name: &str, value: Option<String>, help: String| Metric { name: name.to_owned(), value, help };
    vec![
        figure("Total return", m.total_return.map(percent), "Final equity over first, less one.".into()),
        figure("Final equity", Some(money(m.final_equity)), format!("From {}.", money(m.initial_equity))),
        figure("Return a year", m.cagr.map(percent), "Compounded over years of 365.25 days.".into()),
        figure(
            "Sharpe ratio",
            m.returns.sharpe.map(number),
            format!("Mean over standard deviation of {sampled}, made yearly."),
        ),
        figure(
            "Volatility",
            m.returns.annualised_volatility.map(percent),
            format!("Standard deviation of {sampled}, made yearly."),
        ),
        figure("Largest drawdown", m.max_drawdown.map(|d| percent(d.depth)), "Deepest fall from a high of equity.".into()),
        figure("Turnover", m.turnover.map(number), "Value traded, both ways, over mean equity.".into()),
        figure("Time invested", m.exposure.map(percent), "Part of all events at which something was held.".into()),
        figure(
            "Hit rate",
            m.hit_rate.map(percent),
            "Part of the fills that closed something which gained after their own fee.".into(),
        ),
        figure(
            "Costs",
            Some(money(m.costs.shortfall)),
            "Of all fills against the prices at which they were decided, fees included.".into(),
        ),
        figure(
            "Costs of value traded",
            m.costs.shortfall_bps.map(|bps| format!("{} bps", significant(bps, 3))),
            "The same in basis points of the value traded at the prices of the decisions.".into(),
        ),
        figure(
            "Fills",
            Some(decimals(counts.fills as f64, 0)),
            format!("Of {} orders sent; {rejected} more were refused before they were sent.", counts.orders),
        ),
    ]
}

/// What was held of each instrument at each point of the equity.
fn exposures(ran: &Ran) -> Vec<Exposure> {
    let instruments = ran.backtest.instruments().iter().enumerate();
    let one = |(k, symbol): (usize, &str)| Exposure {
        name: symbol.to_owned(),
        unit: "units".to_owned(),
        values: held(&ran.record, k),
    };
    instruments.map(|(k, instrument)| one((k, instrument.symbol.as_str()))).collect()
}

fn held(record: &Record, instrument: usize) -> Vec<f64> {
    let mut fills = record.blotter.fills.iter().filter(|fill| fill.instrument == instrument).peekable();
    let mut position = 0.0;
    let at = |point: &crate::market::EquityPoint| {
        while let Some(fill) = fills.next_if(|fill| fill.filled_at <= point.time) {
            position += fill.quantity.signed(fill.side).to_f64();
        }
        position
    };
    record.equity.iter().map(at).collect()
}

fn shown_fill(ran: &Ran, fill: &crate::market::Fill) -> Fill {
    Fill {
        time: fill.filled_at.0,
        symbol: ran.backtest.instruments()[fill.instrument].symbol.clone(),
        side: fill.side.word().to_owned(),
        quantity: fill.quantity.to_f64(),
        price: fill.price.to_f64(),
        fee: fill.fee.to_f64(),
    }
}

fn costs(ran: &Ran) -> Vec<Cost> {
    let costs = &ran.summary.metrics.costs;
    let kinds = [
        ("timing", costs.timing),
        ("spread and impact", costs.spread_and_impact),
        ("rounding to a tick", costs.rounding),
        ("fees", costs.fees),
    ];
    // The value traded, as the whole has it.
    let per_bps = costs.shortfall_bps.map(|bps| costs.shortfall / bps).filter(|value| value.is_finite() && *value > 0.0);
    kinds.map(|(kind, amount)| Cost { kind: kind.to_owned(), amount, bps: per_bps.map(|value| amount / value) }).into()
}

fn in_force(ran: &Ran) -> Vec<InForce> {
    let venue = ran.backtest.venue();
    let mechanism = |(name, parameters): (&str, &[crate::sim2real::Parameter])| {
        let settings: Vec<String> = parameters
            .iter()
            .map(|p| with_unit(&format!("{} = {}", p.name, significant(p.nominal, 6)), &venue.unit(&p.unit)))
            .collect();
        InForce { name: name.to_owned(), setting: settings.join(", ") }
    };
    let mut all: Vec<InForce> = venue.mechanisms().map(|(row, _, p)| mechanism((row.about().name, p))).collect();
    let reference = match ran.summary.provenance.reference {
        Reference::Mid => "where there are quotes, from the mid",
        Reference::Touch => "where there are quotes, from the best price an order can take",
    };
    let assumption = |name: &str, setting: String| InForce { name: name.to_owned(), setting };
    all.push(assumption("fills", format!("at the open of the next bar; {reference}")));
    let leverage = ran.file.run.max_leverage.unwrap_or(1.0);
    all.push(assumption("largest leverage", format!("{} of the equity", number(leverage))));
    all.push(assumption("market", "the past does not react to what the backtest trades".to_owned()));
    all
}

fn inputs(ran: &Ran) -> Vec<Input> {
    // The first input is the run itself, the others are its data in their order.
    let rows = std::iter::once(None).chain(ran.rows.iter().copied().map(Some));
    let files = ran.summary.provenance.inputs.iter().zip(rows);
    files.map(|(input, rows)| Input { name: input.path.clone(), rows, sha256: input.sha256.clone() }).collect()
}
