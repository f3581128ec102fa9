//! The front door of an environment: whatever it is given, it answers with a step or an error, and never with a panic.

use super::{
    About, Actions, Autoreset, AutoresetMode, EnvError, Finals, Kept, Occasion, Options, Out, Space, VecEnv, Which,
};

/// Drives an environment and checks all it is given: before anything moves, so that after an error all is as it was.
///
/// Only [`EnvError::Failed`], an environment's own failure, may leave lanes moved where there is more than one: then all have to
/// be reset.
#[derive(Debug, Clone)]
pub struct Checked<E> {
    driver: Autoreset<E>,
    lanes: Vec<Known>,
    /// Whether all lanes have begun an episode: what a step asks first.
    all_begun: bool,
    closed: bool,
    sizes: [usize; 2],
}

/// What is known of a lane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Known {
    seeded: bool,
    begun: bool,
}

impl<E: VecEnv> Checked<E> {
    /// Drives `env`, whose lanes are reset in this way.
    ///
    /// # Errors
    /// [`EnvError::NoLanes`].
    pub fn new(env: E, mode: AutoresetMode) -> Result<Self, EnvError> {
        let lanes = env.lanes();
        if lanes == 0 {
            return Err(EnvError::NoLanes);
        }
        let sizes = [env.about().action.size(), env.about().observation.size()];
        let driver = Autoreset::new(env, mode);
        Ok(Self { driver, lanes: vec![Known::default(); lanes], all_begun: false, closed: false, sizes })
    }

    /// What the environment is.
    #[must_use]
    pub fn about(&self) -> &About {
        self.driver.env().about()
    }

    /// Number of lanes.
    #[must_use]
    pub fn lanes(&self) -> usize {
        self.lanes.len()
    }

    /// The environment.
    #[must_use]
    pub fn env(&self) -> &E {
        self.driver.env()
    }

    /// The environment, for what its wrappers can be set to; lanes are reset and stepped through this driver.
    pub fn env_mut(&mut self) -> &mut E {
        self.driver.env_mut()
    }

    /// When lanes are reset.
    #[must_use]
    pub fn mode(&self) -> AutoresetMode {
        self.driver.mode()
    }

    /// Whether the episode of each lane is over and it has not been reset since. (In [`AutoresetMode::SameStep`]: whether it ended in
    /// the step before.)
    #[must_use]
    pub fn over(&self) -> &[bool] {
        self.driver.over()
    }

