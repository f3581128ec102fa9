//! Screening: what each mechanism would change, and how much of that the misfit looks like.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::hypothesis::{Hypothesis, Inquiry};
use crate::sim2real::identify::Block;
use crate::sim2real::{Candidate, Twin};

/// What screening found of one candidate.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Screened {
    /// Number of the candidate.
    pub number: usize,
    /// Correlation of its projected signature with the projected residual, at its best start; negative where it would
    /// have to act the other way round.
    pub score: f64,
    /// The part of the signature that refitting the parent's parameters could not hide.
    pub survival: f64,
    /// Its starts, the most promising first, each one value a parameter.
    pub starts: Vec<Vec<f64>>,
}

/// Screens every candidate that `parent` does not have.
pub(super) fn signatures<T: Twin>(inquiry: &Inquiry<'_, T>, parent: &Hypothesis<T>) -> Vec<Screened> {
    let blocks = inquiry.problem(&parent.twin, &inquiry.evidence.compared).blocks();
    let ground = Ground::new(parent, &blocks);
    let has: Vec<&str> = parent.added.iter().map(|n| inquiry.candidates[*n].about.name).collect();
    (0..inquiry.candidates.len())
        .into_par_iter()
        .filter(|number| !has.contains(&inquiry.candidates[*number].about.name))
        .filter_map(|number| screen(inquiry, parent, number, &ground))
        .collect()
}

/// What a signature is compared with: the parent's residual, and the directions its parameters can move it in.
struct Ground {
    scale: DVector<f64>,
    hidden: DMatrix<f64>,
    residual: DVector<f64>,
}

impl Ground {
    /// Channels are brought to the same size first, so that a large misfit in one does not drown another.
    fn new<T>(parent: &Hypothesis<T>, blocks: &[Block]) -> Self {
        let rows = parent.fit.residual.len();
        let mut scale = DVector::from_element(rows, 0.0);
        for misfit in &parent.misfits {
            let size = (misfit.sum_of_squares / misfit.count.max(1) as f64).sqrt();
            for block in blocks.iter().filter(|b| b.channel == misfit.channel) {
                scale.rows_mut(block.range.start, block.range.len()).fill(if size > 0.0 { 1.0 / size } else { 0.0 });
            }
        }
        let mut jacobian = parent.fit.jacobian.clone();
        for mut column in jacobian.column_iter_mut() {
            column.component_mul_assign(&scale);
        }
        let hidden = orthonormal(jacobian);
        let residual = without(&parent.fit.residual.component_mul(&scale), &hidden);
        Self { scale, hidden, residual }
    }
}

/// An orthonormal basis of the columns' span.
fn orthonormal(columns: DMatrix<f64>) -> DMatrix<f64> {
    // Of nothing there is no decomposition to ask for.
    if columns.is_empty() {
        return DMatrix::zeros(columns.nrows(), 0);
    }
    let svd = columns.svd(true, false);
    let largest = svd.singular_values.max();
    let kept: Vec<usize> = (0..svd.singular_values.len()).filter(|k| svd.singular_values[*k] > 1e-9 * largest).collect();
    svd.u.map_or_else(|| DMatrix::zeros(0, 0), |u| u.select_columns(&kept))
}

fn without(v: &DVector<f64>, basis: &DMatrix<f64>) -> DVector<f64> {
    if basis.ncols() == 0 { v.clone() } else { v - basis * basis.tr_mul(v) }
}

fn screen<T: Twin>(inquiry: &Inquiry<'_, T>, parent: &Hypothesis<T>, number: usize, ground: &Ground) -> Option<Screened> {
    let candidate = &inquiry.candidates[number];
    let twin = parent.twin.with(candidate);
    let problem = inquiry.problem(&twin, &inquiry.evidence.compared);
    let mut tried: Vec<(f64, f64, Vec<f64>)> = Vec::new();
    for start in starts(candidate) {
        let theta: Vec<f64> = parent.fit.values.iter().chain(&start).copied().collect();
        let residual = problem.evaluate(&theta, &parent.fit.state, &[]).residual;
        let signature = (&parent.fit.residual - residual).component_mul(&ground.scale);
        let projected = without(&signature, &ground.hidden);
        let (length, whole, misfit) = (projected.norm(), signature.norm(), ground.residual.norm());
        if !(length > 0.0 && length.is_finite() && misfit > 0.0) {
            continue;
        }
        let score = projected.dot(&ground.residual) / (length * misfit);
        // How far along its signature the misfit reaches, as a factor on this start.
        let reach = score * misfit / length;
        tried.push((score, length / whole, start.clone()));
        if let Some(scaled) = scaled(candidate, &start, reach) {
            tried.push((score * 0.999, length / whole, scaled));
        }
    }
    tried.sort_by(|a, b| b.0.total_cmp(&a.0));
    let (score, survival) = tried.first().map(|(score, survival, _)| (*score, *survival))?;
    let starts = tried.into_iter().map(|(_, _, start)| start).collect();
    Some(Screened { number, score, survival, starts })
}

/// All combinations of the starts of a candidate's parameters; before them, where there is one parameter, a tenth of the
/// way to its first start: small enough to tell the direction in which its effect begins.
fn starts(candidate: &Candidate) -> Vec<Vec<f64>> {
    let all = candidate.form.parameters.iter().fold(vec![Vec::new()], |so_far, parameter| {
        let own: Vec<f64> = if parameter.starts.is_empty() { vec![parameter.nominal] } else { parameter.starts.clone() };
        so_far.iter().flat_map(|head| own.iter().map(move |v| head.iter().copied().chain([*v]).collect())).collect()
    });
    let probe = match candidate.form.parameters.as_slice() {
        [p] if p.smooth && p.nominal.is_finite() => {
            p.starts.first().map(|start| vec![p.nominal + 0.1 * (start - p.nominal)])
        }
        _ => None,
    };
    probe.into_iter().chain(all).collect()
}

/// The start moved along its own direction by `factor`, where its law has one parameter and that is of some use.
fn scaled(candidate: &Candidate, start: &[f64], factor: f64) -> Option<Vec<f64>> {
    let [parameter] = candidate.form.parameters.as_slice() else { return None };
    let value = parameter.nominal + factor * (start[0] - parameter.nominal);
    let sensible = value.is_finite() && (0.01..100.0).contains(&factor) && (factor - 1.0).abs() > 0.2;
    (sensible && parameter.smooth).then(|| vec![value.clamp(parameter.lower, parameter.upper)])
}
