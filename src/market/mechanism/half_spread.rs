//! The price of immediacy: an order that takes pays half the spread.

use crate::market::{Execution, ExecutionEffect, OrderLog};
use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Scene, Seed, Site, Thetas, Tick, Typical};

use super::need::{Demanding, Need};

/// `price = reference + side * fraction * (ask - bid) / 2`, or `reference + side * bps * mid / 1e4` where no quotes are
/// known.
///
/// Source: Demsetz, "The cost of transacting", Quarterly Journal of Economics 82 (1968); effective spread as in Huang &
/// Stoll, Journal of Financial Economics 41 (1996).
#[derive(Debug, Clone, Copy)]
pub struct HalfSpread;

const FRACTION: usize = 0;

impl Mechanism<Execution> for HalfSpread {
    fn about(&self) -> About {
        About {
            name: "half_spread",
            site: Site::Plant,
            title: "half the bid-ask spread",
            law: "price = reference + side * fraction * (ask - bid) / 2",
            source: "Demsetz, QJE 82 (1968); Huang & Stoll, JFE 41 (1996)",
            remedy: "fill orders that take at the touch rather than at the mid",
            contains: &[],
        }
    }

    fn forms(&self, _typical: &Typical) -> Vec<Form> {
        vec![
            Form {
                name: "fraction",
                parameters: vec![Parameter::new("fraction", "", 0.0).within(0.0, 10.0).starting_at(&[0.5, 1.0])],
            },
            Form {
                name: "bps",
                parameters: vec![Parameter::new("bps", "bps", 0.0).within(0.0, 1_000.0).starting_at(&[0.5, 5.0])],
            },
        ]
    }

    /// The fraction needs quotes; where there are quotes they, and no constant, say what the spread was.
    fn applies(&self, form: usize, _plant: &Execution, log: &OrderLog) -> bool {
        (form == FRACTION) == Need::Quotes.is_known_in(log)
    }

    fn law(&self, form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<Execution>> {
        Box::new(Concession { of_spread: form == FRACTION, size: thetas.row(0).to_vec() })
    }
}

impl Demanding for HalfSpread {
    fn needs(&self, form: usize) -> &'static [Need] {
        if form == FRACTION { &[Need::Quotes] } else { &[] }
    }
}

#[derive(Clone)]
struct Concession {
    of_spread: bool,
    size: Vec<f64>,
}

impl Law<Execution> for Concession {
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.size);
    }

    fn act(&mut self, _tick: Tick, scene: &Scene<'_, Execution>, effects: &mut [ExecutionEffect]) {
        for (((effect, met), order), size) in effects.iter_mut().zip(scene.inputs).zip(scene.commands).zip(&self.size) {
            if !order.takes() {
                continue;
            }
            effect.concession += size * if self.of_spread { met.book.half_spread() } else { order.mid * 1e-4 };
        }
    }
}
