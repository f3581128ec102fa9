//! How far a paper log may part from a backtest before a test fails.

use std::fmt::Write as _;

use serde::{Deserialize, Serialize};

use super::Reconciliation;

/// How far the two may part. What is left out is not looked at.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Tolerance {
    /// Orders that only one of the two has, as a fraction of all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unmatched: Option<f64>,
    /// Largest time between two decisions that are one, beyond the difference of clocks [s].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub decided_seconds: Option<f64>,
    /// Largest difference of what was ordered, as a fraction of the backtest's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ordered: Option<f64>,
    /// Largest difference of what was filled, as a fraction of what was ordered.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub filled: Option<f64>,
    /// Largest difference of average prices of an order, against it or for it [bps].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub price_bps: Option<f64>,
    /// Largest mean difference of average prices, weighted by what was filled [bps].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean_price_bps: Option<f64>,
    /// Largest difference of fees of an order [bps of what was traded].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fee_bps: Option<f64>,
    /// Largest difference between first executions, each counted from its decision [s].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub delay_seconds: Option<f64>,
    /// Largest gap of profit and loss, either way [currency].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gap: Option<f64>,
    /// Largest gap of profit and loss, either way [bps of what the backtest traded].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gap_bps: Option<f64>,
}

impl Tolerance {
    /// The keys there are.
    pub const KEYS: [&'static str; 10] = [
        "unmatched",
        "decided_seconds",
        "ordered",
        "filled",
        "price_bps",
        "mean_price_bps",
        "fee_bps",
        "delay_seconds",
        "gap",
        "gap_bps",
    ];

    /// Each bound by its key, in the order of [`KEYS`](Self::KEYS).
    #[must_use]
    pub fn bounds(&self) -> [(&'static str, Option<f64>); 10] {
        let bounds = [
            self.unmatched,
            self.decided_seconds,
            self.ordered,
            self.filled,
            self.price_bps,
            self.mean_price_bps,
            self.fee_bps,
            self.delay_seconds,
            self.gap,
            self.gap_bps,
        ];
        let mut keyed = [("", None); 10];
        for ((own, key), bound) in keyed.iter_mut().zip(Self::KEYS).zip(bounds) {
            *own = (key, bound);
        }
        keyed
    }

    /// Sets a bound by its key; false where there is no such key.
    pub fn set(&mut self, key: &str, bound: f64) -> bool {
        let own = match key {
            "unmatched" => &mut self.unmatched,
            "decided_seconds" => &mut self.decided_seconds,
            "ordered" => &mut self.ordered,
            "filled" => &mut self.filled,
            "price_bps" => &mut self.price_bps,
            "mean_price_bps" => &mut self.mean_price_bps,
            "fee_bps" => &mut self.fee_bps,
            "delay_seconds" => &mut self.delay_seconds,
            "gap" => &mut self.gap,
            "gap_bps" => &mut self.gap_bps,
            _ => return false,
        };
        *own = Some(bound);
        true
    }
}

/// One bound, and what was found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Checked {
    /// Which bound.
    pub key: &'static str,
    /// The bound.
    pub bound: f64,
    /// The largest there is; none where there is nothing to compare.
    pub found: Option<f64>,
    /// Whether it is within the bound.
    pub holds: bool,
    /// Which order it is of, where it is of one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub order: Option<String>,
}

/// Holds the two to be within `tolerance`: for tests, of a backtest beside a log that was committed.
///
/// # Panics
/// If they are not, with what parts them.
#[allow(clippy::panic, reason = "it is what a test fails by")]
pub fn assert_reconciles(found: &Reconciliation, tolerance: &Tolerance) {
    let broken: Vec<Checked> = found.checked(tolerance).into_iter().filter(|checked| !checked.holds).collect();
    if broken.is_empty() {
        return;
    }
    let mut text = format!("backtest and paper log part: {}", found.summary);
    for Checked { key, bound, found, order, .. } in &broken {
        let found = found.map_or_else(|| "unknown".to_owned(), |found| found.to_string());
        let of = order.as_ref().map_or_else(String::new, |order| format!(" (order {order})"));
        let _ = write!(text, "\n  {key}: {found}{of}, beyond {bound}");
    }
    panic!("{text}");
}
