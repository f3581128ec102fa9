//! The words for a verdict.

use std::collections::BTreeSet;

use super::diagnosis::{ChannelFit, Effect, Verdict};
use super::structure::Dependence;

/// What the words for a verdict are made of, beside the effects.
#[derive(Debug, Clone)]
pub(super) struct Facts {
    /// Name of the twin's simulator.
    pub name: String,
    /// Id and title of every mechanism that was tried, each form once.
    pub tried: Vec<(&'static str, &'static str)>,
    /// Errors per channel.
    pub fits: Vec<ChannelFit>,
    /// Whether fewer rows were fitted than can tell anything.
    pub few: bool,
    /// The part of the misfit that is left.
    pub remainder: f64,
    /// What that depends on.
    pub dependence: Option<Dependence>,
    /// What the recordings say against what they are taken to have begun with, or held-out ones against what was named.
    pub contradiction: Option<String>,
}

impl Facts {
    /// How many mechanisms were tried, in however many forms.
    pub fn mechanisms(&self) -> usize {
        self.tried.iter().map(|(id, _)| id).collect::<BTreeSet<_>>().len()
    }
}

/// The answer, in one sentence.
pub(super) fn summary(facts: &Facts, verdict: Verdict, effects: &[Effect]) -> String {
    let title = |id: &str| {
        let own = facts.tried.iter().find(|(name, _)| *name == id);
        own.map_or_else(|| id.to_owned(), |(_, title)| (*title).to_owned())
    };
    let names = listed(&effects.iter().map(|e| title(&e.mechanism)).collect::<Vec<_>>());
    let name = &facts.name;
    // The first channel is the one a twin is about; others speak where it gained nothing to speak of.
    let better = |fit: &&ChannelFit| fit.trued_rmse < fit.recalibrated_rmse;
    let gains = |least: f64| facts.fits.iter().find(|f| f.improvement_ci95[0] > least);
    let best = gains(TO_SPEAK_OF).or(gains(0.0)).or(facts.fits.iter().find(better)).or(facts.fits.first());
    let gained = best.map_or_else(String::new, gained);
    match verdict {
        Verdict::Named => {
            let sure: Vec<String> = effects.iter().map(|e| percent(e.confidence)).collect();
            let alike = sure.iter().all(|s| *s == sure[0]);
            let found = match sure.first() {
                Some(first) if alike => format!("{names} ({}{first} sure)", if sure.len() > 1 { "each " } else { "" }),
                _ => {
                    let each = effects.iter().zip(&sure).map(|(e, sure)| format!("{} ({sure} sure)", title(&e.mechanism)));
                    listed(&each.collect::<Vec<_>>())
                }
            };
            format!("The {name} leaves out {found}: with that modelled, {gained}.")
        }
        Verdict::Ambiguous => {
            let sure = effects.iter().map(|e| {
                let rivals: Vec<String> =
                    e.rivals.iter().map(|r| format!("{} ({})", title(&r.mechanism), percent(r.confidence))).collect();
                let or = if rivals.is_empty() { String::new() } else { format!(" or {}", rivals.join(" or ")) };
                format!("{} ({}){or}", title(&e.mechanism), percent(e.confidence))
            });
            let all = listed(&sure.collect::<Vec<_>>());
            format!("The {name} leaves out {all}: these data do not tell for sure; with the first modelled, {gained}.")
        }
        Verdict::NoMismatch => format!(
            "The {name} explains the recordings once its own parameters are refitted: nothing is missing that these data show."
        ),
        Verdict::NotExcited if effects.is_empty() && !facts.few => format!(
            "The {name} explains what was fitted and not what was held out: the fitted recordings do not move it enough to tell what that \
             takes. Fit some that move it as far, as fast and as long."
        ),
        Verdict::NotExcited if effects.is_empty() => {
            format!("The {name} does not explain the recordings, and they are too few to tell what is missing: record more.")
        }
        Verdict::NotExcited => format!(
            "{names} would explain the fitted data but not those held out: these recordings do not move the {name} enough to tell."
        ),
        Verdict::Unexplained if effects.is_empty() => format!(
            "Something is missing from the {name} that none of the {} known mechanisms explains{}.",
            facts.mechanisms(),
            shape(facts)
        ),
        Verdict::Unexplained => {
            let part = part_of_it(facts, effects.len() > 1);
            format!("Something is missing from the {name} that no known mechanism explains: {names} {part}{}.", shape(facts))
        }
    }
}

