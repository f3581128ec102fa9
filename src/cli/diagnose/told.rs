//! A diagnosis as text.

use std::cmp::Ordering;

use comfy_table::Table;

use crate::cli::screen::{Screen, titled};
use crate::report::quantity::{
    UNDEFINED, axis, confidence, decimals, number, percent, percents, range, significant, uncertain, with_unit,
};
use crate::sim2real::diagnose::{ChannelFit, Diagnosis, Effect, RecordingError, Score};

/// Mechanisms of each stage that the ranking tells.
const RANKED: usize = 6;

/// The verdict and its sentence.
pub(in crate::cli) fn headline(screen: &Screen, diagnosis: &Diagnosis) -> String {
    screen.wrapped(&format!("{}: ", diagnosis.verdict), &diagnosis.summary)
}

/// Everything a person wants to read of a diagnosis, most important first.
pub(super) fn diagnosis(screen: &Screen, diagnosis: &Diagnosis) -> String {
    let mut text = format!("{}\n", headline(screen, diagnosis));
    if !diagnosis.effects.is_empty() {
        text += &titled("What is missing", &effects(screen, &diagnosis.effects));
    }
    let place = place(diagnosis);
    if !place.is_empty() {
        text += &format!("\nWhere the refitted twin errs, before anything is named\n\n{place}");
    }
    text += &titled(&format!("Errors on held-out data ({})", diagnosis.held_out), &errors(screen, &diagnosis.fit));
    if !diagnosis.location.recordings.is_empty() {
        text += &titled("The same, recording by recording", &by_recording(screen, &diagnosis.location.recordings));
    }
    if !diagnosis.parameters.is_empty() {
        text += &titled("Parameters of the twin", &parameters(screen, diagnosis));
    }
    if !diagnosis.scores.is_empty() {
        text += &titled("What was tried, stage by stage", &ranking(screen, &diagnosis.scores));
    }
    text += &checks(screen, diagnosis);
    text
}

/// Names of the effects found, `nothing` if none was.
pub(in crate::cli) fn effect_names(diagnosis: &Diagnosis) -> String {
    let names: Vec<&str> = diagnosis.effects.iter().map(|effect| effect.mechanism.as_str()).collect();
    if names.is_empty() { "nothing".to_owned() } else { names.join(", ") }
}

fn effects(screen: &Screen, effects: &[Effect]) -> Table {
    let mut table = screen.table(["mechanism", "acts on", ">confidence", "parameters", "where it acted", "rivals"]);
    for effect in effects {
        let parameters: Vec<String> = effect
            .parameters
            .iter()
            .map(|(name, p)| format!("{name} = {}", with_unit(&uncertain(p.value, p.std), &p.unit)))
            .collect();
        let rivals: Vec<String> =
            effect.rivals.iter().map(|r| format!("{} ({})", r.mechanism, percent(r.confidence))).collect();
        table.add_row([
            effect.mechanism.clone(),
            effect.site.to_string(),
            confidence(effect.confidence),
            parameters.join("\n"),
            effect.location.clone().unwrap_or_else(|| UNDEFINED.to_owned()),
            if rivals.is_empty() { "none".to_owned() } else { rivals.join("\n") },
        ]);
    }
    table
}

/// Stretches of time that are told.
const STRETCHES: usize = 4;

/// Since when, in which states and at which times the twin is off.
fn place(diagnosis: &Diagnosis) -> String {
    let location = &diagnosis.location;
    let mut text = location.onset.map_or_else(String::new, |onset| format!("  from {} s on\n", significant(onset, 4)));
    for change in &location.changes {
        let (time, factor) = (significant(change.time, 4), significant(change.factor, 2));
        text += &format!("  {}: {factor} times the error from {time} s of {} on\n", change.channel, change.recording);
    }
    for bin in &location.against {
        let share = format!("{} of the error in {} of the rows", percent(bin.share_of_error), percent(bin.share_of_rows));
        text += &format!("  {}: {}: {share}\n", bin.channel, range(bin));
    }
    for split in &location.columns {
        let (at, explains) = (significant(split.at, 3), percent(split.explains));
        text += &format!(
            "  {}, a column the twin does not read: parameters of their own below and above {at} explain {explains} of the error\n",
            split.column
        );
    }
    for stretch in location.intervals.iter().take(STRETCHES) {
        let (start, end) = (decimals(stretch.start, 2), decimals(stretch.end, 2));
        let share = percent(stretch.share_of_error);
        text += &format!("  {}: {start} to {end} s of {}: {share} of the error\n", stretch.channel, stretch.recording);
    }
    let more = location.intervals.len().saturating_sub(STRETCHES);
    if more > 0 {
        text += &format!("  and {more} more stretches\n");
    }
    text
}

