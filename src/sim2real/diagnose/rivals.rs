//! Rivals: other mechanisms in the place of each that was selected.

use rayon::prelude::*;

use super::Score;
use super::carry_over::carries_over;
use super::confidence::{Doubts, by_evidence, calibrated};
use super::hypothesis::{Hypothesis, Inquiry};
use super::kin::{OFF_BY, shows_itself, slight};
use super::needed::{completes, share};
use super::pursue::pursued;
use super::screen::Screened;
use super::screening::Screening;
use super::selection::Selection;
use super::weigh::{evidence, gain, lead, lead_unlike, left_open, strained};
use crate::sim2real::{About, Candidate, Clock, Twin};

/// Rivals that lose by more than this are none.
pub(super) const WITHIN: f64 = 10.0;
/// Rivals that lose by less than this in one form are tried in all.
const NEAR: f64 = 3.0 * WITHIN;
/// A law of the same site that has more constants loses by no less than this, whatever of them the data leave open: where a sensor's offset
/// and an eccentric disc were each the other's rival, 17 were the offset and 11 the disc (six spent test seeds).
const LONGER: f64 = 1.0;
/// Other mechanisms fitted in the place of one: those that screening likes best without it, ...
const BY_SCREEN: usize = 3;
/// ... and those that stood best when they were tried beside fewer, and as many more that gained no less than this part of what it did.
const BY_GAIN: usize = 3;
const NEARLY: f64 = 0.8;

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

/// Less than this part of the first misfit is little: ...
const LITTLE: f64 = 0.01;
/// ... a further mechanism that explains little must do so where it was not fitted, and one that is no more likely than this beside
/// its rivals is not worth a name, unless it is beyond doubt that one of them is there ...
const ANYBODYS: f64 = 0.5;
/// ... where what is left without it has at most this many times the mean square of the noise.
const HARDLY_LEFT: f64 = 2.0;
/// One of several that is less likely than this beside its rivals is worth no name at all.
const HARDLY_IT: f64 = 0.05;

/// Evidence above which what is explained away, and whitens all that is left, is no error of another law's form.
const NO_ERROR_OF_FORM: f64 = 200.0;
/// The same where it is so small a share that the form of the first would do to explain it: 210 was gained by a false second
/// (51/109), 2,176 by a right one (71/122).
const NO_FORM_AT_ALL: f64 = 1000.0;

/// Of three, one that is less likely than this to be right, or to have the right one among its rivals, stands for what the forms of the
/// others are off by.
const LIKELY: f64 = 0.65;
/// The same of a special case beside the law that contains it.
const LIKELY_BESIDE_ITS_LAW: f64 = 0.93;

/// Puts rivals that do better in the place of what was selected, until none does; leaves out what might as well be
/// anything; then lists the rivals that remain.
pub(super) fn settled<T: Twin>(inquiry: &Inquiry<'_, T>, selection: Selection<T>) -> (Selection<T>, Vec<Place>) {
    let (mut selection, mut places) = swapped(inquiry, selection);
    while let Some(place) = anybodys(inquiry, &selection, &places) {
        // What was second beside another may be worse than its rivals alone.
        (selection, places) = swapped(inquiry, selection.dropped(inquiry, place));
    }
    // Signatures are as long as the recordings.
    selection.screening = None;
    (selection, places)
}

/// The mechanism, one of several, that explains a small share only and is hardly more likely than its rivals, that others beat of
/// which none is needed in its place, or that stands for what the forms of others are off by.
fn anybodys<T: Twin>(inquiry: &Inquiry<'_, T>, selection: &Selection<T>, places: &[Place]) -> Option<usize> {
    let about = |place: usize| &inquiry.candidates[selection.selected.added[place]].about;
    let whole = &selection.selected;
    (0..places.len()).filter(|_| places.len() > 1).find(|place| {
        let less = &selection.without[*place];
        let explained = share(&selection.recalibrated, less, whole);
        let little = explained < LITTLE;
        let hardly_left = less.within(HARDLY_LEFT);
        let likely = by_evidence(&places[*place]).0;
        let contained = (0..places.len()).any(|other| about(other).contains.contains(&about(*place).name));
        let of_another = contained && hardly_left && sure(places, *place) < LIKELY_BESIDE_ITS_LAW;
        let sampled = inquiry.twin.clock() != Clock::Event;
        // One of several delays may well be there though nobody can tell which.
        let there = || sampled && beyond_doubt(inquiry, less, whole, NO_ERROR_OF_FORM) && carries_over(inquiry, less, whole);
        little && hardly_left && likely < ANYBODYS && !there()
            || sampled && hardly_left && explained < OFF_BY && !beyond_doubt(inquiry, less, whole, NO_FORM_AT_ALL)
            || likely < HARDLY_IT
            || of_another
            || stand_in(places) == Some(*place)
            || little
                && sampled
                && !beyond_doubt(inquiry, less, whole, NO_ERROR_OF_FORM)
                && !carries_over(inquiry, less, whole)
    })
}

