//! The result as a page.

use super::figure::{Figure, Standing};
use super::summary::{Failure, Summary, TEST_SEEDS};
use crate::report::{ConfusionTable, ProofFailure, ProofFigure, ProofPage, ReportError, Tone};

impl Summary {
    /// The report as one HTML file.
    ///
    /// # Errors
    /// If a template cannot be rendered.
    pub fn page(&self) -> Result<String, ReportError> {
        let confusion = &self.confusion;
        let counts = confusion.counts.iter().enumerate().map(|(row, counts)| {
            counts.iter().enumerate().map(|(column, count)| (*count, confusion.right(row, column))).collect()
        });
        let page = ProofPage {
            title: self.headline(),
            about: self.about(),
            figures: self.figures.iter().map(figure).collect(),
            confusion: ConfusionTable {
                truths: confusion.truths.clone(),
                answers: confusion.answers.clone(),
                counts: counts.collect(),
            },
            reliability: self.reliability.bins.iter().map(|bin| (bin.confidence, bin.right, bin.count)).collect(),
            failures: self.failures.iter().map(failure).collect(),
        };
        page.render()
    }

    /// The answer in a sentence.
    #[must_use]
    pub fn headline(&self) -> String {
        let found = |start: &str| {
            let figure = self.figures.iter().find(|f| f.name.starts_with(start));
            figure.and_then(|f| Some(f.told(f.value?))).unwrap_or_else(|| "–".into())
        };
        format!(
            "In {} blind cases, an effect that can be seen is named right {} of the time; where nothing is missing, \
             something is named {} of the time, and {} where the noise misleads.",
            self.cases,
            found("right first"),
            found("false name, white"),
            found("false name, misled")
        )
    }

    fn about(&self) -> Vec<String> {
        let kind = if self.development { "development" } else { "test" };
        let told = self.domain.told();
        vec![
            format!(
                "Each case is {}, with something concealed, or nothing: 45 in a hundred hold one effect, 20 two, 15 none, 12 one \
                 that no registry has, 8 one that the recording does not reach. Labels were sealed before the first diagnosis; \
                 together their seal is {}.",
                told.cases,
                &self.seal[..16.min(self.seal.len())]
            ),
            format!(
                "Seed {}, a {kind} seed: those below {TEST_SEEDS} are for development. {} {}",
                self.seed, told.generator, told.sizes
            ),
        ]
    }
}

fn figure(figure: &Figure) -> ProofFigure {
    let standing = match figure.standing {
        Standing::Aim => Some(("aim", Tone::Good)),
        Standing::Least => Some(("least", Tone::Unsure)),
        Standing::Missed => Some(("missed", Tone::Bad)),
        Standing::Open => None,
    };
    ProofFigure {
        name: figure.name.clone(),
        meaning: figure.meaning.clone(),
        value: figure.shown(),
        of: figure.of,
        wanted: figure.wanted(),
        standing: standing.map(|(word, tone)| (word.to_owned(), tone)),
        beside: [figure.recalibration, figure.regression, figure.oracle].map(|value| figure.beside(value)),
    }
}

fn failure(failure: &Failure) -> ProofFailure {
    ProofFailure {
        index: failure.index,
        truth: failure.truth.clone(),
        said: failure.said.clone(),
        circumstances: failure.circumstances.clone(),
        errors: failure.errors.map(|error| error.map_or_else(|| "\u{2013}".to_owned(), |error| format!("{error:.2}"))),
    }
}

#[cfg(test)]
mod tests {
    use super::super::confusion::Confusion;
    use super::super::domain::Domain;
    use super::super::figure::{Figure, Goal};
    use super::super::reliability::Reliability;
    use super::*;

    #[test]
    fn the_headline_tells_a_value_from_what_was_wanted_as_the_table_does() {
        let right = Figure::share("right first", (0..73).map(|k| k < 69)).wanting(Goal::new(0.85, 0.95));
        let told = right.shown();
        let summary = Summary {
            schema: String::new(),
            domain: Domain::Robot,
            seed: 1,
            development: true,
            cases: 73,
            version: String::new(),
            seal: String::new(),
            figures: vec![right],
            confusion: Confusion::of(&[]),
            reliability: Reliability::of(&[]),
            failures: Vec::new(),
        };
        assert!(told.starts_with("94.5\u{a0}%"), "{told}");
        let headline = summary.headline();
        assert!(headline.contains("named right 94.5\u{a0}% of the time"), "{headline}");
        assert!(headline.contains("something is named – of the time"), "what was not measured: {headline}");
    }
}
