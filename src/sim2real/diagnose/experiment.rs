//! The next experiment: the commands that would best tell apart what these recordings cannot.
//!
//! Every command of a family is simulated with each of the hypotheses left. What they would then differ by, after the
//! parameters of the other have been refitted to it, decides (discrimination designs: Hunter & Reiner, Technometrics 7 (1965);
//! Atkinson & Fedorov, Biometrika 62 (1975)).

use rayon::prelude::*;

use super::excitation::{Excitation, family};
use super::gates;
use super::hypothesis::{Hypothesis, Inquiry, STARTS};
use super::noise::median;
use super::rivals::Place;
use super::selection::Selection;
use super::settle::settled_by;
use super::words::figure;
use super::{Effect, NextExperiment, Verdict};
use crate::sim2real::identify::{Effort, Problem, State, fit_smooth};
use crate::sim2real::{Clock, Part, Recording, Thetas, Twin};

/// Name of the file with the commands.
pub const EXPERIMENT_FILE: &str = "next_experiment.csv";

/// Longest experiment [s], where rows are close enough; and the fewest and the most rows it has.
const LONGEST: f64 = 20.0;
const ROWS: (usize, usize) = (1_000, 6_000);
/// Rivals that are told apart at the most.
const RIVALS: usize = 2;
/// Commands that are refitted, of those that a linear prediction likes best.
const REFITTED: usize = 3;
/// The first channel may leave the range it was recorded in by this part of it.
const BEYOND: f64 = 0.5;
/// A gain in log-likelihood of less than this tells nothing.
const TELLS: f64 = 5.0;

/// What to record next, with the commands to send where a plant takes plain numbers.
pub(super) fn next<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    selection: &Selection<T>,
    places: &[Place],
    verdict: Verdict,
    effects: &[Effect],
) -> Option<(NextExperiment, Option<Excitation>)> {
    let messages = inquiry.twin.clock() == Clock::Event;
    if let Some(more) = settled_by(inquiry, selection, places).filter(|_| messages && verdict != Verdict::Unexplained) {
        return Some((more, None));
    }
    if !matches!(verdict, Verdict::Ambiguous | Verdict::NotExcited) || effects.is_empty() {
        return None;
    }
    // With steps of integration as long as they may be: what tells hypotheses apart is far more than these are off by.
    let Hypothesis { twin, fit, .. } = &selection.selected;
    let coarse = gates::exploring_step(twin, &fit.values, inquiry.evidence).map(|step| inquiry.twin.stepping(step));
    let inquiry = &Inquiry { twin: coarse.as_ref().unwrap_or(inquiry.twin), ..*inquiry };
    let selected = inquiry.stepped(&selection.selected);
    let others = contenders(inquiry, selection, places);
    let own: Vec<&str> = effects.iter().map(|e| e.mechanism.as_str()).collect();
    let all: Vec<&str> = others.iter().map(|(name, _)| name.as_str()).collect();
    let Some(best) = Design::of(inquiry, &selected, &others).and_then(|design| design.best()) else {
        let other = match messages {
            true => "send orders of other sizes and at other intervals, in a market that moves more and less",
            false => "record with other amplitudes and frequencies",
        };
        let what = format!("{other}, so that {} can be told", apart(&own, &all));
        return Some((advice(what, &own, &all), None));
    };
    let told = |tells: bool| -> Vec<&str> {
        all.iter().zip(&best.gains).filter(|(_, gain)| (**gain >= TELLS) == tells).map(|(name, _)| *name).collect()
    };
    let (told_apart, alike) = (told(true), told(false));
    let least = |gains: &[f64]| -> f64 {
        gains.iter().zip(&best.gains).filter(|(_, g)| **g >= TELLS).map(|(g, _)| *g).fold(f64::INFINITY, f64::min)
    };
    if told_apart.is_empty() {
        let what = format!(
            "no command within one and a half times the range used tells {}: measure another channel, or with less noise",
            apart(&own, &all)
        );
        return Some((advice(what, &own, &all), None));
    }
    let (gain, so_far) = (least(&best.gains), least(&best.so_far));
    let separation = (2.0 * gain / best.rows as f64).sqrt();
    let time = &best.excitation.time;
    let seconds = time.last().copied().unwrap_or(0.0) + time.get(1).copied().unwrap_or(0.0);
    let mut what = format!(
        "send {EXPERIMENT_FILE}, {} s of {}, and record as before: that tells {}, by {} noise standard deviations even after \
         refitting, which is worth {} in log-likelihood (the commands at hand: {})",
        figure(seconds, 2),
        best.excitation.name,
        apart(&own, &told_apart),
        figure(separation, 2),
        figure(gain, 2),
        figure(so_far, 2)
    );
    if !alike.is_empty() {
        what += &format!("; nothing that can be sent tells {}", apart(&own, &alike));
    }
    let rivals = own.iter().chain(&told_apart).filter(|n| !n.is_empty()).map(|n| (*n).to_owned()).collect();
    let next = NextExperiment {
        what,
        file: Some(EXPERIMENT_FILE.to_owned()),
        rivals,
        separation: Some(separation),
        gain: Some(gain),
        gain_so_far: Some(so_far),
    };
    Some((next, Some(best.excitation)))
}