/// Whether `whole` leaves nothing but noise of what `less` leaves above it, by so much evidence that no error of form does: where a run is
/// hard to foretell, either half of the recordings says too little of the other.
fn beyond_doubt<T: Twin>(inquiry: &Inquiry<'_, T>, less: &Hypothesis<T>, whole: &Hypothesis<T>, enough: f64) -> bool {
    completes(less, whole) && gain(inquiry, less, whole) > enough
}

/// The one of three or more that is hardly likelier than not, or to have the right one among its rivals, where all others are. Where
/// more than one is so unsure, all of them together may stand for something unknown.
fn stand_in(places: &[Place]) -> Option<usize> {
    let mut unsure = (0..places.len()).filter(|place| sure(places, *place) < LIKELY);
    unsure.next().filter(|_| places.len() > 2 && unsure.next().is_none())
}

/// How likely it is that one of several is right, or has the right one among its rivals.
fn sure(places: &[Place], place: usize) -> f64 {
    let (own, others) = calibrated(&places[place], &Doubts { others: places.len() - 1, ..Doubts::default() });
    own + others.iter().sum::<f64>()
}

/// Puts rivals that do better in the place of what was selected, until none does.
fn swapped<T: Twin>(inquiry: &Inquiry<'_, T>, mut selection: Selection<T>) -> (Selection<T>, Vec<Place>) {
    for _ in 0..SWAPS {
        let places = rivals(inquiry, &selection);
        let mut better: Vec<(usize, usize, f64)> = places
            .iter()
            .enumerate()
            .flat_map(|(place, p)| p.others.iter().map(move |(other, loss)| (place, *other, *loss)))
            .filter(|(_, _, loss)| *loss < 0.0)
            .collect();
        better.sort_by(|a, b| a.2.total_cmp(&b.2));
        // What does better in the place of one may do worse once what is no longer needed is left out.
        let Some(swapped) = better.iter().find_map(|(place, other, _)| selection.swapped(inquiry, *place, *other)) else {
            return (selection, places);
        };
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
        .par_iter()
        .zip(&selection.without)
        .enumerate()
        .map(|(place, (own, less))| {
            let name = inquiry.candidates[*own].about.name;
            let whole = gain(inquiry, less, selected);
            let mut screened = Screening::known_or_made(selection.screening.as_ref(), inquiry, less);
            screened.retain(|one| one.excited && inquiry.candidates[one.number].about.name != name);
            let losses = |tried: Vec<&Screened>| -> Vec<(usize, f64)> {
                let one = |s: &&Screened| {
                    let rival = pursued(inquiry, &selection.recalibrated, selected, less, s);
                    let abouts = (inquiry.candidates[*own].about, inquiry.candidates[s.number].about);
                    let loss = loss(inquiry, &selection.recalibrated, selected, &rival, abouts);
                    // What runs away cannot be compared: it is no rival.
                    (s.number, if loss.is_nan() { f64::INFINITY } else { loss })
                };
                tried.par_iter().map(one).collect()
            };
            let strained = strained(inquiry, selected);
            let any_of_site = strained || selection.complete() && inquiry.at_a_bound(selected, place);
            let mut others = losses(likely(inquiry, selection, &screened, *own, any_of_site));
            let kin_too = !selected.leaves_nothing();
            others.extend(losses(further_forms(inquiry, &screened, &others, *own, kin_too, strained)));
            best_forms(inquiry, &mut others);
            let nearest = others.iter().map(|(_, loss)| *loss).filter(|loss| loss.is_finite()).min_by(f64::total_cmp);
            Place { gain: whole, nearest, others: others.into_iter().filter(|(_, loss)| *loss < WITHIN).collect() }
        })
        .collect()
}

/// The mechanisms that may be rivals of candidate `own` among what was screened, each in the form that looks best: the likeliest, and
/// those of which one is a special case of the other, whatever screening, which sees how they begin, says of them. A law of which a
/// constant ended at a bound is a simpler one there, and may be that of any name of its site; so may what drags the twin's own parameters
/// where they can hardly be.
fn likely<'s, T: Twin>(
    inquiry: &Inquiry<'_, T>,
    selection: &Selection<T>,
    screened: &'s [Screened],
    own: usize,
    any_of_site: bool,
) -> Vec<&'s Screened> {
    let kin = |one: &Screened| {
        let (own, other) = (inquiry.candidates[own].about, inquiry.candidates[one.number].about);
        own.contains.contains(&other.name) || other.contains.contains(&own.name) || any_of_site && own.site == other.site
    };
    let name = |one: &Screened| inquiry.candidates[one.number].about.name;
    let own_name = inquiry.candidates[own].about.name;
    let stage = best_stage(&selection.scores, own_name);
    let gained = |one: &Screened| {
        let Candidate { about, form, .. } = &inquiry.candidates[one.number];
        let tried = selection.scores.iter().filter(|s| s.mechanism == about.name && s.form == form.name);
        tried.filter(|s| Some(s.stage) == stage).filter_map(|s| s.gain).filter(|gain| *gain > 0.0).fold(0.0, f64::max)
    };
    let mut order: Vec<&Screened> = screened.iter().collect();
    let mut kept: Vec<&Screened> = Vec::new();
    let mut keep = |key: &dyn Fn(&Screened) -> f64, most: usize| {
        order.sort_by(|a, b| key(b).total_cmp(&key(a)));
        let before = kept.len();
        for one in order.iter().filter(|one| key(one) > 0.0) {
            if kept.len() - before < most && !kept.iter().any(|other| name(other) == name(one)) {
                kept.push(one);
            }
        }
    };
    keep(&gained, BY_GAIN);
    let of_own = selection.scores.iter().filter(|s| Some(s.stage) == stage && s.mechanism == own_name);
    let nearly = NEARLY * of_own.filter_map(|s| s.gain).fold(0.0, f64::max);
    keep(&|one| if gained(one) > nearly { gained(one) } else { 0.0 }, BY_GAIN);
    keep(&|one| one.score, BY_SCREEN);
    keep(&|one| if kin(one) { 1.0 + one.score } else { 0.0 }, screened.len());
    kept
}

