//! Contrast.

use super::colour::ColourMap;
use super::draw::Uniform;
use super::effect::{Effect, EffectParameter};
use super::error::ImageError;
use super::settings::Setting;

/// `x -> 1/2 + gain (x - 1/2)`: about mid-grey, and not about the image's mean, which moves with what is in sight, so that
/// an unmoved wall would flicker as the robot passes it.
///
/// Source: Poynton, "Digital Video and HD" (2012), where contrast is a gain of encoded values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contrast {
    /// 1 does nothing, 0 leaves mid-grey.
    pub gain: f32,
}

pub(super) static EFFECT: Effect = Effect {
    name: "contrast",
    title: "contrast about mid-grey",
    law: "x -> 1/2 + gain (x - 1/2)",
    source: "Poynton, \"Digital Video and HD\" (2012)",
    parameters: &[EffectParameter { name: "gain", unit: "1", identity: 1.0, plausible: [0.8, 1.25], bounds: [0.0, 100.0] }],
};

impl Setting for Contrast {
    const NONE: Self = Self { gain: 1.0 };
    const EFFECT: &'static Effect = &EFFECT;

    fn drawn(uniform: &mut Uniform<'_>) -> Self {
        Self { gain: uniform.number(0) }
    }

    fn check(&self) -> Result<(), ImageError> {
        EFFECT.check(&[self.gain])
    }
}

impl Contrast {
    pub(super) fn compose(self, map: &mut ColourMap) {
        let gain = f64::from(self.gain);
        map.then_scale([gain; 3], 0.5 - 0.5 * gain);
    }
}

#[cfg(test)]
mod tests {
    use super::super::Settings;
    use super::super::settings::tests::applied;
    use super::*;

    #[test]
    fn values_part_from_mid_grey() {
        // 127.5 + 2 (x - 127.5) = 2 x - 127.5, halves to even: 72.5 -> 72, 128.5 -> 128; cut off at both ends.
        let strong = Settings { contrast: Contrast { gain: 2.0 }, ..Settings::NONE };
        assert_eq!(applied(strong, &[100_u8, 128, 50, 250], [1, 1, 4]), [72, 128, 0, 250]);
        assert_eq!(applied(strong, &[0.25_f32, 0.5, 0.9], [1, 3, 1]), [0.0, 0.5, 1.0]);
        // Half-way back from black is 63.75.
        let weak = Settings { contrast: Contrast { gain: 0.5 }, ..Settings::NONE };
        assert_eq!(applied(weak, &[0_u8, 255], [2, 1, 1]), [64, 191]);
    }
}
