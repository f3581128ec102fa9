//! Selection: which set of mechanisms the evidence asks for, and no more.

use rayon::prelude::*;

use super::forms::in_best_forms;
use super::free_run::steadiest_first;
use super::hypothesis::{Hypothesis, Inquiry, STARTS};
use super::needed::needed_share;
use super::order::in_either_order;
use super::prune::{best_part, others_as_good};
use super::screen::Screened;
use super::screening::Screening;
use super::selection::Selection;
use super::weigh::{ACCEPT, gain, lead, ranked, squares};
use super::whiteness::ChannelMisfit;
use super::{Progress, Score};
use crate::sim2real::identify::Effort;
use crate::sim2real::{About, Candidate, Clock, Twin};

/// A twin that leaves a mean squared residual of at most this many times the noise is not bent by what it lacks.
const UNBENT: f64 = 1.05;
/// A twin that leaves a mean squared residual of at most this many times the noise lacks little.
const NEARLY_ALL: f64 = 9.0;
/// Most mechanisms in a set.
const STAGES: usize = 3;
/// Hypotheses that each stage hands to the next: the best alone may be the wrong one to build on.
const BEAM: usize = 6;
/// Mechanisms fitted from each hypothesis of the beam at the most, and from all others than the best together.
const FITTED: usize = 6;
const BESIDE: usize = 9;
/// Of these, those that are fitted to their end: as many as stood best after a few steps.
const FINISHED: usize = 5;
/// A hypothesis behind the best by more than this part of what that gains is not built on, ...
const FAR_BEHIND: f64 = 0.5;
/// ... unless it leaves no more than this many times as much: with residuals as correlated as theirs, gains say little.
const AS_MUCH: f64 = 1.5;
/// Of the sets of each stage so many are kept, and so many of those with one mechanism more than was selected begin a resumed selection.
const IN_MIND: usize = 12;
const KNOWN: usize = 3;
/// What leaves so many times less than all of the beam is in it, and what leaves so many times less than what it builds on is gone on from,
/// however little its gain.
const BY_FAR: f64 = 2.0;
/// Mechanisms of several forms of which all are fitted: those that stood best in the form that screening liked best.
const IN_ALL_FORMS: usize = 3;
/// So are those of mechanisms, and of so many at the most, whose signature promised to explain this part of the misfit and more, and
/// whose fit came to less than this part of what was promised: screening likes a form for what it does at its starts.
const PROMISED: f64 = 0.1;
const KEPT: f64 = 0.5;
const BROKEN_PROMISES: usize = 2;
/// The same where none kept what its signature promised.
const ALL_BROKEN: usize = 8;
/// Beside so many mechanisms and more, a signature has to promise something: what bent the twin is among them.
const WITH_ALL: usize = 2;
/// Signatures with a cosine above this look alike: such rivals are fitted too.
const ALIKE: f64 = 0.9;
/// Starts that are followed of mechanisms that are fitted though as many as [`FITTED`] promise more, and of all that are fitted beside
/// others than the best; ...
const UNPROMISING: usize = 2;
/// ... unless they may begin at more places than this.
const FEW_PLACES: usize = 8;
/// Candidates that are fitted however little evidence the parent's residuals seem to hold.
const ALWAYS_FITTED: usize = 3;
/// Others are fitted if their signature, with this many times the evidence the parent's residuals hold, could gain
/// what acceptance asks for: once more is explained, residuals hold more evidence.
const BENEFIT_OF_DOUBT: f64 = 4.0;

/// Selects stage by stage, then leaves out again what the whole does not need.
pub(super) fn select<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    recalibrated: Hypothesis<T>,
    progress: Progress<'_>,
) -> Selection<T> {
    selected_from(inquiry, recalibrated, None, Vec::new(), progress)
}

