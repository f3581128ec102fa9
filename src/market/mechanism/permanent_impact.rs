//! Impact that stays: the price every later order of one's own meets.

use crate::market::{Execution, ExecutionEffect, OrderLog};
use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Scene, Seed, Site, Thetas, Tick, Typical};

use super::need::{Demanding, Need, known};
use super::propagator::paid;

/// `price = reference + side * mean displacement * mid / 1e4`: what was bought less what was sold moves the price for good, and
/// an order pays the mean of the displacement it finds and the one it leaves.
///
/// With `x` the signed sum of own volume over the units traded on an average day, the displacement is `bps * x` in the form
/// `linear` and `bps * sign(x) * sqrt(|x|)` in the form `square_root`; `bps` is that of a day's volume. A quantity that is
/// split pays in all what it pays as one block. A sale after purchases meets the price they have lifted: whoever is flat again
/// has paid nothing, and gained nothing, in whatever parts and at whatever times. That holds because the displacement
/// depends on the sum of what was traded alone. Of laws by which each order moves the price for good by a function of its own
/// size, only the linear one is free of round trips that gain (Huberman & Stanzl).
///
/// With `paid` an order pays that part of what it moves itself, instead of the mean: 0 where it fills before the price moves, as
/// orders of markets do whose fills are told by the spread, the walk and an impact of their own. With less than a half of it a
/// round trip gains, unless these cost more.
///
/// Own orders that wait do so in the market as it was moved: after purchases those to buy are further from being filled, and those to
/// sell nearer, where they take.
///
/// The tape of a backtest does not react. Where a log's tape was recorded while its orders were in the market
/// ([`OrderLog::shows_own_orders`]), it shows what they left: the law then says how the mid moves, and not what later orders pay.
///
/// Source: Almgren & Chriss, "Optimal execution of portfolio transactions", Journal of Risk 3 (2001); Huberman & Stanzl,
/// "Price manipulation and quasi-arbitrage", Econometrica 72 (2004); the square root of what a parent order has traded so far,
/// Tóth et al., "Anomalous price impact and the critical nature of liquidity in financial markets", Physical Review X 1 (2011).
#[derive(Debug, Clone, Copy)]
pub struct PermanentImpact;

/// The forms, in this order: first those in which an order pays the mean of what it finds and leaves.
const SHOWN: usize = 2;

impl Mechanism<Execution> for PermanentImpact {
    fn about(&self) -> About {
        About {
            name: "permanent_impact",
            site: Site::Plant,
            title: "permanent impact",
            law: "displacement = bps * x, or bps * sqrt(x), x = own net volume / V; an order pays its mean",
            source: "Almgren & Chriss, Journal of Risk 3 (2001); Huberman & Stanzl, Econometrica 72 (2004)",
            remedy: "let orders meet the price that earlier ones have moved",
            contains: &[],
        }
    }

    fn forms(&self, _typical: &Typical) -> Vec<Form> {
        let bps =
            |name, starts: &[f64]| Parameter::new(name, "bps", 0.0).within(0.0, 1e6).starting_at(starts).proportional();
        let line = || bps("bps_at_full_participation", &[10_000.0, 1_000.0, 100.0]);
        let root = || bps("sqrt_bps_at_full_participation", &[1_000.0, 100.0, 10.0]);
        vec![
            Form { name: "linear", parameters: vec![line()] },
            Form { name: "square_root", parameters: vec![root()] },
            Form { name: "linear, shown", parameters: vec![line(), paid()] },
            Form { name: "square_root, shown", parameters: vec![root(), paid()] },
        ]
    }

    /// Where the tape shows own orders, looks at the mid tell of it; where it does not, what later orders pay.
    fn applies(&self, form: usize, _plant: &Execution, log: &OrderLog) -> bool {
        let told = if form >= SHOWN { log.looks() > 0 } else { true };
        known(self.needs(form), log) && log.shows_own_orders() == (form >= SHOWN) && told
    }

    fn memory(&self) -> f64 {
        f64::INFINITY
    }

    fn law(&self, form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<Execution>> {
        let mean = if form.is_multiple_of(SHOWN) { mean_of_lines } else { mean_of_roots };
        let paid = (form >= SHOWN).then(|| thetas.row(1).to_vec());
        Box::new(Displaced { mean, bps: thetas.row(0).to_vec(), paid, traded: vec![0.0; thetas.lanes()] })
    }
}

impl Demanding for PermanentImpact {
    fn needs(&self, _form: usize) -> &'static [Need] {
        &[Need::DailyVolume]
    }
}

#[derive(Clone)]
struct Displaced {
    /// Mean displacement between two sums of what was traded, over that of a day's volume.
    mean: fn(f64, f64) -> f64,
    bps: Vec<f64>,
    /// The part of what an order moves that it pays itself, where it is not the mean.
    paid: Option<Vec<f64>>,
    /// Bought less sold, in days' volumes.
    traded: Vec<f64>,
}

