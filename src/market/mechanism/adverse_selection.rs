//! The price of waiting: resting orders fill most of all when the price is about to move through them.

use crate::market::{Execution, ExecutionEffect, OrderLog, Role};
use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Scene, Seed, Site, Thetas, Tick, Typical};

/// `price = reference + side * bps * mid / 1e4` for orders that rest: their short-run markout, the mean move of the mid against
/// a passive fill, charged when it fills. Negative where fills are followed by moves in their favour.
///
/// A replayed tape does not know whom an order would have met, so fills of a backtest's resting orders are followed by moves that
/// are too kind. The charge stands in the booked price, which is then worse than the order's limit: an account of what is
/// lost soon after, not a price that was traded at. Orders that take pay nothing here.
///
/// In a log of orders that rested the law says what the mid does after their fills: against them by `bps`, of which all but
/// `exp(-t / seconds)` has come after a time t. There it is never negative: a price that comes back after the trade that reached the
/// order does so after any trade, and is no selection. Where the orders of a log are all alike, what they foresaw cannot be told from
/// what they suffered.
///
/// Source: Glosten & Milgrom, "Bid, ask and transaction prices in a specialist market with heterogeneously informed traders",
/// Journal of Financial Economics 14 (1985); realised against effective spread as its measure, Huang & Stoll, Journal of
/// Financial Economics 41 (1996).
#[derive(Debug, Clone, Copy)]
pub struct AdverseSelection;

/// The form of what a mid shows.
const SHOWN: usize = 1;

impl Mechanism<Execution> for AdverseSelection {
    fn about(&self) -> About {
        About {
            name: "adverse_selection",
            site: Site::Plant,
            title: "adverse selection",
            law: "concession of a resting order = bps * mid / 1e4, the move against it soon after it fills",
            source: "Glosten & Milgrom, JFE 14 (1985); Huang & Stoll, JFE 41 (1996)",
            remedy: "charge passive fills their markout, or fill them only where the price moves through them",
            contains: &[],
        }
    }

    fn forms(&self, _typical: &Typical) -> Vec<Form> {
        let bps = |least: f64| Parameter::new("bps", "bps", 0.0).within(least, 1_000.0).starting_at(&[0.5, 2.0, 10.0]);
        let seconds = Parameter::new("seconds", "s", 0.0).within(0.0, 60.0).starting_at(&[0.1, 1.0, 5.0]);
        vec![
            Form { name: "", parameters: vec![bps(-100.0)] },
            Form { name: "shown", parameters: vec![bps(0.0).proportional(), seconds] },
        ]
    }

    /// It needs orders that rest, and looks at what the mid does after their fills: a limit order fills at its limit.
    fn applies(&self, form: usize, _plant: &Execution, log: &OrderLog) -> bool {
        log.has_a(Role::Maker) && (log.looks() > 0) == (form == SHOWN)
    }

    fn memory(&self) -> f64 {
        f64::INFINITY
    }

    fn law(&self, form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<Execution>> {
        let seconds = if form == SHOWN { thetas.row(1).to_vec() } else { vec![AT_ONCE; thetas.lanes()] };
        let moves = vec![Moves::default(); thetas.lanes()];
        Box::new(Markout { bps: thetas.row(0).to_vec(), seconds, moves, last: 0.0 })
    }
}

/// How long the move takes where nobody looks at it [s].
const AT_ONCE: f64 = 0.0;

/// What a mid does against fills [bps]: what has come, and what is still to come.
#[derive(Debug, Clone, Copy, Default)]
struct Moves {
    come: f64,
    coming: f64,
}

#[derive(Clone)]
struct Markout {
    bps: Vec<f64>,
    seconds: Vec<f64>,
    moves: Vec<Moves>,
    /// When the last row was [s], of all lanes.
    last: f64,
}

impl Law<Execution> for Markout {
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.bps);
        change.derived(&mut self.seconds, |values| values.get(1).copied().unwrap_or(AT_ONCE));
        change.memory(&mut self.moves);
        change.shared(&mut self.last, |_| 0.0);
    }

    fn act(&mut self, tick: Tick, scene: &Scene<'_, Execution>, effects: &mut [ExecutionEffect]) {
        let passed = (tick.time - self.last).max(0.0);
        self.last = self.last.max(tick.time);
        let lanes = self.bps.iter().zip(&self.seconds).zip(&mut self.moves);
        for ((effect, order), ((bps, seconds), moves)) in effects.iter_mut().zip(scene.commands).zip(lanes) {
            let part = if *seconds > 0.0 { -(-passed / seconds).exp_m1() } else { 1.0 };
            moves.come += part * moves.coming;
            moves.coming -= part * moves.coming;
            match order.role {
                Role::Maker => {
                    effect.concession += bps * order.mid * 1e-4;
                    moves.coming -= order.side.sign() * bps;
                }
                Role::Watcher => effect.displaced += moves.come * order.mid * 1e-4,
                Role::Taker | Role::Holder => {}
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::schedule::{Child, concessions};
    use super::*;

    #[test]
    fn whoever_rests_pays_the_markout_and_nobody_else_does() {
        let as_a = |role| Child { role, ..Child::sold(0.0, 0.01) };
        let children = [as_a(Role::Maker), as_a(Role::Taker), as_a(Role::Holder)];
        let paid = concessions(&AdverseSelection, 0, &[1.5], &children);
        assert!((paid[0] - 1.5).abs() < 1e-12 && paid[1..] == [0.0, 0.0], "{paid:?}");
    }

    #[test]
    fn the_mid_goes_against_what_rested_little_by_little() {
        let mut law = AdverseSelection.law(SHOWN, &Thetas::single(&[2.0, 5.0]), Seed(1));
        let mut displaced = |role, time| {
            let child = Child { role, ..Child::bought(time, 0.01) };
            super::super::schedule::effect(law.as_mut(), child, 0.0).displaced / super::super::schedule::MID * 1e4
        };
        assert_eq!(displaced(Role::Maker, 1.0), 0.0);
        assert!((displaced(Role::Watcher, 6.0) + 2.0 * (1.0 - (-1.0_f64).exp())).abs() < 1e-9);
        assert!((displaced(Role::Watcher, 600.0) + 2.0).abs() < 1e-9);
    }
}
