//! Impact that decays: the price one's own next orders meet, the less of it the later they come.

use crate::market::{Execution, ExecutionEffect, OrderLog};
use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Scene, Seed, Site, Thetas, Tick, Typical};

use super::need::{Demanding, Need, known};
use super::propagator::{Propagator, paid};

/// `price = reference + side * (D + own / 2) * mid / 1e4`: an order pays what earlier orders of one's own have left of the
/// displacement `D`, and half of what it adds itself.
///
/// An order of quantity Q moves the price by `own = side * bps * Q / V` [bps], V being the units traded on an average day and
/// `bps` that of a day's volume; of it `G(t)` is left after a time t. Form `exponential`: `G(t) = exp(-t / recovery)`, the
/// resilience of a book that fills up again; half of a displacement is gone after `0.69 * recovery`. Form `power`:
/// `G(t) = (1 + t / lag)^(-exponent)`, the propagator, as the sum of exponentials that it is, so that memory does not grow.
///
/// A quantity that is split pays less than as one block, the less the longer it takes. A sale soon after purchases meets the
/// price they have lifted, and gets some of it back: less than was paid for it. With a `G` that is positive, falling and convex,
/// as both forms are, and impact linear in the quantity, no round trip gains (Gatheral; Alfonsi, Schied & Slynko); a
/// square-root law with exponential decay would let one gain, which is why there is none here.
///
/// With `paid` an order pays that part of what it moves itself, instead of half of it: 0 where it fills before the price moves, as
/// orders of markets do whose fills are told by the spread, the walk and an impact of their own. With less than a half of it a
/// round trip gains, unless these cost more.
///
/// Own orders that wait do so in the market as far as it is still moved.
///
/// The tape of a backtest does not react. Where a log's tape was recorded while its orders were in the market
/// ([`OrderLog::shows_own_orders`]), it shows what they left: the law then says how the mid moves, and not what later orders pay.
/// Orders follow each other by when they meet the market.
///
/// Source: Obizhaeva & Wang, "Optimal trading strategy and supply/demand dynamics", Journal of Financial Markets 16 (2013);
/// Bouchaud, Gefen, Potters & Wyart, "Fluctuations and response in financial markets", Quantitative Finance 4 (2004), who
/// find exponents of 0.2 to 0.4; Gatheral, "No-dynamic-arbitrage and market impact", Quantitative Finance 10 (2010); Alfonsi,
/// Schied & Slynko, SIAM Journal on Financial Mathematics 3 (2012).
#[derive(Debug, Clone, Copy)]
pub struct TransientImpact;

/// The forms, in this order: first those in which an order pays half of what it moves.
const SHOWN: usize = 2;

impl Mechanism<Execution> for TransientImpact {
    fn about(&self) -> About {
        About {
            name: "transient_impact",
            site: Site::Plant,
            title: "transient impact",
            law: "concession = what is left of earlier own impact + half of bps * Q / V; exp(-t/recovery) of it is left, or (1 + t/lag)^-exponent",
            source: "Obizhaeva & Wang, JFM 16 (2013); Bouchaud et al., Quantitative Finance 4 (2004); Gatheral, ibid. 10 (2010)",
            remedy: "let orders meet what earlier ones have left, and leave time between them",
            contains: &["linear_impact", "permanent_impact"],
        }
    }

    fn forms(&self, _typical: &Typical) -> Vec<Form> {
        let bps = || {
            let bps = Parameter::new("bps_at_full_participation", "bps", 0.0).within(0.0, 1e6);
            bps.starting_at(&[10_000.0, 1_000.0, 100.0]).proportional()
        };
        let recovery = Parameter::new("recovery", "s", 0.0).within(0.0, 1e7);
        let lag = Parameter::new("lag", "s", 0.0).within(0.0, 1e5).starting_at(&[0.1, 1.0, 10.0, 100.0]);
        let exponent = Parameter::new("exponent", "", 0.0).within(0.0, 3.0).starting_at(&[0.3, 1.0]);
        let starts = [0.1, 1.0, 10.0, 60.0, 600.0, 3600.0];
        let exponential = vec![bps(), recovery.starting_at(&starts)];
        let power = vec![bps(), lag, exponent];
        let shown = |parameters: &[Parameter]| parameters.iter().cloned().chain([paid()]).collect();
        let (shown_exponential, shown_power) = (shown(&exponential), shown(&power));
        vec![
            Form { name: "exponential", parameters: exponential },
            Form { name: "power", parameters: power },
            Form { name: "exponential, shown", parameters: shown_exponential },
            Form { name: "power, shown", parameters: shown_power },
        ]
    }

