//! One case: arm, recordings, twin and label, drawn from a seed.

use rand::seq::SliceRandom;
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};

use super::arm::{Arm, Need, logarithmic, sign};
use super::effect::Effect;
use super::excitation::{Excitation, Swing, driven};
use super::label::Label;
use super::motion::{Drive, Machine, Motion, Precision};
use super::recipe::{FOREIGN, KNOWN, Recipe, UNREACHED, compatible, need};
use super::refit::Refit;
use super::scene::Scales;
use super::sensor::{Noise, Sensor};
use super::size::{Hideable, strength};
use super::truth::{self, Met};
use crate::conceal::kind::planned;
use crate::conceal::{Column, Concealed, Kind, Null, Table};
use crate::sim2real::Seed;

/// A twin, two recordings, and the truth about them.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// Whether the joint slides.
    pub linear: bool,
    /// What its twin takes for inertia, viscous friction, gravity torque and gain.
    pub nominal: [f64; 4],
    /// To what relative standard deviation it says to know them; 0 for exactly.
    pub uncertainty: [f64; 4],
    /// The recording to learn from: `t` [s], `u`, `q` [rad or m].
    pub train: Table,
    /// The recording to test on, moved in another way.
    pub test: Table,
    /// What is told after the diagnosis.
    pub label: Label,
}

/// Sizes of effects, evenly in the logarithm [noise standard deviations].
const SIZES: (f64, f64) = (0.5, 30.0);
/// Signal over noise [dB].
const SNR: (f64, f64) = (20.0, 45.0);
/// An effect that is not reached is at most this large in the recording to learn from.
const UNSEEN: f64 = 0.1;
/// Arms and recordings tried for one size before another size is drawn.
const PATIENCE: usize = 10;
/// Arms and recordings tried for a case; after that, what is nearest is taken.
const ATTEMPTS: usize = 80;
/// Nominal values are off by at most this part.
const FURTHEST_OFF: f64 = 0.3;
/// An effect after which an arm moves this many times as far makes another machine of it.
const RUNAWAY: f64 = 3.0;

/// Cases without an effect, in turn.
const NULLS: [Null; 5] = [Null::White, Null::Coloured, Null::Quantized, Null::MisSet, Null::Coarse];

/// What is to be concealed in a case.
struct Plan {
    kind: Kind,
    ids: Vec<&'static str>,
}

/// Case `index` of `seed`: always the same, whichever others are drawn.
#[must_use]
pub fn draw(seed: Seed, index: usize) -> Case {
    let plan = Plan::of(seed, index);
    let own = seed.child(&format!("case {index}"));
    let mut nearest = None;
    for attempt in 0..ATTEMPTS {
        let sizes = plan.sizes(own.child(&format!("sizes {}", attempt / PATIENCE)));
        let set = Set::draw(&plan, own.child(&format!("attempt {attempt}")));
        match set.concealing(&plan, &sizes) {
            Ok(concealed) => return set.case(index, &plan, &concealed),
            Err(Some(concealed)) => nearest = Some((set, concealed)),
            Err(None) => {}
        }
    }
    // Only a name that no arm shows at any strength gets here: then it is a case of what it comes to.
    let (set, concealed) = nearest.unwrap_or_else(|| (Set::draw(&plan, own), Dosage::default()));
    set.case(index, &plan, &concealed)
}

impl Plan {
    fn of(seed: Seed, index: usize) -> Self {
        let (kind, ordinal) = planned(index);
        let dealt = |names: &[&'static str], what: &str| {
            let (round, place) = (ordinal / names.len(), ordinal % names.len());
            let mut names = names.to_vec();
            names.shuffle(&mut seed.stream(&format!("{what} {round}")));
            names[place]
        };
        match kind {
            0 => Self { kind: Kind::Single, ids: vec![dealt(&KNOWN, "singles")] },
            1 => {
                let first = dealt(&KNOWN, "pairs");
                let mut rng = seed.stream(&format!("partner {ordinal}"));
                let others: Vec<&'static str> = KNOWN.into_iter().filter(|other| compatible(first, other)).collect();
                Self { kind: Kind::Pair, ids: vec![first, others[rng.random_range(0..others.len())]] }
            }
            2 => Self { kind: Kind::Null(NULLS[ordinal % NULLS.len()]), ids: Vec::new() },
            3 => Self { kind: Kind::Outside, ids: vec![dealt(&FOREIGN, "foreign")] },
            _ => Self { kind: Kind::NotExcited, ids: vec![dealt(&UNREACHED, "unreached")] },
        }
    }

