//! The price of waiting: resting orders fill most of all when the price is about to move through them.

use crate::market::{Execution, ExecutionEffect, OrderLog, Role};
use crate::sim2real::{About, Form, Law, Mechanism, Parameter, Scene, Seed, Site, Thetas, Tick, Typical};

/// `price = reference + side * bps * mid / 1e4` for orders that rest: their short-run markout, the mean move of the mid against
/// a passive fill, charged when it fills. Negative where fills are followed by moves in their favour.
///
/// A replayed tape does not know whom an order would have met, so fills of a backtest's resting orders are followed by moves that
/// are too kind. The charge stands in the booked price, which is then worse than the order's limit: an account of what is
/// lost soon after, not a price that was traded at. Orders that take pay nothing here.
///
/// Source: Glosten & Milgrom, "Bid, ask and transaction prices in a specialist market with heterogeneously informed traders",
/// Journal of Financial Economics 14 (1985); realised against effective spread as its measure, Huang & Stoll, Journal of
/// Financial Economics 41 (1996).
#[derive(Debug, Clone, Copy)]
pub struct AdverseSelection;

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
        Form::only(vec![Parameter::new("bps", "bps", 0.0).within(-100.0, 1_000.0).starting_at(&[0.5, 2.0])])
    }

    /// It needs orders that rest.
    fn applies(&self, _form: usize, _plant: &Execution, log: &OrderLog) -> bool {
        log.has_a(Role::Maker)
    }

    fn law(&self, _form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<Execution>> {
        Box::new(Markout { bps: thetas.row(0).to_vec() })
    }
}

#[derive(Clone)]
struct Markout {
    bps: Vec<f64>,
}

impl Law<Execution> for Markout {
    fn act(&mut self, _tick: Tick, scene: &Scene<'_, Execution>, effects: &mut [ExecutionEffect]) {
        for ((effect, order), bps) in effects.iter_mut().zip(scene.commands).zip(&self.bps) {
            if order.role == Role::Maker {
                effect.concession += bps * order.mid * 1e-4;
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
}
