//! A parent order: what an execution strategy works in parts.

use crate::market::{Increments, Orders, Quantity, Side, View};
use crate::sim2real::Timestamp;

use super::{Kind, StrategyError};

/// An order too large to be sent at once: of one instrument, or of each of the run.
///
/// What is done of it is what is held or on its way more than when the instrument was first seen, so that what was
/// cancelled or cut on its way is asked for again, and nothing twice. It is worked in whole lots; what is left below one is
/// not traded.
#[derive(Debug, Clone, PartialEq)]
pub struct ParentOrder {
    symbol: Option<String>,
    side: Side,
    quantity: Quantity,
    start: Timestamp,
    end: Timestamp,
    /// What was held of each instrument when it was first seen.
    held: Vec<Option<Quantity>>,
}

impl ParentOrder {
    /// `quantity` [units] of the instrument called `symbol`, or of each of the run where none is named, from a start to an
    /// end.
    ///
    /// # Errors
    /// If `side` is neither buy nor sell, the quantity is not above 0, or the end is not after the start.
    pub(super) fn new(
        kind: &Kind,
        symbol: Option<&str>,
        side: &str,
        quantity: f64,
        [start, end]: [Timestamp; 2],
    ) -> Result<Self, StrategyError> {
        let value = |parameter, value: String, hint| StrategyError::Value { kind: kind.name, parameter, value, hint };
        let side = Side::of_word(side).ok_or_else(|| value("side", format!("{side:?}"), "write \"buy\" or \"sell\""))?;
        let units = Quantity::nearest(quantity).ok().filter(|units| *units > Quantity::ZERO);
        let hint = "it is a number of units above 0 and below 9.2e9";
        let quantity = units.ok_or_else(|| value("quantity", quantity.to_string(), hint))?;
        if end <= start {
            return Err(value("end", end.to_string(), "it must be after `start`"));
        }
        Ok(Self { symbol: symbol.map(str::to_owned), side, quantity, start, end, held: Vec::new() })
    }

    /// When it may be worked from.
    pub(super) fn start(&self) -> Timestamp {
        self.start
    }

    /// When it is to be done.
    pub(super) fn end(&self) -> Timestamp {
        self.end
    }

    /// Whether it is one of the event's instrument. To be asked at every event: it remembers what was held at the first.
    pub(super) fn concerns(&mut self, view: &View<'_>) -> bool {
        let (instrument, instruments) = (view.event().instrument, view.instruments());
        if self.held.len() < instruments.len() {
            self.held.resize(instruments.len(), None);
        }
        let held = view.position(instrument) + view.working(instrument);
        self.held[instrument].get_or_insert(held);
        self.symbol.as_ref().is_none_or(|symbol| instruments[instrument].symbol == *symbol)
    }

    /// Asks for what is missing of `share` of the event's instrument, a part from 0 to 1 taken to the nearest lot; for
    /// `most` at most, where given.
    pub(super) fn send(&self, view: &View<'_>, orders: &mut Orders, share: f64, most: Option<Quantity>) {
        let instrument = view.event().instrument;
        // Without a price the order would be refused.
        let Some(steps) = view.instruments().get(instrument).and_then(|i| Increments::of(i).ok()) else { return };
        if view.price(instrument).is_none() {
            return;
        }
        let held = self.held.get(instrument).copied().flatten().unwrap_or_default();
        let more = view.position(instrument) + view.working(instrument) - held;
        let missing = due(self.quantity, share, steps) - more.signed(self.side);
        let quantity = most.map_or(missing, |most| missing.min(steps.whole_lots(most)));
        if quantity > Quantity::ZERO {
            orders.market(instrument, self.side, quantity);
        }
    }

    /// The part of it that `units` are [fraction].
    pub(super) fn share_of(&self, units: f64) -> f64 {
        units / self.quantity.to_f64()
    }
}

/// `share` of a quantity, to the nearest lot, and never more than the whole lots in it.
fn due(quantity: Quantity, share: f64, steps: Increments) -> Quantity {
    let whole = steps.whole_lots(quantity);
    if share >= 1.0 {
        return whole;
    }
    let part = Quantity((quantity.0 as f64 * share.max(0.0)).round() as i64);
    steps.whole_lots(part + Quantity(steps.lot().0 / 2)).min(whole)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::market::Instrument;
    use proptest::prelude::*;

    fn lots_of(lot_size: f64) -> Increments {
        let (average_daily_volume, daily_volatility) = (None, None);
        let symbol = String::from("A");
        Increments::of(&Instrument { symbol, tick_size: 0.01, lot_size, average_daily_volume, daily_volatility }).unwrap()
    }

    fn units(x: f64) -> Quantity {
        Quantity::nearest(x).unwrap()
    }

    #[test]
    fn a_share_is_taken_to_the_nearest_lot_within_the_whole() {
        let due = |quantity: f64, share: f64, lot: f64| due(units(quantity), share, lots_of(lot)).to_f64();
        assert_eq!([0.0, 0.3, 0.3333, 0.5, 1.0].map(|share| due(1_000.0, share, 1.0)), [0.0, 300.0, 333.0, 500.0, 1_000.0]);
        assert_eq!([0.25, 0.26, 0.99, 1.0].map(|share| due(250.0, share, 100.0)), [100.0, 100.0, 200.0, 200.0]);
        assert_eq!([0.1, 1.0].map(|share| due(50.0, share, 100.0)), [0.0, 0.0]);
    }

    proptest! {
        #[test]
        fn a_share_never_exceeds_the_parent(
            quantity in prop_oneof![1_i64..3_000_000_000, 1_i64..i64::MAX],
            share in 0.0..2.0_f64,
            lot in 1_i64..1_000_000_000,
        ) {
            let steps = lots_of(lot as f64 * 1e-9);
            let found = due(Quantity(quantity), share, steps);
            prop_assert!(found >= Quantity::ZERO && found.0 <= quantity && steps.holds(found));
        }
    }
}
