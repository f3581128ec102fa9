//! The oracle: a fit that is told the names, and so shows how well any diagnosis could do with these mechanisms.

use std::collections::BTreeMap;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::trial::{Fitted, finite};
use crate::sim2real::diagnose::{Calibration, Comparison, Outcome, calibrate, diagnose};
use crate::sim2real::{Assembly, Candidate, Plant, Recording, Seed, Simulator, Thetas, Trajectory, Twin};

/// What the oracle found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OracleFit {
    /// Root mean square error on the recording to test on, in the first channel's unit.
    pub held_out: f64,
    /// Parameters of each mechanism it was told of, in their order.
    pub parameters: Vec<BTreeMap<String, Fitted>>,
}

/// Starts that are tried of each choice of forms, and of these, those that are followed to their end.
const STARTS: usize = 48;
const FOLLOWED: usize = 2;
/// Fits at the most.
const FITS: usize = 4;

/// An answer of the oracle, before the best is chosen: its squared error on what was fitted, and what it is.
type Attempt = (f64, OracleFit);

/// Fits `twin` with exactly the mechanisms `names`, each in its best form; what fits the recording to learn from best is
/// kept. None where the registry lacks a name; with no names the twin is recalibrated.
///
/// Its error is that of `channel`. It has three ways to go about it: what the diagnosis found, where it named just these; a diagnosis that knows no other
/// names; and where that does not come to all of them, fits from the mechanisms' own starts.
pub(super) fn oracle<P: Plant>(
    twin: &Assembly<P>,
    train: &[Recording<P::Stimulus>],
    test: &[Recording<P::Stimulus>],
    names: &[&str],
    channel: &str,
    diagnosed: &Outcome<Assembly<P>>,
) -> Option<OracleFit> {
    let bare = || calibrate(twin, train, test, Seed(0), &|_, _, _| {});
    if names.is_empty() {
        return Some(OracleFit { held_out: held_out(&bare(), channel), parameters: Vec::new() });
    }
    let known: Vec<String> = twin.registry().iter().map(|row| row.about().name.to_owned()).collect();
    if !names.iter().all(|name| known.iter().any(|known| known == name)) {
        return None;
    }
    let others: Vec<String> = known.into_iter().filter(|known| !names.contains(&known.as_str())).collect();
    let of_these = twin.clone().excluding(&others);
    let told = diagnose(&of_these, train, test, Seed(0), &|_, _, _| {});
    let mut attempts: Vec<Attempt> =
        [diagnosed, &told].into_iter().filter_map(|outcome| as_found(outcome, names, channel)).collect();
    if as_found(&told, names, channel).is_none() {
        attempts.extend(as_fitted(twin, train, test, names, channel, &bare()));
    }
    attempts.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, fit)| fit)
}

/// What a diagnosis found, where it named all of `names` and no other.
fn as_found<P: Plant>(outcome: &Outcome<Assembly<P>>, names: &[&str], channel: &str) -> Option<Attempt> {
    let effects = &outcome.diagnosis.effects;
    let parameters = names.iter().map(|name| {
        let effect = effects.iter().find(|effect| effect.mechanism == *name)?;
        Some(effect.parameters.iter().map(|(name, estimate)| (name.clone(), Fitted::from(estimate))).collect())
    });
    let parameters: Vec<BTreeMap<String, Fitted>> = parameters.collect::<Option<_>>()?;
    let held_out = finite(outcome.diagnosis.fit.iter().find(|fit| fit.channel == channel)?.trued_rmse);
    let exact = effects.len() == names.len();
    exact.then(|| (learnt(&outcome.comparisons, |c| &c.trued), OracleFit { held_out, parameters }))
}

