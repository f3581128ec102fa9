//! Distortion by the lens.

use super::draw::Uniform;
use super::effect::{Effect, EffectParameter};
use super::error::ImageError;
use super::settings::Setting;

/// The pixel at `(x, y)` shows what an ideal camera has at
/// `x (1 + k1 r^2 + k2 r^4) + 2 p1 x y + p2 (r^2 + 2 x^2)`, `y (1 + k1 r^2 + k2 r^4) + p1 (r^2 + 2 y^2) + 2 p2 x y`,
/// between four pixels in proportion to nearness (bilinear).
///
/// `x` and `y` are distances from the centre of the image in focal lengths, `r^2 = x^2 + y^2`. The polynomials take
/// distorted coordinates to ideal ones, as Brown's do: positive `k1` is a barrel, negative a pincushion. `OpenCV`'s
/// polynomials of the same form take ideal coordinates to distorted ones: see [`Lens::from_opencv`].
///
/// Source: Conrady, "Decentred lens-systems", Monthly Notices of the Royal Astronomical Society 79 (1919); Brown,
/// "Decentering distortion of lenses", Photogrammetric Engineering 32 (1966).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lens {
    /// Radial, of the second order.
    pub k1: f32,
    /// Radial, of the fourth order.
    pub k2: f32,
    /// Of a lens off its axis, upwards or downwards.
    pub p1: f32,
    /// Of a lens off its axis, sideways.
    pub p2: f32,
    /// Focal length [widths of the image]: 0.5 is a field of view of 90 degrees across. Without distortion it does nothing.
    pub focal_length: f32,
}

/// What is seen beyond the edge of the image.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Border {
    /// The pixel of the edge, again and again.
    #[default]
    Repeat,
    /// A grey from 0 to 1, where alpha is 0.
    Constant(f32),
}

impl Border {
    pub(super) fn check(self) -> Result<(), ImageError> {
        match self {
            Self::Constant(grey) if !(0.0..=1.0).contains(&grey) => {
                let found = f64::from(grey);
                Err(ImageError::Setting { effect: EFFECT.name, parameter: "border", found, bounds: [0.0, 1.0] })
            }
            _ => Ok(()),
        }
    }
}

const fn coefficient(name: &'static str, plausible: f64) -> EffectParameter {
    EffectParameter { name, unit: "1", identity: 0.0, plausible: [-plausible, plausible], bounds: [-2.0, 2.0] }
}

pub(super) static EFFECT: Effect = Effect {
    name: "lens",
    title: "distortion by the lens",
    law: "(x, y) shows what was at (x, y) (1 + k1 r^2 + k2 r^4) + (2 p1 x y + p2 (r^2 + 2 x^2), p1 (r^2 + 2 y^2) + 2 p2 x y)",
    source: "Conrady, MNRAS 79 (1919); Brown, Photogrammetric Engineering 32 (1966)",
    parameters: &[coefficient("k1", 0.1), coefficient("k2", 0.02), coefficient("p1", 0.005), coefficient("p2", 0.005)],
};

/// 60 degrees across: a common camera's.
const FOCAL_LENGTH: f32 = 0.866;
/// From 157 degrees across to 3 [widths of the image].
pub(super) const FOCAL_LENGTHS: [f64; 2] = [0.1, 20.0];

impl Lens {
    /// The same lens from coefficients of `OpenCV`, which takes them the other way round; `focal_length` [widths of the
    /// image] is `fx / width`.
    ///
    /// `k1` becomes `-k1` and `k2` becomes `3 k1^2 - k2`, the first two terms of the series that turns the polynomials round,
    /// and `p1`, `p2` change their signs: what is left out is of the order `k1^3 r^7`.
    ///
    /// Source: Drap & Lefevre, "An exact formula for calculating inverse radial lens distortions", Sensors 16 (2016).
    #[must_use]
    pub fn from_opencv(k1: f32, k2: f32, p1: f32, p2: f32, focal_length: f32) -> Self {
        Self { k1: -k1, k2: 3.0 * k1 * k1 - k2, p1: -p1, p2: -p2, focal_length }
    }

