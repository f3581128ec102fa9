//! Costs and refusals that no registry has.

use std::f64::consts::TAU;

use super::client::Intent;
use super::climate::SESSION;
use super::effect::Foreign;
use super::executed::Shown;
use super::floor::{Scene, sizes};

impl Foreign {
    /// What it adds to the cost of `order` that meets `shown` at `time` [bps].
    pub fn cost(self, time: f64, order: &Intent, shown: &Shown, scene: &Scene<'_>) -> f64 {
        match self {
            Self::TimeOfDay { bps } => {
                let part = 2.0 * time / SESSION - 1.0;
                bps * (3.0 * part * part - 1.0)
            }
            Self::RoundPrices { bps, ticks } => {
                if shown.touch(order.buys).rem_euclid(ticks) == 0 {
                    -bps
                } else {
                    bps / (ticks - 1) as f64
                }
            }
            Self::ClockPhase { bps, period } => bps * (TAU * time / period).sin(),
            Self::Side { bps } => 0.5 * bps * order.sign(),
            Self::Imbalance { bps } => {
                let row = &scene.tape.rows[shown.row];
                let [against, own] = [order.buys, !order.buys].map(|buys| sizes(row, buys, scene.usual)[0]);
                bps * (own - against) / (own + against)
            }
            Self::LastLook { .. } | Self::Turnover { .. } | Self::Followers { .. } => 0.0,
        }
    }

    /// Whether a dealer refuses `order` at `time`, knowing what comes.
    pub fn refuses(self, time: f64, order: &Intent, scene: &Scene<'_>) -> bool {
        let Self::LastLook { moved, look } = self else { return false };
        let (before, after) = (scene.tape.price_at(time), scene.tape.price_at(time + look));
        order.sign() * 1e4 * (after / before).ln() > moved
    }
}