    /// What was last of the episodes that ended in the step before, in [`AutoresetMode::SameStep`].
    #[must_use]
    pub fn finals(&self) -> Option<Finals<'_>> {
        self.driver.finals()
    }

    /// What of episodes that end is kept as [`finals`](Self::finals): everything from the beginning.
    pub fn keep(&mut self, kept: Kept) {
        self.driver.keep(kept);
    }

    /// Begins an episode in the lanes of `which`: with seeds, one a lane, its first, else its next.
    ///
    /// # Errors
    /// A closed environment; buffers, masks or seeds of a wrong length; a mask that selects none; a lane that has never been given a
    /// seed; an option there is not, or that has a value it cannot have.
    pub fn reset(
        &mut self,
        which: Which<'_>,
        seeds: Option<&[u64]>,
        options: &Options,
        observations: &mut [f32],
    ) -> Result<(), EnvError> {
        self.open()?;
        let lanes = self.lanes();
        length("observations", observations.len(), lanes, self.sizes[1])?;
        if let Which::Mask(mask) = which {
            length("the mask", mask.len(), lanes, 1)?;
        }
        if !which.any() {
            return Err(EnvError::NoLane { lanes });
        }
        match seeds {
            Some(seeds) => length("seeds", seeds.len(), lanes, 1)?,
            None => {
                if let Some(lane) = which.iter(lanes).find(|lane| !self.lanes[*lane].seeded) {
                    return Err(EnvError::Unseeded { lane });
                }
            }
        }
        options.check(&self.about().id, &self.about().options, Occasion::Reset)?;
        let done = self.driver.reset(which, seeds, options, observations);
        self.note(done)?;
        for lane in which.iter(lanes) {
            self.lanes[lane] = Known { seeded: true, begun: true };
        }
        self.all_begun = self.lanes.iter().all(|lane| lane.begun);
        Ok(())
    }

    /// Takes a step in every lane. In lanes that are only reset in it their action is not used, but must be in the space.
    ///
    /// # Errors
    /// A closed environment; actions of the wrong kind or length; buffers of a wrong length; a lane that has not been reset, or whose
    /// episode is over while nothing resets it; an action that is no number or out of the space.
    pub fn step(&mut self, actions: Actions<'_>, out: &mut Out<'_>) -> Result<(), EnvError> {
        self.open()?;
        self.check_buffers(out)?;
        if !self.all_begun
            && let Some(lane) = self.lanes.iter().position(|lane| !lane.begun)
        {
            return Err(EnvError::NotReset { lane });
        }
        if self.driver.mode() == AutoresetMode::Disabled
            && let Some(lane) = self.driver.over().iter().position(|over| *over)
        {
            return Err(EnvError::Over { lane });
        }
        check_actions(self.driver.env().about(), self.lanes.len(), self.sizes[0], actions)?;
        let done = self.driver.step(actions, out);
        self.note(done)
    }

    /// The value of info channel number `channel`, one a lane.
    ///
    /// # Errors
    /// A closed environment; a buffer of the wrong length; no such channel.
    pub fn info(&self, channel: usize, values: &mut [f64]) -> Result<(), EnvError> {
        self.open()?;
        length("info", values.len(), self.lanes(), 1)?;
        let channels = self.about().info.len();
        if channel >= channels {
            return Err(EnvError::Channel { channel, channels });
        }
        self.env().info(channel, values);
        Ok(())
    }

    /// Makes lane `to` a copy of lane `from`, which goes on with the same bits.
    ///
    /// # Errors
    /// A closed environment; no such lane.
    pub fn copy_lane(&mut self, from: usize, to: usize) -> Result<(), EnvError> {
        self.open()?;
        self.lane(from)?;
        self.lane(to)?;
        self.driver.copy_lane(from, to);
        self.lanes[to] = self.lanes[from];
        self.all_begun = self.lanes.iter().all(|lane| lane.begun);
        Ok(())
    }

    /// Makes lane `to` a copy of lane `from` of `other`, such as a clone taken earlier.
    ///
    /// # Errors
    /// A closed environment; no such lane; an environment of another kind.
    pub fn copy_lane_from(&mut self, other: &Self, from: usize, to: usize) -> Result<(), EnvError> {
        self.open()?;
        other.open()?;
        other.lane(from)?;
        self.lane(to)?;
        self.driver.copy_lane_from(&other.driver, from, to)?;
        self.lanes[to] = other.lanes[from];
        self.all_begun = self.lanes.iter().all(|lane| lane.begun);
        Ok(())
    }

    /// Closes the environment: nothing can be done with it from here on. To close it twice is no error.
    pub fn close(&mut self) {
        self.closed = true;
    }

    /// Whether it is closed.
    #[must_use]
    pub fn closed(&self) -> bool {
        self.closed
    }

    fn open(&self) -> Result<(), EnvError> {
        if self.closed { Err(EnvError::Closed) } else { Ok(()) }
    }

    fn lane(&self, lane: usize) -> Result<(), EnvError> {
        if lane < self.lanes() { Ok(()) } else { Err(EnvError::Lane { lane, lanes: self.lanes() }) }
    }

    fn check_buffers(&self, out: &Out<'_>) -> Result<(), EnvError> {
        let lanes = self.lanes();
        length("observations", out.observations.len(), lanes, self.sizes[1])?;
        length("rewards", out.rewards.len(), lanes, 1)?;
        length("terminated", out.terminated.len(), lanes, 1)?;
        length("truncated", out.truncated.len(), lanes, 1)
    }

    /// Where the environment itself failed among several lanes, some have moved and some not.
    fn note(&mut self, done: Result<(), EnvError>) -> Result<(), EnvError> {
        if matches!(done, Err(EnvError::Failed { .. })) && self.lanes.len() > 1 {
            self.lanes.iter_mut().for_each(|lane| lane.begun = false);
            self.all_begun = false;
        }
        done
    }
}

fn length(what: &'static str, found: usize, lanes: usize, size: usize) -> Result<(), EnvError> {
    let expected = lanes * size;
    if found == expected { Ok(()) } else { Err(EnvError::Length { what, found, expected, lanes, size }) }
}

