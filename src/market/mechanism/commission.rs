//! What the broker and the exchange charge.

use crate::market::{Execution, Report};
use crate::sim2real::{About, Form, Law, Mechanism, Parameter, Seed, Site, Thetas, Typical};

/// `fee += bps * 1e-4 * price * quantity`, or `fee += per_share * quantity`; negative for a rebate.
///
/// Source: the two ways in which brokers and exchanges state their schedules; as fixed and variable explicit costs in
/// Kissell, *The Science of Algorithmic Trading and Portfolio Management* (2014), chapter 3.
#[derive(Debug, Clone, Copy)]
pub struct Commission;

const BPS: usize = 0;

impl Mechanism<Execution> for Commission {
    fn about(&self) -> About {
        About {
            name: "commission",
            site: Site::Observation,
            title: "a commission",
            law: "fee = bps * price * quantity / 1e4, or per_share * quantity",
            source: "Kissell, The Science of Algorithmic Trading and Portfolio Management (2014), chapter 3",
            remedy: "charge the commission of the broker's schedule",
            contains: &[],
        }
    }

    fn forms(&self, _typical: &Typical) -> Vec<Form> {
        vec![
            Form {
                name: "bps",
                parameters: vec![Parameter::new("bps", "bps", 0.0).within(-100.0, 1_000.0).starting_at(&[0.1, 1.0])],
            },
            Form {
                name: "per_share",
                parameters: vec![
                    Parameter::new("per_share", "currency/unit", 0.0).within(-1e3, 1e4).starting_at(&[0.001, 0.005]),
                ],
            },
        ]
    }

    fn law(&self, form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<Execution>> {
        Box::new(Charge { of_notional: form == BPS, rate: thetas.row(0).to_vec() })
    }
}

struct Charge {
    of_notional: bool,
    rate: Vec<f64>,
}

impl Law<Execution> for Charge {
    fn sense(&mut self, _time: f64, reports: &mut [Report]) {
        for (report, rate) in reports.iter_mut().zip(&self.rate) {
            report.fee += rate * report.quantity * if self.of_notional { 1e-4 * report.price } else { 1.0 };
        }
    }
}