/// A part of an error that is worth a sentence.
const TO_SPEAK_OF: f64 = 0.01;

/// What of something unknown one or `several` names stand for. Where hardly anything of the fitted misfit is left, held-out data speak
/// against them.
fn part_of_it(facts: &Facts, several: bool) -> String {
    let [takes, goes, is] = if several { ["take", "go", "are"] } else { ["takes", "goes", "is"] };
    if facts.remainder >= 1.0 {
        return format!("{goes} with part of it, and {is} not what it is");
    }
    let left = percent(facts.remainder);
    let away = |fit: &&ChannelFit| !fit.trued_rmse.is_finite() || fit.trued_rmse > STILL_OFF * fit.noise_floor;
    let off = facts.fits.iter().filter(|_| facts.remainder < HARDLY_ANYTHING).find(away);
    match off {
        None => format!("{takes} part of it, {left} of the misfit is left"),
        Some(fit) => {
            let [after, noise] = [fit.trued_rmse, fit.noise_floor].map(|e| figure(e, 3));
            let (channel, unit) = (&fit.channel, &fit.unit);
            let held_out = match fit.trued_rmse.is_finite() {
                true => format!("{channel} is off by {after} {unit} where it was not (noise floor {noise})"),
                false => format!("the held-out run of {channel} leaves all bounds"),
            };
            format!("{takes} part of it, {left} of the misfit is left where it was fitted, and {held_out}")
        }
    }
}

/// So little of the misfit left is none of the reasons not to believe a name ...
const HARDLY_ANYTHING: f64 = 0.1;
/// ... and so many times the noise on held-out data is one.
const STILL_OFF: f64 = 1.5;

/// By how much the held-out error of a channel falls. A run that leaves all bounds has no error that could be told.
fn gained(fit: &ChannelFit) -> String {
    let [before, after, noise] = [fit.recalibrated_rmse, fit.trued_rmse, fit.noise_floor].map(|e| figure(e, 3));
    let (channel, unit) = (&fit.channel, &fit.unit);
    match [fit.recalibrated_rmse, fit.trued_rmse].map(f64::is_finite) {
        [true, true] => {
            let part = 1.0 - fit.trued_rmse / fit.recalibrated_rmse;
            let by = if part.is_finite() && part > 0.0 { format!(" by {}", percent(part)) } else { String::new() };
            let moves = if part >= 0.0 { "falls" } else { "goes" };
            format!("the held-out error of {channel} {moves}{by}, from {before} to {after} {unit} (noise floor {noise})")
        }
        [false, true] => {
            format!(
                "the held-out error of {channel} is {after} {unit} (noise floor {noise}); without, the run leaves all bounds"
            )
        }
        [true, false] => {
            format!(
                "the held-out run of {channel} leaves all bounds; without, its error is {before} {unit} (noise floor {noise})"
            )
        }
        [false, false] => format!("the held-out run of {channel} leaves all bounds, as it does without"),
    }
}

/// A part of one; nothing is certain, and .2 % is not nothing.
fn percent(part: f64) -> String {
    match 100.0 * part {
        p if p > 99.0 => "more than 99 %".to_owned(),
        p if p > 0.0 && p < 1.0 => "less than 1 %".to_owned(),
        p => format!("{p:.0} %"),
    }
}

/// A number to so many digits, as a sentence bears it.
pub(super) fn figure(value: f64, digits: usize) -> String {
    let magnitude = value.abs().log10().floor();
    if value == 0.0 || !(-4.0..6.0).contains(&magnitude) {
        return if value == 0.0 { "0".to_owned() } else { format!("{value:.*e}", digits.saturating_sub(1)) };
    }
    format!("{value:.*}", (digits as f64 - 1.0 - magnitude).max(0.0) as usize)
}

