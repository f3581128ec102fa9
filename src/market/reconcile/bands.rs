//! Whether a paper log lies within what the market showed while its orders were under way.

use serde::Serialize;

use crate::market::{Price, Side};

use super::{Life, Showing};

/// Executions beside the range of prices from decision to execution.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Bands {
    /// Executions for whose time the data know a range.
    pub executions: usize,
    /// Of these, within it.
    pub inside: usize,
    /// Cheaper for the order than anything that was shown.
    pub better: usize,
    /// Dearer for the order than anything that was shown.
    pub worse: usize,
    /// Executions for whose time the data know nothing.
    pub unknown: usize,
    /// Profit and loss of the known ones had each been at the worst price of its time [currency], before fees.
    pub pessimistic: f64,
    /// What it was, before fees [currency].
    pub paper: f64,
    /// The same at the best prices [currency].
    pub optimistic: f64,
    /// The first executions outside, by order, price and range.
    pub outside: Vec<Outside>,
}

/// An execution outside what was shown.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Outside {
    /// Its order in the paper log.
    pub order: String,
    /// When, on the paper log's clock.
    pub at: String,
    /// Its price.
    pub price: f64,
    /// Lowest price that was shown.
    pub low: f64,
    /// Highest price that was shown.
    pub high: f64,
}

/// How many are listed.
const LISTED: usize = 20;

pub(super) fn bands(paper: &[Life], showing: &dyn Showing, mark: impl Fn(&Life) -> Price) -> Option<Bands> {
    let mut bands = Bands {
        executions: 0,
        inside: 0,
        better: 0,
        worse: 0,
        unknown: 0,
        pessimistic: 0.0,
        paper: 0.0,
        optimistic: 0.0,
        outside: Vec::new(),
    };
    for life in paper {
        for piece in &life.pieces {
            let Some([low, high]) = showing.band(&life.symbol, life.at.min(piece.at), piece.at) else {
                bands.unknown += 1;
                continue;
            };
            bands.executions += 1;
            let (best, worst) = if life.side == Side::Buy { (low, high) } else { (high, low) };
            let gain = |price: Price| {
                life.side.sign()
                    * piece.quantity.to_f64()
                    * life.multiplier.get() as f64
                    * (mark(life).to_f64() - price.to_f64())
            };
            bands.pessimistic += gain(worst);
            bands.paper += gain(piece.price);
            bands.optimistic += gain(best);
            if low <= piece.price && piece.price <= high {
                bands.inside += 1;
                continue;
            }
            let better = (life.side == Side::Buy) == (piece.price < low);
            *(if better { &mut bands.better } else { &mut bands.worse }) += 1;
            if bands.outside.len() < LISTED {
                let [price, low, high] = [piece.price, low, high].map(Price::to_f64);
                bands.outside.push(Outside { order: life.id.clone(), at: piece.at.to_string(), price, low, high });
            }
        }
    }
    (bands.executions > 0).then_some(bands)
}
