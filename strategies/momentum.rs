//! `momentum`: time-series momentum, the same risk in each instrument.

use serde::Deserialize;

use crate::market::indicator::{EwmaVolatility, Indicator, Period, RateOfChange};
use crate::market::{EventKind, Orders, Quantity, Strategy, View};

use super::{Kind, StrategyError, check_period, check_weight, most_of_it, read, yes};

/// Long an instrument whose price has risen over the last `lookback` bars, short one whose price has fallen, with a size
/// such that each instrument has a volatility of `volatility` a year; anew every `rebalance` bars.
///
/// T. J. Moskowitz, Y. H. Ooi and L. H. Pedersen, "Time series momentum", Journal of Financial Economics 104 (2012): the
/// sign of the return over twelve months, 40 % over the volatility known before, averaged over the instruments, each month.
/// Their volatility is an exponential one whose weights have their centre of mass 60 days back; here its returns count from
/// 0 and not from their mean. An instrument without bars is never traded.
#[derive(Debug, Clone)]
pub struct Momentum {
    parameters: Parameters,
    fresh: State,
    states: Vec<State>,
}

pub(super) const KIND: Kind = Kind {
    name: "momentum",
    about: "long what has risen over `lookback` bars, short what has fallen, sized to a volatility",
    example: include_str!("momentum.toml"),
    parameters: &["lookback", "rebalance", "volatility", "volatility_bars", "bars_per_year", "short", "weight"],
    instruments: 1,
    build: |parameters| Ok(Box::new(Momentum::new(read(&KIND, parameters)?)?)),
};

/// Parameters of [`Momentum`].
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// Number of bars of the return whose sign counts.
    pub lookback: usize,
    /// Number of bars from one rebalancing to the next.
    pub rebalance: usize,
    /// Standard deviation that a position's return in a year is to have [fraction of its instrument's share of equity].
    pub volatility: f64,
    /// How many bars back the weights of the volatility have their centre of mass.
    pub volatility_bars: usize,
    /// Bars in a year: what turns a bar's volatility into a year's.
    pub bars_per_year: f64,
    /// Whether to be short what has fallen.
    #[serde(default = "yes")]
    pub short: bool,
    /// Largest part of the equity to hold, shared evenly among the instruments of the run.
    #[serde(default = "most_of_it")]
    pub weight: f64,
}

#[derive(Debug, Clone)]
struct State {
    trend: RateOfChange,
    change: RateOfChange,
    volatility: EwmaVolatility,
    /// Bars left until the next rebalancing.
    wait: usize,
}

impl Momentum {
    /// A strategy with the given parameters.
    ///
    /// # Errors
    /// If a number of bars is not from 1 to 1,000,000, or `volatility`, `bars_per_year` or the weight is not above 0.
    pub fn new(parameters: Parameters) -> Result<Self, StrategyError> {
        let trend = check_period(&KIND, "lookback", parameters.lookback, 1)?;
        check_period(&KIND, "rebalance", parameters.rebalance, 1)?;
        let centre = check_period(&KIND, "volatility_bars", parameters.volatility_bars, 1)?;
        for (parameter, value, hint) in [
            ("volatility", parameters.volatility, "it is a standard deviation of a year's return above 0, as 0.4"),
            (
                "bars_per_year",
                parameters.bars_per_year,
                "it is a number above 0: 252 for days, 98280 for minutes of 6.5 hours",
            ),
        ] {
            if !(value.is_finite() && value > 0.0) {
                return Err(StrategyError::Value { kind: KIND.name, parameter, value: value.to_string(), hint });
            }
        }
        check_weight(&KIND, parameters.weight)?;
        let fresh = State {
            trend: RateOfChange::new(trend),
            change: RateOfChange::new(Period::ONE),
            volatility: EwmaVolatility::centred(centre),
            wait: 0,
        };
        Ok(Self { parameters, fresh, states: Vec::new() })
    }

    /// The part of an instrument's share of equity to hold, negative for short, at a trend and a volatility a bar.
    fn exposure(&self, trend: f64, volatility: f64) -> f64 {
        let sign = if trend > 0.0 {
            1.0
        } else if trend < 0.0 && self.parameters.short {
            -1.0
        } else {
            0.0
        };
        let a_year = volatility * self.parameters.bars_per_year.sqrt();
        sign * (self.parameters.volatility / a_year).min(self.parameters.weight)
    }
}

impl Strategy for Momentum {
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
        let (event, count) = (view.event(), view.instruments().len());
        let Some(bar) = view.bars(event.instrument).last().filter(|_| event.kind == EventKind::Bar) else { return };
        if self.states.len() < count {
            self.states.resize(count, self.fresh.clone());
        }
        let state = &mut self.states[event.instrument];
        let close = bar.close.to_f64();
        if let Some(change) = state.change.update(close) {
            state.volatility.update(change);
        }
        let (Some(trend), Some(volatility)) = (state.trend.update(close), state.volatility.value()) else { return };
        if state.wait > 0 {
            state.wait -= 1;
            return;
        }
        state.wait = self.parameters.rebalance - 1;
        // A price that has not moved for all that is remembered has no size: it would be without bounds.
        if volatility > 0.0 {
            let exposure = self.exposure(trend, volatility);
            let size = view.lots_worth(event.instrument, exposure.abs() / count as f64 * view.equity().to_f64());
            let target = if exposure < 0.0 { -size } else { size };
            orders.to_position(view, event.instrument, Quantity(target.0));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exposure_is_the_target_over_the_volatility_up_to_the_weight() {
        let parameters = Parameters {
            lookback: 252,
            rebalance: 21,
            volatility: 0.4,
            volatility_bars: 60,
            bars_per_year: 256.0,
            short: true,
            weight: 2.0,
        };
        let momentum = Momentum::new(parameters).unwrap();
        // 5 % a day is 80 % a year; 1 % is 16 %, which would take 2.5.
        assert!((momentum.exposure(0.1, 0.05) - 0.5).abs() < 1e-15);
        assert!((momentum.exposure(-0.1, 0.05) + 0.5).abs() < 1e-15);
        assert_eq!((momentum.exposure(0.1, 0.01), momentum.exposure(0.0, 0.05)), (2.0, 0.0));
        let long = Momentum::new(Parameters { short: false, ..parameters }).unwrap();
        assert_eq!(long.exposure(-0.1, 0.05), 0.0);
    }
}
