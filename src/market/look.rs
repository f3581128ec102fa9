//! Looks at the mid between orders: what the market does after one's own fills, and whether its tape shows them at all.
//!
//! The mid just before an order is decided, just after it is filled and at times after that: what it moves from one look to the
//! next is a sample of its own, which all orders before it may have to do with. Such moves are nearly independent of one
//! another; told in standard deviations of what the mid moves of itself in as much time, they are alike as well.

use crate::sim2real::Timestamp;

use super::log_rows::Made;
use super::{InFlight, Seen, Side, Tape};

/// Times after a fill at which the mid is looked at [s]; where there are many orders, fewer of them.
const AFTER: [f64; 12] = [0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 40.0, 80.0, 160.0, 320.0, 640.0, 1_280.0];
const AFTER_OF_MANY: [f64; 5] = [1.0, 5.0, 20.0, 80.0, 320.0];
/// Orders from which on they are many.
const MANY: usize = 2_500;
/// How long after a trade the market has shown what it did [s].
const SETTLED: f64 = 0.05;
/// Quotes an order at the least: mids that are known at decisions alone do not tell what happened in between.
const DENSE: usize = 4;
/// With fewer orders nothing is told of what the market makes of them.
const ENOUGH: usize = 25;
/// The tape shows own orders where this part of them is found on it ...
const FOUND: f64 = 0.5;
/// ... or where the mid goes with them at their fills by so many standard errors.
const CERTAIN: f64 = 5.0;
/// The time after a fill from which is told what the mid would have done without it [s].
const COMPARED: f64 = 2.0;

/// A look at the mid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Look {
    /// When.
    pub at: Timestamp,
    /// The mid [currency].
    pub mid: f64,
    /// What it has moved since the look before [bps]; none at the first.
    pub moved: Option<f64>,
    /// What it moves of itself in as much time, a standard deviation [bps].
    pub scatter: f64,
}

/// When an order was decided, and when the market had answered it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Answered {
    decided: Timestamp,
    answered: Timestamp,
}

/// When an order met the market as far as log and tape tell: at its own print, or when its first fill was reported.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Traded {
    /// Its own print on the tape.
    Print(Timestamp),
    /// The report of its first fill.
    Report(Timestamp),
    /// Never, as far as is known.
    No,
}

impl Traded {
    /// Of an order with its own print and the stamp of its first fill, where they are known.
    pub fn of(own_print: Option<Timestamp>, first_fill: Option<Timestamp>) -> Self {
        match (own_print, first_fill) {
            (Some(print), _) => Self::Print(print),
            (None, Some(fill)) => Self::Report(fill),
            (None, None) => Self::No,
        }
    }

    /// The same with another stamp of its report.
    pub fn reported_at(self, stamp: impl Fn(Timestamp) -> Timestamp) -> Self {
        match self {
            Self::Report(at) => Self::Report(stamp(at)),
            other => other,
        }
    }
}

/// When the market came to the price of a fill that was reported at a time, if it came with it, and when it had come: what the mid did
/// until then is why an order that rested was filled, and nothing that followed from it.
pub(super) fn market_came(tape: &Tape, made: &Made, reported: Timestamp) -> Option<[Timestamp; 2]> {
    let times = tape.quotes().times();
    let rounding = if reported.0 % Timestamp::NANOS == 0 { Timestamp::NANOS } else { 1 };
    let end = times.partition_point(|at| at.0 < reported.0 + rounding);
    let first = times[..end].partition_point(|at| *at < reported).saturating_sub(1);
    let quotes = tape.quotes().between(first, end);
    let comes = |k: &usize| {
        let quote = quotes.get(*k);
        let other = quote.and_then(|quote| if made.order.side == Side::Buy { quote.ask() } else { quote.bid() });
        other.is_some_and(|other| made.order.side.sign() * (other - made.price) <= 0.0)
    };
    let came = (0..quotes.len()).find(comes).and_then(|k| quotes.times().get(k).copied());
    // A look before it comes a nanosecond earlier, and sees the quote.
    came.map(|at| [at, Timestamp(at.0 + 2).max(reported)])
}

