//! When orders met a market on which their own trades are not found, as the reports of their fills tell it.
//!
//! Delays that differ from order to order are no one delay. But every order says when its fill was reported, and where what orders
//! paid is what the market showed at that stamp, or after the same part of the way to it, that is when they met it.

use crate::sim2real::Timestamp;

use super::log_rows::Outcome;
use super::{InFlight, PriceAssumption, Seen, Tape};

/// With fewer orders that were reported later than they were decided, reports tell nothing.
const ENOUGH: usize = 50;
/// Orders that are asked at the most, evenly over all.
const ASKED: usize = 500;
/// Parts of the way from decision to report at which orders may have met the market: the rest is the way back. It may be told in so
/// many steps.
const STEPS: u32 = 20;
/// Orders met the market there where that leaves less than this part of the variance of what they cost against their decisions ...
const LEFT: f64 = 0.5;
/// ... and where costs still vary by more than that of a price rounded to its tick.
const ROUNDED: f64 = 1.0 / 12.0;

/// When each order met the market: at its `own_print`, or where most are not found on the tape, when its report says, if reports tell.
pub(super) fn met_at(
    own_prints: &[Option<Timestamp>],
    told: impl FnOnce() -> Option<(f64, Vec<Option<Timestamp>>)>,
    notes: &mut Vec<String>,
) -> Vec<Option<Timestamp>> {
    let found = own_prints.iter().flatten().count();
    let Some((part, told)) = Some(2 * found < own_prints.len()).filter(|few| *few).and_then(|_| told()) else {
        return own_prints.to_vec();
    };
    notes.push(match part {
        1.0 => "what orders paid is what the market showed when their fills are stamped: they are taken to have met it then".to_owned(),
        _ => format!(
            "what orders paid is what the market showed after {:.0} % of their way from decision to report: they are taken to have met \
             it then",
            100.0 * part
        ),
    });
    own_prints.iter().zip(told).map(|(print, told)| print.or(told)).collect()
}

/// When each of `orders` met the market, and after which part of its way from decision to report; none where reports do not tell.
pub(super) fn met_by_report(
    tape: &Tape,
    price: PriceAssumption,
    tick_size: f64,
    orders: &[InFlight],
    outcomes: &[Outcome],
) -> Option<(f64, Vec<Option<Timestamp>>)> {
    let reported = |(order, outcome): (&InFlight, &Outcome)| {
        let late = outcome.first_fill.filter(|at| *at > order.decided_at)?;
        Some((*order, late, outcome.price?))
    };
    let known: Vec<(InFlight, Timestamp, f64)> = orders.iter().zip(outcomes).filter_map(reported).collect();
    if known.len() < ENOUGH {
        return None;
    }
    let every = known.len().div_ceil(ASKED);
    let variance = |part: f64| {
        let cost = |(order, report, paid): &(InFlight, Timestamp, f64)| {
            let seen = Seen::by(&order.arriving(on_the_way(order.decided_at, *report, part)), None);
            Some(order.side.sign() * (paid - price.price(tape, order.side, seen)?))
        };
        let costs: Vec<f64> = known.iter().step_by(every).filter_map(cost).collect();
        let mean = costs.iter().sum::<f64>() / costs.len().max(1) as f64;
        costs.iter().map(|cost| (cost - mean).powi(2)).sum::<f64>() / costs.len().max(1) as f64
    };
    let at_decision = variance(0.0);
    if at_decision <= ROUNDED * tick_size * tick_size {
        return None;
    }
    let parts = (1..=STEPS).rev().map(|step| f64::from(step) / f64::from(STEPS));
    let (part, left) = parts.map(|part| (part, variance(part))).min_by(|a, b| a.1.total_cmp(&b.1))?;
    let met = |(order, outcome): (&InFlight, &Outcome)| {
        outcome.first_fill.filter(|at| *at > order.decided_at).map(|at| on_the_way(order.decided_at, at, part))
    };
    (left < LEFT * at_decision).then(|| (part, orders.iter().zip(outcomes).map(met).collect()))
}

/// A part of the way from one time to another.
fn on_the_way(from: Timestamp, to: Timestamp, part: f64) -> Timestamp {
    if part >= 1.0 { to } else { Timestamp(from.0 + ((to.0 - from.0) as f64 * part).round() as i64) }
}

#[cfg(test)]
mod tests {
    use rand::RngExt;

    use super::*;
    use crate::market::{Level, Quotes, Side};
    use crate::sim2real::Seed;

    /// A market that moves by a tick every second, and orders that meet it after delays that differ, of which the report comes `later`
    /// than that by a part of it.
    fn scene(later: f64) -> (Tape, Vec<InFlight>, Vec<Outcome>) {
        let mut rng = Seed(1).stream("scene");
        let mut quotes = Quotes::with_depth(1);
        let mut bid = 4_000_i32;
        let mut asks = Vec::new();
        for second in 0..4_000 {
            bid += if rng.random::<bool>() { 1 } else { -1 };
            let level = |ticks: i32| [Level { price: 0.01 * f64::from(ticks), size: 100.0 }];
            quotes.push(Timestamp(0).plus_seconds(f64::from(second)), &level(bid), &level(bid + 1));
            asks.push(0.01 * f64::from(bid + 1));
        }
        let (mut orders, mut outcomes) = (Vec::new(), Vec::new());
        for k in 0..200 {
            let decided = 10.0 + 15.0 * f64::from(k) + 0.5;
            let delay = 20.0 * rng.random::<f64>();
            let paid = asks[(decided + delay) as usize];
            let at = Timestamp(0).plus_seconds(decided);
            let assumed = asks[decided as usize];
            orders.push(InFlight::market(Side::Buy, 10.0, at, assumed, assumed - 0.005));
            let report = at.plus_seconds(delay * (1.0 + later));
            outcomes.push(Outcome { first_fill: Some(report), price: Some(paid), ..Outcome::default() });
        }
        (Tape::new(quotes, Vec::new(), Vec::new()), orders, outcomes)
    }

    fn told(later: f64) -> Option<(f64, Vec<Option<Timestamp>>)> {
        let (tape, orders, outcomes) = scene(later);
        met_by_report(&tape, PriceAssumption::Touch, 0.01, &orders, &outcomes)
    }

    #[test]
    fn orders_met_the_market_when_what_they_paid_was_shown() {
        let (part, met) = told(0.0).unwrap();
        assert_eq!(part, 1.0);
        assert_eq!(met, scene(0.0).2.iter().map(|outcome| outcome.first_fill).collect::<Vec<_>>());
        let (part, _) = told(1.0).unwrap();
        assert!((part - 0.5).abs() < 0.06, "half of the way is the way back: {part}");
    }

    #[test]
    fn reports_that_do_not_tell_are_not_believed() {
        let (tape, orders, mut outcomes) = scene(0.0);
        let paid: Vec<Option<f64>> = orders.iter().map(|order| Some(order.assumed)).collect();
        let asked = |outcomes: &[Outcome]| met_by_report(&tape, PriceAssumption::Touch, 0.01, &orders, outcomes);
        assert!(asked(&outcomes[..40]).is_none(), "too few");
        outcomes.iter_mut().zip(&paid).for_each(|(outcome, paid)| outcome.price = *paid);
        assert!(asked(&outcomes).is_none(), "they were filled as they were decided");
        outcomes.iter_mut().enumerate().for_each(|(k, outcome)| outcome.price = Some(40.0 + 0.01 * (k * 37 % 50) as f64));
        assert!(asked(&outcomes).is_none(), "at prices that have nothing to do with the market");
    }
}
