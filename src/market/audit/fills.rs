//! Whether fills are possible ones: after their decision, and at prices there were.

use serde::Serialize;

use crate::market::{Backtest, Fill, History, Instrument, Record, Side};
use crate::sim2real::Timestamp;

/// What is wrong with a fill.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Impossible {
    /// It is older than the decision it follows from.
    BeforeDecision,
    /// It needs nothing but data that had been seen when it was decided: bars had nothing to fill it from but the close.
    SeenPrice,
    /// There was no bar and no quote at its time.
    NoMarket,
    /// Its price lies outside what was traded or quoted at its time.
    OutsideRange,
}

impl Impossible {
    /// What is wrong, in words.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Self::BeforeDecision => "older than its decision",
            Self::SeenPrice => "filled at a price that had been seen",
            Self::NoMarket => "no bar and no quote at its time",
            Self::OutsideRange => "outside the range of its time",
        }
    }
}

/// A fill that cannot be.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FillFault {
    /// The fill's number.
    pub fill_id: u64,
    /// The order's.
    pub order_id: u64,
    /// Symbol of the instrument.
    pub instrument: String,
    /// When it was decided [ns since the Unix epoch, UTC].
    pub decided_at: Timestamp,
    /// When it was filled [ns since the Unix epoch, UTC].
    pub filled_at: Timestamp,
    /// At which price [currency].
    pub price: f64,
    /// What is wrong.
    pub fault: Impossible,
    /// Lowest and highest price of its time [currency], where there are any.
    pub range: Option<(f64, f64)>,
}

/// The fills of `record` that cannot be.
pub(super) fn impossible(backtest: &Backtest, record: &Record) -> Vec<FillFault> {
    let one = |fill: &Fill| {
        // What a whole book showed is not kept: of its fills the decision's time alone is held against them.
        let history =
            backtest.histories().get(fill.instrument).filter(|h| h.shows_bars_alone() || !h.quotes().is_empty())?;
        let decided_at = decided_at(record, fill)?;
        let range = with_trade(range(history, decided_at, fill.filled_at), history, record, fill);
        let fault = match range {
            _ if fill.filled_at < decided_at => Impossible::BeforeDecision,
            None => Impossible::NoMarket,
            Some(range) if outside(fill, range) => Impossible::OutsideRange,
            Some(_) => return None,
        };
        Some(fault_of(fill, decided_at, fault, range, backtest.instruments()))
    };
    record.blotter.fills.iter().filter_map(one).collect()
}

/// The fills of a run that was cut off after `now` of orders that were decided at `now`, where there are bars only: each
/// met a price that had been seen. (With quotes, an order without delay meets the book that it saw.)
pub(super) fn at_seen_prices(backtest: &Backtest, cut_off: &Record, now: Timestamp) -> Vec<FillFault> {
    let one = |fill: &Fill| {
        let history = backtest.histories().get(fill.instrument)?;
        let decided_at = decided_at(cut_off, fill).filter(|at| *at == now && history.shows_bars_alone())?;
        // Where hours are known, a bar that is under way may have its open or its close in them still to come.
        let hours = backtest.settings().calendars.get(fill.instrument).is_some_and(Option::is_some);
        if hours && fill.filled_at > now {
            return None;
        }
        Some(fault_of(fill, decided_at, Impossible::SeenPrice, None, backtest.instruments()))
    };
    cut_off.blotter.fills.iter().filter_map(one).collect()
}

fn decided_at(record: &Record, fill: &Fill) -> Option<Timestamp> {
    record.blotter.order(fill.order_id).map(|order| order.decided_at)
}

fn fault_of(
    fill: &Fill,
    decided_at: Timestamp,
    fault: Impossible,
    range: Option<(f64, f64)>,
    instruments: &[Instrument],
) -> FillFault {
    FillFault {
        fill_id: fill.fill_id,
        order_id: fill.order_id,
        instrument: instruments.get(fill.instrument).map(|i| i.symbol.clone()).unwrap_or_default(),
        decided_at,
        filled_at: fill.filled_at,
        price: fill.price.to_f64(),
        fault,
        range,
    }
}

/// Lowest and highest price at `time` of what was not known whole at `decided_at`.
fn range(history: &History, decided_at: Timestamp, time: Timestamp) -> Option<(f64, f64)> {
    let prices = if history.quotes().is_empty() {
        // A bar begins when the one before it ends: at that instant both count, unless the earlier one had been seen.
        let bars = history.bars();
        let first = bars.partition_point(|bar| bar.known_at < time || bar.known_at <= decided_at);
        bars[first..]
            .iter()
            .take_while(|bar| bar.open_at <= time)
            .flat_map(|bar| [bar.low, bar.high])
            .map(|p| p.to_f64())
            .collect()
    } else {
        quoted(history, time)
    };
    let (low, high) = prices.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
    (low <= high).then_some((low, high))
}

/// The same with the last trade, which is what an order for the open or the close meets where trades are known.
fn with_trade(range: Option<(f64, f64)>, history: &History, record: &Record, fill: &Fill) -> Option<(f64, f64)> {
    let for_auction = record.blotter.order(fill.order_id).is_some_and(|order| order.kind.is_for_auction());
    let before = history.prints().partition_point(|print| print.time <= fill.filled_at);
    let Some(print) = before.checked_sub(1).and_then(|k| history.prints().get(k)).filter(|_| for_auction) else {
        return range;
    };
    let (low, high) = range.unwrap_or((print.price, print.price));
    Some((low.min(print.price), high.max(print.price)))
}

/// Best prices of the quotes that were in force at `time`: those that carry it, and the last before.
fn quoted(history: &History, time: Timestamp) -> Vec<f64> {
    let all = history.quotes().all();
    let after = all.times().partition_point(|t| *t <= time);
    let before = all.times().partition_point(|t| *t < time);
    let rows = before.saturating_sub(1)..after;
    rows.filter_map(|k| all.get(k)).flat_map(|quote| [quote.bid(), quote.ask()]).flatten().collect()
}

/// Whether a fill is better than the best price there was, or began at a price that was not there: mechanisms may make a
/// price worse than any that was traded, never better. Where own orders had moved the market, the best there was had moved with it.
fn outside(fill: &Fill, (low, high): (f64, f64)) -> bool {
    let (price, room, moved) = (fill.price.to_f64(), 1e-9 * high, fill.why.displaced.to_f64());
    let better = match fill.side {
        Side::Buy => price < low + moved - room,
        Side::Sell => price > high + moved + room,
    };
    let conceded = (fill.cost.spread_and_impact + fill.cost.rounding) / fill.quantity.to_f64();
    let met = price - fill.side.sign() * conceded;
    better || (met.is_finite() && (met < low - room || met > high + room))
}