/// What is to be told from what: what was found, and its rivals or the twin without it.
fn apart(own: &[&str], others: &[&str]) -> String {
    let listed = |names: &[&str], joint: &str| match names {
        [] => "the hypotheses left".to_owned(),
        [rest @ .., last] if !rest.is_empty() => format!("{} {joint} {last}", rest.join(", ")),
        all => all.concat(),
    };
    let named: Vec<&str> = others.iter().copied().filter(|name| !name.is_empty()).collect();
    let from = if named.is_empty() { "nothing".to_owned() } else { listed(&named, "and from") };
    format!("{} from {from}", listed(own, "and"))
}

/// Words alone: where commands are no numbers, or none within reach tells.
fn advice(what: String, own: &[&str], others: &[&str]) -> NextExperiment {
    let rivals = own.iter().chain(others).filter(|n| !n.is_empty()).map(|n| (*n).to_owned()).collect();
    NextExperiment { what, file: None, rivals, separation: None, gain: None, gain_so_far: None }
}

/// The hypotheses to tell the selected one from, the most probable first: its rivals, fitted; where there are none, the twin
/// with nothing in its place.
fn contenders<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    selection: &Selection<T>,
    places: &[Place],
) -> Vec<(String, Hypothesis<T>)> {
    let mut rivals: Vec<(usize, usize, f64)> = Vec::new();
    for (place, others) in places.iter().enumerate() {
        rivals.extend(others.others.iter().map(|(number, loss)| (place, *number, *loss)));
    }
    rivals.sort_by(|a, b| a.2.total_cmp(&b.2));
    let name = |number: usize| inquiry.candidates[number].about.name;
    let mut kept: Vec<(usize, usize)> = Vec::new();
    for (place, number, _) in rivals {
        if kept.len() < RIVALS && !kept.iter().any(|(p, n)| *p == place && name(*n) == name(number)) {
            kept.push((place, number));
        }
    }
    if kept.is_empty() {
        return selection.without.first().map(|less| (String::new(), inquiry.stepped(less))).into_iter().collect();
    }
    let fitted = kept.par_iter().filter_map(|(place, number)| {
        let less = &inquiry.stepped(selection.without.get(*place)?);
        let screened = inquiry.screened_as(less, *number)?;
        Some((name(*number).to_owned(), inquiry.extended(less, &screened, STARTS, Effort::Thorough)))
    });
    fitted.collect()
}

/// The best commands.
struct Best {
    excitation: Excitation,
    /// Expected gain in log-likelihood over each of the others ...
    gains: Vec<f64>,
    /// ... and the same of the commands that were recorded.
    so_far: Vec<f64>,
    /// Residuals behind the gains.
    rows: usize,
}

/// What commands are compared by.
struct Design<'a, 'b, T: Twin> {
    inquiry: &'a Inquiry<'b, T>,
    selected: &'a Hypothesis<T>,
    others: &'a [(String, Hypothesis<T>)],
    base: &'a Recording<T::Stimulus>,
    family: Vec<Excitation>,
    /// What the first channel may not leave.
    within: [f64; 2],
}

