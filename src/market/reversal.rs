//! How far a mid comes back after it has moved, as a tape shows where no own order was: what follows the move that fills an order at
//! rest would have followed it without the order, too.

use crate::sim2real::Timestamp;

use super::look::Look;
use super::{Seen, Tape};

/// Times after a move at which it is looked at: the shortest [s], and how many, each twice the one before.
const SHORTEST: f64 = 0.05;
const TIMES: usize = 11;
/// Places of the tape at which a move is sought.
const PLACES: usize = 4_000;
/// A move as near to an own fill as this is not asked [s].
const APART: f64 = 30.0;
/// With fewer moves nothing is told.
const ENOUGH: usize = 100;
/// The mid comes back where it does so by as many standard errors.
const CERTAIN: f64 = 4.0;

/// A move of the mid with which the market came to an order at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Came {
    /// When.
    pub at: Timestamp,
    /// How far it went [bps].
    pub moved: f64,
}

impl Came {
    /// The move of the quote that `tape` shows at a time.
    pub fn at(tape: &Tape, at: Timestamp) -> Option<Self> {
        let (before, after) = (tape.mid(Seen::at(Timestamp(at.0 - 1)))?, tape.mid(Seen::at(at))?);
        Some(Self { at, moved: (after - before) / before * 1e4 })
    }
}

/// The part of a move that is gone after a time.
#[derive(Debug, Clone, PartialEq, Default)]
struct Reversal {
    /// At the times, from the shortest on; none where the mid does not come back for certain.
    parts: Vec<f64>,
}

impl Reversal {
    /// Of all moves on `tape` that are not near any of `own` times, which are in order.
    fn of(tape: &Tape, own: &[Timestamp]) -> Self {
        let moves: Vec<Came> = moves(tape).into_iter().filter(|came| apart(came.at, own)).collect();
        if moves.len() < ENOUGH {
            return Self::default();
        }
        let fitted: Vec<(f64, f64)> = (0..TIMES).map(|k| gone_after(tape, &moves, seconds(k))).collect();
        let certain = fitted.iter().any(|(part, error)| *part > CERTAIN * error);
        let parts = fitted.into_iter().map(|(part, _)| part);
        Self { parts: if certain { parts.collect() } else { Vec::new() } }
    }

    /// The part of a move that is gone after so many seconds: on a line between the times, from none at once.
    fn gone(&self, seconds: f64) -> f64 {
        let Some((first, last)) = self.parts.first().zip(self.parts.last()) else { return 0.0 };
        let place = (seconds / SHORTEST).log2();
        if place <= 0.0 {
            return first * (seconds / SHORTEST).max(0.0);
        }
        let k = place as usize;
        let Some(next) = self.parts.get(k + 1) else { return *last };
        self.parts[k] + (place - k as f64) * (next - self.parts[k])
    }
}

fn seconds(k: usize) -> f64 {
    SHORTEST * 2.0_f64.powi(k as i32)
}

/// Moves of the mid: the first after each of many places, evenly over the tape.
fn moves(tape: &Tape) -> Vec<Came> {
    let quotes = tape.quotes().between(0, tape.quotes().times().len());
    let (count, times) = (quotes.len(), quotes.times());
    let mid = |k: usize| quotes.get(k).and_then(|quote| quote.mid());
    let places = PLACES.min(count);
    let first = |place: usize| {
        let (from, to) = (place * count / places, (place + 1) * count / places);
        (from.max(1)..to).find_map(|k| {
            let (before, after) = (mid(k - 1)?, mid(k)?);
            // Of several quotes at one time the last counts.
            let whole = times.get(k + 1) != times.get(k) && times[k - 1] < times[k];
            (whole && before != after).then(|| Came { at: times[k], moved: (after - before) / before * 1e4 })
        })
    };
    (0..places).filter_map(first).collect()
}

/// Whether a time is apart from all of `own`, which are in order.
fn apart(at: Timestamp, own: &[Timestamp]) -> bool {
    let next = own.partition_point(|other| *other < at);
    let near = |k: usize| own.get(k).is_some_and(|other| other.seconds_since(at).abs() < APART);
    !near(next) && !next.checked_sub(1).is_some_and(near)
}

/// The part of `moves` that is gone after so many seconds, by least squares, and its standard error.
fn gone_after(tape: &Tape, moves: &[Came], seconds: f64) -> (f64, f64) {
    let went = |came: &Came| {
        let (then, later) = (tape.mid(Seen::at(came.at))?, tape.mid(Seen::at(came.at.plus_seconds(seconds)))?);
        Some((came.moved, (later - then) / then * 1e4))
    };
    let (mut product, mut square, mut error) = (0.0, 0.0, 0.0);
    for (moved, after) in moves.iter().filter_map(went) {
        product -= moved * after;
        square += moved * moved;
        error += (moved * after).powi(2);
    }
    if square > 0.0 { (product / square, error.sqrt() / square) } else { (0.0, 0.0) }
}

