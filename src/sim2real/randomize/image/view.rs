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
    use super::super::rounding::{lower, nearest_byte, upper};

    /// How a value is reckoned with.
    pub trait Value: Copy + Send + Sync + 'static {
        /// What stands for white.
        const FULL: f32;
        /// As a number from 0 to `FULL`.
        fn number(self) -> f32;
        /// Back from a number, which is cut off at 0 and `FULL`; bytes are rounded to the nearest, halves to even.
        fn nearest(number: f32) -> Self;
        /// The same for a row of `C` channels.
        fn store<const C: usize>(channels: [&[f32]; 4], row: &mut [Self]);
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
        fn nearest(number: f32) -> Self {
            nearest_byte(number)
        }

        #[inline(always)]
        fn store<const C: usize>(channels: [&[f32]; 4], row: &mut [Self]) {
            let pixels = row.as_chunks_mut::<C>().0;
            let channels = channels.map(|channel| &channel[..pixels.len()]);
            for (x, pixel) in pixels.iter_mut().enumerate() {
                for (value, channel) in pixel.iter_mut().zip(channels) {
                    *value = Self::nearest(channel[x]);
                }
            }
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
        fn nearest(number: f32) -> Self {
            lower(upper(number, 0.0), 1.0)
        }

        #[inline(always)]
        fn store<const C: usize>(channels: [&[f32]; 4], row: &mut [Self]) {
            for (x, pixel) in row.as_chunks_mut::<C>().0.iter_mut().enumerate() {
                for (value, channel) in pixel.iter_mut().zip(channels) {
                    *value = Self::nearest(channel[x]);
                }
            }
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
    use super::super::line::Line;
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
        for byte in 0..=255_u8 {
            let number = f32::from(byte);
            for near in [number, number + 0.49, number - 0.49] {
                assert_eq!(u8::nearest(near), byte);
            }
        }
        assert_eq!([0.5, 1.5, 2.5, 254.5].map(u8::nearest), [0, 2, 2, 254]);
        assert_eq!([-3.0, 255.6, 1e6, -1e6].map(u8::nearest), [0, 255, 255, 0]);
        assert_eq!([-0.1, 0.25, 1.1, 1.0].map(f32::nearest), [0.0, 0.25, 1.0, 1.0]);
    }

    #[test]
    fn each_number_of_a_row_goes_to_its_own_place() {
        fn check<V: Value + PartialEq + std::fmt::Debug, const C: usize>(width: usize, value: fn(usize) -> V) {
            let row: Vec<V> = (0..width * C).map(value).collect();
            let mut line = Line::default();
            line.resize(width);
            line.take::<V, C>(&row);
            let mut back = vec![value(0); row.len()];
            line.store::<V, C>(&mut back);
            assert_eq!(back, row);
        }
        for width in [1, 7, 8, 9, 16, 21] {
            check::<u8, 1>(width, |at| at as u8);
            check::<u8, 3>(width, |at| at as u8);
            check::<u8, 4>(width, |at| at as u8);
            check::<f32, 3>(width, |at| at as f32 / 64.0);
            check::<f32, 4>(width, |at| at as f32 / 84.0);
        }
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
