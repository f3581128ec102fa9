//! The table of figures.

use std::collections::BTreeMap;

use super::domain::Domain;
use super::figure::{Figure, Goal, Unit};
use super::goals::{CONFIDENT_WRONG, Goals, TOLD_APART};
use super::reliability::Reliability;
use super::score::{Answer, CLEAR, Entry, Method, WEAK};
use super::trial::{Fitted, Trial};
use super::wilson::Z;
use crate::conceal::{Concealed, Kind, Span};
use crate::sim2real::diagnose::Verdict;

/// All figures, in the order in which they are shown.
pub(super) fn figures(domain: Domain, entries: &[Entry], reliability: &Reliability) -> Vec<Figure> {
    let goals = Goals::of(domain);
    let (poor, entries): (Vec<&Entry>, Vec<&Entry>) = entries.iter().partition(|entry| entry.truth.poor);
    let mut all = wanted_shares(&entries, &goals, domain.told().misled);
    match domain {
        Domain::Robot => all.extend(located(&entries)),
        Domain::Market => all.extend([told_apart(&entries), confident_and_wrong(&poor)]),
    }
    all.extend(parameters(&entries, &goals));
    all.extend(proven(&entries, &goals));
    let ece = Figure::number("calibration error", reliability.error, reliability.of);
    let ece =
        ece.meaning("mean distance of the confidence of a name and how often names of such confidence are right (ECE)");
    all.push(ece.wanting(goals.calibration));
    let median = reliability.by_chance.map(|[median, ..]| median);
    let chance = Figure {
        interval: reliability.by_chance.map(|[_, low, high]| [low, high]),
        ..Figure::number("the same by chance", median, reliability.of)
    };
    all.push(chance.meaning("what it comes to of as many names that are right just as often as their confidences say"));
    let seconds = Figure::quantile("time of a diagnosis", Unit::Seconds, 0.5, entries.iter().map(|e| e.trial.seconds));
    all.push(seconds.meaning("median, on two threads").wanting(goals.seconds));
    all.extend(further(&entries));
    all
}

/// Shares that something is wanted of.
fn wanted_shares(entries: &[&Entry], goals: &Goals, misled: &str) -> Vec<Figure> {
    let share = |name: &str, meaning: &str, of: &dyn Fn(&Entry) -> bool, holds: Holds<'_>, goal: Goal| {
        let beside = |method: Method| {
            let own = entries.iter().filter(|entry| of(entry)).map(|entry| holds(entry, &entry.answer(method)));
            Figure::share("", own).value
        };
        let (recalibration, regression) = (beside(Method::Recalibration), beside(Method::Regression));
        let figure = plain(entries, name, meaning, of, holds).wanting(goal);
        Figure { recalibration, regression, ..figure }
    };
    let null =
        |adversarial: bool| move |e: &Entry| matches!(e.truth.kind, Kind::Null(null) if null.adversarial() == adversarial);
    let named = |_: &Entry, answer: &Answer| !answer.names.is_empty();
    vec![
        share(
            "right first",
            "one effect of 1 sigma or more: the name most certain is the right one, and nothing else is said to be missing",
            &clear,
            &Entry::right_first,
            goals.right_first,
        ),
        share(
            "right among two",
            "the same effects: the right name is among the first two, or listed as a rival",
            &clear,
            &Entry::right_or_rival,
            goals.right_among_two,
        ),
        share(
            "weak, right first",
            "one effect of 0.3 to 1 sigma",
            &|e| e.single(WEAK, CLEAR),
            &Entry::right_first,
            goals.weak,
        ),
        share(
            "pairs exact",
            "two effects, both of 1 sigma or more: these two and no other",
            &Entry::clear_pair,
            &Entry::exact,
            goals.pairs,
        ),
        share(
            "false name, white",
            "something named where nothing is missing: white noise, or parameters that are off alone",
            &null(false),
            &named,
            goals.false_white,
        ),
        share("false name, misled", misled, &null(true), &named, goals.false_misled),
        share(
            "outside, said so",
            "an effect that no registry has: unexplained; below 1 sigma it may also go unseen",
            &|e| e.truth.kind == Kind::Outside,
            &Entry::said_so,
            goals.outside,
        ),
    ]
}

/// Whether an answer to a case is what is counted.
type Holds<'a> = &'a dyn Fn(&Entry, &Answer) -> bool;

