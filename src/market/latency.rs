//! Latency: simulated time on the way of data, orders and reports.

use std::fmt;

use rand::Rng;
use rand::RngExt as _;
use rand_distr::{Distribution, Exp, LogNormal};
use serde::de::value::MapAccessDeserializer;
use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use crate::sim2real::{Draws, Seed, Timestamp};

use super::account::Ratio;

/// How long a message takes.
///
/// Source: constant and measured latency as in Moallemi & Sağlam, "The cost of latency", Operations Research 61 (2013); a
/// log-normal body with the median and the deviation of the logarithm, as round trips of networks have it, Downey, "Lognormal and
/// Pareto distributions in the Internet", Computer Communications 28 (2005).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", tag = "kind", deny_unknown_fields)]
pub enum Latency {
    /// Always the same.
    Constant {
        /// How long [s].
        seconds: f64,
    },
    /// Anything between two bounds.
    Uniform {
        /// The least [s].
        least: f64,
        /// The most [s].
        most: f64,
    },
    /// At least so long, and beyond that exponential.
    Exponential {
        /// The least [s].
        least: f64,
        /// Mean of what is beyond it [s].
        mean: f64,
    },
    /// Log-normal.
    LogNormal {
        /// The median [s].
        median: f64,
        /// Standard deviation of the natural logarithm.
        sigma: f64,
    },
    /// One of those that were measured.
    Measured {
        /// What was measured [s].
        seconds: Vec<f64>,
    },
}

/// A latency that cannot be.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("the latency's {what} is {value}\nhint: {hint}")]
pub struct LatencyError {
    what: &'static str,
    value: f64,
    hint: &'static str,
}

impl fmt::Display for Latency {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Constant { seconds } => write!(f, "{seconds} s"),
            Self::Uniform { least, most } => write!(f, "{least} to {most} s, evenly"),
            Self::Exponential { least, mean } => write!(f, "{least} s, and beyond that exponential with a mean of {mean} s"),
            Self::LogNormal { median, sigma } => write!(f, "log-normal with a median of {median} s and a sigma of {sigma}"),
            Self::Measured { seconds } => write!(f, "one of {} that were measured", seconds.len()),
        }
    }
}

impl Latency {
    /// No latency.
    pub const NONE: Self = Self::Constant { seconds: 0.0 };
    /// The longest that a message may take [s].
    pub const LONGEST: f64 = 86_400.0;

    /// Holds its parameters to what they can be.
    ///
    /// # Errors
    /// A time that is negative, not finite or longer than a day; bounds in the wrong order; nothing measured.
    pub fn check(&self) -> Result<(), LatencyError> {
        let time = |what, value: f64| {
            let hint = "it is a time in seconds, from 0 to 86400";
            if (0.0..=Self::LONGEST).contains(&value) { Ok(()) } else { Err(LatencyError { what, value, hint }) }
        };
        match self {
            Self::Constant { seconds } => time("seconds", *seconds),
            Self::Uniform { least, most } => {
                time("least", *least)?;
                time("most", *most)?;
                let hint = "it must not be below `least`";
                if most < least { Err(LatencyError { what: "most", value: *most, hint }) } else { Ok(()) }
            }
            Self::Exponential { least, mean } => {
                time("least", *least)?;
                time("mean", *mean)
            }
            Self::LogNormal { median, sigma } => {
                time("median", *median)?;
                let hint = "it is the standard deviation of the logarithm, from 0 to 10";
                if (0.0..=10.0).contains(sigma) { Ok(()) } else { Err(LatencyError { what: "sigma", value: *sigma, hint }) }
            }
            Self::Measured { seconds } => {
                let hint = "give at least one measured time";
                if seconds.is_empty() {
                    return Err(LatencyError { what: "number of measured times", value: 0.0, hint });
                }
                seconds.iter().try_for_each(|value| time("measured time", *value))
            }
        }
    }

    /// Whether it is always 0.
    #[must_use]
    pub fn is_none(&self) -> bool {
        *self == Self::NONE
    }

