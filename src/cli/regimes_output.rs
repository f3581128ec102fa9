//! What `trueup regimes` says and writes.

use crate::io::OutputTable;
use crate::report::quantity::{number, percent};
use crate::report::{FanTime, Listing as Rows, RegimesPage, Segment};

use super::regimes::{Changes, Listing, Series, Times, moments};
use super::screen::{Screen, titled};

/// A row for each of the series: its value, its state, and the probability of each state by then.
pub(super) fn by_row(series: &Series, path: &[usize], filtered: &[f64]) -> OutputTable {
    let mut table = OutputTable::new();
    let times = series.first..series.first + path.len();
    match &series.times {
        Times::Instants(instants) => table = table.times("ts", instants[times].iter().copied()),
        Times::Seconds(seconds) => table = table.floats("t", seconds[times].iter().copied()),
        Times::None => {}
    }
    let states = filtered.len() / path.len();
    table = table
        .floats("value", series.values.iter().map(|x| (!x.is_nan()).then_some(*x)))
        .integers("state", path.iter().map(|state| *state as i64));
    for state in 0..states {
        let probabilities = filtered.iter().skip(state).step_by(states).copied();
        table = table.floats(&format!("by_then_{state}"), probabilities);
    }
    table
}

/// What is told of the states: a row each.
fn states_listing(listing: &Listing) -> Rows {
    let heads = ["state", "mean", "std", "share", "expected rows", "now", ""];
    let endless = || "\u{221e}".to_owned();
    let row = |(number_of, state): (usize, &super::regimes::StateRow)| {
        let mut remarks = vec![];
        if let Some(degrees) = state.degrees {
            remarks.push(format!("{} degrees of freedom", number(degrees)));
        }
        if state.collapsed {
            remarks.push("no regime: it holds hardly a row, or rows that are all but equal".to_owned());
        }
        vec![
            number_of.to_string(),
            number(state.mean),
            state.std.map_or_else(endless, number),
            percent(state.share),
            state.expected_rows.map_or_else(endless, number),
            percent(state.now),
            remarks.join("; "),
        ]
    };
    Rows { heads: heads.map(str::to_owned).to_vec(), rows: listing.states.iter().enumerate().map(row).collect() }
}

/// The same of the changes.
fn changes_listing(listing: &Listing) -> Rows {
    let heads = ["row", "time", "mean after", "std after"];
    let row = |change: &super::regimes::ChangeRow| {
        let time = change.time.clone().unwrap_or_default();
        vec![(change.row + 1).to_string(), time, number(change.mean), number(change.std)]
    };
    Rows { heads: heads.map(str::to_owned).to_vec(), rows: listing.changes.iter().map(row).collect() }
}

/// What the series is, in words.
fn quantity(listing: &Listing) -> String {
    if listing.returns { format!("log returns of {}", listing.column) } else { listing.column.to_owned() }
}

pub(super) fn told(screen: &Screen, listing: &Listing) -> String {
    let what = if listing.returns { "log returns of " } else { "" };
    let converged = if listing.converged { "" } else { "; the fit has not converged" };
    let title =
        format!("States of {what}`{}`, {} rows (BIC {}{converged})", listing.column, listing.rows, number(listing.bic));
    let mut text = titled(&title, &screen.listing(&states_listing(listing)));
    if listing.tried.len() > 1 {
        let mut tried = screen.table([">states", ">log-likelihood", ">BIC"]);
        for row in &listing.tried {
            tried.add_row([row.states.to_string(), format!("{:.1}", row.log_likelihood), format!("{:.1}", row.bic)]);
        }
        text += &titled("Numbers of states that were tried", &tried);
    }
    if listing.changes.is_empty() {
        return text + "\nNo change was found.\n";
    }
    text + &titled("Changes", &screen.listing(&changes_listing(listing)))
}

/// The page, with the series over time: `changes` are the rows at which something new begins, `path` is the state of each row, `filtered` the
/// probabilities of all states row by row.
pub(super) fn page(series: &Series, listing: &Listing, changes: &[usize], path: &[usize], filtered: &[f64]) -> RegimesPage {
    let (rows, states) = (path.len(), listing.states.len());
    let times = series.first..series.first + rows;
    let time = match &series.times {
        Times::Instants(instants) => FanTime::Date(instants[times].iter().map(|instant| instant.0).collect()),
        Times::Seconds(seconds) => FanTime::Seconds(seconds[times].to_vec()),
        Times::None => FanTime::Rows(times.map(|row| row as f64 + 1.0).collect()),
    };
    let starts = [0].into_iter().chain(changes.iter().copied().filter(|row| *row > 0));
    let ends = changes.iter().copied().filter(|row| *row > 0).chain([rows]);
    let segment = |(start, end): (usize, usize)| {
        let (mean, std) = moments(&series.values[start..end.max(start)]);
        Segment { start, end, mean, std }
    };
    let plural = |count: usize, what: &str| format!("{count} {what}{}", if count == 1 { "" } else { "s" });
    let method = match listing.method {
        Changes::Pelt => "the best division of the whole series by mean and variance (PELT)",
        Changes::Bocpd => "Bayesian run lengths, row by row",
        Changes::Cusum => "cumulative sums against the first tenth of the rows, row by row",
    };
    let about = vec![
        format!(
            "{} of {rows} rows were observed. States are those of a hidden Markov model fitted to all of them, the calmest \
             first; the colours are its likeliest path. The probabilities below use no later row.",
            listing.observed
        ),
        format!("Changes are found by {method}."),
    ];
    RegimesPage {
        title: format!("{}: {} and {}", quantity(listing), plural(states, "state"), plural(listing.changes.len(), "change")),
        about,
        quantity: quantity(listing),
        time,
        values: series.values.iter().map(|value| (!value.is_nan()).then_some(*value)).collect(),
        path: path.to_vec(),
        by_then: (0..states).map(|state| filtered.iter().skip(state).step_by(states).copied().collect()).collect(),
        segments: starts.zip(ends).map(segment).collect(),
        states: states_listing(listing),
        changes: changes_listing(listing),
    }
}
