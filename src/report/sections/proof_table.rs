//! The figures of a blind benchmark beside what was wanted of them.

use minijinja::{Value, context};

use crate::report::proof::ProofPage;
use crate::report::section::{ReportError, Section, fill};

pub(in crate::report) struct ProofTable<'a> {
    pub page: &'a ProofPage,
}

impl Section for ProofTable<'_> {
    fn id(&self) -> &'static str {
        "figures"
    }

    fn title(&self) -> &'static str {
        "Figures"
    }

    fn render(&self) -> Result<String, ReportError> {
        let rows: Vec<Value> = self
            .page
            .figures
            .iter()
            .map(|figure| {
                let [least, aim] = figure.wanted.clone().unwrap_or_default();
                let standing = figure.standing.as_ref().map(|(word, tone)| context! { word => word, tone => tone.class() });
                context! {
                    name => &figure.name,
                    meaning => &figure.meaning,
                    value => &figure.value,
                    of => figure.of,
                    least => least,
                    aim => aim,
                    standing => standing.unwrap_or(Value::from(())),
                    beside => figure.beside.to_vec(),
                }
            })
            .collect();
        fill(
            "proof_table.html",
            include_str!("../templates/proof_table.html"),
            context! { rows => rows, about => self.page.about.clone() },
        )
    }
}
