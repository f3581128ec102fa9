//! An image before the camera's geometry has acted on it, with a margin of one pixel all round.

use super::lens::Border;
use super::pixel::{Pixel, load, pixel};
use super::view::{Shape, Value};

/// Rows of pixels, `width + 2` each, `height + 2` in all.
#[derive(Debug, Default)]
pub(super) struct Scene {
    pixels: Vec<Pixel>,
    width: usize,
    height: usize,
}

impl Scene {
    /// Takes an image of `C` channels; the margin is left as it was.
    #[inline(always)]
    pub fn take<V: Value, const C: usize>(&mut self, values: &[V], shape: Shape) {
        (self.width, self.height) = (shape.width, shape.height);
        self.pixels.resize((self.width + 2) * (self.height + 2), Pixel::ZERO);
        let width = self.width;
        for (row, values) in self.rows_mut().zip(values.chunks_exact(width * C)) {
            load::<V, C>(values, &mut row[1..=width]);
        }
    }

    /// Pixels from one row to the next.
    pub fn stride(&self) -> usize {
        self.width + 2
    }

    /// Rows without the margin.
    pub fn height(&self) -> usize {
        self.height
    }

    /// All pixels, margin and all.
    pub fn pixels(&self) -> &[Pixel] {
        &self.pixels
    }

    /// Row `y` without its margin.
    pub fn row(&self, y: usize) -> &[Pixel] {
        let start = (y + 1) * self.stride() + 1;
        &self.pixels[start..start + self.width]
    }

    /// Row `y` of the image moved by whole pixels, `x` to the right and `down` downwards, the margin again and again beyond it.
    #[inline(always)]
    pub fn moved_row(&self, y: usize, [x, down]: [i64; 2], line: &mut [Pixel]) {
        let (width, height) = (self.width as i64, self.height as i64);
        let from = (y as i64 - down).clamp(-1, height) + 1;
        let row = &self.pixels[from as usize * self.stride()..][..self.stride()];
        let (start, end) = (x.clamp(0, width) as usize, (width + x).clamp(0, width) as usize);
        line[..start].fill(row[0]);
        line[end..].fill(row[row.len() - 1]);
        let first = (-x).clamp(0, width) as usize + 1;
        line[start..end].copy_from_slice(&row[first..first + end - start]);
    }

    /// The rows of the image from the top, each with its margin at both ends.
    #[inline(always)]
    pub fn rows_mut(&mut self) -> impl Iterator<Item = &mut [Pixel]> {
        let (stride, height) = (self.stride(), self.height);
        self.pixels.chunks_exact_mut(stride).skip(1).take(height)
    }

    /// Row `y` with its margin, counted from the margin above the image.
    #[inline(always)]
    pub fn row_and_margin(&mut self, y: usize) -> &mut [Pixel] {
        let stride = self.stride();
        &mut self.pixels[y * stride..(y + 1) * stride]
    }

    /// Makes the margin as the edge beside it.
    pub fn repeat_edges(&mut self) {
        let (width, stride, height) = (self.width, self.stride(), self.height);
        for row in self.rows_mut() {
            row[0] = row[1];
            row[width + 1] = row[width];
        }
        self.pixels.copy_within(stride..2 * stride, 0);
        self.pixels.copy_within(height * stride..(height + 1) * stride, (height + 1) * stride);
    }

    /// Makes the margin what lies beyond the edge.
    pub fn surround(&mut self, border: Border, full: f32) {
        self.repeat_edges();
        if let Border::Constant(value) = border {
            let beyond = pixel([value * full, value * full, value * full, 0.0]);
            let (stride, last) = (self.stride(), self.pixels.len() - self.stride());
            self.pixels[..stride].fill(beyond);
            self.pixels[last..].fill(beyond);
            for row in self.rows_mut() {
                row[0] = beyond;
                row[stride - 1] = beyond;
            }
        }
    }
}
