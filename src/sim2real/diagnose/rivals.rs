//! Rivals: other mechanisms in the place of each that was selected.

use rayon::prelude::*;

use super::confidence::by_evidence;
use super::hypothesis::{Hypothesis, Inquiry};
use super::screen::Screened;
use super::select::Selection;
use super::weigh::{SHARE, completes, gain, lead, pursued, share};
use crate::sim2real::{About, Candidate, Twin};

/// What a law explains more of the first misfit than a special case of it counts from this part on.
const SLIGHT: f64 = 0.02;
/// Rivals that lose by more than this are none.
pub(super) const WITHIN: f64 = 10.0;
/// Other mechanisms fitted in the place of one: those that screening likes best without it, ...
const BY_SCREEN: usize = 3;
/// ... and those that stood best when they were tried beside fewer.
const BY_GAIN: usize = 3;

/// The rivals of one selected mechanism.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Place {
    /// What is lost by leaving the mechanism out.
    pub gain: f64,
    /// By how much the nearest of all that were tried in its place loses; none where there was none to try.
    pub nearest: Option<f64>,
    /// Other mechanisms in its place: number of the candidate, and by how much it loses (negative: wins).
    pub others: Vec<(usize, f64)>,
}

/// Swaps tried at the most.
const SWAPS: usize = 4;

/// A further mechanism that explains little, and is no more likely than this beside its rivals, is not worth a name ...
const ANYBODYS: f64 = 0.4;
/// ... where what is left without it has at most this many times the mean square of the noise.
const HARDLY_LEFT: f64 = 2.0;

/// Puts rivals that do better in the place of what was selected, until none does; leaves out what might as well be
/// anything; then lists the rivals that remain.
pub(super) fn settled<T: Twin>(inquiry: &Inquiry<'_, T>, selection: Selection<T>) -> (Selection<T>, Vec<Place>) {
    let (mut selection, mut places) = swapped(inquiry, selection);
    while let Some(place) = anybodys(&selection, &places) {
        selection = selection.dropped(inquiry, place);
        places = rivals(inquiry, &selection);
    }
    (selection, places)
}

/// The mechanism, one of several, that explains a small share only and is hardly more likely than its rivals.
fn anybodys<T: Twin>(selection: &Selection<T>, places: &[Place]) -> Option<usize> {
    let whole = &selection.selected;
    (0..places.len()).filter(|_| places.len() > 1).find(|place| {
        let less = &selection.without[*place];
        let little = share(&selection.recalibrated, less, whole) < SHARE && less.within(HARDLY_LEFT);
        little && by_evidence(&places[*place]).0 < ANYBODYS
    })
}

/// Puts rivals that do better in the place of what was selected, until none does.
fn swapped<T: Twin>(inquiry: &Inquiry<'_, T>, mut selection: Selection<T>) -> (Selection<T>, Vec<Place>) {
    for _ in 0..SWAPS {
        let places = rivals(inquiry, &selection);
        let best = places
            .iter()
            .enumerate()
            .flat_map(|(place, p)| p.others.iter().map(move |(other, loss)| (place, *other, *loss)))
            .filter(|(_, _, loss)| *loss < 0.0)
            .min_by(|a, b| a.2.total_cmp(&b.2));
        let Some((place, other, _)) = best else { return (selection, places) };
        let Some(swapped) = selection.swapped(inquiry, place, other) else { return (selection, places) };
        selection = swapped;
    }
    let places = rivals(inquiry, &selection);
    (selection, places)
}

/// The rivals of each selected mechanism, in their order.
fn rivals<T: Twin>(inquiry: &Inquiry<'_, T>, selection: &Selection<T>) -> Vec<Place> {
    let selected = &selection.selected;
    selected
        .added
        .iter()
        .zip(&selection.without)
        .map(|(own, less)| {
            let name = inquiry.candidates[*own].about.name;
            let whole = gain(inquiry, less, selected);
            let screened = likely(inquiry, selection, less, name);
            let others: Vec<(usize, f64)> = screened
                .par_iter()
                .map(|s| (s.number, pursued(inquiry, &selection.recalibrated, selected, less, s)))
                .map(|(other, rival)| {
                    let abouts = (inquiry.candidates[*own].about, inquiry.candidates[other].about);
                    (other, loss(inquiry, &selection.recalibrated, selected, &rival, abouts))
                })
                .collect();
            let nearest = others.iter().map(|(_, loss)| *loss).min_by(f64::total_cmp);
            Place { gain: whole, nearest, others: others.into_iter().filter(|(_, loss)| *loss < WITHIN).collect() }
        })
        .collect()
}

/// The mechanisms that may be rivals of `own` beside what `less` has, each in its best form.
fn likely<T: Twin>(inquiry: &Inquiry<'_, T>, selection: &Selection<T>, less: &Hypothesis<T>, own: &str) -> Vec<Screened> {
    let name = |one: &Screened| inquiry.candidates[one.number].about.name;
    let gained = |one: &Screened| {
        let Candidate { about, form, .. } = &inquiry.candidates[one.number];
        let tried = selection.scores.iter().filter(|s| s.mechanism == about.name && s.form == form.name);
        tried.filter_map(|s| s.gain).filter(|gain| *gain > 0.0).fold(0.0, f64::max)
    };
    let mut screened = inquiry.screened(less);
    screened.retain(|one| one.excited && name(one) != own);
    let mut kept: Vec<Screened> = Vec::new();
    let mut keep = |screened: &mut Vec<Screened>, key: &dyn Fn(&Screened) -> f64, most: usize| {
        screened.sort_by(|a, b| key(b).total_cmp(&key(a)));
        let before = kept.len();
        for one in screened.iter().filter(|one| key(one) > 0.0) {
            if kept.len() - before < most && !kept.iter().any(|other| name(other) == name(one)) {
                kept.push(one.clone());
            }
        }
    };
    keep(&mut screened, &gained, BY_GAIN);
    keep(&mut screened, &|one| one.score, BY_SCREEN);
    kept
}

/// By how much the rival loses; negative where it is to be preferred.
///
/// A law that contains another as a special case must explain a share of the first misfit more than that, or all that is left
/// of it, and be better by more than others: laws never have quite the form of the real thing, and one more constant bends anything a little nearer.
fn loss<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    first: &Hypothesis<T>,
    selected: &Hypothesis<T>,
    rival: &Hypothesis<T>,
    (own, other): (About, About),
) -> f64 {
    let loss = lead(inquiry, first, selected, rival);
    if own.contains.contains(&other.name) && rival.free() < selected.free() {
        let slight = share(first, rival, selected) < SLIGHT && !completes(rival, selected);
        return if slight { loss.min(-1.0) } else { loss - WITHIN };
    }
    if other.contains.contains(&own.name) && rival.free() > selected.free() {
        let slight = share(first, selected, rival) < SLIGHT && !completes(selected, rival);
        return if slight { loss.max(0.5 * WITHIN) } else { loss + WITHIN };
    }
    loss
}
