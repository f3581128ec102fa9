//! `pov`: an order as a part of the volume.

use serde::Deserialize;

use crate::market::{EventKind, Increments, Orders, Quantity, Strategy, View};

use super::{Instant, Kind, ParentOrder, StrategyError, read};

/// Works an order as a part of the volume that others trade: at each bar that began after `start` it asks for what is
/// missing of `rate` times the volume since then, but for no more than `catch_up` times the bar's volume, and at least a
/// lot. What is missing at the end is sent then, and again at each bar until all is filled; or left, where `complete` is
/// false.
///
/// The volume is that of the bars, which holds no orders of a backtest: an order of `rate` 0.1 is 1/11 of all that is
/// traded then. A part of volume that has been seen comes after it, by a bar.
///
/// Participation as in R. Almgren, C. Thum, E. Hauptmann and H. Li, "Direct estimation of equity market impact", Risk 18(7)
/// (2005). An instrument without bars is never traded.
#[derive(Debug, Clone)]
pub struct Pov {
    parameters: Parameters,
    parent: ParentOrder,
    /// Volume of each instrument since the start [units].
    volumes: Vec<f64>,
}

pub(super) const KIND: Kind = Kind {
    name: "pov",
    about: "works an order as `rate` of the volume that others trade between `start` and `end`",
    example: include_str!("pov.toml"),
    parameters: &["symbol", "side", "quantity", "start", "end", "rate", "catch_up", "complete"],
    instruments: 1,
    build: |parameters| Ok(Box::new(Pov::new(read(&KIND, parameters)?)?)),
};

/// Parameters of [`Pov`].
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// The instrument; where none is named the order is one of each of the run.
    pub symbol: Option<String>,
    /// "buy" or "sell".
    pub side: String,
    /// How much [units].
    pub quantity: f64,
    /// From when on volume counts.
    pub start: Instant,
    /// When all is to be done.
    pub end: Instant,
    /// Part of the volume to trade.
    pub rate: f64,
    /// Largest part of a bar's volume to ask for when behind; twice the rate where it is not given.
    pub catch_up: Option<f64>,
    /// Whether what is missing at the end is sent then.
    #[serde(default = "super::yes")]
    pub complete: bool,
}

impl Pov {
    /// A strategy with the given parameters.
    ///
    /// # Errors
    /// If the side is none, the quantity is not above 0, the end not after the start, or not 0 < rate <= catch_up <= 1.
    pub fn new(mut parameters: Parameters) -> Result<Self, StrategyError> {
        let Parameters { symbol, side, quantity, start, end, rate, catch_up, .. } = &parameters;
        let parent = ParentOrder::new(&KIND, symbol.as_deref(), side, *quantity, [start.0, end.0])?;
        let (rate, catch_up) = (*rate, catch_up.unwrap_or_else(|| (2.0 * rate).min(1.0)));
        let value = |parameter, value: f64, hint| {
            Err(StrategyError::Value { kind: KIND.name, parameter, value: value.to_string(), hint })
        };
        if !(rate > 0.0 && rate <= 1.0) {
            return value("rate", rate, "it is a part of the volume, above 0 and up to 1");
        }
        if !(rate..=1.0).contains(&catch_up) {
            return value("catch_up", catch_up, "it is a part of a bar's volume, from `rate` to 1");
        }
        parameters.catch_up = Some(catch_up);
        Ok(Self { parameters, parent, volumes: Vec::new() })
    }

    /// The most to ask for at a bar of `volume` [units]: a lot at least, so that thin bars add up.
    fn most(&self, volume: f64, steps: Increments) -> Quantity {
        let part = self.parameters.catch_up.unwrap_or(self.parameters.rate) * volume;
        // More than any quantity is no limit.
        Quantity::nearest(part).map_or(Quantity(i64::MAX), |part| part.max(steps.lot()))
    }
}

impl Strategy for Pov {
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
        let (event, now) = (view.event(), view.now());
        if !self.parent.concerns(view) {
            return;
        }
        let Some(bar) = view.bars(event.instrument).last().filter(|_| event.kind == EventKind::Bar) else { return };
        self.volumes.resize(view.instruments().len().max(self.volumes.len()), 0.0);
        if bar.open_at < self.parent.start() {
            return;
        }
        if now >= self.parent.end() {
            if self.parameters.complete {
                self.parent.send(view, orders, 1.0, None);
            }
            return;
        }
        self.volumes[event.instrument] += bar.volume;
        let share = self.parent.share_of(self.parameters.rate * self.volumes[event.instrument]);
        if let Some(steps) = view.instruments().get(event.instrument).and_then(|i| Increments::of(i).ok()) {
            self.parent.send(view, orders, share, Some(self.most(bar.volume, steps)));
        }
    }
}
