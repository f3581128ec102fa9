//! A baseline: equation error and sparse regression, as of Brunton, Proctor & Kutz, "Discovering governing equations from
//! data by sparse identification of nonlinear dynamical systems", PNAS 113 (2016).
//!
//! Positions are smoothed and differentiated, and accelerations regressed on command, velocity and gravity, and on those of a
//! library of terms that the Bayesian information criterion asks for. It takes its terms for free of noise, which they are not.

use nalgebra::{DMatrix, DVector};

use super::terms::{Row, library};
use crate::conceal::benchmark::Case;
use crate::proof::selection::selected;

/// Half the window of the smoother [s].
const WINDOW: f64 = 0.05;
/// Rows used at most.
const ROWS: usize = 2_500;

/// The names it gives, strongest first.
pub(in crate::proof) fn regression(case: &Case) -> Vec<String> {
    let Some(rows) = rows(case) else { return Vec::new() };
    let mut known: Vec<DVector<f64>> = vec![column(&rows, |row| row.command), column(&rows, |row| row.velocity)];
    if case.nominal[2] != 0.0 {
        known.push(column(&rows, |row| row.position.sin()));
    }
    selected(column(&rows, |row| row.acceleration), known, &library(&rows, case.linear))
}

fn column(rows: &[Row], of: impl Fn(&Row) -> f64) -> DVector<f64> {
    DVector::from_iterator(rows.len(), rows.iter().map(of))
}

/// Smoothed motion by parabolas of third order in windows (Savitzky & Golay 1964); the command is smoothed likewise, so that
/// both sides of the balance have passed the same filter.
fn rows(case: &Case) -> Option<Vec<Row>> {
    let (time, command, position) = (case.train.real("t")?, case.train.real("u")?, case.train.real("q")?);
    let sample = time.get(1)? - time.first()?;
    let half = ((WINDOW / sample).round() as usize).max(4);
    let design = DMatrix::from_fn(2 * half + 1, 4, |i, k| ((i as f64 - half as f64) * sample / WINDOW).powi(k as i32));
    let filters = (design.tr_mul(&design)).try_inverse()? * design.transpose();
    let filtered = |values: &[f64], row: usize, order: usize| -> f64 {
        let window = &values[row - half..=row + half];
        let scale = [1.0, 1.0, 2.0][order] / WINDOW.powi(order as i32);
        scale * filters.row(order).iter().zip(window).map(|(weight, value)| weight * value).sum::<f64>()
    };
    // A command in force from a row on acts in the interval after it: half a row late.
    let held: Vec<f64> = (0..command.len()).map(|row| 0.5 * (command[row] + command[row.saturating_sub(1)])).collect();
    let usable = half..time.len().checked_sub(half)?;
    let step = (usable.len() / ROWS).max(1);
    let rows = usable.step_by(step).map(|row| Row {
        index: row,
        time: time[row],
        command: filtered(&held, row, 0),
        command_rate: filtered(&held, row, 1),
        position: filtered(position, row, 0),
        velocity: filtered(position, row, 1),
        acceleration: filtered(position, row, 2),
        delayed: [0.01, 0.03, 0.08].map(|delay: f64| {
            let back = (delay / sample).round() as usize;
            filtered(&held, row.saturating_sub(back).max(half), 0)
        }),
    });
    Some(rows.collect())
}