fn clear(entry: &Entry) -> bool {
    entry.single(CLEAR, f64::INFINITY)
}

/// A share of the cases `of` some kind, of which nothing is wanted.
fn plain(entries: &[&Entry], name: &str, meaning: &str, of: &dyn Fn(&Entry) -> bool, holds: Holds<'_>) -> Figure {
    let own = entries.iter().filter(|entry| of(entry));
    Figure::share(name, own.map(|entry| holds(entry, &entry.answer(Method::Diagnosis)))).meaning(meaning)
}

/// Shares that tell more, though nothing is wanted of them.
fn further(entries: &[&Entry]) -> [Figure; 5] {
    let partly =
        |entry: &Entry, answer: &Answer| !answer.names.is_empty() && answer.names.iter().all(|name| entry.conceals(name));
    let silent = |_: &Entry, answer: &Answer| answer.names.is_empty() && !answer.unknown;
    let null = |entry: &Entry| matches!(entry.truth.kind, Kind::Null(_));
    [
        plain(entries, "that name alone", "one effect of 1 sigma or more: its name and no other", &clear, &Entry::exact),
        plain(entries, "all pairs exact", "two effects of any size", &|e| e.truth.kind == Kind::Pair, &Entry::exact),
        plain(
            entries,
            "pairs, none wrong",
            "both of 1 sigma or more: at least one right, none wrong",
            &Entry::clear_pair,
            &partly,
        ),
        plain(
            entries,
            "unreached, silent",
            "an effect that is not reached: nothing named",
            &|e| e.truth.kind == Kind::NotExcited,
            &silent,
        ),
        plain(entries, "false alarm", "called unexplained where nothing is missing", &null, &|_, answer| answer.unknown),
    ]
}

/// Of impact that stays and impact that fades: whether the right one of the two is named, or told as a rival.
fn told_apart(entries: &[&Entry]) -> Figure {
    const EITHER: [&str; 2] = ["permanent_impact", "transient_impact"];
    let own = |entry: &Entry| entry.truth.effects.iter().find(|effect| EITHER.contains(&effect.id.as_str())).cloned();
    let clear = |effect: &Concealed| effect.size >= CLEAR;
    let plain = |entry: &&&Entry| matches!(entry.truth.kind, Kind::Single | Kind::Pair);
    let effects = entries.iter().filter(plain).filter_map(|entry| Some((entry, own(entry).filter(clear)?)));
    let right = effects.map(|(entry, effect)| {
        let answer = entry.answer(Method::Diagnosis);
        !answer.unknown && answer.names.iter().chain(&answer.rivals).any(|name| *name == effect.id)
    });
    Figure::share("stays or fades", right)
        .meaning("permanent or transient impact of 1 sigma or more: named, or told as a rival of what is named")
        .wanting(TOLD_APART)
}

/// Of cases with mids alone: names given with more confidence than doubt that are not so.
fn confident_and_wrong(poor: &[&Entry]) -> Figure {
    let wrong = poor.iter().map(|entry| {
        let names = entry.answer(Method::Diagnosis).names;
        let sure = entry.trial.found.iter().filter(|found| found.confidence >= 0.5 && names.contains(&found.mechanism));
        entry.trial.verdict == Verdict::Named && sure.into_iter().any(|found| !entry.conceals(&found.mechanism))
    });
    Figure::share("mids alone, wrong", wrong)
        .meaning("where the tape holds no more than the mid at each decision: a wrong name given with confidence")
        .wanting(CONFIDENT_WRONG)
}

/// Where and when: of single effects that act at times only.
fn located(entries: &[&Entry]) -> [Figure; 2] {
    let effects: Vec<(&Entry, &Concealed)> =
        entries.iter().filter(|e| clear(e)).map(|e| (*e, &e.truth.effects[0])).collect();
    let overlaps = effects.iter().filter(|(_, effect)| !effect.active.is_empty());
    // When a mechanism acted, where it was named, else where the error lies.
    let said = |entry: &Entry, id: &str| {
        let named = entry.trial.found.iter().find(|found| found.mechanism == id && !found.active.is_empty());
        named.map_or_else(|| entry.trial.intervals.clone(), |found| found.active.clone())
    };
    let overlaps = overlaps.map(|(entry, effect)| overlap(&effect.active, &said(entry, &effect.id)));
    let times = effects.iter().filter_map(|(entry, effect)| {
        let said = event_time(&entry.trial, &effect.id);
        Some(said.map_or(f64::INFINITY, |said| (said - effect.onset.unwrap_or(said)).abs()))
            .filter(|_| effect.onset.is_some())
    });
    let overlaps = Figure::quantile("intervals, IoU", Unit::Number, 0.5, overlaps);
    let times = Figure::quantile("event time off by", Unit::Seconds, 0.5, times);
    [
        overlaps.meaning("median overlap of when an effect acted and when it is said to have").wanting(Goal::new(0.6, 0.85)),
        times.meaning("median; an event that is not dated counts as infinitely far off").wanting(Goal::new(0.3, 0.1)),
    ]
}

