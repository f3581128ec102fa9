//! Actions made smaller at the first stages of training.

use super::layer::{ActionsMut, Layer, neutral, refused};
use crate::rl::{About, EnvError, Episodes, Occasion, OptionAbout, OptionKind, Options, Space, Which};

/// Scales actions by the factor of the stage training is at, towards the action nearest to 0: a policy that knows nothing yet cannot do
/// much harm. The stage is that of all lanes, and is set from outside: by [`set_stage`](Self::set_stage), or by the option
/// `action_stage` at a reset. It is not reset with an episode.
#[derive(Debug, Clone)]
pub struct ActionScale {
    factors: Vec<f32>,
    stage: usize,
    neutral: Vec<f32>,
}

/// The option that sets the stage.
const STAGE: &str = "action_stage";

impl ActionScale {
    /// The factors of the stages, from 0 to 1 each, of which the first is in force.
    #[must_use]
    pub fn new(factors: &[f32]) -> Self {
        Self { factors: factors.to_vec(), stage: 0, neutral: Vec::new() }
    }

    /// The stage that is in force.
    #[must_use]
    pub fn stage(&self) -> usize {
        self.stage
    }

    /// Goes to a stage.
    ///
    /// # Errors
    /// [`EnvError::Option`] if there is none of this number.
    pub fn set_stage(&mut self, stage: usize) -> Result<(), EnvError> {
        self.option().check(&(stage as f64).into())?;
        self.stage = stage;
        Ok(())
    }

    fn option(&self) -> OptionAbout {
        let kind =
            OptionKind::Whole { nominal: self.stage as u64, lower: 0, upper: self.factors.len().saturating_sub(1) as u64 };
        OptionAbout::new(Occasion::Reset, STAGE, "", kind, "stage of training, which scales the actions of all lanes")
    }
}

impl Layer for ActionScale {
    const NAME: &'static str = "a scale of actions";
    const SHAPES: bool = true;

    fn prepare(&mut self, about: &mut About, _lanes: usize) -> Result<(), EnvError> {
        let Space::Box(space) = &about.action else {
            return Err(refused::<Self>(about, "its actions are choices", "leave it out: choices have no size"));
        };
        if self.factors.is_empty() {
            return Err(refused::<Self>(about, "there is no stage", "give the factor of at least one"));
        }
        if let Some(bad) = self.factors.iter().find(|factor| !(0.0..=1.0).contains(*factor)) {
            return Err(refused::<Self>(about, format!("a factor is {bad}"), "give factors from 0 to 1"));
        }
        self.neutral = neutral(&space.low, &space.high);
        about.options.push(self.option());
        Ok(())
    }

    fn set(&mut self, options: &Options) -> Result<(), EnvError> {
        if options.get(STAGE).is_some() {
            self.stage = options.number(&[self.option()], STAGE)? as usize;
        }
        Ok(())
    }

    fn begin(&mut self, _: Which<'_>, _: &Episodes, _: &mut [f32]) {}

    fn shape(&mut self, actions: &mut ActionsMut<'_>) {
        let factor = self.factors[self.stage];
        for row in actions.continuous().chunks_exact_mut(self.neutral.len().max(1)) {
            for (value, neutral) in row.iter_mut().zip(&self.neutral) {
                *value = factor * *value + (1.0 - factor) * neutral;
            }
        }
    }

    fn copy_lane(&mut self, _: Option<&Self>, _: usize, _: usize) {}
}

#[cfg(test)]
mod tests {
    use super::super::Wrap;
    use super::*;
    use crate::rl::walk::{Push, Walk, acted, acting};
    use crate::rl::{Actions, Buffers, VecEnv};

    #[test]
    fn the_stage_in_force_scales_all_actions() {
        let mut env = Walk::new(2).with(ActionScale::new(&[0.25, 1.0])).unwrap();
        assert_eq!(acting(env.clone(), &[[1.0, -1.0]]), [[0.25, -0.25]]);
        env.layer_mut().set_stage(1).unwrap();
        assert_eq!(acting(env.clone(), &[[1.0, -1.0]]), [[1.0, -1.0]]);
        assert!(env.layer_mut().set_stage(2).unwrap_err().to_string().contains("a whole number from 0 to 1"));
        // By an option, which the environment within never sees.
        let mut buffers = Buffers::of(&env);
        let options = Options::new().with("action_stage", 0.0).with("start", 0.5);
        env.reset(Which::All, Some(&[1, 2]), &options, &mut buffers.observations).unwrap();
        assert_eq!(buffers.observations[0], 0.5);
        env.step(Actions::Continuous(&[1.0, 0.4]), &mut buffers.out()).unwrap();
        assert_eq!(acted(&env), [0.25, 0.1]);
    }

    #[test]
    fn an_option_that_is_refused_within_sets_no_stage() {
        let mut env = Walk::new(1).with(ActionScale::new(&[0.25, 1.0])).unwrap();
        let mut buffers = Buffers::of(&env);
        let options = Options::new().with("action_stage", 1.0).with("start", 99.0);
        assert!(env.reset(Which::All, Some(&[1]), &options, &mut buffers.observations).is_err());
        assert_eq!(env.layer().stage(), 0);
        let options = Options::new().with("action_stage", 7.0);
        assert!(env.reset(Which::All, Some(&[1]), &options, &mut buffers.observations).is_err());
    }

    #[test]
    fn what_is_no_schedule_is_refused() {
        let refused = |factors: &[f32]| Walk::new(1).with(ActionScale::new(factors)).unwrap_err().to_string();
        assert!(refused(&[]).contains("no stage"));
        assert!(refused(&[1.5]).contains("a factor is 1.5"));
        assert!(refused(&[f32::NAN]).contains("a factor is NaN"));
        assert!(Push::new(1).with(ActionScale::new(&[1.0])).is_err());
    }
}
