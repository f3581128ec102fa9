//! Regimes of volatility: whether a market was in its calm or in its restless state.

use crate::sim2real::Timestamp;
use crate::sim2real::regime::{Filter, Observations, Settings, fit};

use super::{Seen, Tape};

/// Time between the mids whose returns are looked at [s], and most of them: a longer tape is looked at less often.
const STEP: f64 = 10.0;
const MOST: usize = 20_000;
/// Fewer returns than these have no regimes.
const FEWEST: usize = 200;
/// Least variance of a state, as a part of that of all returns: mids that rest on a tick are no regime of their own.
const FLOOR: f64 = 1e-2;
/// Starts and iterations of a fit.
const STARTS: usize = 2;
const ITERATIONS: usize = 100;

/// The probability that `tape` was in the more volatile of two states when it was at each of `times`, by what it had shown until then; none
/// where its returns speak for one state alone.
///
/// A hidden Markov model of two Gaussian states is fitted to the returns of the whole tape, and followed by its filter (Hamilton, "A
/// new approach to the economic analysis of nonstationary time series and the business cycle", Econometrica 57 (1989)): the
/// state is known without a look ahead, what the states are is not.
pub(super) fn restless(tape: &Tape, times: &[Timestamp]) -> Option<Vec<f64>> {
    let (first, last) = tape.span()?;
    let span = last.seconds_since(first);
    let step = STEP.max(span / MOST as f64);
    let count = (span / step) as usize;
    if count < FEWEST {
        return None;
    }
    let mids = (0..=count).map(|k| tape.mid(Seen::at(first.plus_seconds(step * k as f64))));
    let mids: Vec<f64> = mids.map(|mid| mid.unwrap_or(f64::NAN)).collect();
    let returns: Vec<f64> = mids.windows(2).map(|pair| 1e4 * (pair[1] / pair[0]).ln()).collect();
    let series = [Observations::of(&returns).ok()?];
    let settings = |states| Settings { starts: STARTS, iterations: ITERATIONS, floor: FLOOR, ..Settings::new(states) };
    let (one, two) = (fit(&series, &settings(1)).ok()?, fit(&series, &settings(2)).ok()?);
    if two.bic() >= one.bic() || !two.collapsed.is_empty() {
        return None;
    }
    let mut filter = Filter::new(two.model);
    let mut believed = Vec::with_capacity(returns.len());
    for one in &returns {
        believed.push(filter.step(std::slice::from_ref(one)).ok()?[1]);
    }
    let at = |time: &Timestamp| {
        let over = (time.seconds_since(first) / step).floor().max(0.0) as usize;
        // Before the first return is over nothing is known.
        over.checked_sub(1).map_or(0.5, |last| believed[last.min(believed.len() - 1)])
    };
    Some(times.iter().map(at).collect())
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution, StandardNormal};

    use super::*;
    use crate::market::{Level, Quotes};
    use crate::sim2real::Seed;

    fn tape(deviation: impl Fn(usize) -> f64) -> Tape {
        let mut draws = Seed(5).stream("regimes");
        let (mut quotes, mut mid) = (Quotes::with_depth(1), 100.0_f64);
        for k in 0..1_200 {
            let normal: f64 = StandardNormal.sample(&mut *draws);
            mid *= (1e-4 * deviation(k) * normal).exp();
            let level = |price| [Level { price, size: 1.0 }];
            quotes.push(Timestamp(0).plus_seconds(10.0 * k as f64), &level(mid - 0.005), &level(mid + 0.005));
        }
        Tape::new(quotes, Vec::new(), Vec::new())
    }

    #[test]
    fn the_restless_hour_is_known_as_one() {
        let tape = tape(|k| if (500..800).contains(&k) { 9.0 } else { 3.0 });
        let at = |k: i32| Timestamp(0).plus_seconds(10.0 * f64::from(k) + 1.0);
        let found = restless(&tape, &[at(100), at(300), at(550), at(700), at(1_000)]).expect("two regimes");
        assert!(found[0] < 0.1 && found[1] < 0.1 && found[2] > 0.9 && found[3] > 0.9 && found[4] < 0.1, "{found:?}");
    }

    #[test]
    fn a_steady_market_and_a_short_tape_have_none() {
        assert_eq!(restless(&tape(|_| 3.0), &[Timestamp(0)]), None);
        assert_eq!(restless(&Tape::default(), &[Timestamp(0)]), None);
    }
}