/// The time of an event as a diagnosis has it: the onset it gives, else the time that its mechanism has as a parameter.
fn event_time(trial: &Trial, id: &str) -> Option<f64> {
    let named = trial.found.iter().find(|found| found.mechanism == id);
    let fitted = named.and_then(|found| found.parameters.get("time")).map(|time| time.value);
    trial.onset.or(fitted)
}

/// Length of what two sets of stretches share over the length of what either has.
fn overlap(one: &[Span], other: &[Span]) -> f64 {
    let mut edges: Vec<(f64, usize, i32)> = Vec::new();
    for (k, spans) in [one, other].into_iter().enumerate() {
        spans.iter().for_each(|span| edges.extend([(span.start, k, 1), (span.end, k, -1)]));
    }
    edges.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut depth, mut last) = ([0, 0], f64::NEG_INFINITY);
    let (mut both, mut either) = (0.0, 0.0);
    for (time, k, step) in edges {
        let length = time - last;
        if depth.iter().any(|depth| *depth > 0) {
            either += length;
        }
        if depth.iter().all(|depth| *depth > 0) {
            both += length;
        }
        depth[k] += step;
        last = time;
    }
    if either > 0.0 { both / either } else { 0.0 }
}

/// What the arithmetic of a constant that is read off rounds at the most, as a part of it.
const ROUNDING: f64 = 1e-12;

/// A fitted parameter beside the true one.
struct Pair {
    fitted: Fitted,
    truth: f64,
    scale: f64,
}

impl Pair {
    fn error(&self) -> f64 {
        (self.fitted.value - self.truth).abs() / self.scale
    }

    /// What was read off exactly, as a sensor's step is, is right to what arithmetic rounds.
    fn covered(&self) -> bool {
        let rounding = ROUNDING * self.truth.abs();
        self.fitted.std.is_some_and(|std| (self.fitted.value - self.truth).abs() <= Z * std + rounding)
    }
}

/// Parameters of what was rightly named, and those the oracle found.
fn parameters(entries: &[&Entry], goals: &Goals) -> [Figure; 2] {
    let mut own = Vec::new();
    let mut told = Vec::new();
    for entry in entries.iter().filter(|entry| matches!(entry.truth.kind, Kind::Single | Kind::Pair)) {
        let answer = entry.answer(Method::Diagnosis);
        for (place, effect) in entry.truth.effects.iter().enumerate() {
            if let Some(found) =
                entry.trial.found.iter().find(|f| f.mechanism == effect.id && answer.names.contains(&f.mechanism))
            {
                own.extend(pairs(effect, &found.parameters));
            }
            if let Some(oracle) = &entry.trial.oracle {
                told.extend(oracle.parameters.get(place).into_iter().flat_map(|fitted| pairs(effect, fitted)));
            }
        }
    }
    let error = |pairs: &[Pair]| {
        Figure::quantile("parameters off by", Unit::Share, 0.5, pairs.iter().map(Pair::error))
            .meaning("median, of mechanisms rightly named, where forms can be compared")
    };
    let covered = |pairs: &[Pair]| {
        Figure::share("intervals hold", pairs.iter().map(Pair::covered))
            .meaning("95 % intervals of the same parameters that hold the truth")
    };
    [
        Figure { oracle: error(&told).value, ..error(&own).wanting(goals.parameters) },
        Figure { oracle: covered(&told).value, ..covered(&own).wanting(goals.intervals_hold) },
    ]
}

