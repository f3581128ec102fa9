//! Aspects: what recordings show that no mechanism has in common, each diagnosed by itself and then told as one.
//!
//! What an order pays, what it is charged and what the mid does after it have no law in common. To look for sets of laws in all of
//! them at once would only multiply the sets.

use std::collections::BTreeSet;

use nalgebra::DMatrix;

use super::diagnosis::{Diagnosis, Effect, Verdict, Where};
use super::words::{self, Facts};
use super::{Answered, Outcome};
use crate::sim2real::{Candidate, Recording, Twin};

/// One aspect of all recordings.
pub(super) struct Aspect<S> {
    pub recordings: Vec<Recording<S>>,
    pub held_out: Vec<Recording<S>>,
}

/// The aspects of `recordings` and of what is held out; none where they show one thing.
pub(super) fn split<T: Twin>(
    twin: &T,
    recordings: &[Recording<T::Stimulus>],
    held_out: &[Recording<T::Stimulus>],
) -> Vec<Aspect<T::Stimulus>> {
    let mut aspects: Vec<Aspect<T::Stimulus>> = Vec::new();
    let mut deal = |all: &[Recording<T::Stimulus>], apart: bool| {
        for recording in all {
            for (k, own) in twin.aspects(recording).into_iter().enumerate() {
                if aspects.len() <= k {
                    aspects.push(Aspect { recordings: Vec::new(), held_out: Vec::new() });
                }
                let aspect = &mut aspects[k];
                if apart { &mut aspect.held_out } else { &mut aspect.recordings }.push(own);
            }
        }
    };
    deal(recordings, false);
    deal(held_out, true);
    // Where recordings for proof are given, what only they show cannot be learnt, nor what they do not show be proved by them.
    aspects.retain_mut(|aspect| {
        let shows = |recording: &Recording<T::Stimulus>| !recording.measured.is_empty();
        aspect.recordings.retain(shows);
        aspect.held_out.retain(shows);
        !aspect.recordings.is_empty() && (held_out.is_empty() || !aspect.held_out.is_empty())
    });
    aspects
}

/// One answer of those to all aspects.
pub(super) fn joined<T: Twin>(twin: &T, mut first: Answered<T>, mut others: Vec<Answered<T>>) -> Outcome<T> {
    let diagnosis = |answer: &Answered<T>| answer.outcome.diagnosis.clone();
    let said: Vec<Diagnosis> = std::iter::once(&first).chain(&others).map(diagnosis).collect();
    let verdict = verdict(&said);
    let mut unproved = Vec::new();
    if verdict != Verdict::NotExcited {
        let all = std::iter::once(&mut first).chain(&mut others);
        unproved.extend(all.filter_map(|answer| withdrawn(twin, answer)));
    }
    let (trued, values, std, correlation) = twins(twin, &std::iter::once(&first).chain(&others).collect::<Vec<_>>());
    let Answered { outcome: mut whole, mut facts, .. } = first;
    for Answered { outcome, facts: more, .. } in others {
        whole.comparisons.extend(outcome.comparisons);
        whole.profiles.extend(outcome.profiles);
        whole.excitation = whole.excitation.or(outcome.excitation);
        join(&mut whole.diagnosis, outcome.diagnosis);
        join_facts(&mut facts, more);
    }
    facts.remainder = remainder(&said, verdict);
    whole.diagnosis.checks.remainder = facts.remainder;
    finish(&mut whole.diagnosis, &facts, verdict);
    whole.diagnosis.checks.notes.extend(unproved);
    Outcome { trued, values, std, correlation, ..whole }
}

/// Whether an aspect says that something is missing.
fn speaks(diagnosis: &Diagnosis) -> bool {
    diagnosis.verdict == Verdict::Unexplained || !diagnosis.effects.is_empty()
}

/// What all aspects say together: what one of them does not explain is not explained, and what one is silent about another may tell.
fn verdict(diagnoses: &[Diagnosis]) -> Verdict {
    let said: Vec<Verdict> = diagnoses.iter().filter(|d| speaks(d)).map(|d| d.verdict).collect();
    let order = [Verdict::Unexplained, Verdict::Ambiguous, Verdict::Named, Verdict::NotExcited];
    let loudest = order.into_iter().find(|verdict| said.contains(verdict));
    loudest.unwrap_or_else(|| diagnoses.first().map(|d| d.verdict).unwrap_or(Verdict::NoMismatch))
}

/// The part of the misfit that is left: the largest of the aspects that are not explained, or else that of the first in which something is
/// found. Of a mid, which does most of what it does of itself, much is left whatever is found.
fn remainder(diagnoses: &[Diagnosis], verdict: Verdict) -> f64 {
    let left = |d: &Diagnosis| d.checks.remainder;
    let unexplained = diagnoses.iter().filter(|d| d.verdict == Verdict::Unexplained).map(left).reduce(f64::max);
    let found = || diagnoses.iter().find(|d| !d.effects.is_empty()).or(diagnoses.first()).map_or(0.0, left);
    unexplained.filter(|_| verdict == Verdict::Unexplained).unwrap_or_else(found)
}

