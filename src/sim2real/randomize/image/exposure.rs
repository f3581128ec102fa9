//! Exposure: more or less light.

use super::colour::ColourMap;
use super::draw::Uniform;
use super::effect::{Effect, EffectParameter};
use super::error::ImageError;
use super::settings::Setting;
use crate::sim2real::elementary::exp2;

/// The exponent by which a camera encodes light: `x = light^(1 / 2.2)`. The curve of IEC 61966-2-1 (sRGB), without its straight
/// piece in the dark.
pub(super) const GAMMA: f64 = 2.2;

/// `x -> x 2^(stops / 2.2)`: light is multiplied by `2^stops`.
///
/// It is correct for images that are encoded by the exponent 2.2, of which a gain of the light is a gain, too: no pixel is
/// decoded. What gets brighter than white is cut off.
///
/// Source: exposure values as of ISO 2721 (2013), a stop a doubling of the light; the exponent is that of ITU-R BT.470 and,
/// nearly, of IEC 61966-2-1 (1999).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exposure {
    /// Doublings of the light [EV]; 0 does nothing.
    pub stops: f32,
}

pub(super) static EFFECT: Effect = Effect {
    name: "exposure",
    title: "more or less light",
    law: "x -> x 2^(stops / 2.2)",
    source: "ISO 2721 (2013); ITU-R BT.470; IEC 61966-2-1 (1999)",
    parameters: &[EffectParameter {
        name: "stops",
        unit: "EV",
        identity: 0.0,
        plausible: [-0.5, 0.5],
        bounds: [-10.0, 10.0],
    }],
};

impl Setting for Exposure {
    const NONE: Self = Self { stops: 0.0 };
    const EFFECT: &'static Effect = &EFFECT;

    fn drawn(uniform: &mut Uniform<'_>) -> Self {
        Self { stops: uniform.number(0) }
    }

    fn check(&self) -> Result<(), ImageError> {
        EFFECT.check(&[self.stops])
    }
}

impl Exposure {
    pub(super) fn compose(self, map: &mut ColourMap) {
        map.then_scale([exp2(f64::from(self.stops) / GAMMA); 3], 0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::super::Settings;
    use super::super::settings::tests::applied;
    use super::*;

    #[test]
    fn a_stop_doubles_the_light() {
        // 2^(1 / 2.2) = 1.370351: 100 -> 137.04, 180 -> 246.7, 200 is cut off; alpha stays.
        let more = Settings { exposure: Exposure { stops: 1.0 }, ..Settings::NONE };
        assert_eq!(applied(more, &[100_u8, 180, 200, 33], [1, 1, 4]), [137, 247, 255, 33]);
        let out = applied(more, &[0.5_f32], [1, 1, 1])[0];
        let light = |x: f32| f64::from(x).powf(GAMMA);
        assert!((light(out) / light(0.5) - 2.0).abs() < 1e-5, "{out}");
        // 2^(-2.2 / 2.2) = 1/2.
        let less = Settings { exposure: Exposure { stops: -2.2 }, ..Settings::NONE };
        assert_eq!(applied(less, &[100_u8, 180, 200], [1, 1, 3]), [50, 90, 100]);
    }
}
