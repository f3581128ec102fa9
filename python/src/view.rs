//! What a strategy of Python sees: a copy of the present and of the newest past, taken once an event.

use std::sync::Arc;

use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyTuple};
use trueup::market::{Bar, Increments, OpenOrder, Print, Quantity, Side, View};

use crate::error;
use crate::orders::side_of;

/// Levels of a book that are shown at most.
const LEVELS: usize = 10;

/// What was seen of each instrument before: what has not changed since is not copied again.
#[derive(Default)]
pub struct Eyes {
    symbols: Option<Py<PyTuple>>,
    pasts: Vec<Past>,
}

/// The newest past of an instrument.
#[derive(Clone, Default)]
struct Past {
    bars: Arc<Vec<Bar>>,
    quotes: Arc<Vec<[f64; 4]>>,
    quoted_at: Arc<Vec<i64>>,
    prints: Arc<Vec<Print>>,
}

impl Past {
    /// Takes over what is new; all of the instrument something just happened to.
    fn look(&mut self, view: &View<'_>, instrument: usize) {
        let happened = view.event().instrument == instrument;
        let bars = view.bars(instrument);
        if happened || self.bars.len() != bars.len() || self.bars.last() != bars.last() {
            self.bars = Arc::new(bars.to_vec());
        }
        let prints = view.prints(instrument);
        if happened || self.prints.len() != prints.len() || self.prints.last() != prints.last() {
            self.prints = Arc::new(prints.to_vec());
        }
        let quotes = view.quotes(instrument);
        let row = |k: usize| {
            let quote = quotes.get(k)?;
            let level = |levels: &[trueup::market::Level]| levels.first().map_or([f64::NAN; 2], |l| [l.price, l.size]);
            let ([bid, bid_size], [ask, ask_size]) = (level(quote.bids), level(quote.asks));
            Some([bid, bid_size, ask, ask_size])
        };
        let newest = quotes.len().checked_sub(1).and_then(row);
        let same = self.quotes.len() == quotes.len() && self.quotes.last().copied().map(bits) == newest.map(bits);
        if happened || !same || self.quoted_at.last() != quotes.times().last().map(|time| &time.0) {
            self.quotes = Arc::new((0..quotes.len()).filter_map(row).collect());
            self.quoted_at = Arc::new(quotes.times().iter().map(|time| time.0).collect());
        }
    }
}

/// NaN is the same as NaN here.
fn bits(row: [f64; 4]) -> [u64; 4] {
    row.map(f64::to_bits)
}

/// What is known of an instrument now.
struct Known {
    past: Past,
    position: Quantity,
    working: Quantity,
    price: Option<f64>,
    best: [Option<f64>; 2],
    depth: Option<[Vec<(f64, f64)>; 2]>,
    unit_value: Option<f64>,
    steps: Option<Increments>,
    orders: Vec<OpenOrder>,
    halted: bool,
    session: Option<(i64, i64)>,
}

/// The past and the present, as far as a strategy may see them: a copy, which may be kept.
///
/// Instruments are given by their number (their place in `symbols`) or by their symbol. Prices and amounts are in currency,
/// quantities in units, times integers of nanoseconds since the epoch (UTC).
#[pyclass(frozen, module = "trueup", name = "View")]
pub struct Sight {
    now: i64,
    kind: &'static str,
    instrument: usize,
    symbols: Py<PyTuple>,
    cash: f64,
    equity: f64,
    known: Vec<Known>,
}

