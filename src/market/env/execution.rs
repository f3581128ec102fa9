//! Execution that is drawn anew for every episode: parameters of mechanisms, and latencies.

use crate::market::{Execution, Latencies, Latency};
use crate::rl::{Episode, InfoChannel};
use crate::sim2real::randomize::{DrawTable, Level, Occasion, Randomized, Randomizer, Redraw, Target, Turn};
use crate::sim2real::{Assembly, Seed, Simulator, Twin};

use super::error::MarketEnvError;

/// Distributions over what stands between decision and fill. Targets are parameters of the venue's mechanisms, and `latency.feed`,
/// `latency.order`, `latency.response` and `latency.compute` [s], which are then constant over an episode.
#[derive(Debug, Clone, PartialEq)]
pub struct DrawnExecution {
    /// What is drawn, and how.
    pub randomizer: Randomizer,
    /// How much of it.
    pub level: Level,
}

/// Where a drawn value goes.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Place {
    /// A parameter of the venue, by its number.
    Venue(usize),
    /// A latency, by its number.
    Latency(usize),
}

/// The kinds of latencies that can be drawn.
const LATENCIES: [&str; 4] = ["feed", "order", "response", "compute"];

/// Draws for episodes.
#[derive(Debug, Clone)]
pub(super) struct Draws {
    execution: DrawnExecution,
    places: Vec<Place>,
    nominal: DrawTable,
}

impl Draws {
    /// Draws for runs at `venue`.
    ///
    /// # Errors
    /// A parameter the venue does not have, or that is drawn anew within an episode.
    pub fn new(execution: DrawnExecution, venue: &Assembly<Execution>) -> Result<Self, MarketEnvError> {
        let within = |one: &&Randomized| !matches!(one.at, Redraw::Startup | Redraw::Reset);
        if let Some(one) = execution.randomizer.randomized().iter().find(within) {
            return Err(MarketEnvError::Within { target: one.target.to_string() });
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
        Ok(Self { places, nominal: execution.randomizer.nominal(1), execution })
    }

    /// What is drawn, with its unit.
    pub fn channels(&self) -> Vec<InfoChannel> {
        let all = self.execution.randomizer.randomized().iter();
        all.map(|one| InfoChannel::new(one.target.to_string(), one.parameter.unit.clone())).collect()
    }

    /// The venue and the latencies of an episode, and what was drawn for it.
    pub fn draw(
        &self,
        episode: Episode,
        venue: &Assembly<Execution>,
        latencies: &Latencies,
    ) -> (Assembly<Execution>, Latencies, Vec<f64>) {
        let DrawnExecution { randomizer, level } = &self.execution;
        let (seed, mut table) = (Seed(episode.seed), self.nominal.clone());
        let turn = |occasion, episode| (occasion, Turn { environment: 0, episode });
        for (occasion, turn) in [turn(Occasion::Startup, 0), turn(Occasion::Reset, episode.number)] {
            randomizer.redraw(&mut table, 0, seed, occasion, turn, *level);
        }
        let drawn: Vec<f64> = table.environment(0).collect();
        let mut values: Vec<f64> = venue.parameters().iter().map(|parameter| parameter.nominal).collect();
        let mut latencies = latencies.clone();
        for (place, value) in self.places.iter().zip(&drawn) {
            match place {
                Place::Venue(k) => values[*k] = *value,
                Place::Latency(k) => {
                    let Latencies { feed, order, response, compute, .. } = &mut latencies;
                    if let Some(own) = [feed, order, response, compute].into_iter().nth(*k) {
                        *own = Latency::Constant { seconds: value.clamp(0.0, Latency::LONGEST) };
                    }
                }
            }
        }
        (venue.clone().with_values(&values), latencies, drawn)
    }
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
