//! `sma_cross`: long while a fast moving average of closes is above a slow one.

use serde::Deserialize;

use crate::market::{Bar, EventKind, Orders, Quantity, Strategy, View};

use super::{Kind, StrategyError, check_weight, most_of_it, read};

/// Holds an instrument while the mean of its last `fast` closes is above that of its last `slow`, and is flat (or short)
/// while it is below. It trades when that changes, not to rebalance.
///
/// The averages are kept as one difference of sums of prices, which are integers: each bar adds closes and takes some away, and
/// it is exact after any number of bars. An instrument without bars is never traded.
#[derive(Debug, Clone)]
pub struct SmaCross {
    parameters: Parameters,
    averages: Vec<Averages>,
}

pub(super) const KIND: Kind = Kind {
    name: "sma_cross",
    about: "long while the mean of the last `fast` closes is above that of the last `slow`, else flat or short",
    example: include_str!("sma_cross.toml"),
    parameters: &["fast", "slow", "short", "weight"],
    instruments: 1,
    build: |parameters| Ok(Box::new(SmaCross::new(read(&KIND, parameters)?)?)),
};

/// Parameters of [`SmaCross`].
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// Number of bars of the fast average.
    pub fast: usize,
    /// Number of bars of the slow average.
    pub slow: usize,
    /// Whether to be short while the fast average is below.
    #[serde(default)]
    pub short: bool,
    /// Part of the equity to hold, shared evenly among the instruments of the run.
    #[serde(default = "most_of_it")]
    pub weight: f64,
}

#[derive(Debug, Clone, Copy, Default)]
struct Averages {
    /// By how much the fast average is above the slow one, times the lengths of both.
    ahead: i128,
    bars: usize,
}

impl SmaCross {
    /// The most bars of an average.
    const LONGEST: usize = 1_000_000;

    /// A strategy with the given parameters.
    ///
    /// # Errors
    /// If not 1 <= fast < slow <= 1,000,000, or the weight is not above 0.
    pub fn new(parameters: Parameters) -> Result<Self, StrategyError> {
        let value = |parameter, value: usize, hint| {
            Err(StrategyError::Value { kind: KIND.name, parameter, value: value.to_string(), hint })
        };
        if parameters.fast == 0 {
            return value("fast", 0, "an average takes at least one bar");
        }
        if parameters.slow <= parameters.fast {
            return value("slow", parameters.slow, "`slow` must be above `fast`");
        }
        if parameters.slow > Self::LONGEST {
            return value("slow", parameters.slow, "an average takes at most 1,000,000 bars");
        }
        check_weight(&KIND, parameters.weight)?;
        Ok(Self { parameters, averages: Vec::new() })
    }

    /// Whether the fast average is above the slow one, once there are bars enough; none before, and where they are equal.
    #[inline]
    fn above(&mut self, instrument: usize, bars: &[Bar]) -> Option<bool> {
        let Parameters { fast, slow, .. } = self.parameters;
        let averages = self.averages.get_mut(instrument)?;
        let newest = bars.last()?.close.0;
        let leaving = |count: usize| bars.len().checked_sub(count + 1).map_or(0, |k| bars[k].close.0);
        // Sums of m and n closes are compared as n * fast and m * slow, without a division: what a bar changes of their difference.
        // Prices are above 0, so that differences of two fit.
        let times = |count: usize, price: i64| i128::from(count as i64) * i128::from(price);
        averages.ahead += times(slow, newest - leaving(fast)) - times(fast, newest - leaving(slow));
        averages.bars += 1;
        if averages.bars < slow {
            return None;
        }
        (averages.ahead != 0).then_some(averages.ahead > 0)
    }
}

impl Strategy for SmaCross {
    fn name(&self) -> &str {
        KIND.name
    }
    fn copied(&self) -> Option<Box<dyn Strategy>> {
        Some(Box::new(self.clone()))
    }

    fn lookback(&self) -> usize {
        self.parameters.slow + 1
    }

    fn on_event(&mut self, view: &View<'_>, orders: &mut Orders) {
        let event = view.event();
        if event.kind != EventKind::Bar {
            return;
        }
        if self.averages.len() < view.instruments().len() {
            self.averages.resize(view.instruments().len(), Averages::default());
        }
        let Some(above) = self.above(event.instrument, view.bars(event.instrument)) else { return };
        let coming = view.position(event.instrument) + view.working(event.instrument);
        let wanted = match (above, self.parameters.short) {
            (true, _) => 1,
            (false, true) => -1,
            (false, false) => 0,
        };
        if coming.0.signum() == wanted {
            return;
        }
        let share = self.parameters.weight / view.instruments().len() as f64;
        let size = view.lots_worth(event.instrument, share * view.equity().to_f64());
        orders.to_position(view, event.instrument, Quantity(size.0 * wanted));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::market::Price;
    use crate::sim2real::Timestamp;

    fn bars(closes: &[i64]) -> Vec<Bar> {
        let bar = |(k, close): (usize, &i64)| {
            let (open_at, price) = (Timestamp(k as i64), Price(*close));
            Bar { open_at, known_at: open_at + 1, open: price, high: price, low: price, close: price, volume: 0.0 }
        };
        closes.iter().enumerate().map(bar).collect()
    }

    /// After any number of bars the kept sums decide as sums made anew from integers do.
    #[test]
    fn kept_averages_are_exact_whatever_the_history() {
        let mut state = 1_u64;
        let closes: Vec<i64> = (0..20_000)
            .map(|_| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                1 + (state >> 40) as i64
            })
            .collect();
        let bars = bars(&closes);
        let parameters = Parameters { fast: 3, slow: 7, short: false, weight: 1.0 };
        let mut strategy = SmaCross::new(parameters).unwrap();
        strategy.averages.resize(1, Averages::default());
        for end in 1..=bars.len() {
            let window = &bars[end.saturating_sub(strategy.lookback())..end];
            let found = strategy.above(0, window);
            let sum = |count: usize| closes[end - count..end].iter().sum::<i64>();
            let expected = (end >= 7).then(|| (sum(3) * 7).cmp(&(sum(7) * 3))).filter(|o| o.is_ne()).map(|o| o.is_gt());
            assert_eq!(found, expected, "bar {end}");
        }
    }
}