/// The same, going on from `start` if there is one, and with the fits that are `known` of what is beside it.
fn selected_from<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    recalibrated: Hypothesis<T>,
    start: Option<Hypothesis<T>>,
    mut known: Vec<Hypothesis<T>>,
    progress: Progress<'_>,
) -> Selection<T> {
    let mut scores = Vec::new();
    let mut fitted: Vec<Hypothesis<T>> = Vec::new();
    let first_stage = start.as_ref().map_or(0, |start| start.added.len());
    let screening = start.is_none().then(|| {
        progress("screening mechanisms", 0, 1);
        Screening::beside(inquiry, &recalibrated)
    });
    let mut beam = vec![start.clone().unwrap_or_else(|| recalibrated.clone())];
    let mut best_of_stage: Vec<Hypothesis<T>> = start.into_iter().collect();
    let mut as_good: Vec<Hypothesis<T>> = Vec::new();
    for stage in first_stage..STAGES {
        progress("comparing mechanisms", stage, STAGES);
        let (mut children, tried) = expand(inquiry, &recalibrated, &beam, stage, screening.as_ref());
        scores.extend(tried);
        if !known.is_empty() {
            children.append(&mut known);
            children = ranked(inquiry, &beam[0], children);
        }
        if stage > 0 {
            children = in_best_forms(inquiry, &beam[0], children);
        }
        let parent = best_of_stage.last().unwrap_or(&recalibrated);
        steadiest_first(inquiry, &recalibrated, parent, &mut children);
        fitted.extend(children.iter().take(IN_MIND).cloned());
        let Some(best) = children.first().cloned() else { break };
        let promising = gain(inquiry, parent, &best) > ACCEPT
            || stage == 0 && best.leaves_something()
            || squares(&best) * BY_FAR < squares(parent);
        if promising && stage + 1 == STAGES {
            as_good = others_as_good(inquiry, parent, &best, &children);
        }
        best_of_stage.push(best);
        if !promising {
            break;
        }
        beam = built_on(inquiry, &recalibrated, &beam[0], children);
    }
    let (recalibrated, selected, without) = best_part(inquiry, &recalibrated, best_of_stage, as_good);
    Selection { recalibrated, selected, without, fitted, scores, screening }
}

/// What is found beside `selection` as another inquiry follows the recordings. What was of no use beside it so far may do much there, and a
/// fit finds it that begins from where it stood.
pub(super) fn resumed<T: Twin>(inquiry: &Inquiry<'_, T>, selection: &Selection<T>, progress: Progress<'_>) -> Selection<T> {
    let refitted = |hypothesis| inquiry.refitted_afresh(hypothesis);
    let both = || rayon::join(|| refitted(&selection.selected), || refitted(&selection.recalibrated));
    let known: Vec<&Hypothesis<T>> = selection.beside(inquiry).take(KNOWN).collect();
    let ((start, recalibrated), known) = rayon::join(both, || known.into_par_iter().map(refitted).collect());
    let found = selected_from(inquiry, recalibrated, Some(start), known, progress);
    let scores = selection.scores.iter().cloned().chain(found.scores).collect();
    Selection { scores, ..found }
}

/// Which of the `children` of the best of the last stage and of others, best first, are built on. The best alone may be the wrong one,
/// unless it leaves nothing; what explains far less is not the right one either. What leaves least by far is, though its residuals may be
/// so correlated that they count for nothing: an offset that is still missing makes them so.
fn built_on<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    first: &Hypothesis<T>,
    parent: &Hypothesis<T>,
    mut children: Vec<Hypothesis<T>>,
) -> Vec<Hypothesis<T>> {
    let best = children[0].clone();
    if best.leaves_nothing() {
        return vec![best];
    }
    if let Some(least) = least_by_far(&children) {
        children.swap(BEAM - 1, least);
    }
    children.truncate(BEAM);
    let far = FAR_BEHIND * gain(inquiry, parent, &best).max(0.0);
    children
        .retain(|child| squares(child) <= AS_MUCH * squares(&best) || lead(inquiry, first, &best, child) <= far.max(ACCEPT));
    children
}

/// The place of the one behind the beam that leaves less than any in it by far.
fn least_by_far<T>(children: &[Hypothesis<T>]) -> Option<usize> {
    let left: Vec<f64> = children.iter().map(squares).collect();
    let least = (BEAM..left.len()).min_by(|a, b| left[*a].total_cmp(&left[*b]))?;
    left[..BEAM].iter().all(|other| *other > BY_FAR * left[least]).then_some(least)
}

/// A candidate that may be fitted beside one of the beam.
struct Job {
    /// Its parent's place in the beam.
    place: usize,
    screened: Screened,
    /// How many of its starts are followed; none where it is not fitted at first.
    starts: usize,
}

