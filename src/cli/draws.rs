//! `trueup backtest --draws`: the same run with many executions.

use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;

use crate::io::{InputError, RunFile};
use crate::market::{DrawnRun, Record, RunDraws, RunOutputs};
use crate::sim2real::Seed;

use super::checkpoint::Going;
use super::screen::{Screen, titled};

/// Refuses before the work what would be refused after it: a run that does not say what is drawn.
pub(super) fn check(file: &RunFile) -> Result<(), InputError> {
    if file.randomize.is_some() || file.posterior.is_some() {
        return Ok(());
    }
    let error = file.error(&[], "--draws needs to know what is drawn, and the run has neither [randomize] nor [posterior]");
    Err(error.hint("add [randomize] with posterior = \"trued.toml\", preset = [\"execution\"] or [[randomize.parameter]]"))
}

/// `count` draws of the run `going`, whose record is `record`, in parallel: what comes of them does not depend on threads.
pub(super) fn drawn(going: &Going<'_>, record: &Record, count: usize) -> Result<RunDraws, InputError> {
    let mut draws = going.prepared.draws(going.file, record, Seed(going.file.run.seed), count)?;
    let done = AtomicUsize::new(0);
    going.progress.tell("drawing executions", 0, count);
    let one = |index: usize| -> Result<DrawnRun, InputError> {
        let run = draws.run(index, (going.strategy)()?.as_mut());
        going.progress.tell("drawing executions", done.fetch_add(1, Ordering::Relaxed) + 1, count);
        Ok(run)
    };
    let runs = (0..count).into_par_iter().map(one).collect::<Result<Vec<DrawnRun>, InputError>>()?;
    draws.runs = runs;
    Ok(draws)
}

/// What draws came to; nothing where there are none.
pub(super) fn told(outputs: &RunOutputs, screen: &Screen) -> String {
    let Some(draws) = &outputs.summary.draws else { return String::new() };
    let mut text = "\n".to_owned();
    for line in draws.about() {
        text += &format!("{}\n", screen.wrapped("", &line));
    }
    text += &titled("Figures over all draws", &screen.listing(&draws.figures_listing()));
    text + &titled("What was drawn", &screen.listing(&draws.parameters_listing()))
}