/// The looks at the mid of `tape` that tell what it does after `orders`, each with when it was decided and when it traded, in order
/// of time; none where the tape is too coarse or has no quotes.
pub(super) fn looks(tape: &Tape, orders: &[(Timestamp, Traded)], tick_size: f64) -> Vec<Look> {
    if orders.len() < ENOUGH || tape.quotes().times().len() < DENSE * orders.len() {
        return Vec::new();
    }
    let Some((first, last)) = tape.span() else { return Vec::new() };
    let answered: Vec<Answered> = answered(orders).into_iter().flatten().collect();
    let after: &[f64] = if orders.len() < MANY { &AFTER } else { &AFTER_OF_MANY };
    let later = answered.iter().flat_map(|one| after.iter().map(|seconds| one.answered.plus_seconds(*seconds)));
    // What is looked at before a decision is what was there strictly before it.
    let before = answered.iter().map(|one| Timestamp(one.decided.0 - 1));
    let mut times: Vec<Timestamp> = before.chain(answered.iter().map(|one| one.answered)).chain(later).collect();
    times.sort_unstable();
    times.dedup();
    times.retain(|time| (first..=last).contains(time));
    outside(&mut times, &answered);
    let calm = Calm::of(tape, tick_size);
    let mut looks: Vec<Look> = Vec::with_capacity(times.len());
    for at in times {
        let Some(mid) = tape.mid(Seen::at(at)) else { continue };
        let (moved, scatter) = match looks.last() {
            Some(last) => (Some((mid - last.mid) / last.mid * 1e4), calm.scatter(last.at, at)),
            None => (None, f64::INFINITY),
        };
        looks.push(Look { at, mid, moved, scatter });
    }
    scaled(looks)
}

/// Moves beyond this quantile of their size are left out of what a mid does of itself: those after own fills are among them.
const USUAL: f64 = 0.9;
/// Mean square of a normal variable of variance 1 that is within that quantile of its size.
const OF_USUAL: f64 = 0.623;

/// The same looks, their usual moves as those of a normal variable of variance 1: orders trade when markets move more than they do on
/// average.
fn scaled(mut looks: Vec<Look>) -> Vec<Look> {
    let mut squares: Vec<f64> = looks.iter().filter_map(|look| Some((look.moved? / look.scatter).powi(2))).collect();
    squares.sort_by(f64::total_cmp);
    let mean = |of: &[f64]| of.iter().sum::<f64>() / of.len().max(1) as f64;
    let usual = mean(&squares[..(USUAL * squares.len() as f64) as usize]) / OF_USUAL;
    // A mid that hardly ever moves moves all the more when it does.
    let scale = if usual > 0.0 { usual.sqrt() } else { mean(&squares).sqrt() };
    if scale > 0.0 {
        looks.iter_mut().for_each(|look| look.scatter *= scale);
    }
    looks
}

/// When the market had answered each order that traded.
fn answered(orders: &[(Timestamp, Traded)]) -> Vec<Option<Answered>> {
    let rounding = rounding(orders);
    let settled = |at: Timestamp| at.plus_seconds(SETTLED);
    let one = |(decided, traded): &(Timestamp, Traded)| {
        let decided = *decided;
        match *traded {
            Traded::Print(at) => Some(Answered { decided, answered: settled(at.max(decided)) }),
            // A stamp that was rounded down may be of anything until the next.
            Traded::Report(at) => Some(Answered { decided, answered: settled(Timestamp(at.max(decided).0 + rounding)) }),
            Traded::No => None,
        }
    };
    orders.iter().map(one).collect()
}

/// The step to which reports are rounded [ns]: a second, a millisecond, or not at all. The tape tells more exactly when those were
/// decided whose trades it shows.
fn rounding(orders: &[(Timestamp, Traded)]) -> i64 {
    let stamps = || {
        orders.iter().filter_map(|(decided, traded)| match traded {
            Traded::Report(at) => Some(*at),
            Traded::No => Some(*decided),
            Traded::Print(_) => None,
        })
    };
    let whole = |step: i64| stamps().all(|at| at.0 % step == 0);
    [Timestamp::NANOS, Timestamp::NANOS / 1_000].into_iter().find(|step| whole(*step)).unwrap_or(0)
}

