//! What is found, with its parameters, how sure it is and what else it could be.

use super::Found;
use super::confidence::{Doubts, by_evidence, calibrated};
use super::decision::Findings;
use super::diagnosis::{Effect, Estimate, Rival};
use super::held_out::held_out_remainder;
use super::hypothesis::{Hypothesis, Inquiry};
use super::rivals::Place;
use super::weigh::plausibility;
use crate::sim2real::{Candidate, Parameter, Twin};

/// Confidence in what needs no fit to be seen.
const CERTAIN_BY_SIGHT: f64 = 0.99;
/// A mechanism that changes the residuals by less than this, in noise and over all rows, does nothing. Where they are smaller than the
/// noise, as those of prices that are rounded to ticks may be, it is in their own size.
const DISTINCT: f64 = 5.0;

/// A parameter further than this from where it does nothing, in its scale, does something.
const AWAY: f64 = 1e-2;

/// What was selected, the surest first.
pub(super) fn fitted<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    selected: &Hypothesis<T>,
    places: &[Place],
    findings: &Findings,
) -> Vec<Effect> {
    let mut at = inquiry.twin.parameters().len();
    let unseen = findings.fits.iter().map(held_out_remainder).fold(0.0, f64::max);
    let implausibility = -plausibility(inquiry, &findings.trued.values);
    let fitted = selected.added.iter().filter(|number| !inquiry.candidates[**number].finishing).count();
    let mut effects: Vec<Effect> = Vec::new();
    for (number, place) in selected.added.iter().zip(places) {
        let candidate = &inquiry.candidates[*number];
        let (confidence, others) = match candidate.finishing {
            // Steps are seen; that they fit is no more than a check.
            true => (CERTAIN_BY_SIGHT, Vec::new()),
            false if findings.sampled => {
                let at_edge = at_edge(&candidate.form.parameters, at, findings);
                let others = fitted.saturating_sub(1);
                calibrated(place, &Doubts { remainder: unseen, others, at_edge, implausibility })
            }
            false => by_evidence(place),
        };
        let parameters = candidate
            .form
            .parameters
            .iter()
            .enumerate()
            .map(|(k, p)| {
                let (value, std) = (findings.trued.values[at + k], findings.std[at + k]);
                (p.name.clone().into_owned(), Estimate { value, std, unit: inquiry.twin.unit(&p.unit) })
            })
            .collect();
        at += candidate.form.parameters.len();
        let mut rivals: Vec<Rival> = Vec::new();
        for ((other, _), confidence) in place.others.iter().zip(others) {
            let mechanism = inquiry.candidates[*other].about.name.to_owned();
            match rivals.iter_mut().find(|r| r.mechanism == mechanism) {
                Some(rival) => rival.confidence += confidence,
                None => rivals.push(Rival { mechanism, confidence }),
            }
        }
        rivals.sort_by(|a, b| b.confidence.total_cmp(&a.confidence));
        effects.push(Effect {
            mechanism: candidate.about.name.to_owned(),
            site: candidate.about.site,
            confidence,
            gain: Some(place.gain),
            margin: place.nearest,
            parameters,
            rivals,
            location: None,
            active: Vec::new(),
            moved: Vec::new(),
        });
    }
    effects.sort_by(|a, b| b.confidence.total_cmp(&a.confidence));
    effects
}

/// Number of a law's `parameters`, the first of which is the twin's `from`-th, that ran to the edge of what they may be. A bound at
/// which a parameter does nothing is no edge: there the law is a simpler one.
fn at_edge(parameters: &[Parameter], from: usize, findings: &Findings) -> usize {
    let of = |k: &usize| parameters.get(k.checked_sub(from)?).map(|p| (p, findings.trued.values[*k]));
    let nailed = findings.trued.at_bound.iter().filter_map(of);
    let away = |value: f64, from: f64, p: &Parameter| (value - from).abs() > AWAY * p.scale();
    nailed.filter(|(p, value)| away(*value, p.nominal, p) && away(*value, 0.0, p)).count()
}

/// What a sign in the recordings shows without a fit.
pub(super) fn seen<T: Twin>(inquiry: &Inquiry<'_, T>, found: &Found<'_>, candidate: &Candidate) -> Effect {
    let Found { signs, of_steps, lost, .. } = found;
    let losses = !of_steps.iter().any(|other| other.about.name == candidate.about.name);
    Effect {
        mechanism: candidate.about.name.to_owned(),
        site: candidate.about.site,
        confidence: CERTAIN_BY_SIGHT,
        gain: None,
        margin: None,
        parameters: candidate
            .form
            .parameters
            .iter()
            .map(|p| {
                let estimate = Estimate { value: p.nominal, std: 0.0, unit: inquiry.twin.unit(&p.unit) };
                (p.name.clone().into_owned(), estimate)
            })
            .collect(),
        rivals: Vec::new(),
        location: losses.then(|| format!("at times: {:.1} % of the rows", 100.0 * signs.repeated)),
        active: if losses { lost.clone() } else { Vec::new() },
        moved: Vec::new(),
    }
}

/// Whether every mechanism found does something: with its parameters put back to where they do nothing, and all others left
/// as they are, residuals must change. A fit may be helped out of a wrong place by a mechanism that then does nothing.
pub(super) fn distinct<T: Twin>(inquiry: &Inquiry<'_, T>, selected: &Hypothesis<T>) -> bool {
    let problem = inquiry.problem(&selected.twin, &inquiry.evidence.compared);
    let fit = &selected.fit;
    let residual = |values: &[f64]| problem.evaluate(values, &fit.state, &[]).residual;
    let with = residual(&fit.values);
    let size = (with.norm_squared() / with.len().max(1) as f64).sqrt().min(1.0);
    let mut at = inquiry.twin.parameters().len();
    selected.added.iter().all(|number| {
        let candidate = &inquiry.candidates[*number];
        let (from, count) = (at, candidate.form.parameters.len());
        at += count;
        let mut values = fit.values.clone();
        for (value, p) in values[from..from + count].iter_mut().zip(&candidate.form.parameters) {
            *value = p.nominal;
        }
        candidate.finishing || (&with - residual(&values)).norm() >= DISTINCT * size
    })
}
