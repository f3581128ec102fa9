//! Whether orders foresaw the market, or the market follows the orders.
//!
//! Whoever foresees picks among moves that come in any case: after orders they are no larger than at other times. Where what goes with
//! the orders comes on top of what the mid does of itself, the orders have brought it: others follow them.

use crate::sim2real::Timestamp;

use super::foresight::Foresight;
use super::{OrderLog, Seen};

/// The mid is looked at in steps of so long [s], ...
const STEP: f64 = 20.0;
/// ... in those that are within this of an order [s]; how restless the market is is told by as much on each side.
const AROUND: f64 = 300.0;
/// With fewer of them nothing is told.
const FEWEST: usize = 100;
/// What the mid does around a time over what it does on average is believed within these.
const BELIEVED: (f64, f64) = (0.1, 10.0);
/// What goes with orders counts where it is this part of all that the mid does, a mean square: nobody foresees as much (those of the
/// development seeds who see half a minute ahead every third time come to .04).
const SHARE: f64 = 0.08;
/// Of what goes with orders this part at the least comes on top, by so many standard errors.
const ON_TOP: f64 = 0.5;
const CERTAIN: f64 = 3.0;

/// What the tape of `log` says against orders that have foreseen `alphas` [bps], one a horizon; none where it may be so.
pub(super) fn followed(log: &OrderLog, alphas: &[f64]) -> Option<String> {
    let steps = steps(log, alphas);
    if steps.len() < FEWEST {
        return None;
    }
    let steps = calmed(&steps);
    let all = steps.iter().map(|step| step.moved.powi(2)).sum::<f64>();
    let going = steps.iter().map(|step| step.with_orders.powi(2)).sum::<f64>();
    let [on_top, error] = on_top(&steps);
    let brought = going > SHARE * all && on_top > ON_TOP && on_top > CERTAIN * error;
    brought.then(|| {
        let [with_orders, all] = [going, all].map(|sum| (sum / steps.len() as f64).sqrt());
        format!(
            "after orders the mid goes their way by more than they can have foreseen: of the {all:.2} bps that it moves in {STEP:.0} s \
             {with_orders:.2} go with the orders (root mean squares), and come on top of what it does at other times"
        )
    })
}

/// A step of the mid: what it moved, and what of that goes with the orders [bps].
#[derive(Debug, Clone, Copy, PartialEq)]
struct Step {
    /// Its number from the beginning of the tape.
    number: i64,
    moved: f64,
    with_orders: f64,
}

/// The steps of the mid of the tape around the orders that took.
fn steps(log: &OrderLog, alphas: &[f64]) -> Vec<Step> {
    let Some((first, last)) = log.tape().span() else { return Vec::new() };
    let orders = || log.orders().iter().filter(|order| order.takes());
    let number = |at: Timestamp| (at.seconds_since(first) / STEP).floor() as i64;
    let reach = (AROUND / STEP) as i64;
    let whole = number(last);
    let mut foresight = Foresight::of(alphas.iter().copied());
    let mut orders_left = orders().map(|order| (order.decided_at.seconds_since(first), order.side.sign())).peekable();
    let mut steps: Vec<Step> = Vec::new();
    let mut next = 0;
    for order in orders() {
        let near = number(order.decided_at);
        for number in (near - reach).max(next)..(near + reach + 1).min(whole) {
            next = number + 1;
            let [from, to] = [number, next].map(|number| number as f64 * STEP);
            let mut look = |until: f64| {
                while let Some((at, sign)) = orders_left.next_if(|(at, _)| *at <= until) {
                    foresight.decided(at, sign);
                }
                foresight.look(until, 0.0)
            };
            look(from);
            let with_orders = look(to);
            let mid = |seconds: f64| log.tape().mid(Seen::at(first.plus_seconds(seconds)));
            if let (Some(before), Some(after)) = (mid(from), mid(to)) {
                steps.push(Step { number, moved: (after - before) / before * 1e4, with_orders });
            }
        }
    }
    steps
}