/// Takes back what an aspect has found that does not hold on data it has not seen; gives what is to be said of it.
fn withdrawn<T: Twin>(twin: &T, answer: &mut Answered<T>) -> Option<String> {
    let Outcome { diagnosis, trued, values, std, correlation, comparisons, .. } = &mut answer.outcome;
    if diagnosis.verdict != Verdict::NotExcited || diagnosis.effects.is_empty() {
        return None;
    }
    let said = std::mem::take(&mut diagnosis.summary);
    diagnosis.effects.clear();
    answer.added.clear();
    *trued = twin.clone();
    values.truncate(twin.parameters().len());
    std.truncate(twin.parameters().len());
    let own = twin.parameters().len();
    *correlation = correlation.view((0, 0), (own, own)).into_owned();
    for comparison in comparisons {
        comparison.trued.clone_from(&comparison.recalibrated);
    }
    for error in &mut diagnosis.location.recordings {
        error.trued_rmse = error.recalibrated_rmse;
    }
    for fit in &mut diagnosis.fit {
        (fit.trued_rmse, fit.trued_mae) = (fit.recalibrated_rmse, fit.recalibrated_mae);
        fit.improvement_ci95 = [0.0; 2];
    }
    Some(said)
}

/// The twin with what was found in all aspects, its parameters, their standard deviations and correlations: its own as the aspect
/// knows them that knows them best. What two aspects tell is not correlated.
fn twins<T: Twin>(twin: &T, answers: &[&Answered<T>]) -> (T, Vec<f64>, Vec<f64>, DMatrix<f64>) {
    let own = twin.parameters().len();
    let best = |k: usize| {
        let all = answers.iter().enumerate();
        all.min_by(|(_, a), (_, b)| a.outcome.std[k].total_cmp(&b.outcome.std[k])).map_or(0, |(number, _)| number)
    };
    // Which answer tells each parameter, and its number there.
    let mut told: Vec<(usize, usize)> = (0..own).map(|k| (best(k), k)).collect();
    let mut trued = twin.clone();
    let mut taken: Vec<&str> = Vec::new();
    for (number, answer) in answers.iter().enumerate() {
        let mut at = own;
        for candidate in &answer.added {
            let Candidate { about, form, .. } = candidate;
            let rows = at..at + form.parameters.len();
            at = rows.end;
            if taken.contains(&about.name) {
                continue;
            }
            taken.push(about.name);
            trued = trued.with(candidate);
            told.extend(rows.map(|row| (number, row)));
        }
    }
    let outcome = |number: usize| &answers[number].outcome;
    let values = told.iter().map(|(number, k)| outcome(*number).values[*k]).collect();
    let std = told.iter().map(|(number, k)| outcome(*number).std[*k]).collect();
    let correlation = DMatrix::from_fn(told.len(), told.len(), |i, j| match (told[i], told[j]) {
        ((of, k), (other, l)) if of == other => outcome(of).correlation[(k, l)],
        _ => 0.0,
    });
    (trued, values, std, correlation)
}

/// What is told of all aspects together once all are joined.
fn finish(whole: &mut Diagnosis, facts: &Facts, verdict: Verdict) {
    whole.verdict = verdict;
    whole.checks.tried = facts.mechanisms();
    // What no aspect moves the data cannot tell of.
    let scores = &whole.scores;
    whole.checks.not_excited.retain(|id| !scores.iter().any(|score| score.mechanism == *id && score.excited));
    whole.checks.not_excited.sort();
    whole.checks.not_excited.dedup();
    let mut told = BTreeSet::new();
    whole.checks.notes.retain(|note| told.insert(note.clone()));
    let mut named = BTreeSet::new();
    whole.effects.retain(|effect: &Effect| named.insert(effect.mechanism.clone()));
    whole.effects.sort_by(|a, b| b.confidence.total_cmp(&a.confidence));
    whole.summary = words::summary(facts, verdict, &whole.effects);
}

fn join_facts(facts: &mut Facts, more: Facts) {
    facts.tried.extend(more.tried);
    facts.fits.extend(more.fits);
    facts.contradiction = facts.contradiction.take().or(more.contradiction);
    facts.dependence = match (facts.dependence.take(), more.dependence) {
        (Some(own), Some(other)) if other.strength > own.strength => Some(other),
        (own, other) => own.or(other),
    };
}

fn join(whole: &mut Diagnosis, other: Diagnosis) {
    let Where { intervals, onset, changes, against, columns, recordings } = other.location;
    whole.location.recordings.extend(recordings);
    whole.location.intervals.extend(intervals);
    whole.location.intervals.sort_by(|a, b| b.share_of_error.total_cmp(&a.share_of_error));
    whole.location.onset = whole.location.onset.or(onset);
    whole.location.changes.extend(changes);
    whole.location.against.extend(against);
    whole.location.columns.extend(columns);
    for (name, change) in other.parameters {
        let better = whole.parameters.get(&name).is_none_or(|own| change.std < own.std);
        if better {
            whole.parameters.insert(name, change);
        }
    }
    whole.effects.extend(other.effects);
    whole.fit.extend(other.fit);
    whole.scores.extend(other.scores);
    let (checks, more) = (&mut whole.checks, other.checks);
    checks.adequacy = checks.adequacy.max(more.adequacy);
    checks.placebo_p = [checks.placebo_p, more.placebo_p].into_iter().flatten().reduce(f64::max);
    checks.at_bound.extend(more.at_bound);
    checks.not_excited.extend(more.not_excited);
    checks.notes.extend(more.notes);
    whole.next_experiment = whole.next_experiment.take().or(other.next_experiment);
}
