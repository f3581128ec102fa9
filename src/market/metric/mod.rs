//! What a backtest came to, in figures. A figure that is not defined for a run is none, never NaN or infinity.

mod cost;
mod currency_summary;
mod daily_return;
mod drawdown;
mod fill_bands;
mod moment;
mod month;
mod returns;
mod round_trip;
mod sharpe;
mod tail;
mod trading;

use serde::Serialize;

use super::{Fill, Held, Income, Instrument, MoneyError, Position, Price, Record, Sender, Status};
use daily_return::{DailyReturns, closes, years};

pub use cost::Costs;
pub use currency_summary::{ChargeSummary, CurrencySummary};
pub use drawdown::{Drawdown, Drawdowns};
pub use fill_bands::FillBands;
pub use month::Month;
pub use returns::Returns;
pub use round_trip::RoundTrip;
pub use sharpe::{deflated_sharpe, expected_largest_sharpe, probabilistic_sharpe, sharpe_standard_error};
pub use trading::Trading;

/// The figures of a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Metrics {
    /// Cash at the start [currency].
    pub initial_equity: f64,
    /// Cash and positions at the end [currency].
    pub final_equity: f64,
    /// `final_equity / initial_equity - 1` (a fraction).
    pub total_return: Option<f64>,
    /// Return a year of 365.25 days, compounded (a fraction); none where [`Returns::make_a_year`] says no.
    pub cagr: Option<f64>,
    /// Volatility, Sharpe ratio and the other figures of daily returns, with the number of returns they rest on.
    #[serde(flatten)]
    pub returns: Returns,
    /// The deepest fall from an earlier high; none where equity never fell.
    pub max_drawdown: Option<Drawdown>,
    /// `cagr` over the depth of `max_drawdown`, over the whole run.
    ///
    /// Source: Young, "Calmar ratio: a smoother tool", Futures 20 (1991), there over three years.
    pub calmar: Option<f64>,
    /// The deepest falls, at most [`Drawdowns::KEPT`], the deepest first; they do not overlap.
    pub drawdowns: Vec<Drawdown>,
    /// The longest time from a high to its recovery, or else to the end [s]; none where equity never fell.
    pub longest_under_water: Option<f64>,
    /// Root of the mean square of the drawdowns at the ends of days (a fraction).
    ///
    /// Source: Martin and McCann, "The investor's guide to Fidelity funds" (1989), there in percent.
    pub ulcer_index: Option<f64>,
    /// Value traded, both ways, over mean equity.
    pub turnover: Option<f64>,
    /// The same a year of 365.25 days; none where [`Returns::make_a_year`] says no.
    pub turnover_per_year: Option<f64>,
    /// Part of all events at which something was held.
    pub exposure: Option<f64>,
    /// Mean over all events of what was held, short positions counted as positive, over equity.
    pub mean_leverage: Option<f64>,
    /// Part of the fills that closed something which gained after their own fee.
    pub hit_rate: Option<f64>,
    /// What round trips came to.
    pub trading: Trading,
    /// Gain on what was closed, at average cost, before fees [currency].
    pub realised: f64,
    /// Gain on what is still held, at its last price, before fees [currency].
    pub unrealised: f64,
    /// What was charged for holding, such as borrow fees and funding; negative where it paid [currency].
    pub charges: f64,
    /// Dividends received before tax, less those paid on short positions [currency].
    pub dividends: f64,
    /// Tax withheld from them [currency].
    pub withheld: f64,
    /// What trading cost.
    pub costs: Costs,
    /// Equity at the end with each fill at the best and at the worst price of its time.
    pub fill_bands: FillBands,
}

/// How many of everything there was.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Counts {
    /// Events: bars and quotes.
    pub events: usize,
    /// Orders sent.
    pub orders: usize,
    /// Orders filled whole.
    pub filled: usize,
    /// Orders of which some was cancelled, because there was no volume for it.
    pub cancelled: usize,
    /// Orders that were under way when the data ended.
    pub unfilled: usize,
    /// Orders the venue refused: post-only ones that would have taken, those to be filled whole that could not be,
    /// those that could not wait and came while the market was closed.
    pub refused_by_venue: usize,
    /// Orders whose time was over before they were filled whole.
    pub expired: usize,
    /// Orders that waited for a price.
    pub resting: usize,
    /// Bars within which orders waited on both sides of the open, so that a rule decided which was met first.
    pub ambiguous_bars: usize,
    /// Fills.
    pub fills: usize,
    /// Orders the broker sent to close what the account could not carry; they are among the orders.
    pub broker_orders: usize,
    /// How often equity fell below maintenance margin.
    pub margin_calls: usize,
    /// Dividends and splits.
    pub corporate_actions: usize,
    /// Orders refused before they were sent, by reason.
    pub rejected: std::collections::BTreeMap<super::Reason, usize>,
}

