//! What a log and a tape show of a day, as tables.

use super::case::{Day, Depth};
use super::client::Intent;
use super::executed::{Execution, Outcome, Piece, Print, Shown};
use super::floor::{Scene, sizes};
use super::plan::Circumstances;
use super::tape::LEVELS;
use crate::conceal::{Column, Table};

/// Nanoseconds in a second.
const SECOND: f64 = 1e9;
/// The way back, as a part of the way there.
const BACK: f64 = 0.8;

/// How a day is written down.
pub(super) struct Written<'a> {
    pub symbol: &'a str,
    /// The open [ns since the Unix epoch].
    pub open: i64,
    pub circumstances: &'a Circumstances,
    /// Whether fills are stamped when the client hears of them, and not when they happen.
    pub heard: bool,
}

impl Written<'_> {
    /// The tables of a day.
    pub fn day(&self, scene: &Scene<'_>, outcome: &Outcome) -> Day {
        Day {
            orders: self.orders(scene.orders, outcome),
            fills: self.fills(scene.orders, outcome),
            quotes: match self.circumstances.depth {
                Depth::MidsOnly => self.mids(scene.orders, outcome),
                Depth::Touch | Depth::FiveLevels => self.quotes(scene, outcome),
            },
            trades: self.circumstances.prints.then(|| self.trades(&outcome.prints)),
        }
    }

    /// Seconds after the open as a stamp of the tape [ns].
    fn stamp(&self, time: f64) -> i64 {
        self.open + (time * SECOND).round() as i64
    }

    /// The same as the client's log has it.
    fn noted(&self, time: f64) -> i64 {
        let stamp = self.stamp(time);
        if self.circumstances.rounded { stamp - stamp.rem_euclid(SECOND as i64) } else { stamp }
    }

    fn orders(&self, orders: &[Intent], outcome: &Outcome) -> Table {
        let met = &outcome.executions;
        let limit = |(order, met): (&Intent, &Execution)| order.rests.map(|_| unit(met.decided.touch(!order.buys) as f64));
        let words = |of: &dyn Fn(&Intent) -> &'static str| Column::Text(orders.iter().map(|o| of(o).to_owned()).collect());
        let table = Table::default()
            .with("order_id", Column::Whole((1..=orders.len() as i64).collect()))
            .with("symbol", Column::Text(vec![self.symbol.to_owned(); orders.len()]))
            .with("decided_at", Column::Time(orders.iter().map(|order| self.noted(order.time)).collect()))
            .with("side", words(&|order| if order.buys { "buy" } else { "sell" }))
            .with("qty", Column::Whole(orders.iter().map(|order| order.quantity as i64).collect()))
            .with("type", words(&|order| if order.rests.is_some() { "limit" } else { "market" }))
            .with("limit_price", Column::Sparse(orders.iter().zip(met).map(limit).collect()));
        if !self.circumstances.tells_seen {
            return table;
        }
        table
            .with("seen_bid", Column::Real(met.iter().map(|met| unit(met.seen.bid as f64)).collect()))
            .with("seen_ask", Column::Real(met.iter().map(|met| unit(met.seen.ask as f64)).collect()))
    }

    fn fills(&self, orders: &[Intent], outcome: &Outcome) -> Table {
        let mut rows: Vec<(i64, usize, &Piece, f64)> = Vec::new();
        for (number, execution) in outcome.executions.iter().enumerate() {
            let way = if self.heard { BACK * (execution.arrived - orders[number].time) } else { 0.0 };
            for (k, piece) in execution.pieces.iter().enumerate() {
                // The fee of an order stands beside its first fill.
                let fee = if k == 0 { execution.fee } else { 0.0 };
                rows.push((self.noted(piece.time + way), number, piece, fee));
            }
        }
        rows.sort_by_key(|(stamp, number, ..)| (*stamp, *number));
        let liquidity = |number: usize| if orders[number].rests.is_some() { "maker" } else { "taker" };
        Table::default()
            .with("order_id", Column::Whole(rows.iter().map(|(_, number, ..)| *number as i64 + 1).collect()))
            .with("filled_at", Column::Time(rows.iter().map(|(stamp, ..)| *stamp).collect()))
            .with("qty", Column::Whole(rows.iter().map(|(_, _, piece, _)| piece.quantity as i64).collect()))
            .with("price", Column::Real(rows.iter().map(|(_, _, piece, _)| unit(piece.price)).collect()))
            .with("fee", Column::Real(rows.iter().map(|(.., fee)| *fee).collect()))
            .with("liquidity", Column::Text(rows.iter().map(|(_, number, ..)| liquidity(*number).to_owned()).collect()))
    }

    fn quotes(&self, scene: &Scene<'_>, outcome: &Outcome) -> Table {
        let shown = &outcome.shown;
        let mut table = Table::default().with("ts", Column::Time(shown.iter().map(|s| self.stamp(s.time)).collect()));
        for level in 0..scene.levels.min(LEVELS) {
            let number = if level == 0 { String::new() } else { (level + 1).to_string() };
            for (name, asks) in [("bid", false), ("ask", true)] {
                let price = |shown: &Shown| {
                    let step = scene.tape.rows[shown.row].steps[level];
                    unit(if asks { shown.ask + step } else { shown.bid - step } as f64)
                };
                let size = |shown: &Shown| sizes(&scene.tape.rows[shown.row], asks, scene.usual)[level] as i64;
                table = table
                    .with(format!("{name}{number}"), Column::Real(shown.iter().map(price).collect()))
                    .with(format!("{name}{number}_size"), Column::Whole(shown.iter().map(size).collect()));
            }
        }
        table
    }

    /// A row an order, of which no more is known than the mid.
    fn mids(&self, orders: &[Intent], outcome: &Outcome) -> Table {
        let mids = || outcome.executions.iter().map(|met| unit(met.decided.mid())).collect();
        Table::default()
            .with("ts", Column::Time(orders.iter().map(|order| self.stamp(order.time)).collect()))
            .with("bid", Column::Real(mids()))
            .with("ask", Column::Real(mids()))
    }

    fn trades(&self, prints: &[Print]) -> Table {
        let side = |print: &Print| if print.bought { "buy" } else { "sell" }.to_owned();
        Table::default()
            .with("ts", Column::Time(prints.iter().map(|print| self.stamp(print.time)).collect()))
            .with("price", Column::Real(prints.iter().map(|print| unit(print.price)).collect()))
            .with("size", Column::Whole(prints.iter().map(|print| print.size as i64).collect()))
            .with("aggressor", Column::Text(prints.iter().map(side).collect()))
    }
}

/// Ticks, of a hundredth each, as a price to the sixth digit [currency].
fn unit(ticks: f64) -> f64 {
    (ticks * 1e4).round() / 1e6
}
