//! What is recognized rather than followed: steps of a sensor, and samples it lost.
//!
//! No fit tells of these. A simulated signal can be rounded as the measured one is, and that is better or it is not; a
//! sample that repeats the one before to the last bit, of a signal that never does so otherwise, is no sample.

use super::Stretch;
use super::hypothesis::{Hypothesis, Inquiry};
use super::noise::{fourth_difference, median};
use super::rivals::Place;
use super::selection::Selection;
use super::weigh::{ACCEPT, gain};
use crate::sim2real::{Candidate, Clock, Measured, Recording, Signs, Simulator, Twin};

/// Rounding the simulated signal must leave at most this part of the squared residual.
const LEFT: f64 = 0.7;
/// Fewer repeated samples than this are chance, ...
const FEWEST: usize = 5;
/// ... and so are fewer runs of them: what hardly moves may once repeat itself for as long as anything, ...
const FEWEST_RUNS: usize = 3;
/// ... unless noise moves it, of at least this part of what neighbouring samples differ by ...
const NOISY: f64 = 0.2;
/// ... and so much more finely counted that no two samples are the same by chance.
const FINELY: f64 = 0.01;

/// Adds to a selection what only rounds: as it is, and with nothing fitted anew, for what jumps has no gradient to follow.
pub(super) fn finished<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    mut selection: Selection<T>,
    places: &mut Vec<Place>,
) -> Selection<T> {
    for (number, candidate) in inquiry.candidates.iter().enumerate().filter(|(_, c)| c.finishing) {
        let rounded = inquiry.as_it_is(&selection.selected, number);
        let squares = |h: &Hypothesis<T>| h.misfits.iter().map(|m| m.sum_of_squares).sum::<f64>();
        let gained = gain(inquiry, &selection.selected, &rounded);
        if gained > ACCEPT && squares(&rounded) < LEFT * squares(&selection.selected) {
            places.push(Place { gain: gained, nearest: None, others: Vec::new() });
            selection.without = selection.without.iter().map(|less| inquiry.as_it_is(less, number)).collect();
            selection.without.push(selection.selected.clone());
            selection.selected = rounded;
            selection.note_finished(candidate, gained);
        }
    }
    selection
}

/// Steps count as visible where their rounding makes at least this part of the scatter of neighbouring rows.
const VISIBLE: f64 = 0.3;

/// What the measured channels themselves show.
pub(super) fn signs<T: Simulator>(twin: &T, recordings: &[Recording<T::Stimulus>]) -> Signs {
    let Some(channel) = twin.channels().first().filter(|_| twin.clock() != Clock::Event) else { return Signs::default() };
    let (mut samples, mut repeated, mut runs) = (0, 0, 0);
    let (mut step, mut never_by_chance) = (f64::INFINITY, true);
    for recording in recordings {
        let Some(measured) = recording.channel(&channel.name) else { continue };
        let resolution = twin.resolution(recording, &channel.name);
        let visible = resolution >= VISIBLE * fourth_difference(&measured.samples);
        step = step.min(if visible { resolution * 12.0_f64.sqrt() } else { 0.0 });
        never_by_chance &= restless(measured, resolution);
        let stale = stale(measured, resolution);
        samples += stale.len();
        repeated += stale.iter().filter(|s| **s).count();
        runs += stale.iter().zip(std::iter::once(&false).chain(&stale)).filter(|(now, before)| **now && !**before).count();
    }
    let counted = Signs { step: if step.is_finite() { step } else { 0.0 }, ..Signs::default() };
    if !lost_some(samples, repeated, if never_by_chance { 1 } else { FEWEST_RUNS }, runs) {
        return counted;
    }
    Signs { repeated: repeated as f64 / samples as f64, run: repeated as f64 / runs.max(1) as f64, ..counted }
}

/// Whether so many repeated samples, in so many `runs`, are more than chance, for which it takes a `fewest`. A signal that hardly ever
/// changes has nothing to lose.
fn lost_some(samples: usize, repeated: usize, fewest: usize, runs: usize) -> bool {
    repeated >= FEWEST && runs >= fewest && 2 * repeated <= samples
}

/// Whether noise moves a channel from each sample to the next, so that no two are the same, but where it may have come to the end of its
/// range.
fn restless(measured: &Measured, resolution: f64) -> bool {
    let samples = &measured.samples;
    let pairs = samples.windows(2).filter_map(|w| Some((w[1]? - w[0]?).abs()));
    let (moved, noise) = (median(pairs.collect()), fourth_difference(samples));
    let ends = ends(samples).map(Some);
    let held_there = samples.windows(2).any(|w| w[0] == w[1] && ends.contains(&w[0]));
    noise > NOISY * moved && resolution < FINELY * noise && !held_there
}

