//! Strategies of Python: an object with `on_event(view, orders)`.

use std::sync::{Arc, Mutex};

use pyo3::prelude::*;
use pyo3::types::PyDict;
use trueup::market::{ActionKind, CorporateAction, News, Notice, Orders, Strategy, View};
use trueup::sim2real::Timestamp;

use crate::error;
use crate::orders::OrderBook;
use crate::view::{Eyes, Sight};

/// What a strategy has raised, for whoever runs it.
#[derive(Clone, Default)]
pub struct Raised(Arc<Mutex<Option<PyErr>>>);

impl Raised {
    /// # Errors
    /// What the strategy has raised first.
    pub fn check(&self) -> PyResult<()> {
        match self.0.lock().ok().and_then(|mut raised| raised.take()) {
            Some(raised) => Err(raised),
            None => Ok(()),
        }
    }

    fn keep(&self, raised: PyErr) {
        if let Ok(mut first) = self.0.lock() {
            first.get_or_insert(raised);
        }
    }
}

/// A strategy of Python as the engine sees it. Once it has raised something it asks for nothing more, and whoever runs it ends the run.
pub struct Guest {
    strategy: Py<PyAny>,
    name: String,
    lookback: usize,
    notices: bool,
    actions: bool,
    eyes: Eyes,
    raised: Raised,
    silent: bool,
}

impl Guest {
    /// # Errors
    /// An object without `on_event`, or with a `lookback` that is no number of rows.
    pub fn new(py: Python<'_>, strategy: Py<PyAny>, raised: Raised) -> PyResult<Self> {
        let object = strategy.bind(py);
        let kind = object.get_type().name()?.to_string();
        if !object.hasattr("on_event")? {
            let message = format!("a strategy has a method on_event(view, orders), and {kind} has none");
            return Err(error::refused(py, &message, "derive it from trueup.Strategy"));
        }
        let lookback = match object.getattr_opt("lookback")? {
            None => 1,
            Some(lookback) => lookback.extract::<usize>().ok().filter(|rows| *rows >= 1).ok_or_else(|| {
                error::refused(
                    py,
                    &format!("the lookback of {kind} is {lookback}"),
                    "it is a whole number of rows, at least 1",
                )
            })?,
        };
        let name = match object.getattr_opt("name")? {
            Some(name) => name.extract()?,
            None => kind,
        };
        let (notices, actions) = (object.hasattr("on_notice")?, object.hasattr("on_action")?);
        Ok(Self { strategy, name, lookback, notices, actions, eyes: Eyes::default(), raised, silent: false })
    }

    /// Calls `method(view, *news, orders)` with what is known now, and takes over what it asked for.
    fn call(
        &mut self,
        method: &str,
        view: &View<'_>,
        orders: &mut Orders,
        news: impl for<'py> FnOnce(Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>>,
    ) {
        if self.silent {
            return;
        }
        let called = Python::attach(|py| -> PyResult<()> {
            let seen = Py::new(py, Sight::of(py, view, &mut self.eyes)?)?;
            let asked = Py::new(py, OrderBook::taking(orders.clone(), view))?;
            let result = match news(py)? {
                None => self.strategy.call_method1(py, method, (seen, asked.clone_ref(py))),
                Some(news) => self.strategy.call_method1(py, method, (seen, news, asked.clone_ref(py))),
            };
            // Whatever becomes of it: from here on it is closed.
            let given = asked.borrow_mut(py).close();
            result?;
            *orders = given;
            Ok(())
        });
        if let Err(raised) = called {
            self.silent = true;
            Python::attach(|py| note(py, &raised, &self.name, method, view));
            self.raised.keep(raised);
        }
    }
}

/// Adds to an exception where it was raised: in which call, at which event.
fn note(py: Python<'_>, raised: &PyErr, name: &str, method: &str, view: &View<'_>) {
    let event = view.event();
    let symbol = view.instruments().get(event.instrument).map_or("?", |instrument| instrument.symbol.as_str());
    let text = format!("raised in {name}.{method} at {} ({} of {symbol})", Timestamp(view.now().0), event.kind.word());
    // An exception that takes no notes is raised all the same.
    let _ = raised.value(py).call_method1("add_note", (text,));
}

impl Strategy for Guest {
    fn name(&self) -> &str {
        &self.name
    }

    fn lookback(&self) -> usize {
        self.lookback
    }

    fn on_event(&mut self, view: &View<'_>, orders: &mut Orders) {
        self.call("on_event", view, orders, |_| Ok(None));
    }

    fn on_notice(&mut self, view: &View<'_>, notice: &Notice, orders: &mut Orders) {
        if !self.notices {
            return;
        }
        self.call("on_notice", view, orders, |py| {
            let news = PyDict::new(py);
            news.set_item("order_id", notice.order_id.0)?;
            news.set_item("instrument", notice.instrument)?;
            news.set_item("side", notice.side.word())?;
            news.set_item("at", notice.at.0)?;
            match notice.news {
                News::Filled { quantity, price, role, left } => {
                    news.set_item("what", "filled")?;
                    news.set_item("quantity", quantity.to_f64())?;
                    news.set_item("price", price.to_f64())?;
                    news.set_item("liquidity", role.word())?;
                    news.set_item("left", left.to_f64())?;
                }
                News::Ended(reason) => {
                    news.set_item("what", "ended")?;
                    news.set_item("reason", reason.word())?;
                }
                News::SetOff => news.set_item("what", "set_off")?,
                News::Replaced => news.set_item("what", "replaced")?,
            }
            Ok(Some(news))
        });
    }

    fn on_action(&mut self, view: &View<'_>, action: &CorporateAction, orders: &mut Orders) {
        if !self.actions {
            return;
        }
        self.call("on_action", view, orders, |py| {
            let news = PyDict::new(py);
            news.set_item("instrument", action.instrument)?;
            news.set_item("at", action.at.0)?;
            match action.kind {
                ActionKind::Dividend { per_unit, .. } => {
                    news.set_item("what", "dividend")?;
                    news.set_item("per_unit", per_unit.to_f64())?;
                }
                ActionKind::Split { new, old } => {
                    news.set_item("what", "split")?;
                    news.set_item("new", new)?;
                    news.set_item("old", old)?;
                }
            }
            Ok(Some(news))
        });
    }
}
