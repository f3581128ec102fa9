//! The audit for lookahead: no decision may depend on what came after it, no fill on what was not there.
//!
//! The future after an instant is cut off, and changed; whatever was decided up to that instant must stay the same, to the
//! last bit. That holds for any strategy and any engine, because it looks at neither.

mod fills;
mod future;
mod known_early;
mod trace;

use std::sync::atomic::{AtomicUsize, Ordering};

use rand::RngExt;
use rayon::prelude::*;
use serde::Serialize;

use crate::sim2real::{Seed, Timestamp};

use super::{Backtest, BacktestError, History, Record, Strategy};

pub use fills::{FillFault, Impossible};
pub use future::Change;
pub(super) use future::with_future;
pub use known_early::KnownEarly;
pub(super) use trace::{Decision, Trace, difference, trace};
pub use trace::{Difference, Subject};

/// What runs a strategy: [`Backtest::run`], or what is to be audited in its place.
pub type Engine<'a> = &'a (dyn Fn(&Backtest, &mut dyn Strategy) -> Result<Record, BacktestError> + Sync);

/// How much an audit does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AuditSettings {
    /// Number of instants after which the future is changed: half of them are times of decisions.
    pub cuts: usize,
    /// Where the instants and the other futures come from.
    pub seed: Seed,
}

/// What an audit comes to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum AuditVerdict {
    /// Nothing depends on its future.
    Clean,
    /// Something depends on its future.
    Lookahead,
    /// There are fills that cannot be.
    ImpossibleFills,
    /// Two runs on the same data differ, so that nothing can be said of the future: a strategy must not keep a state from
    /// run to run, nor draw from anything but a seed among its parameters.
    NotRepeatable,
}

/// What was found at one instant.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Cut {
    /// The instant [ns since the Unix epoch, UTC].
    pub at: Timestamp,
    /// Orders asked for up to it, and compared.
    pub decisions: usize,
    /// What differs, by what was done to the future; empty where nothing does.
    pub found: Vec<(Change, Difference)>,
}

/// What an audit found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Audit {
    /// [`Audit::SCHEMA`].
    pub schema: &'static str,
    /// What it comes to.
    pub verdict: AuditVerdict,
    /// The same in a sentence or two.
    pub summary: String,
    /// The strategy.
    pub strategy: String,
    /// Orders it asked for in all.
    pub decisions: usize,
    /// Fills that were looked at.
    pub fills: usize,
    /// What differs between two runs on the same data.
    pub not_repeatable: Option<Difference>,
    /// The instants, in order.
    pub cuts: Vec<Cut>,
    /// Number of fills that cannot be.
    pub impossible: usize,
    /// The first of them, at most [`Audit::FAULTS_KEPT`].
    pub impossible_fills: Vec<FillFault>,
    /// Bars that are known before they end.
    pub known_early: Vec<KnownEarly>,
    /// Symbols of which the data cannot tell whether bars are known early: there is nothing finer to compare with.
    pub untold: Vec<String>,
}

impl Audit {
    /// The schema, with its version.
    pub const SCHEMA: &'static str = "trueup.audit/1";
    /// How many impossible fills are kept with all that is known of them.
    pub const FAULTS_KEPT: usize = 100;
}

/// Audits the strategies `make` gives, each fresh, on `backtest`. `make` is given the data the strategy will run on; one
/// that keeps its contract has no use for them, and one that looks them up is found out. `told` hears how many runs of how
/// many are done.
///
/// # Errors
/// If the backtest itself cannot run, or `make` cannot make a strategy.
pub fn audit<F, E>(
    backtest: &Backtest,
    make: F,
    settings: AuditSettings,
    told: &(dyn Fn(usize, usize) + Sync),
) -> Result<Audit, E>
where
    F: Fn(&[History]) -> Result<Box<dyn Strategy>, E> + Sync,
    E: From<BacktestError> + Send,
{
    audit_engine(backtest, make, &|backtest, strategy| backtest.run(strategy), settings, told)
}

/// As [`audit`], of the strategies together with the `engine` that runs them.
///
/// # Errors
/// If the engine cannot run the backtest as it is, or `make` cannot make a strategy.
pub fn audit_engine<F, E>(
    backtest: &Backtest,
    make: F,
    engine: Engine<'_>,
    settings: AuditSettings,
    told: &(dyn Fn(usize, usize) + Sync),
) -> Result<Audit, E>
where
    F: Fn(&[History]) -> Result<Box<dyn Strategy>, E> + Sync,
    E: From<BacktestError> + Send,
{
    let run =
        |backtest: &Backtest| -> Result<Trace, E> { Ok(trace(engine, backtest, make(backtest.histories())?.as_mut())) };
    let runs = 2 * settings.cuts + 2;
    told(0, runs);
    let was = run(backtest)?;
    let record = was.record.clone()?;
    let about = backtest.instruments();
    let not_repeatable = difference(&was, &run(backtest)?, Timestamp::MAX, about);
    let mut impossible = fills::impossible(backtest, &record);
    let mut cuts = Vec::new();
    // Of runs that differ by themselves no difference means anything.
    if not_repeatable.is_none() {
        let done = AtomicUsize::new(2);
        let look = |now: &Timestamp| {
            let mut cut = Cut { at: *now, decisions: decided(&was.decisions, *now), found: Vec::new() };
            let mut seen = Vec::new();
            for change in Change::ALL {
                let other = run(&with_future(backtest, *now, change, settings.seed)?)?;
                cut.found.extend(difference(&was, &other, *now, about).map(|found| (change, found)));
                if let (Change::CutOff, Ok(record)) = (change, &other.record) {
                    seen = fills::at_seen_prices(backtest, record, *now);
                }
                told(done.fetch_add(1, Ordering::Relaxed) + 1, runs);
            }
            Ok((cut, seen))
        };
        let looked = instants(backtest.histories(), &was.decisions, settings);
        for (cut, seen) in looked.par_iter().map(look).collect::<Result<Vec<_>, E>>()? {
            cuts.push(cut);
            impossible.extend(seen);
        }
    }
    let (known_early, untold) = known_early::known_early(backtest);
    let mut audit = Audit {
        schema: Audit::SCHEMA,
        verdict: AuditVerdict::Clean,
        summary: String::new(),
        strategy: make(backtest.histories())?.name().to_owned(),
        decisions: was.decisions.len(),
        fills: record.blotter.fills.len(),
        not_repeatable,
        cuts,
        impossible: impossible.len(),
        impossible_fills: impossible.into_iter().take(Audit::FAULTS_KEPT).collect(),
        known_early,
        untold,
    };
    audit.verdict = audit.judged();
    audit.summary = audit.told();
    Ok(audit)
}

