//! How far what a log tells of its orders scatters of itself.

use crate::market::Seen;
use crate::market::log_rows::Outcome;
use crate::market::price_scatter::{finer_than, least_scatter};
use crate::sim2real::Measured;

use super::OrderLog;

/// How long after a decision the mid is looked at, for orders that were late [s].
const LATER: [f64; 2] = [1.0, 10.0];

impl OrderLog {
    /// What costs scatter by of themselves [bps], whatever they depend on; none where prices are told in ticks, whose rounding is
    /// all there is to know, or where there are too few orders.
    #[must_use]
    pub fn cost_scatter(&self) -> Option<f64> {
        self.cost_scatter
    }

    /// Whether stamps were cut to a second: then what the market seems to have done just after a decision may have come before it.
    #[must_use]
    pub fn stamps_are_cut(&self) -> bool {
        self.cut
    }

    /// How many orders, and fills of orders that rested, tell of what mechanisms do.
    #[must_use]
    pub fn sent(&self) -> usize {
        self.orders.len() + self.made.len()
    }

    /// What the costs among `measured` scatter by.
    pub(super) fn scatter_of(&self, measured: &[Measured], executions: &[Outcome]) -> Option<f64> {
        let cost = measured.iter().find(|channel| channel.channel == "cost")?;
        let tick_size = self.market.instrument.tick_size;
        finer_than(tick_size, of_fills(executions)).then(|| least_scatter(&cost.samples, &self.columns()))?
    }

    /// What costs depend on where something is missing, order by order: sizes, spreads, volatility, and what the market did next.
    fn columns(&self) -> Vec<Vec<f64>> {
        let tape = &self.market.tape;
        let [mut quantity, mut of_displayed, mut spread, mut volatility] = [const { Vec::new() }; 4];
        let mut moves = LATER.map(|_| Vec::new());
        for (row, order) in self.orders.iter().enumerate() {
            let book = tape.book(self.seen_on_arrival(row));
            let displayed = book.as_ref().and_then(|book| Some(book.opposite(order.side).first()?.size));
            quantity.push(order.quantity);
            of_displayed.push(displayed.map_or(0.0, |size| order.quantity / size));
            spread.push(book.map_or(0.0, |book| book.half_spread()));
            volatility.push(order.recent_volatility.unwrap_or(0.0));
            for (moved, seconds) in moves.iter_mut().zip(LATER) {
                let later = tape.mid(Seen::at(order.decided_at.plus_seconds(seconds))).unwrap_or(order.mid);
                moved.push(order.side.sign() * (later - order.mid));
            }
        }
        let [soon, later] = moves;
        vec![quantity, of_displayed, spread, volatility, soon, later]
    }
}

/// At what prices orders were filled, fill by fill: the average of fills in ticks lies between ticks, and is known all the same to what
/// these are rounded to.
fn of_fills(executions: &[Outcome]) -> impl Iterator<Item = f64> {
    executions.iter().flat_map(|execution| &execution.pieces).map(|piece| piece.price)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::market::{InFlight, LoggedFill, Side};
    use crate::sim2real::Timestamp;

    #[test]
    fn an_order_filled_at_two_prices_in_ticks_is_told_no_finer() {
        let executed = |prices: [f64; 2]| {
            let order = InFlight::market(Side::Buy, 4.0, Timestamp(0), 10.0, 10.0);
            let fill = |quantity: f64, price: f64| LoggedFill {
                order_id: "1".to_owned(),
                filled_at: Timestamp(1),
                quantity,
                price,
                fee: 0.0,
            };
            let fills = [fill(1.0, prices[0]), fill(3.0, prices[1])];
            Outcome::of(&order, &fills.iter().collect::<Vec<_>>())
        };
        let in_ticks = [executed([10.01, 10.02])];
        assert!(finer_than(0.01, in_ticks[0].price.into_iter()), "their average is");
        assert!(!finer_than(0.01, of_fills(&in_ticks)));
        assert!(finer_than(0.01, of_fills(&[executed([10.013, 10.02])])));
    }
}
