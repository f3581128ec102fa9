//! Execution that is drawn anew within a run: every so many seconds, and as the regimes of its data come and go.

use std::sync::Arc;

use crate::sim2real::randomize::{DrawKey, DrawTable, Level, Occasion, Randomizer, Redraw, Turn, Within};
use crate::sim2real::{Assembly, Simulator, Timestamp, Twin};

use super::agenda::{Due, Phase};
use super::mechanism::StaleQuotes;
use super::{Execution, Latencies, Latency, Session};

/// Where a drawn value goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::market) enum Place {
    /// A parameter of the venue, by its number.
    Venue(usize),
    /// A latency, by its number among [`LATENCIES`].
    Latency(usize),
}

/// The kinds of latencies that can be drawn.
pub(in crate::market) const LATENCIES: [&str; 4] = ["feed", "order", "response", "compute"];

/// The first of them.
const FEED: usize = 0;

/// What a run draws anew, and from what.
#[derive(Debug, Clone)]
pub(in crate::market) struct Redraws {
    groups: Vec<Within>,
    /// Of all that is drawn, and of what it was when the run began.
    places: Vec<Place>,
    drawn: Vec<f64>,
    key: DrawKey,
    episode: u64,
    level: Level,
    /// When regimes of the data begin, in the order of time, and which.
    regimes: Arc<[(Timestamp, usize)]>,
}

/// What the draws of a run depend on.
#[derive(Debug, Clone, Copy)]
pub(in crate::market) struct Drawing {
    pub key: DrawKey,
    pub episode: u64,
    pub level: Level,
}

impl Redraws {
    /// What `randomizer` draws anew within a run that began with `drawn`; none where that is nothing.
    pub fn of(
        randomizer: &Randomizer,
        places: &[Place],
        drawn: &[f64],
        drawing: Drawing,
        regimes: &Arc<[(Timestamp, usize)]>,
    ) -> Option<Self> {
        let (groups, Drawing { key, episode, level }) = (randomizer.within(), drawing);
        let (places, drawn, regimes) = (places.to_vec(), drawn.to_vec(), Arc::clone(regimes));
        (!groups.is_empty()).then_some(Self { groups, places, drawn, key, episode, level, regimes })
    }

    /// Whether what is drawn changes when data are known.
    fn delays_data(&self, venue: &Assembly<Execution>) -> bool {
        let stale = venue.modelled().contains(&"stale_quotes");
        let rows = self.groups.iter().flat_map(|group| &group.rows);
        rows.map(|row| self.places[*row]).any(|place| match place {
            Place::Latency(kind) => kind == FEED,
            Place::Venue(_) => stale,
        })
    }

    /// When group `group` is due for the time of this number, from 1, in a run that began at `origin`; none where it is not again.
    fn due(&self, group: usize, time: u64, origin: Timestamp) -> Option<Timestamp> {
        match self.groups[group].at {
            Redraw::EverySeconds(seconds) => {
                let after = seconds * time as f64 * Timestamp::NANOS as f64;
                (after < i64::MAX as f64).then(|| Timestamp(origin.0.saturating_add(after as i64)))
            }
            Redraw::Regime(_) => self.regime(time, origin).map(|(at, _)| at.max(origin)),
            Redraw::Startup | Redraw::Reset | Redraw::EverySteps(_) => None,
        }
    }

    /// When the regime of this number, from 1, begins, and which it is; the one that the run begins in comes first.
    fn regime(&self, number: u64, origin: Timestamp) -> Option<(Timestamp, usize)> {
        let first = self.regimes.partition_point(|(at, _)| *at <= origin).saturating_sub(1);
        self.regimes.get(first + number as usize - 1).copied()
    }
}

/// What was drawn so far in a run under way.
#[derive(Debug, Clone)]
pub(super) struct Redrawn {
    plan: Arc<Redraws>,
    origin: Timestamp,
    /// Of all that is drawn, as it is now.
    drawn: Vec<f64>,
    /// Of all parameters of the venue, as they are now.
    values: Vec<f64>,
    latencies: Latencies,
    /// How often each group was drawn.
    times: Vec<u64>,
    scratch: Vec<DrawTable>,
}

impl Redrawn {
    pub fn new(plan: &Arc<Redraws>, venue: &Assembly<Execution>, latencies: &Latencies, origin: Timestamp) -> Self {
        Self {
            origin,
            drawn: plan.drawn.clone(),
            values: venue.parameters().iter().map(|parameter| parameter.nominal).collect(),
            latencies: latencies.clone(),
            times: vec![0; plan.groups.len()],
            scratch: plan.groups.iter().map(|group| group.randomizer.nominal(1)).collect(),
            plan: Arc::clone(plan),
        }
    }

    /// What is due first of each group.
    pub fn first(&self) -> impl Iterator<Item = (Timestamp, Phase, Due)> {
        (0..self.times.len()).filter_map(|group| self.next(group))
    }

    /// When a group is drawn next.
    fn next(&self, group: usize) -> Option<(Timestamp, Phase, Due)> {
        let at = self.plan.due(group, self.times[group] + 1, self.origin)?;
        Some((at, Phase::Before, Due::Redraw(group)))
    }

    /// Whether what is drawn changes when data are known.
    pub fn delays_data(&self, venue: &Assembly<Execution>) -> bool {
        self.plan.delays_data(venue)
    }

    fn draw(&mut self, group: usize) {
        self.times[group] += 1;
        let (own, time) = (&self.plan.groups[group], self.times[group]);
        let occasion = match own.at {
            Redraw::Regime(_) => {
                let regime = self.plan.regime(time, self.origin);
                Occasion::Regime(regime.map_or(usize::MAX, |(_, regime)| regime), time)
            }
            _ => Occasion::Interval(time),
        };
        let (turn, scratch) = (Turn { environment: 0, episode: self.plan.episode }, &mut self.scratch[group]);
        own.randomizer.redraw_by(scratch, 0, self.plan.key, occasion, turn, self.plan.level);
        for (row, value) in own.rows.iter().zip(scratch.environment(0)) {
            self.drawn[*row] = value;
            put(self.plan.places[*row], value, &mut self.values, &mut self.latencies);
        }
    }
}

/// Puts a drawn value to where it goes.
pub(in crate::market) fn put(place: Place, value: f64, values: &mut [f64], latencies: &mut Latencies) {
    match place {
        Place::Venue(k) => values[k] = value,
        Place::Latency(k) => {
            let Latencies { feed, order, response, compute, .. } = latencies;
            if let Some(own) = [feed, order, response, compute].into_iter().nth(k) {
                *own = Latency::Constant { seconds: value.clamp(0.0, Latency::LONGEST) };
            }
        }
    }
}

impl Session {
    /// Draws a group anew: from now on its parameters are these, what laws remember stays, and what is on its way arrives as it would have.
    pub(super) fn redraw(&mut self, group: usize) {
        let Some(redrawn) = &mut self.redrawn else { return };
        redrawn.draw(group);
        self.venue.retune(&redrawn.values);
        let stale = StaleQuotes::delay_before(&self.setup.venue.clone().with_values(&redrawn.values));
        self.clocks.retune(redrawn.latencies.clone(), stale);
        if let Some((at, phase, due)) = redrawn.next(group) {
            self.agenda.put(at, phase, due);
        }
    }

    /// What is drawn anew within the run, as it is now; none where that is nothing.
    pub(super) fn redrawn(&self) -> Option<&[f64]> {
        self.redrawn.as_ref().map(|redrawn| redrawn.drawn.as_slice())
    }
}