    fn sizes(&self, seed: Seed) -> Vec<f64> {
        let mut rng = seed.stream("sizes");
        let unseen = self.kind == Kind::NotExcited;
        self.ids.iter().map(|_| if unseen { 0.5 * UNSEEN } else { logarithmic(&mut rng, SIZES.0, SIZES.1) }).collect()
    }

    fn need(&self) -> Need {
        let all = self.ids.iter().map(|id| need(id));
        all.fold(Need::default(), |a, b| Need { weighed: a.weighed || b.weighed, rotary: a.rotary || b.rotary })
    }

    fn has(&self, id: &str) -> bool {
        self.ids.contains(&id)
    }
}

/// A recipe at a strength.
type Dosed = (Recipe, f64);

/// Recipes at their strengths, and the size of each beside the others in the recording to learn from.
#[derive(Default)]
struct Dosage {
    dosed: Vec<Dosed>,
    sizes: Vec<f64>,
}

/// An arm and how it is moved, before anything is concealed.
struct Set {
    seed: Seed,
    arm: Arm,
    drives: [Drive; 2],
    excitation: [Excitation; 2],
    scales: Scales,
    recipes: Vec<Recipe>,
    noise: Noise,
    snr: f64,
    /// A test that goes further than what was learned from.
    further: bool,
    nominal: [f64; 4],
    uncertainty: [f64; 4],
}

impl Set {
    fn draw(plan: &Plan, seed: Seed) -> Self {
        let mut rng = seed.stream("set");
        let arm = Arm::draw(plan.need(), &mut rng);
        let duration = rng.random_range(20.0..24.0);
        let sample = match rng.random::<f64>() {
            x if x < 0.7 => 0.004,
            x if x < 0.8 => 0.002,
            x if x < 0.9 => 0.005,
            _ => 0.01,
        };
        let rows = (duration / sample) as usize;
        let swing = Swing::draw(&arm, &mut rng);
        let learnt = Excitation::to_learn(&mut rng);
        let excitation = [learnt, learnt.other(&mut rng)];
        let further = plan.kind == Kind::NotExcited && rng.random::<bool>();
        let other = if further { 1.5 } else { rng.random_range(0.75..1.1) };
        // A delay of the command is told from one of the sensor by what moves of itself.
        let released = !arm.adds_up() && (plan.has("command_delay") || plan.has("observation_delay"));
        let mut drive = |k: usize, part: f64| {
            let released = released || rng.random::<f64>() < 0.25;
            let start = if released { sign(&mut rng) * rng.random_range(0.2..0.8) * swing.usual } else { 0.0 };
            let wave = excitation[k].wave(rows, sample, arm.adds_up(), &mut rng);
            let swing = Swing { usual: part * swing.usual, most: part.max(1.0) * swing.most };
            driven(arm, &wave, sample, start, swing)
        };
        let drives = [drive(0, 1.0), drive(1, other)];
        let recipes = plan.ids.iter().map(|id| Recipe::draw(id, &mut rng)).collect();
        let noise = noise(plan, &mut rng);
        let (nominal, uncertainty) = mis_set(arm, plan.kind == Kind::Null(Null::MisSet), &mut rng);
        let snr = rng.random_range(SNR.0..SNR.1);
        let scales = Scales::of(arm, &drives[0]);
        Self { seed, arm, drives, excitation, scales, recipes, noise, snr, further, nominal, uncertainty }
    }

    /// Standard deviation of the noise [rad].
    fn sigma(&self) -> f64 {
        self.scales.reach / 10.0_f64.powf(self.snr / 20.0)
    }

    fn sensor(&self, effects: &[Effect], recording: usize) -> Sensor {
        let seed = self.seed.child(RECORDINGS[recording]);
        Sensor::new(effects, self.sigma(), self.noise, self.scales.duration, seed)
    }

    fn effects(&self, dosed: &[Dosed]) -> Vec<Effect> {
        dosed.iter().map(|(recipe, strength)| recipe.at(*strength, &self.scales)).collect()
    }

