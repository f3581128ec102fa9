//! Where, after naming: when each mechanism found acted, and by how much it moved the output.
//!
//! The trued twin is followed with the mechanism and, all else equal, without it. So that what it did a while ago does not
//! count, the run without goes on from the state of the run with at every row: what parts them was done since.

use rayon::prelude::*;

use super::hypothesis::{Hypothesis, Inquiry};
use super::locate::{Covariates, identity, unit};
use super::{Diagnosis, Moved, Stretch, Verdict};
use crate::sim2real::identify::Fit;
use crate::sim2real::{Clock, Part, Thetas, Trajectory, Twin};

/// A mechanism acts where it moves the output by this part of what it does where it acts most.
const ACTS: f64 = 0.2;
/// Some laws do nothing at all at times: where a mechanism rests, to within this part, in so many of the rows, it acts
/// wherever it does anything to speak of.
const RESTS: f64 = 1e-6;
const RESTING: f64 = 0.05;
const ANYTHING: f64 = 0.01;
/// Acting in this part of the rows is acting throughout.
const THROUGHOUT: f64 = 0.9;
/// Pauses of at most this many rows are none.
const PAUSE: usize = 8;
/// Balanced accuracy with which a covariate must tell acting from not acting, to be named.
const SEPARATES: f64 = 0.9;
/// Time is named where nothing else does better by more than this: what happened once will look like some state.
const SIMPLER: f64 = 0.03;
/// Where nothing separates the moments, acting in less than this part of the rows is acting at times; in more, on and off
/// throughout.
const AT_TIMES: f64 = 0.2;

/// What became of one mechanism.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Activity {
    /// In words.
    pub phrase: Option<String>,
    /// When it acted, where it acts at times only.
    pub active: Vec<Stretch>,
    /// By how much it moved each channel.
    pub moved: Vec<Moved>,
    /// When it began [s], where it acted from then on and not before.
    pub onset: Option<f64>,
}

/// What a mechanism did between one row and the next.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Deed {
    /// Number of the recording.
    part: usize,
    /// The row.
    row: usize,
    /// By how much it moved the output, over all channels, in units of the noise.
    size: f64,
}

/// The activity of each mechanism of `selected`, in their order, at the values of `trued`, its fit in free run.
pub(super) fn activities<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    selected: &Hypothesis<T>,
    trued: &Fit,
    covariates: &Covariates,
) -> Vec<Activity> {
    let mut at = inquiry.twin.parameters().len();
    let without: Vec<Vec<f64>> = selected
        .added
        .iter()
        .map(|number| {
            let mut values = trued.values.clone();
            for p in &inquiry.candidates[*number].form.parameters {
                values[at] = p.nominal;
                at += 1;
            }
            values
        })
        .collect();
    without.par_iter().map(|values| activity(inquiry, selected, trued, values, covariates)).collect()
}

/// Adds to `diagnosis` when each mechanism acted.
///
/// What is named knows better than the scores when it began: where it acted from the start, there is no onset.
pub(super) fn tell<T: Twin>(
    diagnosis: &mut Diagnosis,
    inquiry: &Inquiry<'_, T>,
    selected: &Hypothesis<T>,
    activities: Vec<Activity>,
) {
    if matches!(diagnosis.verdict, Verdict::Named | Verdict::Ambiguous) {
        diagnosis.location.onset = activities.iter().filter_map(|a| a.onset).min_by(f64::total_cmp);
    }
    for (number, activity) in selected.added.iter().zip(activities) {
        let name = inquiry.candidates[*number].about.name;
        if let Some(effect) = diagnosis.effects.iter_mut().find(|e| e.mechanism == name) {
            effect.location = activity.phrase;
            effect.active = activity.active;
            effect.moved = activity.moved;
        }
    }
}

