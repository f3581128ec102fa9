//! What varies in the price of a fill for no reason.

use rand::Rng;
use rand_distr::{Distribution, StandardNormal, StudentT};

/// How one fill's noise is distributed, and what it has to do with the next one's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Noise {
    /// Normal and independent.
    White,
    /// Student's t with three degrees of freedom.
    HeavyTailed,
    /// Normal, each keeping this part of the one before.
    Coloured(f64),
}

/// Degrees of freedom, and the furthest a draw may lie [standard deviations]: the fourth moment is infinite.
const FREEDOM: f64 = 3.0;
const FURTHEST: f64 = 25.0;

impl Noise {
    /// Noise of `count` fills, with a standard deviation of 1.
    pub fn draw(self, count: usize, rng: &mut impl Rng) -> Vec<f64> {
        let mut last: f64 = StandardNormal.sample(rng);
        let tails = StudentT::new(FREEDOM).ok();
        let mut one = |_| {
            let normal: f64 = StandardNormal.sample(rng);
            match (self, &tails) {
                (Self::HeavyTailed, Some(tails)) => {
                    (tails.sample(rng) / (FREEDOM / (FREEDOM - 2.0)).sqrt()).clamp(-FURTHEST, FURTHEST)
                }
                (Self::Coloured(kept), _) => {
                    last = kept * last + (1.0 - kept * kept).sqrt() * normal;
                    last
                }
                _ => normal,
            }
        };
        (0..count).map(&mut one).collect()
    }

    /// In words.
    pub fn told(self) -> String {
        match self {
            Self::White => "white".to_owned(),
            Self::HeavyTailed => "heavy-tailed (Student's t, 3)".to_owned(),
            Self::Coloured(kept) => format!("autocorrelated ({kept:.2})"),
        }
    }
}