/// Errors of the three twins, two rows a channel.
pub(in crate::cli) fn errors(screen: &Screen, fits: &[ChannelFit]) -> Table {
    let heads = ["channel", "error", ">as given", ">recalibrated", ">trued", ">noise floor", ">improvement (95 %)"];
    let mut table = screen.table(heads);
    for fit in fits {
        let [low, high] = fit.improvement_ci95;
        table.add_row([
            axis(&fit.channel, &fit.unit),
            "RMS".to_owned(),
            number(fit.nominal_rmse),
            number(fit.recalibrated_rmse),
            number(fit.trued_rmse),
            number(fit.noise_floor),
            percents(low, high),
        ]);
        table.add_row([
            String::new(),
            "mean |e|".to_owned(),
            number(fit.nominal_mae),
            number(fit.recalibrated_mae),
            number(fit.trued_mae),
            String::new(),
            String::new(),
        ]);
    }
    table
}

fn by_recording(screen: &Screen, errors: &[RecordingError]) -> Table {
    let heads = ["recording", "channel", ">share of error", ">RMS as given", ">recalibrated", ">trued", ">rows"];
    let mut table = screen.table(heads);
    for error in errors {
        table.add_row([
            error.recording.clone(),
            axis(&error.channel, &error.unit),
            percent(error.share_of_error),
            number(error.nominal_rmse),
            number(error.recalibrated_rmse),
            number(error.trued_rmse),
            error.rows.to_string(),
        ]);
    }
    table
}

fn parameters(screen: &Screen, diagnosis: &Diagnosis) -> Table {
    let mut table = screen.table(["parameter", "unit", ">as given", ">trued", ""]);
    for (name, p) in &diagnosis.parameters {
        let bound = diagnosis.checks.at_bound.contains(name);
        table.add_row([
            name.clone(),
            p.unit.clone(),
            number(p.nominal),
            if p.std > 0.0 { uncertain(p.value, p.std) } else { number(p.value) },
            if bound { "at its bound".to_owned() } else { String::new() },
        ]);
    }
    table
}

fn ranking(screen: &Screen, scores: &[Score]) -> Table {
    let mut table = screen.table([">stage", "mechanism", ">explains", ">stands apart", ">gain", ""]);
    let last = scores.iter().map(|score| score.stage).max().unwrap_or(0);
    for stage in 0..=last {
        let mut here: Vec<&Score> = scores.iter().filter(|score| score.stage == stage).collect();
        here.sort_by(|a, b| best_first(a, b));
        for score in here.into_iter().take(RANKED) {
            let form = if score.form.is_empty() { String::new() } else { format!(" ({})", score.form) };
            table.add_row([
                (stage + 1).to_string(),
                format!("{}{form}", score.mechanism),
                percent(score.screen),
                percent(score.survival),
                score.gain.map_or_else(|| UNDEFINED.to_owned(), |gain| decimals(gain, 1)),
                if score.accepted { "accepted".to_owned() } else { String::new() },
            ]);
        }
    }
    table
}

/// The accepted first, then by gain, then by what the screening saw.
fn best_first(a: &Score, b: &Score) -> Ordering {
    let gain = |score: &Score| score.gain.unwrap_or(f64::NEG_INFINITY);
    b.accepted.cmp(&a.accepted).then(gain(b).total_cmp(&gain(a))).then(b.screen.total_cmp(&a.screen))
}

fn checks(screen: &Screen, diagnosis: &Diagnosis) -> String {
    let checks = &diagnosis.checks;
    let placebo = checks.placebo_p.map_or_else(|| UNDEFINED.to_owned(), number);
    let mut text = format!(
        "\nChecks\n\n  adequacy {} (1: the residual is white); remainder {}; placebo p {placebo}; mechanisms tried: {}\n",
        number(checks.adequacy),
        percent(checks.remainder),
        checks.tried,
    );
    if !checks.at_bound.is_empty() {
        text += &format!("  at a bound: {}\n", checks.at_bound.join(", "));
    }
    if !checks.not_excited.is_empty() {
        text += &format!("{}\n", screen.wrapped("  not excited by these recordings: ", &checks.not_excited.join(", ")));
    }
    for note in &checks.notes {
        text += &format!("{}\n", screen.wrapped("  - ", note));
    }
    if let Some(next) = &diagnosis.next_experiment {
        text += &format!("\n{}\n", screen.wrapped("Next experiment: ", &next.what));
    }
    text
}
