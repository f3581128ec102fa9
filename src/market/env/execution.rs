//! Execution that is drawn anew for every episode, and within it: parameters of mechanisms, and latencies.

use std::sync::Arc;

use crate::market::redraws::{Drawing, LATENCIES, Place, Redraws, put};
use crate::market::{Execution, Latencies};
use crate::rl::{Episode, InfoChannel};
use crate::sim2real::randomize::{DrawKey, DrawTable, Level, Occasion, Randomizer, Redraw, Target, Turn};
use crate::sim2real::{Assembly, Seed, Simulator, Timestamp, Twin};

use super::error::MarketEnvError;

/// Distributions over what stands between decision and fill. Targets are parameters of the venue's mechanisms, and `latency.feed`,
/// `latency.order`, `latency.response` and `latency.compute` [s], which are then constant until they are drawn anew.
///
/// What is drawn within an episode is drawn every so many seconds of the market's time, or when a regime of the data is entered: the most
/// probable one by the model of [`FeatureSettings::regimes`](super::FeatureSettings::regimes), as it is observed.
#[derive(Debug, Clone, PartialEq)]
pub struct DrawnExecution {
    /// What is drawn, and how.
    pub randomizer: Randomizer,
    /// How much of it.
    pub level: Level,
}

/// Shortest time between draws [s].
const SHORTEST: f64 = 1e-3;

/// Draws for episodes.
#[derive(Debug, Clone)]
pub(super) struct Draws {
    execution: DrawnExecution,
    places: Vec<Place>,
    nominal: DrawTable,
    /// When regimes of the data begin, and which.
    regimes: Arc<[(Timestamp, usize)]>,
}

impl Draws {
    /// Draws for runs at `venue`, on data with these `regimes`, of which there are so many.
    ///
    /// # Errors
    /// A parameter the venue does not have, one that is drawn by steps, or in a regime that there is not.
    pub fn new(
        execution: DrawnExecution,
        venue: &Assembly<Execution>,
        (regimes, count): (Arc<[(Timestamp, usize)]>, usize),
    ) -> Result<Self, MarketEnvError> {
        for one in execution.randomizer.randomized() {
            let target = || one.target.to_string();
            match one.at {
                Redraw::EverySteps(_) => return Err(MarketEnvError::BySteps { target: target() }),
                Redraw::EverySeconds(seconds) if seconds < SHORTEST => {
                    let hint =
                        "what is drawn more often than data come is met by nobody: give a thousandth of a second or more";
                    return Err(MarketEnvError::Value { what: "a time between draws", value: seconds, hint });
                }
                Redraw::Regime(regime) if regime >= count => {
                    return Err(MarketEnvError::NoSuchRegime { target: target(), regime, count });
                }
                _ => {}
            }
        }
        let place = |target: &Target| {
            let latency = || LATENCIES.iter().position(|name| *name == target.parameter).map(Place::Latency);
            let found = match target.mechanism.as_deref() {
                Some("latency") => latency(),
                _ => parameter(venue, target).map(Place::Venue),
            };
            found.ok_or_else(|| MarketEnvError::UnknownTarget {
                target: target.to_string(),
                known: venue.modelled().into_iter().chain(["latency"]).collect::<Vec<_>>().join(", "),
            })
        };
        let targets = execution.randomizer.randomized().iter().map(|one| &one.target);
        let places = targets.map(place).collect::<Result<_, _>>()?;
        Ok(Self { places, nominal: execution.randomizer.nominal(1), execution, regimes })
    }

    /// What is drawn, with its unit.
    pub fn channels(&self) -> Vec<InfoChannel> {
        let all = self.execution.randomizer.randomized().iter();
        all.map(|one| InfoChannel::new(one.target.to_string(), one.parameter.unit.clone())).collect()
    }

    /// What is drawn for an episode at `venue` with these `latencies`.
    pub fn draw(&self, episode: Episode, venue: &Assembly<Execution>, latencies: &Latencies) -> DrawnEpisode {
        let DrawnExecution { randomizer, level } = &self.execution;
        let (seed, mut table) = (Seed(episode.seed), self.nominal.clone());
        let turn = |occasion, episode| (occasion, Turn { environment: 0, episode });
        for (occasion, turn) in [turn(Occasion::Startup, 0), turn(Occasion::Reset, episode.number)] {
            randomizer.redraw(&mut table, 0, seed, occasion, turn, *level);
        }
        let drawn: Vec<f64> = table.environment(0).collect();
        let mut values: Vec<f64> = venue.parameters().iter().map(|parameter| parameter.nominal).collect();
        let mut latencies = latencies.clone();
        self.places.iter().zip(&drawn).for_each(|(place, value)| put(*place, *value, &mut values, &mut latencies));
        let drawing = Drawing { key: DrawKey::new(seed), episode: episode.number, level: *level };
        let redraws = Redraws::of(randomizer, &self.places, &drawn, drawing, &self.regimes).map(Arc::new);
        DrawnEpisode { venue: venue.clone().with_values(&values), latencies, drawn, redraws }
    }
}

/// What was drawn for an episode.
pub(super) struct DrawnEpisode {
    pub venue: Assembly<Execution>,
    pub latencies: Latencies,
    /// All that is drawn, in the order of [`Draws::channels`].
    pub drawn: Vec<f64>,
    /// What is drawn anew within it.
    pub redraws: Option<Arc<Redraws>>,
}

/// The number of a parameter of `venue`.
fn parameter(venue: &Assembly<Execution>, target: &Target) -> Option<usize> {
    let Some(id) = &target.mechanism else {
        return venue.own().iter().position(|parameter| parameter.name == target.parameter);
    };
    let mut first = venue.own().len();
    for (mechanism, _, parameters) in venue.mechanisms() {
        if mechanism.about().name == id {
            return parameters.iter().position(|parameter| parameter.name == target.parameter).map(|k| first + k);
        }
        first += parameters.len();
    }
    None
}
