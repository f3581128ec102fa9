//! A run as audits compare it: what was asked for, and what came of it.

use std::sync::Mutex;

use serde::Serialize;

use crate::market::{
    Backtest, BacktestError, EquityPoint, Fill, Instrument, OrderKind, Orders, Price, Record, Rejection, Request, Side,
    Strategy, View,
};
use crate::sim2real::Timestamp;

use super::Engine;

/// What a strategy asked for, and when; refused or not.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::market) struct Decision {
    pub time: Timestamp,
    pub request: Request,
}

/// What a run left.
#[derive(Debug)]
pub(in crate::market) struct Trace {
    pub decisions: Vec<Decision>,
    /// The record, or why the run did not come to its end: all that was decided before stands nevertheless.
    pub record: Result<Record, BacktestError>,
}

/// What differs between two runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Subject {
    /// An order the strategy asked for.
    Request,
    /// An order that was refused.
    Refusal,
    /// A fill.
    Fill,
    /// The account's worth.
    Equity,
}

impl Subject {
    /// Its word in tables.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Request => "order",
            Self::Refusal => "refusal",
            Self::Fill => "fill",
            Self::Equity => "equity",
        }
    }
}

/// The first thing that differs between two runs.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Difference {
    /// When it came about, in the run in which it did so first [ns since the Unix epoch, UTC].
    pub time: Timestamp,
    /// What it is.
    pub subject: Subject,
    /// Symbol of the instrument; none where it is of all.
    pub instrument: Option<String>,
    /// What it was on the data as they are.
    pub was: String,
    /// What it became on the changed data.
    pub became: String,
}

/// Runs `strategy` by `engine`, and writes down all it asks for.
pub(in crate::market) fn trace(engine: Engine<'_>, backtest: &Backtest, strategy: &mut dyn Strategy) -> Trace {
    struct Recorder<'a> {
        inner: &'a mut dyn Strategy,
        decisions: &'a Mutex<Vec<Decision>>,
    }
    impl Strategy for Recorder<'_> {
        fn name(&self) -> &str {
            self.inner.name()
        }
        fn lookback(&self) -> usize {
            self.inner.lookback()
        }
        fn on_event(&mut self, view: &View<'_>, orders: &mut Orders) {
            self.inner.on_event(view, orders);
            if orders.requests().is_empty() {
                return;
            }
            if let Ok(mut decisions) = self.decisions.lock() {
                let made = orders.requests().iter().map(|request| Decision { time: view.now(), request: *request });
                decisions.extend(made);
            }
        }
    }
    let decisions = Mutex::new(Vec::new());
    let record = engine(backtest, &mut Recorder { inner: strategy, decisions: &decisions });
    Trace { decisions: decisions.into_inner().unwrap_or_default(), record }
}

/// The first thing up to `now` that is not the same, to the last bit, in both runs: orders asked for and refused and the
/// account's worth up to `now`, fills before it (what is filled at an instant is not seen at it).
pub(in crate::market) fn difference(
    was: &Trace,
    became: &Trace,
    now: Timestamp,
    about: &[Instrument],
) -> Option<Difference> {
    let requests = series(Subject::Request, &was.decisions, &became.decisions, |d| d.time <= now, about);
    let (Ok(was), Ok(became)) = (&was.record, &became.record) else { return requests };
    let refused = [&was.blotter.rejections, &became.blotter.rejections];
    let refusals = series(Subject::Refusal, refused[0], refused[1], |r| r.decided_at <= now, about);
    let fills = series(Subject::Fill, &was.blotter.fills, &became.blotter.fills, |f| f.filled_at < now, about);
    // A run that ends at `now` has a point more there, of fills after its last event.
    let points = was.equity.iter().take_while(|point| point.time <= now).count();
    let first = |all: &[EquityPoint]| all[..points.min(all.len())].to_vec();
    let equity = series(Subject::Equity, &first(&was.equity), &first(&became.equity), |_| true, about);
    // At one time the decision is what the reader wants to know of; they were put in this order.
    [requests, refusals, fills, equity].into_iter().flatten().min_by_key(|difference| (difference.time, difference.subject))
}

