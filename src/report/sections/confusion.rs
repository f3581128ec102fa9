//! What was taken for what.

use minijinja::{Value, context};

use crate::report::proof::ConfusionTable;
use crate::report::section::{ReportError, Section, fill};

pub(in crate::report) struct ConfusionMatrix<'a> {
    pub table: &'a ConfusionTable,
}

impl Section for ConfusionMatrix<'_> {
    fn id(&self) -> &'static str {
        "confusion"
    }

    fn title(&self) -> &'static str {
        "What was taken for what"
    }

    fn render(&self) -> Result<String, ReportError> {
        let rows: Vec<Value> = self
            .table
            .truths
            .iter()
            .zip(&self.table.counts)
            .map(|(truth, counts)| {
                let total: usize = counts.iter().map(|(count, _)| count).sum();
                let cells: Vec<Value> = counts
                    .iter()
                    .map(|(count, right)| {
                        let tone = if *right { "good" } else { "bad" };
                        let share = 100.0 * *count as f64 / total.max(1) as f64;
                        context! { count => count, tone => tone, right => right, strength => (25.0 + 0.75 * share).round() }
                    })
                    .collect();
                context! { name => truth, cells => cells, total => total }
            })
            .collect();
        if rows.is_empty() {
            return Ok(String::new());
        }
        fill(
            "confusion.html",
            include_str!("../templates/confusion.html"),
            context! { rows => rows, answers => self.table.answers.clone() },
        )
    }
}