/// The least and the largest of all samples.
fn ends(samples: &[Option<f64>]) -> [f64; 2] {
    let present = || samples.iter().flatten().copied();
    [present().fold(f64::INFINITY, f64::min), present().fold(f64::NEG_INFINITY, f64::max)]
}

/// A run of equal samples counts as lost where fewer than this many as long are to be expected by chance ...
const BY_CHANCE: f64 = 0.1;
/// ... and where the signal then leaps by this many of the sensor's steps, as one does that went on unseen, ...
const LEAP: f64 = 2.5;
/// ... or noise of so many steps moves it wherever it stands.
const CHATTERS: f64 = 1.0;
/// What leaps over steps in one row where each takes more than so many was not seen in between, unless noise of so many steps, that of the
/// rounding with it, makes it leap, ...
const LONG: f64 = 3.0;
const QUIET: f64 = 0.45;
/// ... if it is not back within so many.
const COMES_BACK: usize = 4;

/// Which samples repeat the one before though nothing stood still; `resolution` is the standard deviation of the sensor's
/// rounding, 0 where it does not round.
fn stale(measured: &Measured, resolution: f64) -> Vec<bool> {
    let samples = &measured.samples;
    // A sensor at the end of its range repeats itself with reason, each time it comes there: what is held once may be the highest of
    // all by chance.
    let times = |end: f64| samples.chunk_by(|a, b| a == b).filter(|run| run[0] == Some(end)).count();
    let ends = ends(samples).map(|end| (times(end) > 1).then_some(end));
    let repeats = |w: &[Option<f64>]| w[1].is_some() && w[0].map(f64::to_bits) == w[1].map(f64::to_bits);
    let mut stale: Vec<bool> = std::iter::once(false).chain(samples.windows(2).map(repeats)).collect();
    let step = resolution * 12.0_f64.sqrt();
    let longest = if step > 0.0 { longest_by_chance(&stale) } else { 0 };
    let noise = fourth_difference(&without_runs(samples, &stale, longest));
    let never_stands = step == 0.0 || noise > CHATTERS * step;
    let mut from = 0;
    while from < stale.len() {
        let count = stale[from..].iter().take_while(|s| **s).count();
        if count > 0 {
            let held = samples[from].unwrap_or(f64::NAN);
            let after = samples.get(from + count).copied().flatten();
            let leaps = never_stands || after.is_some_and(|v| (v - held).abs() > LEAP * step);
            let lost = match ends.contains(&Some(held)) {
                true => 0,
                false if count > longest && leaps => count,
                false if noise < QUIET * step => unseen(samples, from + count, step).min(count),
                false => 0,
            };
            stale[from..from + count - lost].fill(false);
        }
        from += count.max(1);
    }
    stale
}

/// How many samples before `row` a signal lost that is counted in steps so coarse that it repeats itself for long: where it leaps over
/// steps of which those before and after take many rows each, as many as it takes to cross these. None where it comes back: that is one
/// wrong reading.
fn unseen(samples: &[Option<f64>], row: usize, step: f64) -> usize {
    let (before, after) = samples.split_at(row);
    let (Some(Some(held)), Some(Some(leapt))) = (before.last(), after.first()) else { return 0 };
    let over = ((leapt - held) / step).abs().round() - 1.0;
    let onward = |v: &Option<f64>| v.is_some_and(|v| (v - leapt) * (leapt - held) >= 0.0);
    if !after.iter().take(COMES_BACK).all(onward) {
        return 0;
    }
    let rows = |run: &[Option<f64>]| run.len() as f64;
    // What is held and what is leapt to are seen in part.
    let [last, next] = [before.chunk_by(|a, b| a == b).rev().nth(1), after.chunk_by(|a, b| a == b).nth(1)];
    match (last.map(rows), next.map(rows)) {
        (Some(last), Some(next)) if over >= 1.0 && last.min(next) > LONG => (0.5 * over * (last + next)).ceil() as usize,
        _ => 0,
    }
}

/// The samples without runs of repeats that are longer than `longest`.
fn without_runs(samples: &[Option<f64>], repeats: &[bool], longest: usize) -> Vec<Option<f64>> {
    let mut left = samples.to_vec();
    let mut from = 0;
    for run in repeats.chunk_by(|a, b| a == b) {
        if run[0] && run.len() > longest {
            left[from..from + run.len()].fill(None);
        }
        from += run.len();
    }
    left
}

