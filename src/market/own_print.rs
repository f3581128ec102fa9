//! Finding an order's own trades on the tape.
//!
//! Once an order has traded, quotes and trades show its own impact. A simulation that reads them at its assumed arrival
//! would find that impact there and take it for latency; so what the order met is read no later than its own print.

use crate::sim2real::Timestamp;

use super::{Print, Side};

/// One fill, as far as prints show it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Piece {
    /// Quantity [units].
    pub quantity: f64,
    /// Price [currency].
    pub price: f64,
}

/// By how much a stamp may have been rounded up [ns]: the step of a 64-bit float at today's count of nanoseconds.
const ROUNDING: i64 = 256;

/// The stamp of an order's own first print: the one run of neighbouring `prints` that shows its fills in their order,
/// after its decision and no later than its `first_fill` was reported. None where there is no such run, or several.
#[must_use]
pub fn own_print(
    prints: &[Print],
    side: Side,
    decided_at: Timestamp,
    first_fill: Timestamp,
    fills: &[Piece],
) -> Option<Timestamp> {
    let from = prints.partition_point(|print| print.time <= decided_at);
    let to = from + prints[from..].partition_point(|print| print.time <= first_fill + ROUNDING);
    let mut runs = (from..to).filter(|start| shows(&prints[*start..], side, fills));
    let found = runs.next()?;
    match runs.next() {
        None => Some(prints[found].time),
        Some(_) => None,
    }
}

/// Whether `prints` begin with the fills: each fill may be the sum of neighbouring prints at its price, for a tape shows a
/// print for every resting order that was met, and many brokers one fill for each price.
pub(super) fn shows(prints: &[Print], side: Side, fills: &[Piece]) -> bool {
    let close = |a: f64, b: f64| (a - b).abs() <= 1e-9 * b.abs();
    let mut prints = prints.iter();
    let mut shown = |fill: &Piece| {
        let mut left = fill.quantity;
        while left > 1e-9 * fill.quantity {
            let Some(print) = prints.next() else { return false };
            let own = print.aggressor.is_none_or(|aggressor| aggressor == side) && close(print.price, fill.price);
            if !own || print.size <= 0.0 {
                return false;
            }
            left -= print.size;
        }
        left.abs() <= 1e-9 * fill.quantity
    };
    !fills.is_empty() && fills.iter().all(&mut shown)
}

/// With fewer orders stamps show nothing.
const ENOUGH: usize = 25;

/// How long orders take from their decisions to their own prints, as the stamps of many show it.
///
/// An order that met the market later than a simulation assumes is read at its own print, so that no delay beyond the longest is
/// refuted by any order: a fit finds one that is too long, where the stamps themselves tell which is the usual one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShownDelay {
    /// Median [s].
    pub median: f64,
    /// Distance between the quartiles [s].
    pub between_quartiles: f64,
    /// Number of orders.
    pub orders: usize,
}

impl ShownDelay {
    /// What `delays` [s] show; none of fewer than 25 orders.
    #[must_use]
    pub fn of(mut delays: Vec<f64>) -> Option<Self> {
        if delays.len() < ENOUGH {
            return None;
        }
        delays.sort_by(f64::total_cmp);
        let quantile = |part: f64| delays[((delays.len() - 1) as f64 * part).round() as usize];
        let between_quartiles = quantile(0.75) - quantile(0.25);
        Some(Self { median: quantile(0.5), between_quartiles, orders: delays.len() })
    }

    /// The delay [s], where it is the same for all: where the distance between the quartiles is less than a tenth of it.
    #[must_use]
    pub fn constant(self) -> Option<f64> {
        (self.between_quartiles < 0.1 * self.median).then_some(self.median)
    }

    /// The median and its standard deviation [s], that of a normal distribution of the same quartiles.
    #[must_use]
    pub fn estimate(self) -> [f64; 2] {
        let scatter = self.between_quartiles / 1.349;
        [self.median, (0.5 * std::f64::consts::PI / self.orders as f64).sqrt() * scatter]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn print(time: i64, price: f64, size: f64, aggressor: Option<Side>) -> Print {
        Print { time: Timestamp(time), price, size, aggressor }
    }

    fn piece(quantity: f64, price: f64) -> Piece {
        Piece { quantity, price }
    }

    fn find(prints: &[Print], fills: &[Piece]) -> Option<i64> {
        own_print(prints, Side::Buy, Timestamp(1_000), Timestamp(5_000), fills).map(|t| t.0)
    }

    #[test]
    fn the_one_run_that_shows_all_fills_is_the_orders_own() {
        let buy = Some(Side::Buy);
        let prints = [
            print(1_000, 10.0, 5.0, buy),
            print(2_000, 10.0, 5.0, buy),
            print(3_000, 10.0, 5.0, Some(Side::Sell)),
            print(3_000, 10.0, 5.0, buy),
            print(3_000, 10.1, 7.0, buy),
            print(6_000, 10.0, 5.0, buy),
        ];
        assert_eq!(find(&prints, &[piece(5.0, 10.0), piece(7.0, 10.1)]), Some(3_000));
        assert_eq!(find(&prints, &[piece(5.0, 10.0)]), None, "two runs would fit");
        assert_eq!(find(&prints[..2], &[piece(5.0, 10.0)]), Some(2_000), "a print of the decision's stamp is not its own");
        assert_eq!(find(&prints[5..], &[piece(5.0, 10.0)]), None, "it comes after the fill was reported");
        assert_eq!(find(&prints, &[piece(5.0, 10.0), piece(7.0, 10.2)]), None);
        assert_eq!(find(&prints, &[]), None);
    }

    #[test]
    fn a_fill_may_be_the_sum_of_prints() {
        let sell = Some(Side::Sell);
        let buy = Some(Side::Buy);
        let prints = [
            print(2_000, 10.0, 3.0, sell),
            print(3_000, 10.0, 2.0, buy),
            print(3_000, 10.0, 3.0, buy),
            print(3_000, 10.1, 7.0, buy),
        ];
        assert_eq!(find(&prints, &[piece(5.0, 10.0), piece(7.0, 10.1)]), Some(3_000));
        assert_eq!(find(&prints, &[piece(4.0, 10.0)]), None, "no prints add up to it");
    }

    #[test]
    fn a_stamp_rounded_up_and_a_print_of_unknown_side_are_understood() {
        assert_eq!(find(&[print(5_256, 10.0, 5.0, None)], &[piece(5.0, 10.0)]), Some(5_256));
        assert_eq!(find(&[print(5_257, 10.0, 5.0, None)], &[piece(5.0, 10.0)]), None);
    }

    #[test]
    fn a_delay_is_shown_by_many_orders_that_agree() {
        assert_eq!(ShownDelay::of(vec![0.25; 24]), None);
        let same = ShownDelay::of(vec![0.25; 25]).unwrap();
        assert_eq!((same.constant(), same.estimate()), (Some(0.25), [0.25, 0.0]));
        let drawn = ShownDelay::of((1..=101).map(f64::from).collect()).unwrap();
        assert_eq!(drawn.constant(), None);
        // Of uniform draws over 100 the median's is 100 / (2 sqrt(n)) = 5.0; quartiles taken for a normal distribution's say 4.6.
        let [median, std] = drawn.estimate();
        assert!((median - 51.0).abs() < 1e-12 && (4.0..5.5).contains(&std), "{median} +- {std}");
    }
}