fn shape(facts: &Facts) -> String {
    if let Some(contradiction) = &facts.contradiction {
        return format!(": {contradiction}");
    }
    facts.dependence.as_ref().map_or_else(String::new, |d| format!("; what is left depends on the {}", d.on))
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
    use std::collections::BTreeMap;

    use super::*;
    use crate::sim2real::Site;

    fn fit(channel: &str, unit: &str, [recalibrated_rmse, trued_rmse]: [f64; 2]) -> ChannelFit {
        ChannelFit {
            channel: channel.into(),
            unit: unit.into(),
            recalibrated_rmse,
            trued_rmse,
            noise_floor: 0.1,
            nominal_rmse: 3.0,
            nominal_mae: 2.0,
            recalibrated_mae: 1.0,
            trued_mae: 0.5,
            improvement_ci95: [0.0; 2],
        }
    }

    #[test]
    fn a_run_that_leaves_all_bounds_has_no_error() {
        let said = |before, after| gained(&fit("position", "rad", [before, after]));
        assert_eq!(
            said(2.0, 1.0),
            "the held-out error of position falls by 50 %, from 2.00 to 1.00 rad (noise floor 0.100)"
        );
        for (before, after) in [(f64::NAN, 1.0), (1.0, f64::INFINITY), (f64::NAN, f64::NAN)] {
            let said = said(before, after);
            assert!(said.contains("leaves all bounds") && !said.contains("NaN") && !said.contains("inf"), "{said}");
        }
    }

    #[test]
    fn where_chance_cannot_be_excluded_the_channel_that_falls_is_told() {
        let facts = |contradiction: Option<&str>| Facts {
            name: "execution".into(),
            tried: vec![("bias", "a zero offset"), ("drift", "a drift"), ("drift", "a drift")],
            fits: vec![fit("cost", "", [0.5, 0.5]), fit("filled", "", [0.01, 0.002])],
            few: false,
            remainder: 0.0,
            dependence: None,
            contradiction: contradiction.map(str::to_owned),
        };
        let named = summary(&facts(None), Verdict::Ambiguous, &[]);
        assert!(named.contains("error of filled falls by 80 %"), "{named}");
        let mut late = facts(None);
        late.fits[0].improvement_ci95 = [1e-3, 3e-3];
        late.fits[1].improvement_ci95 = [0.7, 0.9];
        let named = summary(&late, Verdict::Ambiguous, &[]);
        assert!(named.contains("error of filled falls by 80 %"), "a thousandth of the first is nothing: {named}");
        let said = summary(&facts(Some("others follow")), Verdict::Unexplained, &[]);
        assert!(said.ends_with("none of the 2 known mechanisms explains: others follow."), "a form is no mechanism: {said}");
    }

    #[test]
    fn what_only_goes_with_something_unknown_takes_no_part_of_it() {
        let effect = Effect {
            mechanism: "permanent_impact".into(),
            site: Site::Plant,
            confidence: 0.0,
            gain: None,
            margin: None,
            parameters: BTreeMap::new(),
            rivals: Vec::new(),
            location: None,
            active: Vec::new(),
            moved: Vec::new(),
        };
        let facts = |remainder| Facts {
            name: "execution".into(),
            tried: vec![("permanent_impact", "permanent impact")],
            fits: vec![fit("cost", "bps", [0.6, 0.6])],
            few: false,
            remainder,
            dependence: Some(Dependence { on: "side", strength: 80.0, explained: 1.0 }),
            contradiction: None,
        };
        let said = |remainder| summary(&facts(remainder), Verdict::Unexplained, std::slice::from_ref(&effect));
        let several = summary(&facts(1e-4), Verdict::Unexplained, &[effect.clone(), effect.clone()]);
        assert!(
            several.contains("take part of it, less than 1 % of the misfit is left where it was fitted, and cost is off by"),
            "{several}"
        );
        for away in [f64::INFINITY, f64::NAN] {
            let facts = Facts { fits: vec![fit("cost", "bps", [0.6, away])], ..facts(1e-4) };
            let said = summary(&facts, Verdict::Unexplained, std::slice::from_ref(&effect));
            assert!(said.contains("and the held-out run of cost leaves all bounds"), "{said}");
        }
        assert!(
            said(0.57).ends_with(
                "permanent impact takes part of it, 57 % of the misfit is left; what is left depends on the side."
            )
        );
        assert!(
            said(1.0).ends_with(
                "permanent impact goes with part of it, and is not what it is; what is left depends on the side."
            )
        );
    }

    #[test]
    fn figures_have_three_digits() {
        let figures = [0.0648, 0.00425, 3.588, 59.75, 14_233.0, 0.0, 2.66e-8].map(|v| figure(v, 3));
        assert_eq!(figures, ["0.0648", "0.00425", "3.59", "59.8", "14233", "0", "2.66e-8"]);
        assert_eq!([0.997, 0.93, 0.004, 1.0].map(percent), ["more than 99 %", "93 %", "less than 1 %", "more than 99 %"]);
    }
}