/// Leaves out of `times` those at which an order is between its decision and its answer: what moves then is told as a whole.
fn outside(times: &mut Vec<Timestamp>, answered: &[Answered]) {
    let mut open: Vec<Answered> = answered.to_vec();
    open.sort_unstable_by_key(|one| one.decided);
    let (mut next, mut until) = (0, Timestamp(i64::MIN));
    times.retain(|time| {
        while let Some(one) = open.get(next).filter(|one| one.decided <= *time) {
            until = until.max(one.answered);
            next += 1;
        }
        *time >= until
    });
}

/// What a mid moves of itself: over how long, and when.
struct Calm {
    /// Logarithms of times [s] and of mean squared moves over them [bps^2].
    variogram: Vec<(f64, f64)>,
    /// Mean squared move at times over that of the whole tape, in even steps from the first.
    restless: Vec<f64>,
    /// How long one lasts [s].
    step: f64,
    first: Timestamp,
    /// Least variance [bps^2]: that of mids that are rounded to half ticks.
    least: f64,
}

/// Moves that the variogram is made of, at each time between; times between them, from the shortest, each twice the one before.
const MOVES: usize = 2_000;
const SHORTEST: f64 = 0.05;
const TIMES: usize = 16;
/// Time between the moves that tell how restless the market is [s], for how long on each side they are averaged, and how far that
/// is believed.
const STEP: f64 = 10.0;
/// Most such moves: over a longer tape, or one of whose rows one has the stamp of another year, they are further apart.
const STEPS: f64 = 1e6;
const AROUND: usize = 30;
const BELIEVED: (f64, f64) = (0.1, 10.0);

impl Calm {
    fn of(tape: &Tape, tick_size: f64) -> Self {
        let (first, last) = tape.span().unwrap_or_default();
        let span = last.seconds_since(first).max(1.0);
        let mid = |seconds: f64| tape.mid(Seen::at(first.plus_seconds(seconds)));
        let moved = |from: f64, to: f64| Some((mid(to)? - mid(from)?) / mid(from)? * 1e4);
        let mean_square = |seconds: f64| {
            let at = |k: usize| (k as f64 + 0.5) / MOVES as f64 * (span - seconds).max(0.0);
            let squares: Vec<f64> = (0..MOVES).filter_map(|k| Some(moved(at(k), at(k) + seconds)?.powi(2))).collect();
            squares.iter().sum::<f64>() / squares.len().max(1) as f64
        };
        let least = mid(0.5 * span).map_or(0.0, |mid| (tick_size / mid * 1e4).powi(2) / 24.0);
        let times = (0..TIMES).map(|k| SHORTEST * 2.0_f64.powi(k as i32)).filter(|seconds| *seconds < 0.5 * span);
        let variogram = times.map(|seconds| (seconds.ln(), mean_square(seconds).max(least).ln())).collect();
        let step = STEP.max(span / STEPS);
        let steps = (span / step) as usize;
        let squares: Vec<f64> =
            (0..steps).map(|k| moved(k as f64 * step, (k + 1) as f64 * step).map_or(0.0, |m| m * m)).collect();
        Self { variogram, restless: around(&squares), step, first, least }
    }

    /// Standard deviation of the move between two times [bps].
    fn scatter(&self, from: Timestamp, to: Timestamp) -> f64 {
        let middle = 0.5 * (from.seconds_since(self.first) + to.seconds_since(self.first));
        let restless = self.restless.get((middle / self.step).max(0.0) as usize).copied().unwrap_or(1.0);
        let variance = self.variance(to.seconds_since(from)) * restless;
        variance.max(self.least).sqrt()
    }