/// All sets one larger than those of the beam, best first, and how each mechanism did beside the best of the beam.
fn expand<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    first: &Hypothesis<T>,
    beam: &[Hypothesis<T>],
    stage: usize,
    screening: Option<&Screening>,
) -> (Vec<Hypothesis<T>>, Vec<Score>) {
    let beside = |(place, parent): (usize, &Hypothesis<T>)| -> Vec<Job> {
        let mut screened = Screening::known_or_made(screening, inquiry, parent);
        screened.sort_by(|a, b| b.score.total_cmp(&a.score));
        let chosen = chosen(inquiry, first, parent, &screened, place);
        screened.into_iter().zip(chosen).map(|(screened, starts)| Job { place, screened, starts }).collect()
    };
    let mut jobs: Vec<Job> = beam.par_iter().enumerate().flat_map_iter(beside).collect();
    once(beam, &mut jobs);
    let fit = |starts: &[usize]| -> Vec<Option<Hypothesis<T>>> {
        let one = |(Job { place, screened, .. }, starts): (&Job, &usize)| {
            let extended = || inquiry.extended(&beam[*place], screened, *starts, Effort::Brief);
            (*starts > 0).then(|| in_either_order(inquiry, extended(), Effort::Brief))
        };
        jobs.par_iter().zip(starts).map(one).collect()
    };
    let first_round: Vec<usize> = jobs.iter().map(|job| job.starts).collect();
    let mut brief = fit(&first_round);
    let further = further_forms(inquiry, &beam[0], &jobs, &brief);
    for (one, other) in brief.iter_mut().zip(fit(&further)) {
        *one = one.take().or(other);
    }
    let fitted = finished(inquiry, &beam[0], brief);
    let scores = jobs
        .iter()
        .zip(&fitted)
        .filter(|(job, _)| job.place == 0)
        .map(|(Job { screened, .. }, child)| {
            let candidate = &inquiry.candidates[screened.number];
            Score {
                mechanism: candidate.about.name.to_owned(),
                form: candidate.form.name.to_owned(),
                stage,
                screen: screened.score.max(0.0),
                survival: screened.survival,
                excited: screened.excited,
                gain: child.as_ref().map(|child| gain(inquiry, &beam[0], child)),
                accepted: false,
            }
        })
        .collect();
    (ranked(inquiry, &beam[0], fitted.into_iter().flatten().collect()), scores)
}

/// Leaves of the chosen jobs one for each set, and beside those of the best parent as many as would leave least if the others
/// did all that their signatures promise.
fn once<T: Twin>(beam: &[Hypothesis<T>], jobs: &mut [Job]) {
    let left = |job: &Job| squares(&beam[job.place]) * (1.0 - job.screened.score.powi(2));
    let mut order: Vec<usize> = (0..jobs.len()).filter(|k| jobs[*k].starts > 0).collect();
    order.sort_by(|a, b| {
        let (a, b) = (&jobs[*a], &jobs[*b]);
        (a.place > 0).cmp(&(b.place > 0)).then(left(a).total_cmp(&left(b)))
    });
    let mut sets: Vec<Vec<usize>> = Vec::new();
    let mut beside = 0;
    for k in order {
        let job = &mut jobs[k];
        let mut set = beam[job.place].set();
        set.push(job.screened.number);
        set.sort_unstable();
        beside += usize::from(job.place > 0);
        if sets.contains(&set) || beside > BESIDE {
            job.starts = 0;
        }
        sets.push(set);
    }
}

/// The forms not fitted yet of those mechanisms that stand best beside the best parent, or fell short of what they promised; a wider law
/// of the very best alone. How many starts of each are followed.
fn further_forms<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    parent: &Hypothesis<T>,
    jobs: &[Job],
    brief: &[Option<Hypothesis<T>>],
) -> Vec<usize> {
    let name = |number: usize| inquiry.candidates[number].about.name;
    let own = jobs.iter().zip(brief).filter(|(job, _)| job.place == 0);
    // What has one form alone takes the place of nothing that has others.
    let has_others = |added: &str| inquiry.candidates.iter().filter(|c| !c.general && c.about.name == added).count() > 1;
    let mut best: Vec<&str> = Vec::new();
    for child in ranked(inquiry, parent, own.filter_map(|(_, child)| child.clone()).collect()) {
        let added = child.added.last().map_or("", |number| name(*number));
        if best.iter().filter(|name| has_others(name)).count() < IN_ALL_FORMS && !best.contains(&added) {
            best.push(added);
        }
    }
    let broken = broken_promises(inquiry, parent, jobs, brief);
    let further = |Job { place, screened: one, starts }: &Job| {
        let known = match inquiry.candidates[one.number].general {
            true => best.first().is_some_and(|first| *first == name(one.number)),
            false => best.contains(&name(one.number)) || broken.iter().any(|number| name(*number) == name(one.number)),
        };
        if *place == 0 && *starts == 0 && one.excited && known { STARTS } else { 0 }
    };
    jobs.iter().map(further).collect()
}

/// The candidates beside the best parent that explain far less than their signatures promised, those that promised most first: more of
/// them where none has kept its promise, for then it is the fits that went astray. Fits to messages, which do not add up, do not.
fn broken_promises<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    parent: &Hypothesis<T>,
    jobs: &[Job],
    brief: &[Option<Hypothesis<T>>],
) -> Vec<usize> {
    let own = jobs.iter().zip(brief).filter(|(job, _)| job.place == 0);
    let promises = own.filter_map(|(Job { screened: one, .. }, child)| {
        let (promised, kept) = (one.score.max(0.0).powi(2), 1.0 - squares(child.as_ref()?) / squares(parent));
        (promised > PROMISED).then_some((promised, kept, one.number))
    });
    let mut promises: Vec<(f64, f64, usize)> = promises.collect();
    promises.sort_by(|a, b| b.0.total_cmp(&a.0));
    let most = promises.iter().map(|(_, kept, _)| *kept).fold(0.0, f64::max);
    let sampled = inquiry.twin.clock() != Clock::Event;
    let astray = sampled && promises.first().is_some_and(|(promised, _, _)| most < KEPT * promised);
    let broken = promises.into_iter().filter(|(promised, kept, _)| *kept < KEPT * promised);
    broken.take(if astray { ALL_BROKEN } else { BROKEN_PROMISES }).map(|(_, _, number)| number).collect()
}

