//! A selection: the set of mechanisms that was selected, what it does without each of them, and how all others did; and how it changes.

use rayon::prelude::*;

use super::Score;
use super::free_run::strays;
use super::hypothesis::{Hypothesis, Inquiry};
use super::kin::shows_itself;
use super::prune::{all_needed, pruned};
use super::pursue::pursued;
use super::screening::Screening;
use super::weigh::{ABOVE_NOISE, lead};
use crate::sim2real::{Candidate, Twin};

/// The outcome of a selection.
pub(super) struct Selection<T> {
    /// The twin as given, refitted.
    pub recalibrated: Hypothesis<T>,
    /// The set that was selected; the same as `recalibrated` where nothing was.
    pub selected: Hypothesis<T>,
    /// `selected` with one mechanism left out, in the order of its mechanisms.
    pub without: Vec<Hypothesis<T>>,
    /// The sets that did best in each stage.
    pub fitted: Vec<Hypothesis<T>>,
    /// Every mechanism tried in every stage.
    pub scores: Vec<Score>,
    /// What screening found beside `recalibrated`, as long as rivals may be asked for.
    pub screening: Option<Screening>,
}

impl<T: Twin> Selection<T> {
    /// Whether what was selected leaves hardly more than the noise.
    pub fn complete(&self) -> bool {
        self.selected.within(ABOVE_NOISE)
    }

    /// The best set of so many mechanisms, if the selection came so far from nothing.
    pub fn best_of_stage(&self, mechanisms: usize) -> Option<&Hypothesis<T>> {
        self.fitted.iter().find(|fitted| fitted.added.len() == mechanisms)
    }

