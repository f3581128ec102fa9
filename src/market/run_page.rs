//! A backtest as its report shows it.

use chrono::DateTime;

use crate::report::quantity::{UNDEFINED, decimals, number, percent, significant, with_unit};
use crate::report::{BacktestPage, Cost, Exposure, Fill, InForce, Input, Metric};
use crate::sim2real::{Parameter, Simulator, Timestamp};

use super::metric::{Metrics, Returns};
use super::{Backtest, EquityPoint, Record, Reference, RunSummary};

/// Fills a page is given: it lists no more.
const FILLS: usize = 200;

/// The page of `record`, the record of `backtest`, with the figures of `summary`.
pub(super) fn run_page(summary: &RunSummary, backtest: &Backtest, record: &Record) -> BacktestPage {
    BacktestPage {
        title: title(summary, backtest, record),
        currency: summary.provenance.currency.clone(),
        metrics: metrics(summary),
        time: record.equity.iter().map(|point| point.time.0).collect(),
        equity: record.equity.iter().map(|point| point.equity).collect(),
        exposures: exposures(backtest, record),
        fills: record.blotter.fills.iter().take(FILLS).map(|fill| shown(backtest, fill)).collect(),
        fill_count: record.blotter.fills.len(),
        costs: costs(&summary.metrics),
        in_force: in_force(summary, backtest),
        inputs: inputs(summary),
    }
}

/// What was traded, when, and how it went, in one sentence.
fn title(summary: &RunSummary, backtest: &Backtest, record: &Record) -> String {
    let symbols: Vec<&str> = backtest.instruments().iter().map(|i| i.symbol.as_str()).collect();
    let day = |time: Timestamp| DateTime::from_timestamp_nanos(time.0).format("%-d %B %Y").to_string();
    let span = match (record.equity.first(), record.equity.last()) {
        (Some(first), Some(last)) if day(first.time) == day(last.time) => format!(", {}", day(first.time)),
        (Some(first), Some(last)) => format!(", {} to {}", day(first.time), day(last.time)),
        _ => String::new(),
    };
    let metrics = &summary.metrics;
    let gained = metrics.total_return.map_or_else(|| UNDEFINED.to_owned(), fine);
    let fall = metrics.max_drawdown.map_or_else(|| "no loss".to_owned(), |d| format!("a largest loss of {}", fine(d.depth)));
    format!("{} on {}{span}: {gained} after costs, with {fall} on the way.", summary.provenance.strategy, symbols.join(", "))
}

/// A part of one as a percentage to a hundredth.
fn fine(part: f64) -> String {
    format!("{}\u{a0}%", decimals(100.0 * part, 2))
}

fn metrics(summary: &RunSummary) -> Vec<Metric> {
    let (m, counts) = (&summary.metrics, &summary.counts);
    let money = |amount: f64| with_unit(&decimals(amount, 2), &summary.provenance.currency);
    let rejected: usize = counts.rejected.values().sum();
    let figure = |name: &str, value: Option<String>, help: String| Metric { name: name.to_owned(), value, help };
    let a_year = made_yearly(&m.returns);
    vec![
        figure("Total return", m.total_return.map(fine), format!("From {}, after costs.", money(m.initial_equity))),
        figure("Final equity", Some(money(m.final_equity)), "Cash, and positions at their last price.".into()),
        figure("Return a year", m.cagr.map(fine), format!("Compounded over years of 365.25 days. {a_year}").trim().into()),
        figure("Sharpe ratio", m.returns.sharpe.map(number), format!("Mean over deviation of daily returns. {a_year}")),
        figure("Volatility", m.returns.annualised_volatility.map(fine), format!("Deviation of daily returns. {a_year}")),
        figure("Largest drawdown", m.max_drawdown.map(|d| fine(d.depth)), "Deepest fall from a high of equity.".into()),
        figure("Turnover", m.turnover.map(number), "Value traded, both ways, over mean equity.".into()),
        figure("Time invested", m.exposure.map(percent), "Part of all events at which something was held.".into()),
        figure("Hit rate", m.hit_rate.map(percent), "Part of the closing fills that gained after their own fee.".into()),
        figure(
            "Costs",
            Some(money(m.costs.shortfall)),
            "Of all fills against the prices at which they were decided, fees included.".into(),
        ),
        figure(
            "Costs of value traded",
            m.costs.shortfall_bps.map(|bps| format!("{} bps", significant(bps, 3))),
            "The same over the value traded at the prices of the decisions.".into(),
        ),
        figure(
            "Fills",
            Some(decimals(counts.fills as f64, 0)),
            format!(
                "Of {} orders sent; {} more were refused.",
                decimals(counts.orders as f64, 0),
                decimals(rejected as f64, 0)
            ),
        ),
    ]
}

