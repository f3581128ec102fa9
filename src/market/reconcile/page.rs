//! A reconciliation as its report shows it.

use crate::report::{Badge, GapCause, ReconcilePage, ReconcileTable, Tone};

use super::words::name;
use super::{Checked, Reconciliation, listings};

/// Orders a page lists.
const ORDERS: usize = 100;

/// The page of `found`, with what was checked.
#[must_use]
pub fn reconcile_page(found: &Reconciliation, checked: &[Checked]) -> ReconcilePage {
    let beyond = checked.iter().filter(|checked| !checked.holds).count();
    let badge = match (checked.is_empty(), beyond) {
        (true, _) => None,
        (false, 0) => Some(Badge { text: "within bounds".to_owned(), tone: Tone::Good }),
        (false, _) => Some(Badge { text: format!("{beyond} beyond bounds"), tone: Tone::Bad }),
    };
    let mut sum = 0.0;
    let gap = found.orders.iter().map(|order| {
        sum += order.gap;
        sum
    });
    let tables = listings(found, checked, ORDERS).into_iter().filter(|table| table.id != "gap");
    ReconcilePage {
        title: found.summary.clone(),
        badge,
        currency: found.gaps.iter().find_map(|gap| gap.currency.clone()).unwrap_or_default(),
        causes: found
            .gaps
            .iter()
            .flat_map(|gap| &gap.causes)
            .map(|cause| GapCause {
                name: name(cause.cause).to_owned(),
                words: cause.cause.words().to_owned(),
                amount: cause.amount,
                interval: cause.ci95,
                orders: cause.orders,
            })
            .collect(),
        time: found.orders.iter().map(|order| order.at.0).collect(),
        gap: gap.collect(),
        tables: tables.map(|table| ReconcileTable { id: table.id, title: table.title, listing: table.rows }).collect(),
        notes: found.notes.clone(),
    }
}