/// The longest run of repeats that a sensor which counts in steps shows by chance: as often as it repeats itself once, it
/// does so again.
fn longest_by_chance(repeats: &[bool]) -> usize {
    let began = repeats.windows(2).filter(|w| !w[0]).count().max(1);
    let once = repeats.windows(2).filter(|w| !w[0] && w[1]).count();
    let often = once as f64 / began as f64;
    if often <= 0.0 { 0 } else { ((BY_CHANCE / repeats.len() as f64).ln() / often.min(0.99).ln()).ceil() as usize }
}

/// When samples of the first channel were lost: from the last that was not to the next.
pub(super) fn lost<T: Simulator>(twin: &T, recordings: &[Recording<T::Stimulus>]) -> Vec<Stretch> {
    let Some(channel) = twin.channels().first().filter(|_| twin.clock() != Clock::Event) else { return Vec::new() };
    let mut stretches = Vec::new();
    for recording in recordings {
        let Some(measured) = recording.channel(&channel.name) else { continue };
        let stale = stale(measured, twin.resolution(recording, &channel.name));
        let mut row = 0;
        for run in stale.chunk_by(|a, b| a == b) {
            let end = row + run.len();
            if run[0] {
                let time = |row: usize| recording.time[row.min(recording.len() - 1)];
                stretches.push(Stretch { recording: recording.name.clone(), start: time(row), end: time(end) });
            }
            row = end;
        }
    }
    stretches
}

/// The recordings with repeated samples marked as lost.
pub(super) fn without_repeats<T: Simulator>(
    twin: &T,
    recordings: &[Recording<T::Stimulus>],
    channel: &str,
) -> Vec<Recording<T::Stimulus>> {
    let mut cleaned = recordings.to_vec();
    for (recording, cleaned) in recordings.iter().zip(&mut cleaned) {
        let resolution = twin.resolution(recording, channel);
        for measured in cleaned.measured.iter_mut().filter(|m| m.channel == channel) {
            let lost = stale(measured, resolution);
            measured.samples.iter_mut().zip(lost).filter(|(_, lost)| *lost).for_each(|(sample, _)| *sample = None);
        }
    }
    cleaned
}

/// The candidates with what only rounds fixed at what the recordings show.
pub(super) fn fixed(mut candidates: Vec<Candidate>) -> Vec<Candidate> {
    for parameter in candidates.iter_mut().filter(|c| c.finishing).flat_map(|c| &mut c.form.parameters) {
        parameter.nominal = parameter.starts.first().copied().unwrap_or(parameter.nominal);
        parameter.prior = Some(0.0);
    }
    candidates
}

#[cfg(test)]
mod tests {
    use super::*;

    fn measured(samples: Vec<Option<f64>>) -> Measured {
        Measured { channel: "y".into(), unit: String::new(), samples }
    }

    #[test]
    fn a_sample_that_repeats_the_one_before_is_lost_but_at_the_end_of_the_range() {
        let samples = [0.2, 0.2, 0.1, 0.3, 0.3, 0.3, 0.5, 0.5, 0.4, 0.5, 0.5].map(Some).to_vec();
        let lost = [1, 4, 5];
        assert_eq!(stale(&measured(samples.clone()), 0.0), std::array::from_fn::<bool, 11, _>(|i| lost.contains(&i)));
        // Held once, the highest value is one that was held by chance.
        assert_eq!(
            stale(&measured(samples[..8].to_vec()), 0.0),
            std::array::from_fn::<bool, 8, _>(|i| [1, 4, 5, 7].contains(&i))
        );
    }

    #[test]
    fn a_sensor_that_counts_repeats_itself_by_chance_and_loses_samples_all_the_same() {
        let counted = |i: usize| (100.0 * (0.02 * i as f64).sin() + 0.4 * (i as f64 * 1.7).sin()).round();
        let whole: Vec<Option<f64>> = (0..2_000).map(|i| Some(counted(i))).collect();
        let resolution = 1.0 / 12.0_f64.sqrt();
        assert!(stale(&measured(whole.clone()), resolution).iter().all(|s| !s), "nothing was lost");
        let mut held = whole;
        for from in (20..1_900).step_by(157) {
            let last = held[from];
            held[from + 1..from + 31].fill(last);
        }
        let lost = stale(&measured(held), resolution).iter().filter(|s| **s).count();
        assert!((300..=360).contains(&lost), "{lost} of 360");
    }