/// Fits from the starts that come nearest before anything is fitted.
fn as_fitted<P: Plant>(
    twin: &Assembly<P>,
    train: &[Recording<P::Stimulus>],
    test: &[Recording<P::Stimulus>],
    names: &[&str],
    channel: &str,
    bare: &Calibration,
) -> Vec<Attempt> {
    let mut starts: Vec<Start<P>> = Vec::new();
    for choice in choices(&twin.candidates(train), names) {
        let with = choice.iter().fold(twin.clone(), |twin, candidate| twin.with(candidate));
        let mut tried = started(&with, &choice, &bare.values, &train[0]);
        tried.sort_by(|a, b| a.0.total_cmp(&b.0));
        starts.extend(tried.into_iter().take(FOLLOWED).map(|(error, values)| (error, with.clone(), choice.clone(), values)));
    }
    starts.sort_by(|a, b| a.0.total_cmp(&b.0));
    let fit = |(_, with, choice, values): Start<P>| {
        let point: Vec<f64> = twin.parameters().iter().map(|p| p.nominal).chain(values).collect();
        let fit = calibrate(&with.with_values(&point), train, test, Seed(0), &|_, _, _| {});
        let mut at = twin.parameters().len();
        let parameters = choice.iter().map(|candidate| {
            let from = at;
            at += candidate.form.parameters.len();
            let fitted = |k: usize| Fitted { value: finite(fit.values[k]), std: Some(fit.std[k]).filter(|s| s.is_finite()) };
            let named = candidate.form.parameters.iter().enumerate();
            named.map(|(k, parameter)| (parameter.name.clone().into_owned(), fitted(from + k))).collect()
        });
        let parameters = parameters.collect();
        (learnt(&fit.comparisons, |c| &c.recalibrated), OracleFit { held_out: held_out(&fit, channel), parameters })
    };
    starts.truncate(FITS);
    starts.into_par_iter().map(fit).collect()
}

/// Error at a start, the twin, its mechanisms and the values of their parameters there.
type Start<P> = (f64, Assembly<P>, Vec<Candidate>, Vec<f64>);

/// All choices of one form for each name; none where a name has none.
fn choices(candidates: &[Candidate], names: &[&str]) -> Vec<Vec<Candidate>> {
    names.iter().fold(vec![Vec::new()], |choices, name| {
        let forms: Vec<&Candidate> = candidates.iter().filter(|candidate| candidate.about.name == *name).collect();
        let with = |choice: &Vec<Candidate>, form: &Candidate| choice.iter().cloned().chain([form.clone()]).collect();
        choices.iter().flat_map(|choice| forms.iter().map(move |form| with(choice, form))).collect()
    })
}

/// Starts of the mechanisms' parameters, each with how far the twin is off there before anything is fitted.
fn started<P: Plant>(
    twin: &Assembly<P>,
    choice: &[Candidate],
    plant: &[f64],
    recording: &Recording<P::Stimulus>,
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
    let error = |run: &Trajectory| -> f64 {
        let channels = recording.measured.iter().filter_map(|measured| {
            let simulated = run.iter().find(|simulated| simulated.channel == measured.channel)?;
            Some(misfit(&measured.samples, &simulated.samples))
        });
        finite(channels.sum())
    };
    runs.iter().zip(points).map(|(run, point)| (error(run), point)).collect()
}

/// Squared error over the mean square of what was measured, so that channels of several units can be added up.
fn misfit(measured: &[Option<f64>], simulated: &[f64]) -> f64 {
    let pairs = measured.iter().zip(simulated).filter_map(|(measured, simulated)| Some(((*measured)?, *simulated)));
    let (errors, squares, count) = pairs.fold((0.0, 0.0, 0.0), |(errors, squares, count), (measured, simulated)| {
        (errors + (measured - simulated).powi(2), squares + measured.powi(2), count + 1.0)
    });
    if squares > 0.0 { count * errors / squares } else { errors }
}

fn held_out(calibration: &Calibration, channel: &str) -> f64 {
    let fit = calibration.fit.iter().find(|fit| fit.channel == channel);
    finite(fit.map_or(f64::INFINITY, |fit| fit.recalibrated_rmse))
}

/// How far all channels are off on what was fitted.
fn learnt(comparisons: &[Comparison], of: impl Fn(&Comparison) -> &Vec<f64>) -> f64 {
    let fitted = comparisons.iter().filter(|comparison| !comparison.held_out);
    finite(fitted.map(|comparison| misfit(&comparison.measured, of(comparison))).sum())
}
