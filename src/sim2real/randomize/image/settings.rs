//! What is done to one image.

use super::blur::Blur;
use super::brightness::Brightness;
use super::colour::ColourMap;
use super::contrast::Contrast;
use super::draw::Uniform;
use super::effect::Effect;
use super::error::ImageError;
use super::exposure::Exposure;
use super::hue_saturation::HueSaturation;
use super::lens::{Border, Lens};
use super::noise::Noise;
use super::occlusion::Occlusion;
use super::shift::Shift;
use super::white_balance::WhiteBalance;

/// The settings of one effect.
pub(super) trait Setting: Sized + PartialEq {
    /// That which does nothing.
    const NONE: Self;
    /// What it is a setting of.
    const EFFECT: &'static Effect;
    /// A draw from the ranges of the effect's parameters.
    fn drawn(uniform: &mut Uniform<'_>) -> Self;
    /// Sees that all numbers are what they can be.
    fn check(&self) -> Result<(), ImageError>;
}

/// How the light of an image comes to its pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Way {
    /// All light stays where it is.
    Straight,
    /// The image, which may be blurred, is moved by whole pixels, to the right and down.
    Moved([i64; 2]),
    /// By the map of lens and shift.
    Warped,
}

/// The settings of all effects for one image. The same settings make the same image of the same image, to the last bit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Optics out of focus.
    pub blur: Blur,
    /// Distortion by the lens.
    pub lens: Lens,
    /// The image moved by whole pixels.
    pub shift: Shift,
    /// More or less light.
    pub exposure: Exposure,
    /// The colour of the light.
    pub white_balance: WhiteBalance,
    /// Contrast about mid-grey.
    pub contrast: Contrast,
    /// Hue and saturation, the luminance kept.
    pub hue_saturation: HueSaturation,
    /// The offset of the black level.
    pub brightness: Brightness,
    /// Noise of the sensor.
    pub noise: Noise,
    /// What is covered.
    pub occlusion: Occlusion,
    /// What lens and shift show beyond the edge.
    pub border: Border,
    /// What the noise of all pixels follows from.
    pub key: u64,
}

impl Settings {
    /// Nothing is done.
    pub const NONE: Self = Self {
        blur: Blur::NONE,
        lens: Lens::NONE,
        shift: Shift::NONE,
        exposure: Exposure::NONE,
        white_balance: WhiteBalance::NONE,
        contrast: Contrast::NONE,
        hue_saturation: HueSaturation::NONE,
        brightness: Brightness::NONE,
        noise: Noise::NONE,
        occlusion: Occlusion::NONE,
        border: Border::Repeat,
        key: 0,
    };

    /// Sees that all numbers are what they can be.
    ///
    /// # Errors
    /// [`ImageError::Setting`] of the first that is not.
    pub fn check(&self) -> Result<(), ImageError> {
        self.blur.check()?;
        self.lens.check()?;
        self.shift.check()?;
        self.exposure.check()?;
        self.white_balance.check()?;
        self.contrast.check()?;
        self.hue_saturation.check()?;
        self.brightness.check()?;
        self.noise.check()?;
        self.occlusion.check()?;
        self.border.check()
    }

    /// How light comes to its pixels.
    pub(super) fn way(&self) -> Way {
        let whole = self.shift.whole().filter(|_| self.lens.is_ideal());
        match whole {
            Some([0, 0]) if self.blur == Blur::NONE => Way::Straight,
            Some(by) => Way::Moved(by),
            None => Way::Warped,
        }
    }

    /// The effects of colour on an image of so many channels, if there are any.
    pub(super) fn colour(&self, channels: usize) -> Option<ColourMap> {
        let mut map = ColourMap::IDENTITY;
        self.exposure.compose(&mut map);
        if channels > 1 {
            self.white_balance.compose(&mut map);
        }
        self.contrast.compose(&mut map);
        if channels > 1 {
            self.hue_saturation.compose(&mut map);
        }
        self.brightness.compose(&mut map);
        (map != ColourMap::IDENTITY).then_some(map)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::{Fill, ImageMut, Rectangle, Shape, Value, Workspace};
    use super::*;

    /// What becomes of an image of `height x width x channels`.
    pub fn applied<V: Value>(settings: Settings, values: &[V], [height, width, channels]: [usize; 3]) -> Vec<V> {
        let mut changed = values.to_vec();
        let shape = Shape::new(height, width, channels).unwrap();
        settings.apply(ImageMut::new(&mut changed, shape).unwrap(), &mut Workspace::new()).unwrap();
        changed
    }

    #[test]
    fn numbers_that_cannot_be_are_refused_and_nothing_is_changed() {
        let none = Settings::NONE;
        let wrong = [
            (Settings { blur: Blur { std: -0.1 }, ..none }, "blur.std is -0.1"),
            (Settings { lens: Lens { k1: f32::NAN, ..none.lens }, ..none }, "lens.k1 is NaN"),
            (Settings { lens: Lens { focal_length: 0.0, ..none.lens }, ..none }, "lens.focal_length is 0"),
            (Settings { shift: Shift { x: f32::INFINITY, y: 0.0 }, ..none }, "shift.x is inf"),
            (Settings { exposure: Exposure { stops: 11.0 }, ..none }, "exposure.stops is 11"),
            (Settings { white_balance: WhiteBalance { red: 0.0, blue: -11.0 }, ..none }, "white_balance.blue is -11"),
            (Settings { contrast: Contrast { gain: -1.0 }, ..none }, "contrast.gain is -1"),
            (
                Settings { hue_saturation: HueSaturation { hue: 400.0, saturation: 1.0 }, ..none },
                "hue_saturation.hue is 400",
            ),
            (Settings { brightness: Brightness { offset: 2.0 }, ..none }, "brightness.offset is 2"),
            (Settings { noise: Noise { read: 0.0, shot: -0.5 }, ..none }, "noise.shot is -0.5"),
            (Settings { border: Border::Constant(3.0), ..none }, "lens.border is 3"),
            (
                Settings { occlusion: Occlusion { fill: Fill::Constant(-1.0), ..none.occlusion }, ..none },
                "occlusion.fill is -1",
            ),
        ];
        let rectangles = [Rectangle { left: 0.0, top: 0.0, width: 1.5, height: 0.5 }; Occlusion::MOST];
        let wide = (Settings { occlusion: Occlusion { rectangles, ..none.occlusion }, ..none }, "occlusion.width is 1.5");
        for (settings, text) in wrong.into_iter().chain([wide]) {
            let mut values = [7_u8; 12];
            let image = ImageMut::new(&mut values, Shape::new(2, 2, 3).unwrap()).unwrap();
            let error = settings.apply(image, &mut Workspace::new()).unwrap_err().to_string();
            assert!(error.starts_with(text) && error.contains("\nhint: "), "{error}");
            assert_eq!(values, [7; 12]);
        }
        let mut values = [0.5, f32::NAN];
        let image = ImageMut::new(&mut values, Shape::new(1, 2, 1).unwrap()).unwrap();
        let settings = Settings { exposure: Exposure { stops: 1.0 }, ..none };
        assert!(matches!(settings.apply(image, &mut Workspace::new()), Err(ImageError::Value { column: 1, .. })));
        assert_eq!(values[0], 0.5);
    }
}