    /// Whether it leaves all pixels where they are.
    pub(super) fn is_ideal(&self) -> bool {
        [self.k1, self.k2, self.p1, self.p2] == [0.0; 4]
    }

    /// How far what is seen at `(x, y)` was from there, all in focal lengths.
    #[inline(always)]
    pub(super) fn displacement(&self, x: f32, y: f32) -> (f32, f32) {
        let square = x * x + y * y;
        // Both tangential terms have 2 (p1 y + p2 x) times the coordinate.
        let along_ray = square * (self.k1 + square * self.k2) + 2.0 * (self.p1 * y + self.p2 * x);
        (x * along_ray + self.p2 * square, y * along_ray + self.p1 * square)
    }
}

impl Setting for Lens {
    const NONE: Self = Self { k1: 0.0, k2: 0.0, p1: 0.0, p2: 0.0, focal_length: FOCAL_LENGTH };
    const EFFECT: &'static Effect = &EFFECT;

    fn drawn(uniform: &mut Uniform<'_>) -> Self {
        let [k1, k2, p1, p2] = [0, 1, 2, 3].map(|k| uniform.number(k));
        Self { k1, k2, p1, p2, ..Self::NONE }
    }

    fn check(&self) -> Result<(), ImageError> {
        EFFECT.check(&[self.k1, self.k2, self.p1, self.p2])?;
        if !(FOCAL_LENGTHS[0]..=FOCAL_LENGTHS[1]).contains(&f64::from(self.focal_length)) {
            let found = f64::from(self.focal_length);
            return Err(ImageError::Setting {
                effect: EFFECT.name,
                parameter: "focal_length",
                found,
                bounds: FOCAL_LENGTHS,
            });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::Settings;
    use super::super::settings::tests::applied;
    use super::*;

    fn seen(lens: Lens, border: Border, image: &[f32], shape: [usize; 3]) -> Vec<f32> {
        applied(Settings { lens, border, ..Settings::NONE }, image, shape)
    }

    #[test]
    fn pixels_are_taken_from_where_the_polynomials_say() {
        // A row of five, focal length 5 px: x of the last pixel is 2 / 5 = 0.4, r^2 = 0.16. With k1 = -1 it shows what was at
        // 0.4 (1 - 0.16) = 0.336, 1.68 px from the centre: 0.32 of the pixel at 1 and 0.68 of the one at 2. The one beside it
        // is at 0.2 (1 - 0.04) = 0.192, 0.96 px.
        let image = [0.0, 0.2, 0.4, 0.5, 0.9];
        let lens = Lens { k1: -1.0, focal_length: 1.0, ..Lens::NONE };
        let expected = [0.2 * 0.32, 0.2 * 0.96 + 0.4 * 0.04, 0.4, 0.4 * 0.04 + 0.5 * 0.96, 0.5 * 0.32 + 0.9 * 0.68];
        for (found, expected) in seen(lens, Border::Repeat, &image, [1, 5, 1]).iter().zip(expected) {
            assert!((found - expected).abs() < 1e-6, "{found}, not {expected}");
        }
        // k2 alone: 0.4 (1 + 2 * 0.0256) = 0.42048, 2.1024 px: beyond the edge.
        let lens = Lens { k2: 2.0, focal_length: 1.0, ..Lens::NONE };
        assert!((seen(lens, Border::Repeat, &image, [1, 5, 1])[4] - 0.9).abs() < 1e-6);
        let found = seen(lens, Border::Constant(0.5), &image, [1, 5, 1])[4];
        assert!((found - (0.9 + 0.1024 * (0.5 - 0.9))).abs() < 1e-5, "{found}");
    }

    #[test]
    fn a_decentred_lens_takes_from_beside() {
        // p2 = 0.5, focal length 5 px: x + 0.5 (r^2 + 2 x^2) = x + 1.5 x^2. At x = 0.2 that is 0.26, 1.3 px; at -0.4 it is -0.16,
        // 0.8 px left of the centre; p1 moves nothing along a row with y = 0 but the column.
        let image = [0.0, 0.2, 0.4, 0.5, 0.9];
        let lens = Lens { p2: 0.5, focal_length: 1.0, ..Lens::NONE };
        let found = seen(lens, Border::Repeat, &image, [1, 5, 1]);
        assert!((found[3] - (0.5 * 0.7 + 0.9 * 0.3)).abs() < 1e-6, "{found:?}");
        assert!((found[0] - (0.2 * 0.8 + 0.4 * 0.2)).abs() < 1e-6, "{found:?}");
        // The same upright, with p1: a column of five, whose width is 1, so that 5 widths are 5 px.
        let upright = Lens { p1: 0.5, focal_length: 5.0, ..Lens::NONE };
        assert_eq!(seen(upright, Border::Repeat, &image, [5, 1, 1]), found);
    }

    #[test]
    fn positive_k1_is_a_barrel() {
        // A line beside the centre of a larger image bends away from it: at its ends it is nearer to the centre.
        let (size, line) = (41, 8);
        let image: Vec<f32> = (0..size * size).map(|at| if at % size == line { 1.0 } else { 0.0 }).collect();
        let out = seen(Lens { k1: 0.4, ..Lens::NONE }, Border::Repeat, &image, [size, size, 1]);
        let place = |row: usize| {
            let row = &out[row * size..(row + 1) * size];
            row.iter().enumerate().map(|(x, value)| x as f32 * value).sum::<f32>() / row.iter().sum::<f32>()
        };
        assert!(place(0) > place(20) + 0.5 && place(40) > place(20) + 0.5, "{} {}", place(0), place(20));
    }

    /// `OpenCV`'s polynomials take ideal coordinates to distorted ones; from there the lens must lead back.
    #[test]
    fn opencv_coefficients_are_turned_round() {
        let (k1, k2, p1, p2) = (-0.08_f32, 0.01, 0.002, -0.001);
        let lens = Lens::from_opencv(k1, k2, p1, p2, 0.9);
        assert_eq!(lens.focal_length, 0.9);
        for (x, y) in [(0.3_f32, 0.2_f32), (-0.4, 0.1), (0.5, -0.4), (0.0, 0.0)] {
            let square = x * x + y * y;
            let radial = 1.0 + k1 * square + k2 * square * square;
            let distorted_x = x * radial + 2.0 * p1 * x * y + p2 * (square + 2.0 * x * x);
            let distorted_y = y * radial + p1 * (square + 2.0 * y * y) + 2.0 * p2 * x * y;
            let (back_x, back_y) = lens.displacement(distorted_x, distorted_y);
            let missed = ((distorted_x + back_x - x).powi(2) + (distorted_y + back_y - y).powi(2)).sqrt();
            let distortion = ((distorted_x - x).powi(2) + (distorted_y - y).powi(2)).sqrt();
            assert!(missed <= 0.03 * distortion, "({x}, {y}): {missed} of {distortion}");
        }
    }

    #[test]
    fn alpha_goes_with_its_pixel_and_is_0_beyond_the_edge() {
        let image = [10_u8, 20, 30, 40, 50, 60, 70, 80];
        let shift = super::super::Shift { x: 1.0, y: 0.0 };
        let repeated = Settings { shift, ..Settings::NONE };
        assert_eq!(applied(repeated, &image, [1, 2, 4]), [10, 20, 30, 40, 10, 20, 30, 40]);
        let constant = Settings { border: Border::Constant(1.0), ..repeated };
        assert_eq!(applied(constant, &image, [1, 2, 4]), [255, 255, 255, 0, 10, 20, 30, 40]);
    }
}