impl Counts {
    /// The counts of `record`.
    #[must_use]
    pub fn of(record: &Record) -> Self {
        let blotter = &record.blotter;
        Self {
            events: record.held.events,
            orders: blotter.orders.len(),
            filled: blotter.count(Status::Filled),
            cancelled: blotter.count(Status::Cancelled),
            unfilled: blotter.count(Status::Unfilled),
            refused_by_venue: blotter.count(Status::Rejected),
            expired: blotter.count(Status::Expired),
            resting: blotter.orders.iter().filter(|order| order.kind != super::OrderKind::Market).count(),
            ambiguous_bars: record.held.ambiguous_bars,
            fills: blotter.fills.len(),
            broker_orders: blotter.orders.iter().filter(|order| order.sender == Sender::Broker).count(),
            margin_calls: record.account.margin_calls.len(),
            corporate_actions: record.account.actions.len(),
            rejected: blotter.rejected.clone(),
        }
    }
}

impl Metrics {
    /// The figures of `record`.
    ///
    /// # Errors
    /// If an amount of cash is beyond what can be held.
    pub fn of(record: &Record) -> Result<Self, MoneyError> {
        let initial = record.ledger.opening().to_f64();
        let last = record.ledger.equity()?.to_f64();
        let points = &record.equity;
        let years = match (points.first(), points.last()) {
            (Some(first), Some(last)) => years(first.time, last.time),
            _ => 0.0,
        };
        let growth = if initial > 0.0 { defined(last / initial) } else { None };
        let traded: f64 = record.blotter.fills.iter().map(|fill| value(record, fill)).sum();
        let (mut realised, mut unrealised) = (0.0, 0.0);
        for position in record.ledger.positions() {
            let rate = record.rate_of(position.currency);
            realised += position.realised.to_f64() * rate;
            unrealised += position.value().minus(position.basis)?.to_f64() * rate;
        }
        let (dividends, withheld) = dividends(record);
        let Held { events, invested, leverage, .. } = record.held;
        let per_event = |sum: f64| if events > 0 { Some(sum / events as f64) } else { None };
        let days = closes(points);
        let returns = Returns::of_daily(&DailyReturns::of(&days));
        let yearly = returns.make_a_year();
        let Drawdowns { deepest: drawdowns, longest } = Drawdowns::of(initial, points);
        let cagr = growth.filter(|g| *g > 0.0 && yearly).and_then(|g| defined(g.powf(1.0 / years) - 1.0));
        let mean_equity = record.held.mean_equity.filter(|mean| *mean > 0.0);
        let turnover = mean_equity.and_then(|mean| defined(traded / mean));
        let max_drawdown = drawdowns.first().copied();
        Ok(Self {
            initial_equity: initial,
            final_equity: last,
            total_return: growth.map(|g| g - 1.0),
            cagr,
            returns,
            max_drawdown,
            calmar: cagr.zip(max_drawdown).and_then(|(cagr, fall)| defined(cagr / fall.depth)),
            drawdowns,
            longest_under_water: longest,
            ulcer_index: drawdown::ulcer_index(initial, &days),
            turnover,
            turnover_per_year: turnover.filter(|_| yearly).and_then(|turnover| defined(turnover / years)),
            exposure: per_event(invested as f64),
            mean_leverage: per_event(leverage),
            hit_rate: hit_rate(&record.blotter.fills),
            trading: Trading::of(&RoundTrip::of(record)?),
            realised,
            unrealised,
            charges: charges(record)?,
            dividends,
            withheld,
            costs: Costs::of(record),
            fill_bands: FillBands::of(record)?,
        })
    }
}

fn hit_rate(fills: &[Fill]) -> Option<f64> {
    let gains: Vec<bool> = fills.iter().filter_map(|fill| fill.realised.map(|gain| gain > fill.fee)).collect();
    let hits = gains.iter().filter(|hit| **hit).count();
    defined(hits as f64 / gains.len() as f64)
}