    /// A draw [s].
    fn draw(&self, rng: &mut impl Rng) -> f64 {
        match self {
            Self::Constant { seconds } => *seconds,
            Self::Uniform { least, most } => least + (most - least) * rng.random::<f64>(),
            Self::Exponential { least, mean } if *mean > 0.0 => {
                least + Exp::new(1.0 / mean).map_or(0.0, |law| law.sample(rng))
            }
            Self::Exponential { least, .. } => *least,
            Self::LogNormal { median, sigma } if *median > 0.0 => {
                LogNormal::new(median.ln(), *sigma).map_or(*median, |law| law.sample(rng))
            }
            Self::LogNormal { .. } => 0.0,
            Self::Measured { seconds } => seconds.get(rng.random_range(0..seconds.len().max(1))).copied().unwrap_or(0.0),
        }
    }
}

/// What makes messages slower: the load of the market and how much it moves.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Strain {
    /// Longer by this part for every thousand events a second, averaged over the last second.
    pub per_thousand_events: f64,
    /// Longer by this part for every bp that the price moves in a second (root mean square over the last minute).
    pub per_bp_a_second: f64,
}

/// The latencies of a run: `[latency]`, where a number alone is a constant [s].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Latencies {
    /// From the exchange to the strategy: data. On top of the difference between a row's two times, where it has them.
    #[serde(deserialize_with = "number_or_law")]
    pub feed: Latency,
    /// From the strategy to the exchange: orders, on top of the mechanism `command_delay`.
    #[serde(deserialize_with = "number_or_law")]
    pub order: Latency,
    /// From the exchange to the strategy: what became of orders.
    #[serde(deserialize_with = "number_or_law")]
    pub response: Latency,
    /// What the strategy takes to decide, before its orders leave.
    #[serde(deserialize_with = "number_or_law")]
    pub compute: Latency,
    /// What makes all of them longer.
    pub strain: Strain,
}

/// Reads seconds, or a table of a law.
fn number_or_law<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Latency, D::Error> {
    struct Either;
    impl<'de> Visitor<'de> for Either {
        type Value = Latency;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str("seconds, or a table such as { kind = \"log_normal\", median = 0.001, sigma = 0.5 }")
        }

        fn visit_f64<E: serde::de::Error>(self, seconds: f64) -> Result<Latency, E> {
            Ok(Latency::Constant { seconds })
        }

        fn visit_i64<E: serde::de::Error>(self, seconds: i64) -> Result<Latency, E> {
            Ok(Latency::Constant { seconds: seconds as f64 })
        }

        fn visit_u64<E: serde::de::Error>(self, seconds: u64) -> Result<Latency, E> {
            Ok(Latency::Constant { seconds: seconds as f64 })
        }

        fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Latency, A::Error> {
            Latency::deserialize(MapAccessDeserializer::new(map))
        }
    }
    deserializer.deserialize_any(Either)
}

impl Default for Latencies {
    fn default() -> Self {
        let [feed, order, response, compute] = std::array::from_fn(|_| Latency::NONE);
        Self { feed, order, response, compute, strain: Strain::default() }
    }
}

/// Draws latencies: each kind of message from a stream of its own.
#[derive(Debug, Clone)]
pub(super) struct Clocks {
    latencies: Latencies,
    /// By how much data come later besides, whatever the strain [s].
    stale: f64,
    feed: Draws,
    order: Draws,
    response: Draws,
    compute: Draws,
    strain: Watch,
    /// When the last order, and the last report, arrives: on one line nothing overtakes.
    last: [Timestamp; 2],
}

/// What is watched to know how strained the market is.
#[derive(Debug, Clone, Copy, Default)]
struct Watch {
    at: Timestamp,
    events_a_second: f64,
    price: f64,
    variance_a_second: f64,
}

impl Clocks {
    /// Clocks of a run whose data come `stale` [s] later than by their latency.
    pub fn new(latencies: Latencies, stale: f64, seed: Seed) -> Self {
        let stream = |name: &str| seed.stream(name);
        Self {
            latencies,
            stale,
            feed: stream("latency.feed"),
            order: stream("latency.order"),
            response: stream("latency.response"),
            compute: stream("latency.compute"),
            strain: Watch::default(),
            last: [Timestamp::MIN; 2],
        }
    }

    /// Messages that leave from now on take so long; those on their way arrive as they would have.
    pub fn retune(&mut self, latencies: Latencies, stale: f64) {
        (self.latencies, self.stale) = (latencies, stale);
    }

    /// Whether anybody wants to know how strained the market is.
    pub fn watches(&self) -> bool {
        self.latencies.strain != Strain::default()
    }

