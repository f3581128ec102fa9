//! The clock of a log beside that of its tape: own trades on the tape tell which stamps cannot be right.

use std::borrow::Cow;

use crate::sim2real::Timestamp;

use super::own_print::shows;
use super::{LoggedFill, LoggedOrder, OrderType, Piece, Print, Tape};

/// How far clocks may be apart [ns].
const REACH: i64 = 10 * Timestamp::NANOS;
/// With fewer orders on the tape nothing is told of clocks.
const ENOUGH: usize = 25;
/// Own trades are found where this part of the orders that traded is on the tape at one distance, to within so much [ns].
const FOUND: f64 = 0.5;
const WITHIN: i64 = Timestamp::NANOS / 4;
/// Stamps that are off by less are not touched [ns].
const TOLERATED: i64 = Timestamp::NANOS / 1_000;
/// The part of the orders that a moved clock has to make possible.
const MADE_POSSIBLE: f64 = 0.95;

/// A log as its tape's clock has it.
pub(super) struct Clocked<'a> {
    pub orders: Cow<'a, [LoggedOrder]>,
    pub fills: Cow<'a, [LoggedFill]>,
}

impl<'a> Clocked<'a> {
    /// `orders` and `fills`, which belong to them as `of_order` says; where their own trades are on the tape before they were
    /// decided, or after they were reported, all of it moved by the least that makes this possible. Stamps may be off by `rounding`
    /// [ns] either way.
    pub fn of(
        orders: &'a [LoggedOrder],
        fills: &'a [LoggedFill],
        of_order: &[Vec<&LoggedFill>],
        tape: &Tape,
        rounding: i64,
        notes: &mut Vec<String>,
    ) -> Self {
        let own = own_trades(orders, of_order, tape.prints());
        let Some(ahead) = behind(&own, rounding) else {
            return Self { orders: Cow::Borrowed(orders), fills: Cow::Borrowed(fills) };
        };
        notes.push(format!(
            "the clock of the log is {:.3} s {} that of the tape, as {} of its own trades show there: all its stamps are moved by that{}",
            (ahead as f64 * 1e-9).abs(),
            if ahead > 0 { "behind" } else { "ahead of" },
            own.len(),
            if ahead > 0 { "" } else { ", and delays of its orders cannot be told" },
        ));
        let moved = |at: Timestamp| Timestamp(at.0 + ahead);
        let orders = orders.iter().map(|order| LoggedOrder { decided_at: moved(order.decided_at), ..order.clone() });
        let fills = fills.iter().map(|fill| LoggedFill { filled_at: moved(fill.filled_at), ..fill.clone() });
        Self { orders: orders.collect(), fills: fills.collect() }
    }
}

/// An order's own trade on the tape.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct OwnTrade {
    /// From its decision to the trade [ns]: positive, if clocks agree.
    since_decision: i64,
    /// From the report to the trade [ns]: no more than 0, if clocks agree.
    since_report: i64,
}

/// Own trades of market orders, at the one distance from their reports at which most are found; none unless enough are.
fn own_trades(orders: &[LoggedOrder], fills: &[Vec<&LoggedFill>], prints: &[Print]) -> Vec<OwnTrade> {
    let (mut traded, mut alike) = (0, Vec::new());
    for (number, (order, fills)) in orders.iter().zip(fills).enumerate() {
        let Some(first) = fills.first().filter(|_| order.kind == OrderType::Market) else { continue };
        traded += 1;
        let pieces: Vec<Piece> = fills.iter().map(|f| Piece { quantity: f.quantity, price: f.price }).collect();
        let from = prints.partition_point(|print| print.time.0 < first.filled_at.0 - REACH);
        let to = prints.partition_point(|print| print.time.0 <= first.filled_at.0 + REACH);
        let found = (from..to.max(from)).filter(|start| shows(&prints[*start..], order.side, &pieces));
        alike.extend(found.map(|print| {
            let at = prints[print].time;
            (
                at - first.filled_at,
                number,
                OwnTrade { since_decision: at - order.decided_at, since_report: at - first.filled_at },
            )
        }));
    }
    alike.sort_unstable_by_key(|(distance, number, _)| (*distance, *number));
    let most = window(&alike.iter().map(|(distance, ..)| *distance).collect::<Vec<_>>());
    let mut own: Vec<(usize, OwnTrade)> = alike[most].iter().map(|(_, number, own)| (*number, *own)).collect();
    own.sort_unstable_by_key(|(number, _)| *number);
    own.dedup_by_key(|(number, _)| *number);
    let enough = own.len() >= ENOUGH && own.len() as f64 >= FOUND * traded as f64;
    if enough { own.into_iter().map(|(_, own)| own).collect() } else { Vec::new() }
}

/// The longest run of `sorted` distances within [`WITHIN`] of its first.
fn window(sorted: &[i64]) -> std::ops::Range<usize> {
    let (mut best, mut end) = (0..0, 0);
    for start in 0..sorted.len() {
        while end < sorted.len() && sorted[end] - sorted[start] <= WITHIN {
            end += 1;
        }
        if end - start > best.len() {
            best = start..end;
        }
    }
    best
}

