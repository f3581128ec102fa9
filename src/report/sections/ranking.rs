//! Every mechanism that was tried, stage by stage.

use minijinja::{Value, context};

use crate::report::quantity::{confidence, decimals, number, percent};
use crate::report::section::{ReportError, Section, fill};
use crate::sim2real::diagnose::{Diagnosis, Effect, Score};

use super::answer::width;

pub(in crate::report) struct Ranking<'a> {
    pub diagnosis: &'a Diagnosis,
}

impl Section for Ranking<'_> {
    fn id(&self) -> &'static str {
        "ranking"
    }

    fn title(&self) -> &'static str {
        "Why not the rivals"
    }

    fn render(&self) -> Result<String, ReportError> {
        let scores = &self.diagnosis.scores;
        let mut numbers: Vec<usize> = scores.iter().map(|s| s.stage).collect();
        numbers.sort_unstable();
        numbers.dedup();
        let stages: Vec<Value> = numbers.iter().map(|n| stage(scores, *n)).collect();
        if stages.is_empty() {
            return Ok(String::new());
        }
        let places: Vec<Value> = self.diagnosis.effects.iter().map(place).collect();
        let not_excited = self.diagnosis.checks.not_excited.clone();
        fill(
            "ranking.html",
            include_str!("../templates/ranking.html"),
            context! { stages => stages, places => places, not_excited => not_excited },
        )
    }
}

/// What stands in the place of an effect.
fn place(effect: &Effect) -> Value {
    let rivals: Vec<Value> =
        effect.rivals.iter().map(|r| context! { name => &r.mechanism, confidence => percent(r.confidence) }).collect();
    context! { name => &effect.mechanism, confidence => confidence(effect.confidence), rivals => rivals }
}

fn stage(scores: &[Score], number_of: usize) -> Value {
    let here: Vec<&Score> = scores.iter().filter(|s| s.stage == number_of).collect();
    let mut fitted: Vec<(&Score, f64)> = here.iter().filter_map(|s| Some((*s, s.gain?))).collect();
    fitted.sort_by(|a, b| b.1.total_cmp(&a.1));
    let largest = fitted.iter().map(|(_, gain)| *gain).filter(|g| g.is_finite()).fold(0.0, f64::max);
    let bars: Vec<Value> = fitted
        .iter()
        .map(|(s, gain)| {
            context! {
                name => &s.mechanism,
                form => &s.form,
                accepted => s.accepted,
                gain => if gain.abs() < 1e6 { decimals(*gain, 1) } else { number(*gain) },
                width => width(*gain, largest),
                screen => percent(s.screen),
                survival => percent(s.survival),
            }
        })
        .collect();
    let out: Vec<Value> = here
        .iter()
        .filter(|s| s.gain.is_none())
        .map(|s| context! { name => label(s), screen => percent(s.screen) })
        .collect();
    let before: Vec<String> =
        scores.iter().filter(|s| s.accepted && s.stage < number_of).map(|s| s.mechanism.clone()).collect();
    context! { number => number_of + 1, before => before, bars => bars, screened => out.len(), out => out }
}

fn label(score: &Score) -> String {
    if score.form.is_empty() { score.mechanism.clone() } else { format!("{}, {}", score.mechanism, score.form) }
}
