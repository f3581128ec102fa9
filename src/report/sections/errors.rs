//! Errors of the three twins per channel, on held-out data.

use minijinja::{Value, context};

use crate::report::quantity::{axis, number, percent, percents};
use crate::report::section::{ReportError, Section, fill};
use crate::sim2real::diagnose::Diagnosis;

pub(in crate::report) struct Errors<'a> {
    pub diagnosis: &'a Diagnosis,
}

impl Section for Errors<'_> {
    fn id(&self) -> &'static str {
        "errors"
    }

    fn title(&self) -> &'static str {
        "Proof"
    }

    fn render(&self) -> Result<String, ReportError> {
        if self.diagnosis.fit.is_empty() {
            return Ok(String::new());
        }
        let rows: Vec<Value> = self
            .diagnosis
            .fit
            .iter()
            .map(|f| {
                let [low, high] = f.improvement_ci95;
                context! {
                    channel => axis(&f.channel, &f.unit),
                    floor => number(f.noise_floor),
                    rmse => [f.nominal_rmse, f.recalibrated_rmse, f.trued_rmse].map(number).to_vec(),
                    mae => [f.nominal_mae, f.recalibrated_mae, f.trued_mae].map(number).to_vec(),
                    improvement => percents(low, high),
                    ratio => number(f.trued_rmse / f.noise_floor),
                }
            })
            .collect();
        let by_recording: Vec<Value> = self
            .diagnosis
            .location
            .recordings
            .iter()
            .map(|e| {
                context! {
                    recording => &e.recording,
                    channel => axis(&e.channel, &e.unit),
                    share => percent(e.share_of_error),
                    rmse => [e.nominal_rmse, e.recalibrated_rmse, e.trued_rmse].map(number).to_vec(),
                    rows => e.rows,
                }
            })
            .collect();
        let placebo = self.diagnosis.checks.placebo_p.map(percent);
        let held_out = &self.diagnosis.held_out;
        fill(
            "errors.html",
            include_str!("../templates/errors.html"),
            context! { rows => rows, by_recording => by_recording, placebo => placebo, held_out => held_out },
        )
    }
}
