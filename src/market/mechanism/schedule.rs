//! A schedule of child orders of one's own, and what a law makes them pay. For tests.

use crate::market::{Book, Execution, ExecutionEffect, InFlight, Met, Role, Side};
use crate::sim2real::{Dynamics, Law, Mechanism, Scene, Seed, Thetas, Tick, Timestamp};

/// Units traded on an average day, and the price of all there is.
pub(super) const DAILY: f64 = 1e6;
pub(super) const MID: f64 = 50.0;

/// An order of a schedule.
#[derive(Debug, Clone, Copy)]
pub(super) struct Child {
    /// When it meets the market [s].
    pub time: f64,
    /// Part of an average day's volume that it is, negative for a sale.
    pub size: f64,
    pub role: Role,
}

impl Child {
    pub fn signed(time: f64, size: f64) -> Self {
        Self { time, size, role: Role::Taker }
    }

    pub fn bought(time: f64, size: f64) -> Self {
        Self::signed(time, size)
    }

    pub fn sold(time: f64, size: f64) -> Self {
        Self::signed(time, -size)
    }

    fn order(self) -> InFlight {
        let side = if self.size < 0.0 { Side::Sell } else { Side::Buy };
        let at = Timestamp(0).plus_seconds(self.time);
        let order = InFlight::market(side, DAILY * self.size.abs(), at, MID, MID).as_a(self.role);
        InFlight { average_daily_volume: Some(DAILY), daily_volatility: Some(0.02), ..order }
    }
}

/// What `law` adds to the price of `order` at `time` [s], one lane.
pub(super) fn concession(law: &mut dyn Law<Execution>, time: f64, order: InFlight) -> f64 {
    acted(law, time, order, 0.0).paid(&order, &Met::at(Book::at_price(order.decided_at, MID), MID, f64::INFINITY))
}

/// What `law` does to `child` where so much is `displayed` at its price [units].
pub(super) fn effect(law: &mut dyn Law<Execution>, child: Child, displayed: f64) -> ExecutionEffect {
    acted(law, child.time, child.order(), displayed)
}

fn acted(law: &mut dyn Law<Execution>, time: f64, order: InFlight, displayed: f64) -> ExecutionEffect {
    let book = Book::at_price(order.decided_at, MID);
    let met = Met { displayed, ..Met::at(book, MID, f64::INFINITY) };
    let states = Execution.initial(&Thetas::single(&[]));
    let scene = Scene { dynamics: &Execution, states: &states, inputs: &[met], commands: &[order] };
    let mut effects = [ExecutionEffect::default()];
    law.act(Tick { index: 0, time, step: 0.0 }, &scene, &mut effects);
    effects[0]
}

/// What each of `children` concedes to form `form` of `mechanism` with the values `theta` [bps of the mid].
pub(super) fn concessions(mechanism: &dyn Mechanism<Execution>, form: usize, theta: &[f64], children: &[Child]) -> Vec<f64> {
    let mut law = mechanism.law(form, &Thetas::single(theta), Seed(1));
    let bps = |child: &Child| concession(law.as_mut(), child.time, child.order()) / MID * 1e4;
    children.iter().map(bps).collect()
}

/// What they pay in all [bps of the price of an average day's volume].
pub(super) fn paid(mechanism: &dyn Mechanism<Execution>, form: usize, theta: &[f64], children: &[Child]) -> f64 {
    concessions(mechanism, form, theta, children).iter().zip(children).map(|(bps, child)| bps * child.size.abs()).sum()
}