/// The parameters of an effect that can be compared: those that the form found has in common with the truth.
fn pairs(effect: &Concealed, fitted: &BTreeMap<String, Fitted>) -> Vec<Pair> {
    let of_its_form = effect.simpler.iter().find(|simpler| simpler.keys().eq(fitted.keys()));
    let truths = of_its_form.unwrap_or(&effect.parameters);
    let truth = |name: &str| truths.get(name).copied().unwrap_or(0.0);
    // One of the two parts of a wave may be next to nothing: both are measured by the whole.
    let amplitude = truth("sine").hypot(truth("cosine"));
    let comparable = truths.iter().filter(|(name, truth)| name.as_str() != "time" && **truth != 0.0);
    let pair = |(name, truth): (&String, &f64)| {
        let scale = if ["sine", "cosine"].contains(&name.as_str()) { amplitude } else { truth.abs() };
        Some(Pair { fitted: *fitted.get(name)?, truth: *truth, scale })
    };
    comparable.filter_map(pair).collect()
}

/// Held-out errors over the oracle's, of cases with one or two effects.
fn proven(entries: &[&Entry], goals: &Goals) -> [Figure; 2] {
    let told: Vec<(&Trial, f64)> = entries
        .iter()
        .filter(|entry| matches!(entry.truth.kind, Kind::Single | Kind::Pair))
        .filter_map(|entry| Some((&entry.trial, entry.trial.oracle.as_ref()?.held_out)))
        .filter(|(_, oracle)| *oracle > 0.0)
        .collect();
    let figure = |name: &str, meaning: &str, part: f64, goal: Goal| {
        let ratios = |of: fn(&Trial) -> f64| told.iter().map(move |(trial, oracle)| of(trial) / oracle);
        let own = Figure::quantile(name, Unit::Number, part, ratios(|trial| trial.held_out.trued));
        let recalibrated = Figure::quantile(name, Unit::Number, part, ratios(|trial| trial.held_out.recalibrated));
        let oracle = (!told.is_empty()).then_some(1.0);
        Figure { recalibration: recalibrated.value, oracle, ..own.meaning(meaning).wanting(goal) }
    };
    [
        figure(
            "error over oracle",
            "held-out error over that of a fit that was told the names, median",
            0.5,
            goals.over_oracle[0],
        ),
        figure("the same, p95", "its 95th percentile", 0.95, goals.over_oracle[1]),
    ]
}

#[cfg(test)]
mod tests {
    use super::super::figure::Standing;
    use super::super::score::tests::entry;
    use super::*;
    use crate::conceal::Null;
    use crate::proof::oracle::OracleFit;

    #[test]
    fn overlaps_are_of_lengths() {
        let span = |start, end| Span { start, end };
        assert_eq!(overlap(&[span(1.0, 3.0)], &[span(2.0, 5.0)]), 0.25);
        assert_eq!(overlap(&[span(0.0, 1.0), span(2.0, 3.0)], &[span(0.0, 1.0), span(2.0, 3.0)]), 1.0);
        assert_eq!(overlap(&[span(0.0, 1.0)], &[]), 0.0);
    }

    #[test]
    fn what_is_read_off_to_the_last_digit_is_right() {
        let truth = 0.1 + 0.2;
        let pair = |value, std| Pair { fitted: Fitted { value, std: Some(std) }, truth, scale: 1.0 };
        assert!(pair(0.3, 0.0).covered() && !pair(0.3 + 1e-9, 0.0).covered());
        assert!(pair(0.31, 0.006).covered() && !pair(0.31, 0.005).covered());
    }

    #[test]
    fn a_form_is_held_to_what_it_can_do() {
        let named = |pairs: &[(&str, f64)]| pairs.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
        let effect = Concealed {
            id: "eccentricity".into(),
            size: 5.0,
            parameters: named(&[("sine", 0.3), ("cosine", 0.4), ("second_sine", 0.1)]),
            simpler: vec![named(&[("sine", 0.5), ("cosine", 1.2)])],
            onset: None,
            active: Vec::new(),
        };
        let fitted =
            |names: &[&str]| names.iter().map(|name| ((*name).to_owned(), Fitted { value: 0.0, std: Some(1.0) })).collect();
        let truths = |names: &[&str]| -> Vec<[f64; 2]> {
            pairs(&effect, &fitted(names)).iter().map(|pair| [pair.truth, pair.scale]).collect()
        };
        assert_eq!(truths(&["sine", "cosine"]), [[1.2, 1.3], [0.5, 1.3]]);
        let whole = [[0.4, 0.5], [0.1, 0.1], [0.3, 0.5]];
        assert_eq!(truths(&["sine", "cosine", "second_sine", "second_cosine"]), whole);
    }

