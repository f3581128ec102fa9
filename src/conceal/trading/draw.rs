//! One case: a market, a client, two days, a twin and a label, drawn from a seed.

use rand::{Rng, RngExt};

use super::case::{Day, Depth, Label, TradingCase, World};
use super::client::{Habits, Intent};
use super::climate::{Climate, TICK, logarithmic};
use super::effect::Effect;
use super::excitation::Peculiar;
use super::executed::Outcome;
use super::floor::Scene;
use super::plan::{Circumstances, Plan};
use super::recipe::Recipe;
use super::size::{Channel, difference, strength};
use super::tables::Written;
use super::tape::{LEVELS, Tape};
use super::truth::parameters;
use crate::conceal::{Concealed, Kind, Null};
use crate::sim2real::Seed;

/// Sizes of effects, evenly in the logarithm [standard deviations of the noise], where they show in costs, fees or what was seen,
/// in the part filled, and in the recorded mid.
const SIZES: [(f64, f64); 3] = [(0.5, 12.0), (1.0, 15.0), (0.3, 2.5)];
/// Sizes at which a search has not gone astray.
const ACCEPTED: (f64, f64) = (0.25, 40.0);
/// The size of what is there and not to be seen for what it is, where its size can be chosen.
const UNKNOWABLE: f64 = 3.0;
/// Markets and clients tried for a case; after that, what is there is taken.
const ATTEMPTS: usize = 8;
/// The opens of the two days: 14:30 UTC on 3 and 4 March 2025 [ns since the Unix epoch].
const OPENS: [i64; 2] = [1_741_012_200_000_000_000, 1_741_098_600_000_000_000];

/// Case `index` of `seed`: always the same, whichever others are drawn.
#[must_use]
pub fn draw(seed: Seed, index: usize) -> TradingCase {
    let plan = Plan::of(seed, index);
    let own = seed.child(&format!("trading case {index}"));
    let mut set = Set::draw(&plan, own);
    for attempt in 1..ATTEMPTS {
        if set.sizes().iter().all(|size| plan.accepts(*size)) {
            break;
        }
        set = Set::draw(&plan, own.child(&format!("attempt {attempt}")));
    }
    set.case(index)
}

impl Plan {
    fn accepts(&self, size: f64) -> bool {
        self.kind == Kind::NotExcited || (ACCEPTED.0..ACCEPTED.1).contains(&size)
    }

    /// How the client trades on the two days, with orders of these `sizes` [units] on the first.
    fn habits(&self, sizes: (f64, f64), rng: &mut impl Rng) -> [Habits; 2] {
        let foresight = if self.kind == Kind::Null(Null::Alpha) { rng.random_range(0.2..0.5) } else { 0.0 };
        let resting = if self.rests() { rng.random_range(0.5..0.8) } else { 0.0 };
        let later = rng.random_range(0.7..1.4);
        [1.0, later].map(|scale| Habits {
            count: rng.random_range(400..900),
            sizes: (sizes.0 * scale, sizes.1 * scale),
            persistence: rng.random_range(0.5..0.75),
            haste: rng.random_range(0.6..1.3),
            foresight,
            whole: 1.0,
            resting,
        })
    }

    /// By what factor the twin is off in what it knows of the market.
    fn off(&self, rng: &mut impl Rng) -> f64 {
        let usual = rng.random_range(-0.2..0.2_f64);
        let far = if rng.random::<bool>() { 0.9 } else { -0.9 };
        (if self.kind == Kind::Null(Null::MisSet) { far + usual } else { usual }).exp()
    }
}

/// A market, a client and what is concealed, before anything is traded.
pub(super) struct Set {
    plan: Plan,
    circumstances: Circumstances,
    climate: Climate,
    /// The middle size of orders, and the usual size of the best level where orders do not walk [units].
    middle: f64,
    usual: f64,
    noise: f64,
    tapes: [Tape; 2],
    orders: [Vec<Intent>; 2],
    recipes: Vec<Recipe>,
    effects: Vec<Effect>,
    /// What the twin takes for a day's volume [units] and volatility (a fraction).
    told: [f64; 2],
    lot: Option<f64>,
    heard: bool,
}

