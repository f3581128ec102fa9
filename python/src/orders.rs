//! What a strategy of Python asks for at one event.

use std::collections::HashMap;

use pyo3::prelude::*;
use trueup::market::{Condition, Instrument, OrderId, OrderKind, Orders, Price, Quantity, Side, Ticket, TimeInForce, View};
use trueup::sim2real::Timestamp;

use crate::error;
use crate::view::Sight;

/// The side `word` stands for.
pub fn side_of(py: Python<'_>, word: &str) -> PyResult<Side> {
    Side::of_word(word).ok_or_else(|| error::refused(py, &format!("there is no side {word:?}"), "\"buy\" or \"sell\""))
}

/// Collects what a strategy asks for at one event; of no use after it. Instruments are given by their number or symbol, quantities
/// in units, prices in currency; each order gives its id.
#[pyclass(module = "trueup", name = "Orders")]
pub struct OrderBook {
    /// None once the event is over.
    orders: Option<Orders>,
    symbols: HashMap<String, usize>,
    count: usize,
}

impl OrderBook {
    /// Goes on from `orders`, which numbers them.
    pub fn taking(orders: Orders, view: &View<'_>) -> Self {
        let name = |(number, instrument): (usize, &Instrument)| (instrument.symbol.clone(), number);
        let symbols = view.instruments().iter().enumerate().map(name).collect();
        Self { orders: Some(orders), symbols, count: view.instruments().len() }
    }

    /// What was asked for; nothing more can be.
    pub fn close(&mut self) -> Orders {
        self.orders.take().unwrap_or_default()
    }

    fn open(&mut self, py: Python<'_>) -> PyResult<&mut Orders> {
        self.orders.as_mut().ok_or_else(|| {
            error::refused(
                py,
                "these orders are of an event that is over",
                "use those that the call was given, and keep none",
            )
        })
    }

    fn number(&self, py: Python<'_>, instrument: &Bound<'_, PyAny>) -> PyResult<usize> {
        let named = || self.symbols.get(&instrument.extract::<String>().ok()?).copied();
        let numbered = instrument.extract::<usize>().ok().filter(|number| *number < self.count);
        numbered.or_else(named).ok_or_else(|| {
            let found = instrument.repr().map_or_else(|_| "?".to_owned(), |text| text.to_string());
            error::refused(py, &format!("there is no instrument {found}"), "give the symbol or the number of one of the run")
        })
    }
}

fn quantity(py: Python<'_>, units: f64) -> PyResult<Quantity> {
    Quantity::nearest(units).map_err(|error| error::told(py, &error))
}

fn price(py: Python<'_>, value: f64) -> PyResult<Price> {
    Price::nearest(value).map_err(|error| error::told(py, &error))
}

#[pymethods]
impl OrderBook {
    /// Asks for an order, and gives its id.
    ///
    /// `type` is "market", "limit", "stop", "stop_limit", "trailing_stop", "market_on_open", "limit_on_open", "market_on_close" or
    /// "limit_on_close"; `limit`, `stop` and `distance` are its prices. `time_in_force` is "gtc", "day", "ioc" or "fok";
    /// `condition` "post_only" or "reduce_only".
    #[pyo3(signature = (instrument, side, quantity, r#type="market", *, limit=None, stop=None, distance=None, time_in_force="gtc", condition=None))]
    #[allow(clippy::too_many_arguments)]
    fn submit(
        &mut self,
        py: Python<'_>,
        instrument: &Bound<'_, PyAny>,
        side: &str,
        quantity: f64,
        r#type: &str,
        limit: Option<f64>,
        stop: Option<f64>,
        distance: Option<f64>,
        time_in_force: &str,
        condition: Option<&str>,
    ) -> PyResult<u64> {
        let word = r#type;
        let needed = |name: &str, value: Option<f64>| match value {
            Some(value) => price(py, value),
            None => Err(error::refused(py, &format!("a {word} order needs `{name}`"), &format!("{name}=100.25"))),
        };
        let kind = match word {
            "market" => OrderKind::Market,
            "limit" => OrderKind::Limit { price: needed("limit", limit)? },
            "stop" => OrderKind::Stop { trigger: needed("stop", stop)? },
            "stop_limit" => OrderKind::StopLimit { trigger: needed("stop", stop)?, price: needed("limit", limit)? },
            "trailing_stop" => OrderKind::TrailingStop { distance: needed("distance", distance)? },
            "market_on_open" => OrderKind::MarketOnOpen,
            "limit_on_open" => OrderKind::LimitOnOpen { price: needed("limit", limit)? },
            "market_on_close" => OrderKind::MarketOnClose,
            "limit_on_close" => OrderKind::LimitOnClose { price: needed("limit", limit)? },
            other => return Err(error::refused(py, &format!("there is no order of type {other:?}"), "such as \"limit\"")),
        };
        let works = match time_in_force {
            "gtc" => TimeInForce::GoodTillCancelled,
            "day" => TimeInForce::Day,
            "ioc" => TimeInForce::ImmediateOrCancel,
            "fok" => TimeInForce::FillOrKill,
            other => {
                return Err(error::refused(py, &format!("there is no time in force {other:?}"), "gtc, day, ioc or fok"));
            }
        };
        let condition = match condition {
            None => Condition::None,
            Some("post_only") => Condition::PostOnly,
            Some("reduce_only") => Condition::ReduceOnly,
            Some(other) => {
                return Err(error::refused(py, &format!("there is no condition {other:?}"), "post_only or reduce_only"));
            }
        };
        let instrument = self.number(py, instrument)?;
        let ticket = Ticket::new(instrument, side_of(py, side)?, self::quantity(py, quantity)?, kind);
        Ok(self.open(py)?.submit(ticket.working(works).on(condition)).0)
    }

