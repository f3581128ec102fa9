//! A concession in proportion to how much the price moves.

use crate::market::{Execution, ExecutionEffect, InFlight, OrderLog};
use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Scene, Seed, Site, Thetas, Tick, Typical};

use super::need::{Demanding, Need, known};

/// `price = reference + side * fraction * sigma * mid`, with sigma the standard deviation of the daily return: spreads widen in
/// proportion to it. In the form `delay` it is `fraction_of_move * sigma * sqrt(delay / day) * mid`: the part of a typical move,
/// during the time from decision to arrival, by which those who come first are ahead. A day is one of 86,400 s; for a
/// session of 6.5 h the same move is 0.52 times the fraction. In the form `recent` it is `fraction_of_recent` of the standard
/// deviation of the return over five minutes, as the five minutes before the decision had it (the root of the summed squared
/// returns over ten seconds).
///
/// In a log of one instrument the daily sigma is one number, so that its forms cannot be told from a constant concession: a
/// diagnosis proposes these only where the orders know different ones.
///
/// Source: Wyart, Bouchaud, Kockelkoren, Potters & Vettorazzo, "Relation between bid-ask spread, impact and volatility in
/// order-driven markets", Quantitative Finance 8 (2008); the form `delay`, Moallemi & Sağlam, "The cost of latency in
/// high-frequency trading", Operations Research 61 (2013).
#[derive(Debug, Clone, Copy)]
pub struct VolatilitySlippage;

/// The forms, after the daily one.
const DELAY: usize = 1;
const RECENT: usize = 2;
/// A day [s].
const DAY: f64 = 86_400.0;

impl Mechanism<Execution> for VolatilitySlippage {
    fn about(&self) -> About {
        About {
            name: "volatility_slippage",
            site: Site::Plant,
            title: "slippage in proportion to volatility",
            law: "concession = fraction * sigma * mid, fraction_of_move * sigma * sqrt(delay / day) * mid, or fraction_of_recent * sigma of late * mid",
            source: "Wyart et al., Quantitative Finance 8 (2008); Moallemi & Sağlam, Operations Research 61 (2013)",
            remedy: "charge more where the price moves more",
            contains: &[],
        }
    }

    fn forms(&self, _typical: &Typical) -> Vec<Form> {
        let one = |name, parameter: Parameter| Form { name, parameters: vec![parameter] };
        let fraction = Parameter::new("fraction", "", 0.0).within(0.0, 10.0).starting_at(&[0.005, 0.05]);
        let of_move = Parameter::new("fraction_of_move", "", 0.0).within(0.0, 100.0).starting_at(&[0.2, 1.0]);
        let of_recent = Parameter::new("fraction_of_recent", "", 0.0).within(0.0, 100.0).starting_at(&[0.2, 0.02]);
        vec![one("daily", fraction), one("delay", of_move), one("recent", of_recent.proportional())]
    }

    fn applies(&self, form: usize, _plant: &Execution, log: &OrderLog) -> bool {
        let differs = |pair: &[InFlight]| pair[0].daily_volatility != pair[1].daily_volatility;
        known(self.needs(form), log) && (form == RECENT || log.orders().windows(2).any(differs))
    }

    fn law(&self, form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<Execution>> {
        Box::new(Slippage { form, fraction: thetas.row(0).to_vec() })
    }
}

impl Demanding for VolatilitySlippage {
    fn needs(&self, form: usize) -> &'static [Need] {
        if form == RECENT { &[Need::RecentVolatility] } else { &[Need::DailyVolatility] }
    }
}

#[derive(Clone)]
struct Slippage {
    form: usize,
    fraction: Vec<f64>,
}

impl Law<Execution> for Slippage {
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.fraction);
    }

    fn act(&mut self, _tick: Tick, scene: &Scene<'_, Execution>, effects: &mut [ExecutionEffect]) {
        for ((effect, order), fraction) in effects.iter_mut().zip(scene.commands).zip(&self.fraction) {
            let sigma = if self.form == RECENT { order.recent_volatility } else { order.daily_volatility };
            let Some(sigma) = sigma.filter(|_| order.takes()) else { continue };
            let delay = order.arrives_at.seconds_since(order.decided_at).max(0.0);
            let days = if self.form == DELAY { delay / DAY } else { 1.0 };
            effect.concession += fraction * sigma * days.sqrt() * order.mid;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::schedule::{MID, concession};
    use super::*;
    use crate::market::{Role, Side};
    use crate::sim2real::Timestamp;

    #[test]
    fn a_daily_volatility_of_two_percent_and_a_delay_of_a_hundredth_of_a_day() {
        let at = Timestamp(0);
        let order = InFlight {
            daily_volatility: Some(0.02),
            recent_volatility: Some(0.001),
            ..InFlight::market(Side::Sell, 10.0, at, MID, MID).arriving(at.plus_seconds(864.0))
        };
        let conceded = |form: usize, fraction: f64, order: InFlight| {
            let mut law = VolatilitySlippage.law(form, &Thetas::single(&[fraction]), Seed(1));
            concession(law.as_mut(), 0.0, order) / MID * 1e4
        };
        // 200 bps a day: a hundredth of it; a tenth of it, the root of a hundredth, and half of that.
        assert!((conceded(0, 0.01, order) - 2.0).abs() < 1e-9);
        assert!((conceded(1, 0.5, order) - 10.0).abs() < 1e-9);
        // 10 bps in five minutes: a fifth of it.
        assert!((conceded(2, 0.2, order) - 2.0).abs() < 1e-9);
        assert_eq!(conceded(0, 0.01, order.as_a(Role::Maker)), 0.0);
        assert_eq!(conceded(0, 0.01, InFlight { daily_volatility: None, ..order }), 0.0);
    }
}
