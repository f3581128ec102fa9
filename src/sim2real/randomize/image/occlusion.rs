//! Occlusion: something stands between the camera and the scene.

use super::draw::Uniform;
use super::effect::{Effect, EffectParameter};
use super::error::ImageError;
use super::gaussian::Counter;
use super::settings::Setting;
use super::view::{Shape, Value};
use crate::sim2real::elementary::exp2;

/// Up to four rectangles of the image are filled, the last effect of all, so that the fill is what it says. Alpha stays
/// what it is.
///
/// Drawn rectangles number `count`, each a part `area` of the image with `log2(width / height)` of `log2_aspect` relative to
/// the image's, anywhere within it.
///
/// Source: `Fill::Constant` and `Fill::Mean`, `DeVries` & Taylor, "Improved regularization of convolutional neural networks
/// with cutout", arXiv 1708.04552 (2017); `Fill::Noise`, Zhong, Zheng, Kang, Li & Yang, "Random erasing data augmentation",
/// AAAI (2020).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Occlusion {
    /// What is covered; [`Rectangle::NONE`] covers nothing.
    pub rectangles: [Rectangle; Occlusion::MOST],
    /// What it is covered with.
    pub fill: Fill,
}

/// A part of the image, in parts of its width and height from the top left corner.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rectangle {
    /// Left edge, from 0 to 1.
    pub left: f32,
    /// Upper edge, from 0 to 1.
    pub top: f32,
    /// From 0 to 1.
    pub width: f32,
    /// From 0 to 1.
    pub height: f32,
}

impl Rectangle {
    /// Nothing.
    pub const NONE: Self = Self { left: 0.0, top: 0.0, width: 0.0, height: 0.0 };
}

/// What a rectangle is filled with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fill {
    /// A grey from 0 (black) to 1 (white).
    Constant(f32),
    /// The mean of each channel of the image, as it is with all other effects.
    Mean,
    /// Each value anything from black to white, with equal probability.
    Noise,
}

pub(super) static EFFECT: Effect = Effect {
    name: "occlusion",
    title: "rectangles of the image covered",
    law: "x -> fill within each of count rectangles of a part area of the image",
    source: "DeVries & Taylor, arXiv 1708.04552 (2017); Zhong et al., AAAI (2020)",
    parameters: &[
        EffectParameter {
            name: "count",
            unit: "rectangles",
            identity: 0.0,
            plausible: [0.0, 2.0],
            bounds: [0.0, Occlusion::MOST as f64],
        },
        EffectParameter { name: "area", unit: "1", identity: 0.0, plausible: [0.02, 0.1], bounds: [0.0, 1.0] },
        EffectParameter { name: "log2_aspect", unit: "1", identity: 0.0, plausible: [-1.0, 1.0], bounds: [-8.0, 8.0] },
    ],
};

impl Setting for Occlusion {
    const NONE: Self = Self { rectangles: [Rectangle::NONE; Self::MOST], fill: Fill::Constant(0.0) };
    const EFFECT: &'static Effect = &EFFECT;

    fn drawn(uniform: &mut Uniform<'_>) -> Self {
        let count = uniform.whole(0);
        let mut drawn = Self::NONE;
        // All are drawn and some are kept: where one lies does not depend on how many there are.
        for (at, rectangle) in drawn.rectangles.iter_mut().enumerate() {
            let (area, aspect) = (f64::from(uniform.number(1)), exp2(0.5 * f64::from(uniform.number(2))));
            // A side of more than the image is cut off, and what is over goes to the other one.
            let width = (area.sqrt() * aspect).clamp(area, 1.0);
            let height = if width > 0.0 { (area / width).min(1.0) } else { 0.0 };
            let (left, top) = ((1.0 - width) * uniform.part(), (1.0 - height) * uniform.part());
            if (at as f64) < count {
                let [left, top, width, height] = [left, top, width, height].map(|side| side as f32);
                *rectangle = Rectangle { left, top, width, height };
            }
        }
        drawn
    }

    fn check(&self) -> Result<(), ImageError> {
        let within = |parameter, value: f32| {
            let found = f64::from(value);
            let fine = (0.0..=1.0).contains(&found);
            if fine {
                Ok(())
            } else {
                Err(ImageError::Setting { effect: EFFECT.name, parameter, found, bounds: [0.0, 1.0] })
            }
        };
        for rectangle in &self.rectangles {
            within("left", rectangle.left)?;
            within("top", rectangle.top)?;
            within("width", rectangle.width)?;
            within("height", rectangle.height)?;
        }
        if let Fill::Constant(grey) = self.fill { within("fill", grey) } else { Ok(()) }
    }
}

impl Occlusion {
    /// The most rectangles there can be.
    pub const MOST: usize = 4;

    /// Whether nothing is covered.
    pub(super) fn is_clear(&self) -> bool {
        self.rectangles.iter().all(|r| r.width <= 0.0 || r.height <= 0.0)
    }

    /// Covers parts of an image of `C` channels.
    pub(super) fn apply<V: Value, const C: usize>(&self, values: &mut [V], shape: Shape, draws: Counter) {
        let constant = match self.fill {
            Fill::Constant(grey) => [V::nearest(grey * V::FULL); C],
            Fill::Mean => mean::<V, C>(values).map(V::nearest),
            Fill::Noise => [V::nearest(0.0); C],
        };
        let light = C.min(3);
        for rectangle in &self.rectangles {
            let [left, right] = span(rectangle.left, rectangle.width, shape.width);
            let [top, bottom] = span(rectangle.top, rectangle.height, shape.height);
            for y in top..bottom {
                let row = &mut values[y * shape.width * C..(y + 1) * shape.width * C];
                for (x, pixel) in row.as_chunks_mut::<C>().0.iter_mut().enumerate().take(right).skip(left) {
                    pixel[..light].copy_from_slice(&constant[..light]);
                    if self.fill == Fill::Noise {
                        speckle(&mut pixel[..light], draws.bits((y * shape.width + x) as u64));
                    }
                }
            }
        }
    }
}