/// What was charged for holding [currency].
fn charges(record: &Record) -> Result<f64, MoneyError> {
    let all = record.ledger.income().iter().zip(record.ledger.positions());
    let one = |(income, position): (&Income, &Position)| -> Result<f64, MoneyError> {
        Ok(income.charges.total()?.to_f64() * record.rate_of(position.currency))
    };
    let held = all.map(one).try_fold(0.0, |sum, charge| Ok::<_, MoneyError>(sum + charge?))?;
    let on_cash = record.ledger.balances().iter().enumerate();
    on_cash
        .map(|(k, balance)| Ok(balance.charges.total()?.to_f64() * record.rate_of(k)))
        .try_fold(held, |sum, charge| Ok(sum + charge?))
}

/// Dividends before tax and tax withheld [currency].
fn dividends(record: &Record) -> (f64, f64) {
    let all = record.ledger.income().iter().zip(record.ledger.positions());
    all.fold((0.0, 0.0), |(dividends, withheld), (income, position)| {
        let rate = record.rate_of(position.currency);
        (dividends + income.dividends.to_f64() * rate, withheld + income.withheld.to_f64() * rate)
    })
}

/// What a fill was worth at its rate [currency].
fn value(record: &Record, fill: &Fill) -> f64 {
    (fill.price * fill.quantity).to_f64() * record.worth_of_one(fill)
}

impl Record {
    /// What one unit of a currency is worth at the end [currency of the run]; 0 where it has no rate.
    #[must_use]
    pub fn rate_of(&self, currency: usize) -> f64 {
        match self.ledger.balances().get(currency) {
            Some(balance) if currency > 0 => balance.rate.map_or(0.0, Price::to_f64),
            _ => 1.0,
        }
    }

    /// What one unit at a price of 1 was worth when `fill` was made [currency of the run].
    fn worth_of_one(&self, fill: &Fill) -> f64 {
        let terms = self.ledger.terms().get(fill.instrument).copied().unwrap_or_default();
        fill.rate * terms.multiplier.get() as f64
    }
}

/// The number, where it is one.
fn defined(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

/// What one instrument came to; amounts are in its own currency.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InstrumentSummary {
    /// Symbol.
    pub symbol: String,
    /// Its currency, where the run has several.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub currency: Option<String>,
    /// Held at the end [units], negative when short.
    pub position: f64,
    /// Gain on what was closed, before fees [currency].
    pub realised: f64,
    /// Gain on what is held, before fees [currency].
    pub unrealised: f64,
    /// Fees [currency].
    pub fees: f64,
    /// Dividends before tax, less those paid when short [currency].
    pub dividends: f64,
    /// Tax withheld from them [currency].
    pub withheld: f64,
    /// Charged for holding [currency].
    pub charges: f64,
    /// Number of fills.
    pub fills: usize,
    /// Rows from outside the sessions of its calendar, which no order met; none where it has no calendar.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rows_outside_sessions: Option<usize>,
}

impl InstrumentSummary {
    /// One summary an instrument.
    ///
    /// # Errors
    /// If an amount of cash is beyond what can be held.
    pub fn of(record: &Record, instruments: &[Instrument]) -> Result<Vec<Self>, MoneyError> {
        let ledger = &record.ledger;
        let held = ledger.positions().iter().zip(ledger.income()).zip(instruments).enumerate();
        held.map(|(k, ((position, income), instrument))| {
            Ok(Self {
                symbol: instrument.symbol.clone(),
                currency: record.account.currencies.get(position.currency).cloned(),
                position: position.quantity.to_f64(),
                realised: position.realised.to_f64(),
                unrealised: position.value().to_f64() - position.basis.to_f64(),
                fees: position.fees.to_f64(),
                dividends: income.dividends.to_f64(),
                withheld: income.withheld.to_f64(),
                charges: income.charges.total()?.to_f64(),
                fills: record.blotter.fills.iter().filter(|fill| fill.instrument == k).count(),
                rows_outside_sessions: record.outside.get(k).copied().flatten(),
            })
        })
        .collect()
    }
}

#[cfg(test)]
mod tests {
    use crate::market::EquityPoint;
    use crate::sim2real::Timestamp;

    /// Equity every `spacing` nanoseconds.
    pub(super) fn curve(spacing: i64, values: &[f64]) -> Vec<EquityPoint> {
        let point = |(k, v): (usize, &f64)| EquityPoint { time: Timestamp((k as i64 + 1) * spacing), equity: *v };
        values.iter().enumerate().map(point).collect()
    }
}
