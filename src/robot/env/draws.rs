//! What is randomized in the lanes of an environment, lane by lane, and what was drawn.

use crate::rl::{Episode, Episodes, InfoChannel};
use crate::sim2real::randomize::{DrawKey, DrawTable, Level, Occasion, Randomizer, Redraw, Turn, Within};
use crate::sim2real::{Parameter, Seed, SplitMix64};

/// What is randomized of an assembly.
#[derive(Debug, Clone)]
pub struct Randomization {
    /// What is drawn.
    pub randomizer: Randomizer,
    /// Which of the assembly's parameters each row of a table is.
    pub places: Vec<usize>,
    /// How much, at most: an environment's option can ask for less.
    pub level: Level,
    /// How long a regime lasts in the mean [s], where parameters are drawn with regimes.
    pub regime_seconds: f64,
}

/// Parameters that are drawn anew together within an episode.
#[derive(Debug, Clone)]
struct Group {
    own: Within,
    scratch: DrawTable,
    /// How often each lane has drawn them in its episode.
    drawn: Vec<u64>,
}

/// The parameters of the lanes, each lane's own, drawn by the rules of a [`Randomization`].
#[derive(Debug, Clone)]
pub(super) struct LaneParameters {
    nominal: Vec<f64>,
    /// How many parameters are drawn.
    rows: usize,
    /// Whether any is drawn but once in a lane's life.
    startup: bool,
    randomization: Option<Randomization>,
    scratch: Option<DrawTable>,
    /// Draws of several lanes that begin together.
    several: Option<Several>,
    groups: Vec<Group>,
    /// Values drawn, shape (lanes, rows): a lane that begins writes them next to each other.
    values: Vec<f64>,
    keys: Vec<Option<(u64, DrawKey)>>,
    levels: Vec<Level>,
    regimes: Regimes,
    /// All parameters of the lane that was last asked for.
    whole: Vec<f64>,
}

/// Lanes whose draws are made together, at most [`TOGETHER`].
#[derive(Debug, Clone)]
struct Several {
    table: DrawTable,
    keys: Vec<DrawKey>,
    numbers: Vec<u64>,
}

const TOGETHER: usize = 64;

/// Which regime each lane is in: from each to any other, or to none, at a constant rate.
#[derive(Debug, Clone, Default)]
struct Regimes {
    /// How many there are beside none.
    count: usize,
    seconds: f64,
    now: Vec<Option<usize>>,
    entered: Vec<u64>,
    draws: Vec<SplitMix64>,
}

/// The key of the draws of regimes: the name's hash.
const REGIME: u64 = 0x5247_494d_4553_0001;

impl LaneParameters {
    pub(super) fn new(parameters: &[Parameter], randomization: Option<Randomization>, lanes: usize) -> Self {
        let nominal: Vec<f64> = parameters.iter().map(|p| p.nominal).collect();
        let scratch = randomization.as_ref().map(|r| r.randomizer.nominal(1));
        let made = |r: &Randomization| Several {
            table: r.randomizer.nominal(TOGETHER.min(lanes)),
            keys: Vec::with_capacity(TOGETHER),
            numbers: Vec::with_capacity(TOGETHER),
        };
        let several = randomization.as_ref().map(made);
        let group = |own: Within| Group { scratch: own.randomizer.nominal(1), own, drawn: vec![0; lanes] };
        let groups: Vec<Group> = randomization.iter().flat_map(|r| r.randomizer.within()).map(group).collect();
        let rows = randomization.as_ref().map_or(0, |r| r.places.len());
        let mut randomized = randomization.iter().flat_map(|r| r.randomizer.randomized());
        let startup = randomized.any(|one| one.at == Redraw::Startup);
        let regime = |group: &Group| if let Redraw::Regime(k) = group.own.at { k + 1 } else { 0 };
        let count = groups.iter().map(regime).max().unwrap_or(0);
        let kept = if count > 0 { lanes } else { 0 };
        let regimes = Regimes {
            count,
            seconds: randomization.as_ref().map_or(1.0, |r| r.regime_seconds),
            now: vec![None; kept],
            entered: vec![0; kept],
            draws: vec![SplitMix64::new(Seed(0), REGIME); kept],
        };
        Self {
            whole: nominal.clone(),
            nominal,
            rows,
            startup,
            randomization,
            scratch,
            several,
            groups,
            values: vec![0.0; rows * lanes],
            keys: vec![None; lanes],
            levels: vec![Level::FULL; lanes],
            regimes,
        }
    }