impl Set {
    pub fn draw(plan: &Plan, seed: Seed) -> Self {
        let mut circumstances = plan.circumstances(seed);
        let mut rng = seed.stream("set");
        let least = logarithmic(&mut *rng, 10.0, 80.0);
        let largest = least * 10.0_f64.powf(rng.random_range(1.5..2.1));
        let middle = (least * largest).sqrt();
        let mut climate = Climate::draw(largest, &mut *rng);
        let deep = logarithmic(&mut *rng, 1.5, 4.0);
        if plan.rests() {
            // Who rests is filled only where others trade as much as there is ahead.
            climate.volume *= 40.0;
        }
        let usual = if plan.rests() { deep * climate.volume / climate.trades } else { deep * largest };
        let noise = logarithmic(&mut *rng, 0.15, 0.6);
        if let Some(peculiar) = circumstances.peculiar {
            peculiar.shape(&mut climate, &mut circumstances);
        }
        let recipes: Vec<Recipe> = plan.ids.iter().map(|id| Recipe::draw(id, &mut *rng)).collect();
        let habits = plan.habits((least, largest), &mut *rng);
        let tapes = DAYS.map(|day| Tape::draw(&climate, seed.child(day)));
        let orders = std::array::from_fn(|day| {
            let peculiar = circumstances.peculiar.map(|peculiar| peculiar.habits(&habits[day], day == 0, middle, WHOLE));
            peculiar.unwrap_or_else(|| habits[day].clone()).orders(&tapes[day], circumstances.noise, seed.child(DAYS[day]))
        });
        let told = [climate.volume, climate.volatility].map(|value| value * plan.off(&mut *rng));
        let (lot, heard) = (rng.random::<bool>().then_some(1.0), rng.random::<bool>());
        let (plan, effects) = (plan.clone(), Vec::new());
        let mut set =
            Self { plan, circumstances, climate, middle, usual, noise, tapes, orders, recipes, effects, told, lot, heard };
        set.effects = set.concealing(seed);
        set
    }

