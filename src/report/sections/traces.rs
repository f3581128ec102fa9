//! Measured and simulated over time, and what is left between them.

use minijinja::{Value, context};

use crate::report::figures::{Abscissa, DiagnosisFigures, Trace};
use crate::report::plot::{Curve, Ink, Mark, Plot, Scale, Shade, Tint};
use crate::report::quantity::{axis, number, percent, with_unit};
use crate::report::section::{ReportError, Section, fill};
use crate::sim2real::diagnose::Diagnosis;

pub(in crate::report) struct Traces<'a> {
    pub diagnosis: &'a Diagnosis,
    pub figures: &'a DiagnosisFigures,
    /// Whether to show what no fit has seen, or what was fitted.
    pub held_out: bool,
}

/// Plots of one section at most; the rest are listed by name.
pub(super) const SHOWN: usize = 6;
/// Columns of all wide plots of a section together: what keeps a page small.
const COLUMNS: usize = 3_000;

impl Section for Traces<'_> {
    fn id(&self) -> &'static str {
        if self.held_out { "held-out" } else { "fitted" }
    }

    fn title(&self) -> &'static str {
        if self.held_out { "Held-out recordings" } else { "Fitted recordings" }
    }

    fn render(&self) -> Result<String, ReportError> {
        let all: Vec<&Trace> = selected(self.figures, self.held_out, Abscissa::Time).collect();
        if all.is_empty() {
            return Ok(String::new());
        }
        let columns = (COLUMNS / all.len().min(SHOWN)).min(1_000);
        let plots: Vec<Value> = all.iter().take(SHOWN).enumerate().map(|(k, t)| self.pair(k, t, columns)).collect();
        let rest: Vec<String> = all.iter().skip(SHOWN).map(|t| t.caption()).collect();
        fill(
            "traces.html",
            include_str!("../templates/traces.html"),
            context! { plots => plots, rest => rest, held_out => self.held_out },
        )
    }
}

/// The traces of one part and one kind.
pub(super) fn selected(figures: &DiagnosisFigures, held_out: bool, kind: Abscissa) -> impl Iterator<Item = &Trace> {
    figures.traces.iter().filter(move |t| t.held_out == held_out && t.abscissa == kind)
}

impl Traces<'_> {
    /// The plot of the channel and, beneath it, that of the residuals.
    fn pair(&self, k: usize, trace: &Trace, columns: usize) -> Value {
        let id = self.id();
        let twins = twins(trace);
        let line = |ink, y| Curve { ink, mark: Mark::Line, x: &trace.time, y };
        let mut over_time = vec![line(Ink::Measured, trace.measured.clone())];
        over_time.extend(twins.iter().map(|(ink, series)| line(*ink, series.iter().map(|v| Some(*v)).collect())));
        let residuals = twins.iter().map(|(ink, series)| line(*ink, trace.residual(series))).collect();
        // Three spans of what was measured on either side show how a simulation ran away without flattening the rest.
        let limits = trace.span().map(|(low, high)| {
            let span = (high - low).max(1e-12);
            (low - 3.0 * span, high + 3.0 * span, 3.0 * span)
        });
        let caption = trace.caption();
        let shades = self.shades(trace);
        let active = self.active(trace);
        let level = Plot {
            alt: format!("{caption}: measured, nominal, recalibrated and trued over time"),
            x_label: String::new(),
            y_label: axis(&trace.channel, &trace.unit),
            scale: Scale::Number,
            curves: over_time,
            shades: shades.clone(),
            zero: false,
            diagonal: false,
            within: limits.map(|(low, high, _)| (low, high)),
            height: (290.0, 230.0),
            columns,
        };
        let residual = Plot {
            alt: format!("{caption}: measured less each simulation over time"),
            x_label: "time [s]".into(),
            y_label: axis("residual", &trace.unit),
            curves: residuals,
            shades: if active.is_empty() {
                shades.iter().map(|s| Shade { label: String::new(), ..s.clone() }).collect()
            } else {
                active.clone()
            },
            zero: true,
            within: limits.map(|(_, _, most)| (-most, most)),
            height: (210.0, 190.0),
            ..level.clone()
        };
        context! {
            caption => caption,
            errors => errors(trace),
            level => Value::from_safe_string(level.draw(&format!("{id}-{k}"))),
            residual => Value::from_safe_string(residual.draw(&format!("{id}-{k}-r"))),
            shaded => !shades.is_empty(),
            active => !active.is_empty(),
        }
    }

    fn shades(&self, trace: &Trace) -> Vec<Shade> {
        let (Some(first), Some(last)) = (trace.time.first(), trace.time.last()) else { return Vec::new() };
        let of_this = |i: &&crate::sim2real::diagnose::Interval| {
            i.channel == trace.channel && i.recording == trace.recording && i.end > *first && i.start < *last
        };
        let intervals = self.diagnosis.location.intervals.iter().filter(of_this);
        intervals
            .map(|i| Shade { start: i.start, end: i.end, label: percent(i.share_of_error), tint: Tint::Misfit })
            .collect()
    }

    /// When what was found acted, where it acts at times only.
    fn active(&self, trace: &Trace) -> Vec<Shade> {
        let (Some(first), Some(last)) = (trace.time.first(), trace.time.last()) else { return Vec::new() };
        let stretches = self.diagnosis.effects.iter().flat_map(|effect| &effect.active);
        stretches
            .filter(|s| s.recording == trace.recording && s.end > *first && s.start < *last)
            .map(|s| Shade { start: s.start, end: s.end, label: String::new(), tint: Tint::Active })
            .collect()
    }
}

/// The three twins, in the order in which they are drawn.
pub(super) fn twins(trace: &Trace) -> [(Ink, &[f64]); 3] {
    [(Ink::Nominal, &trace.nominal), (Ink::Recalibrated, &trace.recalibrated), (Ink::Trued, &trace.trued)]
}

/// Root mean square errors over the rows shown.
pub(super) fn errors(trace: &Trace) -> Vec<Value> {
    let error = |(ink, series): (Ink, &[f64])| {
        let value = trace.rmse(series).map_or_else(|| crate::report::quantity::UNDEFINED.into(), number);
        context! { name => ink.name(), value => with_unit(&value, &trace.unit) }
    };
    twins(trace).into_iter().map(error).collect()
}
