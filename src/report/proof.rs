//! The page of a blind benchmark, from plain data.

use super::page::{Badge, Page, Tone};
use super::section::ReportError;
use super::sections::{ConfusionMatrix, Failures, ProofTable, ReliabilityPlot};

/// What the page of a blind benchmark shows.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ProofPage {
    /// The first sentence: how often the answers were right.
    pub title: String,
    /// How the cases came about, in a paragraph each.
    pub about: Vec<String>,
    /// The table of figures.
    pub figures: Vec<ProofFigure>,
    /// What was taken for what.
    pub confusion: ConfusionTable,
    /// Mean confidence, share that is right and number of names, a bin each.
    pub reliability: Vec<(f64, f64, usize)>,
    /// The worst answers, worst first.
    pub failures: Vec<ProofFailure>,
}

/// A figure beside what was wanted of it and what the baselines reach, all as text.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ProofFigure {
    /// What it is of, in a few words.
    pub name: String,
    /// What it is of, in full.
    pub meaning: String,
    /// Its value with its interval.
    pub value: String,
    /// Number of cases.
    pub of: usize,
    /// The least that was wanted, and the aim.
    pub wanted: Option<[String; 2]>,
    /// How it stands to that, in a word, and how to take it.
    pub standing: Option<(String, Tone)>,
    /// Recalibration alone, sparse regression, oracle.
    pub beside: [String; 3],
}

/// Counts of answers by truth.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ConfusionTable {
    /// What was concealed: a row each.
    pub truths: Vec<String>,
    /// What was said: a column each.
    pub answers: Vec<String>,
    /// How often, and whether that is right, row by row.
    pub counts: Vec<Vec<(usize, bool)>>,
}

/// A case that was answered wrongly.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ProofFailure {
    /// Number of the case.
    pub index: usize,
    /// What was concealed.
    pub truth: String,
    /// What was said.
    pub said: String,
    /// Arm, noise, motion.
    pub circumstances: String,
    /// Held-out errors over the noise, as text: recalibrated, trued, oracle.
    pub errors: [String; 3],
}

impl ProofPage {
    /// The page as one HTML file.
    ///
    /// # Errors
    /// If a template cannot be rendered.
    pub fn render(&self) -> Result<String, ReportError> {
        let (mut reached, mut wanted) = (0, 0);
        for (_, tone) in self.figures.iter().filter_map(|figure| figure.standing.as_ref()) {
            wanted += 1;
            reached += usize::from(*tone == Tone::Good);
        }
        let tone = if reached == wanted { Tone::Good } else { Tone::Unsure };
        let page = Page {
            kind: "Blind benchmark",
            heading: self.title.clone(),
            badge: Some(Badge { text: format!("{reached} of {wanted} aims reached"), tone }),
            sections: vec![
                Box::new(ProofTable { page: self }),
                Box::new(ConfusionMatrix { table: &self.confusion }),
                Box::new(ReliabilityPlot { page: self }),
                Box::new(Failures { page: self }),
            ],
        };
        page.render()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_reaches_the_least_alone_has_not_reached_its_aim() {
        let figure = |tone| ProofFigure { standing: Some((String::new(), tone)), ..ProofFigure::default() };
        let figures = [Tone::Good, Tone::Unsure, Tone::Bad].map(figure).to_vec();
        let page = ProofPage { figures, ..ProofPage::default() }.render().unwrap();
        assert!(page.contains("1 of 3 aims reached"));
    }
}
