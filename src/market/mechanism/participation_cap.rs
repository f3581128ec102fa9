//! A limit on the part of the market's volume an order may be.

use crate::market::{Execution, InFlight, OrderLog};
use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Seed, Site, Thetas, Tick, Typical};

use super::need::{Demanding, Need, known};

/// `quantity filled = min(quantity, fraction * volume met)`; what is left is cancelled.
///
/// The volume met is that of the bar in which the order arrives; where there are only quotes, what is displayed on the
/// side it takes from; where there are only trades, what is traded in the minute after its arrival
/// ([`Tape::volume`](crate::market::Tape::volume)). Without a limit the fraction is infinite.
///
/// Source: volume-share slippage of zipline (Quantopian), `volume_limit`, 0.025 by default; participation limits in
/// Almgren & Chriss, "Optimal execution of portfolio transactions", Journal of Risk 3 (2001).
#[derive(Debug, Clone, Copy)]
pub struct ParticipationCap;

impl Mechanism<Execution> for ParticipationCap {
    fn about(&self) -> About {
        About {
            name: "participation_cap",
            site: Site::Command,
            title: "a limit on participation",
            law: "quantity filled = min(quantity, fraction * volume met)",
            source: "zipline, VolumeShareSlippage; Almgren & Chriss, Journal of Risk 3 (2001)",
            remedy: "cut orders to the part of the volume they may be, or spread them over time",
            contains: &[],
        }
    }

    fn forms(&self, _typical: &Typical) -> Vec<Form> {
        let starts = [1.0, 0.5, 0.25, 0.1, 0.05, 0.025];
        Form::only(vec![Parameter::new("fraction", "", f64::INFINITY).within(0.0, f64::INFINITY).starting_at(&starts)])
    }

    fn applies(&self, form: usize, _plant: &Execution, log: &OrderLog) -> bool {
        known(self.needs(form), log)
    }

    fn law(&self, _form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<Execution>> {
        Box::new(Cap { fraction: thetas.row(0).to_vec() })
    }
}

impl Demanding for ParticipationCap {
    fn needs(&self, _form: usize) -> &'static [Need] {
        &[Need::Volume]
    }
}

#[derive(Clone)]
struct Cap {
    fraction: Vec<f64>,
}

impl Law<Execution> for Cap {
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.fraction);
    }

    fn shape(&mut self, _tick: Tick, orders: &mut [InFlight]) {
        for (order, fraction) in orders.iter_mut().zip(&self.fraction) {
            order.participation_limit = order.participation_limit.min(*fraction);
        }
    }
}
