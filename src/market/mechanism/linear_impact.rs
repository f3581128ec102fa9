//! Impact that grows with the size.

use crate::market::{Execution, ExecutionEffect, OrderLog};
use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Scene, Seed, Site, Thetas, Tick, Typical};

use super::need::{Demanding, Need, known};

/// `price = reference + side * bps * Q / V * mid / 1e4`, with Q the quantity filled and V the units
/// traded on an average day; `bps` is `bps_at_full_participation`, the concession of an order as large as a day's
/// volume.
///
/// Source: Kyle, "Continuous auctions and insider trading", Econometrica 53 (1985): his lambda is
/// `bps * mid / (1e4 V)`.
#[derive(Debug, Clone, Copy)]
pub struct LinearImpact;

impl Mechanism<Execution> for LinearImpact {
    fn about(&self) -> About {
        About {
            name: "linear_impact",
            site: Site::Plant,
            title: "linear impact",
            law: "concession = bps * Q / V * mid / 1e4",
            source: "Kyle, Econometrica 53 (1985)",
            remedy: "charge lambda * Q, or trade in smaller parts",
            contains: &[],
        }
    }

    fn forms(&self, _typical: &Typical) -> Vec<Form> {
        Form::only(vec![
            Parameter::new("bps_at_full_participation", "bps", 0.0)
                .within(0.0, 1e6)
                .starting_at(&[10_000.0, 1_000.0, 100.0])
                .proportional(),
        ])
    }

    fn applies(&self, form: usize, _plant: &Execution, log: &OrderLog) -> bool {
        known(self.needs(form), log)
    }

    fn law(&self, _form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<Execution>> {
        Box::new(Impact { bps: thetas.row(0).to_vec() })
    }
}

impl Demanding for LinearImpact {
    fn needs(&self, _form: usize) -> &'static [Need] {
        &[Need::DailyVolume]
    }
}

#[derive(Clone)]
struct Impact {
    bps: Vec<f64>,
}

impl Law<Execution> for Impact {
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.bps);
    }

    fn act(&mut self, _tick: Tick, scene: &Scene<'_, Execution>, effects: &mut [ExecutionEffect]) {
        for (((effect, met), order), bps) in effects.iter_mut().zip(scene.inputs).zip(scene.commands).zip(&self.bps) {
            if !order.takes() {
                continue;
            }
            effect.concession += bps * order.participation(met.volume) * order.mid * 1e-4;
        }
    }
}