    /// Asks for a market order.
    fn market(&mut self, py: Python<'_>, instrument: &Bound<'_, PyAny>, side: &str, quantity: f64) -> PyResult<u64> {
        let instrument = self.number(py, instrument)?;
        let (side, quantity) = (side_of(py, side)?, self::quantity(py, quantity)?);
        Ok(self.open(py)?.market(instrument, side, quantity).0)
    }

    /// Asks for a limit order that works until it is filled or cancelled.
    fn limit(
        &mut self,
        py: Python<'_>,
        instrument: &Bound<'_, PyAny>,
        side: &str,
        quantity: f64,
        price: f64,
    ) -> PyResult<u64> {
        let instrument = self.number(py, instrument)?;
        let (side, quantity, price) = (side_of(py, side)?, self::quantity(py, quantity)?, self::price(py, price)?);
        Ok(self.open(py)?.limit(instrument, side, quantity, price).0)
    }

    /// Asks for the market order that takes the position, with what is on its way, to `target` [units]; for none where it is there
    /// already. `view` is the one that came with these orders. Gives the id, where there is an order.
    #[pyo3(name = "to_position")]
    fn bring_to(
        &mut self,
        py: Python<'_>,
        view: &Bound<'_, Sight>,
        instrument: &Bound<'_, PyAny>,
        target: f64,
    ) -> PyResult<Option<u64>> {
        let instrument = self.number(py, instrument)?;
        let missing = quantity(py, target)? - view.get().coming(instrument);
        let orders = self.open(py)?;
        Ok(match missing.0.signum() {
            1 => Some(orders.market(instrument, Side::Buy, missing).0),
            -1 => Some(orders.market(instrument, Side::Sell, missing.abs()).0),
            _ => None,
        })
    }

    /// Asks to take an order back.
    fn cancel(&mut self, py: Python<'_>, id: u64) -> PyResult<()> {
        self.open(py)?.cancel(OrderId(id));
        Ok(())
    }

    /// Asks to change an order: its quantity in all [units], what was filled included, and its limit, or the trigger of a stop.
    #[pyo3(signature = (id, quantity=None, price=None))]
    fn replace(&mut self, py: Python<'_>, id: u64, quantity: Option<f64>, price: Option<f64>) -> PyResult<()> {
        let quantity = quantity.map(|units| self::quantity(py, units)).transpose()?;
        let price = price.map(|value| self::price(py, value)).transpose()?;
        self.open(py)?.replace(OrderId(id), quantity, price);
        Ok(())
    }

    /// Asks to be woken at an instant [ns since the epoch, UTC], or at once where that is past.
    fn wake_at(&mut self, py: Python<'_>, time: i64) -> PyResult<()> {
        self.open(py)?.wake_at(Timestamp(time));
        Ok(())
    }

    /// How many requests there are so far.
    fn __len__(&self) -> usize {
        self.orders.as_ref().map_or(0, |orders| orders.requests().len())
    }
}