/// Fits to their end those of the briefly fitted hypotheses that may yet be the best.
fn finished<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    reference: &Hypothesis<T>,
    brief: Vec<Option<Hypothesis<T>>>,
) -> Vec<Option<Hypothesis<T>>> {
    let order: Vec<Vec<usize>> =
        ranked(inquiry, reference, brief.iter().flatten().cloned().collect()).iter().map(Hypothesis::set).collect();
    brief
        .into_par_iter()
        .map(|one| {
            let one = one?;
            let rank = order.iter().position(|set| *set == one.set())?;
            Some(if rank < FINISHED { inquiry.refitted(&one) } else { one })
        })
        .collect()
}

/// Which of the screened candidates, best first, are fitted, each mechanism in the form that screening likes best, and from how many
/// of their starts.
///
/// Beside a twin with nothing added it is all that the recordings could show: the refit of a twin that lacks something may
/// be bent so far that the signature of what it lacks looks like nothing at all. So may that of the best twin that lacks
/// little. Elsewhere it is the best, and whatever looks much like the best.
fn chosen<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    first: &Hypothesis<T>,
    parent: &Hypothesis<T>,
    screened: &[Screened],
    place: usize,
) -> Vec<usize> {
    let effective: f64 = parent.misfits.iter().map(ChannelMisfit::effective).sum();
    // Residuals that are white hold all the evidence there is; others may hold more once more is explained.
    let whole: f64 = parent.misfits.iter().map(|m| m.count as f64).sum();
    let (benefit, always) = if parent.leaves_nothing() { (1.0, 0) } else { (BENEFIT_OF_DOUBT, ALWAYS_FITTED) };
    let doubt = (benefit * effective).min(whole.max(effective));
    let needed = needed_share(inquiry, first, parent);
    let hopeful = |score: f64| {
        let explained = score * score;
        -doubt * (1.0 - explained).max(1e-300).ln() > ACCEPT && benefit * explained > needed
    };
    let near = parent.added.is_empty() || parent.within(NEARLY_ALL);
    let all = place == 0 && parent.added.len() < WITH_ALL && near && !parent.leaves_nothing() && !parent.unbent(UNBENT);
    let mut mechanisms: Vec<&str> = Vec::new();
    screened
        .iter()
        .enumerate()
        .map(|(rank, one)| {
            let Candidate { about: About { name, .. }, general, .. } = &inquiry.candidates[one.number];
            let promising = all || one.score > 0.0 && (rank < always || hopeful(one.score));
            if *general || !one.excited || !promising || mechanisms.contains(name) {
                return 0;
            }
            let alike = || one.signature.dot(&screened[0].signature).abs() > ALIKE;
            let before = mechanisms.len();
            let liked = before < FITTED || before < 2 * FITTED && alike();
            let starts = match (liked, all) {
                (true, _) if place == 0 => STARTS,
                (true, _) | (_, true) => unpromising(&inquiry.candidates[one.number]),
                (false, false) => 0,
            };
            if starts > 0 {
                mechanisms.push(name);
            }
            starts
        })
        .collect()
}

/// How many starts are followed of a candidate that does not promise much: of the teeth of a motor, of which each number is a valley of
/// its own, the first by a hair may be the wrong ones.
fn unpromising(candidate: &Candidate) -> usize {
    let places = candidate.form.parameters.iter().filter(|p| !p.linear).map(|p| p.starts.len().max(1));
    if places.product::<usize>() > FEW_PLACES { STARTS } else { UNPROMISING }
}

#[cfg(test)]
mod tests {
    use super::super::weigh::tests::leaving;
    use super::*;

    #[test]
    fn what_leaves_least_by_far_is_built_on_however_late_it_stands() {
        let children = |last: f64| {
            let mut children = vec![leaving(15.0, 40.0); BEAM + 2];
            children.push(leaving(last, 2.0));
            children
        };
        assert_eq!(least_by_far(&children(3.6)), Some(BEAM + 2));
        assert_eq!(least_by_far(&children(8.0)), None, "less, and not by far");
        assert_eq!(least_by_far(&children(3.6)[BEAM..]), None, "all are in the beam");
        let mut known = children(3.6);
        known[1] = leaving(4.0, 30.0);
        assert_eq!(least_by_far(&known), None, "one that leaves as little is in the beam");
    }
}
