//! Images as borrowed slices with a checked shape.

use std::fmt;

use super::error::ImageError;

/// Height, width and channels of an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Shape {
    /// Rows [px].
    pub height: usize,
    /// Columns [px].
    pub width: usize,
    /// 1 (grey), 3 (RGB) or 4 (RGB and alpha).
    pub channels: usize,
}

impl Shape {
    /// The longest side an image may have [px]: positions to a fraction of a pixel must fit into an `f32`.
    pub const LONGEST_SIDE: usize = 16_384;

    /// An image of `height` rows and `width` columns.
    ///
    /// # Errors
    /// [`ImageError::Side`] and [`ImageError::Channels`].
    pub fn new(height: usize, width: usize, channels: usize) -> Result<Self, ImageError> {
        let shape = Self { height, width, channels };
        shape.check()?;
        Ok(shape)
    }

    /// Values of one image.
    #[must_use]
    pub const fn values(&self) -> usize {
        self.height * self.width * self.channels
    }

    fn check(&self) -> Result<(), ImageError> {
        let sides = 1..=Self::LONGEST_SIDE;
        if !sides.contains(&self.height) || !sides.contains(&self.width) {
            return Err(ImageError::Side(*self));
        }
        if !matches!(self.channels, 1 | 3 | 4) {
            return Err(ImageError::Channels(self.channels));
        }
        Ok(())
    }
}

impl fmt::Display for Shape {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} x {} x {}", self.height, self.width, self.channels)
    }
}

/// A kind of value of which images are made: `u8` from 0 to 255, or `f32` from 0 to 1.
pub trait Value: sealed::Value {}
impl Value for u8 {}
impl Value for f32 {}

pub(super) mod sealed {
    use wide::{i16x8, i32x8, u8x16};

    use super::super::pixel::Pixel;

    /// How a value is reckoned with.
    pub trait Value: Copy + Send + Sync + 'static {
        /// What stands for white.
        const FULL: f32;
        /// As a number from 0 to `FULL`.
        fn number(self) -> f32;
        /// Back from four pixels' numbers, which are cut off at 0 and `FULL`; bytes are rounded to the nearest, halves to even.
        fn nearest(pixels: &[Pixel; 4]) -> [[Self; 4]; 4];
        /// Where the first value stands that is none, and what it is.
        fn wrong(values: &[Self]) -> Option<(usize, f32)>;
    }

    impl Value for u8 {
        const FULL: f32 = 255.0;

        #[inline(always)]
        fn number(self) -> f32 {
            f32::from(self)
        }

        #[inline(always)]
        fn nearest(pixels: &[Pixel; 4]) -> [[Self; 4]; 4] {
            // Numbers that are too large for a narrower integer become its largest.
            let pair = |a: Pixel, b: Pixel| {
                let ([a, b, c, d], [e, f, g, h]) = (a.fast_round_int().to_array(), b.fast_round_int().to_array());
                i16x8::from_i32x8_saturate(i32x8::new([a, b, c, d, e, f, g, h]))
            };
            let bytes = u8x16::narrow_i16x8(pair(pixels[0], pixels[1]), pair(pixels[2], pixels[3])).to_array();
            let mut four = [[0; 4]; 4];
            four.as_flattened_mut().copy_from_slice(&bytes);
            four
        }

        fn wrong(_values: &[Self]) -> Option<(usize, f32)> {
            None
        }
    }

    impl Value for f32 {
        const FULL: f32 = 1.0;

        #[inline(always)]
        fn number(self) -> f32 {
            self
        }

        #[inline(always)]
        fn nearest(pixels: &[Pixel; 4]) -> [[Self; 4]; 4] {
            let cut = |pixel: Pixel| pixel.fast_max(Pixel::ZERO).fast_min(Pixel::ONE).to_array();
            [cut(pixels[0]), cut(pixels[1]), cut(pixels[2]), cut(pixels[3])]
        }

        fn wrong(values: &[Self]) -> Option<(usize, f32)> {
            let fine = |value: &f32| (*value >= 0.0) & (*value <= 1.0);
            // All at once first, without a branch a value: images are fine.
            let all = values.chunks(64).all(|part| part.iter().fold(true, |so_far, value| so_far & fine(value)));
            if all { None } else { values.iter().position(|value| !fine(value)).map(|at| (at, values[at])) }
        }
    }
}

/// One image or a batch of them to read: values row by row, channels side by side (HWC; NHWC).
#[derive(Debug, Clone, Copy)]
pub struct ImageView<'a, V> {
    pub(super) shape: Shape,
    pub(super) images: usize,
    pub(super) values: &'a [V],
}

impl<'a, V: Value> ImageView<'a, V> {
    /// One image.
    ///
    /// # Errors
    /// A shape that cannot be, or one that does not have as many values.
    pub fn new(values: &'a [V], shape: Shape) -> Result<Self, ImageError> {
        Self::batch(values, 1, shape)
    }

    /// `images` images one after another.
    ///
    /// # Errors
    /// As of [`ImageView::new`].
    pub fn batch(values: &'a [V], images: usize, shape: Shape) -> Result<Self, ImageError> {
        check(values.len(), images, shape)?;
        Ok(Self { shape, images, values })
    }

    /// What each image is.
    #[must_use]
    pub fn shape(&self) -> Shape {
        self.shape
    }

    /// How many images there are.
    #[must_use]
    pub fn images(&self) -> usize {
        self.images
    }
}

