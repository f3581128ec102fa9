//! What is wanted of each figure, in each domain.

use super::domain::Domain;
use super::figure::Goal;

/// Goals, by figure.
#[derive(Debug, Clone, Copy)]
pub(super) struct Goals {
    pub right_first: Goal,
    pub right_among_two: Goal,
    pub weak: Goal,
    pub pairs: Goal,
    pub false_white: Goal,
    pub false_misled: Goal,
    pub outside: Goal,
    pub parameters: Goal,
    pub intervals_hold: Goal,
    pub over_oracle: [Goal; 2],
    pub calibration: Goal,
    pub seconds: Goal,
}

/// What a joint's figures are to reach; those of a market where nothing else is said.
const ROBOT: Goals = Goals {
    right_first: Goal::new(0.85, 0.95),
    right_among_two: Goal::new(0.93, 0.99),
    weak: Goal::new(0.60, 0.80),
    pairs: Goal::new(0.65, 0.85),
    false_white: Goal::new(0.05, 0.01),
    false_misled: Goal::new(0.10, 0.03),
    outside: Goal::new(0.75, 0.95),
    parameters: Goal::new(0.10, 0.03),
    intervals_hold: Goal { least: 0.85, aim: 0.93, until: Some(0.97) },
    over_oracle: [Goal::new(1.10, 1.02), Goal::new(1.5, 1.10)],
    calibration: Goal::new(0.10, 0.03),
    seconds: Goal::new(30.0, 2.0),
};

impl Goals {
    pub fn of(domain: Domain) -> Self {
        match domain {
            Domain::Robot => ROBOT,
            Domain::Market => Self {
                false_white: Goal::new(0.05, 0.02),
                false_misled: Goal::new(0.10, 0.02),
                outside: Goal::new(0.75, 0.90),
                parameters: Goal::new(0.10, 0.05),
                ..ROBOT
            },
        }
    }
}

/// Impact that stays told from impact that fades, or said to be perhaps the other.
pub(super) const TOLD_APART: Goal = Goal::new(0.85, 0.95);
/// Confident wrong names where no more is known than mids.
pub(super) const CONFIDENT_WRONG: Goal = Goal::new(0.0, 0.0);