    /// The recording to learn from, as coarsely integrated as a search can afford, in which the size of what is called `id` shows.
    ///
    /// Unless that is the counting itself, before a sensor counts: where a small change moves a few readings by a whole step and all others
    /// by nothing, its root mean square is that of the step and not of what changed.
    fn rehearsed(&self, effects: &[Effect], noise: &[f64], id: &str) -> (Vec<f64>, Motion) {
        let seed = self.seed.child(RECORDINGS[0]);
        let motion = Machine::new(self.arm, effects).run(&self.drives[0], Precision::Coarse, seed);
        let sensor = self.sensor(effects, 0);
        let sensor = if id == "quantization" { sensor } else { sensor.uncounted() };
        (sensor.measure(&motion, &self.drives[0], noise), motion)
    }

    fn noise_of(&self, recording: usize) -> Vec<f64> {
        self.noise.draw(self.drives[recording].commands.len(), self.seed.child(RECORDINGS[recording]))
    }

    /// The recipes at strengths that give `sizes`; what comes nearest, or nothing, where that is not to be had.
    fn concealing(&self, plan: &Plan, sizes: &[f64]) -> Result<Dosage, Option<Dosage>> {
        let noise = self.noise_of(0);
        let hideable = self.hideable();
        let mut dosed: Vec<Dosed> = Vec::new();
        for (recipe, target) in self.recipes.iter().zip(sizes) {
            if plan.kind == Kind::NotExcited && recipe.id == "payload_change" {
                dosed.push((recipe.clone(), 0.5));
                continue;
            }
            let before = self.effects(&dosed);
            let (without, still) = self.rehearsed(&before, &noise, recipe.id);
            let size = |strength: f64| {
                let all = [before.clone(), vec![recipe.at(strength, &self.scales)]].concat();
                let (with, motion) = self.rehearsed(&all, &noise, recipe.id);
                let size = hideable.size(&with, &without, self.sigma());
                if motion.reach() > RUNAWAY * still.reach() { f64::INFINITY } else { size }
            };
            match strength(*target, recipe.range, size) {
                Some((strength, _)) => dosed.push((recipe.clone(), strength)),
                None => return Err(None),
            }
        }
        if plan.kind != Kind::NotExcited && (0..dosed.len()).any(|k| self.hides(&dosed, k, &hideable)) {
            return Err(None);
        }
        let sizes = self.sizes(&dosed, &noise, &hideable);
        let wanted = |size: &f64| plan.kind == Kind::NotExcited || (SIZES.0 * 0.9..SIZES.1 * 1.2).contains(size);
        let wanted = sizes.iter().all(wanted);
        let all = Dosage { dosed, sizes };
        if wanted { Ok(all) } else { Err(Some(all)) }
    }

    fn hideable(&self) -> Hideable {
        Hideable::of(self.arm, &self.drives[0], self.scales.reach, self.scales.speed)
    }

    /// Whether another arm does without effect number `k` most of what that does.
    fn hides(&self, dosed: &[Dosed], k: usize, hideable: &Hideable) -> bool {
        let all = self.effects(dosed);
        let others = [&all[..k], &all[k + 1..]].concat();
        let scales = [self.scales.reach, self.scales.speed];
        let seed = self.seed.child(RECORDINGS[0]);
        Refit { arm: self.arm, effects: &others, drive: &self.drives[0], seed, scales }.hides(&all, hideable)
    }

    /// The size of each effect beside the others.
    fn sizes(&self, dosed: &[Dosed], noise: &[f64], hideable: &Hideable) -> Vec<f64> {
        let size = |k: usize| {
            let rows = |dosed: &[Dosed], id: &str| self.rehearsed(&self.effects(dosed), noise, id).0;
            let (id, others) = (dosed[k].0.id, [&dosed[..k], &dosed[k + 1..]].concat());
            hideable.size(&rows(dosed, id), &rows(&others, id), self.sigma())
        };
        (0..dosed.len()).map(size).collect()
    }

    /// The effects in a recording: those of a case, but for a mass that is put on in the test alone.
    fn in_recording(&self, plan: &Plan, dosed: &[Dosed], recording: usize) -> Vec<Effect> {
        let mut effects = self.effects(dosed);
        if plan.kind == Kind::NotExcited && recording == 0 {
            effects.retain(|effect| !matches!(effect, Effect::Load { .. }));
        }
        effects
    }