impl Law<Execution> for Displaced {
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.bps);
        if let Some(paid) = &mut self.paid {
            change.parameter(1, paid);
        }
        change.memory(&mut self.traded);
    }

    fn act(&mut self, _tick: Tick, scene: &Scene<'_, Execution>, effects: &mut [ExecutionEffect]) {
        let lanes = self.bps.iter().zip(&mut self.traded).enumerate();
        for (((effect, met), order), (lane, (bps, traded))) in
            effects.iter_mut().zip(scene.inputs).zip(scene.commands).zip(lanes)
        {
            let found = (self.mean)(*traded, *traded);
            effect.displaced += bps * found * order.mid * 1e-4;
            if !order.takes() {
                continue;
            }
            let after = *traded + order.side.sign() * order.participation(met.volume);
            let own = match &self.paid {
                Some(paid) => paid[lane] * ((self.mean)(after, after) - found),
                None => (self.mean)(*traded, after) - found,
            };
            effect.concession += order.side.sign() * bps * own * order.mid * 1e-4;
            *traded = after;
        }
    }
}

fn mean_of_lines(from: f64, to: f64) -> f64 {
    0.5 * (from + to)
}

/// The mean of `sign(x) sqrt(|x|)`, in a shape that loses no digits where `from` and `to` are near each other.
fn mean_of_roots(from: f64, to: f64) -> f64 {
    let (a, b) = (from.abs().sqrt(), to.abs().sqrt());
    if a + b == 0.0 {
        return 0.0;
    }
    if from * to >= 0.0 {
        let sign = if from + to < 0.0 { -1.0 } else { 1.0 };
        return sign * 2.0 / 3.0 * (a * a + a * b + b * b) / (a + b);
    }
    let (below, above) = if from < to { (a, b) } else { (b, a) };
    2.0 / 3.0 * (above.powi(3) - below.powi(3)) / (above * above + below * below)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::schedule::{Child, concessions, paid};
    use super::*;

    #[test]
    fn a_block_pays_half_of_what_it_moves_and_the_next_order_all_of_it() {
        // Of 1000 bps: a block of 2 % moves 20 bps and pays 10; 1 % more pays 25; selling all meets 30, leaves 0, gets 15.
        let children = [Child::bought(0.0, 0.02), Child::bought(5.0, 0.01), Child::sold(9.0, 0.03)];
        let linear = concessions(&PermanentImpact, 0, &[1_000.0], &children);
        for (found, expected) in linear.iter().zip([10.0, 25.0, -15.0]) {
            assert!((found - expected).abs() < 1e-9, "{linear:?}");
        }
        // Of 100 bps at a day's volume: 0.04 moves 20 bps, 2/3 of which is the mean; on to 0.09 moves 30 bps.
        let children = [Child::bought(0.0, 0.04), Child::bought(5.0, 0.05), Child::sold(9.0, 0.09)];
        let root = concessions(&PermanentImpact, 1, &[100.0], &children);
        // 2/3 * (30 * 0.09 - 20 * 0.04) / 0.05, and back: -2/3 * 30.
        for (found, expected) in root.iter().zip([40.0 / 3.0, 2.0 / 3.0 * 1.9 / 0.05, -20.0]) {
            assert!((found - expected).abs() < 1e-9, "{root:?}");
        }
    }

    #[test]
    fn a_position_that_turns_round_pays_the_mean_over_all_it_passes() {
        // From +0.01 to -0.03: the integral of the root from 0.01 down to 0 gets 2/3 0.1^3, from 0 on pays 2/3 0.03^1.5.
        let children = [Child::bought(0.0, 0.01), Child::sold(1.0, 0.04)];
        let root = concessions(&PermanentImpact, 1, &[100.0], &children);
        let expected = 100.0 * 2.0 / 3.0 * (0.03_f64.powf(1.5) - 0.01_f64.powf(1.5)) / 0.04;
        assert!((root[1] - expected).abs() < 1e-9, "{root:?}, not {expected}");
    }

    proptest! {
        #[test]
        fn parts_pay_what_the_block_pays_and_round_trips_nothing(
            sizes in prop::collection::vec(-0.05..0.05_f64, 1..20), form in 0..2_usize,
        ) {
            let mut children: Vec<Child> = sizes.iter().enumerate().map(|(k, x)| Child::signed(k as f64, *x)).collect();
            let total: f64 = sizes.iter().sum();
            let block = paid(&PermanentImpact, form, &[500.0], &[Child::signed(0.0, total)]);
            let parts = paid(&PermanentImpact, form, &[500.0], &children);
            prop_assert!((parts - block).abs() < 1e-9, "{parts} in parts, {block} at once");
            children.push(Child::signed(99.0, -total));
            prop_assert!(paid(&PermanentImpact, form, &[500.0], &children).abs() < 1e-9);
        }
    }
}