fn activity<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    selected: &Hypothesis<T>,
    trued: &Fit,
    without: &[f64],
    covariates: &Covariates,
) -> Activity {
    let parts = &inquiry.evidence.free_run;
    let event = inquiry.twin.clock() == Clock::Event;
    let mut deeds: Vec<Deed> = Vec::new();
    let mut moved: Vec<(f64, usize)> = vec![(0.0, 0); inquiry.evidence.weights.len()];
    for (number, part) in parts.iter().enumerate() {
        let initial = trued.state.values.get(number).map_or(&[][..], Vec::as_slice);
        let lane = |values: &[f64]| -> Vec<f64> { values.iter().chain(initial).copied().collect() };
        let lanes = Thetas::from_lanes(&[lane(&trued.values), lane(without)]);
        let (recording, rows) = (part.recording, part.followed());
        let free = selected.twin.rollout(&lanes, recording, rows.clone(), inquiry.seed);
        for (channel, sum) in moved.iter_mut().enumerate() {
            let apart = difference(&free, &inquiry.evidence.weights[channel].channel);
            *sum = (sum.0 + apart.iter().map(|d| d * d).sum::<f64>(), sum.1 + apart.len());
        }
        // Orders do not wait for one another: each shows by itself what was done to it.
        let local = if event { None } else { selected.twin.rollout_rejoined(&lanes, recording, rows, 1, inquiry.seed) };
        deeds.extend(deeds_of(inquiry, number, part, &local.unwrap_or(free)));
    }
    let moved = moved
        .iter()
        .zip(&inquiry.evidence.weights)
        .filter(|((sum, count), _)| *count > 0 && sum.is_finite())
        .map(|((sum, count), weight)| Moved {
            channel: weight.channel.clone(),
            rms: (sum / *count as f64).sqrt(),
            unit: unit(inquiry, &weight.channel),
        })
        .collect();
    let mut told = told(inquiry, &deeds, covariates);
    told.moved = moved;
    told
}

/// First lane less second, row by row.
fn difference(runs: &[Trajectory], channel: &str) -> Vec<f64> {
    let of = |lane: usize| runs.get(lane)?.iter().find(|s| s.channel == channel).map(|s| s.samples.as_slice());
    match (of(0), of(1)) {
        (Some(with), Some(without)) => with.iter().zip(without).map(|(a, b)| a - b).collect(),
        _ => Vec::new(),
    }
}

fn deeds_of<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    number: usize,
    part: &Part<'_, T::Stimulus>,
    runs: &[Trajectory],
) -> Vec<Deed> {
    let apart: Vec<(Vec<f64>, f64)> =
        inquiry.evidence.weights.iter().map(|w| (difference(runs, &w.channel), w.noise)).collect();
    let size =
        |row: usize| apart.iter().filter_map(|(d, noise)| d.get(row).map(|d| (d / noise).powi(2))).sum::<f64>().sqrt();
    // What is done from a sample on shows in the next one, where the lanes meet again; a message shows it itself.
    let later = usize::from(inquiry.twin.clock() != Clock::Event);
    (later..part.followed().len())
        .map(|row| Deed { part: number, row: part.start + row - later, size: size(row) })
        .filter(|deed| deed.size.is_finite())
        .collect()
}

