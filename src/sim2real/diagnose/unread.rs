//! Columns of a recording that the twin does not read: where parameters of its own on either side of some value of one would explain what
//! the twin errs by, the column is likely to tell what the twin does not know, as that a drive was switched off.
//!
//! It is asked of windows that start afresh: what a run brings along from elsewhere would hide where it began to go wrong.

use std::collections::BTreeSet;

use super::hypothesis::{Hypothesis, Inquiry, free_parameters};
use super::locate::{Covariates, identity, quantile_bins, sorted};
use super::onset::{Row, parted};
use super::weigh::ACCEPT;
use super::{ColumnSplit, gates};
use crate::sim2real::identify::{Problem, State, fit_smooth};
use crate::sim2real::{Clock, Twin};

/// Windows into which the longest recording is cut.
const WINDOWS: f64 = 60.0;
/// Rows of which it is asked at the most, evenly taken from all.
const MOST_ROWS: usize = 6_000;
/// A column is told that explains this part of the misfit above the noise: beside what else is missing it need not be most of it.
const EXPLAINS: f64 = 0.3;
/// A column, or a state, of which less than this part of the rows has a value is not asked.
const KNOWN: f64 = 0.9;
/// Columns that are told.
const TOLD: usize = 2;

/// A column of a recording that the twin does not read.
#[derive(Debug, Clone, PartialEq)]
pub struct Unread {
    /// The recording.
    pub recording: String,
    /// The column's name.
    pub name: String,
    /// Time of each row [s].
    pub time: Vec<f64>,
    /// Its values, row by row; not a number where there is none.
    pub values: Vec<f64>,
}

/// The unread `columns` on which the parameters of `recalibrated` seem to depend, the most telling first: each explains more of what it
/// errs by than chance would have it, and more than the states of the twin and time do.
///
/// Source: tests of whether parameters are the same whatever a covariate is, Zeileis & Hornik, "Generalized M-fluctuation tests for
/// parameter instability", Statistica Neerlandica 61 (2007); of two sets of parameters, Chow, Econometrica 28 (1960).
pub(super) fn splits<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    recalibrated: &Hypothesis<T>,
    covariates: &Covariates,
    columns: &[Unread],
) -> Vec<ColumnSplit> {
    if columns.is_empty() || inquiry.twin.clock() == Clock::Event {
        return Vec::new();
    }
    let mut rows = afresh(inquiry, recalibrated);
    let every = rows.len().div_ceil(MOST_ROWS).max(1);
    rows = rows.into_iter().step_by(every).collect();
    let mut names: Vec<&str> = columns.iter().map(|c| c.name.as_str()).collect();
    names.sort_unstable();
    names.dedup();
    let of_column = |name: &str| -> Vec<f64> { rows.iter().map(|row| of(columns, name, row)).collect() };
    let own = |name: &str| -> Vec<f64> {
        let value = |row: &Placed| {
            let all = covariates.get(&row.recording)?;
            all.iter().find(|(other, _)| *other == name)?.1.get(row.row).copied()
        };
        rows.iter().map(|row| value(row).unwrap_or(f64::NAN)).collect()
    };
    let states: BTreeSet<&str> = covariates.values().flatten().map(|(name, _)| *name).collect();
    let size = |values: Vec<f64>| values.into_iter().map(f64::abs).collect();
    let known = states.into_iter().flat_map(|name| [own(name), size(own(name))]);
    let known = known.chain([rows.iter().map(|row| row.of.time).collect()]);
    let most = known.filter_map(|values| best(&rows, &values)).map(|split| split.gain).fold(0.0, f64::max);
    let tried = names.len() as f64;
    let mut found: Vec<(f64, ColumnSplit)> = Vec::new();
    for name in names {
        let Some(split) = best(&rows, &of_column(name)) else { continue };
        // As many were tried.
        if split.explains > EXPLAINS && split.gain - 2.0 * tried.ln() > ACCEPT && split.gain > most {
            found.push((split.gain, ColumnSplit { column: name.to_owned(), at: split.at, explains: split.explains }));
        }
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.into_iter().take(TOLD).map(|(_, split)| split).collect()
}

/// A row of the regression, and where it stands.
struct Placed<'a> {
    /// Of the recording, by its identity and its name.
    recording: usize,
    name: &'a str,
    row: usize,
    of: Row,
}

/// The rows of windows that start afresh, with derivatives by all of the twin's parameters: one that is known exactly may be another where
/// the twin does not know what is going on.
fn afresh<'a, T: Twin>(inquiry: &Inquiry<'a, T>, recalibrated: &Hypothesis<T>) -> Vec<Placed<'a>> {
    let evidence = inquiry.evidence.in_windows(WINDOWS);
    let step = gates::exploring_step(inquiry.twin, &recalibrated.fit.values, inquiry.evidence);
    let twin = step.map_or_else(|| recalibrated.twin.clone(), |step| recalibrated.twin.stepping(step));
    let smooth = |k: &usize| twin.parameters()[*k].smooth;
    let free: Vec<usize> = free_parameters(&twin).into_iter().filter(smooth).collect();
    let all: Vec<usize> = (0..twin.parameters().len()).filter(smooth).collect();
    let problem = Problem { simulator: &twin, parts: &evidence.compared, weights: &evidence.weights, seed: inquiry.seed };
    let fit = fit_smooth(&problem, &recalibrated.fit.values, &free, &State::unknown(&problem));
    let found = problem.evaluate(&fit.values, &fit.state, &all);
    let mut rows = Vec::new();
    for block in problem.blocks() {
        let recording = evidence.compared[block.part].recording;
        let channel = evidence.weights.iter().position(|w| w.channel == block.channel).unwrap_or(0);
        rows.extend(block.range.clone().zip(&block.rows).map(|(at, row)| {
            let derivatives = found.jacobian.row(at).iter().copied().collect();
            let of = Row { time: recording.time[*row], channel, residual: found.residual[at], derivatives };
            Placed { recording: identity(recording), name: &recording.name, row: *row, of }
        }));
    }
    rows
}

