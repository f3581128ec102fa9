//! A backtest beside a paper log, order by order.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::market::{Cash, MoneyError, Price};
use crate::sim2real::Seed;

use super::align::align;
use super::bands::{Bands, bands};
use super::causes::{self, Cause, Split, Unknown, last_price};
use super::clock::{ClockDifference, clock_difference};
use super::difference::OrderDifference;
use super::divergence::{Divergence, first_divergence};
use super::gap::{CurrencyGap, gaps, worth_by_currency};
use super::{Checked, Life, Lives, Showing, Tolerance};

/// What is compared.
#[derive(Clone, Copy)]
pub struct Compared<'a> {
    /// The orders of the backtest.
    pub backtest: &'a Lives,
    /// The orders of the paper log.
    pub paper: &'a Lives,
    /// The orders of the paper log as the backtest's own simulator executes them, in the same order; none where it could not.
    pub replayed: Option<&'a [Option<Life>]>,
    /// The market they met.
    pub showing: Option<&'a dyn Showing>,
    /// Seed of the bootstrap.
    pub seed: Seed,
}

/// How many orders there are of each sort.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct ReconcileCounts {
    /// Orders of the backtest.
    pub backtest: usize,
    /// Orders of the paper log.
    pub paper: usize,
    /// Orders that are in both.
    pub pairs: usize,
    /// Orders that the backtest alone has.
    pub only_backtest: usize,
    /// Orders that the paper log alone has.
    pub only_paper: usize,
}

/// A backtest beside a paper log: `reconcile.json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Reconciliation {
    /// [`Reconciliation::SCHEMA`].
    pub schema: &'static str,
    /// What was found, in a few sentences.
    pub summary: String,
    /// How many orders.
    pub counts: ReconcileCounts,
    /// How the clocks differ.
    pub clock: ClockDifference,
    /// Whether the paper log's orders were executed by the backtest's simulator, so that decision and execution are told apart.
    pub replayed: bool,
    /// The gap of profit and loss, currency by currency, and what made it.
    pub gaps: Vec<CurrencyGap>,
    /// Where decisions part first.
    pub first_decision: Option<Divergence>,
    /// Where executions part first.
    pub first_execution: Option<Divergence>,
    /// Whether the paper log lies within what the market showed.
    pub bands: Option<Bands>,
    /// The price each symbol is valued at [its currency].
    pub marks: BTreeMap<String, f64>,
    /// Order by order, in the order of time.
    pub orders: Vec<OrderDifference>,
    /// What a reader should know.
    pub notes: Vec<String>,
}

impl Reconciliation {
    /// The schema, with its version.
    pub const SCHEMA: &'static str = "trueup.reconcile/1";

    /// Each bound of `tolerance` that is set, and what was found.
    #[must_use]
    pub fn checked(&self, tolerance: &Tolerance) -> Vec<Checked> {
        let set = tolerance.bounds().into_iter().filter_map(|(key, bound)| Some((key, bound?)));
        set.map(|(key, bound)| {
            let (found, order) = self.largest(key);
            // What cannot be compared is not beyond a bound, but for a log without a single pair.
            let holds = found.map_or(self.counts.pairs > 0 || self.orders.is_empty(), |found| found <= bound);
            Checked { key, bound, found, holds, order }
        })
        .collect()
    }

    /// The largest of what a bound is about, and the order it is of.
    fn largest(&self, key: &str) -> (Option<f64>, Option<String>) {
        let of_orders = |of: fn(&OrderDifference) -> Option<f64>| {
            let all = self.orders.iter().filter_map(|order| Some((of(order)?.abs(), order)));
            all.max_by(|a, b| a.0.total_cmp(&b.0)).map_or((None, None), |(found, order)| (Some(found), Some(order.name())))
        };
        let counts = &self.counts;
        match key {
            "unmatched" => {
                let all = counts.pairs + counts.only_backtest + counts.only_paper;
                let alone = counts.only_backtest + counts.only_paper;
                ((all > 0).then(|| alone as f64 / all as f64), None)
            }
            "decided_seconds" => of_orders(|order| order.decided_seconds),
            "ordered" => of_orders(|order| order.ordered),
            "filled" => of_orders(|order| order.filled),
            "price_bps" => of_orders(|order| order.price_bps),
            "mean_price_bps" => (self.mean_price_bps().map(f64::abs), None),
            "fee_bps" => of_orders(|order| order.fee_bps),
            "delay_seconds" => of_orders(|order| order.delay_seconds),
            "gap" => (self.gaps.iter().map(|gap| gap.gap.abs()).reduce(f64::max), None),
            _ => (self.gaps.iter().filter_map(|gap| gap.gap_bps).map(f64::abs).reduce(f64::max), None),
        }
    }

    /// Mean difference of average prices, weighted by what was filled; the paper log dearer positive [bps].
    #[must_use]
    pub fn mean_price_bps(&self) -> Option<f64> {
        let (sum, weight) = self.orders.iter().fold((0.0, 0.0), |(sum, weight), order| match order.price_bps {
            Some(bps) => (sum + bps * order.traded, weight + order.traded),
            None => (sum, weight),
        });
        (weight > 0.0).then(|| sum / weight)
    }
}

