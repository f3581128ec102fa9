//! Orders come in whole lots.

use crate::market::{Execution, ExecutionEffect};
use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Scene, Seed, Site, Thetas, Tick, Typical};

/// `quantity filled = lot * floor(quantity / lot)`, after any limit on participation; what is left lapses.
///
/// It stands for a venue whose lots are larger than the strategy assumes: orders that are no multiple of the instrument's own
/// `lot_size` a backtest refuses before they are sent. Listed as what happens to a command, it acts where the order is
/// filled, so that the part filled is a part of what was asked for. Impacts are those of the quantity before it is cut.
///
/// Source: round lots, Harris, *Trading and Exchanges* (2003), chapter 3; SEC Regulation NMS, Rule 600(b).
#[derive(Debug, Clone, Copy)]
pub struct LotSize;

impl Mechanism<Execution> for LotSize {
    fn about(&self) -> About {
        About {
            name: "lot_size",
            site: Site::Command,
            title: "a lot size",
            law: "quantity filled = lot * floor(quantity / lot)",
            source: "Harris, Trading and Exchanges (2003), chapter 3; Regulation NMS, Rule 600(b)",
            remedy: "round orders down to whole lots before they are sent",
            contains: &[],
        }
    }

    fn forms(&self, typical: &Typical) -> Vec<Form> {
        // Between the lots that explain what was filled are many that nearly do: a search that begins beside the lot ends beside it.
        let round = [1.0, 10.0, 100.0, 1_000.0].into_iter().filter(|lot| *lot <= 3.0 * typical.command);
        let starts: Vec<f64> = typical.quantum.into_iter().chain(round).collect();
        let starts = if starts.is_empty() { vec![0.3 * typical.command] } else { starts };
        Form::only(vec![Parameter::new("lot", "unit", 0.0).within(0.0, f64::INFINITY).starting_at(&starts).stepped()])
    }

    fn site(&self, _form: usize) -> Site {
        Site::Plant
    }

    fn law(&self, _form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<Execution>> {
        Box::new(Lots { lot: thetas.row(0).to_vec() })
    }
}

#[derive(Clone)]
struct Lots {
    lot: Vec<f64>,
}

impl Law<Execution> for Lots {
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.lot);
    }

    fn act(&mut self, _tick: Tick, _scene: &Scene<'_, Execution>, effects: &mut [ExecutionEffect]) {
        for (effect, lot) in effects.iter_mut().zip(&self.lot) {
            effect.lot = effect.lot.max(*lot);
        }
    }
}
