//! What our own orders took of the volume that is there: a replayed market goes on to show it.

use crate::market::{Price, Side};

/// What was taken of the volume that is there now.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Taken {
    /// By buyers, and by sellers [units].
    size: [f64; 2],
    /// The best price it was taken from, and what was displayed there.
    best: [Option<(Price, f64)>; 2],
    /// Buyers and sellers share it, as they do the volume of a bar.
    shared: bool,
}

fn place(side: Side) -> usize {
    usize::from(side == Side::Sell)
}

impl Taken {
    /// Nothing yet of a bar, whose volume buyers and sellers share.
    pub fn of_bars() -> Self {
        Self { shared: true, ..Self::default() }
    }

    /// What is no longer there for an order of `side` [units].
    pub fn by(&self, side: Side) -> f64 {
        if self.shared { self.size.iter().sum() } else { self.size[place(side)] }
    }

    pub fn is_nothing(&self) -> bool {
        self.size == [0.0; 2]
    }

    /// An order of `side` takes `size` [units].
    pub fn add(&mut self, side: Side, size: f64) {
        self.size[place(side)] += size;
    }

    /// What an order of `side` took, it took from this best price, with so much displayed.
    pub fn from(&mut self, side: Side, best: Option<(Price, f64)>) {
        self.best[place(side)] = best;
    }

    /// What orders of `side` took is there again where the best price is another, or more is displayed there.
    pub fn refresh(&mut self, side: Side, best: Option<(Price, f64)>) {
        let still = self.best[place(side)]
            .zip(best)
            .is_some_and(|((price, size), (now, displayed))| now == price && displayed <= size);
        if !still {
            (self.size[place(side)], self.best[place(side)]) = (0.0, None);
        }
    }
}