    fn case(self, index: usize, plan: &Plan, concealed: &Dosage) -> Case {
        let precision = if plan.kind == Kind::Null(Null::Coarse) { self.coarse() } else { Precision::Fine };
        let record = |recording: usize| {
            let effects = self.in_recording(plan, &concealed.dosed, recording);
            let drive = &self.drives[recording];
            let seed = self.seed.child(RECORDINGS[recording]);
            let motion = Machine::new(self.arm, &effects).run(drive, precision, seed);
            let read = self.sensor(&effects, recording).measure(&motion, drive, &self.noise_of(recording));
            let time = (0..read.len()).map(|row| drive.time(row)).collect();
            let commands = drive.commands.clone();
            let table = Table::default().with("t", Column::Real(time)).with("u", Column::Real(commands));
            (table.with("q", Column::Real(read)), motion)
        };
        let ((train, motion), (test, _)) = (record(0), record(1));
        let label = self.label(index, plan, concealed, &motion, precision);
        Case { linear: self.arm.linear, nominal: self.nominal, uncertainty: self.uncertainty, train, test, label }
    }

    /// Steps that a simulator of rigid bodies would take, of which a row is a whole number.
    fn coarse(&self) -> Precision {
        Precision::Euler(self.drives[0].sample / (self.drives[0].sample / 0.002).ceil())
    }

    fn label(&self, index: usize, plan: &Plan, concealed: &Dosage, motion: &Motion, precision: Precision) -> Label {
        let Dosage { dosed, sizes } = concealed;
        let learnt = self.in_recording(plan, dosed, 0);
        let absent = learnt.len() < dosed.len();
        let sizes = if absent { vec![0.0; dosed.len()] } else { sizes.clone() };
        let machine = Machine::new(self.arm, &learnt);
        let sensor = self.sensor(&learnt, 0);
        let met = Met::of(&self.drives[0], motion);
        let effects = dosed.iter().zip(&sizes).map(|((recipe, strength), size)| {
            let effect = recipe.at(*strength, &self.scales);
            Concealed {
                id: recipe.id.to_owned(),
                size: *size,
                parameters: truth::parameters(recipe.id, &effect, &self.scales, &met),
                simpler: truth::simpler(&effect, &self.scales, &met),
                onset: truth::onset(&effect).filter(|_| !absent),
                active: if absent { Vec::new() } else { truth::active(&effect, &machine, &sensor, &self.drives[0], motion) },
            }
        });
        let outside = plan.kind == Kind::Outside;
        let mut tolerated = vec!["noise".to_owned()];
        if matches!(self.noise, Noise::Counted(_)) {
            tolerated.push("quantization".to_owned());
        }
        let mut told = self.noise.told();
        if let Precision::Euler(step) = precision {
            told += &format!("; motion by semi-implicit Euler at {:.2} ms", 1e3 * step);
        }
        Label {
            index,
            kind: plan.kind,
            outside: outside.then(|| (plan.ids[0].to_owned(), sizes.first().copied().unwrap_or(0.0))),
            effects: if outside { Vec::new() } else { effects.collect() },
            tolerated,
            arm: self.arm,
            nominal: self.nominal,
            noise: self.sigma(),
            noise_kind: told,
            snr: self.snr,
            excitation: [
                self.excitation[0].name().to_owned(),
                format!("{}{}", self.excitation[1].name(), if self.further { ", further" } else { "" }),
            ],
        }
    }
}

/// What the streams of the two recordings are called.
const RECORDINGS: [&str; 2] = ["train", "test"];

fn noise(plan: &Plan, rng: &mut impl Rng) -> Noise {
    let coloured = rng.random_range(0.5..0.95);
    let counted = rng.random_range(0.4..1.0);
    let kind = rng.random::<f64>();
    match plan.kind {
        Kind::Null(Null::Coloured) => Noise::Coloured(coloured),
        Kind::Null(Null::Quantized) => Noise::Counted(counted),
        Kind::Null(_) => Noise::White,
        _ if kind < 0.25 => Noise::Coloured(coloured),
        _ if kind < 0.4 && !plan.has("quantization") => Noise::Counted(counted),
        _ => Noise::White,
    }
}

