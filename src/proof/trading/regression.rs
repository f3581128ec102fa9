//! A baseline: ordinary least squares of costs on what they are usually put down to, as in Kissell, *The Science of Algorithmic
//! Trading and Portfolio Management* (2014), chapter 4. It takes each order by itself and the market as it was decided on.

use nalgebra::DVector;

use crate::market::{InFlight, OrderLog, Seen};
use crate::proof::selection::{Term, selected};
use crate::sim2real::Recording;

/// What a cost may be put down to, order by order.
type Column = fn(&OrderLog, &InFlight) -> Option<f64>;

/// The columns of the textbook, by the name of the mechanism that each stands for.
const COLUMNS: [(&str, Column); 6] = [
    ("half_spread", |log, order| Some(log.tape().book(seen(order))?.half_spread() / order.mid)),
    ("book_walk", |log, order| {
        Some(log.tape().book(seen(order))?.walk(order.side, order.quantity)?.beyond_touch / order.mid)
    }),
    ("linear_impact", |_, order| Some(order.participation(f64::INFINITY))),
    ("sqrt_impact", |_, order| Some(order.participation(f64::INFINITY).sqrt())),
    ("command_delay", |log, order| {
        let later = log.tape().mid(Seen::at(order.decided_at.plus_seconds(LATER)))?;
        Some(order.side.sign() * (later / order.mid - 1.0))
    }),
    ("transient_impact", |log, order| {
        let since = order.decided_at.plus_seconds(-BEFORE);
        let earlier = log.orders().iter().filter(|other| (since..order.decided_at).contains(&other.decided_at));
        Some(order.side.sign() * earlier.map(|other| other.side.sign() * other.quantity).sum::<f64>())
    }),
];

/// How late an order may be supposed to be, and for how long it may be supposed to be felt [s].
const LATER: f64 = 0.5;
const BEFORE: f64 = 30.0;
/// A fee of less is none [bps].
const FREE: f64 = 1e-3;

fn seen(order: &InFlight) -> Seen {
    Seen::at(order.decided_at)
}

/// The names it gives to what a log shows, strongest first.
pub(in crate::proof) fn regression(recording: &Recording<OrderLog>) -> Vec<String> {
    let log = &recording.stimulus;
    let known = |channel: &str| recording.channel(channel).map(|measured| measured.samples.as_slice()).unwrap_or_default();
    let rows: Vec<(usize, f64)> = known("cost").iter().enumerate().filter_map(|(row, cost)| Some((row, (*cost)?))).collect();
    let costs = DVector::from_iterator(rows.len(), rows.iter().map(|(_, cost)| *cost));
    let column = |of: Column| -> Option<DVector<f64>> {
        let values: Option<Vec<f64>> = rows.iter().map(|(row, _)| of(log, &log.orders()[*row])).collect();
        values.filter(|values| values.iter().all(|value| value.is_finite())).map(DVector::from_vec)
    };
    let library: Vec<Term> = COLUMNS.iter().filter_map(|(id, of)| Some(Term { id, columns: vec![column(*of)?] })).collect();
    let mut names = selected(costs, Vec::new(), &library);
    let fees: Vec<f64> = known("fee").iter().flatten().copied().collect();
    if fees.iter().sum::<f64>().abs() > FREE * fees.len() as f64 {
        names.push("commission".to_owned());
    }
    names
}
