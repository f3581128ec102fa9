//! The words for a verdict.

use super::diagnosis::{Effect, NextExperiment, Verdict};
use super::hypothesis::Inquiry;
use super::verdict::Findings;
use crate::sim2real::Twin;

/// What to record next, where rivals are left.
pub(super) fn next_experiment(verdict: Verdict, effects: &[Effect]) -> Option<NextExperiment> {
    let rival = effects.iter().find(|e| !e.rivals.is_empty() && verdict == Verdict::Ambiguous)?;
    let others: Vec<&str> = rival.rivals.iter().map(|r| r.mechanism.as_str()).collect();
    Some(NextExperiment {
        what: format!(
            "record with other amplitudes and frequencies, so that {} and {} no longer look alike",
            rival.mechanism,
            others.join(", ")
        ),
    })
}

/// The answer, in one sentence.
pub(super) fn summary<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    verdict: Verdict,
    effects: &[Effect],
    findings: &Findings,
) -> String {
    let title = |id: &str| {
        inquiry.candidates.iter().find(|c| c.about.name == id).map_or_else(|| id.to_owned(), |c| c.about.title.to_owned())
    };
    let names = listed(&effects.iter().map(|e| title(&e.mechanism)).collect::<Vec<_>>());
    let name = inquiry.twin.name();
    // The first channel is the one a twin is about; others speak where it gained nothing.
    let best = findings.fits.iter().find(|f| f.improvement_ci95[0] > 0.0).or(findings.fits.first());
    let gained = best.map_or_else(String::new, |f| {
        format!(
            "the held-out error of {} falls from {} to {} {} (noise floor {})",
            f.channel,
            figure(f.recalibrated_rmse),
            figure(f.trued_rmse),
            f.unit,
            figure(f.noise_floor)
        )
    });
    match verdict {
        Verdict::Named => format!("The {name} leaves out {names}: with that modelled, {gained}."),
        Verdict::Ambiguous => {
            let rivals: Vec<String> = effects.iter().flat_map(|e| e.rivals.iter()).map(|r| title(&r.mechanism)).collect();
            format!("The {name} leaves out {names}, or {} instead: these data do not tell; {gained}.", listed(&rivals))
        }
        Verdict::NoMismatch => format!(
            "The {name} explains the recordings once its own parameters are refitted: nothing is missing that these data show."
        ),
        Verdict::NotExcited if effects.is_empty() => {
            format!("The {name} does not explain the recordings, and they are too few to tell what is missing: record more.")
        }
        Verdict::NotExcited => format!(
            "{names} would explain the fitted data but not those held out: these recordings do not move the {name} enough to tell."
        ),
        Verdict::Unexplained if effects.is_empty() => format!(
            "Something is missing from the {name} that none of the {} known mechanisms explains{}.",
            inquiry.candidates.len(),
            shape(findings)
        ),
        Verdict::Unexplained => format!(
            "Something is missing from the {name} that no known mechanism explains: {names} takes part of it, {:.0} % of the misfit is left{}.",
            100.0 * findings.remainder,
            shape(findings)
        ),
    }
}

/// A number to three digits, as a sentence bears it.
fn figure(value: f64) -> String {
    let magnitude = value.abs().log10().floor();
    if value == 0.0 || !(-4.0..6.0).contains(&magnitude) {
        return if value == 0.0 { "0".to_owned() } else { format!("{value:.2e}") };
    }
    format!("{value:.*}", (2.0 - magnitude).max(0.0) as usize)
}

fn shape(findings: &Findings) -> String {
    findings.dependence.as_ref().map_or_else(String::new, |d| format!("; what is left depends on the {}", d.on))
}

fn listed(names: &[String]) -> String {
    match names {
        [] => "nothing".to_owned(),
        [one] => one.clone(),
        [rest @ .., last] => format!("{} and {last}", rest.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_have_three_digits() {
        let figures = [0.0648, 0.00425, 3.588, 59.75, 14_233.0, 0.0, 2.66e-8].map(figure);
        assert_eq!(figures, ["0.0648", "0.00425", "3.59", "59.8", "14233", "0", "2.66e-8"]);
    }
}
