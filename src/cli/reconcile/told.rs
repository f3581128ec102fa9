//! A reconciliation on the terminal.

use crate::market::reconcile::{Checked, Reconciliation, listings};

use super::super::screen::{Screen, titled};

/// Orders that are shown.
const SHOWN: usize = 10;

/// All that is said of it: summary, causes, where they part, clocks, bands, bounds, and the orders with the largest gaps.
pub(super) fn told(found: &Reconciliation, checked: &[Checked], screen: &Screen) -> String {
    let mut text = format!("{}\n", screen.wrapped("", &found.summary));
    for listing in listings(found, checked, SHOWN) {
        if !listing.rows.rows.is_empty() {
            text += &titled(listing.title, &screen.listing(&listing.rows));
        }
    }
    if !found.notes.is_empty() {
        text += "\nNotes\n\n";
        found.notes.iter().for_each(|note| text += &format!("{}\n", screen.wrapped("- ", note)));
    }
    text
}