    #[test]
    fn what_leaps_over_steps_that_otherwise_take_long_was_not_seen_in_between() {
        // A step takes ten rows and more, and the same reading stands for a hundred about where it turns round.
        let signal = |i: usize| (10.0 * (0.01 * i as f64).sin()).round();
        let whole: Vec<f64> = (0..3_000).map(signal).collect();
        let lost = |samples: &[f64]| -> usize {
            let samples = samples.iter().copied().map(Some).collect();
            stale(&measured(samples), 1.0 / 12.0_f64.sqrt()).iter().filter(|s| **s).count()
        };
        assert_eq!(lost(&whole), 0);
        let (mut held, mut unseen) = (whole.clone(), 0);
        for from in (20..2_900).step_by(157) {
            let last = held[from];
            held[from + 1..from + 31].fill(last);
            // Where it hardly moves, what is lost is not missed.
            unseen += if (signal(from + 31) - last).abs() > 1.5 { 30 } else { 0 };
        }
        let found = lost(&held);
        assert!(unseen >= 240 && (0.6..1.2).contains(&(found as f64 / unseen as f64)), "{found} of {unseen}");
        let mut wrong = whole;
        (25..2_900).step_by(300).for_each(|i| wrong[i] += 3.0);
        assert_eq!(lost(&wrong), 0, "a wrong reading comes back");
    }

    /// Noise that is normal enough: the sum of a dozen of a linear congruential generator.
    fn noise(count: usize) -> Vec<f64> {
        let mut state = 1_u64;
        let mut unit = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..count).map(|_| (0..12).map(|_| unit()).sum::<f64>() - 6.0).collect()
    }

    #[test]
    fn one_run_is_lost_of_what_noise_moves_and_none_of_what_rests() {
        let noise = noise(3_000);
        let noisy = |size: f64, i: usize| (0.01 * i as f64).sin() + size * noise[i];
        let shaken: Vec<Option<f64>> = (0..3_000).map(|i| Some(noisy(0.01, i))).collect();
        assert!(restless(&measured(shaken.clone()), 0.0));
        assert!(restless(&measured(shaken.clone()), 1e-5) && !restless(&measured(shaken.clone()), 1e-3), "counted or not");
        let clipped = shaken.iter().map(|y| y.map(|y| y.min(0.9))).collect();
        assert!(!restless(&measured(clipped), 0.0), "the end of its range");
        let still: Vec<Option<f64>> = (0..3_000).map(|i| Some(noisy(1e-5, i))).collect();
        assert!(!restless(&measured(still), 0.0), "what is simulated rests wherever nothing pulls at it");
        assert!(lost_some(3_000, 12, 1, 1) && !lost_some(3_000, 4, 1, 1));
    }

    #[test]
    fn what_noise_moves_by_steps_need_not_leap_after_it_was_lost() {
        let noise = noise(6_000);
        let mut counted: Vec<Option<f64>> =
            (0..6_000).map(|i| Some((3.0 * (0.002 * i as f64).sin() + 1.2 * noise[i]).round())).collect();
        let lost = |samples: &[Option<f64>]| {
            stale(&measured(samples.to_vec()), 1.0 / 12.0_f64.sqrt()).iter().filter(|s| **s).count()
        };
        assert_eq!(lost(&counted), 0);
        for from in (30..5_900).step_by(157) {
            let last = counted[from];
            counted[from + 1..from + 31].fill(last);
        }
        let found = lost(&counted);
        assert!((1_050..1_250).contains(&found), "{found} of 1140");
    }

    #[test]
    fn to_stand_still_once_is_not_to_lose_samples() {
        // About where it turns round it hardly moves, and what it counts stays the same for longer than chance elsewhere has it.
        let counted = |i: usize| (400.0 * (0.004 * i as f64).cos() + 1.5 * (i as f64 * 1.7).sin()).round();
        let mut turning: Vec<Option<f64>> = (0..3_000).map(|i| Some(counted(i))).collect();
        turning[784..796].fill(Some(counted(784)));
        turning[796] = Some(counted(784) - 4.0);
        let stale = stale(&measured(turning), 1.0 / 12.0_f64.sqrt());
        let repeated = stale.iter().filter(|s| **s).count();
        assert!(repeated >= FEWEST, "{repeated}");
        assert!(!lost_some(stale.len(), repeated, FEWEST_RUNS, 1) && lost_some(stale.len(), repeated, FEWEST_RUNS, 4));
    }
}
