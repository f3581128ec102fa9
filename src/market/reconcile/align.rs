//! Which order of one log is which of the other, without shared ids.

use std::collections::HashMap;

use crate::market::Side;

use super::{ClockDifference, Life};

/// Orders by their places: in the backtest, and in the paper log.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Alignment {
    /// Orders of both, in the order of the backtest's times.
    pub pairs: Vec<(usize, usize)>,
    /// Orders of the backtest that the paper log has not.
    pub only_backtest: Vec<usize>,
    /// Orders of the paper log that the backtest has not.
    pub only_paper: Vec<usize>,
}

/// What a pair is worth where nothing differs; below 0 both rather stay alone.
const WORTH: f64 = 6.0;
/// Candidates of an order on either side of its time at most.
const CANDIDATES: usize = 32;
/// The shortest time between two stamps that counts for anything [s].
const SHORTEST: f64 = 0.5;

/// Pairs up the orders of two logs: by symbol and side, and in the order of their times, which is the same in both. Of all such
/// pairings it is the one whose pairs are worth most together. A pair is worth less by the time between the two, beside how far
/// pairs of these logs lie apart; by the ratio of what was ordered; by another kind, and by another limit.
pub(super) fn align(backtest: &[Life], paper: &[Life], clock: &ClockDifference) -> Alignment {
    let mut alike: HashMap<(&str, Side), [Vec<usize>; 2]> = HashMap::new();
    for (which, orders) in [backtest, paper].into_iter().enumerate() {
        for (k, order) in orders.iter().enumerate() {
            alike.entry((order.symbol.as_str(), order.side)).or_default()[which].push(k);
        }
    }
    let unit = (4.0 * clock.spread).max(SHORTEST);
    let mut pairs: Vec<(usize, usize)> = Vec::new();
    for [own, other] in alike.values() {
        let times: Vec<f64> = other.iter().map(|k| clock.on_backtest(paper[*k].at).seconds_since(clock.origin)).collect();
        let candidates = |i: usize| -> Vec<(usize, f64)> {
            let order = &backtest[own[i]];
            let at = order.at.seconds_since(clock.origin);
            let middle = times.partition_point(|time| *time < at);
            let near = middle.saturating_sub(CANDIDATES)..(middle + CANDIDATES).min(times.len());
            let worth = |j: usize| WORTH - distance(order, &paper[other[j]], (times[j] - at).abs() / unit);
            near.map(|j| (j, worth(j))).filter(|(_, worth)| *worth > 0.0).collect()
        };
        pairs.extend(best_chain(own.len(), other.len(), candidates).into_iter().map(|(i, j)| (own[i], other[j])));
    }
    pairs.sort_unstable();
    let alone = |count: usize, of: fn(&(usize, usize)) -> usize| {
        let mut taken = vec![false; count];
        pairs.iter().for_each(|pair| taken[of(pair)] = true);
        (0..count).filter(|k| !taken[*k]).collect()
    };
    Alignment { only_backtest: alone(backtest.len(), |p| p.0), only_paper: alone(paper.len(), |p| p.1), pairs }
}

/// How unlike two orders are that lie `units` of time apart. Logarithms: what is far off already is hardly worse further off.
fn distance(one: &Life, other: &Life, units: f64) -> f64 {
    let sizes = one.ordered.zip(other.ordered).map_or(0.5, |(a, b)| {
        let ratio = b.to_f64().max(1e-9) / a.to_f64().max(1e-9);
        (2.0 * ratio.ln().abs()).min(4.0)
    });
    let kinds = if one.kind.as_ref().zip(other.kind.as_ref()).is_some_and(|(a, b)| a != b) { 1.0 } else { 0.0 };
    let limits = one.limit.zip(other.limit).map_or(0.0, |(a, b)| {
        let bps = 1e4 * (b.to_f64() / a.to_f64() - 1.0).abs();
        (bps / 10.0).min(2.0)
    });
    units.ln_1p() + sizes + kinds + limits
}

/// The chain of pairs, rising on both sides, that is worth most: of each `i` in turn the candidates `(j, worth)`. The best chain
/// that ends before `j` is kept in a Fenwick tree (Software: Practice and Experience 24 (1994)), so that it takes
/// O(pairs log n).
fn best_chain(own: usize, other: usize, candidates: impl Fn(usize) -> Vec<(usize, f64)>) -> Vec<(usize, usize)> {
    /// A pair, and the one before it in its chain.
    struct Link {
        pair: (usize, usize),
        before: Option<usize>,
    }
    let mut links: Vec<Link> = Vec::new();
    let mut best: Vec<(f64, Option<usize>)> = vec![(0.0, None); other + 1];
    for i in 0..own {
        let mut ends = Vec::new();
        for (j, worth) in candidates(i) {
            let (mut sum, mut before, mut node) = (0.0, None, j);
            while node > 0 {
                if best[node].0 > sum {
                    (sum, before) = best[node];
                }
                node &= node - 1;
            }
            links.push(Link { pair: (i, j), before });
            ends.push((j, sum + worth, links.len() - 1));
        }
        // Not before all candidates of `i` were tried, for it is in one pair alone.
        for (j, sum, link) in ends {
            let mut node = j + 1;
            while node <= other {
                if sum > best[node].0 {
                    best[node] = (sum, Some(link));
                }
                node += node & node.wrapping_neg();
            }
        }
    }
    let (mut node, mut sum, mut at) = (other, 0.0, None);
    while node > 0 {
        if best[node].0 > sum {
            (sum, at) = best[node];
        }
        node &= node - 1;
    }
    let mut chain = Vec::new();
    while let Some(link) = at.map(|k: usize| &links[k]) {
        chain.push(link.pair);
        at = link.before;
    }
    chain.reverse();
    chain
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The best chain by trying all.
    fn tried(i: usize, j: usize, own: usize, worth: &[Vec<f64>]) -> f64 {
        if i == own {
            return 0.0;
        }
        let mut best = tried(i + 1, j, own, worth);
        for (k, value) in worth[i].iter().enumerate().skip(j).filter(|(_, value)| **value > 0.0) {
            best = best.max(value + tried(i + 1, k + 1, own, worth));
        }
        best
    }

    proptest! {
        #[test]
        fn no_chain_is_worth_more(worth in proptest::collection::vec(proptest::collection::vec(-3.0..6.0_f64, 5), 0..6)) {
            let of = |i: usize| worth[i].iter().copied().enumerate().filter(|(_, w)| *w > 0.0).collect::<Vec<_>>();
            let chain = best_chain(worth.len(), 5, of);
            prop_assert!(chain.windows(2).all(|w| w[0].0 < w[1].0 && w[0].1 < w[1].1), "{:?}", chain);
            let sum: f64 = chain.iter().map(|(i, j)| worth[*i][*j]).sum();
            prop_assert!((sum - tried(0, 0, worth.len(), &worth)).abs() < 1e-9);
        }
    }
}