    /// Mean squared move over `seconds` [bps^2], on a line through the variogram.
    fn variance(&self, seconds: f64) -> f64 {
        let log = seconds.max(1e-9).ln();
        let after = self.variogram.partition_point(|(time, _)| *time < log);
        let [low, high] = match self.variogram.as_slice() {
            [] => return self.least,
            [(_, only)] => return only.exp(),
            all => {
                let high = after.clamp(1, all.len() - 1);
                [all[high - 1], all[high]]
            }
        };
        // Below the shortest time a move is no larger; beyond the longest the line goes on.
        let slope = (high.1 - low.1) / (high.0 - low.0);
        (low.1 + slope * (log.max(self.variogram[0].0) - low.0)).exp()
    }
}

/// Means of squares around each, over the mean of all.
fn around(squares: &[f64]) -> Vec<f64> {
    let sums: Vec<f64> = std::iter::once(0.0)
        .chain(squares.iter().scan(0.0, |sum, square| {
            *sum += square;
            Some(*sum)
        }))
        .collect();
    let all = sums.last().copied().unwrap_or_default() / squares.len().max(1) as f64;
    let own = |k: usize| {
        let (from, to) = (k.saturating_sub(AROUND), (k + AROUND + 1).min(squares.len()));
        ((sums[to] - sums[from]) / (to - from) as f64 / all).clamp(BELIEVED.0, BELIEVED.1)
    };
    (0..squares.len()).map(|k| if all > 0.0 { own(k) } else { 1.0 }).collect()
}

/// Whether the tape shows what own orders did: they are found on it, or the mid goes with them at their fills by more than it
/// would have by going on as it does soon after.
pub(super) fn shows_own(tape: &Tape, orders: &[InFlight], traded: &[(Timestamp, Traded)], tick_size: f64) -> bool {
    let printed = traded.iter().filter(|(_, traded)| matches!(traded, Traded::Print(_))).count();
    if orders.len() < ENOUGH || tape.quotes().times().len() < DENSE * orders.len() {
        return false;
    }
    if printed as f64 >= FOUND * orders.len() as f64 {
        return true;
    }
    let calm = Calm::of(tape, tick_size);
    let moves = orders.iter().zip(answered(traded)).filter_map(|(order, answered)| {
        let one = answered?;
        let before = Timestamp(one.decided.0 - 1);
        let mid = |at| tape.mid(Seen::at(at));
        let (start, end) = (mid(before)?, mid(one.answered)?);
        let went_on = mid(one.answered.plus_seconds(COMPARED))?;
        let share = one.answered.seconds_since(before) / COMPARED;
        let jump = (end - start) - share * (went_on - end);
        let scatter = calm.scatter(before, one.answered).hypot(share * calm.variance(COMPARED).sqrt());
        Some(order.side.sign() * jump / start * 1e4 / scatter)
    });
    let moves: Vec<f64> = moves.collect();
    let count = moves.len() as f64;
    moves.len() >= ENOUGH && moves.iter().sum::<f64>() / count.sqrt() > CERTAIN
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::market::{Level, Quotes};

    /// One stamp of another year makes a tape long, and nothing of it large.
    #[test]
    fn a_tape_of_sixty_years_is_looked_at_in_steps_that_are_longer() {
        let mut quotes = Quotes::with_depth(1);
        let year = 31_557_600.0;
        let seconds = (0..1_000).map(|k| f64::from(k) * 0.5).chain([60.0 * year]);
        for (k, at) in seconds.enumerate() {
            let mid = 100.0 + 0.01 * (k % 7) as f64;
            let level = |price: f64| [Level { price, size: 1.0 }];
            quotes.push(Timestamp(0).plus_seconds(at), &level(mid - 0.01), &level(mid + 0.01));
        }
        let calm = Calm::of(&Tape::new(quotes, Vec::new(), Vec::new()), 0.01);
        let steps = calm.restless.len() as f64;
        assert!((0.99 * STEPS..=STEPS).contains(&steps), "{steps}");
        let within = calm.scatter(Timestamp(0).plus_seconds(3.0), Timestamp(0).plus_seconds(4.0));
        assert!(within.is_finite() && within > 0.0, "{within}");
    }
}
