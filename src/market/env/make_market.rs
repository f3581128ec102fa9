//! Making a market: an order rests on each side, and what is held is paid for.

use crate::market::{Blotter, Cash, Condition, Orders, Price, Quantity, Side, Ticket, View};
use crate::rl::{BoxSpace, Episode};

use super::portfolio::session_left;
use super::task::{Outcome, Task, within};

/// Furthest a quote may stand ahead of the best price of its side, and behind it [ticks].
const AHEAD: f64 = 5.0;
const BEHIND: f64 = 20.0;

/// The task of `MakeMarket-v0`. The action is how many ticks behind the best bid the own bid stands (below 0: ahead of it, and never
/// so far that it takes), the same of the ask, and the size of new quotes as a part of the largest. A side that could take what
/// is held beyond the largest inventory is not quoted.
///
/// The reward is the change of equity, less the inventory penalty times the square of what is held over the largest inventory; both
/// in what one tick is worth on the largest quote.
#[derive(Debug, Clone, PartialEq)]
pub struct MakeMarket {
    /// Largest quote [units].
    pub quote: f64,
    /// Largest inventory [units], either way.
    pub inventory: f64,
    /// What the largest inventory costs a step [ticks on the largest quote].
    pub penalty: f64,
    equity: f64,
}

impl MakeMarket {
    /// Quotes of at most `quote` [units], of which at most `inventory` [units] is held.
    #[must_use]
    pub fn new(quote: f64, inventory: f64, penalty: f64) -> Self {
        Self { quote, inventory, penalty, equity: 0.0 }
    }

    /// The price of a quote so many ticks behind the best; none where there is no such price.
    fn price(view: &View<'_>, side: Side, behind: f64) -> Option<Price> {
        let best = view.best(0, side).or_else(|| view.price(0))?;
        let tick = view.tick(0);
        let wanted = view.restable(0, side, best.to_f64() - side.sign() * behind.round() * tick.to_f64())?;
        let Some(other) = view.best(0, side.opposite()) else { return Some(wanted) };
        // A tick before the other side at the most, so that it rests.
        Some(match side {
            Side::Buy => wanted.min(other.minus(tick)),
            Side::Sell => wanted.max(other.plus(tick)),
        })
        .filter(|price| price.0 > 0)
    }

    fn quote(&self, view: &View<'_>, orders: &mut Orders, side: Side, behind: f64, size: f64) {
        let open = view.orders(0).iter().filter(|order| order.side == side);
        let room = self.inventory - side.sign() * view.position(0).to_f64();
        let most = (size * self.quote).min(room).max(0.0);
        let wanted = Quantity::nearest(most).map_or(Quantity::ZERO, |quantity| view.whole_lots(0, quantity));
        let price = Self::price(view, side, behind).filter(|_| wanted > Quantity::ZERO);
        let mut working = Quantity::ZERO;
        for order in open {
            match (price, order.kind.limit()) {
                (Some(price), Some(own)) if order.left.to_f64() <= room => {
                    if own != price {
                        orders.replace(order.id, None, Some(price));
                    }
                }
                _ => orders.cancel(order.id),
            }
            working = working + order.left;
        }
        // One quote a side: a new one once the old one is known to be gone.
        if let (Some(price), Quantity::ZERO) = (price, working) {
            orders.submit(Ticket::limit(0, side, wanted, price).on(Condition::PostOnly));
        }
    }

    /// What a tick is worth on the largest quote [currency].
    fn unit(&self, view: &View<'_>) -> f64 {
        let multiplier = view.terms(0).multiplier.get() as f64;
        (view.tick(0).to_f64() * self.quote * multiplier).max(f64::MIN_POSITIVE)
    }
}

impl Task for MakeMarket {
    fn begin(&mut self, _episode: Episode, view: &View<'_>) {
        self.equity = view.equity().to_f64();
    }

    fn components(&self) -> Vec<(String, &'static str, f32, f32)> {
        let (ahead, behind) = (AHEAD as f32, BEHIND as f32);
        // How far the market may have gone from a quote before its owner knows is without bound.
        let far = 10.0 * behind;
        [
            ("inventory", "share", -1.0, 1.0),
            ("unrealized", "ticks", -far, far),
            ("bid_behind", "ticks", -ahead.max(far), far),
            ("bid_size", "share", 0.0, 1.0),
            ("ask_behind", "ticks", -ahead.max(far), far),
            ("ask_size", "share", 0.0, 1.0),
            ("session_left", "", 0.0, 1.0),
        ]
        .map(|(name, unit, low, high)| (name.to_owned(), unit, low, high))
        .into()
    }

    fn actions(&self) -> BoxSpace {
        let (ahead, behind) = (AHEAD as f32, BEHIND as f32);
        BoxSpace::of(&[("bid", "ticks", -ahead, behind), ("ask", "ticks", -ahead, behind), ("size", "share", 0.0, 1.0)])
    }

    fn act(&mut self, view: &View<'_>, orders: &mut Orders, action: &[f32], _last: bool) {
        let [bid, ask, size] = action else { return };
        self.quote(view, orders, Side::Buy, f64::from(*bid), f64::from(*size));
        self.quote(view, orders, Side::Sell, f64::from(*ask), f64::from(*size));
    }

    fn observe(&self, view: &View<'_>, into: &mut [f32]) {
        let [inventory, unrealized, rest @ ..] = into else { return };
        let held = view.position(0).to_f64();
        *inventory = within(held / self.inventory.max(f64::MIN_POSITIVE), -1.0, 1.0);
        let far = 10.0 * BEHIND;
        *unrealized = within(view.unrealized(0) / self.unit(view), -far, far);
        let (quotes, session) = rest.split_at_mut(4);
        let tick = view.tick(0).to_f64();
        for (own, side) in quotes.as_chunks_mut::<2>().0.iter_mut().zip([Side::Buy, Side::Sell]) {
            let order = view.orders(0).iter().find(|order| order.side == side);
            let best = view.best(0, side).or_else(|| view.price(0)).map(Price::to_f64);
            *own = match (order.and_then(|order| Some((order.left, order.kind.limit()?))), best) {
                (Some((left, limit)), Some(best)) => [
                    within(side.sign() * (best - limit.to_f64()) / tick, -far, far),
                    within(left.to_f64() / self.quote, 0.0, 1.0),
                ],
                _ => [0.0; 2],
            };
        }
        session.fill(session_left(view, 0));
    }

    fn settle(&mut self, view: &View<'_>, _blotter: &Blotter) -> Outcome {
        let equity = view.equity().to_f64();
        let held = view.position(0).to_f64() / self.inventory.max(f64::MIN_POSITIVE);
        let reward = (equity - self.equity) / self.unit(view) - self.penalty * held * held;
        self.equity = equity;
        Outcome { reward, done: view.equity() <= Cash::ZERO }
    }
}