    /// What was fitted of the selected mechanisms and one more, in the order in which it did well.
    pub fn beside<'a>(&'a self, inquiry: &'a Inquiry<'_, T>) -> impl Iterator<Item = &'a Hypothesis<T>> {
        let names = |set: &[usize]| set.iter().map(|n| inquiry.candidates[*n].about.name).collect::<Vec<_>>();
        let selected = names(&self.selected.added);
        self.fitted.iter().filter(move |fitted| one_more(&names(&fitted.added), &selected))
    }

    /// Notes what was added as it is, after everything else.
    pub fn note_finished(&mut self, candidate: &Candidate, gain: f64) {
        self.scores.push(Score {
            mechanism: candidate.about.name.to_owned(),
            form: candidate.form.name.to_owned(),
            stage: self.selected.added.len() - 1,
            screen: 0.0,
            survival: 1.0,
            gain: Some(gain),
            accepted: true,
            excited: true,
        });
    }

    /// Marks the scores of what was selected, each in the last stage in which it was tried.
    pub fn mark_accepted(&mut self, candidates: &[Candidate]) {
        for number in &self.selected.added {
            let Candidate { about, form, .. } = &candidates[*number];
            let own = |s: &&mut Score| s.mechanism == about.name && s.form == form.name && s.gain.is_some();
            if let Some(score) = self.scores.iter_mut().filter(own).max_by_key(|s| s.stage) {
                score.accepted = true;
            }
        }
    }

    /// The same selection fitted with another inquiry's step of integration, and what is no longer needed left out.
    pub fn refitted(&self, inquiry: &Inquiry<'_, T>) -> Self {
        let whole = || (!self.selected.added.is_empty()).then(|| inquiry.refitted(&self.selected));
        let (recalibrated, whole) = rayon::join(|| inquiry.refitted(&self.recalibrated), whole);
        let Some(whole) = whole else { return self.elsewhere((recalibrated.clone(), recalibrated, Vec::new())) };
        // What each is needed for with longer steps it is hardly ever not with these: only then is the set chosen anew.
        let without: Vec<Hypothesis<T>> = match self.without.as_slice() {
            [_] => vec![recalibrated.clone()],
            several => several.par_iter().map(|less| inquiry.refitted(less)).collect(),
        };
        if all_needed(inquiry, &recalibrated, &whole, &without) {
            return self.elsewhere((recalibrated, whole, without));
        }
        self.elsewhere(pruned(inquiry, &recalibrated, vec![whole]))
    }

    /// This selection, nothing of it fitted anew, as another inquiry sees it.
    pub fn seen(&self, inquiry: &Inquiry<'_, T>) -> Self {
        let without = self.without.iter().map(|less| inquiry.seen(less)).collect();
        self.elsewhere((inquiry.seen(&self.recalibrated), inquiry.seen(&self.selected), without))
    }

    /// The selection without its `place`-th mechanism.
    pub fn dropped(&self, inquiry: &Inquiry<'_, T>, place: usize) -> Self {
        self.with_set(pruned(inquiry, &self.recalibrated, vec![self.without[place].clone()]))
    }

    /// The selection with none of its mechanisms: all that was tried remains known.
    pub fn bare(mut self) -> Self {
        self.scores.iter_mut().for_each(|score| score.accepted = false);
        self.with_set((self.recalibrated.clone(), self.recalibrated.clone(), Vec::new()))
    }

    /// The selection with the `place`-th mechanism replaced by candidate `other`, and what is no longer needed left out.
    pub fn swapped(&self, inquiry: &Inquiry<'_, T>, place: usize, other: usize) -> Option<Self> {
        let less = &self.without[place];
        let screened = inquiry.screened_as(less, other)?;
        // On the way on which it was found to be better.
        let whole = pursued(inquiry, &self.recalibrated, &self.selected, less, &screened);
        let swapped = self.with_set(pruned(inquiry, &self.recalibrated, vec![whole]));
        let selected = &swapped.selected;
        let abouts =
            self.selected.added.get(place).map(|own| [&inquiry.candidates[*own].about, &inquiry.candidates[other].about]);
        // A simpler law is preferred although it explains a little less, ...
        let simpler =
            selected.free() < self.selected.free() && abouts.is_some_and(|[own, other]| own.contains.contains(&other.name));
        // ... unless what a longer one says more is seen.
        let both = [&self.selected, selected];
        let shown = abouts.is_some_and(|abouts| shows_itself(inquiry, &swapped.recalibrated, both, abouts));
        let kept = selected.added.len() >= self.selected.added.len();
        let better = lead(inquiry, &swapped.recalibrated, selected, &self.selected) > 0.0;
        if strays(inquiry, &self.selected, selected) {
            return None;
        }
        (better || kept && (simpler || shown)).then_some(swapped)
    }

    /// This selection with another set selected: all that was tried remains known.
    fn with_set(&self, (recalibrated, selected, without): (Hypothesis<T>, Hypothesis<T>, Vec<Hypothesis<T>>)) -> Self {
        let (fitted, scores, screening) = (self.fitted.clone(), self.scores.clone(), self.screening.clone());
        Self { recalibrated, selected, without, fitted, scores, screening }
    }

    /// The same of another inquiry, whose twin changes in another way.
    fn elsewhere(&self, set: (Hypothesis<T>, Hypothesis<T>, Vec<Hypothesis<T>>)) -> Self {
        Self { screening: None, ..self.with_set(set) }
    }
}