    /// Names and units of what is drawn.
    pub(super) fn channels(&self, unit: impl Fn(&str) -> String) -> Vec<InfoChannel> {
        let randomized = self.randomization.iter().flat_map(|r| r.randomizer.randomized());
        randomized.map(|one| InfoChannel::new(one.target.to_string(), unit(&one.parameter.unit))).collect()
    }

    /// Whether anything is drawn at all.
    pub(super) fn any(&self) -> bool {
        self.randomization.is_some()
    }

    /// Whether anything is drawn within episodes.
    pub(super) fn within(&self) -> bool {
        !self.groups.is_empty()
    }

    /// How many regimes there are.
    pub(super) fn regimes(&self) -> usize {
        self.regimes.count
    }

    /// The regime of lane `lane`: -1 where it is in none.
    pub(super) fn regime(&self, lane: usize) -> f64 {
        self.regimes.now.get(lane).copied().flatten().map_or(-1.0, |k| k as f64)
    }

    /// Writes what was drawn of row `row`, one a lane.
    pub(super) fn tell(&self, row: usize, values: &mut [f64]) {
        let lanes = self.values.chunks_exact(self.rows.max(1));
        values.iter_mut().zip(lanes).for_each(|(value, lane)| *value = lane[row]);
    }

    /// Draws for lane `lane`, which begins `episode`, and gives all its parameters. `level` is a part of the declared one.
    pub(super) fn begin(&mut self, lane: usize, episode: Episode, level: f64) -> &[f64] {
        let (Some(own), Some(scratch)) = (&self.randomization, &mut self.scratch) else { return &self.nominal };
        let key = key_of(&mut self.keys[lane], episode.seed);
        let level = Level::new(own.level.get() * level).unwrap_or(own.level);
        self.levels[lane] = level;
        let turn = Turn { environment: 0, episode: episode.number };
        if self.startup {
            own.randomizer.redraw_by(scratch, 0, key, Occasion::Startup, Turn { episode: 0, ..turn }, level);
        }
        own.randomizer.redraw_by(scratch, 0, key, Occasion::Reset, turn, level);
        for (row, value) in scratch.environment(0).enumerate() {
            self.values[lane * self.rows + row] = value;
        }
        self.groups.iter_mut().for_each(|group| group.drawn[lane] = 0);
        if self.regimes.count > 0 {
            self.regimes.now[lane] = None;
            self.regimes.entered[lane] = 0;
            self.regimes.draws[lane] = SplitMix64::new(episode.seed(), REGIME);
        }
        self.whole(lane)
    }

    /// Draws for `lanes`, which begin these episodes, as many, as [`begin`](Self::begin) does for one; for what draws nothing within
    /// episodes.
    pub(super) fn begin_all(&mut self, lanes: &[u32], episodes: &[Episode], level: f64) {
        let (Some(own), Some(several)) = (&self.randomization, &mut self.several) else { return };
        let level = Level::new(own.level.get() * level).unwrap_or(own.level);
        for (lanes, episodes) in lanes.chunks(TOGETHER).zip(episodes.chunks(TOGETHER)) {
            let Several { table, keys, numbers } = &mut *several;
            keys.clear();
            for (lane, episode) in lanes.iter().zip(episodes) {
                keys.push(key_of(&mut self.keys[*lane as usize], episode.seed));
                self.levels[*lane as usize] = level;
            }
            if self.startup {
                numbers.clear();
                numbers.resize(keys.len(), 0);
                own.randomizer.redraw_each(table, keys, Occasion::Startup, numbers, level);
            }
            numbers.clear();
            numbers.extend(episodes.iter().map(|episode| episode.number));
            own.randomizer.redraw_each(table, keys, Occasion::Reset, numbers, level);
            for row in 0..self.rows {
                for (lane, value) in lanes.iter().zip(table.row(row)) {
                    self.values[*lane as usize * self.rows + row] = *value;
                }
            }
        }
    }

    /// All parameters of lane `lane` as they are.
    #[inline]
    pub(super) fn whole(&mut self, lane: usize) -> &[f64] {
        if let Some(own) = &self.randomization {
            for (row, place) in own.places.iter().enumerate() {
                self.whole[*place] = self.values[lane * self.rows + row];
            }
        }
        &self.whole
    }