impl Sight {
    /// What `view` shows.
    pub fn of(py: Python<'_>, view: &View<'_>, eyes: &mut Eyes) -> PyResult<Self> {
        let count = view.instruments().len();
        eyes.pasts.resize_with(count, Past::default);
        let symbols = match &eyes.symbols {
            Some(symbols) => symbols.clone_ref(py),
            None => {
                let symbols =
                    PyTuple::new(py, view.instruments().iter().map(|instrument| instrument.symbol.as_str()))?.unbind();
                eyes.symbols.insert(symbols).clone_ref(py)
            }
        };
        let known = (0..count).zip(&mut eyes.pasts).map(|(instrument, past)| {
            past.look(view, instrument);
            let best = [Side::Buy, Side::Sell].map(|side| view.best(instrument, side).map(|price| price.to_f64()));
            let levels = |book: &trueup::market::DepthBook, side| {
                book.levels(side).take(LEVELS).map(|level| (level.price, level.size)).collect::<Vec<_>>()
            };
            Known {
                past: past.clone(),
                position: view.position(instrument),
                working: view.working(instrument),
                price: view.price(instrument).map(|price| price.to_f64()),
                best,
                depth: view.book(instrument).map(|book| [Side::Buy, Side::Sell].map(|side| levels(book, side))),
                unit_value: view.unit_value(instrument),
                steps: view.instruments().get(instrument).and_then(|instrument| Increments::of(instrument).ok()),
                orders: view.orders(instrument).to_vec(),
                halted: view.halt(instrument).is_some(),
                session: view.session(instrument).map(|hours| (hours.open.0, hours.close.0)),
            }
        });
        let event = view.event();
        Ok(Self {
            now: view.now().0,
            kind: event.kind.word(),
            instrument: event.instrument,
            symbols,
            cash: view.cash().to_f64(),
            equity: view.equity().to_f64(),
            known: known.collect(),
        })
    }

    /// What is held of an instrument and what is on its way.
    pub fn coming(&self, instrument: usize) -> Quantity {
        self.known.get(instrument).map_or(Quantity::ZERO, |known| known.position + known.working)
    }

    /// The number of an instrument that is given by number or symbol.
    pub fn number(&self, py: Python<'_>, instrument: &Bound<'_, PyAny>) -> PyResult<usize> {
        if let Ok(number) = instrument.extract::<usize>()
            && number < self.known.len()
        {
            return Ok(number);
        }
        let symbols = self.symbols.bind(py);
        if let Ok(symbol) = instrument.extract::<String>()
            && let Some(number) =
                symbols.iter().position(|known| known.extract::<String>().is_ok_and(|known| known == symbol))
        {
            return Ok(number);
        }
        let message = format!("there is no instrument {}", instrument.repr()?);
        Err(error::refused(py, &message, &format!("the run has {}, numbered from 0", symbols.repr()?)))
    }

    fn of_instrument(&self, py: Python<'_>, instrument: Option<&Bound<'_, PyAny>>) -> PyResult<&Known> {
        let number = instrument.map_or(Ok(self.instrument), |instrument| self.number(py, instrument))?;
        self.known.get(number).ok_or_else(|| error::refused(py, "the event is of no instrument", "name one"))
    }
}

#[pymethods]
impl Sight {
    /// The present [ns since the epoch, UTC].
    #[getter]
    fn now(&self) -> i64 {
        self.now
    }

