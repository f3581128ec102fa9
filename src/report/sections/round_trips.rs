//! Round trips: those that gained and lost most, the first and the last.

use minijinja::{Value, context};

use crate::report::backtest::{BacktestPage, Trade};
use crate::report::quantity::{UNDEFINED, decimals, fine, span};
use crate::report::section::{ReportError, Section, fill};

use super::dates::Dates;
use super::fills::{exact, price};

pub(in crate::report) struct RoundTrips<'a> {
    pub page: &'a BacktestPage,
}

/// Up to so many are listed in one table.
const ALL: usize = 40;
/// Trips in the tables of the largest gains and of the largest losses.
const LARGEST: usize = 10;
/// Trips in the tables of the first and of the last.
const ENDS: usize = 20;

impl Section for RoundTrips<'_> {
    fn id(&self) -> &'static str {
        "trades"
    }

    fn title(&self) -> &'static str {
        "Round trips"
    }

    fn render(&self) -> Result<String, ReportError> {
        let trades: Vec<&Trade> = self.page.trades.iter().collect();
        if trades.is_empty() {
            return Ok(String::new());
        }
        let dates = Dates::over(self.page);
        let mut tables = Vec::new();
        let mut table = |title: String, of: &[&Trade], open: bool| {
            let rows: Vec<Value> = of.iter().map(|trade| row(trade, dates)).collect();
            if !rows.is_empty() {
                tables.push(context! { title => title, rows => rows, open => open });
            }
        };
        if trades.len() <= ALL {
            table(format!("All {}", trades.len()), &trades, true);
        } else {
            let mut sorted = trades.clone();
            sorted.sort_by(|a, b| b.net.total_cmp(&a.net));
            let gains: Vec<&Trade> = sorted.iter().copied().filter(|t| t.net > 0.0).take(LARGEST).collect();
            let losses: Vec<&Trade> = sorted.iter().rev().copied().filter(|t| t.net < 0.0).take(LARGEST).collect();
            table(format!("The {} that gained most", gains.len()), &gains, true);
            table(format!("The {} that lost most", losses.len()), &losses, true);
            table(format!("The first {ENDS}"), &trades[..ENDS], false);
            table(format!("The last {ENDS}"), &trades[trades.len() - ENDS..], false);
        }
        fill(
            "round_trips.html",
            include_str!("../templates/round_trips.html"),
            context! {
                tables => tables,
                currency => &self.page.currency,
                zone => dates.zone(),
                count => decimals(trades.len() as f64, 0),
                cut => trades.len() > ALL,
            },
        )
    }
}

fn row(trade: &Trade, dates: Dates) -> Value {
    context! {
        symbol => &trade.symbol,
        side => &trade.side,
        entered => dates.text(trade.entered_at),
        exited => trade.exited_at.map(|at| dates.text(at)),
        length => span(trade.seconds),
        quantity => exact(trade.quantity),
        entry => price(trade.entry_price),
        exit => trade.exit_price.map_or_else(|| UNDEFINED.to_owned(), price),
        fees => decimals(trade.fees, 2),
        net => decimals(trade.net, 2),
        growth => trade.growth.map_or_else(|| UNDEFINED.to_owned(), fine),
    }
}
