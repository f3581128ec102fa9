//! Approach: how a twin is brought near recordings that it does not follow from where its parameters are given.
//!
//! What a free run is off by early decides where it is late: an arm goes over the top or does not. Windows that start afresh forget that
//! (multiple shooting: Bock, "Recent advances in parameter identification techniques for ODE", in *Numerical Treatment of Inverse
//! Problems* (1983)).

use super::hypothesis::{Hypothesis, Inquiry, KEEPS_UP};
use super::locate::identity;
use super::weigh::squares;
use crate::sim2real::identify::{Effort, State};
use crate::sim2real::{Clock, Twin};

/// Into so many windows recordings are cut, ...
const SHORT: f64 = 24.0;
/// ... and then, from where these lead, into so many.
const LONG: f64 = 6.0;
/// Where the short ones are followed, they are joined to so many, one after the other, and at last to the whole.
const JOINED: [f64; 3] = [12.0, 6.0, 3.0];

impl<T: Twin> Inquiry<'_, T> {
    /// The twin as given, its own parameters refitted: from where they are given and, where that does not follow, from where windows lead.
    pub fn recalibrated(&self) -> Hypothesis<T> {
        let given: Vec<f64> = self.twin.parameters().iter().map(|p| p.nominal).collect();
        let directly = self.begun(self.twin.clone(), Vec::new(), &given, None, Effort::Thorough);
        // What starts in the middle of a closed loop lacks what its controller remembers.
        let starts_anywhere = self.twin.clock() != Clock::Event && !self.twin.in_closed_loop();
        if !starts_anywhere || self.evidence.window.is_some() || directly.within(KEEPS_UP) {
            return directly;
        }
        approached(self, &given, directly)
    }
}

/// The best fit of the inquiry's twin to free runs that windows lead to, or what was fitted `directly` if that leaves less.
fn approached<T: Twin>(inquiry: &Inquiry<'_, T>, given: &[f64], directly: Hypothesis<T>) -> Hypothesis<T> {
    let short = in_windows(inquiry, SHORT, given, &[]);
    let long = in_windows(inquiry, LONG, &short.0.fit.values, &[]);
    let best = better(directly, begun_from(inquiry, &long.0.fit.values, &[]));
    if best.within(KEEPS_UP) {
        return best;
    }
    match joined(inquiry, short) {
        Some(joined) => better(best, joined),
        None => best,
    }
}

fn better<T>(one: Hypothesis<T>, other: Hypothesis<T>) -> Hypothesis<T> {
    if squares(&other) < squares(&one) { other } else { one }
}

/// Where a part begins: its recording and row, and the initial state found there.
type Begun = (usize, usize, Vec<f64>);

/// A free run that goes on from `short` windows, of which two at a time become one (of the last three, all) that starts as the first of
/// them did: by then the state it starts from is known far better than its samples tell. None where what is joined is not followed any
/// longer.
fn joined<T: Twin>(inquiry: &Inquiry<'_, T>, short: (Hypothesis<T>, Vec<Begun>)) -> Option<Hypothesis<T>> {
    let follows = |(fitted, begun): (Hypothesis<T>, Vec<Begun>)| fitted.within(KEEPS_UP).then_some((fitted, begun));
    let longest = JOINED
        .into_iter()
        .try_fold(follows(short)?, |(fitted, begun), count| follows(in_windows(inquiry, count, &fitted.fit.values, &begun)));
    longest.map(|(fitted, begun)| begun_from(inquiry, &fitted.fit.values, &begun))
}

/// The twin's own parameters fitted to so many windows, from these `values` on and, where windows began before at the same row, from
/// their states.
fn in_windows<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    count: f64,
    values: &[f64],
    before: &[Begun],
) -> (Hypothesis<T>, Vec<Begun>) {
    let evidence = inquiry.evidence.in_windows(count);
    let there = Inquiry { evidence: &evidence, ..*inquiry };
    let fitted = begun_from(&there, values, before);
    let states = evidence.compared.iter().zip(&fitted.fit.state.values);
    let begun = states.map(|(part, state)| (identity(part.recording), part.rows.start, state.clone())).collect();
    (fitted, begun)
}

/// The same, fitted to what the inquiry compares.
fn begun_from<T: Twin>(inquiry: &Inquiry<'_, T>, values: &[f64], before: &[Begun]) -> Hypothesis<T> {
    let parts = &inquiry.evidence.compared;
    let mut state: State = inquiry.evidence.initial_state(&inquiry.problem(inquiry.twin, parts));
    for (part, values) in parts.iter().zip(&mut state.values) {
        // Times divided by another number may round to the row beside.
        let same =
            |(recording, row, _): &&Begun| *recording == identity(part.recording) && row.abs_diff(part.rows.start) <= 1;
        if let Some((_, _, known)) = before.iter().find(same) {
            values.clone_from(known);
        }
    }
    inquiry.begun(inquiry.twin.clone(), Vec::new(), values, Some(&state), Effort::Thorough)
}