/// The pixels whose middle lies between two edges.
fn span(start: f32, length: f32, pixels: usize) -> [usize; 2] {
    let edge = |part: f32| (f64::from(part) * pixels as f64 + 0.5) as usize;
    [edge(start).min(pixels), edge(start + length).min(pixels)]
}

/// Each value from its own 21 bits.
fn speckle<V: Value>(light: &mut [V], bits: u64) {
    for (channel, place) in light.iter_mut().enumerate() {
        let part = (bits >> (21 * channel) & 0x1f_ffff) as f32 / 2_097_151.0;
        *place = V::nearest(part * V::FULL);
    }
}

/// The mean of each channel; rows of pixels are added up in their order, whatever the machine.
fn mean<V: Value, const C: usize>(values: &[V]) -> [f32; C] {
    let mut sums = [0.0_f64; C];
    // Parts are summed up as `f32`, exactly where they are bytes: 255 times 4,096 is below 2^24.
    for part in values.chunks(C * 4_096) {
        let mut sum = [0.0_f32; C];
        for pixel in part.as_chunks::<C>().0 {
            for (sum, value) in sum.iter_mut().zip(pixel) {
                *sum += value.number();
            }
        }
        for (total, sum) in sums.iter_mut().zip(sum) {
            *total += f64::from(sum);
        }
    }
    let pixels = (values.len() / C) as f64;
    sums.map(|sum| (sum / pixels) as f32)
}

#[cfg(test)]
mod tests {
    use super::super::settings::tests::applied;
    use super::super::{Brightness, Settings};
    use super::*;

    fn covering(rectangle: Rectangle, fill: Fill) -> Settings {
        let mut rectangles = [Rectangle::NONE; Occlusion::MOST];
        rectangles[2] = rectangle;
        Settings { occlusion: Occlusion { rectangles, fill }, ..Settings::NONE }
    }

    const MIDDLE: Rectangle = Rectangle { left: 0.25, top: 0.0, width: 0.5, height: 0.5 };

    #[test]
    fn the_rectangle_and_nothing_else_is_filled() {
        // Columns 1 and 2 of four, the first row of two; 0.2 is 51.
        let out = applied(covering(MIDDLE, Fill::Constant(0.2)), &[1_u8, 2, 3, 4, 5, 6, 7, 8], [2, 4, 1]);
        assert_eq!(out, [1, 51, 51, 4, 5, 6, 7, 8]);
        // Alpha stays.
        let out = applied(covering(MIDDLE, Fill::Constant(1.0)), &[9_u8; 16], [1, 4, 4]);
        assert_eq!(out, [9, 9, 9, 9, 255, 255, 255, 9, 255, 255, 255, 9, 9, 9, 9, 9]);
    }

    #[test]
    fn the_mean_is_of_the_image_with_all_other_effects() {
        // Red 10, 20, 30, 40, and 51 more of brightness: a mean of 76; green 2 x 51 and 2 x 151 of it: 101; blue 0 -> 51.
        let image = [10_u8, 0, 0, 20, 100, 0, 30, 0, 0, 40, 100, 0];
        let covered = covering(MIDDLE, Fill::Mean);
        let settings = Settings { brightness: Brightness { offset: 0.2 }, ..covered };
        assert_eq!(applied(settings, &image, [1, 4, 3]), [61, 51, 51, 76, 101, 51, 76, 101, 51, 91, 151, 51]);
    }

    #[test]
    fn noise_fills_evenly_and_by_the_key() {
        let all = Rectangle { left: 0.0, top: 0.0, width: 1.0, height: 1.0 };
        let settings = Settings { key: 5, ..covering(all, Fill::Noise) };
        let out = applied(settings, &vec![0_u8; 200 * 200 * 3], [200, 200, 3]);
        let count = out.len() as f64;
        let mean = out.iter().map(|byte| f64::from(*byte)).sum::<f64>() / count;
        // A uniform value has the variance 255^2 / 12.
        assert!((mean - 127.5).abs() < 4.5 * 255.0 / (12.0 * count).sqrt(), "{mean}");
        for channel in 0..3 {
            let dark = out.iter().skip(channel).step_by(3).filter(|byte| **byte < 64).count() as f64;
            assert!((dark / (count / 3.0) - 63.5 / 255.0).abs() < 4.5 * (0.19 / (count / 3.0)).sqrt(), "{dark}");
        }
        assert_eq!(applied(settings, &vec![7_u8; 200 * 200 * 3], [200, 200, 3]), out);
        let other = Settings { key: 6, ..settings };
        assert_ne!(applied(other, &vec![0_u8; 200 * 200 * 3], [200, 200, 3]), out);
    }

    #[test]
    fn a_rectangle_that_reaches_beyond_the_image_is_cut_off() {
        let beyond = Rectangle { left: 0.5, top: 0.5, width: 1.0, height: 1.0 };
        assert_eq!(applied(covering(beyond, Fill::Constant(0.0)), &[5_u8; 4], [2, 2, 1]), [5, 5, 5, 0]);
        let thin = Rectangle { left: 0.3, top: 0.0, width: 0.0, height: 1.0 };
        assert_eq!(applied(covering(thin, Fill::Constant(0.0)), &[5_u8; 4], [2, 2, 1]), [5; 4]);
    }
}