    /// Draws what is due in lane `lane` after `seconds` [s] and `steps` of its episode, the last of which took `step` [s]. Gives all
    /// its parameters if any has changed.
    pub(super) fn go_on(&mut self, lane: usize, episode: Episode, seconds: f64, steps: u64, step: f64) -> Option<&[f64]> {
        let (_, key) = self.keys[lane]?;
        let switched = self.regimes.go_on(lane, step);
        let mut changed = false;
        for group in &mut self.groups {
            let occasion = match group.own.at {
                Redraw::Regime(_) if switched => {
                    let now = self.regimes.now[lane].unwrap_or(usize::MAX);
                    Some(Occasion::Regime(now, self.regimes.entered[lane]))
                }
                Redraw::Regime(_) => None,
                at => {
                    let due = at.due(seconds, steps);
                    let new = due > group.drawn[lane];
                    group.drawn[lane] = due.max(group.drawn[lane]);
                    new.then_some(Occasion::Interval(due))
                }
            };
            let Some(occasion) = occasion else { continue };
            let turn = Turn { environment: 0, episode: episode.number };
            group.own.randomizer.redraw_by(&mut group.scratch, 0, key, occasion, turn, self.levels[lane]);
            for (row, value) in group.own.rows.iter().zip(group.scratch.environment(0)) {
                self.values[lane * self.rows + row] = value;
            }
            changed = true;
        }
        changed.then(|| self.whole(lane))
    }

    /// Makes lane `to` a copy of lane `from` of `other`, or of its own where there is none.
    pub(super) fn copy(&mut self, other: Option<&Self>, from: usize, to: usize) {
        let rows = self.rows;
        match other {
            Some(other) => self.values[to * rows..][..rows].copy_from_slice(&other.values[from * rows..][..rows]),
            None => self.values.copy_within(from * rows..(from + 1) * rows, to * rows),
        }
        self.keys[to] = other.map_or_else(|| self.keys[from], |other| other.keys[from]);
        self.levels[to] = other.map_or_else(|| self.levels[from], |other| other.levels[from]);
        for (k, group) in self.groups.iter_mut().enumerate() {
            group.drawn[to] = other.map_or_else(|| group.drawn[from], |other| other.groups[k].drawn[from]);
        }
        if self.regimes.count > 0 {
            let source = other.map_or(&self.regimes, |other| &other.regimes);
            let (now, entered, draws) = (source.now[from], source.entered[from], source.draws[from]);
            (self.regimes.now[to], self.regimes.entered[to], self.regimes.draws[to]) = (now, entered, draws);
        }
    }

    /// What is drawn, in the order of rows: lanes can be copied where it is the same.
    pub(super) fn same_as(&self, other: &Self) -> bool {
        let of = |this: &Self| this.randomization.as_ref().map(|r| r.randomizer.clone());
        self.nominal == other.nominal && of(self) == of(other)
    }
}

/// The key of the draws of `seed`, kept from the last time it was asked for.
#[inline]
fn key_of(kept: &mut Option<(u64, DrawKey)>, seed: u64) -> DrawKey {
    match *kept {
        Some((last, key)) if last == seed => key,
        _ => {
            let key = DrawKey::new(Seed(seed));
            *kept = Some((seed, key));
            key
        }
    }
}

impl Regimes {
    /// Whether lane `lane` is in another regime after `step` [s].
    fn go_on(&mut self, lane: usize, step: f64) -> bool {
        if self.count == 0 || self.draws[lane].unit() >= -(-step / self.seconds).exp_m1() {
            return false;
        }
        // One of the others, none among them.
        let now = self.now[lane].map_or(0, |k| k + 1);
        let other = (self.draws[lane].unit() * self.count as f64) as usize;
        let next = if other >= now { other + 1 } else { other };
        self.now[lane] = next.checked_sub(1);
        self.entered[lane] += 1;
        true
    }
}

