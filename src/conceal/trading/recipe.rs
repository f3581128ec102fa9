//! From a name to an effect: shapes are drawn once, strength is turned until the effect is as large as wanted.

use rand::{Rng, RngExt};

use super::case::World;
use super::climate::logarithmic;
use super::effect::{Effect, Fee, Foreign, Growth, Way};
use super::floor::Scene;
use super::wake::Kernel;

/// What registries may have, by its name there, in orders that take.
pub(super) const KNOWN: [&str; 12] = [
    "half_spread",
    "book_walk",
    "linear_impact",
    "sqrt_impact",
    "permanent_impact",
    "transient_impact",
    "volatility_slippage",
    "command_delay",
    "commission",
    "participation_cap",
    "lot_size",
    "stale_quotes",
];

/// The same in orders that rest.
pub(super) const RESTING: [&str; 2] = ["adverse_selection", "queue_position"];

/// What no registry has.
pub(super) const FOREIGN: [&str; 8] = [
    "time_of_day_cost",
    "last_look",
    "round_price_improvement",
    "turnover_fee",
    "momentum_ignition",
    "clock_phase_cost",
    "side_cost",
    "imbalance_cost",
];

/// Names that one case does not hold both of: they are one thing in two words, or no log could part them.
const ALIKE: [&[&str]; 2] =
    [&["linear_impact", "sqrt_impact", "permanent_impact", "transient_impact"], &["participation_cap", "lot_size"]];

/// Whether one case may hold both.
pub(super) fn compatible(one: &str, other: &str) -> bool {
    let resting = |id: &str| RESTING.contains(&id);
    let mixed = [one, other].iter().all(|id| resting(id) || ["commission", "stale_quotes"].contains(id));
    let alike = ALIKE.iter().any(|names| names.contains(&one) && names.contains(&other));
    one != other && !alike && (mixed || !resting(one) && !resting(other))
}

/// A shape with its strength left open.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Recipe {
    pub id: &'static str,
    /// Strengths that make sense.
    pub range: (f64, f64),
    growth: Growth,
    power: f64,
    kernel: Kernel,
    kernel_told: String,
    plateau: bool,
    way: Way,
    schedule: usize,
    shape: [f64; 3],
}

impl Recipe {
    pub fn draw(id: &'static str, rng: &mut impl Rng) -> Self {
        let growth = match (id, rng.random::<bool>()) {
            ("linear_impact", _) => Growth::Power(rng.random_range(0.93..1.07)),
            (_, true) => Growth::Power(rng.random_range(0.45..0.55)),
            _ => Growth::Logarithm(rng.random_range(0.2..0.5)),
        };
        let power = if rng.random::<bool>() { 1.0 } else { rng.random_range(0.85..1.0) };
        let (kernel, kernel_told, plateau) = if id == "permanent_impact" { lasting() } else { fading(rng) };
        let way = if rng.random::<bool>() { Way::Lognormal(rng.random_range(0.1..0.5)) } else { Way::Twofold };
        let (schedule, shape) = (rng.random_range(0..4), std::array::from_fn(|_| rng.random()));
        Self { id, range: range(id), growth, power, kernel, kernel_told, plateau, way, schedule, shape }
    }

    /// The effect at a strength.
    pub fn at(&self, strength: f64, scene: &Scene<'_>) -> Effect {
        let bps = strength;
        match self.id {
            "half_spread" => Effect::Spread { fraction: strength },
            // The stronger, the less the best level shows.
            "book_walk" => Effect::Walk { usual: scene.usual / strength, hidden: self.between(0, 0.0, 0.3) },
            "linear_impact" | "sqrt_impact" => Effect::Impact { bps, growth: self.growth },
            "permanent_impact" | "transient_impact" => {
                Effect::Displacement { bps, power: self.power, kernel: self.kernel.clone() }
            }
            "volatility_slippage" => Effect::Slippage { fraction: strength },
            "command_delay" => Effect::Latency { seconds: strength, way: self.way },
            "commission" => Effect::Fee(self.fee(strength, scene)),
            "participation_cap" => {
                // The stronger, the smaller the part: of what an order of the middle size would be.
                let fraction = scene.middle / (scene.levels as f64 * scene.usual) / strength;
                Effect::Cap { fraction, wobble: self.between(0, 0.02, 0.08) }
            }
            "lot_size" => {
                Effect::Lots { lot: [5.0, 10.0, 20.0, 25.0, 50.0, 100.0, 200.0][(strength.floor() as usize).min(6)] }
            }
            "stale_quotes" => Effect::Age { seconds: strength },
            "adverse_selection" => Effect::Toxic { bps, time: self.between(0, 0.7, 4.0) },
            "queue_position" => Effect::Queue { ahead: strength, wobble: self.between(0, 0.1, 0.4) },
            _ => Effect::Foreign(self.foreign(strength, scene)),
        }
    }

