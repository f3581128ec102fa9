//! Judging: a selection proved on held-out data, what is found of it, and the verdict.

use super::decision::Findings;
use super::diagnosis::{Diagnosis, Verdict};
use super::findings::findings;
use super::hypothesis::Inquiry;
use super::locate::Covariates;
use super::prove::{Contest, compared};
use super::rivals::Place;
use super::selection::Selection;
use super::{Comparison, verdict, words};
use crate::sim2real::any_twin::{AnyStimulus, AnyTwin};
use crate::sim2real::identify::Fit;
use crate::sim2real::{Recording, Simulator};

/// What is to be said of a selection, and what that rests on.
pub(super) struct Judged {
    pub comparisons: Vec<Comparison>,
    /// The fit of what was selected in free run.
    pub trued: Fit,
    pub findings: Findings,
    pub diagnosis: Diagnosis,
}

/// Judges `selection`, of which `places` are the rivals, and which was found in `recordings`.
pub(super) fn judged(
    inquiry: &Inquiry<'_, AnyTwin>,
    selection: &Selection<AnyTwin>,
    places: &[Place],
    recordings: &[Recording<AnyStimulus>],
    covariates: &Covariates,
) -> Judged {
    let in_free_run = |hypothesis| inquiry.in_free_run(hypothesis);
    let (recalibrated, trued) = rayon::join(|| in_free_run(&selection.recalibrated), || in_free_run(&selection.selected));
    let given: Vec<f64> = inquiry.twin.parameters().iter().map(|p| p.nominal).collect();
    let contest = Contest {
        nominal: (inquiry.twin, &given),
        recalibrated: (inquiry.twin, &recalibrated.values),
        trued: (&selection.selected.twin, &trued.values),
    };
    let comparisons = compared(&contest, inquiry.evidence, inquiry.seed);
    let findings = findings(inquiry, selection, recordings, (&comparisons, &trued), covariates);
    let diagnosis = verdict::diagnosis(inquiry, selection, places, &findings);
    Judged { comparisons, trued, findings, diagnosis }
}

impl Judged {
    /// Whether what was named explains the fitted rows alone.
    pub fn of_fitted_rows_alone(&self) -> bool {
        self.diagnosis.verdict == Verdict::NotExcited && !self.diagnosis.effects.is_empty()
    }

    /// What is to be noted of that where it is not named.
    pub fn unconfirmed(&self, inquiry: &Inquiry<'_, AnyTwin>) -> String {
        words::summary(&verdict::facts(inquiry, &self.findings), self.diagnosis.verdict, &self.diagnosis.effects)
    }
}