fn decided(decisions: &[Decision], now: Timestamp) -> usize {
    decisions.partition_point(|decision| decision.time <= now)
}

impl Audit {
    /// The earliest difference there is, with the instant and what was done to the future after it.
    #[must_use]
    pub fn first(&self) -> Option<(&Cut, Change, &Difference)> {
        let all = self.cuts.iter().flat_map(|cut| cut.found.iter().map(move |(change, found)| (cut, *change, found)));
        all.min_by_key(|(cut, _, found)| (found.time, cut.at))
    }

    fn judged(&self) -> AuditVerdict {
        let ahead = |fault: &FillFault| matches!(fault.fault, Impossible::BeforeDecision | Impossible::SeenPrice);
        match () {
            () if self.not_repeatable.is_some() => AuditVerdict::NotRepeatable,
            () if self.first().is_some() || !self.known_early.is_empty() => AuditVerdict::Lookahead,
            () if self.impossible_fills.iter().any(ahead) => AuditVerdict::Lookahead,
            () if self.impossible > 0 => AuditVerdict::ImpossibleFills,
            () => AuditVerdict::Clean,
        }
    }

    fn told(&self) -> String {
        let name = &self.strategy;
        if let Some(found) = &self.not_repeatable {
            return format!(
                "Two runs of {name} on the same data differ from {} on: it draws at random or keeps a state from run to run, so that nothing can be said of lookahead.",
                found.time
            );
        }
        let mut said = Vec::new();
        if let Some((cut, change, found)) = self.first() {
            let (subject, at) = (found.subject.word(), cut.at);
            let how = change.words();
            said.push(format!(
                "{name} sees the future: its {subject} at {} is another when what is known after {at} is {how}.",
                found.time
            ));
        }
        for early in &self.known_early {
            let KnownEarly { instrument, seconds, .. } = early;
            said.push(format!("The bars of {instrument} are known {seconds} s before they end: their closes are those of quotes that much later."));
        }
        if let Some(fault) = self.impossible_fills.first() {
            let (count, words) = (self.impossible, fault.fault.words());
            said.push(format!(
                "{count} fills cannot be; the first, of order {} at {}: {words}.",
                fault.order_id, fault.filled_at
            ));
        }
        if said.is_empty() && self.decisions == 0 {
            said.push(format!("{name} asked for no order, so that there was nothing to compare."));
        } else if said.is_empty() {
            let (cuts, most) = (self.cuts.len(), self.cuts.iter().map(|cut| cut.decisions).max().unwrap_or(0));
            said.push(format!("No lookahead was found: after none of {cuts} instants did a changed or missing future change one of the orders before it, up to {most} of them."));
        }
        said.join(" ")
    }
}

/// The instants: as many times of decisions as of other events, where there are so many, each drawn from its own stretch
/// of the run. Nothing follows the last event, which is none of them.
fn instants(histories: &[History], decisions: &[Decision], settings: AuditSettings) -> Vec<Timestamp> {
    let mut events = known_times(histories);
    events.dedup();
    let last = events.pop();
    let mut decided: Vec<Timestamp> =
        decisions.iter().map(|decision| decision.time).filter(|time| Some(*time) != last).collect();
    decided.dedup();
    let at_decisions = (settings.cuts / 2).min(decided.len());
    let drawn = |all: &[Timestamp], count: usize, name: &str| -> Vec<Timestamp> {
        let mut rng = settings.seed.child("audit").stream(name);
        let count = count.min(all.len());
        let one = |k: usize| {
            let (from, to) = (all.len() * k / count, all.len() * (k + 1) / count);
            all[rng.random_range(from..to)]
        };
        (0..count).map(one).collect()
    };
    let mut all = drawn(&decided, at_decisions, "decisions");
    all.extend(drawn(&events, settings.cuts - at_decisions, "events"));
    all.sort_unstable();
    all.dedup();
    all
}

/// When each bar and quote was known, in order.
pub(super) fn known_times(histories: &[History]) -> Vec<Timestamp> {
    let mut times: Vec<Timestamp> = histories
        .iter()
        .flat_map(|h| h.bars().iter().map(|bar| bar.known_at).chain(h.quotes().times().iter().copied()))
        .collect();
    times.sort_unstable();
    times
}
