//! What a reconciliation says, in sentences.

use super::causes::Cause;
use super::{CurrencyGap, Reconciliation};

/// What was found, in a few sentences a person can act on.
pub(super) fn summary(found: &Reconciliation) -> String {
    let counts = &found.counts;
    let mut text = match (counts.only_backtest, counts.only_paper) {
        (0, 0) => format!("All {} orders are in both.", counts.pairs),
        (backtest, paper) => {
            format!("{} orders are in both, {backtest} in the backtest alone, {paper} in the paper log alone.", counts.pairs)
        }
    };
    for gap in &found.gaps {
        text += &format!(" {}", of_gap(gap));
    }
    if found.clock.is_a_zone {
        text += &format!(" The paper log's times are {:+} h off: those of another zone.", found.clock.offset / 3_600.0);
    }
    text
}

fn of_gap(gap: &CurrencyGap) -> String {
    let currency = gap.currency.as_ref().map_or_else(String::new, |currency| format!(" {currency}"));
    if gap.causes.is_empty() {
        return format!("Profit and loss is the same: {:.2}{currency}.", gap.backtest);
    }
    let bps = gap.gap_bps.map_or_else(String::new, |bps| format!(", {bps:+.2} bps of what was traded"));
    let mut causes: Vec<_> = gap.causes.iter().filter(|cause| cause.amount != 0.0).collect();
    causes.sort_by(|a, b| b.amount.abs().total_cmp(&a.amount.abs()));
    let main: Vec<String> = causes.iter().take(3).map(|c| format!("{} {:+.2}", name(c.cause), c.amount)).collect();
    format!(
        "Profit and loss is {:.2}{currency} in the backtest and {:.2} in the paper log ({:+.2}{bps}): {}.",
        gap.backtest,
        gap.paper,
        gap.gap,
        main.join(", ")
    )
}

/// A cause as it is called in sentences and tables.
#[must_use]
pub fn name(cause: Cause) -> &'static str {
    match cause {
        Cause::QueueFill => "queue and fill",
        other => other.word(),
    }
}