/// What an environment's copy of lanes needs of episodes.
pub(super) fn copy_episode(own: &mut Episodes, other: Option<&Episodes>, from: usize, to: usize) {
    match other {
        Some(other) => own.copy_lane_from(other, from, to),
        None => own.copy_lane(from, to),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim2real::randomize::{Distribution, Randomized, Target};

    fn uniform(name: &'static str, at: Redraw) -> Randomized {
        let parameter = Parameter::new(name, "", 5.0);
        let distribution = Distribution::Uniform { low: 0.0, high: 1.0 };
        Randomized { target: Target::own(name), parameter, distribution, relative: false, at }
    }

    fn lanes(count: usize) -> LaneParameters {
        let parameters = ["a", "b", "c", "d", "e"].map(|name| Parameter::new(name, "", 5.0));
        let randomized = vec![
            uniform("b", Redraw::Startup),
            uniform("c", Redraw::Reset),
            uniform("d", Redraw::EverySteps(10)),
            uniform("e", Redraw::Regime(1)),
        ];
        let randomization = Randomization {
            randomizer: Randomizer::new(randomized, Vec::new()).unwrap(),
            places: vec![1, 2, 3, 4],
            level: Level::FULL,
            regime_seconds: 0.1,
        };
        LaneParameters::new(&parameters, Some(randomization), count)
    }

    #[test]
    fn each_parameter_is_drawn_when_it_is_due_and_the_rest_is_nominal() {
        let mut parameters = lanes(2);
        let first = parameters.begin(1, Episode { seed: 3, number: 0 }, 1.0).to_vec();
        assert_eq!((first[0], first[4]), (5.0, 5.0));
        assert!(first[1..4].iter().all(|v| (0.0..1.0).contains(v)));
        let second = parameters.begin(1, Episode { seed: 3, number: 1 }, 1.0).to_vec();
        assert_eq!(first[1], second[1]);
        assert!(first[2] != second[2] && first[3] != second[3]);
        assert_eq!(parameters.begin(0, Episode { seed: 3, number: 0 }, 1.0), first);
        assert_eq!(parameters.begin(0, Episode { seed: 3, number: 0 }, 0.0), [5.0; 5]);
    }

    #[test]
    fn lanes_that_begin_together_draw_what_each_draws_alone() {
        let parameters = ["a", "b", "c"].map(|name| Parameter::new(name, "", 5.0));
        let normal =
            Randomized { distribution: Distribution::Normal { mean: 1.0, std: 0.5 }, ..uniform("c", Redraw::Reset) };
        let randomizer = Randomizer::new(vec![uniform("b", Redraw::Startup), normal], Vec::new()).unwrap();
        let randomization = Randomization { randomizer, places: vec![1, 2], level: Level::FULL, regime_seconds: 1.0 };
        let new = |lanes| LaneParameters::new(&parameters, Some(randomization.clone()), lanes);
        let (mut together, mut alone) = (new(200), new(200));
        let due: Vec<u32> = (0..200).filter(|lane| lane % 7 != 3).collect();
        for number in [0, 1, 7] {
            for level in [1.0, 0.3] {
                let episode = |lane: &u32| Episode { seed: u64::from(*lane % 90) * 3, number: number + u64::from(*lane) };
                let episodes: Vec<Episode> = due.iter().map(episode).collect();
                together.begin_all(&due, &episodes, level);
                for (lane, episode) in due.iter().zip(&episodes) {
                    let lane = *lane as usize;
                    assert_eq!(together.whole(lane), alone.begin(lane, *episode, level), "lane {lane}");
                }
            }
        }
        assert_eq!(together.whole(3)[1..], [0.0; 2]);
    }

    #[test]
    fn intervals_and_regimes_change_within_an_episode_what_is_theirs() {
        let mut parameters = lanes(1);
        let episode = Episode { seed: 3, number: 0 };
        let mut now = parameters.begin(0, episode, 1.0).to_vec();
        let (mut by_interval, mut by_regime, mut nominal) = (0, 0, 0);
        for step in 1..=1_000_u64 {
            let before = parameters.regime(0);
            let Some(next) = parameters.go_on(0, episode, step as f64 * 0.01, step, 0.01) else { continue };
            let next = next.to_vec();
            assert_eq!(now[..3], next[..3]);
            by_interval += u32::from(now[3] != next[3]);
            assert_eq!(now[3] != next[3], step % 10 == 0);
            let regime = parameters.regime(0);
            // Only the second regime draws the last parameter.
            assert_eq!(next[4] == 5.0, regime != 1.0);
            by_regime += u32::from(before != regime);
            nominal += u32::from(before != regime && regime != 1.0);
            now = next;
        }
        assert_eq!(by_interval, 100);
        // A mean of 100 switches; a part of them goes to no regime or to the first.
        assert!((60..150).contains(&by_regime) && nominal > 20, "{by_regime}, {nominal}");
    }

    #[test]
    fn a_copy_has_what_was_drawn() {
        let mut parameters = lanes(3);
        let drawn = parameters.begin(0, Episode { seed: 3, number: 2 }, 1.0).to_vec();
        parameters.copy(None, 0, 2);
        assert_eq!(parameters.whole(2), drawn);
        let mut other = lanes(1);
        other.copy(Some(&parameters), 2, 0);
        assert_eq!(other.whole(0), drawn);
        assert!(other.same_as(&parameters));
    }
}