/// Something that came about in a run.
trait Happened {
    fn time(&self) -> Timestamp;
    fn instrument(&self) -> Option<usize>;
    fn shown(&self) -> String;
    fn same(&self, other: &Self) -> bool;
}

fn series<T: Happened>(
    subject: Subject,
    was: &[T],
    became: &[T],
    counts: impl Fn(&T) -> bool,
    about: &[Instrument],
) -> Option<Difference> {
    let [was, became] = [was, became].map(|all| &all[..all.iter().take_while(|one| counts(one)).count()]);
    let same = was.iter().zip(became).take_while(|(a, b)| a.same(b)).count();
    let (was, became) = (was.get(same), became.get(same));
    let time = [was, became].into_iter().flatten().map(T::time).min()?;
    let at = |one: Option<&T>| one.filter(|one| one.time() == time).map_or_else(|| "nothing".to_owned(), T::shown);
    let first = [was, became].into_iter().flatten().find(|one| one.time() == time)?;
    let instrument = first.instrument().and_then(|k| about.get(k)).map(|i| i.symbol.clone());
    Some(Difference { time, subject, instrument, was: at(was), became: at(became) })
}

fn sided(side: Side, quantity: crate::market::Quantity) -> String {
    format!("{} {}", side.word(), quantity.to_f64())
}

impl Happened for Decision {
    fn time(&self) -> Timestamp {
        self.time
    }
    fn instrument(&self) -> Option<usize> {
        match self.request {
            Request::Submit(_, ticket) => Some(ticket.instrument),
            Request::Refused { instrument, .. } => Some(instrument),
            Request::Cancel(_) | Request::Replace { .. } | Request::Wake(_) => None,
        }
    }
    fn shown(&self) -> String {
        let price = |price: Price| format!(" at {}", price.to_f64());
        match self.request {
            Request::Submit(_, ticket) => {
                let at = ticket.kind.limit().or(ticket.kind.trigger()).map(price).unwrap_or_default();
                let kind = match ticket.kind {
                    OrderKind::Market => String::new(),
                    kind => format!(" ({})", kind.word().replace('_', " ")),
                };
                format!("{}{at}{kind}", sided(ticket.side, ticket.quantity))
            }
            Request::Cancel(id) => format!("cancel order {}", id.0),
            Request::Replace { id, quantity, price: to } => {
                let quantity = quantity.map(|q| format!(" {}", q.to_f64())).unwrap_or_default();
                format!("replace order {}:{quantity}{}", id.0, to.map(price).unwrap_or_default())
            }
            Request::Refused { side, quantity, reason, .. } => {
                format!("{} {} refused: {reason}", side.word(), quantity.to_f64())
            }
            Request::Wake(time) => format!("wake at {time}"),
        }
    }
    fn same(&self, other: &Self) -> bool {
        self == other
    }
}

impl Happened for Rejection {
    fn time(&self) -> Timestamp {
        self.decided_at
    }
    fn instrument(&self) -> Option<usize> {
        Some(self.instrument)
    }
    fn shown(&self) -> String {
        format!("{} refused: {}", sided(self.side, self.quantity), self.reason)
    }
    fn same(&self, other: &Self) -> bool {
        self == other
    }
}

impl Happened for Fill {
    fn time(&self) -> Timestamp {
        self.filled_at
    }
    fn instrument(&self) -> Option<usize> {
        Some(self.instrument)
    }
    fn shown(&self) -> String {
        format!("{} at {}", sided(self.side, self.quantity), self.price.to_f64())
    }
    fn same(&self, other: &Self) -> bool {
        (self.order_id, self.instrument, self.filled_at, self.side)
            == (other.order_id, other.instrument, other.filled_at, other.side)
            && (self.quantity, self.price, self.fee) == (other.quantity, other.price, other.fee)
    }
}

impl Happened for EquityPoint {
    fn time(&self) -> Timestamp {
        self.time
    }
    fn instrument(&self) -> Option<usize> {
        None
    }
    fn shown(&self) -> String {
        format!("{}", self.equity)
    }
    fn same(&self, other: &Self) -> bool {
        self.time == other.time && self.equity.to_bits() == other.equity.to_bits()
    }
}
