//! What is a matter of how a recording was made: no name stands for it, and without it everything else is told wrongly.

use super::diagnosis::Verdict;
use super::hypothesis::{Hypothesis, Inquiry};
use super::whiteness::ChannelMisfit;
use super::words::figure;
use super::{Answered, weigh};
use crate::sim2real::identify::Effort;
use crate::sim2real::{Candidate, Recording, Twin};

/// Evidence above this [twice a log-likelihood] decides.
const DECISIVE: f64 = 10.0;
/// The record is to blame only where that takes away so much of what is left above the noise: a law of another form, or an effect that
/// nobody knows, leaves more than a shift of the clock.
const MOST_OF_IT: f64 = 0.5;

/// What of the record the recordings ask for beside what was `selected`, if anything.
pub(super) fn asked_for<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    selected: &Hypothesis<T>,
    recordings: &[Recording<T::Stimulus>],
) -> Option<Candidate> {
    if !selected.leaves_something() {
        return None;
    }
    let fitted = |candidate: &Candidate| {
        let starts = candidate.form.parameters.iter().map(|p| p.starts.first().copied().unwrap_or(p.nominal));
        let values: Vec<f64> = selected.fit.values.iter().copied().chain(starts).collect();
        let twin = selected.twin.with(candidate);
        inquiry.begun(twin, selected.added.clone(), &values, Some(&selected.fit.state), Effort::Thorough)
    };
    let above = |h: &Hypothesis<T>| h.misfits.iter().map(|m: &ChannelMisfit| m.above(1.0)).sum::<f64>();
    inquiry.twin.of_the_record(recordings).into_iter().find(|candidate| {
        let with = fitted(candidate);
        above(&with) <= (1.0 - MOST_OF_IT) * above(selected) && weigh::gain(inquiry, selected, &with) > DECISIVE
    })
}

/// The answer that takes `candidate` for a part of the record, where that explains the recordings after all.
pub(super) fn better<T: Twin>(as_stamped: Answered<T>, mut corrected: Answered<T>, candidate: &Candidate) -> Answered<T> {
    if corrected.outcome.diagnosis.verdict == Verdict::Unexplained {
        return as_stamped;
    }
    let diagnosis = &mut corrected.outcome.diagnosis;
    for parameter in &candidate.form.parameters {
        let Some(found) = diagnosis.parameters.get(parameter.name.as_ref()) else { continue };
        diagnosis.checks.notes.push(format!(
            "a matter of the record, not of the {}: {} ({} {} {})",
            corrected.facts.name,
            candidate.about.title,
            parameter.name,
            figure(found.value, 3),
            found.unit
        ));
    }
    corrected
}
