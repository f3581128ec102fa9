//! Images of a training run, each with its own settings.

use rayon::prelude::*;

use super::error::ImageError;
use super::ranges::{ImageIndex, Ranges, Streams};
use super::render::Scratch;
use super::settings::Settings;
use super::view::{ImageMut, ImageView, Value, check_values};
use crate::sim2real::Seed;

/// Room for images under way, a piece a thread; once it has grown to the size of the images, none is allocated any more.
#[derive(Debug, Default)]
pub struct Workspace {
    scratch: Vec<Scratch>,
}

impl Workspace {
    /// Empty.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    fn of(&mut self, threads: usize) -> &mut [Scratch] {
        if self.scratch.len() < threads {
            self.scratch.resize_with(threads, Scratch::default);
        }
        &mut self.scratch[..threads]
    }
}

impl Settings {
    /// Changes `image`, or all images of a batch in the same way, to the same noise.
    ///
    /// # Errors
    /// A setting or a value that cannot be; the image is then as it was.
    pub fn apply<V: Value>(&self, image: ImageMut<'_, V>, workspace: &mut Workspace) -> Result<(), ImageError> {
        self.check()?;
        check_values(&image.view())?;
        let [scratch] = workspace.of(1) else { return Ok(()) };
        for values in image.values.chunks_exact_mut(image.shape.values()) {
            scratch.render(self, None, values, image.shape);
        }
        Ok(())
    }
}

/// Draws the settings of images from [`Ranges`] and applies them.
///
/// # Contract
/// The same seed, ranges and [`ImageIndex`] make the same image of the same image to the last bit: in a batch of any size, on
/// any number of threads, whatever was done before. Sums, products, square roots and tables are all that pixels go through,
/// never fused, and no function of the platform's library, so that the bits are those of any machine that keeps to IEEE 754.
#[derive(Debug, Clone)]
pub struct ImageRandomizer {
    ranges: Ranges,
    streams: Streams,
}

impl ImageRandomizer {
    /// Settings drawn from `ranges` by the streams of `seed`: `image.blur` and so on, and `image.pixels`.
    #[must_use]
    pub fn new(ranges: Ranges, seed: Seed) -> Self {
        Self { ranges, streams: Streams::new(seed) }
    }

    /// What settings are drawn from.
    #[must_use]
    pub fn ranges(&self) -> &Ranges {
        &self.ranges
    }

    /// The settings of an image, as they are applied to it.
    #[must_use]
    pub fn settings(&self, index: ImageIndex) -> Settings {
        self.ranges.draw(&mut self.streams.clone(), index)
    }

    /// Changes the images of a batch, of which `indices` has one each.
    ///
    /// # Errors
    /// As many indices as images are needed, and float values from 0 to 1. All images are then as they were.
    pub fn apply<V: Value>(
        &self,
        batch: ImageMut<'_, V>,
        indices: &[ImageIndex],
        workspace: &mut Workspace,
    ) -> Result<(), ImageError> {
        check_values(&batch.view())?;
        self.render(None, batch, indices, workspace)
    }

    /// Writes the images of `source` into `target`, changed.
    ///
    /// # Errors
    /// As of [`ImageRandomizer::apply`]; and a target of another shape. The target is then as it was.
    pub fn apply_into<V: Value>(
        &self,
        source: ImageView<'_, V>,
        target: ImageMut<'_, V>,
        indices: &[ImageIndex],
        workspace: &mut Workspace,
    ) -> Result<(), ImageError> {
        if (source.shape, source.images) != (target.shape, target.images) {
            return Err(ImageError::Shapes {
                source_shape: source.shape,
                source_images: source.images,
                target_shape: target.shape,
                target_images: target.images,
            });
        }
        check_values(&source)?;
        self.render(Some(source.values), target, indices, workspace)
    }

    fn render<V: Value>(
        &self,
        source: Option<&[V]>,
        target: ImageMut<'_, V>,
        indices: &[ImageIndex],
        workspace: &mut Workspace,
    ) -> Result<(), ImageError> {
        let (images, shape) = (target.images, target.shape);
        if images != indices.len() {
            return Err(ImageError::Indices { images, indices: indices.len() });
        }
        let threads = rayon::current_num_threads().min(images).max(1);
        let each = images.div_ceil(threads).max(1);
        let size = shape.values();
        let parts = target.values.par_chunks_mut(each * size).enumerate().zip(indices.par_chunks(each));
        parts.zip(workspace.of(threads)).for_each(|(((part, targets), indices), scratch)| {
            let mut streams = self.streams.clone();
            for ((image, target), index) in (part * each..).zip(targets.chunks_exact_mut(size)).zip(indices) {
                let settings = self.ranges.draw(&mut streams, *index);
                let source = source.map(|values| &values[image * size..(image + 1) * size]);
                scratch.render(&settings, source, target, shape);
            }
        });
        Ok(())
    }
}
