//! A recorded log of orders beside the tape they met: what drives the execution plant.

use crate::sim2real::Stimulus;

use super::{Execution, InFlight, Met};

/// The orders of a log, and what each would have met.
#[derive(Debug, Clone, Default)]
pub struct OrderLog {
    orders: Vec<InFlight>,
    met: Vec<Met>,
}

impl Stimulus<Execution> for OrderLog {
    fn command(&self, row: usize) -> InFlight {
        self.orders[row]
    }

    fn input(&self, row: usize, _arriving: &InFlight) -> Met {
        self.met[row]
    }
}
