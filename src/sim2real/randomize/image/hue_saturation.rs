//! Hue and saturation.

use super::colour::ColourMap;
use super::draw::Uniform;
use super::effect::{Effect, EffectParameter};
use super::error::ImageError;
use super::settings::Setting;
use crate::sim2real::elementary::sin_cos;

/// A turn by `hue` and a gain `saturation` of the chrominance `(I, Q)`, in which the luminance `Y` is kept. Grey images
/// have no colour, and are left alone.
///
/// `Y = 0.299 r + 0.587 g + 0.114 b`, `I = 0.74 (r - Y) - 0.27 (b - Y)`, `Q = 0.48 (r - Y) + 0.41 (b - Y)`. It is linear, and
/// so one step with the other effects of colour; the hue of HSV is not, and turns all colours whatever their luminance.
///
/// Source: the NTSC's colour television of 1953, 47 CFR 73.682 (a)(20).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HueSaturation {
    /// Turn of the chrominance from I to Q [degrees]; 0 does nothing.
    pub hue: f32,
    /// Gain of the chrominance; 1 does nothing, 0 leaves the luminance.
    pub saturation: f32,
}

pub(super) static EFFECT: Effect = Effect {
    name: "hue_saturation",
    title: "hue and saturation, the luminance kept",
    law: "(I, Q) -> saturation (I cos hue - Q sin hue, I sin hue + Q cos hue)",
    source: "NTSC (1953), 47 CFR 73.682 (a)(20)",
    parameters: &[
        EffectParameter { name: "hue", unit: "degrees", identity: 0.0, plausible: [-15.0, 15.0], bounds: [-360.0, 360.0] },
        EffectParameter { name: "saturation", unit: "1", identity: 1.0, plausible: [0.7, 1.3], bounds: [0.0, 10.0] },
    ],
};

/// Of red, green and blue in the luminance.
const LUMINANCE: [f64; 3] = [0.299, 0.587, 0.114];
/// I and Q, of `r - Y` and `b - Y`.
const CHROMINANCE: [[f64; 2]; 2] = [[0.74, -0.27], [0.48, 0.41]];

impl Setting for HueSaturation {
    const NONE: Self = Self { hue: 0.0, saturation: 1.0 };
    const EFFECT: &'static Effect = &EFFECT;

    fn drawn(uniform: &mut Uniform<'_>) -> Self {
        Self { hue: uniform.number(0), saturation: uniform.number(1) }
    }

    fn check(&self) -> Result<(), ImageError> {
        EFFECT.check(&[self.hue, self.saturation])
    }
}

impl HueSaturation {
    pub(super) fn compose(self, map: &mut ColourMap) {
        if self != Self::NONE {
            map.then_mix(self.mix());
        }
    }

    /// The matrix of red, green and blue.
    fn mix(self) -> [[f64; 3]; 3] {
        let (sine, cosine) = sin_cos(f64::from(self.hue).to_radians());
        let gain = f64::from(self.saturation);
        let [i, q] = CHROMINANCE;
        let determinant = i[0] * q[1] - i[1] * q[0];
        // What a colour with these r - Y and b - Y gets.
        let turned = |red: f64, blue: f64| {
            let (from_i, from_q) = (i[0] * red + i[1] * blue, q[0] * red + q[1] * blue);
            let (to_i, to_q) = (gain * (from_i * cosine - from_q * sine), gain * (from_i * sine + from_q * cosine));
            let (red, blue) = ((q[1] * to_i - i[1] * to_q) / determinant, (i[0] * to_q - q[0] * to_i) / determinant);
            // The luminance of differences from the luminance is 0.
            [red, -(LUMINANCE[0] * red + LUMINANCE[2] * blue) / LUMINANCE[1], blue]
        };
        let mut mix = [[0.0; 3]; 3];
        for (channel, luminance) in LUMINANCE.into_iter().enumerate() {
            let [red, blue] = [0, 2].map(|of| f64::from(u8::from(channel == of)) - luminance);
            for (row, value) in mix.iter_mut().zip(turned(red, blue)) {
                row[channel] = luminance + value;
            }
        }
        mix
    }
}

#[cfg(test)]
mod tests {
    use super::super::Settings;
    use super::super::settings::tests::applied;
    use super::*;

    fn with(hue: f32, saturation: f32) -> Settings {
        Settings { hue_saturation: HueSaturation { hue, saturation }, ..Settings::NONE }
    }

    #[test]
    fn without_saturation_the_luminance_is_left() {
        // 0.299 * 100 + 0.587 * 150 + 0.114 * 200 = 140.75.
        assert_eq!(applied(with(0.0, 0.0), &[100_u8, 150, 200, 9], [1, 1, 4]), [141, 141, 141, 9]);
        assert_eq!(applied(with(90.0, 0.0), &[100_u8, 150, 200], [1, 1, 3]), [141, 141, 141]);
    }

    #[test]
    fn half_a_turn_mirrors_colours_at_their_luminance() {
        // 2 * 140.75 - (100, 150, 200).
        assert_eq!(applied(with(180.0, 1.0), &[100_u8, 150, 200], [1, 1, 3]), [182, 132, 82]);
        // Half as saturated: 140.75 + (x - 140.75) / 2.
        assert_eq!(applied(with(0.0, 0.5), &[100_u8, 150, 200], [1, 1, 3]), [120, 145, 170]);
    }

    #[test]
    fn a_quarter_turn_takes_i_to_q() {
        // r - Y = a, b - Y = b with Q = 0.48 a + 0.41 b = 0 and I = 0.1 is a = 0.1 * 0.41 / D, b = -0.1 * 0.48 / D, with
        // D = 0.74 * 0.41 + 0.27 * 0.48 = 0.433; a quarter turn makes it I = 0, Q = 0.1: a = 0.1 * 0.27 / D, b = 0.1 * 0.74 / D.
        let colour = |a: f32, b: f32| [0.5 + a, 0.5 - (0.299 * a + 0.114 * b) / 0.587, 0.5 + b];
        let (before, after) = (colour(0.041 / 0.433, -0.048 / 0.433), colour(0.027 / 0.433, 0.074 / 0.433));
        for (found, expected) in applied(with(90.0, 1.0), &before, [1, 1, 3]).iter().zip(after) {
            assert!((found - expected).abs() < 1e-6, "{found}, not {expected}");
        }
    }

    #[test]
    fn greys_keep_their_value() {
        for grey in 0..=255_u8 {
            assert_eq!(applied(with(77.0, 1.4), &[grey; 3], [1, 1, 3]), [grey; 3]);
        }
        assert_eq!(applied(with(77.0, 0.0), &[1_u8, 2, 3], [1, 3, 1]), [1, 2, 3]);
    }
}