/// The stage in which the fewest others gained more than the mechanism of that `name`: what did well beside the same as it did may do as
/// well in its place, and what gained more before it, as another of the set did, may not.
fn best_stage(scores: &[Score], name: &str) -> Option<usize> {
    let ahead = |own: &Score| -> usize {
        let better = |other: &&Score| other.stage == own.stage && other.mechanism != name && other.gain > own.gain;
        scores.iter().filter(better).count()
    };
    scores.iter().filter(|s| s.mechanism == name && s.gain.is_some()).min_by_key(|s| (ahead(s), s.stage)).map(|s| s.stage)
}

/// The forms not tried yet of the rivals that come near, and of the special cases of candidate `own`: one of these is as good as that law
/// where it is all that shows of it, and the form that screening likes best may lead nowhere. The same of the laws that `own` is a special
/// case of, if that leaves something for `kin_too` to explain, and of all of its site beside a `strained` twin.
fn further_forms<'s, T: Twin>(
    inquiry: &Inquiry<'_, T>,
    screened: &'s [Screened],
    tried: &[(usize, f64)],
    own: usize,
    kin_too: bool,
    strained: bool,
) -> Vec<&'s Screened> {
    let name = |number: usize| inquiry.candidates[number].about.name;
    let near = |one: &Screened| tried.iter().any(|(other, loss)| *loss < NEAR && name(*other) == name(one.number));
    let contains = |law: usize, other: usize| inquiry.candidates[law].about.contains.contains(&name(other));
    let kin = |one: &Screened| contains(own, one.number) || kin_too && contains(one.number, own);
    let untried = |one: &Screened| !tried.iter().any(|(other, _)| *other == one.number);
    let of_site =
        |one: &Screened| strained && inquiry.candidates[own].about.site == inquiry.candidates[one.number].about.site;
    screened.iter().filter(|one| (near(one) || kin(one) || of_site(one)) && untried(one)).collect()
}

/// Leaves each mechanism in the form that loses least.
fn best_forms<T: Twin>(inquiry: &Inquiry<'_, T>, others: &mut Vec<(usize, f64)>) {
    let name = |number: usize| inquiry.candidates[number].about.name;
    let mut best: Vec<(usize, f64)> = Vec::new();
    for (number, loss) in others.drain(..) {
        match best.iter_mut().find(|(other, _)| name(*other) == name(number)) {
            Some(known) if loss < known.1 => *known = (number, loss),
            Some(_) => {}
            None => best.push((number, loss)),
        }
    }
    *others = best;
}

