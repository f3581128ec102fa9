//! When it began: a change in what the residuals say about the parameters.
//!
//! The scores `J_i r_i`, cumulated row by row, drift one way before a change and another way after it (Brown, Durbin & Evans,
//! JRSS B 37 (1975); Hjort & Koning, Journal of Nonparametric Statistics 14 (2002)). How much better two sets of
//! parameters, one before and one after, explain the residuals than one set does follows from the cumulated scores and
//! information alone (Chow, Econometrica 28 (1960)), so that every date is tried.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::gates;
use super::hypothesis::{Hypothesis, Inquiry, free_parameters};
use super::weigh::ACCEPT;
use super::whiteness::autocorrelation_time;
use crate::sim2real::identify::{Problem, State, fit_smooth};
use crate::sim2real::{Clock, Part, Twin};

/// Dates tried at first.
const DATES: usize = 400;
/// Neither side of a change is shorter than this part of its recording.
const SHORTEST: f64 = 0.04;
/// A change must explain this part of the misfit above the noise: what is off throughout is somewhat less so with two sets
/// of parameters, too.
const EXPLAINS: f64 = 0.5;
/// Directions that the rows of one side determine less than this part of the best count as not determined by it.
const DETERMINED: f64 = 1e-7;

/// A change in the parameters.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Onset {
    /// When [s].
    pub time: f64,
    /// The recording in which it is clearest.
    pub recording: String,
    /// `N_e ln(RSS0 / RSS1) - k ln N_e` of two sets of parameters against one; above [`ACCEPT`], or there is no onset.
    pub gain: f64,
}

/// A row of the regression of residuals on what parameters can change in them.
#[derive(Debug, Clone)]
pub(super) struct Row {
    pub time: f64,
    pub channel: usize,
    pub residual: f64,
    pub derivatives: Vec<f64>,
}

