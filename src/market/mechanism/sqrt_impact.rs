//! Impact that grows with the square root of the size.

use crate::market::{Execution, ExecutionEffect, OrderLog};
use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Scene, Seed, Site, Thetas, Tick, Typical};

use super::need::{Demanding, Need, known};

/// `price = reference + side * bps * sqrt(Q / V) * mid / 1e4`, with Q the quantity filled and V the units
/// traded on an average day; `bps` is `bps_at_full_participation`, the concession of an order as large as a day's
/// volume.
///
/// Source: Tóth et al., "Anomalous price impact and the critical nature of liquidity in financial markets", Physical
/// Review X 1 (2011); Almgren, Thum, Hauptmann & Li, "Direct estimation of equity market impact" (2005), with an exponent
/// of 0.6; Sato & Kanazawa, "Does the square-root price impact law hold universally?" (2024). Their law is
/// `Y sigma sqrt(Q / V)` with Y about 1, so `bps` is about the daily volatility in bps.
#[derive(Debug, Clone, Copy)]
pub struct SqrtImpact;

impl Mechanism<Execution> for SqrtImpact {
    fn about(&self) -> About {
        About {
            name: "sqrt_impact",
            site: Site::Plant,
            title: "square-root impact",
            law: "concession = bps * sqrt(Q / V) * mid / 1e4",
            source: "Tóth et al., Physical Review X 1 (2011); Almgren et al. (2005); Sato & Kanazawa (2024)",
            remedy: "charge Y * sigma * sqrt(Q / V), or trade in smaller parts",
            contains: &[],
        }
    }

    fn forms(&self, _typical: &Typical) -> Vec<Form> {
        Form::only(vec![
            Parameter::new("bps_at_full_participation", "bps", 0.0)
                .within(0.0, 100_000.0)
                .starting_at(&[1_000.0, 100.0, 10.0])
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

impl Demanding for SqrtImpact {
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
            effect.concession += bps * order.participation(met.volume).sqrt() * order.mid * 1e-4;
        }
    }
}
