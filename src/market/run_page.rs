//! A backtest as its report shows it.

use std::sync::Arc;

use chrono::DateTime;

use crate::report::quantity::{UNDEFINED, fine, number, percent, with_unit};
use crate::report::{BacktestPage, Cost, Exposure, Fall, Fill, InForce, Input, MonthReturn, Trade};
use crate::sim2real::{Parameter, Simulator, Timestamp};

use super::metric::{Drawdown, FillBands, Metrics, Month, RoundTrip};
use super::run_figures::{figure_groups, key_figures};
use super::{Backtest, Calendar, DataSeen, EquityPoint, HaltSummary, Rate, Record, Reference, Requirement, RunSummary};

/// Fills a page is given: it lists no more.
const FILLS: usize = 200;

/// The page of `record`, the record of `backtest`, with the figures of `summary`.
pub(super) fn run_page(summary: &RunSummary, backtest: &Backtest, record: &Record, trips: &[RoundTrip]) -> BacktestPage {
    BacktestPage {
        title: title(summary, backtest, record),
        currency: summary.provenance.currency.clone(),
        metrics: key_figures(summary),
        figures: figure_groups(summary),
        time: record.equity.iter().map(|point| point.time.0).collect(),
        equity: record.equity.iter().map(|point| point.equity).collect(),
        bands: (!record.blotter.fills.is_empty()).then(|| FillBands::curves(record)),
        months: months(summary, record),
        zone: summary.provenance.zone.name().to_owned(),
        drawdowns: summary.metrics.drawdowns.iter().map(fall).collect(),
        trades: trips.iter().map(|trip| trade(backtest, trip)).collect(),
        exposures: exposures(backtest, record),
        fills: record.blotter.fills.iter().take(FILLS).map(|fill| shown(backtest, fill)).collect(),
        fill_count: record.blotter.fills.len(),
        costs: costs(&summary.metrics),
        in_force: in_force(summary, backtest, record),
        inputs: inputs(summary),
        draws: None,
    }
}

/// What was traded, when, and how it went, in one sentence.
pub(super) fn title(summary: &RunSummary, backtest: &Backtest, record: &Record) -> String {
    let symbols: Vec<&str> = backtest.instruments().iter().map(|i| i.symbol.as_str()).collect();
    // What is known at midnight belongs to the day that ends with it.
    let known = |time: Timestamp| DateTime::from_timestamp_nanos(time.0.saturating_sub(1));
    let day = |time: Timestamp| known(time).with_timezone(&summary.provenance.zone).format("%-d %B %Y").to_string();
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
    let fills = record.blotter.fills.iter().enumerate();
    let mut fills = fills.filter(|(_, fill)| fill.instrument == instrument).peekable();
    let mut actions = record.account.actions.iter().filter(|booked| booked.action.instrument == instrument).peekable();
    let mut position = 0.0;
    let at = |point: &EquityPoint| {
        loop {
            let booked = actions.peek().filter(|booked| booked.action.at <= point.time).map_or(usize::MAX, |b| b.fills);
            if let Some((_, fill)) = fills.next_if(|(k, fill)| *k < booked && fill.filled_at <= point.time) {
                position += fill.quantity.signed(fill.side).to_f64();
            } else if let Some(booked) = actions.next_if(|_| booked < usize::MAX) {
                // After a split in new units.
                position = booked.after.to_f64();
            } else {
                break position;
            }
        }
    };
    record.equity.iter().map(at).collect()
}

fn months(summary: &RunSummary, record: &Record) -> Vec<MonthReturn> {
    let months = Month::of(summary.metrics.initial_equity, &record.equity, summary.provenance.zone);
    months.iter().map(|m| MonthReturn { year: m.year, month: m.month, growth: m.growth }).collect()
}

fn fall(drawdown: &Drawdown) -> Fall {
    Fall {
        depth: drawdown.depth,
        peak_at: drawdown.peak_at.0,
        trough_at: drawdown.trough_at.0,
        recovered_at: drawdown.recovered_at.map(|at| at.0),
        seconds: drawdown.seconds,
    }
}

