//! Working an order: a parent order is to be traded by a deadline, at as little cost as can be.

use crate::market::{Blotter, Orders, Price, Quantity, Side, Ticket, View};
use crate::rl::{BoxSpace, Episode, StreamName};

use super::portfolio::session_left;
use super::task::{Outcome, Task, within};

/// Furthest a limit may be from the best price of its own side [ticks].
const FURTHEST: f64 = 10.0;
/// Largest drift that is observed [bps].
const LARGEST_DRIFT: f64 = 1_000.0;

/// Which way parent orders go.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ways {
    /// All buy.
    Buy,
    /// All sell.
    Sell,
    /// As the episode's stream `side` has it, as often one as the other.
    Both,
}

/// The task of `Execute-v0`. The action is the part of the rest that is to be in the market now, and how many ticks behind the best
/// price of its own side its limit stands; at -10 it is a market order. Of data that show no quotes the last price stands for
/// both sides. What is not done when the last action was taken is closed at the market.
///
/// The reward is the implementation shortfall of what was filled, as a loss below 0: its price over the price at arrival, and
/// its fees, in bps of the parent order's worth at arrival. All rewards of an episode add up to the shortfall of the parent order;
/// what the data end before counts at the last price.
///
/// Source: Perold, "The implementation shortfall: paper versus reality", Journal of Portfolio Management 14 (1988).
#[derive(Debug, Clone, PartialEq)]
pub struct Execute {
    quantity: f64,
    ways: Ways,
    side: Side,
    parent: Quantity,
    /// Held when the episode began.
    held: Quantity,
    arrival: f64,
    /// Fills booked so far.
    fills: usize,
    closing: bool,
    /// How far its limit stands behind the best [ticks].
    offset: f64,
}

impl Execute {
    /// Parent orders of `quantity` [units].
    #[must_use]
    pub fn new(quantity: f64, ways: Ways) -> Self {
        let (side, parent, held) = (Side::Buy, Quantity::ZERO, Quantity::ZERO);
        Self { quantity, ways, side, parent, held, arrival: 0.0, fills: 0, closing: false, offset: 0.0 }
    }

    /// What is left to trade.
    fn rest(&self, view: &View<'_>) -> Quantity {
        (self.parent - (view.position(0) - self.held).signed(self.side)).max(Quantity::ZERO)
    }

    /// The limit at the offset that was asked for; none for a market order.
    fn limit(&self, view: &View<'_>) -> Option<Price> {
        if self.offset <= -FURTHEST {
            return None;
        }
        let best = view.best(0, self.side).or_else(|| view.price(0))?;
        let behind = view.tick(0).to_f64() * self.offset.round();
        view.restable(0, self.side, best.to_f64() - self.side.sign() * behind)
    }

    /// Takes orders to `wanted` in all, at `limit`; what is on its way with what was filled never comes to more than the parent.
    fn work(&self, view: &View<'_>, orders: &mut Orders, wanted: Quantity, limit: Option<Price>) {
        let working = view.working(0).signed(self.side).max(Quantity::ZERO);
        let (rest, mut left) = (self.rest(view), working);
        for order in view.orders(0).iter().rev() {
            if left > wanted || (limit.is_none() && order.kind.limit().is_some()) {
                orders.cancel(order.id);
                left = left - order.left;
            } else if let (Some(own), Some(limit)) = (order.kind.limit(), limit)
                && own != limit
            {
                orders.replace(order.id, None, Some(limit));
            }
        }
        let more = view.whole_lots(0, (wanted - left).min(rest - working));
        if more > Quantity::ZERO {
            orders.submit(match limit {
                Some(limit) => Ticket::limit(0, self.side, more, limit),
                None => Ticket::market(0, self.side, more),
            });
        }
    }

    /// What fills that were booked since the last time cost [bps of the parent's worth at arrival].
    fn shortfall(&mut self, blotter: &Blotter) -> f64 {
        let new = blotter.fills.get(self.fills..).unwrap_or_default();
        self.fills = blotter.fills.len();
        let cost = |fill: &crate::market::Fill| {
            let worse = self.side.sign() * (fill.price.to_f64() - self.arrival);
            worse * fill.quantity.to_f64() + fill.fee.to_f64()
        };
        new.iter().map(cost).sum::<f64>() * self.bps()
    }