/// When that was, in words and as stretches.
fn told<T: Twin>(inquiry: &Inquiry<'_, T>, deeds: &[Deed], covariates: &Covariates) -> Activity {
    let parts = &inquiry.evidence.free_run;
    let event = inquiry.twin.clock() == Clock::Event;
    let acts = acts(deeds);
    let share = acts.iter().filter(|a| **a).count() as f64 / acts.len().max(1) as f64;
    if share == 0.0 {
        return Activity::default();
    }
    let throughout = || {
        let phrase = if event { "every order" } else { "throughout" };
        Activity { phrase: Some(phrase.into()), ..Activity::default() }
    };
    if share > THROUGHOUT {
        return throughout();
    }
    let values = |k: usize| -> Vec<f64> {
        deeds.iter().map(|d| covariates[&identity(parts[d.part].recording)][k].1[d.row]).collect()
    };
    let first = parts.first().and_then(|p| covariates.get(&identity(p.recording))).map_or(&[][..], Vec::as_slice);
    let alike = parts.iter().all(|p| covariates.get(&identity(p.recording)).is_some_and(|own| own.len() == first.len()));
    let mut rules: Vec<Rule> = Vec::new();
    for (k, (name, _)) in first.iter().enumerate().filter(|_| alike) {
        let values = values(k);
        let unit = unit(inquiry, name);
        rules.extend(Rule::best(name, &unit, &values, &acts));
        if values.iter().any(|v| *v < 0.0) && values.iter().any(|v| *v > 0.0) {
            let sizes: Vec<f64> = values.iter().map(|v| v.abs()).collect();
            rules.extend(Rule::best(&format!("|{name}|"), &unit, &sizes, &acts));
        }
    }
    let time: Vec<f64> = deeds.iter().map(|d| parts[d.part].recording.time[d.row]).collect();
    let when = if event { None } else { Rule::best("time", "s", &time, &acts) };
    let state = rules.into_iter().max_by(|a, b| a.accuracy.total_cmp(&b.accuracy));
    let better = match (when, state) {
        (Some(when), Some(state)) if state.accuracy > when.accuracy + SIMPLER => Some(state),
        (when, state) => when.or(state),
    };
    let clear = better.filter(|rule| rule.accuracy > SEPARATES);
    let onset = clear.as_ref().filter(|rule| rule.on == "time" && rule.above).map(|rule| rule.threshold);
    let phrase = match (clear, event) {
        (Some(rule), _) => rule.words(),
        (None, true) => format!("{:.0} % of the orders", 100.0 * share),
        (None, false) if share > AT_TIMES => return throughout(),
        (None, false) => format!("at times: {:.0} % of the rows", 100.0 * share),
    };
    let active = if event { Vec::new() } else { stretches(inquiry, deeds, &acts) };
    Activity { phrase: Some(phrase), active, moved: Vec::new(), onset }
}

/// In which rows it acted: the level is that of the rows in which it did most, each counting by how much it did.
fn acts(deeds: &[Deed]) -> Vec<bool> {
    let (fourth, second) = deeds.iter().fold((0.0, 0.0), |(f, s), d| (f + d.size.powi(4), s + d.size.powi(2)));
    let most = if second > 0.0 { (fourth / second).sqrt() } else { 0.0 };
    let resting = deeds.iter().filter(|d| d.size <= RESTS * most).count();
    let level = if resting as f64 > RESTING * deeds.len() as f64 { ANYTHING } else { ACTS };
    deeds.iter().map(|d| most > 0.0 && d.size > level * most).collect()
}

/// Neighbouring rows in which it acted, as stretches of time; short pauses are none.
fn stretches<T: Twin>(inquiry: &Inquiry<'_, T>, deeds: &[Deed], acts: &[bool]) -> Vec<Stretch> {
    let parts = &inquiry.evidence.free_run;
    let mut runs: Vec<(usize, usize, usize)> = Vec::new();
    for (deed, _) in deeds.iter().zip(acts).filter(|(_, acts)| **acts) {
        match runs.last_mut() {
            Some((part, _, end)) if *part == deed.part && deed.row <= *end + PAUSE => *end = deed.row + 1,
            _ => runs.push((deed.part, deed.row, deed.row + 1)),
        }
    }
    let stretch = |(part, start, end): (usize, usize, usize)| {
        let recording = parts[part].recording;
        let end = end.min(recording.len() - 1);
        Stretch { recording: recording.name.clone(), start: recording.time[start], end: recording.time[end] }
    };
    runs.into_iter().map(stretch).collect()
}

/// A covariate beyond a threshold.
#[derive(Debug, Clone, PartialEq)]
struct Rule {
    on: String,
    unit: String,
    threshold: f64,
    /// Whether it acts above the threshold rather than below.
    above: bool,
    /// Mean of the part of the moments of acting and of the part of those of not acting that it tells right.
    accuracy: f64,
}

