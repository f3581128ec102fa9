//! White balance: the colour of the light.

use super::colour::ColourMap;
use super::draw::Uniform;
use super::effect::{Effect, EffectParameter};
use super::error::ImageError;
use super::exposure::GAMMA;
use super::settings::Setting;
use crate::sim2real::elementary::exp2;

/// `r -> r 2^(red / 2.2)`, `b -> b 2^(blue / 2.2)`: red and blue light are multiplied by `2^red` and `2^blue`, green is
/// not. Grey images have no colour, and are left alone.
///
/// Source: von Kries' law of coefficients, "Chromatic adaptation" (1902), a gain for each kind of receptor; the encoding is
/// that of [`Exposure`](super::Exposure).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WhiteBalance {
    /// Doublings of red light [EV]; 0 does nothing.
    pub red: f32,
    /// Doublings of blue light [EV]; 0 does nothing.
    pub blue: f32,
}

const fn gain(name: &'static str) -> EffectParameter {
    EffectParameter { name, unit: "EV", identity: 0.0, plausible: [-0.3, 0.3], bounds: [-10.0, 10.0] }
}

pub(super) static EFFECT: Effect = Effect {
    name: "white_balance",
    title: "colour of the light",
    law: "r -> r 2^(red / 2.2), b -> b 2^(blue / 2.2)",
    source: "von Kries, \"Chromatic adaptation\" (1902)",
    parameters: &[gain("red"), gain("blue")],
};

impl Setting for WhiteBalance {
    const NONE: Self = Self { red: 0.0, blue: 0.0 };
    const EFFECT: &'static Effect = &EFFECT;

    fn drawn(uniform: &mut Uniform<'_>) -> Self {
        Self { red: uniform.number(0), blue: uniform.number(1) }
    }

    fn check(&self) -> Result<(), ImageError> {
        EFFECT.check(&[self.red, self.blue])
    }
}

impl WhiteBalance {
    pub(super) fn compose(self, map: &mut ColourMap) {
        let [red, blue] = [self.red, self.blue].map(|stops| exp2(f64::from(stops) / GAMMA));
        map.then_scale([red, 1.0, blue], 0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::super::Settings;
    use super::super::settings::tests::applied;
    use super::*;

    #[test]
    fn red_and_blue_have_their_own_gains() {
        // 2^(2.2 / 2.2) = 2 and 2^(-2.2 / 2.2) = 1/2.
        let warm = Settings { white_balance: WhiteBalance { red: 2.2, blue: -2.2 }, ..Settings::NONE };
        assert_eq!(applied(warm, &[50_u8, 60, 70, 80], [1, 1, 4]), [100, 60, 35, 80]);
        assert_eq!(applied(warm, &[50_u8, 60, 70], [1, 3, 1]), [50, 60, 70]);
    }
}
