//! The gap of profit and loss, and what made it.

use std::collections::BTreeMap;

use rand::RngExt;
use serde::Serialize;

use crate::market::{Cash, MoneyError, Price};
use crate::sim2real::Seed;

use super::causes::{Cause, Split};
use super::{Life, OrderDifference};

/// The gap in one currency. Amounts as texts are exact: those of the causes sum to the gap, and the gap is one worth less the
/// other, to the last unit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CurrencyGap {
    /// Currency of prices; none where the logs do not say.
    pub currency: Option<String>,
    /// Profit and loss of the backtest's orders.
    pub backtest: f64,
    /// The same, exactly.
    pub backtest_exact: String,
    /// Profit and loss of the paper log's orders.
    pub paper: f64,
    /// The same, exactly.
    pub paper_exact: String,
    /// The paper log's less the backtest's.
    pub gap: f64,
    /// The same, exactly.
    pub gap_exact: String,
    /// The gap [bps of what the backtest traded]; none where it traded nothing.
    pub gap_bps: Option<f64>,
    /// What made it, in the order in which it comes about; causes with nothing are left out.
    pub causes: Vec<CauseAmount>,
}

/// What one cause made of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CauseAmount {
    /// Which cause.
    pub cause: Cause,
    /// Its amount [currency].
    pub amount: f64,
    /// The same, exactly.
    pub amount_exact: String,
    /// 95 % interval of the amount, had there been other orders like these; none with fewer than 8 orders.
    pub ci95: Option<[f64; 2]>,
    /// Orders it is of.
    pub orders: usize,
}

/// Worth and turnover, currency by currency.
pub(super) type Worth = BTreeMap<Option<String>, (Cash, f64)>;

/// What orders are worth at the marks of their symbols.
pub(super) fn worth_by_currency(lives: &[Life], mark: impl Fn(&Life) -> Price) -> Result<Worth, MoneyError> {
    let mut worth = Worth::new();
    for life in lives {
        let own = worth.entry(life.currency.clone()).or_default();
        own.0 = own.0.plus(life.worth(mark(life))?)?;
        own.1 += life.turnover();
    }
    Ok(worth)
}

pub(super) fn gaps(
    backtest: &Worth,
    paper: &Worth,
    orders: &[(OrderDifference, Split)],
    seed: Seed,
) -> Result<Vec<CurrencyGap>, MoneyError> {
    // A log that says nothing of currencies is in that of the other, where there is but one.
    let mut currencies: Vec<&Option<String>> = backtest.keys().chain(paper.keys()).collect();
    currencies.sort();
    currencies.dedup();
    let told: Vec<&Option<String>> = currencies.iter().copied().filter(|currency| currency.is_some()).collect();
    let one = told.len() <= 1;
    let groups: Vec<Option<String>> =
        if one { vec![told.first().and_then(|only| (*only).clone())] } else { currencies.into_iter().cloned().collect() };
    let of = |worth: &Worth, group: &Option<String>| -> Result<(Cash, f64), MoneyError> {
        let own = worth.iter().filter(|(currency, _)| one || *currency == group);
        own.map(|(_, own)| *own).try_fold((Cash::ZERO, 0.0), |sum, own| Ok((sum.0.plus(own.0)?, sum.1 + own.1)))
    };
    let gap = |group: Option<String>| {
        let ((was, traded), (is, _)) = (of(backtest, &group)?, of(paper, &group)?);
        let own: Vec<&Split> =
            orders.iter().filter(|(order, _)| one || order.currency == group).map(|(_, split)| split).collect();
        let gap = is.minus(was)?;
        Ok(CurrencyGap {
            backtest: was.to_f64(),
            backtest_exact: was.to_string(),
            paper: is.to_f64(),
            paper_exact: is.to_string(),
            gap: gap.to_f64(),
            gap_exact: gap.to_string(),
            gap_bps: (traded > 0.0).then(|| 1e4 * gap.to_f64() / traded),
            causes: amounts(&own, seed)?,
            currency: group,
        })
    };
    groups.into_iter().map(gap).collect()
}

fn amounts(orders: &[&Split], seed: Seed) -> Result<Vec<CauseAmount>, MoneyError> {
    let mut all = Split::default();
    orders.iter().try_for_each(|split| all.merge(split))?;
    let intervals = intervals(orders, seed);
    let amount = |(k, cause): (usize, Cause)| {
        let touched = orders.iter().filter(|split| split.of(cause) != Cash::ZERO).count();
        (touched > 0).then(|| CauseAmount {
            cause,
            amount: all.of(cause).to_f64(),
            amount_exact: all.of(cause).to_string(),
            ci95: intervals.as_ref().map(|intervals| intervals[k]),
            orders: touched,
        })
    };
    Ok(Cause::ALL.into_iter().enumerate().filter_map(amount).collect())
}

/// Draws of the bootstrap.
const DRAWS: usize = 500;
/// Blocks at most; more neighbours go together where there are more orders.
const BLOCKS: usize = 250;
/// The fewest orders of which an interval means anything.
const FEWEST: usize = 8;

/// 95 % intervals of the sums, cause by cause, by a bootstrap of blocks of neighbouring orders (Künsch, Annals of Statistics 17
/// (1989)).
fn intervals(orders: &[&Split], seed: Seed) -> Option<Vec<[f64; 2]>> {
    if orders.len() < FEWEST {
        return None;
    }
    let mut rng = seed.stream("reconcile bootstrap");
    let length = orders.len().div_ceil(BLOCKS);
    let blocks: Vec<Vec<f64>> = orders
        .chunks(length)
        .map(|block| Cause::ALL.map(|cause| block.iter().map(|split| split.of(cause).to_f64()).sum()).to_vec())
        .collect();
    // The last block may be shorter: sums are of as many orders as there are, on average.
    let mut sums: Vec<Vec<f64>> = vec![Vec::with_capacity(DRAWS); Cause::ALL.len()];
    for _ in 0..DRAWS {
        let mut sum = [0.0; Cause::ALL.len()];
        for _ in 0..blocks.len() {
            let block = &blocks[rng.random_range(0..blocks.len())];
            sum.iter_mut().zip(block).for_each(|(sum, amount)| *sum += amount);
        }
        sums.iter_mut().zip(sum).for_each(|(sums, sum)| sums.push(sum));
    }
    let interval = |mut sums: Vec<f64>| {
        sums.sort_by(f64::total_cmp);
        [sums[DRAWS / 40], sums[DRAWS - 1 - DRAWS / 40]]
    };
    Some(sums.into_iter().map(interval).collect())
}
