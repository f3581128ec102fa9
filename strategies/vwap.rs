//! `vwap`: an order in parts as large as the volume that is usual at their time.

use chrono::{NaiveTime, Timelike};
use chrono_tz::Tz;
use serde::Deserialize;

use crate::market::{EventKind, Orders, Strategy, View};
use crate::sim2real::Timestamp;

use super::volume_profile::{DAY, PastDays, Span, VolumeProfile, local};
use super::{Instant, Kind, ParentOrder, Schedule, StrategyError, read};

/// Works an order in parts, one every `interval` from `start` on, each as large as the part of the day's volume that
/// usually falls into its slice, so that its price comes near the volume-weighted average. The first event in a slice
/// brings its part, and what is missing of those before. What is missing at the end is sent then, and again once an
/// interval until all is filled.
///
/// What is usual is written as `profile`, or learned from the bars of the last `days` that have ended, in parts of
/// `interval` (a minute at least). Where there is no volume to go by between start and end the parts are equal.
///
/// The price is the measure of S. A. Berkowitz, D. E. Logue and E. A. Noser, "The total cost of transactions on the NYSE",
/// Journal of Finance 43 (1988); slices after expected volume are the static rule of H. Konishi, "Optimal slice of a VWAP
/// trade", Journal of Financial Markets 5 (2002), for volume and volatility that go together.
#[derive(Debug, Clone)]
pub struct Vwap {
    parent: ParentOrder,
    schedule: Schedule,
    zone: Tz,
    source: Source,
}

/// Where the profile comes from.
#[derive(Debug, Clone)]
enum Source {
    Written(VolumeProfile),
    Learned { fresh: PastDays, instruments: Vec<Learning> },
}

/// What is learned of an instrument: its days, until the start, and then their profile.
#[derive(Debug, Clone)]
enum Learning {
    Days(PastDays),
    Profile(VolumeProfile),
}

pub(super) const KIND: Kind = Kind {
    name: "vwap",
    about: "works an order in parts as large as the volume that is usual at their time of day",
    example: include_str!("vwap.toml"),
    parameters: &["symbol", "side", "quantity", "start", "end", "interval", "zone", "days", "profile"],
    instruments: 1,
    build: |parameters| Ok(Box::new(Vwap::new(&read(&KIND, parameters)?)?)),
};

/// Parameters of [`Vwap`].
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// The instrument; where none is named the order is one of each of the run.
    pub symbol: Option<String>,
    /// "buy" or "sell".
    pub side: String,
    /// How much [units].
    pub quantity: f64,
    /// When the first part is sent.
    pub start: Instant,
    /// When all is to be done, on the same day.
    pub end: Instant,
    /// Time from part to part [s].
    pub interval: f64,
    /// Time zone of the day, by its name in the IANA database.
    #[serde(default = "greenwich")]
    pub zone: String,
    /// Number of days a profile is learned from.
    #[serde(default = "a_month")]
    pub days: usize,
    /// The volume of each part of the day, in its order; none to learn it.
    pub profile: Option<Vec<Part>>,
}

/// A part of the day, as a profile writes it.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Part {
    /// Time of day it begins at, as "09:30".
    pub from: String,
    /// Time of day it ends at; "24:00" for the end of the day.
    pub to: String,
    /// Its volume, in any unit.
    pub weight: f64,
}

fn greenwich() -> String {
    "UTC".to_owned()
}

/// Trading days in a month.
fn a_month() -> usize {
    20
}

impl Vwap {
    /// A strategy with the given parameters.
    ///
    /// # Errors
    /// If the side is none, the quantity is not above 0, the end not after the start or on another day, the zone unknown,
    /// the interval or the number of days cannot be, or the profile is out of order or has no volume between start and end.
    pub fn new(parameters: &Parameters) -> Result<Self, StrategyError> {
        let Parameters { symbol, side, quantity, start, end, interval, zone, days, profile } = parameters;
        let value = |parameter, value: String, hint| StrategyError::Value { kind: KIND.name, parameter, value, hint };
        let parent = ParentOrder::new(&KIND, symbol.as_deref(), side, *quantity, [start.0, end.0])?;
        let schedule = Schedule::new(&KIND, &parent, *interval)?;
        let hint = "write a name of the IANA database, as \"America/New_York\"";
        let zone: Tz = zone.parse().map_err(|_| value("zone", format!("{zone:?}"), hint))?;
        // Midnight itself is the end of a day.
        if local(start.0, zone).0 != local(end.0 + -1, zone).0 {
            return Err(value("end", end.0.to_string(), "it must be on the day of `start`, in `zone`"));
        }
        if !(1..=1_000).contains(days) {
            return Err(value("days", days.to_string(), "a profile is learned from 1 to 1,000 days"));
        }
        let source = match profile {
            Some(parts) => Source::Written(written(parts)?),
            // Minutes are the finest that a few days can tell.
            None => {
                let fresh = PastDays::new(zone, interval.clamp(60.0, DAY), *days);
                Source::Learned { fresh, instruments: Vec::new() }
            }
        };
        let vwap = Self { parent, schedule, zone, source };
        if let Source::Written(profile) = &vwap.source
            && vwap.volume(profile, end.0) <= 0.0
        {
            let hint = "it has no volume between `start` and `end`; its times are those of `zone`";
            return Err(value("profile", "empty there".to_owned(), hint));
        }
        Ok(vwap)
    }