/// Whether `more` is `set` with one name more.
fn one_more(more: &[&str], set: &[&str]) -> bool {
    more.len() == set.len() + 1 && set.iter().all(|name| more.contains(name))
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution, StandardNormal};

    use super::super::evidence::Evidence;
    use super::*;
    use crate::sim2real::identify::Effort;
    use crate::sim2real::mechanism::wire::Wire;
    use crate::sim2real::mechanism::{Bias, Drift};
    use crate::sim2real::{Assembly, Measured, Recording, Registry, Seed, Simulator};

    const SENSOR: Registry<Wire> = &[&Bias, &Drift { rate: None }];

    /// Asks `asked` what becomes of a bias and a drift that were both selected, of what a sensor that wanders by `rate` made of nothing.
    fn of_a_sensor<R>(rate: f64, asked: impl Fn(&Inquiry<'_, Assembly<Wire>>, Selection<Assembly<Wire>>) -> R) -> R {
        let mut rng = Seed(7).stream("noise");
        let time: Vec<f64> = (0..2_000).map(|i| 0.01 * f64::from(i)).collect();
        let read = |t: &f64| -> f64 {
            let noise: f64 = StandardNormal.sample(&mut rng);
            0.1 + rate * t + 0.01 * noise
        };
        let samples = time.iter().map(read).map(Some).collect();
        let measured = vec![Measured { channel: "signal".into(), unit: "rad".into(), samples }];
        let recordings = [Recording { name: "still".into(), time, stimulus: (), measured }];
        let twin = Assembly::new(Wire, SENSOR);
        let evidence = Evidence::divide(&twin, &recordings, &[]);
        let candidates = twin.candidates(&recordings);
        let inquiry = Inquiry { twin: &twin, candidates: &candidates, evidence: &evidence, seed: Seed(0) };
        let number = |name: &str| candidates.iter().position(|candidate| candidate.about.name == name).unwrap();
        let of = |names: &[&str]| {
            let added: Vec<usize> = names.iter().map(|name| number(name)).collect();
            let twin = inquiry.with(&added);
            let given: Vec<f64> = twin.parameters().iter().map(|p| p.nominal).collect();
            inquiry.begun(twin, added, &given, None, Effort::Thorough)
        };
        let recalibrated = of(&[]);
        let screening = Some(Screening::beside(&inquiry, &recalibrated));
        let without = vec![of(&["drift"]), of(&["bias"])];
        let (selected, fitted, scores) = (of(&["bias", "drift"]), Vec::new(), vec![accepted()]);
        asked(&inquiry, Selection { recalibrated, selected, without, fitted, scores, screening })
    }

    /// What is selected once that is fitted with other steps.
    fn refitted(rate: f64) -> Vec<&'static str> {
        of_a_sensor(rate, |inquiry, selection| {
            let refitted = selection.refitted(inquiry);
            assert_eq!(refitted.without.len(), refitted.selected.added.len());
            let chosen = refitted.selected.added.clone();
            let bare = refitted.bare();
            assert!(bare.selected.added.is_empty() && bare.without.is_empty() && !bare.scores[0].accepted);
            chosen.iter().map(|number| inquiry.candidates[*number].about.name).collect()
        })
    }

    fn accepted() -> Score {
        Score {
            mechanism: "drift".to_owned(),
            form: "linear".to_owned(),
            stage: 1,
            screen: 0.5,
            survival: 1.0,
            gain: Some(900.0),
            accepted: true,
            excited: true,
        }
    }

    #[test]
    fn what_other_steps_do_not_need_is_left_out() {
        assert_eq!(refitted(0.01), ["bias", "drift"]);
        assert_eq!(refitted(0.0), ["bias"], "a sensor that does not wander");
    }

    #[test]
    fn screening_is_not_done_twice_of_the_same_and_anew_of_all_else() {
        of_a_sensor(0.01, |inquiry, selection| {
            let known = selection.screening.as_ref();
            let anew = inquiry.screened(&selection.recalibrated);
            assert_eq!(Screening::known_or_made(known, inquiry, &selection.recalibrated), anew);
            let beside_drift = &selection.without[0];
            let of_another = Some(Screening::beside(inquiry, beside_drift));
            assert_ne!(inquiry.screened(beside_drift), anew, "a drift is not screened beside itself");
            assert_eq!(Screening::known_or_made(of_another.as_ref(), inquiry, &selection.recalibrated), anew);
            assert!(selection.refitted(inquiry).screening.is_none(), "other steps change other things");
            for one in &anew {
                assert_eq!(inquiry.screened_as(&selection.recalibrated, one.number).as_ref(), Some(one));
            }
        });
    }

    #[test]
    fn one_more_has_all_the_others() {
        assert!(one_more(&["friction", "cogging"], &["cogging"]) && one_more(&["lag"], &[]));
        assert!(!one_more(&["friction", "lag"], &["cogging"]), "another two");
        assert!(!one_more(&["cogging"], &["cogging"]) && !one_more(&["a", "b", "c"], &["a"]));
    }
}