/// One image or a batch of them to change: values row by row, channels side by side (HWC; NHWC).
#[derive(Debug)]
pub struct ImageMut<'a, V> {
    pub(super) shape: Shape,
    pub(super) images: usize,
    pub(super) values: &'a mut [V],
}

impl<'a, V: Value> ImageMut<'a, V> {
    /// One image.
    ///
    /// # Errors
    /// A shape that cannot be, or one that does not have as many values.
    pub fn new(values: &'a mut [V], shape: Shape) -> Result<Self, ImageError> {
        Self::batch(values, 1, shape)
    }

    /// `images` images one after another.
    ///
    /// # Errors
    /// As of [`ImageMut::new`].
    pub fn batch(values: &'a mut [V], images: usize, shape: Shape) -> Result<Self, ImageError> {
        check(values.len(), images, shape)?;
        Ok(Self { shape, images, values })
    }

    /// What each image is.
    #[must_use]
    pub fn shape(&self) -> Shape {
        self.shape
    }

    /// How many images there are.
    #[must_use]
    pub fn images(&self) -> usize {
        self.images
    }

    /// The same, to read.
    #[must_use]
    pub fn view(&self) -> ImageView<'_, V> {
        ImageView { shape: self.shape, images: self.images, values: self.values }
    }
}

fn check(found: usize, images: usize, shape: Shape) -> Result<(), ImageError> {
    shape.check()?;
    let expected = shape.values().saturating_mul(images);
    if found == expected { Ok(()) } else { Err(ImageError::Length { shape, images, expected, found }) }
}

/// Says where a float image holds what is no value.
pub(super) fn check_values<V: Value>(view: &ImageView<'_, V>) -> Result<(), ImageError> {
    let Some((at, found)) = V::wrong(view.values) else { return Ok(()) };
    let Shape { width, channels, .. } = view.shape;
    let (image, within) = (at / view.shape.values(), at % view.shape.values());
    let (pixel, channel) = (within / channels, within % channels);
    Err(ImageError::Value { image, row: pixel / width, column: pixel % width, channel, found })
}

#[cfg(test)]
mod tests {
    use super::super::pixel::Pixel;
    use super::sealed::Value as _;
    use super::*;

    #[test]
    fn shapes_and_lengths_are_checked() {
        assert_eq!(Shape::new(0, 4, 3), Err(ImageError::Side(Shape { height: 0, width: 4, channels: 3 })));
        assert!(matches!(Shape::new(4, 20_000, 3), Err(ImageError::Side(_))));
        assert_eq!(Shape::new(4, 4, 2), Err(ImageError::Channels(2)));
        let shape = Shape::new(2, 3, 3).unwrap();
        let error = ImageView::new(&[0_u8; 17], shape).unwrap_err();
        assert_eq!(error, ImageError::Length { shape, images: 1, expected: 18, found: 17 });
        let text = error.to_string();
        assert!(
            text.contains("2 x 3 x 3") && text.contains("18") && text.contains("17") && text.contains("hint:"),
            "{text}"
        );
        assert!(ImageMut::batch(&mut [0_u8; 36], 2, shape).is_ok());
        assert!(ImageMut::batch(&mut [0_u8; 36], usize::MAX, shape).is_err());
        // A shape written by hand is checked, too.
        assert!(ImageView::new(&[0_u8; 2], Shape { height: 1, width: 1, channels: 2 }).is_err());
    }

    #[test]
    fn bytes_are_rounded_to_the_nearest_and_cut_off() {
        let nearest = |number: f32| u8::nearest(&[Pixel::splat(number); 4]);
        for byte in 0..=255_u8 {
            let number = f32::from(byte);
            for near in [number, number + 0.49, number - 0.49] {
                assert_eq!(nearest(near), [[byte; 4]; 4]);
            }
        }
        assert_eq!([0.5, 1.5, 2.5, 254.5].map(|number| nearest(number)[1][2]), [0, 2, 2, 254]);
        assert_eq!([-3.0, 255.6, 1e6, -1e6].map(|number| nearest(number)[3][0]), [0, 255, 255, 0]);
        // Each number goes to its own place.
        let places: [[f32; 4]; 4] = std::array::from_fn(|k| std::array::from_fn(|j| (4 * k + j) as f32));
        assert_eq!(u8::nearest(&places.map(Pixel::from)).as_flattened(), (0..16).collect::<Vec<u8>>());
        let floats = f32::nearest(&[Pixel::from([-0.1, 0.25, 1.1, 1.0]); 4]);
        assert_eq!(floats, [[0.0, 0.25, 1.0, 1.0]; 4]);
    }

    #[test]
    fn a_value_that_is_none_is_told_with_its_place() {
        let shape = Shape::new(2, 3, 3).unwrap();
        let mut values = vec![0.5_f32; 36];
        assert_eq!(check_values(&ImageView::batch(&values, 2, shape).unwrap()), Ok(()));
        // Image 1, row 1, column 2, channel 0 is value 18 + 9 + 6.
        for wrong in [1.01, -0.01, f32::INFINITY] {
            values[33] = wrong;
            let error = check_values(&ImageView::batch(&values, 2, shape).unwrap()).unwrap_err();
            assert_eq!(error, ImageError::Value { image: 1, row: 1, column: 2, channel: 0, found: wrong });
        }
        values[33] = f32::NAN;
        let text = check_values(&ImageView::batch(&values, 2, shape).unwrap()).unwrap_err().to_string();
        assert!(text.starts_with("image 1, row 1, column 2, channel 0: NaN"), "{text}");
    }
}
