//! Old news: whoever decides sees quotes that are older than the backtest thinks.

use crate::market::{Execution, InFlight, OrderLog};
use crate::sim2real::{About, Assembly, Form, LaneChange, Law, Mechanism, Parameter, Seed, Site, Thetas, Tick, Typical};

/// `seen(t) = market(t - seconds)`: what an order is decided on is so old when it is decided.
///
/// In a run all data reach the strategy so much later, in addition to what `[latency]` says of `feed`: decisions are made as much
/// later, on what was there before. In a log whose orders say what they saw (`seen_bid`, `seen_ask`), the channel `seen` is the mid
/// that was seen beside the mid of the tape when the order was decided, and the law says of which past of the tape that is. A
/// log tells of it where one age explains nearly all its orders; what it costs to decide late is in the price of the tape at
/// the decision already.
///
/// It acts on what was observed before the command was made: what its law moves is the time until which the market had been
/// seen, which an order carries with it.
///
/// Source: Moallemi & Sağlam, "The cost of latency in high-frequency trading", Operations Research 61 (2013); Ding, Hanna &
/// Hendershott, "How slow is the NBBO?", Financial Review 49 (2014), for stale quotes as they are seen.
#[derive(Debug, Clone, Copy)]
pub struct StaleQuotes;

/// Id in twins and runs.
const NAME: &str = "stale_quotes";

impl StaleQuotes {
    /// How much later than they would data reach whoever decides before `venue` [s].
    #[must_use]
    pub fn delay_before(venue: &Assembly<Execution>) -> f64 {
        let own = venue.mechanisms().filter(|(mechanism, ..)| mechanism.about().name == NAME);
        own.flat_map(|(.., parameters)| parameters).map(|parameter| parameter.nominal).sum()
    }
}

impl Mechanism<Execution> for StaleQuotes {
    fn about(&self) -> About {
        About {
            name: NAME,
            site: Site::Observation,
            title: "stale quotes",
            law: "seen(t) = market(t - seconds)",
            source: "Moallemi & Sağlam, Operations Research 61 (2013); Ding, Hanna & Hendershott, Financial Review 49 (2014)",
            remedy: "decide on data as late as they arrive: give the backtest the latency of its feed",
            contains: &[],
        }
    }

    fn forms(&self, typical: &Typical) -> Vec<Form> {
        let shown = typical.age.filter(|age| *age > 0.0 && *age <= LONGEST);
        let starts: Vec<f64> = shown.into_iter().chain([0.001, 0.01, 0.1, 0.5, 1.0]).collect();
        Form::only(vec![Parameter::new("seconds", "s", 0.0).within(0.0, LONGEST).starting_at(&starts).stepped()])
    }

    fn applies(&self, _form: usize, _plant: &Execution, log: &OrderLog) -> bool {
        log.shown_age().is_some()
    }

    /// What is moved is what the order says of its past, before it is sent.
    fn site(&self, _form: usize) -> Site {
        Site::Command
    }

    fn law(&self, _form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<Execution>> {
        Box::new(Aged { seconds: thetas.row(0).to_vec() })
    }
}

/// The oldest that quotes may be: a day [s].
const LONGEST: f64 = 86_400.0;

#[derive(Clone)]
struct Aged {
    seconds: Vec<f64>,
}

impl Law<Execution> for Aged {
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.seconds);
    }

    fn shape(&mut self, _tick: Tick, orders: &mut [InFlight]) {
        for (order, seconds) in orders.iter_mut().zip(&self.seconds) {
            order.seen_until = order.seen_until.plus_seconds(-seconds);
        }
    }
}
