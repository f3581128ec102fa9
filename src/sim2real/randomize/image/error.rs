//! What can be wrong with images, settings and ranges.

use super::view::Shape;

/// Why images were not randomized. No image has been changed when this comes back.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ImageError {
    /// A buffer does not hold as many values as its shape says.
    #[error(
        "{images} image(s) of {shape} have {expected} values, and the buffer has {found}\nhint: give height, width, channels in this order; values lie row by row, the channels of a pixel side by side (HWC, NHWC)"
    )]
    Length {
        /// What each image is.
        shape: Shape,
        /// How many images there are to be.
        images: usize,
        /// Values that takes.
        expected: usize,
        /// Values the buffer has.
        found: usize,
    },
    /// A number of channels that is no picture.
    #[error(
        "{0} channels\nhint: 1 (grey), 3 (RGB) or 4 (RGB and alpha); give the frames of a stack one by one, with one index"
    )]
    Channels(usize),
    /// A side that cannot be.
    #[error("an image of {0}\nhint: height and width are from 1 to {max}", max = Shape::LONGEST_SIDE)]
    Side(Shape),
    /// Two buffers of which one is to become the other differ.
    #[error(
        "{source_images} image(s) of {source_shape} cannot be written into {target_images} of {target_shape}\nhint: give a target of the same shape"
    )]
    Shapes {
        /// What is read.
        source_shape: Shape,
        /// How many are read.
        source_images: usize,
        /// What is written.
        target_shape: Shape,
        /// How many are written.
        target_images: usize,
    },
    /// Images and indices do not match.
    #[error("{images} image(s) and {indices} indices\nhint: give each image of the batch its (episode, frame)")]
    Indices {
        /// Images in the batch.
        images: usize,
        /// Indices given.
        indices: usize,
    },
    /// A value of a float image that is none.
    #[error(
        "image {image}, row {row}, column {column}, channel {channel}: {found}\nhint: values of float images are from 0 to 1; divide by 255, or give bytes, and keep NaN out of the renderer"
    )]
    Value {
        /// Which image of the batch, from 0.
        image: usize,
        /// Its row, from 0 at the top.
        row: usize,
        /// Its column, from 0 at the left.
        column: usize,
        /// The channel, from 0.
        channel: usize,
        /// What was there.
        found: f32,
    },
    /// An effect that is not in the registry.
    #[error("there is no image effect {name:?}\nhint: {hint}")]
    UnknownEffect {
        /// What was asked for.
        name: String,
        /// What there is.
        hint: String,
    },
    /// A parameter that the effect does not have.
    #[error("{effect} has no parameter {name:?}\nhint: {hint}")]
    UnknownParameter {
        /// The effect.
        effect: &'static str,
        /// What was asked for.
        name: String,
        /// What there is.
        hint: String,
    },
    /// A range that cannot be.
    #[error("{effect}.{parameter} from {low} to {high}\nhint: give two numbers in order, from {} to {}", bounds[0], bounds[1])]
    Range {
        /// The effect.
        effect: &'static str,
        /// Its parameter.
        parameter: &'static str,
        /// Lower end given.
        low: f64,
        /// Upper end given.
        high: f64,
        /// What the parameter can be.
        bounds: [f64; 2],
    },
    /// A setting that cannot be.
    #[error("{effect}.{parameter} is {found}\nhint: give a number from {} to {}", bounds[0], bounds[1])]
    Setting {
        /// The effect.
        effect: &'static str,
        /// Its parameter.
        parameter: &'static str,
        /// The value given.
        found: f64,
        /// What the parameter can be.
        bounds: [f64; 2],
    },
    /// A level that is none.
    #[error("the level is {0}\nhint: give a number from 0 (nothing is changed) to 1 (the whole of the ranges)")]
    Level(f64),
}