    #[test]
    fn figures_of_hand_made_outcomes() {
        let mut right = entry(Kind::Single, &[("bias", 5.0)], Verdict::Named, &[("bias", 0.9)]);
        right.truth.effects[0].parameters.insert("offset".into(), 2.0);
        right.trial.found[0].parameters.insert("offset".into(), Fitted { value: 2.1, std: Some(0.06) });
        right.trial.oracle = Some(OracleFit { held_out: 0.0008, parameters: Vec::new() });
        right.trial.regression = vec!["drift".to_owned()];
        let mut late = entry(Kind::Single, &[("payload_change", 5.0)], Verdict::Named, &[("payload_change", 0.9)]);
        late.truth.effects[0].onset = Some(10.0);
        late.truth.effects[0].active = vec![Span { start: 10.0, end: 20.0 }];
        late.trial.intervals = vec![Span { start: 10.0, end: 15.0 }];
        late.trial.found[0].parameters.insert("time".into(), Fitted { value: 10.2, std: None });
        let entries = [
            right,
            late,
            entry(Kind::Single, &[("bias", 0.5)], Verdict::NoMismatch, &[]),
            entry(Kind::Null(Null::White), &[], Verdict::Named, &[("bias", 0.9)]),
            entry(Kind::Null(Null::Coarse), &[], Verdict::NoMismatch, &[]),
            entry(Kind::Outside, &[("shaking", 9.0)], Verdict::Unexplained, &[]),
        ];
        let figures = figures(Domain::Robot, &entries, &Reliability::of(&entries));
        let value = |name: &str| figures.iter().find(|f| f.name.starts_with(name)).unwrap().value;
        assert_eq!(value("right first"), Some(1.0));
        assert_eq!(value("weak, right first"), Some(0.0));
        assert_eq!(value("pairs exact"), None);
        assert_eq!((value("false name, white"), value("false name, misled")), (Some(1.0), Some(0.0)));
        assert_eq!(value("outside"), Some(1.0));
        assert_eq!(value("intervals, IoU"), Some(0.5));
        assert!((value("event time").unwrap() - 0.2).abs() < 1e-9);
        assert!((value("parameters off by").unwrap() - 0.05).abs() < 1e-9);
        assert_eq!(value("intervals hold"), Some(1.0));
        assert!((value("error over oracle").unwrap() - 1.25).abs() < 1e-9);
        assert_eq!(figures[0].regression, Some(0.0));
    }

    #[test]
    fn figures_of_a_market_are_its_own() {
        let single = |id: &str, verdict, said: &[(&str, f64)]| entry(Kind::Single, &[(id, 2.0)], verdict, said);
        let mut rival = single("permanent_impact", Verdict::Ambiguous, &[("transient_impact", 0.6)]);
        rival.trial.found[0].rivals = vec!["permanent_impact".to_owned()];
        let poor = |mut entry: Entry| {
            entry.truth.poor = true;
            entry
        };
        let mut entries = vec![
            rival,
            single("transient_impact", Verdict::Named, &[("permanent_impact", 0.9)]),
            single("half_spread", Verdict::Named, &[("half_spread", 0.9)]),
            poor(single("sqrt_impact", Verdict::Named, &[("linear_impact", 0.4)])),
            poor(single("sqrt_impact", Verdict::Ambiguous, &[("linear_impact", 0.6)])),
        ];
        let value = |entries: &[Entry], name: &str| {
            let figures = figures(Domain::Market, entries, &Reliability::of(entries));
            figures
                .into_iter()
                .find(|figure| figure.name.starts_with(name))
                .map(|figure| (figure.value, figure.of, figure.standing))
        };
        assert_eq!(value(&entries, "stays or fades"), Some((Some(0.5), 2, Standing::Missed)));
        assert_eq!(value(&entries, "mids alone"), Some((Some(0.0), 2, Standing::Aim)), "unsure, or said to be");
        // What is poor has a row of its own and no part in others.
        assert_eq!(value(&entries, "right first").map(|(share, of, _)| (share, of)), Some((Some(1.0 / 3.0), 3)));
        entries.push(poor(single("sqrt_impact", Verdict::Named, &[("linear_impact", 0.6)])));
        assert_eq!(value(&entries, "mids alone").map(|(share, ..)| share), Some(Some(1.0 / 3.0)));
        assert_eq!(value(&entries, "event time"), None);
    }
}
