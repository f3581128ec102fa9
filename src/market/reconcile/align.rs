//! Which order of one log is which of the other, without shared ids.

use std::collections::HashMap;

use crate::market::Side;

use super::clock::median;
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

/// Candidates of an order on either side of its time at most.
const CANDIDATES: usize = 32;
/// The shortest time between two stamps that counts for anything [s].
const SHORTEST: f64 = 0.5;
/// Most that can speak against a pair by what was ordered.
const OTHER_SIZE: f64 = 3.0;

/// Pairs up the orders of two logs: by symbol and side, and in the order of their times, which is the same in both. Of all such
/// pairings it is the one whose pairs are worth most together. What a pair is worth is, in logarithms, how much likelier two
/// such orders are one than two that came so near by chance: so the rarer orders are, the further apart a pair may lie. Against
/// it speak another ratio of sizes than is usual, another kind, and another limit.
pub(super) fn align(backtest: &[Life], paper: &[Life], clock: &ClockDifference) -> Alignment {
    let mut alike: HashMap<(&str, Side), [Vec<usize>; 2]> = HashMap::new();
    for (which, orders) in [backtest, paper].into_iter().enumerate() {
        for (k, order) in orders.iter().enumerate() {
            alike.entry((order.symbol.as_str(), order.side)).or_default()[which].push(k);
        }
    }
    let stamps = |of: &[usize]| -> Vec<f64> {
        of.iter().map(|k| clock.on_backtest(paper[*k].at).seconds_since(clock.origin)).collect()
    };
    let groups: Vec<Group<'_>> = alike
        .values()
        .map(|[own, other]| Group { own, other, times: stamps(other), backtest, paper, clock })
        .filter(|group| !group.own.is_empty() && !group.other.is_empty())
        .collect();
    let usual = median(groups.iter().flat_map(Group::ratios));
    let mut pairs: Vec<(usize, usize)> = groups.iter().flat_map(|group| group.pairs(usual)).collect();
    pairs.sort_unstable();
    let alone = |count: usize, of: fn(&(usize, usize)) -> usize| {
        let mut taken = vec![false; count];
        pairs.iter().for_each(|pair| taken[of(pair)] = true);
        (0..count).filter(|k| !taken[*k]).collect()
    };
    Alignment { only_backtest: alone(backtest.len(), |p| p.0), only_paper: alone(paper.len(), |p| p.1), pairs }
}

/// Orders of one symbol and side, by their places in the logs.
struct Group<'a> {
    own: &'a [usize],
    other: &'a [usize],
    /// Times of the paper log's, on the backtest's clock [s].
    times: Vec<f64>,
    backtest: &'a [Life],
    paper: &'a [Life],
    clock: &'a ClockDifference,
}

impl Group<'_> {
    fn at(&self, i: usize) -> f64 {
        self.backtest[self.own[i]].at.seconds_since(self.clock.origin)
    }

    /// Logarithms of the ratios of what was ordered, each order with the nearest in time.
    fn ratios(&self) -> impl Iterator<Item = f64> {
        (0..self.own.len()).filter_map(|i| {
            let at = self.at(i);
            let behind = self.times.partition_point(|time| *time < at);
            let near = [behind.checked_sub(1), (behind < self.times.len()).then_some(behind)].into_iter().flatten();
            let nearest = near.min_by(|a, b| (self.times[*a] - at).abs().total_cmp(&(self.times[*b] - at).abs()))?;
            ratio(&self.backtest[self.own[i]], &self.paper[self.other[nearest]])
        })
    }

    fn pairs(&self, usual: f64) -> Vec<(usize, usize)> {
        let unit = (4.0 * self.clock.spread).max(SHORTEST);
        let count = self.own.len().max(self.other.len()) as f64;
        let ends = [self.at(0), self.at(self.own.len() - 1), self.times[0], self.times[self.times.len() - 1]];
        let span = ends.iter().fold(f64::MIN, |a, b| a.max(*b)) - ends.iter().fold(f64::MAX, |a, b| a.min(*b));
        let rare = (span / count / unit).max(1.0).ln().clamp(1.0, 12.0) + 1.0;
        let candidates = |i: usize| -> Vec<(usize, f64)> {
            let (order, at) = (&self.backtest[self.own[i]], self.at(i));
            let middle = self.times.partition_point(|time| *time < at);
            let near = middle.saturating_sub(CANDIDATES)..(middle + CANDIDATES).min(self.times.len());
            let worth = |j: usize| {
                let units = (self.times[j] - at).abs() / unit;
                rare - 2.0 * units.ln_1p() - unlikeness(order, &self.paper[self.other[j]], usual)
            };
            near.map(|j| (j, worth(j))).filter(|(_, worth)| *worth > 0.0).collect()
        };
        let chain = best_chain(self.own.len(), self.other.len(), candidates);
        chain.into_iter().map(|(i, j)| (self.own[i], self.other[j])).collect()
    }
}

fn ratio(one: &Life, other: &Life) -> Option<f64> {
    let (a, b) = one.ordered.zip(other.ordered)?;
    (a.0 > 0 && b.0 > 0).then(|| (b.0 as f64 / a.0 as f64).ln())
}

/// How unlike two orders are but for their times, where the ratio of sizes usually has the logarithm `usual`.
fn unlikeness(one: &Life, other: &Life, usual: f64) -> f64 {
    let sizes = ratio(one, other).map_or(0.5, |ratio| (2.0 * (ratio - usual).abs()).min(OTHER_SIZE));
    let kinds = if one.kind.as_ref().zip(other.kind.as_ref()).is_some_and(|(a, b)| a != b) { 1.0 } else { 0.0 };
    let limits = one.limit.zip(other.limit).map_or(0.0, |(a, b)| {
        let bps = 1e4 * (b.to_f64() / a.to_f64() - 1.0).abs();
        (bps / 10.0).min(2.0)
    });
    sizes + kinds + limits
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