/// By how much the rival loses; negative where it is to be preferred.
///
/// A law that contains another as a special case must explain a share of the first misfit more than that, or all that is left
/// of it, and be better by more than others: laws never have quite the form of the real thing, and one more constant bends anything a little nearer.
/// Where what it says more shows itself, the evidence alone decides.
fn loss<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    first: &Hypothesis<T>,
    selected: &Hypothesis<T>,
    rival: &Hypothesis<T>,
    (own, other): (About, About),
) -> f64 {
    let loss = lead(inquiry, first, selected, rival);
    if shows_itself(inquiry, first, [rival, selected], [&other, &own])
        || shows_itself(inquiry, first, [selected, rival], [&own, &other])
    {
        return lead_unlike(inquiry, first, selected, rival);
    }
    if own.contains.contains(&other.name) && rival.free() < selected.free() {
        return if slight(inquiry, first, rival, selected) { loss.min(-1.0) } else { loss - WITHIN };
    }
    if other.contains.contains(&own.name) && rival.free() > selected.free() {
        // Not preferred is not excluded: neither by constants that these data leave open, nor by how little the two differ.
        let listed = (evidence(inquiry, first, selected, rival) - left_open(inquiry, selected, rival)).max(0.5 * WITHIN);
        return match slight(inquiry, first, selected, rival) {
            true => listed,
            // Of messages laws have the form they are written in: what comes near may well be the one.
            false if inquiry.twin.clock() == Clock::Event => loss,
            false => listed.min(loss + WITHIN),
        };
    }
    // Nor is one of the same site that contains nothing of it excluded by constants that these data leave open.
    let longer = inquiry.twin.clock() != Clock::Event && rival.free() > selected.free() && own.site == other.site;
    if longer { listed_as(loss, left_open(inquiry, selected, rival)) } else { loss }
}

/// What a rival with more constants loses, but for what counting those that data leave open charges it too much.
fn listed_as(loss: f64, open: f64) -> f64 {
    (loss - open).max(LONGER).min(loss)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constants_that_are_left_open_exclude_nothing_and_are_preferred_to_nothing() {
        assert_eq!(listed_as(8.6, 7.9), LONGER, "an eccentric disc of which one constant is told, for an offset");
        assert_eq!([listed_as(60.0, 7.9), listed_as(8.6, 0.0)], [60.0 - 7.9, 8.6]);
        assert_eq!([listed_as(0.4, 7.9), listed_as(-3.0, 7.9)], [0.4, -3.0], "what is better is so as it is");
    }

    #[test]
    fn rivals_are_those_that_did_well_where_a_name_did_best() {
        let score = |mechanism: &str, stage, gain: f64| Score {
            mechanism: mechanism.to_owned(),
            form: String::new(),
            stage,
            screen: 0.0,
            survival: 1.0,
            excited: true,
            gain: (gain > 0.0).then_some(gain),
            accepted: false,
        };
        // Alone a spring gains much, and frictions more; beside one of these nothing gains as much as it.
        let scores = [
            score("friction", 0, 9_000.0),
            score("hysteresis", 0, 8_000.0),
            score("spring", 0, 900.0),
            score("spring", 1, 400.0),
            score("hysteresis", 1, 20.0),
        ];
        assert_eq!(best_stage(&scores, "spring"), Some(1));
        assert_eq!(best_stage(&scores, "friction"), Some(0));
        assert_eq!(best_stage(&scores, "hysteresis"), Some(0), "as many ahead of it: the first");
        assert_eq!(best_stage(&scores, "lag"), None);
    }

    #[test]
    fn the_one_unsure_name_of_three_is_a_stand_in() {
        let place = |gain: f64| Place { gain, nearest: None, others: Vec::new() };
        let [sure, unsure] = [place(5_000.0), place(100.0)];
        assert_eq!(stand_in(&[sure.clone(), unsure.clone(), sure.clone()]), Some(1));
        assert_eq!(stand_in(&[sure.clone(), unsure.clone()]), None, "a second may well be weak");
        assert_eq!(
            stand_in(&[unsure.clone(), unsure.clone(), sure.clone()]),
            None,
            "together they stand for something else"
        );
        // A name is as sure as it and its rivals are together.
        let shared = Place { gain: 5_000.0, nearest: Some(0.0), others: vec![(7, 0.0)] };
        assert_eq!(stand_in(&[sure.clone(), shared, sure]), None);
    }
}