fn check_actions(about: &About, lanes: usize, size: usize, actions: Actions<'_>) -> Result<(), EnvError> {
    let kind = |expected, found| Err(EnvError::ActionKind { id: about.id.clone(), expected, found });
    match (&about.action, actions) {
        (Space::Box(space), Actions::Continuous(values)) => {
            length("actions", values.len(), lanes, size)?;
            match space.outside(values) {
                None => Ok(()),
                Some((lane, k)) => Err(EnvError::Action {
                    lane,
                    component: space.names[k].clone(),
                    value: values[lane * size + k].into(),
                    low: space.low[k].into(),
                    high: space.high[k].into(),
                }),
            }
        }
        (Space::Discrete { n, .. }, Actions::Discrete(values)) => {
            length("actions", values.len(), lanes, size)?;
            check_choices(about, values, std::slice::from_ref(n))
        }
        (Space::MultiDiscrete { n, .. }, Actions::Discrete(values)) => {
            length("actions", values.len(), lanes, size)?;
            check_choices(about, values, n)
        }
        (Space::Box(_), Actions::Discrete(_)) => kind("real numbers (f32)", "choices (i64)"),
        (_, Actions::Continuous(_)) => kind("choices (i64)", "real numbers (f32)"),
    }
}

fn check_choices(about: &About, values: &[i64], n: &[usize]) -> Result<(), EnvError> {
    let within = |value: i64, n: usize| usize::try_from(value).is_ok_and(|value| value < n);
    let bad = match n {
        [n] if all_below(values, *n) => None,
        [n] => values.iter().position(|value| !within(*value, *n)),
        _ => (0..values.len()).find(|k| !within(values[*k], n[k % n.len()])),
    };
    match bad {
        None => Ok(()),
        Some(at) => {
            let (lane, k) = (at / n.len(), at % n.len());
            let component = about.action.name(k).to_owned();
            Err(EnvError::Action { lane, component, value: values[at] as f64, low: 0.0, high: n[k] as f64 - 1.0 })
        }
    }
}

