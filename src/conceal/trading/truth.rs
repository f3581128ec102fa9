//! True parameters, by the names that registries give them, as far as they can be compared.
//!
//! Where forms differ, the parameter told is the one by which a registry's form comes nearest, in least squares, to what the
//! effect did to each order on the day to learn from. Volumes are as the twin has them: it is by those that a fit counts.

use std::collections::BTreeMap;

use super::case::World;
use super::client::Intent;
use super::effect::{Effect, Fee};
use super::executed::{Execution, Outcome};
use super::floor::{Scene, sizes};
use super::size::Channel;
use super::wake::{Kernel, Wake};

/// The parameters of `effect`, called `id`, which makes of a day `without` it the day `with` it; `volume` is a day's [units] as
/// the twin has it, and `volatility` a day's likewise (a fraction).
pub(super) fn parameters(
    id: &str,
    effect: &Effect,
    scene: &Scene<'_>,
    [with, without]: [&Outcome; 2],
    [volume, volatility]: [f64; 2],
) -> BTreeMap<String, f64> {
    let costs = [with, without].map(|outcome| Channel::Cost.shows(scene, outcome));
    let cost: Vec<Option<f64>> =
        costs[0].iter().zip(&costs[1]).map(|(with, without)| Some((*with)? - (*without)?)).collect();
    let nearest = |column: &dyn Fn(&Intent, &Execution) -> f64| {
        let column: Vec<f64> = scene.orders.iter().zip(&with.executions).map(|(order, met)| column(order, met)).collect();
        projected(&cost, &column)
    };
    let one = |name: &str, value: Option<f64>| value.map(|value| (name.to_owned(), value)).into_iter().collect();
    let part = |order: &Intent| order.quantity / volume;
    match effect {
        Effect::Spread { .. } => one("fraction", nearest(&|_, met| half_spread(met))),
        Effect::Walk { .. } => one("fraction", nearest(&|order, met| walk(order, met, scene))),
        Effect::Impact { .. } if id == "linear_impact" => one("bps_at_full_participation", nearest(&|order, _| part(order))),
        Effect::Impact { .. } => one("bps_at_full_participation", nearest(&|order, _| part(order).sqrt())),
        Effect::Displacement { kernel, .. } if *kernel == Kernel::lasting() => {
            let value = match scene.world {
                World::Live => projected(&kicks(with), &scene.orders.iter().map(part).collect::<Vec<f64>>()),
                World::Paper => projected(&cost, &displaced(scene, with, kernel, volume)),
            };
            one("bps_at_full_participation", value)
        }
        // A fit of another kernel finds another height at the beginning.
        Effect::Displacement { .. } | Effect::Foreign(_) => BTreeMap::new(),
        Effect::Slippage { .. } => one("fraction", nearest(&|_, _| 1e4 * volatility)),
        Effect::Latency { seconds, .. } => one("seconds", Some(*seconds)),
        Effect::Fee(Fee::OfNotional(bps)) => one("bps", Some(*bps)),
        Effect::Fee(Fee::PerShare(amount)) => one("per_share", Some(*amount)),
        Effect::Fee(Fee::Minimum(amount, least)) => {
            BTreeMap::from([("per_share".to_owned(), *amount), ("minimum".to_owned(), *least)])
        }
        Effect::Fee(Fee::PerOrder(amount)) => one("per_order", Some(*amount)),
        Effect::Cap { fraction, .. } => one("fraction", Some(*fraction)),
        Effect::Lots { lot } => one("lot", Some(*lot)),
        Effect::Age { seconds } => one("seconds", Some(*seconds)),
        // Its draws, of which the largest are cut, have a mean a little below 1.
        Effect::Toxic { bps, .. } => one("bps", Some(bps * TOXIC)),
        Effect::Queue { ahead, wobble } => one("ahead", Some(ahead * (0.5 * wobble * wobble).exp())),
    }
}

/// Mean of `min(0.5 - ln(u) / 2, 3)` with `u` evenly in [0, 1): what a fill at rest moves the price by, over its usual size.
const TOXIC: f64 = 0.996_631;

/// The factor by which `column` comes nearest to `effect`.
fn projected(effect: &[Option<f64>], column: &[f64]) -> Option<f64> {
    let pairs = effect.iter().zip(column).filter_map(|(effect, column)| Some(((*effect)?, *column)));
    let (product, square) = pairs.fold((0.0, 0.0), |(p, s), (effect, column)| (p + effect * column, s + column * column));
    (square > 0.0).then(|| product / square)
}

fn half_spread(met: &Execution) -> f64 {
    0.5 * (met.met.ask - met.met.bid) as f64 / met.decided.mid() * 1e4
}

/// What the displayed levels would have cost beyond the touch [bps].
fn walk(order: &Intent, met: &Execution, scene: &Scene<'_>) -> f64 {
    let row = &scene.tape.rows[met.met.row];
    let displayed = sizes(row, order.buys, scene.usual);
    let (mut left, mut paid, mut last) = (order.quantity, 0.0, 0.0);
    for (size, step) in displayed.iter().zip(row.steps).take(scene.levels) {
        last = step as f64;
        let part = size.min(left);
        paid += part * last;
        left -= part;
    }
    (paid + left * last) / order.quantity / met.decided.mid() * 1e4
}

fn kicks(outcome: &Outcome) -> Vec<Option<f64>> {
    outcome.executions.iter().map(|execution| Some(execution.kick).filter(|_| !execution.pieces.is_empty())).collect()
}

/// What orders would pay for a displacement that is linear in the quantity, of 1 bps at a day's volume [bps].
fn displaced(scene: &Scene<'_>, outcome: &Outcome, kernel: &Kernel, volume: f64) -> Vec<f64> {
    let mut wake = Wake::new(kernel);
    let mut order: Vec<usize> = (0..scene.orders.len()).collect();
    order.sort_by(|a, b| outcome.executions[*a].arrived.total_cmp(&outcome.executions[*b].arrived));
    let mut column = vec![0.0; order.len()];
    for number in order {
        let intent = &scene.orders[number];
        let own = if outcome.executions[number].pieces.is_empty() { 0.0 } else { intent.quantity / volume };
        column[number] = intent.sign() * wake.at(outcome.executions[number].arrived) + 0.5 * own;
        wake.kick(intent.sign() * own);
    }
    column
}
