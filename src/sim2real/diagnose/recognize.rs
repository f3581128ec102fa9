//! What is recognized rather than followed: steps of a sensor, and samples it lost.
//!
//! No fit tells of these. A simulated signal can be rounded as the measured one is, and that is better or it is not; a
//! sample that repeats the one before to the last bit, of a signal that never does so otherwise, is no sample.

use super::hypothesis::{Hypothesis, Inquiry};
use super::rivals::Place;
use super::select::{ACCEPT, Selection, gain};
use crate::sim2real::{Candidate, Measured, Recording, Signs, Simulator, Twin};

/// Rounding the simulated signal must leave at most this part of the squared residual.
const LEFT: f64 = 0.7;
/// Fewer repeated samples than this are chance.
const FEWEST: usize = 5;

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
            places.push(Place { gain: gained, others: Vec::new() });
            selection.without = selection.without.iter().map(|less| inquiry.as_it_is(less, number)).collect();
            selection.without.push(selection.selected.clone());
            selection.selected = rounded;
            selection.note_finished(candidate, gained);
        }
    }
    selection
}

/// What the measured channels themselves show.
pub(super) fn signs<T: Simulator>(twin: &T, recordings: &[Recording<T::Stimulus>]) -> Signs {
    let (mut samples, mut repeated, mut runs) = (0, 0, 0);
    let Some(channel) = twin.channels().first() else { return Signs::default() };
    for recording in recordings {
        let Some(measured) = recording.channel(&channel.name) else { continue };
        // A sensor that counts in steps repeats itself whenever the signal is slow.
        if twin.resolution(recording, &channel.name) > 0.0 {
            continue;
        }
        let stale = stale(measured);
        samples += stale.len();
        repeated += stale.iter().filter(|s| **s).count();
        runs += stale.iter().zip(std::iter::once(&false).chain(&stale)).filter(|(now, before)| **now && !**before).count();
    }
    // A signal that hardly ever changes has nothing to lose.
    if repeated < FEWEST || 2 * repeated > samples {
        return Signs::default();
    }
    Signs { repeated: repeated as f64 / samples as f64, run: repeated as f64 / runs.max(1) as f64 }
}

/// Which samples repeat the one before.
fn stale(measured: &Measured) -> Vec<bool> {
    let repeats = |w: &[Option<f64>]| w[1].is_some() && w[0].map(f64::to_bits) == w[1].map(f64::to_bits);
    std::iter::once(false).chain(measured.samples.windows(2).map(repeats)).collect()
}

/// The recordings with repeated samples marked as lost.
pub(super) fn without_repeats<S: Clone>(recordings: &[Recording<S>], channel: &str) -> Vec<Recording<S>> {
    let mut cleaned = recordings.to_vec();
    for measured in cleaned.iter_mut().flat_map(|r| &mut r.measured).filter(|m| m.channel == channel) {
        let lost = stale(measured);
        measured.samples.iter_mut().zip(lost).filter(|(_, lost)| *lost).for_each(|(sample, _)| *sample = None);
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

    #[test]
    fn a_sample_that_repeats_the_one_before_is_lost() {
        let samples = vec![Some(0.1), Some(0.1), None, None, Some(0.2), Some(0.3), Some(0.3), Some(0.3)];
        let measured = Measured { channel: "y".into(), unit: String::new(), samples };
        assert_eq!(stale(&measured), [false, true, false, false, false, false, true, true]);
        let recording = Recording { name: String::new(), time: vec![0.0; 8], stimulus: (), measured: vec![measured] };
        let cleaned = without_repeats(&[recording], "y");
        assert_eq!(cleaned[0].measured[0].samples.iter().flatten().count(), 3);
    }
}
