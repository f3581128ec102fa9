//! What counts as right.

use super::trial::Trial;
use super::truth::Truth;
use crate::conceal::{Concealed, Kind};
use crate::sim2real::diagnose::Verdict;

/// A case unsealed: the truth beside what was said.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// The truth.
    pub truth: Truth,
    /// What was said.
    pub trial: Trial,
}

/// From this size on [noise standard deviations] an effect must be seen ...
pub(super) const CLEAR: f64 = 1.0;
/// ... and from this size on it may be.
pub(super) const WEAK: f64 = 0.3;

/// Whose answer is looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Method {
    /// The diagnosis.
    Diagnosis,
    /// Refitting what the twin has: it names nothing.
    Recalibration,
    /// Sparse regression on differentiated positions.
    Regression,
}

/// What a method said of a case.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct Answer {
    /// Names, most certain first; those that a case tolerates left out.
    pub names: Vec<String>,
    /// Names that were said to be possible as well.
    pub rivals: Vec<String>,
    /// Whether it said that something is missing which it does not know.
    pub unknown: bool,
}

impl Entry {
    /// What `method` said.
    pub(super) fn answer(&self, method: Method) -> Answer {
        match method {
            Method::Recalibration => Answer::default(),
            Method::Regression => {
                self.without_tolerated(Answer { names: self.trial.regression.clone(), ..Answer::default() })
            }
            Method::Diagnosis => {
                // What is listed as not excited is not named.
                let silent = matches!(self.trial.verdict, Verdict::NoMismatch | Verdict::NotExcited);
                let found = if silent { &[] } else { self.trial.found.as_slice() };
                self.without_tolerated(Answer {
                    names: found.iter().map(|found| found.mechanism.clone()).collect(),
                    rivals: found.iter().flat_map(|found| found.rivals.iter().cloned()).collect(),
                    unknown: self.trial.verdict == Verdict::Unexplained,
                })
            }
        }
    }

    fn without_tolerated(&self, mut answer: Answer) -> Answer {
        answer.names.retain(|name| !self.tolerates(name));
        answer
    }

    /// Whether a name is neither right nor wrong here.
    pub(super) fn tolerates(&self, name: &str) -> bool {
        self.truth.tolerated.iter().any(|tolerated| tolerated == name) && !self.conceals(name)
    }

    /// Whether a name is among what was concealed.
    pub(super) fn conceals(&self, name: &str) -> bool {
        self.concealed(name).is_some()
    }

    /// The concealed effect of that name.
    pub(super) fn concealed(&self, name: &str) -> Option<&Concealed> {
        self.truth.effects.iter().find(|effect| effect.id == name)
    }

    /// The smallest size of what is concealed; 0 where nothing is.
    pub(super) fn size(&self) -> f64 {
        let known = self.truth.effects.iter().map(|effect| effect.size);
        let all = known.chain(self.truth.outside.as_ref().map(|(_, size)| *size));
        let smallest = all.fold(f64::INFINITY, f64::min);
        if smallest.is_finite() { smallest } else { 0.0 }
    }

    /// Whether it holds one effect, of a size between the two.
    pub(super) fn single(&self, from: f64, to: f64) -> bool {
        self.truth.kind == Kind::Single && (from..to).contains(&self.size())
    }

    /// Whether it holds two effects, both of a size that must be seen.
    pub(super) fn clear_pair(&self) -> bool {
        self.truth.kind == Kind::Pair && self.size() >= CLEAR
    }

    /// The name most certain is the one concealed, and nothing else is said to be missing.
    pub(super) fn right_first(&self, answer: &Answer) -> bool {
        !answer.unknown && answer.names.first().is_some_and(|name| self.conceals(name))
    }

    /// The name concealed is among the first two, or listed as a rival.
    pub(super) fn right_or_rival(&self, answer: &Answer) -> bool {
        !answer.unknown && answer.names.iter().take(2).chain(&answer.rivals).any(|name| self.conceals(name))
    }

    /// Exactly what was concealed is named.
    pub(super) fn exact(&self, answer: &Answer) -> bool {
        let all = self.truth.effects.iter().all(|effect| answer.names.contains(&effect.id));
        !answer.unknown && all && answer.names.len() == self.truth.effects.len()
    }