/// Whether all values are from 0 to below `n`: without a branch in the loop, which is run over all lanes at every step.
fn all_below(values: &[i64], n: usize) -> bool {
    let Ok(n) = i64::try_from(n) else { return false };
    // Of a value below 0 the sign is set, of one from `n` on that of the difference.
    values.iter().fold(0, |signs, value| signs | value | (n - 1).wrapping_sub(*value)) >= 0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rl::walk::{Push, Walk};
    use crate::rl::{Buffers, Each, InfoChannel};

    fn walk(mode: AutoresetMode) -> (Checked<Walk>, Buffers) {
        let mut env = Checked::new(Walk::new(3), mode).unwrap();
        let mut buffers = Buffers::of(env.env());
        env.reset(Which::All, Some(&[1, 2, 3]), &Options::new(), &mut buffers.observations).unwrap();
        (env, buffers)
    }

    /// What `bad` is refused with, and that the environment goes on as if it had not been asked.
    fn refused(bad: impl Fn(&mut Checked<Walk>, &mut Buffers) -> Result<(), EnvError>) -> String {
        let (mut env, mut buffers) = walk(AutoresetMode::NextStep);
        let (mut other, mut others) = (env.clone(), buffers.clone());
        let error = bad(&mut env, &mut buffers.clone()).unwrap_err().to_string();
        for k in 0..5 {
            let actions = [0.1 * k as f32, -0.5, 1.0];
            env.step(Actions::Continuous(&actions), &mut buffers.out()).unwrap();
            other.step(Actions::Continuous(&actions), &mut others.out()).unwrap();
            assert_eq!(buffers, others, "{error}");
        }
        let (body, hint) = error.split_once("\nhint: ").unwrap();
        assert!(!body.is_empty() && !hint.is_empty());
        error
    }

    #[test]
    fn bad_actions_are_refused_with_lane_component_value_and_range() {
        let step = |actions: &'static [f32]| {
            refused(move |env, buffers| env.step(Actions::Continuous(actions), &mut buffers.out()))
        };
        assert!(step(&[0.0, f32::NAN, 0.0]).starts_with("lane 1: action `push` is NaN, which is not within [-1, 1]\nhint:"));
        assert!(step(&[0.0, 0.0, 1.5]).starts_with("lane 2: action `push` is 1.5"));
        assert!(step(&[f32::INFINITY, 0.0, 0.0]).starts_with("lane 0: action `push` is inf"));
        assert!(step(&[0.0, 0.0]).starts_with("actions: 2 numbers, where 3 are asked for (3 lanes of 1)"));
        assert!(step(&[]).starts_with("actions: 0 numbers"));
        let error = refused(|env, buffers| env.step(Actions::Discrete(&[0, 1, 0]), &mut buffers.out()));
        assert!(error.starts_with("actions are choices (i64), and `test/Walk-v0` takes real numbers (f32)"), "{error}");
    }

    #[test]
    fn bad_choices_are_refused() {
        let mut env = Checked::new(Push::new(2), AutoresetMode::NextStep).unwrap();
        let mut buffers = Buffers::of(env.env());
        env.reset(Which::All, Some(&[1, 2]), &Options::new(), &mut buffers.observations).unwrap();
        for bad in [-1, 2, i64::MIN, i64::MAX] {
            let error = env.step(Actions::Discrete(&[1, bad]), &mut buffers.out()).unwrap_err().to_string();
            assert!(
                error.starts_with(&format!("lane 1: action `way` is {}, which is not within [0, 1]", bad as f64)),
                "{error}"
            );
        }
        let error = env.step(Actions::Continuous(&[1.0, 0.0]), &mut buffers.out()).unwrap_err().to_string();
        assert!(error.contains("takes choices (i64)"), "{error}");
        env.step(Actions::Discrete(&[1, 1]), &mut buffers.out()).unwrap();
        assert_eq!(buffers.observations, [1.0, 1.0]);
    }

    #[test]
    fn several_choices_are_checked_each_by_its_own_number() {
        let mut about = About::new(
            "test/Many-v0",
            "",
            crate::rl::BoxSpace::of(&[("x", "", 0.0, 1.0)]),
            Space::Discrete { n: 1, name: "a".into() },
        );
        about.action = Space::MultiDiscrete { n: vec![2, 5], names: vec!["side".into(), "size".into()] };
        about.info.push(InfoChannel::new("none", ""));
        assert!(check_actions(&about, 2, 2, Actions::Discrete(&[1, 4, 0, 0])).is_ok());
        let error = check_actions(&about, 2, 2, Actions::Discrete(&[1, 4, 2, 0])).unwrap_err().to_string();
        assert!(error.starts_with("lane 1: action `side` is 2, which is not within [0, 1]"), "{error}");
        let error = check_actions(&about, 2, 2, Actions::Discrete(&[1, 5, 1, 0])).unwrap_err().to_string();
        assert!(error.starts_with("lane 0: action `size` is 5, which is not within [0, 4]"), "{error}");
        assert!(check_actions(&about, 2, 2, Actions::Discrete(&[1, 4])).is_err());
    }

    #[test]
    fn bad_buffers_masks_seeds_and_options_are_refused() {
        for k in 0..4 {
            let error = refused(move |env, buffers| {
                match k {
                    0 => buffers.observations.truncate(5),
                    1 => buffers.rewards.push(0.0),
                    2 => buffers.terminated.clear(),
                    _ => buffers.truncated.truncate(2),
                }
                env.step(Actions::Continuous(&[0.0; 3]), &mut buffers.out())
            });
            let what = ["observations: 5", "rewards: 4", "terminated: 0", "truncated: 2"][k];
            assert!(error.starts_with(&format!("{what} numbers, where ")), "{error}");
        }
        let none = Options::new();
        let reset = |which: Which<'static>, seeds: Option<&'static [u64]>, options: Options| {
            refused(move |env, buffers| env.reset(which, seeds, &options, &mut buffers.observations))
        };
        assert!(reset(Which::Mask(&[true]), None, none.clone()).starts_with("the mask: 1 numbers, where 3"));
        assert!(reset(Which::Mask(&[false; 3]), None, none.clone()).starts_with("the mask selects none of the 3 lanes"));
        assert!(reset(Which::All, Some(&[1, 2]), none.clone()).starts_with("seeds: 2 numbers"));
        assert!(reset(Which::All, None, none.clone().with("stat", 1.0)).contains("did you mean `start`?"));
        assert!(reset(Which::All, None, none.clone().with("start", 2.0)).contains("option `start` is 2"));
        let error = refused(|env, _| env.reset(Which::All, None, &Options::new(), &mut [0.0]));
        assert!(error.starts_with("observations: 1 numbers, where 6"), "{error}");
        assert!(refused(|env, _| env.info(0, &mut [0.0])).starts_with("info: 1 numbers"));
        assert!(
            refused(|env, _| env.info(7, &mut [0.0; 3])).starts_with("there is no info channel 7: the environment has 1")
        );
        assert!(refused(|env, _| env.copy_lane(0, 3)).starts_with("there is no lane 3: the environment has 3"));
        assert!(refused(|env, _| env.copy_lane_from(&env.clone(), 9, 0)).starts_with("there is no lane 9"));
    }

    #[test]
    fn seeds_may_be_any_number_and_the_first_must_be_given() {
        let mut env = Checked::new(Walk::new(2), AutoresetMode::NextStep).unwrap();
        let mut buffers = Buffers::of(env.env());
        let error = env.reset(Which::All, None, &Options::new(), &mut buffers.observations).unwrap_err().to_string();
        assert!(error.starts_with("lane 0 has never been given a seed\nhint:"), "{error}");
        env.reset(Which::Mask(&[true, false]), Some(&[u64::MAX, 0]), &Options::new(), &mut buffers.observations).unwrap();
        let error = env.reset(Which::All, None, &Options::new(), &mut buffers.observations).unwrap_err();
        assert!(matches!(error, EnvError::Unseeded { lane: 1 }));
        env.reset(Which::All, Some(&[0, u64::MAX]), &Options::new(), &mut buffers.observations).unwrap();
        env.reset(Which::All, None, &Options::new(), &mut buffers.observations).unwrap();
    }

    #[test]
    fn steps_out_of_turn_are_refused() {
        let mut env = Checked::new(Push::new(2), AutoresetMode::Disabled).unwrap();
        let mut buffers = Buffers::of(env.env());
        let actions = Actions::Discrete(&[1, 0]);
        let error = env.step(actions, &mut buffers.out()).unwrap_err().to_string();
        assert!(error.starts_with("lane 0 has not been reset"), "{error}");
        env.reset(Which::Mask(&[true, false]), Some(&[1, 2]), &Options::new(), &mut buffers.observations).unwrap();
        assert!(matches!(env.step(actions, &mut buffers.out()), Err(EnvError::NotReset { lane: 1 })));
        env.reset(Which::All, Some(&[1, 2]), &Options::new(), &mut buffers.observations).unwrap();
        (0..3).for_each(|_| env.step(actions, &mut buffers.out()).unwrap());
        let error = env.step(actions, &mut buffers.out()).unwrap_err().to_string();
        assert!(error.starts_with("the episode of lane 0 is over"), "{error}");
        env.reset(Which::Mask(&[true, false]), None, &Options::new(), &mut buffers.observations).unwrap();
        assert!(matches!(env.step(actions, &mut buffers.out()), Err(EnvError::Over { lane: 1 })));
        env.copy_lane(0, 1).unwrap();
        env.step(actions, &mut buffers.out()).unwrap();
    }

    #[test]
    fn nothing_can_be_done_with_a_closed_environment() {
        let (mut env, mut buffers) = walk(AutoresetMode::NextStep);
        let open = env.clone();
        env.close();
        env.close();
        assert!(env.closed());
        let closed = |done: Result<(), EnvError>| matches!(done, Err(EnvError::Closed));
        assert!(closed(env.step(Actions::Continuous(&[0.0; 3]), &mut buffers.out())));
        assert!(closed(env.reset(Which::All, Some(&[1, 2, 3]), &Options::new(), &mut buffers.observations)));
        assert!(closed(env.info(0, &mut [0.0; 3])));
        assert!(closed(env.copy_lane(0, 1)) && closed(env.copy_lane_from(&open, 0, 1)));
        assert!(closed(open.clone().copy_lane_from(&env, 0, 1)));
        assert!(matches!(Checked::new(Walk::new(0), AutoresetMode::NextStep), Err(EnvError::NoLanes)));
        assert!(matches!(Each::new(Push::alone(), 0), Err(EnvError::NoLanes)));
    }

    #[test]
    fn after_an_environments_own_failure_one_lane_goes_on_and_several_are_reset() {
        let failing = |lanes| {
            let mut push = Push::new(lanes);
            push.lane_mut(lanes - 1).fails = Some(1);
            let mut env = Checked::new(push, AutoresetMode::NextStep).unwrap();
            let mut buffers = Buffers::of(env.env());
            let seeds: Vec<u64> = (0..lanes as u64).collect();
            env.reset(Which::All, Some(&seeds), &Options::new(), &mut buffers.observations).unwrap();
            (env, buffers)
        };
        let (mut env, mut buffers) = failing(1);
        env.step(Actions::Discrete(&[1]), &mut buffers.out()).unwrap();
        let error = env.step(Actions::Discrete(&[1]), &mut buffers.out()).unwrap_err().to_string();
        assert_eq!(error, "lane 0: the counter is stuck\nhint: oil it");
        env.env_mut().lane_mut(0).fails = None;
        env.step(Actions::Discrete(&[1]), &mut buffers.out()).unwrap();
        assert_eq!(buffers.observations, [2.0]);
        let (mut env, mut buffers) = failing(2);
        env.step(Actions::Discrete(&[1, 1]), &mut buffers.out()).unwrap();
        let error = env.step(Actions::Discrete(&[1, 1]), &mut buffers.out()).unwrap_err().to_string();
        assert!(error.starts_with("lane 1: the counter is stuck"), "{error}");
        assert!(matches!(env.step(Actions::Discrete(&[1, 1]), &mut buffers.out()), Err(EnvError::NotReset { lane: 0 })));
    }
}