/// The same steps, over how much the mid moves around each, of which the average is 1.
fn calmed(steps: &[Step]) -> Vec<Step> {
    let reach = (AROUND / STEP) as i64;
    let mean = |of: &[Step]| of.iter().map(|step| step.moved.powi(2)).sum::<f64>() / of.len().max(1) as f64;
    let all = mean(steps);
    let own = |step: &Step| {
        let from = steps.partition_point(|other| other.number < step.number - reach);
        let to = steps.partition_point(|other| other.number <= step.number + reach);
        let restless = (mean(&steps[from..to]) / all.max(f64::MIN_POSITIVE)).clamp(BELIEVED.0, BELIEVED.1).sqrt();
        Step { moved: step.moved / restless, with_orders: step.with_orders / restless, ..*step }
    };
    steps.iter().map(own).collect()
}

/// What of the squares of what goes with orders comes on top of the squares that there are at other times, and its standard error: the
/// slope of a line of squares on squares, and one by White, "A heteroskedasticity-consistent covariance matrix estimator", Econometrica
/// 48 (1980).
fn on_top(steps: &[Step]) -> [f64; 2] {
    let squares = || steps.iter().map(|step| (step.with_orders.powi(2), step.moved.powi(2)));
    let count = steps.len() as f64;
    let (x, y) = squares().fold((0.0, 0.0), |(x, y), (one, other)| (x + one / count, y + other / count));
    let (product, square) = squares()
        .fold((0.0, 0.0), |(product, square), (one, other)| (product + (one - x) * (other - y), square + (one - x).powi(2)));
    let slope = product / square.max(f64::MIN_POSITIVE);
    let scatter = squares().map(|(one, other)| ((one - x) * (other - y - slope * (one - x))).powi(2)).sum::<f64>();
    [slope, scatter.sqrt() / square.max(f64::MIN_POSITIVE)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng, rngs::StdRng};
    use rand_distr::{Distribution, StandardNormal};

    /// Steps of a mid of standard deviation 1; every other is one in which an order is carried out.
    fn walk(seed: u64, order: impl Fn(&mut StdRng, f64) -> (f64, f64)) -> Vec<Step> {
        let mut rng = StdRng::seed_from_u64(seed);
        (0..4_800)
            .map(|number| {
                let of_itself: f64 = StandardNormal.sample(&mut rng);
                let (moved, with_orders) = if number % 2 == 0 { order(&mut rng, of_itself) } else { (of_itself, 0.0) };
                Step { number, moved, with_orders }
            })
            .collect()
    }

    #[test]
    fn what_is_brought_comes_on_top_and_what_is_foreseen_does_not() {
        for seed in 0..20 {
            // Nine of ten orders know which way the mid will go: on average it goes their way by 0.9 * sqrt(2 / pi).
            let known = 0.9 * (2.0 / std::f64::consts::PI).sqrt();
            let foreseen = walk(seed, |rng, of_itself| {
                let sign = if rng.random_bool(0.9) { of_itself.signum() } else { 1.0 };
                (of_itself, sign * known)
            });
            let brought = walk(seed, |rng, of_itself| {
                let sign = if rng.random_bool(0.5) { known } else { -known };
                (of_itself + sign, sign)
            });
            let [[slope, error], [other, other_error]] = [&foreseen, &brought].map(|steps| on_top(&calmed(steps)));
            assert!(slope < ON_TOP && slope < CERTAIN * error, "seed {seed}: {slope} of {error}");
            assert!(other > ON_TOP && other > CERTAIN * other_error, "seed {seed}: {other} of {other_error}");
        }
    }

    #[test]
    fn a_market_that_is_restless_for_hours_brings_nothing() {
        let mut steps = walk(3, |_, of_itself| (of_itself, 0.8));
        // Orders come in the restless half alone.
        for step in &mut steps {
            let restless = step.number < 2_400;
            step.moved *= if restless { 3.0 } else { 1.0 };
            step.with_orders *= if restless { 3.0 } else { 0.0 };
        }
        let [slope, error] = on_top(&calmed(&steps));
        assert!(slope.abs() < CERTAIN * error, "{slope} of {error}");
        let [as_it_is, _] = on_top(&steps);
        assert!(as_it_is > ON_TOP, "{as_it_is}");
    }
}