    /// It is said that something unknown is missing; of what is too small to be seen, nothing need be said.
    pub(super) fn said_so(&self, answer: &Answer) -> bool {
        answer.unknown || self.size() < CLEAR && answer.names.is_empty()
    }

    /// Whether the diagnosis is right, by the measure of its kind of case.
    #[must_use]
    pub fn right(&self) -> bool {
        let answer = self.answer(Method::Diagnosis);
        match self.truth.kind {
            Kind::Single => self.right_first(&answer),
            Kind::Pair => self.exact(&answer),
            Kind::Null(_) => answer.names.is_empty() && !answer.unknown,
            Kind::Outside => self.said_so(&answer),
            // It need not be seen; what is there may be, and so may what cannot be told from it.
            Kind::NotExcited => {
                let listed = self.trial.verdict == Verdict::Ambiguous && self.right_or_rival(&answer);
                !answer.unknown && (listed || answer.names.iter().all(|name| self.conceals(name)))
            }
        }
    }

    /// How bad a wrong answer is: what is said with confidence and is not so is worst, then a large effect not seen; 0 for
    /// right ones.
    #[must_use]
    pub fn severity(&self) -> f64 {
        if self.right() {
            return 0.0;
        }
        let answer = self.answer(Method::Diagnosis);
        let wrong = self.trial.found.iter().filter(|found| answer.names.contains(&found.mechanism));
        let wrong = wrong.filter(|found| !self.conceals(&found.mechanism)).map(|found| found.confidence);
        let certain = wrong.fold(0.0, f64::max);
        // Of what is not known to be missing, the right answer is not a name, however large it is.
        certain * 2.0 + (1.0 + self.size()).ln() / 31.0_f64.ln()
    }
}

