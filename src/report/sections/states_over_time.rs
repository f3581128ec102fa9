//! A series in the colours of its states, and how probable each state was by then.

use minijinja::{Value, context};

use crate::report::plot::{Curve, Ink, Mark, Plot, Scale};
use crate::report::regimes::RegimesPage;
use crate::report::section::{ReportError, Section, fill};

use super::equity::gaps;

pub(in crate::report) struct StatesOverTime<'a> {
    pub page: &'a RegimesPage,
}

/// Columns of each plot.
const COLUMNS: usize = 1_000;

impl Section for StatesOverTime<'_> {
    fn id(&self) -> &'static str {
        "over-time"
    }

    fn title(&self) -> &'static str {
        "Over time"
    }

    fn render(&self) -> Result<String, ReportError> {
        let page = self.page;
        let (time, cuts, x_label) = page.time.axis();
        let shades = cuts.as_deref().map(gaps).unwrap_or_default();
        let scale = cuts.map_or(Scale::Number, Scale::Date);
        // Both ends of the band of a segment stand at the same places.
        let twice: Vec<f64> = time.iter().chain(&time).copied().collect();
        let spread = |side: f64| page.segments.iter().flat_map(move |s| vec![Some(s.mean + side * s.std); s.end - s.start]);
        let between = Curve { ink: Ink::Band, mark: Mark::Between, x: &twice, y: spread(-1.0).chain(spread(1.0)).collect() };
        let means = Curve { ink: Ink::Level, mark: Mark::Step, x: &time, y: spread(0.0).collect() };
        let dots = (0..page.by_then.len()).map(|state| {
            let own = |(value, of): (&Option<f64>, &usize)| value.filter(|_| *of == state);
            let y = page.values.iter().zip(&page.path).map(own).collect();
            Curve { ink: Ink::Member(state), mark: Mark::Dots, x: &time, y }
        });
        let series = Plot {
            alt: format!("{} in the colours of its states, with mean and deviation between changes", page.quantity),
            x_label: x_label.into(),
            y_label: String::new(),
            scale,
            curves: [between].into_iter().chain(dots).chain([means]).collect(),
            shades,
            zero: false,
            diagonal: false,
            within: None,
            height: (330.0, 250.0),
            columns: COLUMNS,
        };
        let line = |(state, y): (usize, &Vec<f64>)| Curve {
            ink: Ink::Member(state),
            // What is believed holds until more is known.
            mark: Mark::Step,
            x: &time,
            y: y.iter().map(|p| Some(*p)).collect(),
        };
        let beliefs = Plot {
            alt: "probability of each state by then".into(),
            curves: page.by_then.iter().enumerate().map(line).collect(),
            within: Some((0.0, 1.0)),
            height: (220.0, 190.0),
            ..series.clone()
        };
        let members: Vec<Value> = (0..page.by_then.len())
            .map(|state| context! { name => format!("state {state}"), class => Ink::Member(state).name() })
            .collect();
        fill(
            "states_over_time.html",
            include_str!("../templates/states_over_time.html"),
            context! {
                about => page.about.clone(),
                quantity => &page.quantity,
                members => members,
                series => Value::from_safe_string(series.draw("series")),
                beliefs => Value::from_safe_string(beliefs.draw("beliefs")),
            },
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::fan::FanTime;
    use crate::report::regimes::Segment;
    use crate::report::sweep::Listing;

    #[test]
    fn each_state_has_its_colour_and_each_segment_its_mean() {
        let rows = 60;
        let path: Vec<usize> = (0..rows).map(|row| usize::from(row >= 40)).collect();
        let page = RegimesPage {
            title: "two <states>".into(),
            about: vec!["of <flow>".into()],
            quantity: "flow".into(),
            time: FanTime::Rows((1..=rows).map(|row| row as f64).collect()),
            values: (0..rows).map(|row| (row != 5).then_some(if row < 40 { 1.0 } else { 4.0 })).collect(),
            by_then: [1.0, 0.0].map(|of| path.iter().map(|state| (of - *state as f64).abs()).collect()).to_vec(),
            path,
            segments: vec![
                Segment { start: 0, end: 40, mean: 1.0, std: 0.1 },
                Segment { start: 40, end: rows, mean: 4.0, std: 0.2 },
            ],
            states: Listing::default(),
            changes: Listing::default(),
        };
        let html = StatesOverTime { page: &page }.render().unwrap();
        for colour in ["var(--member-0)", "var(--member-1)", "var(--level)", "var(--band)"] {
            assert!(html.contains(colour), "{colour}");
        }
        // On wide screens and narrow ones: the 59 values that there are, each a dot: a line of no length.
        assert_eq!(html.matches("h0").count(), 2 * (rows - 1), "{html}");
        assert!(html.contains("of &lt;flow&gt;") && html.contains("state 1") && !html.contains("state 2"));
    }
}
