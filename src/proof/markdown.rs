//! The result as text that needs no program to read it.

use std::fmt::Write as _;

use super::figure::Standing;
use super::summary::{Summary, TEST_SEEDS};

/// The table of figures in Markdown.
#[must_use]
pub fn figures_table(summary: &Summary) -> String {
    let mut text = String::from(
        "| figure | trueup (95 % interval) | of | least | aim | | recalibrated only | sparse regression | oracle |\n\
         |---|---|---|---|---|---|---|---|---|\n",
    );
    for figure in &summary.figures {
        let [least, aim] = figure.wanted().unwrap_or_default();
        let standing = match figure.standing {
            Standing::Aim => "aim",
            Standing::Least => "least",
            Standing::Missed => "missed",
            Standing::Open => "",
        };
        let _ = writeln!(
            text,
            "| **{}**: {} | {} | {} | {least} | {aim} | {standing} | {} | {} | {} |",
            figure.name,
            figure.meaning,
            figure.shown(),
            figure.of,
            figure.beside(figure.recalibration),
            figure.beside(figure.regression),
            figure.beside(figure.oracle)
        );
    }
    text
}

/// What lies beside the table: how it came about, and how to check it.
#[must_use]
pub fn readme(summary: &Summary) -> String {
    let kind = if summary.development { "development" } else { "test" };
    let told = summary.domain.told();
    let mut text = format!(
        "# The blind benchmark of {title}\n\n\
         Made by `trueup prove --domain {domain} --cases {cases} --seed {seed}` with trueup {version}. {seed} is a {kind} seed: \
         seeds below {TEST_SEEDS} are for development, those from {TEST_SEEDS} on for tests, of which nothing is to be learnt.\n\n\
         Each case is {of}, and a label. Of a hundred, 45 conceal one effect, 20 two, 15 none, 12 one that no registry has, and 8 \
         one that the recording to learn from does not reach. {generator} {sizes}\n\n",
        title = told.title,
        domain = summary.domain,
        cases = summary.cases,
        seed = summary.seed,
        version = summary.version,
        of = told.cases,
        generator = told.generator,
        sizes = told.sizes,
    );
    text += &figures_table(summary);
    let _ = write!(
        text,
        "\n\"Recalibrated only\" is the twin refitted with nothing added; {}; the \"oracle\" is a fit that is told the names. A \
         diagnosis that is `unexplained` has no name counted as right, and what is listed as `not_excited` is not named.\n\n\
         ## The worst answers\n\n\
         | case | concealed | said | circumstances | recalibrated, trued, oracle [sigma] |\n|---|---|---|---|---|\n",
        told.regression
    );
    for failure in &summary.failures {
        let errors = failure.errors.map(|error| error.map_or_else(|| "\u{2013}".to_owned(), |error| format!("{error:.2}")));
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} |",
            failure.index,
            failure.truth,
            failure.said,
            failure.circumstances,
            errors.join(", ")
        );
    }
    let _ = write!(
        text,
        "\n## Files\n\n\
         - `cases.jsonl` grows while the run goes on. Its first line holds the SHA-256 of every label, and is written before \
         any case is diagnosed; then comes a line for each case with the label, its salt, and what was said. A label fits its \
         seal if `printf %s \"$salt$label\" | sha256sum` gives it. All seals together have the seal\n  `{}`.\n\
         - `summary.json`: the figures, what was taken for what, confidences beside how often they are right, failures.\n\
         - `figures.md`: the table above. `report.html`: all of it with pictures; it opens offline.\n",
        summary.seal
    );
    text
}
