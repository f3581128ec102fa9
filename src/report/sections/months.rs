//! Returns month by month, as a heat map with a row a year.

use minijinja::{Value, context};

use crate::report::backtest::{BacktestPage, MonthReturn};
use crate::report::quantity::{UNDEFINED, decimals};
use crate::report::section::{ReportError, Section, fill};

pub(in crate::report) struct Months<'a> {
    pub page: &'a BacktestPage,
}

/// Less than this is a fragment of months [ns].
const MONTH: i64 = 31 * 86_400_000_000_000;

impl Section for Months<'_> {
    fn id(&self) -> &'static str {
        "months"
    }

    fn title(&self) -> &'static str {
        "Months"
    }

    fn render(&self) -> Result<String, ReportError> {
        let months = &self.page.months;
        let long = match (self.page.time.first(), self.page.time.last()) {
            (Some(first), Some(last)) => last.saturating_sub(*first) > MONTH,
            _ => false,
        };
        if !long || months.len() < 2 {
            return Ok(String::new());
        }
        let largest = months.iter().filter_map(|m| m.growth).filter(|g| g.is_finite()).map(f64::abs).fold(0.0, f64::max);
        let rows: Vec<Value> = months.chunk_by(|a, b| a.year == b.year).map(|year| row(year, largest)).collect();
        fill(
            "months.html",
            include_str!("../templates/months.html"),
            context! { names => NAMES, rows => rows, zone => &self.page.zone },
        )
    }
}

const NAMES: [&str; 12] = ["Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec"];

fn row(year: &[MonthReturn], largest: f64) -> Value {
    let cell = |month: u32| match year.iter().find(|m| m.month == month) {
        Some(m) => shaded(m.growth, largest),
        None => context! { text => "", class => "none", heat => 0 },
    };
    let cells: Vec<Value> = (1..=12).map(cell).collect();
    context! { year => year.first().map(|m| m.year), cells => cells, total => percentage(together(year)) }
}

/// What months came to one after another; none where one is not defined.
fn together(months: &[MonthReturn]) -> Option<f64> {
    months.iter().map(|m| m.growth.map(|g| 1.0 + g)).product::<Option<f64>>().map(|growth| growth - 1.0)
}

/// Sign and size as a colour, `largest` being the strongest; the number has its sign too.
fn shaded(growth: Option<f64>, largest: f64) -> Value {
    let growth = growth.filter(|g| g.is_finite());
    let class = match growth {
        Some(g) if g > 0.0 => "gain",
        Some(g) if g < 0.0 => "loss",
        _ => "none",
    };
    let heat = growth.filter(|_| largest > 0.0).map_or(0.0, |g| 100.0 * g.abs() / largest);
    context! { text => percentage(growth), class => class, heat => heat.round() as u32 }
}

/// In percent, without the sign of it: the table says it once.
fn percentage(growth: Option<f64>) -> String {
    growth.filter(|g| g.is_finite()).map_or_else(|| UNDEFINED.to_owned(), |g| decimals(100.0 * g, 2))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn month(month: u32, growth: Option<f64>) -> MonthReturn {
        MonthReturn { year: 2024, month, growth }
    }

    #[test]
    fn a_year_is_what_its_months_come_to() {
        let year = [month(1, Some(0.1)), month(2, Some(-0.5)), month(4, Some(0.2))];
        assert!((together(&year).unwrap() - (1.1 * 0.5 * 1.2 - 1.0)).abs() < 1e-15);
        assert_eq!(together(&[month(1, Some(0.1)), month(2, None)]), None);
    }

    #[test]
    fn some_weeks_are_no_months() {
        let day = 86_400_000_000_000;
        let mut page = BacktestPage {
            months: vec![month(1, Some(0.01)), month(2, Some(-0.02))],
            zone: "UTC".into(),
            time: vec![0, 20 * day],
            ..BacktestPage::default()
        };
        assert_eq!(Months { page: &page }.render().unwrap(), "");
        page.time = vec![0, 40 * day];
        let html = Months { page: &page }.render().unwrap();
        assert!(html.contains("class=\"n gain\" style=\"--heat:50%\">1.00<"), "{html}");
        assert!(html.contains("class=\"n loss\" style=\"--heat:100%\">\u{2212}2.00<"), "{html}");
        assert!(html.contains("<td class=\"n total\">\u{2212}1.02</td>"), "{html}");
    }
}
