//! A baseline: equation error and sparse regression, as of Brunton, Proctor & Kutz, "Discovering governing equations from
//! data by sparse identification of nonlinear dynamical systems", PNAS 113 (2016).
//!
//! Positions are smoothed and differentiated, and accelerations regressed on command, velocity and gravity, and on those of a
//! library of terms that the Bayesian information criterion asks for. It takes its terms for free of noise, which they are not.

use nalgebra::{DMatrix, DVector};

use super::terms::{Row, Term, library};
use crate::conceal::benchmark::Case;

/// Half the window of the smoother [s].
const WINDOW: f64 = 0.05;
/// Rows used at most.
const ROWS: usize = 2_500;
/// Terms named at most.
const MOST: usize = 3;
/// A term must lower the criterion by this ...
const WORTH: f64 = 10.0;
/// ... and the squared error by this part, for with errors in the terms themselves the criterion alone keeps everything.
const SHARE: f64 = 0.05;

/// The names it gives, strongest first.
pub(super) fn regression(case: &Case) -> Vec<String> {
    let Some(rows) = rows(case) else { return Vec::new() };
    let mut left = column(&rows, |row| row.acceleration);
    let mut basis: Vec<DVector<f64>> = Vec::new();
    let mut known: Vec<DVector<f64>> = vec![column(&rows, |row| row.command), column(&rows, |row| row.velocity)];
    if case.nominal[2] != 0.0 {
        known.push(column(&rows, |row| row.position.sin()));
    }
    known.into_iter().for_each(|direction| explain(&mut basis, &mut left, direction));
    let library = library(&rows, case.linear);
    let count = rows.len() as f64;
    let mut names: Vec<String> = Vec::new();
    for _ in 0..MOST {
        let before = left.norm_squared();
        let open = library.iter().filter(|term| !names.iter().any(|name| name == term.id));
        let tried = open.map(|term| {
            let after = remaining(&basis, &left, term);
            (count * (before / after.max(1e-300)).ln() - (term.columns.len() as f64 + 1.0) * count.ln(), after, term)
        });
        let Some((gain, after, term)) = tried.max_by(|a, b| a.0.total_cmp(&b.0)) else { break };
        if gain < WORTH || after > (1.0 - SHARE) * before {
            break;
        }
        names.push(term.id.to_owned());
        term.columns.iter().for_each(|column| explain(&mut basis, &mut left, column.clone()));
    }
    names
}

/// Takes what `direction` explains out of what is left, and `direction` into the orthonormal basis.
fn explain(basis: &mut Vec<DVector<f64>>, left: &mut DVector<f64>, mut direction: DVector<f64>) {
    let whole = direction.norm();
    for _ in 0..2 {
        basis.iter().for_each(|known| direction -= known * known.dot(&direction));
    }
    let size = direction.norm();
    if size > 1e-8 * whole {
        direction /= size;
        *left -= &direction * direction.dot(left);
        basis.push(direction);
    }
}

/// Squared error that a term would leave.
fn remaining(basis: &[DVector<f64>], left: &DVector<f64>, term: &Term) -> f64 {
    let (mut basis, mut left) = (basis.to_vec(), left.clone());
    term.columns.iter().for_each(|column| explain(&mut basis, &mut left, column.clone()));
    left.norm_squared()
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