/// What the column `name` is in a row; not a number where it has none, or where two recordings of one name have it.
fn of(columns: &[Unread], name: &str, row: &Placed) -> f64 {
    let mut same = columns.iter().filter(|c| c.name == name && c.recording == row.name);
    let column = same.next().filter(|_| same.next().is_none());
    let at = |column: &Unread| column.values.get(column.time.binary_search_by(|t| t.total_cmp(&row.of.time)).ok()?).copied();
    column.and_then(at).unwrap_or(f64::NAN)
}

/// Two sets of parameters, below and above a value.
struct Split {
    at: f64,
    gain: f64,
    explains: f64,
}

/// The value of those between quantiles at which two sets of parameters explain most, of the rows that have one; none where there
/// is no such value, or too few rows have any.
fn best(rows: &[Placed], values: &[f64]) -> Option<Split> {
    let order = sorted(values);
    if (order.len() as f64) < KNOWN * rows.len() as f64 {
        return None;
    }
    let bins = quantile_bins(&order, values);
    let border = |pair: &[&[usize]]| Some(0.5 * (values[*pair[0].last()?] + values[*pair[1].first()?]));
    let splits = bins.windows(2).filter_map(|pair| {
        let at = border(pair)?;
        // In the order of time on either side.
        let (below, above): (Vec<usize>, Vec<usize>) =
            (0..rows.len()).filter(|k| values[*k].is_finite()).partition(|k| values[*k] < at);
        let in_turn: Vec<Row> = below.iter().chain(&above).map(|k| rows[*k].of.clone()).collect();
        let (gain, explains) = parted(&in_turn, below.len())?;
        Some(Split { at, gain, explains })
    });
    splits.max_by(|a, b| a.gain.total_cmp(&b.gain))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows of a regression on one parameter, which is another by `by` where it is so.
    fn rows(by: f64, other: fn(usize) -> bool) -> Vec<Placed<'static>> {
        let one = |row: usize| {
            let t = row as f64 * 0.01;
            let derivative = (1.3 * t).sin() + 0.5 * (4.7 * t).cos();
            let noise = 2.0 * ((row as f64 * 12.989_8).sin() * 43_758.545_3).fract();
            let residual = noise + if other(row) { by * derivative } else { -0.3 * by * derivative };
            Placed { recording: 0, name: "r", row, of: Row { time: t, channel: 0, residual, derivatives: vec![derivative] } }
        };
        (0..4_000).map(one).collect()
    }

    fn off(row: usize) -> bool {
        (row / 173) % 5 < 2
    }

    fn column(value: fn(usize) -> f64) -> Vec<f64> {
        (0..4_000).map(value).collect()
    }

    #[test]
    fn parameters_that_are_others_where_a_column_is_low_are_found_by_it() {
        let rows = rows(20.0, off);
        let found = best(&rows, &column(|row| f64::from(!off(row)))).unwrap();
        assert!(
            found.at == 0.5 && found.explains > 0.95 && found.gain > 100.0,
            "{} {} {}",
            found.at,
            found.explains,
            found.gain
        );
        let current = best(&rows, &column(|row| if off(row) { 0.1 } else { 2.0 } + 0.5 * (row as f64 * 0.7).sin())).unwrap();
        assert!((0.4..1.6).contains(&current.at) && current.explains > 0.9, "{} {}", current.at, current.explains);
    }

    #[test]
    fn a_few_holes_hide_nothing() {
        let with_holes = column(|row| if row.is_multiple_of(50) { f64::NAN } else { f64::from(!off(row)) });
        let found = best(&rows(20.0, off), &with_holes).unwrap();
        assert!(found.at == 0.5 && found.explains > 0.95, "{} {}", found.at, found.explains);
    }

    #[test]
    fn a_column_that_has_nothing_to_do_with_them_gains_nothing() {
        let rows = rows(20.0, off);
        let blinks = best(&rows, &column(|row| f64::from((row / 211).is_multiple_of(2)))).unwrap();
        assert!(blinks.explains < 0.1, "{}", blinks.explains);
        assert!(best(&rows, &column(|_| 7.3)).is_none(), "what never changes parts nothing");
        assert!(
            best(&rows, &column(|row| if row.is_multiple_of(3) { f64::NAN } else { row as f64 })).is_none(),
            "nor what has holes in a third of its rows"
        );
    }

    #[test]
    fn where_nothing_is_left_nothing_is_parted() {
        let quiet = best(&rows(0.0, off), &column(|row| f64::from(off(row))));
        assert!(quiet.is_none_or(|split| split.gain < ACCEPT || split.explains < EXPLAINS));
    }

    #[test]
    fn a_column_is_that_of_its_recording_and_of_no_other_of_the_same_name() {
        let column = |recording: &str| Unread {
            recording: recording.into(),
            name: "enabled".into(),
            time: vec![0.0, 0.01],
            values: vec![3.0, 4.0],
        };
        let row = &rows(1.0, off)[1];
        assert_eq!(of(&[column("q"), column("r")], "enabled", row), 4.0);
        assert!(of(&[column("r"), column("r")], "enabled", row).is_nan() && of(&[column("r")], "volts", row).is_nan());
    }
}