/// By how much the stamps of a log, off by up to `rounding` [ns], have to be moved for its `own` trades to be possible [ns]; none
/// where they are. Stamps of whole seconds are moved by whole ones.
fn behind(own: &[OwnTrade], rounding: i64) -> Option<i64> {
    let quantile = |mut values: Vec<i64>, part: f64| {
        values.sort_unstable();
        values.get(((values.len() as f64 - 1.0).max(0.0) * part).round() as usize).copied()
    };
    let of = |value: &dyn Fn(&OwnTrade) -> i64, part: f64| quantile(own.iter().map(value).collect(), part);
    let report = |own: &OwnTrade| own.since_report;
    let decision = |own: &OwnTrade| own.since_decision;
    let tolerated = TOLERATED.max(rounding);
    let ahead = if of(&report, 0.5)? > tolerated {
        of(&report, MADE_POSSIBLE)? - rounding
    } else if of(&decision, 0.5)? < -tolerated {
        // A trade comes after the decision, not with it.
        of(&decision, 1.0 - MADE_POSSIBLE)? - 1 + rounding
    } else {
        return None;
    };
    let whole = (ahead as f64 / Timestamp::NANOS as f64).round() as i64 * Timestamp::NANOS;
    Some(if rounding > 0 { whole } else { ahead }).filter(|ahead| *ahead != 0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::market::{Quotes, Side};

    fn at(seconds: f64) -> Timestamp {
        Timestamp(1_000 * Timestamp::NANOS).plus_seconds(seconds)
    }

    /// A hundred orders of 100 units or so, decided every 7 s, on the tape after 300 ms and reported after 320, by a clock that is
    /// so much behind; and as many trades of others between them.
    fn log(behind: f64) -> (Vec<LoggedOrder>, Vec<LoggedFill>, Tape) {
        let (mut orders, mut fills, mut prints) = (Vec::new(), Vec::new(), Vec::new());
        for k in 0..100 {
            let (time, quantity) = (7.0 * f64::from(k), 100.0 + f64::from(k % 9));
            let side = if k % 3 == 0 { Side::Sell } else { Side::Buy };
            let price = 50.0 + 0.01 * f64::from(k % 4);
            orders.push(LoggedOrder {
                id: k.to_string(),
                side,
                quantity,
                decided_at: at(time - behind),
                kind: OrderType::Market,
                seen_mid: None,
            });
            let filled_at = at(time + 0.32 - behind);
            fills.push(LoggedFill { order_id: k.to_string(), filled_at, quantity, price, fee: 0.0 });
            prints.push(Print { time: at(time + 0.3), price, size: quantity, aggressor: Some(side) });
            prints.push(Print { time: at(time + 3.0), price, size: 100.0, aggressor: Some(side) });
        }
        (orders, fills, Tape::new(Quotes::with_depth(1), prints, Vec::new()))
    }

    fn moved(behind: f64) -> (f64, Vec<String>) {
        let (orders, fills, tape) = log(behind);
        let of_order: Vec<Vec<&LoggedFill>> = fills.iter().map(|fill| vec![fill]).collect();
        let mut notes = Vec::new();
        let clocked = Clocked::of(&orders, &fills, &of_order, &tape, 0, &mut notes);
        let by = clocked.orders[5].decided_at.seconds_since(orders[5].decided_at);
        assert_eq!(clocked.fills[5].filled_at.seconds_since(fills[5].filled_at), by);
        (by, notes)
    }

    #[test]
    fn stamps_that_can_be_right_are_left_alone() {
        for behind in [0.0, 0.015, -0.25] {
            assert_eq!(moved(behind), (0.0, Vec::new()), "{behind}");
        }
    }

    #[test]
    fn a_clock_is_moved_by_the_least_that_makes_own_trades_possible() {
        // Trades that come 1.25 s after their reports are then reported at once.
        let (by, notes) = moved(1.27);
        assert!((by - 1.25).abs() < 1e-9, "{by}");
        assert!(notes[0].contains("1.250 s behind that of the tape, as 100 of its own trades"), "{notes:?}");
        let (by, notes) = moved(-5.0);
        assert!((by + 4.7).abs() < 1e-6 && notes[0].contains("4.700 s ahead of"), "{by} {notes:?}");
    }

    #[test]
    fn few_trades_tell_nothing_of_clocks() {
        let (orders, fills, tape) = log(10.0);
        let of_order: Vec<Vec<&LoggedFill>> = fills.iter().map(|fill| vec![fill]).collect();
        assert_eq!(own_trades(&orders[..20], &of_order[..20], tape.prints()), []);
        assert_eq!(window(&[]), 0..0);
        assert_eq!(behind(&[], 0), None);
        let whole = |since_report| behind(&[OwnTrade { since_decision: 0, since_report }], Timestamp::NANOS / 2);
        assert_eq!([400_000_000, 2_600_000_000].map(whole), [None, Some(2 * Timestamp::NANOS)]);
    }
}