fn trade(backtest: &Backtest, trip: &RoundTrip) -> Trade {
    Trade {
        symbol: symbol(backtest, trip.instrument),
        side: trip.word().to_owned(),
        entered_at: trip.entered_at.0,
        exited_at: trip.exited_at.map(|at| at.0),
        seconds: trip.seconds,
        quantity: trip.quantity,
        entry_price: trip.entry_price,
        exit_price: trip.exit_price,
        fees: trip.fees.to_f64(),
        net: trip.net.to_f64(),
        growth: trip.growth(),
    }
}

fn symbol(backtest: &Backtest, instrument: usize) -> String {
    backtest.instruments().get(instrument).map(|i| i.symbol.clone()).unwrap_or_default()
}

fn shown(backtest: &Backtest, fill: &super::Fill) -> Fill {
    Fill {
        time: fill.filled_at.0,
        symbol: symbol(backtest, fill.instrument),
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
    if metrics.charges != 0.0 {
        kinds.push(("holding", metrics.charges));
    }
    let bps = |amount: f64| (costs.decided_value > 0.0).then(|| amount / costs.decided_value * 1e4);
    kinds.into_iter().map(|(kind, amount)| Cost { kind: kind.to_owned(), amount, bps: bps(amount) }).collect()
}

/// How orders that wait were matched, and how long messages took: where it can have mattered.
fn matched(summary: &RunSummary, backtest: &Backtest, data: &[DataSeen]) -> Vec<(&'static str, String)> {
    let settings = backtest.settings();
    let (matching, latencies) = (settings.matching, &settings.latencies);
    let mut all = Vec::new();
    if summary.counts.resting > 0 {
        let by_bars = data.iter().any(|seen| seen.bars_alone);
        if by_bars {
            let count = match summary.counts.ambiguous_bars {
                0 => "in no bar did it decide what was filled".to_owned(),
                1 => "in 1 bar orders waited on both sides of the open, and it may have decided".to_owned(),
                n => format!("in {n} bars orders waited on both sides of the open, and it may have decided"),
            };
            all.push(("way within a bar", format!("{}; {count}", matching.intrabar.word())));
            all.push(("limit orders", format!("filled {}, at the limit", matching.limit_fill.word())));
        } else {
            all.push(("queue at a price", matching.queue.to_string()));
        }
    }
    for (name, latency) in [
        ("latency of data", &latencies.feed),
        ("latency of orders", &latencies.order),
        ("latency of reports", &latencies.response),
        ("time to decide", &latencies.compute),
    ] {
        if !latency.is_none() {
            all.push((name, latency.to_string()));
        }
    }
    if !summary.halts.is_empty() {
        let sum = |of: fn(&HaltSummary) -> usize| summary.halts.iter().map(of).sum::<usize>();
        let (orders, refused) = (sum(|halt| halt.orders), sum(|halt| halt.refused));
        all.push(("halts", format!("{}; orders that came in them: {orders}, refused: {refused}", summary.halts.len())));
    }
    all
}

/// How the account was kept, where that was not cash in one currency.
fn account_terms(backtest: &Backtest, summary: &RunSummary) -> Vec<(String, String)> {
    let Some(account) = &backtest.settings().account else { return Vec::new() };
    let mut all = Vec::new();
    for (instrument, terms) in backtest.instruments().iter().zip(&account.terms) {
        let mut told = Vec::new();
        if terms.multiplier.get() != 1 {
            told.push(format!("{} units in one", terms.multiplier.get()));
        }
        if terms.currency != 0 {
            told.push(format!("in {}", account.currencies.get(terms.currency).map_or("", String::as_str)));
        }
        let margin = |what: &str, of: Requirement| {
            format!("margin {what} {} to open, {} to keep", percent(of.initial.to_f64()), percent(of.maintenance.to_f64()))
        };
        for (what, of) in [("long", terms.long), ("short", terms.short)] {
            if of != Requirement::default() {
                told.push(margin(what, of));
            }
        }
        if !told.is_empty() {
            all.push((format!("terms of {}", instrument.symbol), told.join("; ")));
        }
    }
    for (name, rate) in account.currencies.iter().skip(1).zip(&account.rates) {
        let told = match rate {
            Rate::Constant(rate) => format!("{} at all times; a trade in it is owed or held in it", rate.to_f64()),
            Rate::Known(rates) => format!("{} known from their times on; a trade in it is owed or held in it", rates.len()),
            Rate::PriceOf(k) => format!("the latest price of {}", symbol(backtest, *k)),
        };
        all.push((format!("rate of {name}"), told));
    }
    match summary.counts.corporate_actions {
        0 => {}
        count => all.push((
            "dividends and splits".to_owned(),
            format!("{count}; bars and quotes of before a split stay as they were printed"),
        )),
    }
    all
}

fn in_force(summary: &RunSummary, backtest: &Backtest, record: &Record) -> Vec<InForce> {
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
    let data = &record.data;
    let quoted = data.iter().filter(|seen| seen.quoted).count();
    let from_quotes = match summary.provenance.reference {
        Reference::Mid => "from the mid of the quotes an order meets",
        Reference::Touch => "at the best price of the quotes an order meets",
    };
    let fills = match quoted {
        0 => "at the open of the next bar".to_owned(),
        all if all == data.len() => from_quotes.to_owned(),
        _ => format!("{from_quotes}; without quotes at the open of the next bar"),
    };
    let assumption = |name: &str, setting: String| InForce { name: name.to_owned(), setting };
    all.push(assumption("market orders", fills));
    all.extend(matched(summary, backtest, &record.data).into_iter().map(|(name, setting)| assumption(name, setting)));
    all.extend(hours(backtest, record).into_iter().map(|(name, setting)| assumption(&name, setting)));
    all.push(assumption("largest leverage", format!("{} times the equity", number(backtest.settings().max_leverage))));
    all.extend(account_terms(backtest, summary).into_iter().map(|(name, setting)| assumption(&name, setting)));
    all.push(assumption("market", "the past does not react to what the backtest trades".to_owned()));
    for file in &summary.data {
        all.extend(file.lines.iter().map(|line| assumption("data", format!("{}, {line}", file.symbol))));
    }
    match summary.metrics.returns.gaps {
        0 => {}
        gaps => all.push(assumption(
            "gaps in the data",
            format!("{gaps} of more than a week; what was held over one gained or lost all that prices moved in it"),
        )),
    }
    all
}

/// When the market of each instrument was open, how many rows that leaves out, and since when its calendar holds.
fn hours(backtest: &Backtest, record: &Record) -> Vec<(String, String)> {
    let first = record.equity.first().map(|point| point.time);
    let all = backtest.instruments().iter().zip(&backtest.settings().calendars).enumerate();
    let one = |(k, (instrument, calendar)): (usize, (&super::Instrument, &Option<Arc<Calendar>>))| {
        let calendar = calendar.as_deref()?;
        let rows = match record.outside.get(k).copied().flatten().unwrap_or_default() {
            0 => "no row is from outside its sessions".to_owned(),
            1 => "1 row is from outside its sessions, and no order met it".to_owned(),
            n => format!("{n} rows are from outside its sessions, and no order met them"),
        };
        let begins = first.map(|time| calendar.date_at(time));
        let early = calendar.holds_from().zip(begins).filter(|(from, begins)| begins < from);
        let since = early.map(|(from, _)| format!("; its rules hold from {from}, and are followed before it all the same"));
        Some((
            format!("hours of {}", instrument.symbol),
            format!("{}: {rows}{}", calendar.name(), since.unwrap_or_default()),
        ))
    };
    all.filter_map(one).collect()
}

fn inputs(summary: &RunSummary) -> Vec<Input> {
    let input = |file: &super::InputFile| Input { name: file.path.clone(), rows: file.rows, sha256: file.sha256.clone() };
    summary.provenance.inputs.iter().map(input).collect()
}
