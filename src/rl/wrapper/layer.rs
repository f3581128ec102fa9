//! A layer around an environment: what the wrappers have in common.

use crate::rl::{About, Actions, EnvError, Episodes, Options, Out, VecEnv, Which, alike};

/// What changes actions on their way in, and observations, rewards and ends on their way out.
///
/// # Contract
/// - What it does in a lane depends on that lane's episode, actions and observations alone.
/// - It is called for all lanes, also for one whose episode is over, where it must do no harm.
/// - Nothing is allocated in `shape` and `sense` (but by the recorder, which keeps all it sees).
pub trait Layer: Clone + Send + 'static {
    /// What it is called in errors.
    const NAME: &'static str;

    /// Whether it changes actions: if not, they are handed on as they are, and [`shape`](Self::shape) is not called.
    const SHAPES: bool = false;

    /// Makes it ready for so many lanes of the environment `about`, and changes that to what it is with this layer around it: info
    /// channels and options are added at the end, and are the layer's from then on.
    ///
    /// # Errors
    /// [`EnvError::Wrapper`] if it does not go with that environment.
    fn prepare(&mut self, about: &mut About, lanes: usize) -> Result<(), EnvError>;

    /// Takes the options that are its own, before an episode begins.
    ///
    /// # Errors
    /// [`EnvError::Option`].
    fn set(&mut self, _options: &Options) -> Result<(), EnvError> {
        Ok(())
    }

    /// The lanes of `which` have begun the episodes `episodes` with these observations, shape (lanes, size).
    fn begin(&mut self, which: Which<'_>, episodes: &Episodes, observations: &mut [f32]);

    /// Changes actions, shape (lanes, size of an action).
    fn shape(&mut self, _actions: &mut ActionsMut<'_>) {}

    /// Changes what came of a step by `given`, the actions before this layer changed them.
    fn sense(&mut self, _given: Actions<'_>, _out: &mut Out<'_>) {}

    /// The value of its own info channel number `channel`, one a lane.
    fn info(&self, _channel: usize, _values: &mut [f64]) {}

    /// Whether a lane of `other` has a place here: not where the two are set so that they keep more or less in memory.
    fn holds(&self, _other: &Self) -> bool {
        true
    }

    /// Makes lane `to` a copy of lane `from`: of `other`, which it [`holds`](Self::holds), or else of its own lanes.
    fn copy_lane(&mut self, other: Option<&Self>, from: usize, to: usize);
}

/// Actions that may be changed, shape (lanes, size of an action).
#[derive(Debug)]
pub enum ActionsMut<'a> {
    /// Real numbers.
    Continuous(&'a mut [f32]),
    /// Choices.
    Discrete(&'a mut [i64]),
}

impl ActionsMut<'_> {
    /// The real numbers; empty where the actions are choices.
    pub fn continuous(&mut self) -> &mut [f32] {
        match self {
            Self::Continuous(values) => values,
            Self::Discrete(_) => &mut [],
        }
    }
}

/// Memory for actions that a layer has changed.
#[derive(Debug, Clone, Default)]
pub(super) struct ActionBuffer {
    continuous: Vec<f32>,
    discrete: Vec<i64>,
}

impl ActionBuffer {
    /// A copy of `actions`.
    pub fn take(&mut self, actions: Actions<'_>) -> ActionsMut<'_> {
        match actions {
            Actions::Continuous(values) => {
                self.continuous.resize(values.len(), 0.0);
                self.continuous.copy_from_slice(values);
                ActionsMut::Continuous(&mut self.continuous)
            }
            Actions::Discrete(values) => {
                self.discrete.resize(values.len(), 0);
                self.discrete.copy_from_slice(values);
                ActionsMut::Discrete(&mut self.discrete)
            }
        }
    }

    /// What was last taken, of the kind of `like`.
    pub fn get(&self, like: Actions<'_>) -> Actions<'_> {
        match like {
            Actions::Continuous(_) => Actions::Continuous(&self.continuous),
            Actions::Discrete(_) => Actions::Discrete(&self.discrete),
        }
    }
}

/// An environment with a layer around it.
#[derive(Debug, Clone)]
pub struct Wrapped<E, L> {
    env: E,
    layer: L,
    about: About,
    episodes: Episodes,
    actions: ActionBuffer,
    /// Number of info channels and options of the environment within.
    within: [usize; 2],
}

impl<E: VecEnv, L: Layer> Wrapped<E, L> {
    /// `env` with `layer` around it.
    ///
    /// # Errors
    /// [`EnvError::Wrapper`] if the two do not go together.
    pub fn new(env: E, mut layer: L) -> Result<Self, EnvError> {
        let mut about = env.about().clone();
        let within = [about.info.len(), about.options.len()];
        layer.prepare(&mut about, env.lanes())?;
        let episodes = Episodes::new(env.lanes());
        Ok(Self { env, layer, about, episodes, actions: ActionBuffer::default(), within })
    }

    /// The environment within.
    #[must_use]
    pub fn env(&self) -> &E {
        &self.env
    }

    /// The environment within, for what it can be set to.
    pub fn env_mut(&mut self) -> &mut E {
        &mut self.env
    }

    /// The layer.
    #[must_use]
    pub fn layer(&self) -> &L {
        &self.layer
    }

    /// The layer, for what it can be set to.
    pub fn layer_mut(&mut self) -> &mut L {
        &mut self.layer
    }

    /// Sets the layer's own options, and gives those that are left for the environment within.
    fn divided(&mut self, options: &Options) -> Result<Options, EnvError> {
        let (mut own, mut others) = (Options::new(), options.clone());
        for option in &self.about.options[self.within[1]..] {
            if let Some(value) = others.take(&option.name) {
                option.check(&value)?;
                own.set(&option.name, value);
            }
        }
        self.layer.set(&own)?;
        Ok(others)
    }
}

impl<E: VecEnv + Clone, L: Layer> VecEnv for Wrapped<E, L> {
    fn about(&self) -> &About {
        &self.about
    }

    fn lanes(&self) -> usize {
        self.env.lanes()
    }

    fn reset(
        &mut self,
        which: Which<'_>,
        seeds: Option<&[u64]>,
        options: &Options,
        observations: &mut [f32],
    ) -> Result<(), EnvError> {
        if options.is_empty() || self.about.options.len() == self.within[1] {
            self.env.reset(which, seeds, options, observations)?;
        } else {
            let before = self.layer.clone();
            let within = self.divided(options)?;
            if let Err(error) = self.env.reset(which, seeds, &within, observations) {
                self.layer = before;
                return Err(error);
            }
        }
        self.episodes.begin(which, seeds);
        self.layer.begin(which, &self.episodes, observations);
        Ok(())
    }

    fn step(&mut self, actions: Actions<'_>, out: &mut Out<'_>) -> Result<(), EnvError> {
        if L::SHAPES {
            self.layer.shape(&mut self.actions.take(actions));
            self.env.step(self.actions.get(actions), out)?;
        } else {
            self.env.step(actions, out)?;
        }
        self.layer.sense(actions, out);
        Ok(())
    }

    fn info(&self, channel: usize, values: &mut [f64]) {
        match channel.checked_sub(self.within[0]) {
            None => self.env.info(channel, values),
            Some(own) => self.layer.info(own, values),
        }
    }

    fn privileged(&self, parameter: usize, values: &mut [f64]) {
        self.env.privileged(parameter, values);
    }

    fn copy_lane(&mut self, from: usize, to: usize) {
        if from != to {
            self.env.copy_lane(from, to);
            self.episodes.copy_lane(from, to);
            self.layer.copy_lane(None, from, to);
        }
    }

    fn copy_lane_from(&mut self, other: &dyn VecEnv, from: usize, to: usize) -> Result<(), EnvError> {
        let other = alike(self, other)?;
        if !self.layer.holds(&other.layer) {
            return Err(EnvError::Unlike { id: self.about.id.clone(), why: format!("{} is set otherwise", L::NAME) });
        }
        self.env.copy_lane_from(&other.env, from, to)?;
        self.episodes.copy_lane_from(&other.episodes, from, to);
        self.layer.copy_lane(Some(&other.layer), from, to);
        Ok(())
    }
}

/// Puts layers around environments.
pub trait Wrap: VecEnv + Sized {
    /// This environment with `layer` around it.
    ///
    /// # Errors
    /// [`EnvError::Wrapper`] if the two do not go together.
    fn with<L: Layer>(self, layer: L) -> Result<Wrapped<Self, L>, EnvError> {
        Wrapped::new(self, layer)
    }
}

impl<E: VecEnv> Wrap for E {}

/// The error of a layer that does not go with the environment `about`.
pub(super) fn refused<L: Layer>(about: &About, why: impl Into<String>, remedy: impl Into<String>) -> EnvError {
    EnvError::Wrapper { wrapper: L::NAME, id: about.id.clone(), why: why.into(), remedy: remedy.into() }
}

/// Copies the row `from` of `other`, or else of `rows` itself, to the row `to` of `rows`, all of `size` values.
pub(super) fn copy_row<T: Copy>(rows: &mut [T], other: Option<&[T]>, size: usize, from: usize, to: usize) {
    match other {
        Some(other) => rows[to * size..][..size].copy_from_slice(&other[from * size..][..size]),
        None => rows.copy_within(from * size..(from + 1) * size, to * size),
    }
}

/// The action of each component that is nearest to doing nothing: 0 where it is within the bounds, else the bound nearest to it.
pub(super) fn neutral(low: &[f32], high: &[f32]) -> Vec<f32> {
    low.iter().zip(high).map(|(low, high)| 0.0_f32.max(*low).min(*high)).collect()
}