    /// An event of a price is seen.
    pub fn watch(&mut self, at: Timestamp, price: f64) {
        let watch = &mut self.strain;
        let passed = at.seconds_since(watch.at).max(0.0);
        // Exponential averages with means of a second and of a minute.
        watch.events_a_second = watch.events_a_second * (-passed).exp() + 1.0;
        if watch.price > 0.0 && price > 0.0 {
            let moved = 1e4 * (price / watch.price).ln();
            watch.variance_a_second = watch.variance_a_second * (-passed / 60.0).exp() + moved * moved / 60.0;
        }
        (watch.at, watch.price) = (at, price);
    }

    /// A split is no move of the price.
    pub fn split(&mut self, ratio: Ratio) {
        self.strain.price /= ratio.to_f64();
    }

    /// By how much messages take longer than they would.
    fn longer(&self) -> f64 {
        let Strain { per_thousand_events, per_bp_a_second } = self.latencies.strain;
        1.0 + per_thousand_events * self.strain.events_a_second / 1e3
            + per_bp_a_second * self.strain.variance_a_second.max(0.0).sqrt()
    }

    /// Data of `time` reach the strategy.
    pub fn shown(&mut self, time: Timestamp) -> Timestamp {
        let seconds = self.longer() * self.latencies.feed.draw(&mut self.feed);
        later(time, seconds + self.stale)
    }

    /// When an order that leaves at `time`, or is delayed to it, arrives.
    pub fn order(&mut self, time: Timestamp) -> Timestamp {
        let thought = self.latencies.compute.draw(&mut self.compute);
        let travelled = self.longer() * self.latencies.order.draw(&mut self.order);
        self.last[0] = later(time, thought + travelled).max(self.last[0]);
        self.last[0]
    }

    /// What happened at `time` is known to the strategy.
    pub fn response(&mut self, time: Timestamp) -> Timestamp {
        let seconds = self.longer() * self.latencies.response.draw(&mut self.response);
        self.last[1] = later(time, seconds).max(self.last[1]);
        self.last[1]
    }
}

fn later(time: Timestamp, seconds: f64) -> Timestamp {
    if seconds > 0.0 { time.plus_seconds(seconds) } else { time }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_have_the_moments_of_their_law() {
        let mut rng = Seed(3).stream("test");
        let mut mean =
            |latency: Latency, of: fn(f64) -> f64| (0..40_000).map(|_| of(latency.draw(&mut rng))).sum::<f64>() / 40_000.0;
        assert_eq!(mean(Latency::Constant { seconds: 0.25 }, |x| x), 0.25);
        assert!((mean(Latency::Uniform { least: 0.1, most: 0.3 }, |x| x) - 0.2).abs() < 1e-3);
        assert!((mean(Latency::Exponential { least: 0.1, mean: 0.2 }, |x| x) - 0.3).abs() < 4e-3);
        assert!((mean(Latency::LogNormal { median: 0.02, sigma: 0.5 }, f64::ln) - 0.02_f64.ln()).abs() < 1e-2);
        assert!((mean(Latency::Measured { seconds: vec![0.1, 0.2, 0.6] }, |x| x) - 0.3).abs() < 5e-3);
    }

    #[test]
    fn what_cannot_be_is_refused() {
        for (latency, word) in [
            (Latency::Constant { seconds: -1.0 }, "seconds"),
            (Latency::Constant { seconds: f64::NAN }, "seconds"),
            (Latency::Uniform { least: 0.2, most: 0.1 }, "most"),
            (Latency::LogNormal { median: 0.1, sigma: f64::INFINITY }, "sigma"),
            (Latency::Measured { seconds: vec![] }, "measured"),
        ] {
            let error = latency.check().unwrap_err().to_string();
            assert!(error.contains(word) && error.contains("hint:"), "{error}");
        }
    }

    #[test]
    fn a_strained_market_is_slower() {
        let strain = Strain { per_thousand_events: 1.0, per_bp_a_second: 0.0 };
        let order = Latency::Constant { seconds: 0.001 };
        let mut clocks = Clocks::new(Latencies { order, strain, ..Latencies::default() }, 0.0, Seed(1));
        let start = Timestamp(1_000_000_000_000);
        assert_eq!((clocks.order(start) - start), 1_000_000);
        // 5,000 events a second, each at its 0.2 ms.
        for k in 0..50_000_i64 {
            clocks.watch(start + k * 200_000, 100.0);
        }
        let now = start + 50_000 * 200_000;
        let taken = (clocks.order(now) - now) as f64 / 1e6;
        assert!((taken - 6.0).abs() < 0.05, "{taken} ms");
    }
}