    /// What just became known: "bar", "trade", "depth", "quote" or "timer".
    #[getter]
    fn event(&self) -> &'static str {
        self.kind
    }

    /// Number of the instrument it became known of.
    #[getter]
    fn instrument(&self) -> usize {
        self.instrument
    }

    /// Symbols of the instruments; an instrument's number is its place here.
    #[getter]
    fn symbols(&self, py: Python<'_>) -> Py<PyTuple> {
        self.symbols.clone_ref(py)
    }

    /// Cash in hand [currency of the run].
    #[getter]
    fn cash(&self) -> f64 {
        self.cash
    }

    /// Cash and what all positions are worth [currency of the run].
    #[getter]
    fn equity(&self) -> f64 {
        self.equity
    }

    /// The bars known by now, oldest first, at most `lookback` of them; of the event's instrument unless another is named.
    #[pyo3(signature = (instrument=None))]
    fn bars(&self, py: Python<'_>, instrument: Option<&Bound<'_, PyAny>>) -> PyResult<Bars> {
        Ok(Bars { bars: Arc::clone(&self.of_instrument(py, instrument)?.past.bars) })
    }

    /// The quotes by now, oldest first, at most `lookback` of them: a dict of arrays ts [ns], bid, bid_size, ask, ask_size.
    #[pyo3(signature = (instrument=None))]
    fn quotes<'py>(&self, py: Python<'py>, instrument: Option<&Bound<'py, PyAny>>) -> PyResult<Bound<'py, PyDict>> {
        let past = &self.of_instrument(py, instrument)?.past;
        let columns = PyDict::new(py);
        columns.set_item("ts", PyArray1::from_slice(py, &past.quoted_at))?;
        for (k, name) in ["bid", "bid_size", "ask", "ask_size"].into_iter().enumerate() {
            columns.set_item(name, PyArray1::from_iter(py, past.quotes.iter().map(|row| row[k])))?;
        }
        Ok(columns)
    }

    /// The trades printed by now, oldest first, at most `lookback` of them: a dict of arrays ts [ns], price, size.
    #[pyo3(signature = (instrument=None))]
    fn trades<'py>(&self, py: Python<'py>, instrument: Option<&Bound<'py, PyAny>>) -> PyResult<Bound<'py, PyDict>> {
        let prints = &self.of_instrument(py, instrument)?.past.prints;
        let columns = PyDict::new(py);
        columns.set_item("ts", PyArray1::from_iter(py, prints.iter().map(|print| print.time.0)))?;
        columns.set_item("price", PyArray1::from_iter(py, prints.iter().map(|print| print.price)))?;
        columns.set_item("size", PyArray1::from_iter(py, prints.iter().map(|print| print.size)))?;
        Ok(columns)
    }

    /// The book by now, where the data have one: {"buy": [(price, size), ...], "sell": ...}, the best first, at most 10 levels.
    #[pyo3(signature = (instrument=None))]
    fn book<'py>(&self, py: Python<'py>, instrument: Option<&Bound<'py, PyAny>>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some([bids, asks]) = &self.of_instrument(py, instrument)?.depth else { return Ok(None) };
        let book = PyDict::new(py);
        book.set_item("buy", bids.clone())?;
        book.set_item("sell", asks.clone())?;
        Ok(Some(book))
    }

    /// The best price displayed on `side` ("buy": the bid), where there is one.
    #[pyo3(signature = (side, instrument=None))]
    fn best(&self, py: Python<'_>, side: &str, instrument: Option<&Bound<'_, PyAny>>) -> PyResult<Option<f64>> {
        let [bid, ask] = self.of_instrument(py, instrument)?.best;
        Ok(if side_of(py, side)? == Side::Buy { bid } else { ask })
    }

    /// The latest price: the close of the last bar, or the last mid.
    #[pyo3(signature = (instrument=None))]
    fn price(&self, py: Python<'_>, instrument: Option<&Bound<'_, PyAny>>) -> PyResult<Option<f64>> {
        Ok(self.of_instrument(py, instrument)?.price)
    }

    /// What is held [units], negative when short.
    #[pyo3(signature = (instrument=None))]
    fn position(&self, py: Python<'_>, instrument: Option<&Bound<'_, PyAny>>) -> PyResult<f64> {
        Ok(self.of_instrument(py, instrument)?.position.to_f64())
    }

    /// What is on its way and would change the position [units]: positive for buys.
    #[pyo3(signature = (instrument=None))]
    fn working(&self, py: Python<'_>, instrument: Option<&Bound<'_, PyAny>>) -> PyResult<f64> {
        Ok(self.of_instrument(py, instrument)?.working.to_f64())
    }

    /// Smallest step of the price [currency].
    #[pyo3(signature = (instrument=None))]
    fn tick(&self, py: Python<'_>, instrument: Option<&Bound<'_, PyAny>>) -> PyResult<f64> {
        Ok(self.of_instrument(py, instrument)?.steps.map_or(0.0, |steps| steps.tick().to_f64()))
    }

    /// What one unit is worth at its latest price [currency of the run], where there is one.
    #[pyo3(signature = (instrument=None))]
    fn unit_value(&self, py: Python<'_>, instrument: Option<&Bound<'_, PyAny>>) -> PyResult<Option<f64>> {
        Ok(self.of_instrument(py, instrument)?.unit_value)
    }

    /// The whole lots [units] that `amount` [currency of the run] is worth at the latest price; 0 where there is no price, or the
    /// amount is not above 0.
    #[pyo3(signature = (amount, instrument=None))]
    fn lots_worth(&self, py: Python<'_>, amount: f64, instrument: Option<&Bound<'_, PyAny>>) -> PyResult<f64> {
        let known = self.of_instrument(py, instrument)?;
        let (Some(value), Some(steps)) = (known.unit_value, known.steps) else { return Ok(0.0) };
        let units = amount / value;
        let lots = if units > 0.0 {
            Quantity::nearest(units).map_or(Quantity::ZERO, |q| steps.whole_lots(q))
        } else {
            Quantity::ZERO
        };
        Ok(lots.to_f64())
    }

    /// Our orders that work, as far as is known, the oldest first: dicts with id, side, type, limit, stop, left [units].
    #[pyo3(signature = (instrument=None))]
    fn orders<'py>(&self, py: Python<'py>, instrument: Option<&Bound<'py, PyAny>>) -> PyResult<Bound<'py, PyList>> {
        let list = PyList::empty(py);
        for order in &self.of_instrument(py, instrument)?.orders {
            let row = PyDict::new(py);
            row.set_item("id", order.id.0)?;
            row.set_item("side", order.side.word())?;
            row.set_item("type", order.kind.word())?;
            row.set_item("limit", order.kind.limit().map(|price| price.to_f64()))?;
            row.set_item("stop", order.kind.trigger().map(|price| price.to_f64()))?;
            row.set_item("left", order.left.to_f64())?;
            list.append(row)?;
        }
        Ok(list)
    }

    /// Whether it is halted now.
    #[pyo3(signature = (instrument=None))]
    fn halted(&self, py: Python<'_>, instrument: Option<&Bound<'_, PyAny>>) -> PyResult<bool> {
        Ok(self.of_instrument(py, instrument)?.halted)
    }

    /// The session now, its open and its close [ns since the epoch]; None while its market is closed, and where it has no calendar.
    #[pyo3(signature = (instrument=None))]
    fn session(&self, py: Python<'_>, instrument: Option<&Bound<'_, PyAny>>) -> PyResult<Option<(i64, i64)>> {
        Ok(self.of_instrument(py, instrument)?.session)
    }

    fn __repr__(&self) -> String {
        format!("<trueup.View at {} ns, a {} of instrument {}>", self.now, self.kind, self.instrument)
    }
}