/// What figures of a year rest on, or why there are none.
fn made_yearly(returns: &Returns) -> String {
    let Returns { daily_returns: count, gaps, .. } = *returns;
    if count < Returns::FEWEST {
        return format!("Not given for {count} daily returns: it takes {}.", Returns::FEWEST);
    }
    let left_out = match gaps {
        0 => String::new(),
        1 => " One gap of more than a week is left out.".to_owned(),
        many => format!(" {many} gaps of more than a week are left out."),
    };
    let a_year = returns.returns_per_year.map(number).unwrap_or_default();
    format!("From {} daily returns, {a_year} of them a year.{left_out}", decimals(count as f64, 0))
}

/// What was held of each instrument at each point of the equity.
fn exposures(backtest: &Backtest, record: &Record) -> Vec<Exposure> {
    let one = |(k, instrument): (usize, &super::Instrument)| Exposure {
        name: instrument.symbol.clone(),
        unit: "units".to_owned(),
        values: held(record, k),
    };
    backtest.instruments().iter().enumerate().map(one).collect()
}

fn held(record: &Record, instrument: usize) -> Vec<f64> {
    let mut fills = record.blotter.fills.iter().filter(|fill| fill.instrument == instrument).peekable();
    let mut position = 0.0;
    let at = |point: &EquityPoint| {
        while let Some(fill) = fills.next_if(|fill| fill.filled_at <= point.time) {
            position += fill.quantity.signed(fill.side).to_f64();
        }
        position
    };
    record.equity.iter().map(at).collect()
}

fn shown(backtest: &Backtest, fill: &super::Fill) -> Fill {
    Fill {
        time: fill.filled_at.0,
        symbol: backtest.instruments().get(fill.instrument).map(|i| i.symbol.clone()).unwrap_or_default(),
        side: fill.side.word().to_owned(),
        quantity: fill.quantity.to_f64(),
        price: fill.price.to_f64(),
        fee: fill.fee.to_f64(),
    }
}

/// What fills cost, mechanism by mechanism, and what no mechanism is to blame for.
fn costs(metrics: &Metrics) -> Vec<Cost> {
    let costs = &metrics.costs;
    let by_mechanism: f64 = costs.mechanisms.values().sum();
    let at_touch = costs.spread_and_impact - by_mechanism;
    let mut kinds: Vec<(&str, f64)> = vec![("timing", costs.timing)];
    kinds.extend(costs.mechanisms.iter().map(|(id, amount)| (*id, *amount)));
    // Fills that begin at the touch pay a spread that no mechanism adds; a rest from rounding is no cost.
    if at_touch.abs() > 1e-9 * costs.decided_value {
        kinds.push(("spread to the touch", at_touch));
    }
    kinds.extend([("rounding to a tick", costs.rounding), ("commission", costs.fees)]);
    let bps = |amount: f64| (costs.decided_value > 0.0).then(|| amount / costs.decided_value * 1e4);
    kinds.into_iter().map(|(kind, amount)| Cost { kind: kind.to_owned(), amount, bps: bps(amount) }).collect()
}

fn in_force(summary: &RunSummary, backtest: &Backtest) -> Vec<InForce> {
    let venue = backtest.venue();
    let currency = &summary.provenance.currency;
    let setting = |p: &Parameter| {
        let unit = venue.unit(&p.unit).replace("currency", currency);
        let value = format!("{} = {}", p.name, p.nominal);
        // "bps = 1 bps" says it twice.
        if unit == p.name.as_ref() { value } else { with_unit(&value, &unit) }
    };
    let mechanism = |name: &str, parameters: &[Parameter]| InForce {
        name: name.to_owned(),
        setting: parameters.iter().map(setting).collect::<Vec<_>>().join(", "),
    };
    let mut all: Vec<InForce> = venue.mechanisms().map(|(row, _, p)| mechanism(row.about().name, p)).collect();
    let histories = backtest.histories();
    let quoted = histories.iter().filter(|history| !history.quotes().is_empty()).count();
    let from_quotes = match summary.provenance.reference {
        Reference::Mid => "from the mid of the quotes an order meets",
        Reference::Touch => "at the best price of the quotes an order meets",
    };
    let fills = match quoted {
        0 => "at the open of the next bar".to_owned(),
        all if all == histories.len() => from_quotes.to_owned(),
        _ => format!("{from_quotes}; without quotes at the open of the next bar"),
    };
    let assumption = |name: &str, setting: String| InForce { name: name.to_owned(), setting };
    all.push(assumption("fills", fills));
    all.push(assumption("largest leverage", format!("{} times the equity", number(backtest.settings().max_leverage))));
    all.push(assumption("market", "the past does not react to what the backtest trades".to_owned()));
    match summary.metrics.returns.gaps {
        0 => {}
        gaps => all.push(assumption(
            "gaps in the data",
            format!("{gaps} of more than a week; what was held over one gained or lost all that prices moved in it"),
        )),
    }
    all
}

fn inputs(summary: &RunSummary) -> Vec<Input> {
    let input = |file: &super::InputFile| Input { name: file.path.clone(), rows: file.rows, sha256: file.sha256.clone() };
    summary.provenance.inputs.iter().map(input).collect()
}