#[cfg(test)]
pub(super) mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::conceal::Null;
    use crate::proof::trial::{Found, HeldOut};

    pub(in crate::proof) fn entry(kind: Kind, truth: &[(&str, f64)], verdict: Verdict, said: &[(&str, f64)]) -> Entry {
        let effects = truth.iter().map(|(id, size)| Concealed {
            id: (*id).to_owned(),
            size: *size,
            parameters: BTreeMap::new(),
            simpler: Vec::new(),
            onset: None,
            active: Vec::new(),
        });
        let found = said.iter().map(|(mechanism, confidence)| Found {
            mechanism: (*mechanism).to_owned(),
            confidence: *confidence,
            gain: None,
            margin: None,
            rivals: Vec::new(),
            parameters: BTreeMap::new(),
            active: Vec::new(),
        });
        let outside = kind == Kind::Outside;
        Entry {
            truth: Truth {
                index: 0,
                kind,
                outside: outside.then(|| (truth[0].0.to_owned(), truth[0].1)),
                effects: if outside { Vec::new() } else { effects.collect() },
                tolerated: vec!["quantization".to_owned()],
                noise: 1e-3,
                circumstances: String::new(),
                poor: false,
            },
            trial: Trial {
                verdict,
                remainder: 0.0,
                found: found.collect(),
                onset: None,
                intervals: Vec::new(),
                held_out: HeldOut { nominal: 0.1, recalibrated: 0.05, trued: 0.001 },
                oracle: None,
                regression: Vec::new(),
                seconds: 1.0,
            },
        }
    }

    #[test]
    fn one_effect_is_right_when_it_is_named_first_and_nothing_else_is_missing() {
        let single = |verdict, said: &[(&str, f64)]| entry(Kind::Single, &[("bias", 5.0)], verdict, said);
        assert!(single(Verdict::Named, &[("bias", 0.9)]).right());
        assert!(single(Verdict::Ambiguous, &[("bias", 0.6), ("drift", 0.4)]).right());
        assert!(!single(Verdict::Ambiguous, &[("drift", 0.6), ("bias", 0.4)]).right());
        assert!(!single(Verdict::Unexplained, &[("bias", 0.9)]).right());
        assert!(!single(Verdict::NotExcited, &[("bias", 0.9)]).right());
        assert!(!single(Verdict::NoMismatch, &[]).right());
        let mut rival = single(Verdict::Named, &[("constant_load", 0.8)]);
        rival.trial.found[0].rivals = vec!["bias".to_owned()];
        let answer = rival.answer(Method::Diagnosis);
        assert!(!rival.right_first(&answer) && rival.right_or_rival(&answer) && !rival.exact(&answer));
        let two = single(Verdict::Named, &[("bias", 0.9), ("drift", 0.8)]);
        assert!(two.right() && !two.exact(&two.answer(Method::Diagnosis)));
    }

    #[test]
    fn two_effects_are_right_only_together() {
        let truth = [("bias", 5.0), ("stiffness", 2.0)];
        let pair = |said: &[(&str, f64)]| entry(Kind::Pair, &truth, Verdict::Named, said);
        assert!(pair(&[("stiffness", 0.9), ("bias", 0.8)]).right());
        assert!(!pair(&[("bias", 0.9)]).right());
        assert!(!pair(&[("bias", 0.9), ("stiffness", 0.9), ("drift", 0.9)]).right());
        assert!(pair(&[]).clear_pair());
        assert!(!entry(Kind::Pair, &[("bias", 5.0), ("stiffness", 0.7)], Verdict::Named, &[]).clear_pair());
    }

    #[test]
    fn of_nothing_nothing_is_to_be_named_but_what_the_sensor_does_show() {
        let none = |verdict, said: &[(&str, f64)]| entry(Kind::Null(Null::White), &[], verdict, said);
        assert!(none(Verdict::NoMismatch, &[]).right());
        assert!(none(Verdict::Named, &[("quantization", 0.9)]).right());
        assert!(!none(Verdict::Named, &[("bias", 0.9)]).right());
        assert!(!none(Verdict::Unexplained, &[]).right());
        assert!(none(Verdict::NotExcited, &[("bias", 0.9)]).right(), "what is listed as not excited is not named");
    }

    #[test]
    fn what_is_hardly_reached_may_go_unseen_or_be_named_but_nothing_else_may() {
        let hardly = |verdict, said: &[(&str, f64)]| entry(Kind::NotExcited, &[("bias", 0.1)], verdict, said);
        assert!(hardly(Verdict::NoMismatch, &[]).right());
        assert!(hardly(Verdict::Named, &[("bias", 0.9)]).right());
        assert!(!hardly(Verdict::Named, &[("drift", 0.9)]).right());
        assert!(!hardly(Verdict::Unexplained, &[]).right());
        assert!(hardly(Verdict::Ambiguous, &[("drift", 0.5), ("bias", 0.4)]).right(), "it is among what it may be");
        assert!(!hardly(Verdict::Ambiguous, &[("drift", 0.5), ("scale", 0.4)]).right());
    }

    #[test]
    fn what_no_registry_has_is_to_be_called_unknown() {
        let outside = |size, verdict, said: &[(&str, f64)]| entry(Kind::Outside, &[("shaking", size)], verdict, said);
        assert!(outside(5.0, Verdict::Unexplained, &[("bias", 0.2)]).right());
        assert!(!outside(5.0, Verdict::NoMismatch, &[]).right());
        assert!(!outside(5.0, Verdict::NotExcited, &[]).right());
        assert!(outside(0.7, Verdict::NoMismatch, &[]).right());
        assert!(!outside(0.7, Verdict::Named, &[("bias", 0.9)]).right());
    }

    #[test]
    fn a_confident_error_is_worse_than_silence_and_silence_about_much_worse_than_about_little() {
        let wrong = entry(Kind::Single, &[("bias", 2.0)], Verdict::Named, &[("drift", 0.95)]).severity();
        let much = entry(Kind::Single, &[("bias", 20.0)], Verdict::NoMismatch, &[]).severity();
        let little = entry(Kind::Single, &[("bias", 0.6)], Verdict::NoMismatch, &[]).severity();
        assert!(wrong > much && much > little && little > 0.0);
        assert_eq!(entry(Kind::Single, &[("bias", 2.0)], Verdict::Named, &[("bias", 0.9)]).severity(), 0.0);
    }
}