    /// What 1 of the currency is [bps of the parent's worth at arrival].
    fn bps(&self) -> f64 {
        let worth = self.arrival * self.parent.to_f64();
        if worth > 0.0 { 1e4 / worth } else { 0.0 }
    }
}

const SIDE: StreamName = StreamName::new("side");

impl Task for Execute {
    fn begin(&mut self, episode: Episode, view: &View<'_>) {
        self.side = match self.ways {
            Ways::Buy => Side::Buy,
            Ways::Sell => Side::Sell,
            Ways::Both if episode.stream(SIDE).uniform() < 0.5 => Side::Buy,
            Ways::Both => Side::Sell,
        };
        self.parent = Quantity::nearest(self.quantity).map_or(Quantity::ZERO, |quantity| view.whole_lots(0, quantity));
        self.held = view.position(0);
        self.arrival = view.price(0).map_or(0.0, Price::to_f64);
        (self.fills, self.closing, self.offset) = (0, false, 0.0);
    }

    fn components(&self) -> Vec<(String, &'static str, f32, f32)> {
        let drift = LARGEST_DRIFT as f32;
        [
            ("side", "", -1.0, 1.0),
            ("rest", "share", 0.0, 1.0),
            ("working", "share", 0.0, 1.0),
            ("drift", "bps", -drift, drift),
            ("session_left", "", 0.0, 1.0),
        ]
        .map(|(name, unit, low, high)| (name.to_owned(), unit, low, high))
        .into()
    }

    fn actions(&self) -> BoxSpace {
        let furthest = FURTHEST as f32;
        BoxSpace::of(&[("share", "", 0.0, 1.0), ("offset", "ticks", -furthest, furthest)])
    }

    fn watch(&mut self, view: &View<'_>, orders: &mut Orders) {
        if !self.closing {
            return;
        }
        let rest = self.rest(view);
        self.closing = rest > Quantity::ZERO;
        self.work(view, orders, rest, None);
    }

    fn goes_on_alone(&self) -> bool {
        self.closing
    }

    fn act(&mut self, view: &View<'_>, orders: &mut Orders, action: &[f32], last: bool) {
        let [share, offset] = action else { return };
        let rest = self.rest(view);
        // Rounded up: of a single lot that is left any part is the whole.
        let part = (f64::from(*share) * rest.to_f64()).min(rest.to_f64());
        let lot = view.whole_lots(0, Quantity::nearest(part).unwrap_or(rest));
        let wanted = if lot.to_f64() < part { view.next_lot(0, lot).min(rest) } else { lot };
        self.offset = f64::from(*offset);
        let limit = self.limit(view);
        self.work(view, orders, wanted, limit);
        if last {
            // From the next event on, what is left is closed.
            self.closing = true;
        }
    }

    fn observe(&self, view: &View<'_>, into: &mut [f32]) {
        let [side, rest, working, drift, session] = into else { return };
        let share = |quantity: Quantity| {
            if self.parent > Quantity::ZERO { within(quantity.to_f64() / self.parent.to_f64(), 0.0, 1.0) } else { 0.0 }
        };
        *side = self.side.sign() as f32;
        *rest = share(self.rest(view));
        *working = share(view.working(0).signed(self.side));
        let now = view.price(0).map_or(self.arrival, Price::to_f64);
        let moved = if self.arrival > 0.0 { 1e4 * self.side.sign() * (now / self.arrival - 1.0) } else { 0.0 };
        *drift = within(moved, -LARGEST_DRIFT, LARGEST_DRIFT);
        *session = session_left(view, 0);
    }

    fn settle(&mut self, view: &View<'_>, blotter: &Blotter) -> Outcome {
        Outcome { reward: -self.shortfall(blotter), done: self.rest(view) <= Quantity::ZERO }
    }

    fn cut_off(&mut self, view: &View<'_>, blotter: &Blotter) -> Outcome {
        let filled = self.shortfall(blotter);
        let now = view.price(0).map_or(self.arrival, Price::to_f64);
        let missed = self.side.sign() * (now - self.arrival) * self.rest(view).to_f64() * self.bps();
        Outcome { reward: -(filled + missed), done: self.rest(view) <= Quantity::ZERO }
    }

    fn tells(&self) -> Vec<(&'static str, &'static str)> {
        vec![("arrival_price", "currency"), ("parent", "units")]
    }

    fn told(&self, channel: usize) -> f64 {
        if channel == 0 { self.arrival } else { self.parent.to_f64() }
    }
}
