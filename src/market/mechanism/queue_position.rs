//! The price of coming late: more stands ahead of a resting order than is displayed when it joins.

use crate::market::{Execution, ExecutionEffect, OrderLog, Role};
use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Scene, Seed, Site, Thetas, Tick, Typical};

use super::need::{Demanding, Need, known};

/// `ahead = displayed + fraction * displayed`, at the price at which an order that rests joins a queue: it joined later than it
/// thought, hidden orders sit at the same price, or others have priority.
///
/// What is added stands behind all that is displayed ahead of the order and before the order itself: trades reach it last, and
/// since nobody sees it, nothing that is cancelled is known of it. How much cancellations ahead help is for the venue's
/// [`QueueModel`](crate::market::QueueModel). Where the market shows a price at or beyond the order's limit, the whole queue is
/// gone, and what was added with it.
///
/// On bars nothing is displayed and no queue is known: a run on bars alone refuses the law. A log of market orders cannot tell of
/// it. A log with orders that rest, each at the best price of its own side, does where its tape has trades: what was taken at
/// their price before they were filled stood ahead of them.
///
/// Source: Moallemi & Yuan, "A model for queue position valuation in a limit order book" (2017), for what a place in the queue
/// is worth; Rigtorp, "Estimating order queue position" (2013), for how it is estimated, and by how much that may be wrong.
#[derive(Debug, Clone, Copy)]
pub struct QueuePosition;

impl Mechanism<Execution> for QueuePosition {
    fn about(&self) -> About {
        About {
            name: "queue_position",
            site: Site::Plant,
            title: "a place further back in the queue",
            law: "ahead of an order that joins a queue = displayed + fraction * displayed",
            source: "Moallemi & Yuan (2017); Rigtorp (2013)",
            remedy: "let more trade at the price of a resting order before it is filled",
            contains: &[],
        }
    }

    fn forms(&self, _typical: &Typical) -> Vec<Form> {
        Form::only(vec![Parameter::new("ahead", "", 0.0).within(0.0, 100.0).starting_at(&[0.5, 1.0]).proportional()])
    }

    fn applies(&self, form: usize, _plant: &Execution, log: &OrderLog) -> bool {
        known(self.needs(form), log)
    }

    fn law(&self, _form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<Execution>> {
        Box::new(Ahead { fraction: thetas.row(0).to_vec() })
    }
}

impl Demanding for QueuePosition {
    fn needs(&self, _form: usize) -> &'static [Need] {
        &[Need::Queues]
    }
}

#[derive(Clone)]
struct Ahead {
    fraction: Vec<f64>,
}

impl Law<Execution> for Ahead {
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.fraction);
    }

    fn act(&mut self, _tick: Tick, scene: &Scene<'_, Execution>, effects: &mut [ExecutionEffect]) {
        for (((effect, met), order), fraction) in
            effects.iter_mut().zip(scene.inputs).zip(scene.commands).zip(&self.fraction)
        {
            // Where nobody knows what is displayed, nobody knows a fraction of it.
            if order.role == Role::Maker && met.displayed.is_finite() {
                effect.ahead += fraction * met.displayed;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::schedule::{Child, effect};
    use super::*;

    #[test]
    fn a_fraction_of_what_is_displayed_stands_ahead_of_those_who_join_it() {
        let ahead = |role, displayed: f64| {
            let mut law = QueuePosition.law(0, &Thetas::single(&[0.4]), Seed(1));
            effect(law.as_mut(), Child { role, ..Child::bought(0.0, 0.01) }, displayed).ahead
        };
        assert_eq!(ahead(Role::Maker, 50.0), 20.0);
        assert_eq!(ahead(Role::Maker, f64::INFINITY), 0.0);
        assert_eq!([ahead(Role::Taker, 50.0), ahead(Role::Holder, 50.0)], [0.0, 0.0]);
    }
}
