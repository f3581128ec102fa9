//! Brightness.

use super::colour::ColourMap;
use super::draw::Uniform;
use super::effect::{Effect, EffectParameter};
use super::error::ImageError;
use super::settings::Setting;

/// `x -> x + offset`, in all channels but alpha.
///
/// Source: Poynton, "Digital Video and HD" (2012), where brightness is an offset of encoded values (the black level).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Brightness {
    /// Part of the way from black to white; 0 does nothing.
    pub offset: f32,
}

pub(super) static EFFECT: Effect = Effect {
    name: "brightness",
    title: "offset of the black level",
    law: "x -> x + offset",
    source: "Poynton, \"Digital Video and HD\" (2012)",
    parameters: &[EffectParameter { name: "offset", unit: "1", identity: 0.0, plausible: [-0.1, 0.1], bounds: [-1.0, 1.0] }],
};

impl Setting for Brightness {
    const NONE: Self = Self { offset: 0.0 };
    const EFFECT: &'static Effect = &EFFECT;

    fn drawn(uniform: &mut Uniform<'_>) -> Self {
        Self { offset: uniform.number(0) }
    }

    fn check(&self) -> Result<(), ImageError> {
        EFFECT.check(&[self.offset])
    }
}

impl Brightness {
    pub(super) fn compose(self, map: &mut ColourMap) {
        map.then_scale([1.0; 3], f64::from(self.offset));
    }
}

#[cfg(test)]
mod tests {
    use super::super::Settings;
    use super::super::settings::tests::applied;
    use super::*;

    #[test]
    fn all_channels_but_alpha_get_the_offset() {
        // 0.2 of 255 is 51.
        let bright = Settings { brightness: Brightness { offset: 0.2 }, ..Settings::NONE };
        assert_eq!(applied(bright, &[0_u8, 100, 230, 7], [1, 1, 4]), [51, 151, 255, 7]);
        let dark = Settings { brightness: Brightness { offset: -0.25 }, ..Settings::NONE };
        assert_eq!(applied(dark, &[0.5_f32, 0.125, 0.25], [1, 1, 3]), [0.25, 0.0, 0.0]);
    }
}
