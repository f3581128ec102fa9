//! `trueup backtest` that stops at a moment, goes on from one, or goes on with another fill.

use std::path::{Path, PathBuf};

use clap::Args;
use serde::{Deserialize, Serialize};

use crate::io::{InputError, OutputFolder, Overwrite, RunFile};
use crate::market::{
    AnotherFill, BacktestError, Checkpoint, ForkError, InputFile, Moment, MoneyError, OrderId, PreparedRun, Price, Quantity,
    Record, Session, Strategy, explained,
};
use crate::sim2real::Timestamp;

use super::screen::Progress;
use super::stop::Stop;

/// Events between two looks at the progress.
const EVENTS_A_TURN: usize = 20_000;

/// Where a run stops, begins or parts.
#[derive(Debug, Args)]
pub(super) struct Turn {
    /// Stop at the moment of --at, and save it into this file
    #[arg(long, value_name = "FILE", requires = "at")]
    save: Option<PathBuf>,
    /// When to stop: "event:5000", "order:12" (once it was sent), or before the data of a time (RFC 3339)
    #[arg(long, value_name = "MOMENT", requires = "save", value_parser = moment)]
    at: Option<Moment>,
    /// Go on from a saved moment, held to be the same to the last bit
    #[arg(long, value_name = "FILE", conflicts_with_all = ["save", "fork"])]
    resume: Option<PathBuf>,
    /// Run once more with another fill of this order, and show both runs beside each other; --out gets the other one
    #[arg(long, value_name = "ORDER", requires = "fill_price", conflicts_with_all = ["save", "resume"])]
    fork: Option<u64>,
    /// Price of that fill
    #[arg(long, value_name = "PRICE", requires = "fork")]
    fill_price: Option<f64>,
    /// Quantity of that fill [default: all that is left of the order]
    #[arg(long, value_name = "UNITS", requires = "fork")]
    fill_quantity: Option<f64>,
}

/// What came of a run.
pub(super) enum Ran {
    /// It came to its end; beside it, the run it is a fork of.
    Whole { record: Box<Record>, beside: Option<Box<Record>> },
    /// It was stopped and saved: what to say of it.
    Saved(String),
}

/// A file of a saved moment.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Saved {
    schema: String,
    version: String,
    seed: u64,
    inputs: Vec<SavedInput>,
    moment: Checkpoint,
}

#[derive(Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct SavedInput {
    path: String,
    sha256: String,
}

const SCHEMA: &str = "trueup.checkpoint/1";

/// A run that is told how it goes.
pub(super) struct Going<'a> {
    pub file: &'a RunFile,
    pub prepared: &'a PreparedRun,
    pub progress: &'a Progress,
    /// Makes the strategy anew: a run that is repeated begins with one that remembers nothing.
    pub strategy: &'a (dyn Fn() -> Result<Box<dyn Strategy>, InputError> + Sync),
}

impl Turn {
    /// Whether the run goes through from its beginning to its end, once.
    pub fn is_none(&self) -> bool {
        self.save.is_none() && self.resume.is_none() && self.fork.is_none()
    }

    /// Refuses now what would be refused after a long run.
    pub fn check_free(&self, overwrite: Overwrite) -> Result<(), InputError> {
        let Some(path) = &self.save else { return Ok(()) };
        folder_of(path, overwrite)?.check_free(&[&name_of(path)])
    }

    /// Runs as it says.
    pub fn run(&self, going: &Going<'_>, overwrite: Overwrite) -> Result<Ran, Stop> {
        let mut strategy = (going.strategy)()?;
        let mut session = going.started()?;
        if let (Some(path), Some(at)) = (&self.save, self.at) {
            return going.saved(&mut session, strategy.as_mut(), at, path, overwrite).map(Ran::Saved);
        }
        if let Some(path) = &self.resume {
            let checkpoint = going.read(path)?;
            going.to(&mut session, strategy.as_mut(), Moment::Events(checkpoint.events))?;
            session.check(&checkpoint).map_err(|error| forked(path, &error))?;
        }
        let record = Box::new(going.finished(session, strategy.as_mut())?);
        let Some(order) = self.fork else { return Ok(Ran::Whole { record, beside: None }) };
        let fork = Box::new(going.forked(OrderId(order), self.instead(going.file)?)?);
        Ok(Ran::Whole { record: fork, beside: Some(record) })
    }

    /// What is another in the fork, in a sentence.
    pub fn instead_of_what(&self) -> String {
        let (order, price) = (self.fork.unwrap_or_default(), self.fill_price.unwrap_or_default());
        let units = self.fill_quantity.map_or_else(|| "all that is left".to_owned(), |units| units.to_string());
        format!("In the fork, order {order} is filled at {price} ({units}); from there on the strategy decides anew.")
    }

    fn instead(&self, file: &RunFile) -> Result<AnotherFill, InputError> {
        let wrong = |error: MoneyError| InputError::new(file.document().path(), error.to_string());
        let price = Price::nearest(self.fill_price.unwrap_or_default()).map_err(wrong)?;
        let quantity = self.fill_quantity.map(Quantity::nearest).transpose().map_err(wrong)?;
        Ok(AnotherFill { quantity, price })
    }
}

impl<'a> Going<'a> {
    fn started(&self) -> Result<Session, InputError> {
        self.prepared.start().map_err(|error| self.explained(&error))
    }

    fn explained(&self, error: &BacktestError) -> InputError {
        explained(self.file, error)
    }

