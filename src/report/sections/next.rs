//! What to record next, where these data cannot tell.

use minijinja::{Value, context};

use crate::report::figures::DiagnosisFigures;
use crate::report::plot::{Curve, Ink, Mark, Plot, Scale};
use crate::report::quantity::number;
use crate::report::section::{ReportError, Section, fill};
use crate::sim2real::diagnose::{Diagnosis, Excitation};

pub(in crate::report) struct Next<'a> {
    pub diagnosis: &'a Diagnosis,
    pub figures: &'a DiagnosisFigures,
}

impl Section for Next<'_> {
    fn id(&self) -> &'static str {
        "next"
    }

    fn title(&self) -> &'static str {
        "Next experiment"
    }

    fn render(&self) -> Result<String, ReportError> {
        let Some(next) = &self.diagnosis.next_experiment else { return Ok(String::new()) };
        fill(
            "next.html",
            include_str!("../templates/next.html"),
            context! {
                what => capital(&next.what),
                file => next.file.as_deref(),
                rivals => next.rivals.clone(),
                separation => next.separation.map(number),
                gain => next.gain.map(number),
                gain_so_far => next.gain_so_far.map(number),
                commands => self.figures.excitation.as_ref().map(commands),
            },
        )
    }
}

/// A sentence begins with a capital.
fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

fn commands(excitation: &Excitation) -> Value {
    let plot = Plot {
        alt: format!("The commands to send over time: {}", excitation.name),
        x_label: "time [s]".into(),
        y_label: "command".into(),
        scale: Scale::Number,
        curves: vec![Curve {
            ink: Ink::Equity,
            mark: Mark::Step,
            x: &excitation.time,
            y: excitation.command.iter().map(|v| Some(*v)).collect(),
        }],
        shades: Vec::new(),
        zero: true,
        diagonal: false,
        within: None,
        height: (230.0, 200.0),
        columns: 800,
    };
    Value::from_safe_string(plot.draw("next"))
}