    /// What hardly fades while it is recorded is told from what stays by the forms of both alone, and no form is that exact: a decay
    /// is one of which the recordings show the end.
    fn sought(&self, typical: &Typical) -> Vec<Form> {
        let mut forms = self.forms(typical);
        if typical.duration > 0.0 {
            for parameter in forms.iter_mut().flat_map(|form| &mut form.parameters) {
                match parameter.name.as_ref() {
                    "recovery" => shortened(parameter, RECOVERED * typical.duration),
                    "lag" => shortened(parameter, BEGUN * typical.duration),
                    "exponent" => parameter.lower = SLOWEST,
                    _ => {}
                }
            }
        }
        forms
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
        let exponential = form.is_multiple_of(SHOWN);
        let paid = match form < SHOWN {
            true => vec![HALF; thetas.lanes()],
            false => thetas.row(paid_at(exponential)).to_vec(),
        };
        let displaced = (0..thetas.lanes()).map(|lane| kernel(exponential, |k| thetas.row(k)[lane])).collect();
        Box::new(Decaying { exponential, bps: thetas.row(0).to_vec(), paid, displaced, last: f64::NEG_INFINITY })
    }
}

impl Demanding for TransientImpact {
    fn needs(&self, _form: usize) -> &'static [Need] {
        &[Need::DailyVolume]
    }
}

/// Within this part of a recording a displacement falls to 1 / e: on average orders have as much of it behind them.
const RECOVERED: f64 = 0.5;
/// Within this part a power law begins to fall, ...
const BEGUN: f64 = 0.01;
/// ... and no slower than this: exponents of 0.2 and more are what was found (Bouchaud et al. 2004).
const SLOWEST: f64 = 0.2;

/// Bounds a time by `longest` [s], with a start within it.
fn shortened(time: &mut Parameter, longest: f64) {
    time.upper = time.upper.min(longest);
    time.starts.retain(|start| *start < longest);
    if time.starts.is_empty() {
        time.starts.push(0.5 * longest);
    }
}

/// What an order pays of what it moves where that is spread evenly over the prices it takes.
const HALF: f64 = 0.5;

/// The kernel of a form where its parameters have these values.
fn kernel(exponential: bool, value: impl Fn(usize) -> f64) -> Propagator {
    if exponential { Propagator::exponential(value(1)) } else { Propagator::power(value(1), value(2)) }
}

/// The number of `paid` among the parameters of a form that has it: it follows those of the kernel.
const fn paid_at(exponential: bool) -> usize {
    if exponential { 2 } else { 3 }
}

#[derive(Clone)]
struct Decaying {
    exponential: bool,
    bps: Vec<f64>,
    /// The part of what an order moves that it pays itself.
    paid: Vec<f64>,
    /// What is left of own impact [bps].
    displaced: Vec<Propagator>,
    /// When the last order met the market [s], of all lanes.
    last: f64,
}

impl Law<Execution> for Decaying {
    fn change(&mut self, change: &LaneChange<'_>) {
        let exponential = self.exponential;
        change.parameter(0, &mut self.bps);
        change.derived(&mut self.paid, |values| values.get(paid_at(exponential)).copied().unwrap_or(HALF));
        Propagator::change(&mut self.displaced, change, |values| kernel(exponential, |k| values[k]));
        change.shared(&mut self.last, |_| f64::NEG_INFINITY);
    }