    /// Runs up to a moment; whether it came to it.
    fn to(&self, session: &mut Session, strategy: &mut dyn Strategy, moment: Moment) -> Result<bool, InputError> {
        loop {
            let (done, of) = session.progress();
            self.progress.tell("running", done, of.unwrap_or_default());
            for _ in 0..EVENTS_A_TURN {
                if session.is_at(moment) {
                    return Ok(true);
                }
                if session.step(strategy).map_err(|error| self.explained(&error))?.is_none() {
                    return Ok(false);
                }
            }
        }
    }

    fn finished(&self, mut session: Session, strategy: &mut dyn Strategy) -> Result<Record, InputError> {
        loop {
            let (done, of) = session.progress();
            self.progress.tell("running", done, of.unwrap_or_default());
            if !session.advance(strategy, EVENTS_A_TURN).map_err(|error| self.explained(&error))? {
                break;
            }
        }
        session.finish().map_err(|error| self.explained(&error))
    }

    fn forked(&self, order: OrderId, instead: AnotherFill) -> Result<Record, InputError> {
        let (mut strategy, mut session) = ((self.strategy)()?, self.started()?);
        self.to(&mut session, strategy.as_mut(), Moment::Sent(order))?;
        let document = self.file.document().path();
        session.fill_instead(order, instead).map_err(|error| forked(document, &error))?;
        self.finished(session, strategy.as_mut())
    }

    /// Runs up to a moment and saves it.
    fn saved(
        &self,
        session: &mut Session,
        strategy: &mut dyn Strategy,
        at: Moment,
        path: &Path,
        overwrite: Overwrite,
    ) -> Result<String, Stop> {
        if !self.to(session, strategy, at)? {
            let message = format!("the run ends after {} events, before the moment of --at", session.events());
            return Err(InputError::new(self.file.document().path(), message).hint("name an earlier moment").into());
        }
        let saved = self.saved_as(session.checkpoint());
        let mut folder = folder_of(path, overwrite)?;
        folder.file(&name_of(path), format!("{}\n", serde_json::to_string_pretty(&saved)?).as_bytes())?;
        folder.finish()?;
        let when = saved.moment.time.map_or_else(|| "before its first event".to_owned(), |t| format!("at {}", Timestamp(t)));
        let path = path.display();
        Ok(format!("Stopped after {} events, {when}.\nWritten: {path}\n\nGo on with --resume {path}\n", saved.moment.events))
    }

    fn saved_as(&self, moment: Checkpoint) -> Saved {
        let provenance = &self.prepared.provenance;
        let input = |file: &InputFile| SavedInput { path: file.path.clone(), sha256: file.sha256.clone() };
        Saved {
            schema: SCHEMA.to_owned(),
            version: provenance.version.clone(),
            seed: provenance.seed,
            inputs: provenance.inputs.iter().map(input).collect(),
            moment,
        }
    }

    /// The moment in a file, which must be one of this run.
    fn read(&self, path: &Path) -> Result<Checkpoint, InputError> {
        let text = std::fs::read_to_string(path).map_err(|error| {
            InputError::new(path, format!("cannot be read ({error})")).hint("give a file that --save has written")
        })?;
        let saved: Saved = serde_json::from_str(&text).map_err(|error| {
            InputError::new(path, format!("no checkpoint: {error}")).hint("give a file that --save has written")
        })?;
        let own = self.saved_as(saved.moment.clone());
        let refuse = |message: String| Err(InputError::new(path, message).hint("run it from the start"));
        if saved.schema != own.schema || saved.version != own.version {
            return refuse(format!(
                "saved by version {} ({}), this is {} ({SCHEMA})",
                saved.version, saved.schema, own.version
            ));
        }
        if saved.seed != own.seed {
            return refuse(format!("saved with seed {}, this run has {}", saved.seed, own.seed));
        }
        let changed =
            own.inputs.iter().zip(&saved.inputs).find(|(own, saved)| own != saved).map(|(own, _)| own.path.clone());
        match changed {
            Some(input) => refuse(format!("`{input}` has changed since")),
            None if own.inputs.len() != saved.inputs.len() => refuse("the run has other files now".to_owned()),
            None => Ok(saved.moment),
        }
    }
}

fn forked(path: &Path, error: &ForkError) -> InputError {
    let text = error.to_string();
    let (message, hint) = text.split_once("\nhint: ").unwrap_or((&text, ""));
    InputError::new(path, message).hint(hint)
}

fn folder_of(path: &Path, overwrite: Overwrite) -> Result<OutputFolder, InputError> {
    OutputFolder::create(path.parent().unwrap_or(Path::new("")), overwrite)
}

fn name_of(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Reads a moment.
fn moment(text: &str) -> Result<Moment, String> {
    let expected = || format!("expected event:5000, order:12 or 2024-03-08T14:30:00Z, found {text:?}");
    match text.split_once(':') {
        Some(("event", number)) => number.parse().map(Moment::Events).map_err(|_| expected()),
        Some(("order", number)) => number.parse().map(|id| Moment::Sent(OrderId(id))).map_err(|_| expected()),
        _ => text.parse().map(Moment::Before).map_err(|_| expected()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_are_events_orders_or_times() {
        assert_eq!(moment("event:5000"), Ok(Moment::Events(5_000)));
        assert_eq!(moment("order:12"), Ok(Moment::Sent(OrderId(12))));
        assert_eq!(moment("1970-01-01T00:00:01Z"), Ok(Moment::Before(Timestamp(Timestamp::NANOS))));
        for wrong in ["", "event:", "event:-1", "order:x", "yesterday", "2024-03-08"] {
            assert!(moment(wrong).unwrap_err().contains(wrong), "{wrong}");
        }
    }
}
