//! How far what a log tells of its orders scatters of itself.

use crate::market::Seen;
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

    /// What the costs among `measured` scatter by.
    pub(super) fn scatter_of(&self, measured: &[Measured]) -> Option<f64> {
        let cost = measured.iter().find(|channel| channel.channel == "cost")?;
        let tick_size = self.market.instrument.tick_size;
        finer_than(tick_size, self.paid.iter().flatten().copied()).then(|| least_scatter(&cost.samples, &self.columns()))?
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