    /// What `profile` has from the start to `until`, on the day of the start.
    fn volume(&self, profile: &VolumeProfile, until: Timestamp) -> f64 {
        let (first, from) = local(self.parent.start(), self.zone);
        let (last, to) = local(until, self.zone);
        profile.between(from, if last > first { DAY } else { to })
    }

    /// The part of the order that is to be sent by `until`; none where `profile` has no volume to go by.
    fn share(&self, profile: &VolumeProfile, until: Timestamp) -> Option<f64> {
        let all = self.volume(profile, self.parent.end());
        (all > 0.0).then(|| self.volume(profile, until) / all)
    }

    /// Sees the bar of the event, until the start; then what was seen becomes a profile.
    fn learn(&mut self, view: &View<'_>) {
        let (event, start) = (view.event(), self.parent.start());
        let Source::Learned { fresh, instruments } = &mut self.source else { return };
        if instruments.len() < view.instruments().len() {
            instruments.resize(view.instruments().len(), Learning::Days(fresh.clone()));
        }
        let learning = &mut instruments[event.instrument];
        let Learning::Days(days) = learning else { return };
        if let Some(bar) = view.bars(event.instrument).last().filter(|_| event.kind == EventKind::Bar) {
            days.see(bar);
        }
        if event.time >= start {
            *learning = Learning::Profile(days.profile_before(local(start, self.zone).0));
        }
    }
}

/// The profile that is written as `parts`.
fn written(parts: &[Part]) -> Result<VolumeProfile, StrategyError> {
    let value = |value: String, hint| StrategyError::Value { kind: KIND.name, parameter: "profile", value, hint };
    let time = |text: &str| {
        let time = NaiveTime::parse_from_str(text, "%H:%M").or_else(|_| NaiveTime::parse_from_str(text, "%H:%M:%S"));
        match time {
            _ if text == "24:00" => Ok(DAY),
            Ok(time) => Ok(f64::from(time.num_seconds_from_midnight())),
            Err(_) => Err(value(format!("{text:?}"), "times of day are written as \"09:30\"")),
        }
    };
    let mut spans: Vec<Span> = Vec::new();
    for part in parts {
        let (from, to, weight) = (time(&part.from)?, time(&part.to)?, part.weight);
        if to <= from || spans.last().is_some_and(|last| from < last.to) {
            return Err(value(
                format!("{} to {}", part.from, part.to),
                "parts of the day do not overlap, and are in its order",
            ));
        }
        if !(weight.is_finite() && weight >= 0.0) {
            return Err(value(format!("a weight of {weight}"), "a weight is a volume in any unit, 0 or above"));
        }
        spans.push(Span { from, to, weight });
    }
    Ok(VolumeProfile::new(spans))
}

impl Strategy for Vwap {
    fn name(&self) -> &str {
        KIND.name
    }
    fn copied(&self) -> Option<Box<dyn Strategy>> {
        Some(Box::new(self.clone()))
    }

    fn lookback(&self) -> usize {
        1
    }

    fn on_event(&mut self, view: &View<'_>, orders: &mut Orders) {
        if !self.parent.concerns(view) {
            return;
        }
        self.learn(view);
        let Some(slice) = self.schedule.begun(view) else { return };
        let profile = match &self.source {
            Source::Written(profile) => Some(profile),
            Source::Learned { instruments, .. } => match instruments.get(view.event().instrument) {
                Some(Learning::Profile(profile)) => Some(profile),
                _ => None,
            },
        };
        let share = profile.filter(|_| slice.number + 1 < slice.of).and_then(|profile| self.share(profile, slice.until));
        let share = share.unwrap_or_else(|| slice.share());
        self.parent.send(view, orders, share, None);
    }
}
