//! Where: since when, in which states and at which times model and recording part, and when what was found acted.

use minijinja::{Value, context};

use crate::report::figures::DiagnosisFigures;
use crate::report::plot::{Curve, Ink, Mark, Plot, Scale};
use crate::report::quantity::{axis, decimals, number, percent, range, significant, with_unit};
use crate::report::section::{ReportError, Section, fill};
use crate::sim2real::diagnose::{Diagnosis, Effect, Profile};

pub(in crate::report) struct Place<'a> {
    pub diagnosis: &'a Diagnosis,
    pub figures: &'a DiagnosisFigures,
}

/// Stretches of time in the table; plots shade them all.
const STRETCHES: usize = 4;
/// Channels whose errors are drawn over states.
const CHANNELS: usize = 2;

impl Section for Place<'_> {
    fn id(&self) -> &'static str {
        "where"
    }

    fn title(&self) -> &'static str {
        "Where"
    }

    fn render(&self) -> Result<String, ReportError> {
        let location = &self.diagnosis.location;
        let acted: Vec<Value> = self.diagnosis.effects.iter().filter_map(acted).collect();
        let mut channels: Vec<&Profile> = Vec::new();
        for profile in &self.figures.profiles {
            if channels.len() < CHANNELS && !channels.iter().any(|known| known.channel == profile.channel) {
                channels.push(profile);
            }
        }
        let profiles: Vec<Value> = channels.iter().map(|first| self.profiles(first)).collect();
        let nothing =
            acted.is_empty() && location.intervals.is_empty() && location.against.is_empty() && location.changes.is_empty();
        if nothing && location.columns.is_empty() && location.onset.is_none() && profiles.is_empty() {
            return Ok(String::new());
        }
        let intervals: Vec<Value> = location
            .intervals
            .iter()
            .take(STRETCHES)
            .map(|i| {
                context! {
                    recording => &i.recording,
                    channel => &i.channel,
                    stretch => format!("{} to {} s", decimals(i.start, 2), decimals(i.end, 2)),
                    share => percent(i.share_of_error),
                }
            })
            .collect();
        let changes: Vec<Value> = location
            .changes
            .iter()
            .map(|change| {
                let (time, factor) = (with_unit(&significant(change.time, 4), "s"), significant(change.factor, 2));
                context! { channel => &change.channel, recording => &change.recording, time => time, factor => factor }
            })
            .collect();
        let against: Vec<Value> = location
            .against
            .iter()
            .map(|bin| {
                let (error, rows) = (percent(bin.share_of_error), percent(bin.share_of_rows));
                context! { channel => &bin.channel, range => range(bin), error => error, rows => rows }
            })
            .collect();
        let columns: Vec<Value> = location
            .columns
            .iter()
            .map(|split| {
                let (at, explains) = (significant(split.at, 3), percent(split.explains));
                context! { column => &split.column, at => at, explains => explains }
            })
            .collect();
        fill(
            "place.html",
            include_str!("../templates/place.html"),
            context! {
                acted => acted,
                onset => location.onset.map(|t| with_unit(&significant(t, 4), "s")),
                changes => changes,
                against => against,
                columns => columns,
                profiles => profiles,
                intervals => intervals,
                more => location.intervals.len().saturating_sub(STRETCHES),
            },
        )
    }
}

impl Place<'_> {
    /// The profiles of the channel that `first` is of.
    fn profiles(&self, first: &Profile) -> Value {
        let own = self.figures.profiles.iter().enumerate().filter(|(_, p)| p.channel == first.channel);
        let plots: Vec<Value> = own.map(profile).collect();
        context! { channel => axis(&first.channel, &first.unit), plots => plots }
    }
}

/// When a mechanism acted and by how much it moved the output; none where neither is known.
fn acted(effect: &Effect) -> Option<Value> {
    let moved: Vec<Value> =
        effect.moved.iter().map(|m| context! { channel => &m.channel, rms => with_unit(&number(m.rms), &m.unit) }).collect();
    let known = effect.location.is_some() || !moved.is_empty();
    // `position > 0.5 rad` is a condition, `throughout` a time.
    let condition = effect.location.as_ref().is_some_and(|l| l.contains(['<', '>']));
    let stretches = effect.active.len();
    known.then(|| {
        context! { name => &effect.mechanism, place => effect.location.as_deref(), moved => moved, stretches => stretches, condition => condition }
    })
}

fn profile((k, profile): (usize, &Profile)) -> Value {
    let line = |ink, y: &[f64]| Curve { ink, mark: Mark::Line, x: &profile.at, y: y.iter().map(|v| Some(*v)).collect() };
    let noise = vec![profile.noise; profile.at.len()];
    let plot = Plot {
        alt: format!("Error of {} over {}: recalibrated, trued and the noise floor", profile.channel, profile.on),
        x_label: axis(&profile.on, &profile.on_unit),
        // The caption says what the errors are of: beside three plots there is no room.
        y_label: String::new(),
        scale: Scale::Number,
        curves: vec![
            line(Ink::Measured, &noise),
            line(Ink::Recalibrated, &profile.recalibrated),
            line(Ink::Trued, &profile.trued),
        ],
        shades: Vec::new(),
        zero: true,
        diagonal: false,
        within: None,
        height: (230.0, 230.0),
        columns: 200,
    };
    Value::from_safe_string(plot.draw_narrow(&format!("where-{k}")))
}