/// What a twin takes an arm for: each number off by as much as it says it may be, the gain exact.
fn mis_set(arm: Arm, far: bool, rng: &mut impl Rng) -> ([f64; 4], [f64; 4]) {
    let (mut nominal, mut uncertainty) = (arm.values(), [0.0; 4]);
    for k in 0..3 {
        let said = if far { 0.2 } else { [0.1, 0.15, 0.2][rng.random_range(0..3)] };
        let off: f64 = StandardNormal.sample(rng);
        let off = if far {
            sign(rng) * rng.random_range(0.2..FURTHEST_OFF)
        } else {
            (said * off).clamp(-FURTHEST_OFF, FURTHEST_OFF)
        };
        // Twins are written with three digits.
        let digits = 10.0_f64.powi(2 - nominal[k].abs().max(1e-12).log10().floor() as i32);
        nominal[k] = (nominal[k] * (1.0 + off) * digits).round() / digits;
        uncertainty[k] = if nominal[k] == 0.0 { 0.0 } else { said };
    }
    (nominal, uncertainty)
}

/// What is concealed in a case, without drawing it.
#[cfg(test)]
pub(super) fn names(seed: Seed, index: usize) -> Vec<&'static str> {
    Plan::of(seed, index).ids
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The size in a label is what was asked for, and what a search by coarse steps found is there in fine ones.
    #[test]
    fn the_projected_size_hits_its_target() {
        for (id, target) in [("stiffness", 3.0), ("coulomb_friction", 5.0), ("compliance", 2.0), ("command_delay", 8.0)] {
            let plan = Plan { kind: Kind::Single, ids: vec![id] };
            let mut hits = 0;
            for attempt in 0..3 {
                let set = Set::draw(&plan, Seed(attempt));
                let Ok(Dosage { dosed, sizes }) = set.concealing(&plan, &[target]) else { continue };
                let (noise, hideable) = (set.noise_of(0), set.hideable());
                let size = sizes[0];
                assert!((size / target - 1.0).abs() < 0.06, "{id}: {size}");
                let fine = |effects: &[Effect]| {
                    let seed = set.seed.child(RECORDINGS[0]);
                    let motion = Machine::new(set.arm, effects).run(&set.drives[0], Precision::Fine, seed);
                    set.sensor(effects, 0).measure(&motion, &set.drives[0], &noise)
                };
                let fine = hideable.size(&fine(&set.effects(&dosed)), &fine(&[]), set.sigma());
                assert!((fine / target - 1.0).abs() < 0.08, "{id}: {fine} in fine steps");
                hits += 1;
            }
            assert!(hits > 0, "{id} was never to be had");
        }
    }

    /// What is concealed beside a sensor that counts in coarse steps is as large as it is without one, and not as what it moves by a step.
    #[test]
    fn steps_make_nothing_out_larger_than_it_is() {
        for ids in [["quantization", "quadratic_drag"], ["quadratic_drag", "quantization"]] {
            let plan = Plan { kind: Kind::Pair, ids: ids.to_vec() };
            let targets = ids.map(|id| if id == "quantization" { 12.0 } else { 3.0 });
            let found = (0..6).find_map(|attempt| {
                let set = Set::draw(&plan, Seed(attempt));
                set.concealing(&plan, &targets).ok().map(|dosage| (set, dosage))
            });
            let (set, Dosage { dosed, sizes }) = found.unwrap();
            let drag = ids.iter().position(|id| *id == "quadratic_drag").unwrap();
            assert!((sizes[drag] / 3.0 - 1.0).abs() < 0.06 && (sizes[1 - drag] / 12.0 - 1.0).abs() < 0.1, "{sizes:?}");
            let (noise, hideable) = (set.noise_of(0), set.hideable());
            let size = |dosed: &[Dosed], without: &[Dosed], id: &str| {
                let rows = |dosed: &[Dosed]| set.rehearsed(&set.effects(dosed), &noise, id).0;
                hideable.size(&rows(dosed), &rows(without), set.sigma())
            };
            assert!((size(&dosed[drag..=drag], &[], "quadratic_drag") / 3.0 - 1.0).abs() < 0.06);
            let others = &dosed[1 - drag..2 - drag];
            assert!(size(&dosed, others, "quantization") > 1.5 * sizes[drag], "steps would tell the size of a step");
        }
    }
}
