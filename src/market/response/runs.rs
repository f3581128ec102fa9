//! Orders of one sign in a row.

use crate::market::Side;
use crate::sim2real::Timestamp;

use super::mids::Felt;

/// Orders of one sign in a row, none of the other between them.
///
/// It is no metaorder: nobody knows whose the orders are. Several traders may be in one run, and one trader's parent order in
/// many. What is found of runs says nothing of parent orders but that it does not contradict them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrderRun {
    /// All of it as the market felt it.
    pub felt: Felt,
    /// How many orders.
    pub orders: usize,
}

/// The runs of `orders`, which are in order of time. One ends, too, where the next order comes more than `pause` [s] later.
#[must_use]
pub fn runs(orders: &[Felt], pause: f64) -> Vec<OrderRun> {
    let mut found: Vec<OrderRun> = Vec::new();
    for order in orders {
        let goes_on =
            |run: &&mut OrderRun| run.felt.side == order.side && order.came_at.seconds_since(run.felt.done_at) <= pause;
        match found.last_mut().filter(goes_on) {
            Some(run) => {
                run.felt.done_at = Timestamp(run.felt.done_at.0.max(order.done_at.0));
                run.felt.volume += order.volume;
                run.orders += 1;
            }
            None => found.push(OrderRun { felt: *order, orders: 1 }),
        }
    }
    found
}

impl OrderRun {
    /// Which way it trades.
    #[must_use]
    pub fn side(&self) -> Side {
        self.felt.side
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_ends_with_the_other_sign_and_with_a_pause() {
        let order = |second: i64, side, volume| {
            let came_at = Timestamp(second * Timestamp::NANOS);
            Felt { came_at, done_at: came_at + 5, side, volume }
        };
        use Side::{Buy, Sell};
        let orders = [order(0, Buy, 1.0), order(1, Buy, 2.0), order(2, Sell, 4.0), order(3, Buy, 8.0), order(20, Buy, 16.0)];
        let found: Vec<(usize, f64)> = runs(&orders, 10.0).iter().map(|run| (run.orders, run.felt.volume)).collect();
        assert_eq!(found, [(2, 3.0), (1, 4.0), (1, 8.0), (1, 16.0)]);
        let first = runs(&orders, 10.0)[0].felt;
        assert_eq!(
            (first.came_at, first.done_at, runs(&orders, 10.0)[0].side()),
            (Timestamp(0), Timestamp(1_000_000_005), Buy)
        );
        assert!(runs(&[], 1.0).is_empty());
    }
}