/// Compares a backtest with a paper log.
///
/// # Errors
/// If 128 bits do not hold a sum.
pub fn reconcile(compared: &Compared<'_>) -> Result<Reconciliation, MoneyError> {
    let (backtest, paper) = (compared.backtest.orders.as_slice(), compared.paper.orders.as_slice());
    let clock = clock_difference(backtest, paper);
    let alignment = align(backtest, paper, &clock);
    let marks = marks(compared);
    let showing: &dyn Showing = compared.showing.unwrap_or(&Unknown);
    let mark = |life: &Life| marks.get(life.symbol.as_str()).copied().unwrap_or_default();
    let executed = |place: usize| compared.replayed.and_then(|replayed| replayed.get(place)?.as_ref());

    let mut accounted: Vec<(OrderDifference, Split)> = Vec::new();
    for (i, j) in &alignment.pairs {
        let (before, after, mut split) = (&backtest[*i], &paper[*j], Split::default());
        match executed(*j) {
            Some(own) => {
                causes::of_decision(before, own, mark(before), &mut split)?;
                causes::of_execution(own, after, mark(before), showing, &mut split)?;
            }
            None => causes::of_both(before, after, mark(before), showing, &mut split)?,
        }
        accounted.push((OrderDifference::of_pair(before, after, &clock, &split)?, split));
    }
    for i in &alignment.only_backtest {
        let (life, mut split) = (&backtest[*i], Split::default());
        split.add(Cause::Signal, Cash::ZERO.minus(life.worth(mark(life))?)?)?;
        accounted.push((OrderDifference::of_one(Some(life), None, &clock, &split)?, split));
    }
    for j in &alignment.only_paper {
        let (life, mut split) = (&paper[*j], Split::default());
        match executed(*j) {
            Some(own) => {
                split.add(Cause::Signal, own.worth(mark(life))?)?;
                causes::of_execution(own, life, mark(life), showing, &mut split)?;
            }
            None => split.add(Cause::Signal, life.worth(mark(life))?)?,
        }
        accounted.push((OrderDifference::of_one(None, Some(life), &clock, &split)?, split));
    }
    accounted.sort_by(|(a, _), (b, _)| {
        a.at.cmp(&b.at).then_with(|| a.symbol.cmp(&b.symbol)).then_with(|| a.name().cmp(&b.name()))
    });

    let counts = ReconcileCounts {
        backtest: backtest.len(),
        paper: paper.len(),
        pairs: alignment.pairs.len(),
        only_backtest: alignment.only_backtest.len(),
        only_paper: alignment.only_paper.len(),
    };
    let worth = [backtest, paper].map(|lives| worth_by_currency(lives, mark));
    let [of_backtest, of_paper] = worth;
    let gaps = gaps(&of_backtest?, &of_paper?, &accounted, compared.seed)?;
    let orders: Vec<OrderDifference> = accounted.into_iter().map(|(order, _)| order).collect();
    let (first_decision, first_execution) = first_divergence(&orders, backtest, paper, &clock);
    let mut found = Reconciliation {
        schema: Reconciliation::SCHEMA,
        summary: String::new(),
        counts,
        clock,
        replayed: compared.replayed.is_some(),
        gaps,
        first_decision,
        first_execution,
        bands: compared.showing.and_then(|showing| bands(paper, showing, mark)),
        marks: marks.iter().map(|(symbol, mark)| ((*symbol).to_owned(), mark.to_f64())).collect(),
        orders,
        notes: notes(compared),
    };
    found.summary = super::words::summary(&found);
    Ok(found)
}

/// The price each symbol is valued at: the last the data know, or else the last execution of either log. With nothing held at the
/// end it does not matter.
fn marks<'a>(compared: &Compared<'a>) -> BTreeMap<&'a str, Price> {
    let logs = [compared.backtest.orders.as_slice(), compared.paper.orders.as_slice()];
    let mut marks = BTreeMap::new();
    for life in logs.into_iter().flatten() {
        marks.entry(life.symbol.as_str()).or_insert_with(|| {
            let known = compared.showing.and_then(|showing| showing.last(&life.symbol));
            known.or_else(|| last_price(&life.symbol, logs)).unwrap_or_default()
        });
    }
    marks
}

fn notes(compared: &Compared<'_>) -> Vec<String> {
    let of =
        |name: &str, lives: &Lives| -> Vec<String> { lives.notes.iter().map(|note| format!("{name}: {note}")).collect() };
    let mut notes = of("backtest", compared.backtest);
    notes.extend(of("paper log", compared.paper));
    if compared.replayed.is_none() {
        notes.push(
            "decision and execution of an order are told apart by what the backtest's own simulator makes of the paper log's \
             orders: give the run (--run RUN.toml)"
                .to_owned(),
        );
    }
    notes
}
