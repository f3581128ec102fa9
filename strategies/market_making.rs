//! `market_making`: quotes both sides about what one more unit is worth.

mod avellaneda_stoikov;

use serde::Deserialize;

use crate::market::{Condition, Event, EventKind, OrderId, Orders, Price, Quantity, Side, Strategy, Ticket, View};
use crate::sim2real::Timestamp;

use super::{Kind, StrategyError, read};

pub use avellaneda_stoikov::{AvellanedaStoikov, Parameters as Quoting, TwoSided};

/// Quotes `size` on both sides of every instrument at the prices of [`AvellanedaStoikov`], and moves a quote when the best price
/// has gone `step` ticks or more from it. Time runs from the first event in spans of `horizon`, at the end of each of which no
/// risk is left, and then anew.
///
/// Quotes are post-only: they never take. Where a side would add to a full inventory it is not quoted. Where the instrument has
/// a calendar, nothing is held over night: from `flat_before_close` on quotes are taken back, and what is held is sold or
/// bought back at the market.
#[derive(Debug, Clone)]
pub struct MarketMaking {
    parameters: Parameters,
    formula: AvellanedaStoikov,
    began: Option<Timestamp>,
    /// The bid and the ask of each instrument.
    own: Vec<[Option<OrderId>; 2]>,
}

pub(super) const KIND: Kind = Kind {
    name: "market_making",
    about: "quotes both sides about what one more unit is worth, as Avellaneda and Stoikov have it",
    example: include_str!("market_making.toml"),
    parameters: &["gamma", "kappa", "sigma", "max_inventory", "size", "horizon", "step", "flat_before_close"],
    instruments: 1,
    build: |parameters| Ok(Box::new(MarketMaking::new(read(&KIND, parameters)?)?)),
};

/// Parameters of [`MarketMaking`].
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// Aversion to risk [1/(currency unit)].
    pub gamma: f64,
    /// Decay of the rate of fills with the distance from the mid [1/currency].
    pub kappa: f64,
    /// Standard deviation of the mid after a second [currency/s^0.5].
    pub sigma: f64,
    /// Largest inventory on either side [units].
    pub max_inventory: f64,
    /// What is quoted on each side [units].
    pub size: f64,
    /// Length of the spans over which inventory is a risk [s].
    pub horizon: f64,
    /// How many ticks the best price may go from a quote before that is moved.
    #[serde(default = "one")]
    pub step: u32,
    /// How long before the close of a session nothing is quoted and nothing held [s]; none to hold over night, as without a
    /// calendar.
    pub flat_before_close: Option<f64>,
}

fn one() -> u32 {
    1
}

impl MarketMaking {
    /// A strategy with the given parameters.
    ///
    /// # Errors
    /// If a parameter is not a number above 0.
    pub fn new(parameters: Parameters) -> Result<Self, StrategyError> {
        let Parameters { gamma, kappa, sigma, max_inventory, size, horizon, step, flat_before_close } = parameters;
        let formula = AvellanedaStoikov::new(&KIND, Quoting { gamma, kappa, sigma, max_inventory })?;
        for (parameter, value, hint) in [
            ("size", size, "it is a number of units above 0"),
            ("horizon", horizon, "it is a time in seconds above 0, such as 3600"),
            ("step", f64::from(step), "it is a number of ticks, at least 1"),
            ("flat_before_close", flat_before_close.unwrap_or(1.0), "it is a time in seconds above 0, such as 300"),
        ] {
            if !(value.is_finite() && value > 0.0) {
                return Err(StrategyError::Value { kind: KIND.name, parameter, value: value.to_string(), hint });
            }
        }
        Ok(Self { parameters, formula, began: None, own: Vec::new() })
    }

    /// What is left of the span under way [s].
    fn left(&mut self, now: Timestamp) -> f64 {
        let began = *self.began.get_or_insert(now);
        let horizon = self.parameters.horizon;
        horizon - now.seconds_since(began).max(0.0) % horizon
    }

    /// Whether the session of an instrument closes so soon that it is to be flat.
    fn closes_soon(&self, view: &View<'_>, instrument: usize) -> bool {
        let session = self.parameters.flat_before_close.zip(view.session(instrument));
        session.is_some_and(|(seconds, session)| session.close.seconds_since(view.now()) <= seconds)
    }

    /// Takes quotes back, and closes what is held once none of them works.
    fn flatten(&self, view: &View<'_>, instrument: usize, orders: &mut Orders) {
        let quotes = || view.orders(instrument).iter().filter(|order| self.own[instrument].contains(&Some(order.id)));
        quotes().for_each(|order| orders.cancel(order.id));
        if quotes().next().is_none() {
            orders.to_position(view, instrument, Quantity::ZERO);
        }
    }

    /// Sees to the quote on one side, which is best at `price`; none for no quote.
    fn quote(&mut self, view: &View<'_>, instrument: usize, side: Side, price: Option<f64>, orders: &mut Orders) {
        let own = &mut self.own[instrument][usize::from(side == Side::Sell)];
        let working = own.and_then(|id| view.orders(instrument).iter().find(|order| order.id == id));
        let best = price.and_then(|price| view.restable(instrument, side, price));
        match (working, best) {
            (Some(order), None) => orders.cancel(order.id),
            (Some(order), Some(best)) => {
                let tick = view.tick(instrument).0.max(1);
                let gone = order.kind.limit().map_or(i64::MAX, |limit| (limit.0 - best.0).abs());
                if gone >= i64::from(self.parameters.step).saturating_mul(tick) {
                    // A post-only order that was moved into the market would take: it is sent anew.
                    orders.cancel(order.id);
                    *own = submit(view, instrument, side, self.parameters.size, best, orders);
                }
            }
            (None, Some(best)) => *own = submit(view, instrument, side, self.parameters.size, best, orders),
            (None, None) => {}
        }
    }
}

fn submit(view: &View<'_>, instrument: usize, side: Side, size: f64, best: Price, orders: &mut Orders) -> Option<OrderId> {
    let quantity = Quantity::nearest(size).ok().map(|quantity| view.whole_lots(instrument, quantity))?;
    let ticket = Ticket::limit(instrument, side, quantity, best).on(Condition::PostOnly);
    (quantity > Quantity::ZERO).then(|| orders.submit(ticket))
}

impl Strategy for MarketMaking {
    fn name(&self) -> &str {
        KIND.name
    }
    fn copied(&self) -> Option<Box<dyn Strategy>> {
        Some(Box::new(self.clone()))
    }

    fn lookback(&self) -> usize {
        1
    }

    fn on_event(&mut self, view: &View<'_>, orders: &mut Orders) {
        let Event { time, instrument, kind } = view.event();
        let Some(price) = view.price(instrument).filter(|_| kind != EventKind::Timer) else { return };
        self.own.resize(view.instruments().len(), [None; 2]);
        if self.closes_soon(view, instrument) {
            return self.flatten(view, instrument, orders);
        }
        let left = self.left(time);
        let quotes = self.formula.quotes(price.to_f64(), view.position(instrument).to_f64(), left);
        self.quote(view, instrument, Side::Buy, quotes.bid, orders);
        self.quote(view, instrument, Side::Sell, quotes.ask, orders);
    }
}
