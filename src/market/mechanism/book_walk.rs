//! The price of size: an order larger than the touch takes the levels behind it.

use crate::market::{Execution, ExecutionEffect, OrderLog};
use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Scene, Seed, Site, Thetas, Tick, Typical};

use super::need::{Demanding, Need, known};

/// `price = touch + side * fraction * |VWAP of the displayed levels up to the quantity - touch|`.
///
/// 1 is the walk through the book as it is displayed; less where hidden orders sit within it, more where displayed
/// orders are withdrawn before they are reached. An order larger than all that is displayed takes the rest at the last
/// level. What it adds is on top of the reference, so that it stands beside [`HalfSpread`](super::HalfSpread).
///
/// Source: the cost of a round trip for a given size, Irvine, Benston & Kandel, "Liquidity beyond the inside spread"
/// (2000); Gomber, Schweickert & Theissen, "Liquidity dynamics in an electronic open limit order book", European
/// Financial Management 21 (2015).
#[derive(Debug, Clone, Copy)]
pub struct BookWalk;

impl Mechanism<Execution> for BookWalk {
    fn about(&self) -> About {
        About {
            name: "book_walk",
            site: Site::Plant,
            title: "the walk through the book",
            law: "price = touch + side * fraction * |VWAP of the levels up to the quantity - touch|",
            source: "Irvine, Benston & Kandel (2000); Gomber, Schweickert & Theissen, European Financial Management 21 (2015)",
            remedy: "fill orders level by level, with the sizes displayed when they arrive",
            contains: &[],
        }
    }

    fn forms(&self, _typical: &Typical) -> Vec<Form> {
        Form::only(vec![Parameter::new("fraction", "", 0.0).within(0.0, 3.0).starting_at(&[0.5, 1.0])])
    }

    fn applies(&self, form: usize, _plant: &Execution, log: &OrderLog) -> bool {
        known(self.needs(form), log)
    }

    fn law(&self, _form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<Execution>> {
        Box::new(Walk { fraction: thetas.row(0).to_vec() })
    }
}

impl Demanding for BookWalk {
    fn needs(&self, _form: usize) -> &'static [Need] {
        &[Need::Quotes, Need::Sizes]
    }
}

#[derive(Clone)]
struct Walk {
    fraction: Vec<f64>,
}

impl Law<Execution> for Walk {
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.fraction);
    }

    fn act(&mut self, _tick: Tick, scene: &Scene<'_, Execution>, effects: &mut [ExecutionEffect]) {
        for (((effect, met), order), fraction) in
            effects.iter_mut().zip(scene.inputs).zip(scene.commands).zip(&self.fraction)
        {
            if !order.takes() {
                continue;
            }
            let walk = met.book.walk(order.side, order.fillable(met.volume));
            effect.concession += fraction * walk.map_or(0.0, |walk| walk.beyond_touch);
        }
    }
}
