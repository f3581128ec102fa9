//! Memory of runs that are over, in which others go on: a run of a million bars leaves some thirty megabytes, which to ask of the
//! system anew takes a quarter of the run.

use std::sync::{Arc, Mutex};

use super::{EquityPoint, Fill, Order, Record};

/// What was given back, taken from there by whichever run comes next. Clones share it.
#[derive(Debug, Clone, Default)]
pub(super) struct Spare(Arc<Mutex<Vec<Rows>>>);

/// The rows of a run, which are most of what it leaves.
#[derive(Debug, Default)]
pub(super) struct Rows {
    pub equity: Vec<EquityPoint>,
    pub orders: Vec<Order>,
    pub fills: Vec<Fill>,
    pub terms: Vec<f64>,
}

impl Spare {
    pub fn take(&self) -> Option<Rows> {
        self.0.lock().ok()?.pop()
    }

    pub fn give(&self, over: Record) {
        let Record { equity, blotter, .. } = over;
        if let Ok(mut rows) = self.0.lock() {
            rows.push(Rows { equity, orders: blotter.orders, fills: blotter.fills, terms: blotter.terms });
        }
    }
}
