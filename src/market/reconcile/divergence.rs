//! Where two logs part first, and what followed from it.

use std::collections::HashMap;

use serde::Serialize;

use crate::market::Quantity;
use crate::sim2real::Timestamp;

use super::{ClockDifference, Life, OrderDifference};

/// Where two logs part.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Divergence {
    /// When, on the backtest's clock.
    pub at: Timestamp,
    /// Which order, by its ids.
    pub order: String,
    /// What it trades.
    pub symbol: String,
    /// How it differs, in words.
    pub what: String,
    /// Orders from this one on.
    pub orders_from_there: usize,
    /// Of these, those that differ in the same way: in decision, or in execution.
    pub of_these_differ: usize,
    /// When both held the same again of everything, on the backtest's clock; none where they never did.
    pub same_positions_again: Option<Timestamp>,
    /// The gap of profit and loss of the orders from there on [currency].
    pub gap_from_there: f64,
}

/// Where decisions part first, and where executions.
pub(super) fn first_divergence(
    orders: &[OrderDifference],
    backtest: &[Life],
    paper: &[Life],
    clock: &ClockDifference,
) -> (Option<Divergence>, Option<Divergence>) {
    let near = (8.0 * clock.spread).max(1.0);
    let decision = |order: &OrderDifference| order.parts_in_decision(near);
    let execution = |order: &OrderDifference| order.parts_in_execution();
    let of = |parts: &dyn Fn(&OrderDifference) -> bool, words: fn(&OrderDifference) -> String| {
        let first = orders.iter().position(parts)?;
        let (order, rest) = (&orders[first], &orders[first..]);
        Some(Divergence {
            at: order.at,
            order: order.name(),
            symbol: order.symbol.clone(),
            what: words(order),
            orders_from_there: rest.len(),
            of_these_differ: rest.iter().filter(|order| parts(order)).count(),
            same_positions_again: same_again(order.at, backtest, paper, clock),
            gap_from_there: rest.iter().map(|order| order.gap).sum(),
        })
    };
    (of(&decision, decided), of(&execution, executed))
}

fn decided(order: &OrderDifference) -> String {
    if order.paper.is_none() {
        return "the paper log has no such order".to_owned();
    }
    if order.backtest.is_none() {
        return "the backtest has no such order".to_owned();
    }
    let mut words = Vec::new();
    if let Some(ordered) = order.ordered.filter(|ordered| *ordered != 0.0) {
        words.push(format!("{:+.3} % ordered", 100.0 * ordered));
    }
    if order.another_kind {
        words.push("another kind or limit".to_owned());
    }
    if let Some(seconds) = order.decided_seconds
        && words.is_empty()
    {
        words.push(format!("decided {seconds:+.3} s in the paper log"));
    }
    words.join(", ")
}

fn executed(order: &OrderDifference) -> String {
    let mut words = Vec::new();
    if let Some(filled) = order.filled.filter(|filled| *filled != 0.0) {
        words.push(format!("{:+.3} % filled", 100.0 * filled));
    }
    if let Some(bps) = order.price_bps {
        words.push(format!("{bps:+.3} bps of price against it in the paper log"));
    }
    if let Some(bps) = order.fee_bps.filter(|bps| bps.abs() > 1e-2) {
        words.push(format!("{bps:+.3} bps of fees"));
    }
    words.join(", ")
}

/// When both held the same of everything again after they had not, from `since` on.
fn same_again(since: Timestamp, backtest: &[Life], paper: &[Life], clock: &ClockDifference) -> Option<Timestamp> {
    let of = |lives: &'_ [Life], sign: i64| -> Vec<(Timestamp, usize, i64)> {
        let pieces = lives.iter().enumerate().flat_map(|(k, life)| life.pieces.iter().map(move |piece| (k, life, piece)));
        let moved = |(k, life, piece): (usize, &Life, &super::Piece)| {
            let at = if sign > 0 { piece.at } else { clock.on_backtest(piece.at) };
            (at, k, sign.saturating_mul(piece.quantity.signed(life.side).0))
        };
        pieces.map(moved).collect()
    };
    let mut moves: Vec<(Timestamp, &str, i64)> =
        of(backtest, 1).into_iter().map(|(at, k, by)| (at, backtest[k].symbol.as_str(), by)).collect();
    moves.extend(of(paper, -1).into_iter().map(|(at, k, by)| (at, paper[k].symbol.as_str(), by)));
    moves.sort_unstable();
    let (mut apart, mut differing, mut have_parted) = (HashMap::<&str, Quantity>::new(), 0_usize, false);
    for (k, (at, symbol, by)) in moves.iter().enumerate() {
        let held = apart.entry(symbol).or_default();
        let was = *held != Quantity::ZERO;
        *held = *held + Quantity(*by);
        differing = differing + usize::from(*held != Quantity::ZERO) - usize::from(was);
        have_parted |= *at >= since && differing > 0;
        let last_of_instant = moves.get(k + 1).is_none_or(|next| next.0 > *at);
        if have_parted && last_of_instant && differing == 0 && *at >= since {
            return Some(*at);
        }
    }
    None
}