/// Bars, oldest first. Each attribute is a new array of shape (bars,).
#[pyclass(frozen, module = "trueup")]
pub struct Bars {
    bars: Arc<Vec<Bar>>,
}

impl Bars {
    fn array<'py>(&self, py: Python<'py>, value: impl Fn(&Bar) -> f64) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_iter(py, self.bars.iter().map(value))
    }
}

#[pymethods]
impl Bars {
    fn __len__(&self) -> usize {
        self.bars.len()
    }

    /// When each began [ns since the epoch, UTC].
    #[getter]
    fn open_at<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        PyArray1::from_iter(py, self.bars.iter().map(|bar| bar.open_at.0))
    }

    /// When each ended, and could be known [ns since the epoch, UTC].
    #[getter]
    fn known_at<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        PyArray1::from_iter(py, self.bars.iter().map(|bar| bar.known_at.0))
    }

    /// First prices [currency].
    #[getter]
    fn open<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.array(py, |bar| bar.open.to_f64())
    }

    /// Highest prices [currency].
    #[getter]
    fn high<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.array(py, |bar| bar.high.to_f64())
    }

    /// Lowest prices [currency].
    #[getter]
    fn low<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.array(py, |bar| bar.low.to_f64())
    }

    /// Last prices [currency].
    #[getter]
    fn close<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.array(py, |bar| bar.close.to_f64())
    }

    /// Last prices as whole numbers [1e-9 of the currency]: sums of these are exact.
    #[getter]
    fn close_nanos<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        PyArray1::from_iter(py, self.bars.iter().map(|bar| bar.close.0))
    }

    /// Volumes [units].
    #[getter]
    fn volume<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.array(py, |bar| bar.volume)
    }
}