    fn act(&mut self, tick: Tick, scene: &Scene<'_, Execution>, effects: &mut [ExecutionEffect]) {
        // Nothing is displaced before the first order, and no order comes before one that came before it.
        let seconds = if self.last.is_finite() { (tick.time - self.last).max(0.0) } else { 0.0 };
        if !scene.commands.iter().any(|order| order.takes()) {
            // Those that rest meet what is left by then, and leave nothing.
            for ((effect, order), displaced) in effects.iter_mut().zip(scene.commands).zip(&self.displaced) {
                effect.displaced += displaced.left_after(seconds) * order.mid * 1e-4;
            }
            return;
        }
        self.last = self.last.max(tick.time);
        let lanes = self.bps.iter().zip(&self.paid).zip(&mut self.displaced);
        for (((effect, met), order), ((bps, paid), displaced)) in
            effects.iter_mut().zip(scene.inputs).zip(scene.commands).zip(lanes)
        {
            let own = bps * order.participation(met.volume);
            displaced.pass(seconds);
            effect.displaced += displaced.left() * order.mid * 1e-4;
            effect.concession += paid * own * order.mid * 1e-4;
            displaced.kick(order.side.sign() * own);
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::LinearImpact;
    use super::super::schedule::{Child, concessions, paid};
    use super::*;
    use crate::market::Role;

    #[test]
    fn children_pay_what_is_left_of_those_before_them_and_half_their_own() {
        // 1000 bps a day's volume: 1 % moves 10 bps. After 6.93 s, ln 2 of 10 s, half of it is left.
        let half_life = 10.0 * 2.0_f64.ln();
        let children = [0.0, 1.0, 2.0].map(|k| Child::bought(k * half_life, 0.01));
        let exponential = concessions(&TransientImpact, 0, &[1_000.0, 10.0], &children);
        for (found, expected) in exponential.iter().zip([5.0, 10.0, 12.5]) {
            assert!((found - expected).abs() < 1e-9, "{exponential:?}");
        }
        // A block of the three at once: half of 30 bps each. The sale at once meets all 30, and gets back half of what it moves.
        let block = concessions(&TransientImpact, 0, &[1_000.0, 10.0], &[Child::bought(0.0, 0.03), Child::sold(0.0, 0.01)]);
        assert!((block[0] - 15.0).abs() < 1e-9 && (block[1] + 25.0).abs() < 1e-9, "{block:?}");
        // (1 + t)^-1/2: a quarter of the time constants at 15 s.
        let children = [Child::bought(0.0, 0.01), Child::bought(15.0, 0.01), Child::sold(15.0 + 80.0, 0.01)];
        let power = concessions(&TransientImpact, 1, &[1_000.0, 1.0, 0.5], &children);
        let left = 10.0 / 96.0_f64.sqrt() + 10.0 / 81.0_f64.sqrt();
        for (found, expected) in power.iter().zip([5.0, 10.0 / 4.0 + 5.0, 5.0 - left]) {
            assert!((found - expected).abs() < 1e-3, "{power:?}, not {expected}");
        }
    }

    /// In a day of 6.5 hours: not what takes three days to fade, nor what begins to fade after an hour.
    #[test]
    fn a_decay_is_one_of_which_recordings_show_the_end() {
        let day = Typical { duration: 23_400.0, ..Typical::default() };
        for form in Mechanism::<Execution>::sought(&TransientImpact, &day) {
            let seconds = form.parameters.iter().filter(|p| p.unit == "s");
            let bounds: Vec<f64> = seconds.map(|p| p.upper).collect();
            assert!(bounds == [if form.name.starts_with("power") { 234.0 } else { 11_700.0 }], "{}: {bounds:?}", form.name);
            let within = |p: &Parameter| p.starts.iter().all(|start| (p.lower..=p.upper).contains(start));
            assert!(form.parameters.iter().all(|p| p.starts.is_empty() || within(p)), "{form:?}");
        }
        let brief = Typical { duration: 5.0, ..Typical::default() };
        let forms = Mechanism::<Execution>::sought(&TransientImpact, &brief);
        assert!(forms.iter().flat_map(|form| &form.parameters).all(|p| !p.starts.is_empty() || p.name == "paid"));
        // Whoever says what a broker does may say what he likes.
        let said = Mechanism::<Execution>::forms(&TransientImpact, &day);
        assert!(said[0].parameters[1].upper > 1e6);
    }

    #[test]
    fn an_order_long_after_the_last_meets_the_price_as_it_was() {
        let children = [Child::bought(0.0, 0.05), Child::bought(1_000.0, 0.01)];
        let late = concessions(&TransientImpact, 0, &[1_000.0, 10.0], &children)[1];
        assert!((late - 5.0).abs() < 1e-9, "the price has returned: {late}");
    }

    #[test]
    fn what_is_gone_at_once_is_half_of_linear_impact() {
        let children = [Child::bought(0.0, 0.02), Child::bought(0.0, 0.01), Child::sold(3.0, 0.05)];
        let gone = concessions(&TransientImpact, 0, &[1_000.0, 0.0], &children);
        assert_eq!(gone, concessions(&LinearImpact, 0, &[500.0], &children));
    }

    #[test]
    fn a_resting_order_neither_pays_nor_moves_the_price() {
        let resting = Child { role: Role::Maker, ..Child::bought(1.0, 0.5) };
        let children = [Child::bought(0.0, 0.01), resting, Child::bought(2.0, 0.01)];
        let with = concessions(&TransientImpact, 0, &[1_000.0, 10.0], &children);
        let without = concessions(&TransientImpact, 0, &[1_000.0, 10.0], &[children[0], children[2]]);
        assert_eq!(with[1], 0.0);
        assert!((with[2] - without[1]).abs() < 1e-12);
    }

    proptest! {
        #[test]
        fn no_round_trip_gains_and_what_is_spread_out_costs_no_more_than_the_block(
            sizes in prop::collection::vec(-0.05..0.05_f64, 1..20), gap in 0.0..60.0_f64, form in 0..2_usize,
        ) {
            let theta: &[f64] = if form == 0 { &[800.0, 20.0] } else { &[800.0, 2.0, 0.4] };
            let mut trip: Vec<Child> = sizes.iter().enumerate().map(|(k, x)| Child::signed(gap * k as f64, *x)).collect();
            trip.push(Child::signed(gap * sizes.len() as f64, -sizes.iter().sum::<f64>()));
            let cost = paid(&TransientImpact, form, theta, &trip);
            prop_assert!(cost > -1e-9, "a round trip gains {}", -cost);
            let bought: Vec<Child> = trip[..sizes.len()].iter().map(|c| Child::bought(c.time, c.size.abs())).collect();
            let block = Child::bought(0.0, bought.iter().map(|c| c.size).sum());
            let (parts, whole) = (paid(&TransientImpact, form, theta, &bought), paid(&TransientImpact, form, theta, &[block]));
            prop_assert!(parts < whole + 1e-9, "{parts} in parts, {whole} at once");
        }
    }
}
