//! The first fills.

use chrono::DateTime;
use minijinja::{Value, context};

use crate::report::backtest::BacktestPage;
use crate::report::quantity::{decimals, tick};
use crate::report::section::{ReportError, Section, fill};

pub(in crate::report) struct Fills<'a> {
    pub page: &'a BacktestPage,
}

/// Fills listed at most.
const LISTED: usize = 200;

impl Section for Fills<'_> {
    fn id(&self) -> &'static str {
        "fills"
    }

    fn title(&self) -> &'static str {
        "Fills"
    }

    fn render(&self) -> Result<String, ReportError> {
        let total = self.page.fill_count.max(self.page.fills.len());
        let rows: Vec<Value> = self
            .page
            .fills
            .iter()
            .take(LISTED)
            .map(|f| {
                let time = DateTime::from_timestamp_nanos(f.time).format("%Y-%m-%d %H:%M:%S%.3f");
                context! {
                    time => time.to_string(),
                    symbol => &f.symbol,
                    side => &f.side,
                    quantity => exact(f.quantity),
                    price => price(f.price),
                    fee => decimals(f.fee, 2),
                }
            })
            .collect();
        let listed = rows.len();
        fill(
            "fills.html",
            include_str!("../templates/fills.html"),
            context! {
                rows => rows,
                listed => listed,
                rest => decimals((total - listed) as f64, 0),
                cut => total > listed,
                currency => &self.page.currency,
            },
        )
    }
}

/// Whole numbers in full, others as on an axis.
pub(super) fn exact(quantity: f64) -> String {
    if quantity.fract() == 0.0 { decimals(quantity, 0) } else { tick(quantity) }
}

/// At least two decimals, up to four where the price has them.
pub(super) fn price(price: f64) -> String {
    let text = decimals(price, 4);
    text.strip_suffix("00").map_or(text.clone(), str::to_owned)
}
