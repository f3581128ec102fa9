//! The oracle: a fit that is told the names, and so shows how well any diagnosis could do with these mechanisms.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::trial::{Fitted, finite};
use crate::robot::{Commands, Joint};
use crate::sim2real::diagnose::{Calibration, calibrate};
use crate::sim2real::{Assembly, Candidate, Recording, Seed, Simulator, Thetas, Twin};

/// What the oracle found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OracleFit {
    /// Root mean square error on the recording to test on [rad].
    pub held_out: f64,
    /// Parameters of each mechanism it was told of, in their order.
    pub parameters: Vec<BTreeMap<String, Fitted>>,
}

/// Starts that are tried of each choice of forms, and of these, those that are followed to their end.
const STARTS: usize = 48;
const FOLLOWED: usize = 2;
/// Fits at the most.
const FITS: usize = 6;

/// Fits `twin` with exactly the mechanisms `names`, each in its best form, from several starts; what fits the recording to
/// learn from best is kept. None where the registry lacks a name; with no names the twin is recalibrated.
pub(super) fn oracle(
    twin: &Assembly<Joint>,
    train: &[Recording<Commands>],
    test: &[Recording<Commands>],
    names: &[&str],
) -> Option<OracleFit> {
    let run = |twin: &Assembly<Joint>| calibrate(twin, train, test, Seed(0), &|_, _, _| {});
    let bare = run(twin);
    if names.is_empty() {
        return Some(OracleFit { held_out: held_out(&bare), parameters: Vec::new() });
    }
    let mut starts: Vec<Start> = Vec::new();
    for choice in choices(&twin.candidates(train), names) {
        let with = choice.iter().fold(twin.clone(), |twin, candidate| twin.with(candidate));
        let mut tried = started(&with, &choice, &bare.values, &train[0]);
        tried.sort_by(|a, b| a.0.total_cmp(&b.0));
        starts.extend(tried.into_iter().take(FOLLOWED).map(|(error, values)| (error, with.clone(), choice.clone(), values)));
    }
    starts.sort_by(|a, b| a.0.total_cmp(&b.0));
    let own = twin.parameters().len();
    let fits = starts.into_iter().take(FITS).map(|(_, with, choice, values)| {
        let nominal: Vec<f64> = twin.parameters().iter().map(|p| p.nominal).chain(values).collect();
        (run(&with.with_values(&nominal)), choice)
    });
    let (best, choice) = fits.min_by(|a, b| learnt(&a.0).total_cmp(&learnt(&b.0)))?;
    let mut at = own;
    let parameters = choice.iter().map(|candidate| {
        let from = at;
        at += candidate.form.parameters.len();
        let fitted = |k: usize| Fitted { value: finite(best.values[k]), std: Some(best.std[k]).filter(|s| s.is_finite()) };
        candidate.form.parameters.iter().enumerate().map(|(k, p)| (p.name.clone().into_owned(), fitted(from + k))).collect()
    });
    Some(OracleFit { parameters: parameters.collect(), held_out: held_out(&best) })
}

/// Error at a start, the twin, its mechanisms and the values of their parameters there.
type Start = (f64, Assembly<Joint>, Vec<Candidate>, Vec<f64>);

/// All choices of one form for each name; none where a name has none.
fn choices(candidates: &[Candidate], names: &[&str]) -> Vec<Vec<Candidate>> {
    names.iter().fold(vec![Vec::new()], |choices, name| {
        let forms: Vec<&Candidate> = candidates.iter().filter(|candidate| candidate.about.name == *name).collect();
        let with = |choice: &Vec<Candidate>, form: &Candidate| choice.iter().cloned().chain([form.clone()]).collect();
        choices.iter().flat_map(|choice| forms.iter().map(move |form| with(choice, form))).collect()
    })
}

/// Starts of the mechanisms' parameters, each with how far the twin is off there before anything is fitted.
fn started(
    twin: &Assembly<Joint>,
    choice: &[Candidate],
    plant: &[f64],
    recording: &Recording<Commands>,
) -> Vec<(f64, Vec<f64>)> {
    let mut points: Vec<Vec<f64>> = vec![Vec::new()];
    for parameter in choice.iter().flat_map(|candidate| &candidate.form.parameters) {
        let values = if parameter.starts.is_empty() { vec![parameter.nominal] } else { parameter.starts.clone() };
        points = points.iter().flat_map(|point| values.iter().map(move |v| [point.clone(), vec![*v]].concat())).collect();
        // Evenly thinned, so that no parameter keeps its first starts alone.
        let step = points.len().div_ceil(STARTS);
        points = points.into_iter().step_by(step.max(1)).collect();
    }
    let initial: Vec<f64> = twin.initial_parameters(recording, 0).iter().map(|p| p.nominal).collect();
    let lanes: Vec<Vec<f64>> = points.iter().map(|point| [plant, point, &initial].concat()).collect();
    let runs = twin.rollout(&Thetas::from_lanes(&lanes), recording, 0..recording.len(), Seed(0));
    let measured = recording.measured.first().map(|measured| measured.samples.as_slice()).unwrap_or_default();
    let error = |run: &[f64]| -> f64 {
        let squares = run.iter().zip(measured).filter_map(|(run, measured)| Some((run - (*measured)?).powi(2)));
        finite(squares.sum())
    };
    runs.iter().zip(points).filter_map(|(run, point)| Some((error(&run.first()?.samples), point))).collect()
}

fn held_out(calibration: &Calibration) -> f64 {
    finite(calibration.fit.first().map_or(f64::INFINITY, |fit| fit.recalibrated_rmse))
}

/// Squared error on what was fitted.
fn learnt(calibration: &Calibration) -> f64 {
    let fitted = calibration.comparisons.iter().filter(|comparison| !comparison.held_out);
    let squares = fitted.flat_map(|comparison| {
        let pairs = comparison.measured.iter().zip(&comparison.recalibrated);
        pairs.filter_map(|(measured, simulated)| Some(((*measured)? - simulated).powi(2)))
    });
    finite(squares.sum())
}
