//! The first screen: what is missing, how sure, how much better.

use minijinja::{Value, context};

use crate::report::quantity::{confidence, number, percent, percents, uncertain, with_unit};
use crate::report::section::{ReportError, Section, fill};
use crate::sim2real::diagnose::{ChannelFit, Diagnosis, Effect, Verdict};

pub(in crate::report) struct Answer<'a> {
    pub diagnosis: &'a Diagnosis,
}

/// Channels on the first screen; the table of errors has them all.
const CHANNELS: usize = 3;

impl Section for Answer<'_> {
    fn id(&self) -> &'static str {
        "answer"
    }

    fn title(&self) -> &'static str {
        "Answer"
    }

    fn render(&self) -> Result<String, ReportError> {
        let d = self.diagnosis;
        let found: Vec<Value> = d.effects.iter().map(effect).collect();
        let channels: Vec<Value> = d.fit.iter().take(CHANNELS).map(channel).collect();
        let more = d.fit.len().saturating_sub(CHANNELS);
        fill(
            "answer.html",
            include_str!("../templates/answer.html"),
            context! {
                found => found,
                nothing => nothing(d.verdict),
                remainder => percent(d.checks.remainder),
                placebo => d.checks.placebo_p.map(percent),
                tried => d.checks.tried,
                channels => channels,
                more => more,
                held_out => &d.held_out,
                next => d.next_experiment.as_ref().map(|n| n.what.as_str()),
            },
        )
    }
}

/// What to say where no effect was found.
fn nothing(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::NoMismatch => "Nothing. The twin explains these recordings.",
        Verdict::NotExcited => "Open. These recordings do not move the system enough to tell.",
        Verdict::Ambiguous => "Something, but these recordings do not tell which mechanism it is.",
        Verdict::Named | Verdict::Unexplained => "Something that none of the known mechanisms explains.",
    }
}

fn effect(effect: &Effect) -> Value {
    let parameters: Vec<Value> = effect
        .parameters
        .iter()
        .map(|(name, e)| context! { name => name, value => with_unit(&uncertain(e.value, e.std), &e.unit) })
        .collect();
    let rivals: Vec<Value> = effect
        .rivals
        .iter()
        .map(|r| context! { name => &r.mechanism, confidence => percent(r.confidence), width => width(r.confidence, 1.0) })
        .collect();
    context! {
        name => &effect.mechanism,
        site => effect.site.to_string(),
        location => effect.location.as_deref(),
        confidence => confidence(effect.confidence),
        width => width(effect.confidence, 1.0),
        parameters => parameters,
        rivals => rivals,
    }
}

fn channel(fit: &ChannelFit) -> Value {
    let largest = [fit.nominal_rmse, fit.recalibrated_rmse, fit.trued_rmse, fit.noise_floor]
        .into_iter()
        .filter(|v| v.is_finite())
        .fold(0.0, f64::max);
    let bar = |name: &str, class: &str, value: f64| {
        context! { name => name, class => class, value => with_unit(&number(value), &fit.unit), width => width(value, largest) }
    };
    let [low, high] = fit.improvement_ci95;
    // 0 / 0 is undefined, and says so in print.
    let better = 1.0 - fit.trued_rmse / fit.recalibrated_rmse;
    context! {
        name => &fit.channel,
        better => percent(better.abs()),
        direction => match better {
            b if b.is_nan() => "",
            b if b < 0.0 => "higher error",
            _ => "lower error",
        },
        interval => percents(low, high),
        floor => with_unit(&number(fit.noise_floor), &fit.unit),
        floor_at => width(fit.noise_floor, largest),
        bars => vec![
            bar("nominal", "nominal", fit.nominal_rmse),
            bar("recalibrated", "recalibrated", fit.recalibrated_rmse),
            bar("trued", "trued", fit.trued_rmse),
        ],
    }
}

/// `value` as a share of `largest` [%], for the width of a bar.
pub(super) fn width(value: f64, largest: f64) -> String {
    let share = value / largest;
    format!("{:.1}", if share.is_finite() { (100.0 * share).clamp(0.0, 100.0) } else { 0.0 })
}