impl<'a, 'b, T: Twin> Design<'a, 'b, T> {
    fn of(inquiry: &'a Inquiry<'b, T>, selected: &'a Hypothesis<T>, others: &'a [(String, Hypothesis<T>)]) -> Option<Self> {
        let parts = &inquiry.evidence.free_run;
        let base = parts.first()?.recording;
        let mut used: Option<[f64; 2]> = None;
        for part in parts {
            for value in inquiry.twin.commands(part.recording)? {
                used = Some(used.map_or([value, value], |[low, high]| [low.min(value), high.max(value)]));
            }
        }
        let used = used.filter(|[low, high]| low.is_finite() && high > low)?;
        let spacing = median(base.time.windows(2).map(|w| w[1] - w[0]).collect());
        if spacing.is_nan() || spacing <= 0.0 {
            return None;
        }
        let rows = ((LONGEST / spacing) as usize).clamp(ROWS.0, ROWS.1);
        let channel = &inquiry.evidence.weights.first()?.channel;
        let values = parts.iter().filter_map(|p| p.recording.channel(channel)).flat_map(|m| m.samples.iter().flatten());
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(*v), high.max(*v)));
        let room = BEYOND * (high - low);
        let family = family(rows, spacing, used, inquiry.seed);
        Some(Self { inquiry, selected, others, base, family, within: [low - room, high + room] })
    }

    /// The commands that tell as many of the others apart as well as can be.
    fn best(&self) -> Option<Best> {
        let worth = |gains: &[f64]| gains.iter().map(|gain| gain.ln_1p()).sum::<f64>();
        let of = |k: usize, refitted: bool| self.gains(&self.recording(&self.family[k])?, true, refitted);
        let all: Vec<usize> = (0..self.family.len()).collect();
        let mut ranked: Vec<(usize, f64)> = all.par_iter().filter_map(|k| Some((*k, worth(&of(*k, false)?.0)))).collect();
        ranked.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        ranked.truncate(REFITTED);
        let refitted: Vec<(usize, Vec<f64>, usize)> = ranked
            .par_iter()
            .filter_map(|(k, _)| {
                let (gains, rows) = of(*k, true)?;
                Some((*k, gains, rows))
            })
            .collect();
        let (k, gains, rows) = refitted.into_iter().max_by(|a, b| worth(&a.1).total_cmp(&worth(&b.1)))?;
        let so_far = self.as_recorded().and_then(|made| self.gains(&made, false, true));
        let so_far = so_far.map_or_else(|| vec![0.0; gains.len()], |(gains, _)| gains);
        Some(Best { excitation: self.family[k].clone(), gains, so_far, rows })
    }

    fn recording(&self, signal: &Excitation) -> Option<Recording<T::Stimulus>> {
        self.inquiry.twin.excited(self.base, signal.time.clone(), signal.command.clone())
    }

    /// The commands of the recording at hand.
    fn as_recorded(&self) -> Option<Recording<T::Stimulus>> {
        let commands = self.inquiry.twin.commands(self.base)?;
        self.inquiry.twin.excited(self.base, self.base.time.clone(), commands)
    }

    /// The gain in log-likelihood over each of the others, `N / 2` times the mean squared separation in units of the noise,
    /// whichever of the two is true, and the number of residuals: with the parameters of the wrong one moved to first order,
    /// or `refitted`. None where a simulation diverges, or leaves what is safe though it `must` not.
    fn gains(&self, recording: &Recording<T::Stimulus>, must: bool, refitted: bool) -> Option<(Vec<f64>, usize)> {
        let mut rows = 0;
        let mut gains = Vec::new();
        for (_, other) in self.others {
            let (forth, count) = self.gain(recording, self.selected, other, must, refitted)?;
            let (back, _) = self.gain(recording, other, self.selected, must, refitted)?;
            gains.push(forth.min(back));
            rows = count;
        }
        (!gains.is_empty()).then_some((gains, rows))
    }

    fn gain(
        &self,
        recording: &Recording<T::Stimulus>,
        truth: &Hypothesis<T>,
        wrong: &Hypothesis<T>,
        must: bool,
        refitted: bool,
    ) -> Option<(f64, usize)> {
        let measured = self.measured(recording, truth, must)?;
        let part = [Part::whole(&measured)];
        let weights = &self.inquiry.evidence.weights;
        let problem = Problem { simulator: &wrong.twin, parts: &part, weights, seed: self.inquiry.seed };
        let parameters = wrong.twin.parameters();
        let free: Vec<usize> = wrong.fit.free.iter().copied().filter(|k| parameters[*k].smooth).collect();
        let state = State::unknown(&problem);
        let (left, rows) = if refitted {
            let fit = fit_smooth(&problem, &wrong.fit.values, &free, &state);
            let rows: usize = problem.blocks().iter().map(|b| b.range.len()).sum();
            (fit.residual.rows(0, rows).norm_squared(), rows)
        } else {
            let evaluation = problem.evaluate(&wrong.fit.values, &state, &free);
            let hidden = evaluation.jacobian.clone().qr().q().tr_mul(&evaluation.residual);
            (evaluation.residual.norm_squared() - hidden.norm_squared(), evaluation.measured)
        };
        // What diverged has residuals beyond any that a system can show.
        (left.is_finite() && rows > 0 && left < 1e12 * rows as f64).then(|| (0.5 * left.max(0.0), rows))
    }

    /// `recording` as it would be measured, without noise, if `truth` were true.
    fn measured(
        &self,
        recording: &Recording<T::Stimulus>,
        truth: &Hypothesis<T>,
        must: bool,
    ) -> Option<Recording<T::Stimulus>> {
        let initial = truth.fit.state.values.first().map_or(&[][..], Vec::as_slice);
        let lane: Vec<f64> = truth.fit.values.iter().chain(initial).copied().collect();
        let rows = 0..recording.len();
        let run = truth.twin.rollout(&Thetas::single(&lane), recording, rows, self.inquiry.seed).pop()?;
        let commands = self.inquiry.twin.commands(recording)?;
        let blank = self.inquiry.twin.excited(recording, recording.time.clone(), commands)?;
        let first = &self.inquiry.evidence.weights.first()?.channel;
        let mut samples = blank.measured.clone();
        for channel in &mut samples {
            let Some(simulated) = run.iter().find(|s| s.channel == channel.channel) else { continue };
            let [low, high] = self.within;
            let safe = |v: &f64| !must || channel.channel != *first || (low..=high).contains(v);
            if !simulated.samples.iter().all(|v| v.is_finite() && safe(v)) {
                return None;
            }
            channel.samples = simulated.samples.iter().map(|v| Some(*v)).collect();
        }
        Some(self.inquiry.twin.resampled(&blank, samples))
    }
}