/// The clearest change in the residuals of `hypothesis`, where one is clear.
pub(super) fn onset<T: Twin>(inquiry: &Inquiry<'_, T>, hypothesis: &Hypothesis<T>) -> Option<Onset> {
    if inquiry.twin.clock() == Clock::Event {
        return None;
    }
    let parts = &inquiry.evidence.compared;
    let blocks = inquiry.problem(&hypothesis.twin, parts).blocks();
    let fit = &hypothesis.fit;
    let mut found: Vec<(Onset, &Part<'_, T::Stimulus>)> = Vec::new();
    for whole in &inquiry.evidence.free_run {
        let own = blocks.iter().filter(|b| std::ptr::eq(parts[b.part].recording, whole.recording));
        let mut rows: Vec<(usize, Row)> = Vec::new();
        for block in own {
            let channel = inquiry.evidence.weights.iter().position(|w| w.channel == block.channel).unwrap_or(0);
            rows.extend(block.range.clone().zip(&block.rows).map(|(at, row)| {
                let derivatives = fit.jacobian.row(at).iter().copied().collect();
                (*row, Row { time: whole.recording.time[*row], channel, residual: fit.residual[at], derivatives })
            }));
        }
        rows.sort_by_key(|(row, _)| *row);
        let rows: Vec<Row> = rows.into_iter().map(|(_, row)| row).collect();
        if let Some((time, gain)) = change(&rows) {
            found.push((Onset { time, recording: whole.recording.name.clone(), gain }, whole));
        }
    }
    let (mut best, part) = found.into_iter().max_by(|a, b| a.0.gain.total_cmp(&b.0.gain))?;
    best.time = refined(inquiry, hypothesis, part, best.time);
    Some(best)
}

/// The date of a change and its gain, where it is clear.
fn change(rows: &[Row]) -> Option<(f64, f64)> {
    let columns = standardized(rows)?;
    let count = columns.target.len();
    let width = columns.design.ncols();
    let shortest = ((SHORTEST * count as f64) as usize).max(3 * width);
    if count < 2 * shortest + 1 {
        return None;
    }
    let every = (count / DATES).max(1);
    // Scores and information, cumulated.
    let mut score = DVector::zeros(width);
    let mut information = DMatrix::zeros(width, width);
    let mut so_far: Vec<(usize, DVector<f64>, DMatrix<f64>)> = Vec::new();
    for at in 0..count {
        if at >= shortest && at <= count - shortest && at.is_multiple_of(every) {
            so_far.push((at, score.clone(), information.clone()));
        }
        let row = columns.design.row(at).transpose();
        score.axpy(columns.target[at], &row, 1.0);
        information.ger(1.0, &row, &row, 1.0);
    }
    let dates = so_far.par_iter().map(|(at, before, known)| {
        let explained = explained(known, before) + explained(&(&information - known), &(&score - before));
        (*at, explained)
    });
    let (at, _) = dates.collect::<Vec<_>>().into_iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
    let (gain, explains) = gain(rows, &columns, at)?;
    (gain > ACCEPT && explains.is_none_or(|part| part > EXPLAINS)).then(|| (rows[at].time, gain))
}

/// Residuals and derivatives, each channel brought to the size of its misfit and each column to length 1.
struct Columns {
    target: DVector<f64>,
    design: DMatrix<f64>,
}

fn standardized(rows: &[Row]) -> Option<Columns> {
    let channels = rows.iter().map(|r| r.channel).max()? + 1;
    let sizes: Vec<f64> = (0..channels)
        .map(|k| {
            let own = rows.iter().filter(|r| r.channel == k).map(|r| r.residual * r.residual);
            let (sum, count) = own.fold((0.0, 0_u32), |(sum, count), square| (sum + square, count + 1));
            (sum / f64::from(count.max(1))).sqrt()
        })
        .collect();
    let inverse = |row: &Row| if sizes[row.channel] > 0.0 { 1.0 / sizes[row.channel] } else { 0.0 };
    let target = DVector::from_iterator(rows.len(), rows.iter().map(|r| r.residual * inverse(r)));
    let own = rows.first()?.derivatives.len();
    // An offset of each channel beside the parameters: what began may be an offset.
    let mut design = DMatrix::from_fn(rows.len(), own + channels, |i, k| match k.checked_sub(own) {
        None => rows[i].derivatives[k] * inverse(&rows[i]),
        Some(channel) => f64::from(u8::from(rows[i].channel == channel)),
    });
    let usable = |v: &f64| v.is_finite();
    if !target.iter().all(usable) || !design.iter().all(usable) {
        return None;
    }
    for mut column in design.column_iter_mut() {
        let length = column.norm();
        if length > 0.0 {
            column /= length;
        }
    }
    Some(Columns { target, design })
}

/// What parameters with this information and score explain of the squared residuals: `S' A^-1 S`.
fn explained(information: &DMatrix<f64>, score: &DVector<f64>) -> f64 {
    let eigen = information.clone().symmetric_eigen();
    let most = eigen.eigenvalues.max();
    let along = eigen.eigenvectors.tr_mul(score);
    along
        .iter()
        .zip(&eigen.eigenvalues)
        .filter(|(_, value)| **value > DETERMINED * most)
        .map(|(s, value)| s * s / value)
        .sum()
}

/// What is left of the rows from `from` to `to` once their own parameters are fitted to them.
fn left(columns: &Columns, from: usize, to: usize) -> DVector<f64> {
    let design = columns.design.rows(from, to - from);
    let target = columns.target.rows(from, to - from);
    let eigen = design.tr_mul(&design).symmetric_eigen();
    let most = eigen.eigenvalues.max();
    let mut along = eigen.eigenvectors.tr_mul(&design.tr_mul(&target));
    for (value, scale) in along.iter_mut().zip(&eigen.eigenvalues) {
        *value = if *scale > DETERMINED * most { *value / scale } else { 0.0 };
    }
    target - design * (&eigen.eigenvectors * along)
}

/// The gain of two sets of parameters, one for the rows before `at` and one for the others, and what they explain of the misfit above the
/// noise; none where nothing is above it, or either side is too short.
pub(super) fn parted(rows: &[Row], at: usize) -> Option<(f64, f64)> {
    let columns = standardized(rows)?;
    let shortest = ((SHORTEST * rows.len() as f64) as usize).max(3 * columns.design.ncols());
    if !(shortest..rows.len().saturating_sub(shortest)).contains(&at) {
        return None;
    }
    let (gain, explains) = gain(rows, &columns, at)?;
    Some((gain, explains?))
}

/// The gain of a change at row `at`, and what it explains of the misfit above the noise, where there is any; as in selection, by the
/// evidence that the residuals of the alternative hold.
fn gain(rows: &[Row], columns: &Columns, at: usize) -> Option<(f64, Option<f64>)> {
    let count = rows.len();
    let one = left(columns, 0, count);
    let two: Vec<f64> = left(columns, 0, at).iter().chain(left(columns, at, count).iter()).copied().collect();
    let (mut gain, mut effective) = (0.0, 1.0_f64);
    let (mut misfit, mut remaining) = (0.0, 0.0);
    let channels = rows.iter().map(|r| r.channel).max()? + 1;
    for channel in 0..channels {
        let own = |values: &[f64]| -> Vec<f64> {
            values.iter().zip(rows).filter(|(_, row)| row.channel == channel).map(|(v, _)| *v).collect()
        };
        let (before, after) = (own(one.as_slice()), own(&two));
        let squares = |values: &[f64]| values.iter().map(|v| v * v).sum::<f64>().max(f64::MIN_POSITIVE);
        // In units of the misfit: the noise is what residuals are in units of.
        let unit = rows.iter().zip(&columns.target).find(|(row, _)| row.channel == channel && row.residual != 0.0);
        let noise = unit.map_or(0.0, |(row, target)| (target / row.residual).powi(2)) * before.len() as f64;
        let independent = after.len() as f64 / autocorrelation_time(&[&after]);
        gain += independent * (squares(&before) / squares(&after)).ln();
        effective += independent;
        misfit += (squares(&before) - noise).max(0.0);
        remaining += (squares(&after) - noise).max(0.0);
    }
    let free = columns.design.ncols() + 1;
    let explains = (misfit > 0.0).then(|| 1.0 - remaining / misfit);
    Some((gain - free as f64 * effective.ln(), explains))
}

/// Reaches of the search around a first date, as parts of a recording, and dates tried in each.
const REACHES: [f64; 2] = [0.05, 0.012];
const TRIED: usize = 3;

/// The date at which the twin, started afresh there with parameters of its own, explains the rows before and after best.
///
/// Scores of a run that passes through the change miss that the motion before it goes on for a while after it.
fn refined<T: Twin>(inquiry: &Inquiry<'_, T>, hypothesis: &Hypothesis<T>, whole: &Part<'_, T::Stimulus>, first: f64) -> f64 {
    // Steps as long as those in which hypotheses are compared tell a date as well as the shorter ones of the twin.
    let step = gates::exploring_step(inquiry.twin, &hypothesis.fit.values, inquiry.evidence);
    let twin = step.map_or_else(|| hypothesis.twin.clone(), |step| hypothesis.twin.stepping(step));
    let time = &whole.recording.time;
    let (start, end) = (time[whole.rows.start], time[whole.rows.end - 1]);
    let free: Vec<usize> =
        free_parameters(&hypothesis.twin).into_iter().filter(|k| hypothesis.twin.parameters()[*k].smooth).collect();
    let misfit = |at: f64| -> f64 {
        let row = time.partition_point(|t| *t < at).clamp(whole.rows.start + 2, whole.rows.end - 2);
        let one = |start: usize, end: usize| {
            let part = [Part { recording: whole.recording, start, rows: start..end }];
            let problem = Problem { simulator: &twin, parts: &part, weights: &inquiry.evidence.weights, seed: inquiry.seed };
            let fit = fit_smooth(&problem, &hypothesis.fit.values, &free, &State::unknown(&problem));
            fit.residual.norm_squared() + fit.prior
        };
        one(whole.rows.start, row) + one(row, whole.rows.end)
    };
    let margin = SHORTEST * (end - start);
    let mut best = first;
    for reach in REACHES {
        let step = reach * (end - start) / TRIED as f64;
        let dates: Vec<f64> =
            (0..=2 * TRIED).map(|k| (best + (k as f64 - TRIED as f64) * step).clamp(start + margin, end - margin)).collect();
        let misfits: Vec<f64> = dates.par_iter().map(|date| misfit(*date)).collect();
        let least = dates.iter().zip(&misfits).min_by(|a, b| a.1.total_cmp(b.1));
        best = least.map_or(best, |(date, _)| *date);
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim2real::Seed;
    use rand_distr::{Distribution, StandardNormal};

    /// Rows at 100 Hz of a regression whose parameters change by `step` at 12 s of 20; autoregressive noise of standard
    /// deviation 1.
    fn rows(step: f64, phi: f64, seed: u64) -> Vec<Row> {
        let mut rng = Seed(seed).stream("onset");
        let mut noise = 0.0;
        (0..2_000)
            .map(|i| {
                let time = f64::from(i) * 0.01;
                let draw: f64 = StandardNormal.sample(&mut rng);
                noise = phi * noise + (1.0 - phi * phi).sqrt() * draw;
                let derivatives = vec![(1.7 * time).sin(), (3.1 * time).cos(), (0.6 * time).sin()];
                let change = if time < 12.0 { -0.4 * step } else { 0.6 * step };
                Row { time, channel: 0, residual: noise + change * (derivatives[0] + derivatives[1]), derivatives }
            })
            .collect()
    }

    #[test]
    fn a_change_is_dated() {
        for seed in 0..5 {
            for (step, phi) in [(2.0, 0.0), (4.0, 0.5)] {
                let (time, gain) = change(&rows(step, phi, seed)).unwrap();
                assert!((time - 12.0).abs() < 0.2 && gain > 100.0, "{step} {phi}: {time} s, {gain}");
            }
        }
    }

    #[test]
    fn noise_has_no_onset_however_coloured() {
        for seed in 0..20 {
            for phi in [0.0, 0.6, 0.9, 0.98] {
                assert_eq!(change(&rows(0.0, phi, seed)), None, "{phi}, {seed}");
            }
        }
    }

    #[test]
    fn a_misfit_throughout_has_no_onset() {
        let mut rows = rows(0.0, 0.3, 1);
        rows.iter_mut().for_each(|row| row.residual += 8.0 * (2.3 * row.time).sin() * (0.9 * row.time).cos());
        assert_eq!(change(&rows), None);
    }
}