    fn fee(&self, bps: f64, scene: &Scene<'_>) -> Fee {
        let price = scene.tape.rows[0].price;
        // What is charged an order is stated in whole cents.
        let cents = |amount: f64| (100.0 * amount).round().max(1.0) / 100.0;
        let of_middle = 1e-4 * bps * price * scene.middle;
        match self.schedule {
            0 => Fee::OfNotional(bps),
            1 => Fee::PerShare(1e-4 * bps * price),
            2 => Fee::Minimum(1e-4 * bps * price, cents(self.between(0, 0.3, 1.0) * of_middle)),
            _ => Fee::PerOrder(cents(of_middle)),
        }
    }

    fn foreign(&self, strength: f64, scene: &Scene<'_>) -> Foreign {
        let bps = strength;
        match self.id {
            "time_of_day_cost" => Foreign::TimeOfDay { bps },
            "last_look" => {
                let look = self.between(0, 0.5, 3.0);
                Foreign::LastLook { moved: scene.tape.moves_over(look) / strength, look }
            }
            "round_price_improvement" => Foreign::RoundPrices { bps, ticks: if self.shape[0] < 0.5 { 5 } else { 10 } },
            "turnover_fee" => Foreign::Turnover { bps },
            "momentum_ignition" => Foreign::Followers { bps, time: self.between(0, 8.0, 30.0) },
            "clock_phase_cost" => Foreign::ClockPhase { bps, period: if self.shape[0] < 0.5 { 1.0 } else { 60.0 } },
            "side_cost" => Foreign::Side { bps },
            _ => Foreign::Imbalance { bps },
        }
    }

    /// `low` to `high` by the `k`-th number of the shape.
    fn between(&self, k: usize, low: f64, high: f64) -> f64 {
        low + (high - low) * self.shape[k]
    }

    /// Whether what it leaves is gone before an hour is over but for a part.
    pub fn leaves_a_plateau(&self) -> bool {
        self.id == "transient_impact" && self.plateau
    }

    /// Its form in words.
    pub fn told(&self, effect: &Effect, world: World) -> String {
        let form = match effect {
            Effect::Spread { .. } => "a part of the half spread, to half ticks by chance".to_owned(),
            Effect::Walk { hidden, .. } => format!("level after level, {hidden:.2} hidden beside what is displayed"),
            Effect::Impact { growth, .. } => growth.told(),
            Effect::Displacement { power, .. } => match world {
                World::Live => format!("Q^{power:.2}, {}, on the tape", self.kernel_told),
                World::Paper => format!("Q^{power:.2}, {}, in fills alone", self.kernel_told),
            },
            Effect::Slippage { .. } => "of the volatility of the last five minutes".to_owned(),
            Effect::Latency { way: Way::Lognormal(width), .. } => format!("lognormal ({width:.2}), one in 25 held up"),
            Effect::Latency { way: Way::Twofold, .. } => "sum of two exponentials, one in 25 held up".to_owned(),
            Effect::Fee(Fee::OfNotional(_)) => "of the notional, to the cent".to_owned(),
            Effect::Fee(Fee::PerShare(_)) => "a share, to the cent".to_owned(),
            Effect::Fee(Fee::Minimum(..)) => "a share with a minimum, to the cent".to_owned(),
            Effect::Fee(Fee::PerOrder(_)) => "an order, to the cent".to_owned(),
            Effect::Cap { wobble, .. } => format!("of what is displayed, give or take {wobble:.2}"),
            Effect::Lots { .. } => "whole lots".to_owned(),
            Effect::Age { .. } => "of one age".to_owned(),
            Effect::Toxic { time, .. } => format!("within some {time:.1} s of each fill at rest"),
            Effect::Queue { wobble, .. } => format!("more than is displayed, give or take {wobble:.2}"),
            Effect::Foreign(foreign) => format!("{foreign:?}"),
        };
        format!("{}: {form}", self.id)
    }
}

fn lasting() -> (Kernel, String, bool) {
    (Kernel::lasting(), "lasting".to_owned(), false)
}

fn fading(rng: &mut impl Rng) -> (Kernel, String, bool) {
    let time = logarithmic(rng, 4.0, 120.0);
    match rng.random_range(0..3) {
        0 => {
            let (share, slow) = (rng.random_range(0.2..0.5), time * rng.random_range(4.0..8.0));
            (Kernel::twofold(share, time, slow), format!("fading with {time:.1} s and {slow:.1} s"), false)
        }
        1 => {
            let plateau = rng.random_range(0.05..0.2);
            (Kernel::with_plateau(plateau, time), format!("fading with {time:.1} s but for {plateau:.2}"), true)
        }
        _ => {
            let (time, exponent) = (logarithmic(rng, 0.3, 5.0), rng.random_range(0.4..0.9));
            (Kernel::power(time, exponent), format!("fading as t^-{exponent:.2} from {time:.1} s on"), false)
        }
    }
}

/// From hardly there to as much as a broker that one stays with could have.
fn range(id: &str) -> (f64, f64) {
    match id {
        "half_spread" => (0.15, 1.5),
        "book_walk" => (0.3, 60.0),
        "volatility_slippage" => (1e-4, 0.1),
        "command_delay" => (0.01, 15.0),
        "participation_cap" => (0.05, 5.0),
        "lot_size" => (0.5, 6.99),
        "stale_quotes" => (0.05, 20.0),
        "queue_position" => (0.2, 4.0),
        "last_look" => (0.3, 20.0),
        _ => (0.02, 40.0),
    }
}
