//! A reconciliation as tables: the same in the terminal and on the page.

use crate::report::Listing;

use super::words::name;
use super::{Checked, CurrencyGap, Divergence, OrderDifference, Reconciliation};

/// A table with its title.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TitledListing {
    /// Anchor on a page.
    pub id: &'static str,
    /// Title.
    pub title: &'static str,
    /// Table.
    pub rows: Listing,
}

/// What was found as tables, with at most `orders` orders: those with the largest gaps. Tables may be empty.
#[must_use]
pub fn listings(found: &Reconciliation, checked: &[Checked], orders: usize) -> Vec<TitledListing> {
    let listing = |id, title, heads: &[&str], rows: Vec<Vec<String>>| TitledListing {
        id,
        title,
        rows: Listing { heads: heads.iter().map(|head| (*head).to_owned()).collect(), rows },
    };
    vec![
        listing("bounds", "Bounds", &["bound", "found", "at most", "holds", "order"], checked.iter().map(bound).collect()),
        listing(
            "gap",
            "The gap of profit and loss, and what made it",
            &["cause", "amount", "95 % interval", "orders", "what it is"],
            found.gaps.iter().flat_map(causes).collect(),
        ),
        listing(
            "parting",
            "Where they part first",
            &[
                "in",
                "when",
                "order",
                "symbol",
                "how",
                "orders from there",
                "that differ",
                "same positions again",
                "gap from there",
            ],
            [("decision", &found.first_decision), ("execution", &found.first_execution)]
                .into_iter()
                .filter_map(|(of, divergence)| Some(parting(of, divergence.as_ref()?)))
                .collect(),
        ),
        listing("clock", "Orders and clocks", &["figure", "value"], figures(found)),
        listing("bands", "Beside what the market showed", &["figure", "value"], bands(found)),
        listing(
            "orders",
            "Orders with the largest gaps",
            &[
                "order",
                "symbol",
                "side",
                "when",
                "gap",
                "decided [s]",
                "ordered [%]",
                "filled [%]",
                "price [bps]",
                "fee [bps]",
                "mostly",
            ],
            largest(&found.orders, orders).into_iter().map(order).collect(),
        ),
    ]
}

fn bound(checked: &Checked) -> Vec<String> {
    let found = checked.found.map_or_else(|| "nothing to compare".to_owned(), short);
    let holds = if checked.holds { "yes" } else { "no" };
    vec![
        checked.key.to_owned(),
        found,
        checked.bound.to_string(),
        holds.to_owned(),
        checked.order.clone().unwrap_or_default(),
    ]
}

fn causes(gap: &CurrencyGap) -> Vec<Vec<String>> {
    let currency = gap.currency.clone().unwrap_or_default();
    let row = |what: &str, amount: f64, words: &str| {
        vec![what.to_owned(), format!("{amount:+.2}"), String::new(), String::new(), words.to_owned()]
    };
    let mut rows = vec![row("backtest", gap.backtest, &currency)];
    rows.extend(gap.causes.iter().map(|cause| {
        let interval = cause.ci95.map_or_else(String::new, |[low, high]| format!("{low:+.2} to {high:+.2}"));
        vec![
            name(cause.cause).to_owned(),
            format!("{:+.2}", cause.amount),
            interval,
            cause.orders.to_string(),
            cause.cause.words().to_owned(),
        ]
    }));
    rows.push(row("paper log", gap.paper, &currency));
    rows
}

fn parting(of: &str, divergence: &Divergence) -> Vec<String> {
    let again = divergence.same_positions_again.map_or_else(|| "never".to_owned(), |at| at.to_string());
    vec![
        of.to_owned(),
        divergence.at.to_string(),
        divergence.order.clone(),
        divergence.symbol.clone(),
        divergence.what.clone(),
        divergence.orders_from_there.to_string(),
        divergence.of_these_differ.to_string(),
        again,
        format!("{:+.2}", divergence.gap_from_there),
    ]
}

fn figures(found: &Reconciliation) -> Vec<Vec<String>> {
    let (counts, clock) = (&found.counts, &found.clock);
    let row = |figure: &str, value: String| vec![figure.to_owned(), value];
    let mut rows = vec![
        row("orders of the backtest", counts.backtest.to_string()),
        row("orders of the paper log", counts.paper.to_string()),
        row("in both", counts.pairs.to_string()),
        row("in the backtest alone", counts.only_backtest.to_string()),
        row("in the paper log alone", counts.only_paper.to_string()),
        row("paper log later by [s]", format!("{:+.6}", clock.offset)),
        row("half of all pairs within [s]", format!("{:.6}", clock.spread)),
    ];
    if clock.drift != 0.0 {
        rows.push(row("its clock runs faster by [s/day]", format!("{:+.6}", clock.drift * 86_400.0)));
    }
    if let Some(bps) = found.mean_price_bps() {
        rows.push(row("paper log dearer by, on average [bps]", format!("{bps:+.3}")));
    }
    rows
}

fn bands(found: &Reconciliation) -> Vec<Vec<String>> {
    let Some(bands) = &found.bands else { return Vec::new() };
    let row = |figure: &str, value: String| vec![figure.to_owned(), value];
    vec![
        row("executions at prices that were shown", bands.inside.to_string()),
        row("cheaper than anything shown", bands.better.to_string()),
        row("dearer than anything shown", bands.worse.to_string()),
        row("at times of which nothing is known", bands.unknown.to_string()),
        row("before fees, at the worst prices shown", format!("{:+.2}", bands.pessimistic)),
        row("before fees, as executed", format!("{:+.2}", bands.paper)),
        row("before fees, at the best prices shown", format!("{:+.2}", bands.optimistic)),
    ]
}

fn largest(orders: &[OrderDifference], most: usize) -> Vec<&OrderDifference> {
    let mut parted: Vec<&OrderDifference> = orders.iter().filter(|order| order.gap != 0.0).collect();
    parted.sort_by(|a, b| b.gap.abs().total_cmp(&a.gap.abs()).then_with(|| (a.at, a.name()).cmp(&(b.at, b.name()))));
    parted.truncate(most);
    parted
}

fn order(order: &OrderDifference) -> Vec<String> {
    let number =
        |value: Option<f64>, scale: f64| value.map_or_else(|| "-".to_owned(), |value| format!("{:+.3}", scale * value));
    let mostly = order.causes.iter().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).map(|(cause, _)| (*cause).to_owned());
    vec![
        order.name(),
        order.symbol.clone(),
        order.side.word().to_owned(),
        order.at.to_string(),
        format!("{:+.2}", order.gap),
        number(order.decided_seconds, 1.0),
        number(order.ordered, 100.0),
        number(order.filled, 100.0),
        number(order.price_bps, 1.0),
        number(order.fee_bps, 1.0),
        mostly.unwrap_or_default(),
    ]
}

/// A number with six digits that count.
fn short(value: f64) -> String {
    let digits = if value == 0.0 { 0 } else { (5 - value.abs().log10().floor() as i32).clamp(0, 9) as usize };
    format!("{value:.digits$}")
}
