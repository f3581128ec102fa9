//! How one order differs between two logs.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::market::{MoneyError, Quantity, Side};
use crate::sim2real::Timestamp;

use super::causes::{Cause, Split};
use super::{ClockDifference, Life};

/// How one order differs. Without the one or the other id it is in one log alone.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OrderDifference {
    /// What it trades.
    pub symbol: String,
    /// Currency of its prices, where a log says.
    pub currency: Option<String>,
    /// Which way.
    pub side: Side,
    /// Its id in the backtest.
    pub backtest: Option<String>,
    /// Its id in the paper log.
    pub paper: Option<String>,
    /// When it was decided, on the backtest's clock.
    pub at: Timestamp,
    /// By how much later the paper log has it, beyond the difference of clocks [s].
    pub decided_seconds: Option<f64>,
    /// By how much more was ordered in the paper log, as a fraction of the backtest's.
    pub ordered: Option<f64>,
    /// Whether its kind or its limit is another.
    pub another_kind: bool,
    /// By how much more was filled in the paper log, as a fraction of what the backtest ordered.
    pub filled: Option<f64>,
    /// By how much dearer it was executed in the paper log, against the order positive [bps].
    pub price_bps: Option<f64>,
    /// By how much later its first execution followed its decision in the paper log [s].
    pub delay_seconds: Option<f64>,
    /// By how much more fees were paid in the paper log [bps of what was traded].
    pub fee_bps: Option<f64>,
    /// What was traded in the paper log, or else in the backtest [currency].
    pub traded: f64,
    /// Profit and loss in the paper log less that in the backtest [currency].
    pub gap: f64,
    /// What made it [currency]; causes with nothing are left out.
    pub causes: BTreeMap<&'static str, f64>,
}

impl OrderDifference {
    pub(super) fn of_pair(before: &Life, after: &Life, clock: &ClockDifference, split: &Split) -> Result<Self, MoneyError> {
        let mut own = Self::of_one(Some(before), Some(after), clock, split)?;
        own.decided_seconds = Some(clock.on_backtest(after.at).seconds_since(before.at));
        let ordered = before.ordered.zip(after.ordered).filter(|(a, _)| *a > Quantity::ZERO);
        own.ordered = ordered.map(|(a, b)| (b - a).to_f64() / a.to_f64());
        own.another_kind = before.kind.as_ref().zip(after.kind.as_ref()).is_some_and(|(a, b)| a != b)
            || before.limit.zip(after.limit).is_some_and(|(a, b)| a != b);
        let whole = before.ordered.filter(|ordered| *ordered > Quantity::ZERO);
        own.filled = whole.map(|whole| (after.filled - before.filled).to_f64() / whole.to_f64());
        own.price_bps =
            before.average().zip(after.average()).map(|(was, is)| 1e4 * before.side.sign() * (is - was) / was.abs());
        let delay = |life: &Life| Some(life.first()?.seconds_since(life.at));
        own.delay_seconds = delay(before).zip(delay(after)).map(|(was, is)| is - was);
        let rate = |life: &Life| {
            let turnover = life.turnover();
            (turnover > 0.0).then(|| 1e4 * life.fees.to_f64() / turnover)
        };
        own.fee_bps = rate(before).zip(rate(after)).map(|(was, is)| is - was);
        Ok(own)
    }

    /// Of an order in one log alone, or of a pair of which nothing has been compared yet.
    pub(super) fn of_one(
        before: Option<&Life>,
        after: Option<&Life>,
        clock: &ClockDifference,
        split: &Split,
    ) -> Result<Self, MoneyError> {
        let life = before.or(after);
        let at = before.map(|life| life.at).or_else(|| after.map(|life| clock.on_backtest(life.at)));
        let amounts = Cause::ALL.into_iter().map(|cause| (cause.word(), split.of(cause).to_f64()));
        Ok(Self {
            symbol: life.map(|life| life.symbol.clone()).unwrap_or_default(),
            currency: [before, after].into_iter().flatten().find_map(|life| life.currency.clone()),
            side: life.map_or(Side::Buy, |life| life.side),
            backtest: before.map(|life| life.id.clone()),
            paper: after.map(|life| life.id.clone()),
            at: at.unwrap_or_default(),
            decided_seconds: None,
            ordered: None,
            another_kind: false,
            filled: None,
            price_bps: None,
            delay_seconds: None,
            fee_bps: None,
            traded: after.or(before).map_or(0.0, Life::turnover),
            gap: split.total()?.to_f64(),
            causes: amounts.filter(|(_, amount)| *amount != 0.0).collect(),
        })
    }

    /// What it is called in tables: both ids, or the one there is.
    #[must_use]
    pub fn name(&self) -> String {
        match (&self.backtest, &self.paper) {
            (Some(backtest), Some(paper)) if backtest == paper => backtest.clone(),
            (Some(backtest), Some(paper)) => format!("{backtest} = {paper}"),
            (Some(backtest), None) => format!("{backtest} (backtest alone)"),
            (None, paper) => format!("{} (paper alone)", paper.as_deref().unwrap_or_default()),
        }
    }

    /// Whether the two decided differently; `near` [s] is how far decisions of one time lie apart.
    #[must_use]
    pub fn parts_in_decision(&self, near: f64) -> bool {
        self.backtest.is_none()
            || self.paper.is_none()
            || self.another_kind
            || self.ordered.is_some_and(|ordered| ordered != 0.0)
            || self.decided_seconds.is_some_and(|seconds| seconds.abs() > near)
    }

    /// Whether what was decided alike was executed differently.
    #[must_use]
    pub fn parts_in_execution(&self) -> bool {
        /// Prices and fees that differ by less are the same, rounded otherwise [bps].
        const SAME: f64 = 1e-2;
        self.backtest.is_some()
            && self.paper.is_some()
            && (self.filled.is_some_and(|filled| filled != 0.0)
                || [self.price_bps, self.fee_bps].into_iter().flatten().any(|bps| bps.abs() > SAME))
    }
}
