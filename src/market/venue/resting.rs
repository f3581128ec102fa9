//! Orders at the venue: those that wait for a price, and what becomes of them.

use crate::market::account::Ratio;
use crate::market::{
    Condition, InFlight, Increments, Link, OrderId, OrderKind, Price, Quantity, Reason, Role, Side, Ticket, TimeInForce,
};
use crate::sim2real::Timestamp;

use super::queue::Place;

/// An order at the venue.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::market) struct Resting {
    pub id: OrderId,
    pub side: Side,
    /// What it has become: a stop that was set off is a market order.
    pub kind: OrderKind,
    pub time_in_force: TimeInForce,
    pub condition: Condition,
    pub link: Link,
    /// How much of it is left.
    pub left: Quantity,
    /// How much of it may trade: less than is left for a child whose parent has filled in part.
    pub released: Quantity,
    /// How much of it was filled.
    pub filled: Quantity,
    /// The order as command laws have shaped it.
    pub order: InFlight,
    /// It takes part in bars that open from then on: those of its arrival, and later ones where a bar's volume is used up.
    pub from: Timestamp,
    /// The best price since it arrived, which a trailing stop follows.
    pub extreme: Option<Price>,
    pub place: Place,
    /// It has been offered to the market once: what then is left of it takes no more.
    pub met: bool,
}

impl Resting {
    /// An order as it is sent; of a child nothing may trade yet.
    pub fn new(id: OrderId, ticket: &Ticket, order: InFlight, left: Quantity) -> Self {
        let Ticket { side, kind, time_in_force, condition, link, .. } = *ticket;
        let released = if matches!(link, Link::ChildOf { .. }) { Quantity::ZERO } else { left };
        let (extreme, place, met) = Default::default();
        let (filled, from) = (Quantity::ZERO, order.arrives_at);
        Self { id, side, kind, time_in_force, condition, link, left, released, filled, order, from, extreme, place, met }
    }

    /// How much of it may trade now.
    pub fn tradable(&self) -> Quantity {
        self.left.min(self.released)
    }

    pub fn limit(&self) -> Option<Price> {
        self.kind.limit()
    }

    /// The price that sets it off, where it waits for one.
    pub fn trigger(&self) -> Option<Price> {
        match self.kind {
            OrderKind::TrailingStop { distance } => self.extreme.map(|extreme| match self.side {
                Side::Sell => Price(extreme.0.saturating_sub(distance.0)),
                Side::Buy => Price(extreme.0.saturating_add(distance.0)),
            }),
            kind => kind.trigger(),
        }
    }

    /// The same, arriving at another time.
    pub fn arriving(self, at: Timestamp) -> Self {
        Self { order: self.order.arriving(at), from: at, ..self }
    }

    /// Whether part of it still waits for its parent to fill.
    pub fn waits_for_parent(&self) -> bool {
        self.released < self.left
    }

    /// Why it ends where it took all it could: the market had no more, or there was no more to close.
    pub fn exhausted(&self) -> Reason {
        if self.condition == Condition::ReduceOnly { Reason::ReduceOnly } else { Reason::NoVolume }
    }

    /// Whether it waits to be set off.
    pub fn waits(&self) -> bool {
        matches!(self.kind, OrderKind::Stop { .. } | OrderKind::StopLimit { .. } | OrderKind::TrailingStop { .. })
    }

    /// Whether a price of `price` sets it off.
    pub fn set_off_by(&self, price: Price) -> bool {
        self.trigger().is_some_and(|trigger| match self.side {
            Side::Buy => price >= trigger,
            Side::Sell => price <= trigger,
        })
    }

    /// It was set off: what it is from now on.
    pub fn set_off(&mut self) {
        self.kind = match self.kind {
            OrderKind::Stop { .. } | OrderKind::TrailingStop { .. } => OrderKind::Market,
            OrderKind::StopLimit { price, .. } => OrderKind::Limit { price },
            other => other,
        };
    }

    /// A trailing stop follows the market to `price`, if that is further than it was.
    pub fn follow(&mut self, price: Price) {
        if matches!(self.kind, OrderKind::TrailingStop { .. }) {
            self.extreme = Some(match (self.extreme, self.side) {
                (None, _) => price,
                (Some(best), Side::Sell) => best.max(price),
                (Some(best), Side::Buy) => best.min(price),
            });
        }
    }

    /// It is told in the units of after a split; false, and nothing changed, where a price then is on no tick or what is left
    /// no whole number of lots.
    pub fn split(&mut self, ratio: Ratio, increments: Increments) -> bool {
        let Some(kind) = self.kind.split(ratio, increments) else { return false };
        let Some(left) = ratio.whole_lots(self.left, increments) else { return false };
        // Of an entry that has filled in part, its exits may do with what is whole of that part.
        let released = increments.whole_lots(ratio.quantity(self.released)).min(left);
        self.kind = kind;
        (self.left, self.released, self.filled) = (left, released, ratio.quantity(self.filled));
        self.extreme = self.extreme.map(|price| ratio.price(price));
        self.place.split(ratio.to_f64());
        let order = &mut self.order;
        let units = ratio.to_f64();
        (order.quantity, order.assumed, order.mid) = (order.quantity * units, order.assumed / units, order.mid / units);
        order.average_daily_volume = order.average_daily_volume.map(|volume| volume * units);
        true
    }
}

/// What became of an order at the venue.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::market) struct Outcome {
    pub id: OrderId,
    pub instrument: usize,
    pub at: Timestamp,
    pub what: What,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::market) enum What {
    /// Some of it was filled.
    Filled(Filled),
    /// The rest of it works no longer.
    Ended(Reason),
    /// It was set off.
    SetOff,
    /// It was changed as asked.
    Replaced { quantity: Quantity, kind: OrderKind },
}

/// A fill as the venue knows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::market) struct Filled {
    pub role: Role,
    pub quantity: Quantity,
    pub price: Price,
    /// Price before it was moved to a tick [currency].
    pub model_price: f64,
    /// Mid or open it was filled against [currency].
    pub mid: f64,
    /// Fee [currency].
    pub fee: f64,
    /// What stood ahead of it when it joined the queue [units]; 0 where it took.
    pub queued_behind: f64,
    /// Row of the data that brought it about, counted among rows of their kind.
    pub row: usize,
    /// Lowest and highest price the data show for the time of the fill, moved as own orders have moved the market.
    pub band: [Price; 2],
    /// By how much they have.
    pub displaced: Price,
}
