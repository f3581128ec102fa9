//! The formula most backtests charge for everything at once.

use rand_distr::{Distribution, StandardNormal};

use crate::market::{Execution, ExecutionEffect};
use crate::sim2real::{About, Draws, Form, LaneChange, Law, Mechanism, Parameter, Scene, Seed, Site, Thetas, Tick, Typical};

use super::need::{Demanding, Need};

/// `slippage = base_bps / 1e4 + volume_impact * Q / V + noise`, as a fraction of the mid: a constant, a part in proportion to the
/// quantity filled over the units traded on an average day, and Gaussian noise of standard deviation `noise_bps`.
///
/// The textbook's values are 5 bps, 0.01 and 2 bps: 0.01 is one percent of the price for an order as large as a day's volume. A
/// document that names the mechanism and no parameters means these. They are assumptions, and no measurement.
///
/// Draws are one an order that takes, the same for all lanes, in the order in which orders meet the market. Since real noise is
/// not that of the seed, a diagnosis keeps what a twin lists of it but the noise, and proposes in its place what it is made of:
/// `half_spread` and `linear_impact`.
///
/// Source: the rule of thumb of backtesters; its parts in Kissell, *The Science of Algorithmic Trading and Portfolio
/// Management* (2014), chapter 3.
#[derive(Debug, Clone, Copy)]
pub struct TextbookSlippage;

impl Mechanism<Execution> for TextbookSlippage {
    fn about(&self) -> About {
        About {
            name: NAME,
            site: Site::Plant,
            title: "the textbook's slippage",
            law: "slippage = base_bps / 1e4 + volume_impact * Q / V + noise of noise_bps; 5 bps, 0.01 and 2 bps if nothing is said",
            source: "the rule of thumb of backtesters; its parts in Kissell (2014), chapter 3",
            remedy: "measure spread and impact instead: half_spread, linear_impact",
            contains: &["half_spread", "linear_impact"],
        }
    }

    fn forms(&self, _typical: &Typical) -> Vec<Form> {
        let [base, impact, noise] = TEXTBOOK;
        Form::only(vec![
            Parameter::new("base_bps", "bps", 0.0).within(0.0, 1_000.0).starting_at(&[base]),
            Parameter::new("volume_impact", "", 0.0).within(0.0, 10.0).starting_at(&[impact]),
            Parameter::new("noise_bps", "bps", 0.0).within(0.0, 1_000.0).starting_at(&[noise]),
        ])
    }

    fn followed(&self, _form: usize) -> bool {
        false
    }

    fn mean(&self, _form: usize, thetas: &Thetas) -> Option<Box<dyn Law<Execution>>> {
        Some(Box::new(Slippage::new(thetas, None)))
    }

    fn customary(&self) -> Option<(usize, Vec<f64>)> {
        Some((0, TEXTBOOK.to_vec()))
    }

    fn law(&self, _form: usize, thetas: &Thetas, seed: Seed) -> Box<dyn Law<Execution>> {
        Box::new(Slippage::new(thetas, Some(seed.stream(NAME))))
    }
}

/// Id, and the stream its noise is drawn from.
const NAME: &str = "textbook_slippage";

/// `base_bps` [bps], `volume_impact` [] and `noise_bps` [bps] where nothing is said.
const TEXTBOOK: [f64; 3] = [5.0, 0.01, 2.0];

impl Demanding for TextbookSlippage {
    fn needs(&self, _form: usize) -> &'static [Need] {
        &[Need::DailyVolume]
    }
}

#[derive(Clone)]
struct Slippage {
    base_bps: Vec<f64>,
    volume_impact: Vec<f64>,
    noise_bps: Vec<f64>,
    /// Where the noise is drawn from, if there is any.
    draws: Option<Draws>,
}

impl Slippage {
    fn new(thetas: &Thetas, draws: Option<Draws>) -> Self {
        let [base_bps, volume_impact, noise_bps] = [0, 1, 2].map(|k| thetas.row(k).to_vec());
        Self { base_bps, volume_impact, noise_bps, draws }
    }
}

impl Law<Execution> for Slippage {
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.base_bps);
        change.parameter(1, &mut self.volume_impact);
        change.parameter(2, &mut self.noise_bps);
        if let Some(draws) = &mut self.draws {
            change.shared(draws, |seed| seed.stream(NAME));
        }
    }

    fn act(&mut self, _tick: Tick, scene: &Scene<'_, Execution>, effects: &mut [ExecutionEffect]) {
        if !scene.commands.iter().any(|order| order.takes()) {
            return;
        }
        let draw: f64 = self.draws.as_mut().map_or(0.0, |draws| StandardNormal.sample(draws));
        let lanes = self.base_bps.iter().zip(&self.volume_impact).zip(&self.noise_bps);
        for (((effect, met), order), ((base, impact), noise)) in
            effects.iter_mut().zip(scene.inputs).zip(scene.commands).zip(lanes)
        {
            let bps = base + 1e4 * impact * order.participation(met.volume) + noise * draw;
            effect.concession += bps * order.mid * 1e-4;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::schedule::{Child, concessions};
    use super::*;
    use crate::market::Role;

    #[test]
    fn a_tenth_of_a_days_volume_pays_five_and_ten_basis_points() {
        let children = [Child::bought(0.0, 0.1), Child::sold(1.0, 0.001)];
        let paid = concessions(&TextbookSlippage, 0, &[5.0, 0.01, 0.0], &children);
        assert!((paid[0] - 15.0).abs() < 1e-9 && (paid[1] - 5.1).abs() < 1e-9, "{paid:?}");
    }

    #[test]
    fn noise_has_its_size_and_resting_orders_draw_none() {
        let children: Vec<Child> = (0..20_000).map(|k| Child::bought(f64::from(k), 1e-4)).collect();
        let noise = concessions(&TextbookSlippage, 0, &[0.0, 0.0, 2.0], &children);
        let (mean, square) = noise.iter().fold((0.0, 0.0), |(m, s), n| (m + n / 2e4, s + n * n / 2e4));
        // Four standard deviations of either.
        assert!(mean.abs() < 4.0 * 2.0 / 20_000_f64.sqrt(), "{mean}");
        assert!((square.sqrt() / 2.0 - 1.0).abs() < 4.0 / 40_000_f64.sqrt(), "{}", square.sqrt());
        let resting = Child { role: Role::Maker, ..children[0] };
        let with: Vec<Child> = [resting].into_iter().chain(children[..50].iter().copied()).collect();
        assert_eq!(concessions(&TextbookSlippage, 0, &[0.0, 0.0, 2.0], &with)[1..], noise[..50]);
    }

    #[test]
    fn what_is_followed_is_the_mean_and_what_is_not_said_is_the_textbooks() {
        let thetas = Thetas::single(&[5.0, 0.01, 2.0]);
        assert!(TextbookSlippage.mean(0, &thetas).is_some() && !TextbookSlippage.followed(0));
        assert_eq!(TextbookSlippage.customary(), Some((0, vec![5.0, 0.01, 2.0])));
    }
}