/// Takes from what was seen to move in `looks` what would have come back of the moves that brought fills by itself, as the tape shows
/// where it is apart from all `own` fills.
pub(super) fn discount(looks: &mut [Look], tape: &Tape, mut came: Vec<Came>, mut own: Vec<Timestamp>) {
    if looks.is_empty() || came.is_empty() {
        return;
    }
    came.sort_by_key(|one| one.at);
    own.sort_unstable();
    let reversal = Reversal::of(tape, &own);
    if reversal.parts.is_empty() {
        return;
    }
    let longest = seconds(TIMES - 1);
    let mut oldest = 0;
    for k in 1..looks.len() {
        let (from, to) = (looks[k - 1].at, looks[k].at);
        oldest += came[oldest..].iter().take_while(|one| from.seconds_since(one.at) > longest).count();
        let under_way = came[oldest..].iter().take_while(|one| one.at < to);
        let gone = |one: &Came, at: Timestamp| reversal.gone(at.seconds_since(one.at).max(0.0));
        let back: f64 = under_way.map(|one| -one.moved * (gone(one, to) - gone(one, from))).sum();
        if let Some(moved) = &mut looks[k].moved {
            *moved -= back;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::market::{Level, Quotes};

    /// A tape whose mid jumps by a tick every so many seconds, up and down by chance, and comes back by a part of that a second later.
    fn tape(back: i64) -> Tape {
        let mut quotes = Quotes::with_depth(1);
        let at = |seconds: f64| Timestamp(0).plus_seconds(seconds);
        let (mut ticks, mut dice) = (100_000_i64, 7_u64);
        let mut show = |time: f64, ticks: i64| {
            let level = |ticks: i64| [Level { price: ticks as f64 * 0.001, size: 100.0 }];
            quotes.push(at(time), &level(ticks - 10), &level(ticks + 10));
        };
        for k in 0..1_000 {
            dice = dice * 48_271 % 2_147_483_647;
            let jump = if dice % 2 == 0 { 10 } else { -10 };
            show(10.0 * k as f64, ticks + jump);
            ticks += jump - jump * back / 10;
            show(10.0 * k as f64 + 1.0, ticks);
        }
        Tape::new(quotes, Vec::new(), Vec::new())
    }

    #[test]
    fn what_comes_back_is_found_where_nobody_traded() {
        let reversal = Reversal::of(&tape(4), &[]);
        assert_eq!(reversal.gone(0.2), 0.0, "{reversal:?}");
        // Of what is looked at, half are moves back, from which nothing comes back.
        let gone = reversal.gone(3.0);
        assert!((0.2..0.45).contains(&gone), "{reversal:?}");
        assert_eq!(reversal.gone(1e3), reversal.parts[TIMES - 1]);
    }

    #[test]
    fn nothing_comes_back_of_a_walk_nor_where_own_fills_are_everywhere() {
        assert_eq!(Reversal::of(&tape(0), &[]).gone(3.0), 0.0);
        let own: Vec<Timestamp> = (0..500).map(|k| Timestamp(0).plus_seconds(20.0 * f64::from(k))).collect();
        assert_eq!(Reversal::of(&tape(4), &own), Reversal::default());
    }

    #[test]
    fn what_comes_back_is_taken_from_the_looks_that_saw_it() {
        let tape = tape(4);
        let at = |seconds: f64| Timestamp(0).plus_seconds(seconds);
        let look = |seconds: f64, moved| Look { at: at(seconds), mid: 100.0, moved, scatter: 1.0 };
        let mut looks = [look(1.0, None), look(4_010.05, Some(-0.4)), look(4_013.0, Some(0.0)), look(4_600.0, Some(0.0))];
        let came = Came { at: at(4_010.0), moved: 1.0 };
        discount(&mut looks, &tape, vec![came], vec![at(4_010.0)]);
        let reversal = Reversal::of(&tape, &[at(4_010.0)]);
        let expected = reversal.gone(3.0) - reversal.gone(0.05);
        let moved: Vec<f64> = looks.iter().filter_map(|look| look.moved).collect();
        assert!((moved[0] + 0.4 - reversal.gone(0.05)).abs() < 1e-12, "{moved:?}");
        assert!((moved[1] - expected).abs() < 1e-12 && expected > 0.1, "{moved:?} {expected}");
        // No more came back than does within the longest time.
        assert!((moved.iter().sum::<f64>() + 0.4 - reversal.gone(1e3)).abs() < 1e-12, "{moved:?}");
    }
}
