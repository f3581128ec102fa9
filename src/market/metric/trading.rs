//! What round trips came to, taken together.

use serde::Serialize;

use super::{RoundTrip, defined};
use crate::market::Side;

/// Figures of the round trips that were closed, after fees, in the currency of the run at the rates of their ends; a trip that gained nothing is neither won nor lost.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Trading {
    /// Trips closed.
    pub closed: usize,
    /// Trips under way at the end, which no other figure counts.
    pub open: usize,
    /// Of those closed, how many were long.
    pub long: usize,
    /// Of those closed, how many were short.
    pub short: usize,
    /// Part of the trips that gained.
    pub hit_rate: Option<f64>,
    /// Sum of what was won over sum of what was lost; none where nothing was lost.
    pub profit_factor: Option<f64>,
    /// Mean gain of a trip [currency].
    pub expectancy: Option<f64>,
    /// Mean gain of a trip over what was entered (a fraction).
    pub mean_return: Option<f64>,
    /// Mean gain of those that gained [currency].
    pub average_win: Option<f64>,
    /// Mean gain of those that lost [currency], below 0.
    pub average_loss: Option<f64>,
    /// The largest gain [currency]; none where no trip gained.
    pub largest_win: Option<f64>,
    /// The largest loss [currency], below 0; none where no trip lost.
    pub largest_loss: Option<f64>,
    /// Mean time from the first fill to the last [s].
    pub mean_seconds: Option<f64>,
}

impl Trading {
    /// The figures of `trips`.
    #[must_use]
    pub fn of(trips: &[RoundTrip]) -> Self {
        let closed: Vec<&RoundTrip> = trips.iter().filter(|trip| trip.exited_at.is_some()).collect();
        let net: Vec<f64> = closed.iter().map(|trip| trip.net.to_f64() * trip.rate).collect();
        let wins: Vec<f64> = net.iter().copied().filter(|gain| *gain > 0.0).collect();
        let losses: Vec<f64> = net.iter().copied().filter(|gain| *gain < 0.0).collect();
        let growths: Vec<f64> = closed.iter().filter_map(|trip| trip.growth()).collect();
        let long = closed.iter().filter(|trip| trip.side == Side::Buy).count();
        Self {
            closed: closed.len(),
            open: trips.len() - closed.len(),
            long,
            short: closed.len() - long,
            hit_rate: defined(wins.len() as f64 / closed.len() as f64),
            profit_factor: defined(sum(&wins) / -sum(&losses)),
            expectancy: mean(&net),
            mean_return: mean(&growths),
            average_win: mean(&wins),
            average_loss: mean(&losses),
            largest_win: wins.iter().copied().reduce(f64::max),
            largest_loss: losses.iter().copied().reduce(f64::min),
            mean_seconds: mean(&closed.iter().map(|trip| trip.seconds).collect::<Vec<_>>()),
        }
    }
}

fn sum(values: &[f64]) -> f64 {
    values.iter().sum()
}

/// The mean; none of nothing.
fn mean(values: &[f64]) -> Option<f64> {
    defined(sum(values) / values.len() as f64)
}
