//! The price of immediacy: an order that takes pays half the spread.

use crate::market::{Execution, ExecutionEffect, OrderLog, Quotes};
use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Scene, Seed, Site, Thetas, Tick, Typical};

use super::need::{Demanding, Need, known};

/// `price = reference + side * fraction * (ask - bid) / 2`, or `reference + side * bps * mid / 1e4` where no quotes are
/// known. Where none are, a spread may have widened with the volatility: in the form `of_volatility` half of it is
/// `fraction_of_recent` of the standard deviation of the return over five minutes, as in
/// [`VolatilitySlippage`](super::VolatilitySlippage), from which nothing tells it there.
///
/// Source: Demsetz, "The cost of transacting", Quarterly Journal of Economics 82 (1968); effective spread as in Huang &
/// Stoll, Journal of Financial Economics 41 (1996); spreads in proportion to volatility, Wyart, Bouchaud, Kockelkoren, Potters &
/// Vettorazzo, Quantitative Finance 8 (2008).
#[derive(Debug, Clone, Copy)]
pub struct HalfSpread;

/// The forms.
const FRACTION: usize = 0;
const OF_VOLATILITY: usize = 2;

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
            Form {
                name: "of_volatility",
                parameters: vec![
                    Parameter::new("fraction_of_recent", "", 0.0)
                        .within(0.0, 100.0)
                        .starting_at(&[0.2, 0.02])
                        .proportional(),
                ],
            },
        ]
    }

    /// The fraction needs quotes that show a spread; where they do, they, and no other form, say what it was.
    fn applies(&self, form: usize, _plant: &Execution, log: &OrderLog) -> bool {
        (form == FRACTION) == shows_spreads(log.tape().quotes()) && known(self.needs(form), log)
    }

    fn law(&self, form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<Execution>> {
        Box::new(Concession { form, size: thetas.row(0).to_vec() })
    }
}

impl Demanding for HalfSpread {
    fn needs(&self, form: usize) -> &'static [Need] {
        match form {
            FRACTION => &[Need::Quotes],
            OF_VOLATILITY => &[Need::RecentVolatility],
            _ => &[],
        }
    }
}

/// Whether any of the quotes has its offer above its bid: mids that were written down as both show no spread.
fn shows_spreads(quotes: &Quotes) -> bool {
    let all = quotes.all();
    (0..all.len()).any(|row| all.get(row).and_then(|quote| Some(quote.ask()? > quote.bid()?)).unwrap_or(false))
}

#[derive(Clone)]
struct Concession {
    form: usize,
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
            effect.concession += size
                * match self.form {
                    FRACTION => met.book.half_spread(),
                    OF_VOLATILITY => order.recent_volatility.unwrap_or(0.0) * order.mid,
                    _ => order.mid * 1e-4,
                };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::schedule::{MID, concession};
    use super::*;
    use crate::market::{InFlight, Level, Side};
    use crate::sim2real::Timestamp;

    #[test]
    fn a_spread_that_nobody_shows_may_go_with_the_volatility() {
        let order = InFlight::market(Side::Buy, 10.0, Timestamp(0), MID, MID);
        let order = InFlight { recent_volatility: Some(0.001), ..order };
        let conceded = |form: usize, size: f64| {
            let mut law = HalfSpread.law(form, &Thetas::single(&[size]), Seed(1));
            concession(law.as_mut(), 0.0, order) / MID * 1e4
        };
        assert!((conceded(OF_VOLATILITY, 0.2) - 2.0).abs() < 1e-9, "a fifth of 10 bps");
        assert!((conceded(1, 0.7) - 0.7).abs() < 1e-9);
        assert_eq!(conceded(FRACTION, 1.0), 0.0, "there is none where it was met");
    }

    #[test]
    fn mids_show_no_spread() {
        let mut quotes = Quotes::with_depth(1);
        let level = |price: f64| [Level { price, size: 1.0 }];
        quotes.push(Timestamp(0), &level(10.0), &level(10.0));
        assert!(!shows_spreads(&quotes));
        quotes.push(Timestamp(1), &level(10.0), &level(10.01));
        assert!(shows_spreads(&quotes) && !shows_spreads(&Quotes::default()));
    }
}