impl Rule {
    /// The threshold that best tells when `acts`.
    fn best(on: &str, unit: &str, values: &[f64], acts: &[bool]) -> Option<Self> {
        let mut order: Vec<usize> = (0..values.len()).filter(|i| values[*i].is_finite()).collect();
        order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
        let (mut acting, mut resting) = (0_u32, 0_u32);
        order.iter().for_each(|i| if acts[*i] { acting += 1 } else { resting += 1 });
        if acting == 0 || resting == 0 {
            return None;
        }
        let (mut acting_below, mut resting_below) = (0_u32, 0_u32);
        let mut best: Option<Self> = None;
        for pair in order.windows(2) {
            if acts[pair[0]] {
                acting_below += 1
            } else {
                resting_below += 1
            }
            let (below, above) = (values[pair[0]], values[pair[1]]);
            if below == above {
                continue;
            }
            // Acting above: the acting ones above and the resting ones below are told right.
            let right =
                0.5 * (f64::from(acting - acting_below) / f64::from(acting) + f64::from(resting_below) / f64::from(resting));
            for (is_above, accuracy) in [(true, right), (false, 1.0 - right)] {
                if best.as_ref().is_none_or(|b| accuracy > b.accuracy) {
                    let threshold = 0.5 * (below + above);
                    best = Some(Self { on: on.to_owned(), unit: unit.to_owned(), threshold, above: is_above, accuracy });
                }
            }
        }
        best
    }

    /// `|velocity| < 0.05 rad/s`, `from 12.4 s on`.
    fn words(&self) -> String {
        let digits = if self.on == "time" { 3 } else { 2 };
        let value = super::words::figure(self.threshold, digits);
        match (self.on.as_str(), self.above) {
            ("time", true) => format!("from {value} s on"),
            ("time", false) => format!("until {value} s"),
            (on, above) => format!("{on} {} {value} {}", if above { ">" } else { "<" }, self.unit).trim_end().to_owned(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rule_finds_its_threshold_and_its_side() {
        let values: Vec<f64> = (0..1_000).map(|i| f64::from((i * 617) % 1_000) * 0.01).collect();
        let acts: Vec<bool> = values.iter().map(|v| *v > 7.25).collect();
        let rule = Rule::best("position", "rad", &values, &acts).unwrap();
        assert_eq!(rule.words(), "position > 7.3 rad");
        let others: Vec<bool> = acts.iter().map(|a| !a).collect();
        assert_eq!(Rule::best("|command|", "", &values, &others).unwrap().words(), "|command| < 7.3");
        assert_eq!(Rule::best("time", "s", &values, &acts).unwrap().words(), "from 7.25 s on");
        assert_eq!(Rule::best("time", "s", &values, &[true; 1_000]), None);
        // Values that recur leave few thresholds, and none of them may be missed.
        let pulses: Vec<f64> = (0..6_000).map(|i| if i % 97 < 70 { 0.0 } else { 2.5 + f64::from(i / 97) * 0.01 }).collect();
        let acts: Vec<bool> = pulses.iter().map(|u| *u > 0.0).collect();
        assert_eq!(Rule::best("|command|", "", &pulses, &acts).unwrap().accuracy, 1.0);
        let random: Vec<bool> = (0..1_000).map(|i| (i * i * 31 + i) % 7 < 3).collect();
        assert!(Rule::best("position", "rad", &values, &random).unwrap().accuracy < 0.6);
    }

    #[test]
    fn little_is_not_acting() {
        let deed = |size| Deed { part: 0, row: 0, size };
        let deeds: Vec<Deed> = [1e-3, 0.01, 1.0, 0.8, 0.05, 0.3].into_iter().map(deed).collect();
        assert_eq!(acts(&deeds), [false, false, true, true, false, true]);
        // What rests altogether at times acts wherever it does something.
        let limited: Vec<Deed> = [0.0, 0.0, 1.0, 0.8, 0.05, 0.3].into_iter().map(deed).collect();
        assert_eq!(acts(&limited), [false, false, true, true, true, true]);
        assert_eq!(acts(&[deed(0.0)]), [false]);
    }
}
