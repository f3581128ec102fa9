//! How much is randomized: from nothing to all, and on what schedule.

use serde::{Deserialize, Serialize};

/// How much is randomized: 0 leaves every parameter at its nominal value, to the bit; 1 draws as is declared.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Serialize)]
pub struct Level(f64);

/// A level that is none.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("expected a level from 0 to 1, found {0}\nhint: 0 randomizes nothing, 1 as much as is declared")]
pub struct NotALevel(pub f64);

impl Level {
    /// Nothing is randomized.
    pub const NONE: Self = Self(0.0);
    /// All that is declared is.
    pub const FULL: Self = Self(1.0);

    /// A level.
    ///
    /// # Errors
    /// A number outside 0 to 1.
    pub fn new(level: f64) -> Result<Self, NotALevel> {
        if (0.0..=1.0).contains(&level) { Ok(Self(level)) } else { Err(NotALevel(level)) }
    }

    /// The number.
    #[must_use]
    pub fn get(self) -> f64 {
        self.0
    }
}

/// A schedule of levels over the progress of training, from 0 to 1 or in any other unit that grows.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Curriculum {
    /// The same level always.
    Constant(f64),
    /// On a straight line from one level to another, between two moments.
    Linear {
        /// Level before.
        from: f64,
        /// Level after.
        to: f64,
        /// Progress at which it begins to change.
        start: f64,
        /// Progress from which it is there.
        end: f64,
    },
    /// In steps.
    Steps {
        /// Level before the first step.
        from: f64,
        /// Progress from which, and level to which, in order.
        steps: Vec<(f64, f64)>,
    },
}

/// Why a curriculum is none.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CurriculumError {
    /// A level that is none.
    #[error(transparent)]
    Level(#[from] NotALevel),
    /// Moments in the wrong order.
    #[error("expected moments in order, found {before} and then {after}\nhint: each begins after the one before it")]
    Order {
        /// The earlier one.
        before: f64,
        /// The one after it.
        after: f64,
    },
}

impl Curriculum {
    /// Holds it to make sense.
    ///
    /// # Errors
    /// Levels outside 0 to 1, and moments that are not in order.
    pub fn check(&self) -> Result<(), CurriculumError> {
        let in_order = |before: f64, after: f64| match before < after && after.is_finite() {
            true => Ok(()),
            false => Err(CurriculumError::Order { before, after }),
        };
        match self {
            Self::Constant(level) => Level::new(*level).map(|_| ()).map_err(Into::into),
            Self::Linear { from, to, start, end } => {
                Level::new(*from)?;
                Level::new(*to)?;
                in_order(*start, *end)
            }
            Self::Steps { from, steps } => {
                Level::new(*from)?;
                steps.iter().try_for_each(|(_, level)| Level::new(*level).map(|_| ()))?;
                steps.windows(2).try_for_each(|pair| in_order(pair[0].0, pair[1].0))
            }
        }
    }

    /// The level at `progress`; that of progress that is no number is the first.
    #[must_use]
    pub fn level(&self, progress: f64) -> Level {
        let level = match self {
            Self::Constant(level) => *level,
            Self::Linear { from, to, start, end } => {
                let way = if progress > *start { ((progress - start) / (end - start)).min(1.0) } else { 0.0 };
                (1.0 - way) * from + way * to
            }
            Self::Steps { from, steps } => {
                steps.iter().take_while(|(at, _)| *at <= progress).last().map_or(*from, |(_, level)| *level)
            }
        };
        Level(level.clamp(0.0, 1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn schedules_reach_their_levels_when_they_say() {
        let linear = Curriculum::Linear { from: 0.2, to: 1.0, start: 0.1, end: 0.5 };
        let levels = [0.0, 0.1, 0.3, 0.5, 2.0, f64::NAN].map(|p| linear.level(p).get());
        assert!((levels[2] - 0.6).abs() < 1e-12);
        assert_eq!([levels[0], levels[1], levels[3], levels[4], levels[5]], [0.2, 0.2, 1.0, 1.0, 0.2]);
        let steps = Curriculum::Steps { from: 0.0, steps: vec![(0.25, 0.5), (0.75, 1.0)] };
        assert_eq!([0.0, 0.24, 0.25, 0.74, 0.75, 1.0].map(|p| steps.level(p).get()), [0.0, 0.0, 0.5, 0.5, 1.0, 1.0]);
        assert_eq!(Curriculum::Constant(0.3).level(7.0).get(), 0.3);
        for curriculum in [&linear, &steps] {
            curriculum.check().unwrap();
            let text = serde_json::to_string(curriculum).unwrap();
            assert_eq!(serde_json::from_str::<Curriculum>(&text).unwrap(), *curriculum);
        }
    }

    #[test]
    fn what_is_no_schedule_is_refused() {
        assert_eq!(Level::new(1.5), Err(NotALevel(1.5)));
        assert!(Level::new(f64::NAN).is_err() && Level::new(-0.1).is_err());
        for wrong in [
            Curriculum::Constant(2.0),
            Curriculum::Linear { from: 0.0, to: 1.0, start: 0.5, end: 0.5 },
            Curriculum::Linear { from: -1.0, to: 1.0, start: 0.0, end: 0.5 },
            Curriculum::Steps { from: 0.0, steps: vec![(0.5, 1.0), (0.2, 0.5)] },
            Curriculum::Steps { from: 0.0, steps: vec![(0.5, 1.2)] },
        ] {
            assert!(wrong.check().unwrap_err().to_string().contains("\nhint: "));
        }
    }
}