    /// A day as it is before orders are sent, with the book as `effects` have it.
    pub fn scene(&self, day: usize, effects: &[Effect]) -> Scene<'_> {
        let usual = effects.iter().find_map(|effect| match effect {
            Effect::Walk { usual, .. } => Some(*usual),
            _ => None,
        });
        Scene {
            tape: &self.tapes[day],
            orders: &self.orders[day],
            world: self.circumstances.world,
            price: self.circumstances.price,
            levels: if self.circumstances.depth == Depth::FiveLevels { LEVELS } else { 1 },
            usual: usual.unwrap_or(self.usual),
            middle: self.middle,
            noise: self.noise,
        }
    }

    /// The effects of the case, each as large as was drawn for it.
    fn concealing(&self, seed: Seed) -> Vec<Effect> {
        let mut rng = seed.stream("sizes");
        let mut effects: Vec<Effect> = Vec::new();
        for recipe in &self.recipes {
            let drawn = rng.random::<f64>();
            let at = |strength: f64| recipe.at(strength, &self.scene(0, &[]));
            let channel = Channel::of(&at(1.0), self.circumstances.world == World::Live);
            let (low, high) = SIZES[match channel {
                Channel::Filled => 1,
                Channel::Mid => 2,
                Channel::Cost | Channel::Fee | Channel::Seen => 0,
            }];
            let fixed = self.circumstances.peculiar.and_then(fixed_strength);
            let target = if self.plan.kind == Kind::NotExcited { UNKNOWABLE } else { low * (high / low).powf(drawn) };
            let found = fixed.unwrap_or_else(|| {
                strength(target, recipe.range, |strength| {
                    let all = [effects.clone(), vec![at(strength)]].concat();
                    self.size(&all, all.len() - 1)
                })
            });
            effects.push(at(found));
        }
        effects
    }

    /// The size of effect `k` of `effects`, beside the others, on the day to learn from.
    pub fn size(&self, effects: &[Effect], k: usize) -> f64 {
        let scene = self.scene(0, effects);
        let channel = Channel::of(&effects[k], self.circumstances.world == World::Live);
        let [with, without] = self.with_and_without(effects, k).map(|outcome| channel.shows(&scene, &outcome));
        let noise = channel.noise(&scene, self.mid_noise());
        // A cost that is the same for all is something any twin can be given; what moves the mid goes the way of each order.
        let about_mean = self.plan.kind == Kind::Outside && channel != Channel::Mid;
        difference(&with, &without, about_mean) / noise
    }

    /// The day to learn from with all of `effects`, and with all but the `k`-th; the displayed book is the same.
    fn with_and_without(&self, effects: &[Effect], k: usize) -> [Outcome; 2] {
        let others: Vec<Effect> = effects.iter().enumerate().filter(|(n, _)| *n != k).map(|(_, e)| e.clone()).collect();
        let scene = self.scene(0, effects);
        [scene.with(effects), scene.with(&others)]
    }

    /// What is concealed.
    #[cfg(test)]
    pub fn effects(&self) -> &[Effect] {
        &self.effects
    }

    /// The sizes of all effects.
    pub fn sizes(&self) -> Vec<f64> {
        (0..self.effects.len()).map(|k| self.size(&self.effects, k)).collect()
    }

    fn mid_noise(&self) -> f64 {
        self.tapes[0].moves_over(10.0)
    }

    fn day(&self, day: usize) -> Day {
        let scene = self.scene(day, &self.effects);
        let written = Written { symbol: SYMBOL, open: OPENS[day], circumstances: &self.circumstances, heard: self.heard };
        written.day(&scene, &scene.with(&self.effects))
    }

    fn case(&self, index: usize) -> TradingCase {
        TradingCase {
            symbol: SYMBOL.to_owned(),
            price: self.circumstances.price,
            tick: TICK,
            lot: self.lot,
            average_daily_volume: self.told[0].round(),
            daily_volatility: (1e5 * self.told[1]).round() / 1e5,
            train: self.day(0),
            test: self.day(1),
            label: self.label(index),
        }
    }

    fn label(&self, index: usize) -> Label {
        let outside = self.plan.kind == Kind::Outside;
        let sizes = self.sizes();
        let scene = self.scene(0, &self.effects);
        let concealed = (0..self.effects.len()).map(|k| {
            let [with, without] = self.with_and_without(&self.effects, k);
            Concealed {
                id: self.recipes[k].id.to_owned(),
                size: sizes[k],
                parameters: parameters(self.recipes[k].id, &self.effects[k], &scene, [&with, &without], self.told),
                simpler: Vec::new(),
                onset: None,
                active: Vec::new(),
            }
        });
        let circumstances = &self.circumstances;
        let forms = self.recipes.iter().zip(&self.effects).map(|(recipe, effect)| recipe.told(effect, circumstances.world));
        Label {
            index,
            kind: self.plan.kind,
            effects: if outside { Vec::new() } else { concealed.collect() },
            outside: outside.then(|| (self.plan.ids[0].to_owned(), sizes[0])),
            tolerated: self.tolerated(),
            forms: forms.collect(),
            world: circumstances.world,
            depth: circumstances.depth,
            rounded: circumstances.rounded,
            noise: self.noise,
            noise_kind: circumstances.noise.told(),
            mid_noise: self.mid_noise(),
            average_daily_volume: self.climate.volume,
            daily_volatility: self.climate.volatility,
            orders: [self.orders[0].len(), self.orders[1].len()],
            peculiar: circumstances.peculiar.map_or(String::new(), |peculiar| peculiar.told().to_owned()),
        }
    }

    /// Names that are a part of the truth, or that these data cannot tell from it.
    fn tolerated(&self) -> Vec<String> {
        let mut names: Vec<&str> = Vec::new();
        // Orders that show on the tape took a tenth of a millisecond; stamps that were cut let them look late.
        let concealed = !self.effects.is_empty();
        if self.circumstances.world == World::Live || self.circumstances.rounded && concealed {
            names.push("command_delay");
        }
        if self.recipes.iter().any(Recipe::leaves_a_plateau) {
            names.push("permanent_impact");
        }
        if self.circumstances.peculiar == Some(Peculiar::FarApart) {
            names.push("linear_impact");
        }
        // Whoever waits is filled most when the price comes to the limit, whatever else is concealed.
        if self.plan.has("queue_position") {
            names.push("adverse_selection");
        }
        names.into_iter().map(str::to_owned).collect()
    }
}

/// What is traded.
const SYMBOL: &str = "XYZ";
/// What the streams of the two days are called.
const DAYS: [&str; 2] = ["train", "test"];
/// The lots of quantities that are whole lots anyway [units].
const WHOLE: f64 = 20.0;

/// The strength of what is not reached: it has no size to be found by.
fn fixed_strength(peculiar: Peculiar) -> Option<f64> {
    match peculiar {
        Peculiar::Calm => Some(0.5),
        Peculiar::Small => Some(1.0),
        // The third of the lots there are: that of whole quantities.
        Peculiar::WholeLots => Some(2.5),
        Peculiar::Unsaid => Some(1.0),
        Peculiar::OneSize | Peculiar::FarApart | Peculiar::OneSpread => None,
    }
}
