//! An image before the camera's geometry has acted on it, with a margin of one pixel all round.

use bytemuck::{cast_slice, cast_slice_mut};
use wide::f32x8;

use super::lens::Border;
use super::line::LANES;
use super::view::{Shape, Value};

/// Rows of pixels, `width + 2` each, `height + 2` in all, channels side by side, from 0 to
/// [`Value::FULL`](super::view::sealed::Value::FULL). Unlike pixels of four numbers they take no more memory than they need.
#[derive(Debug, Default)]
pub(super) struct Scene {
    numbers: Vec<f32x8>,
    width: usize,
    height: usize,
    stride: usize,
}

impl Scene {
    /// Makes room for an image.
    pub fn resize(&mut self, shape: Shape) {
        (self.width, self.height, self.stride) = (shape.width, shape.height, Self::stride_of(shape));
        self.numbers.resize((shape.height + 2) * self.stride / LANES + 1, f32x8::ZERO);
    }

    /// Numbers from one row of such an image to the next: a vector more at either end, of which the margin is a part, so
    /// that the image begins with a whole one.
    pub fn stride_of(Shape { width, channels, .. }: Shape) -> usize {
        2 * LANES + (width * channels).next_multiple_of(LANES)
    }

    /// Numbers from one row to the next.
    pub fn stride(&self) -> usize {
        self.stride
    }

    /// Pixels of a row without the margin.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows without the margin.
    pub fn height(&self) -> usize {
        self.height
    }

    /// All numbers, margin and all, and [`LANES`] beyond; the pixel above and left of the image begins `LANES - C` after the
    /// first.
    #[inline(always)]
    pub fn numbers(&self) -> &[f32] {
        cast_slice(&self.numbers)
    }

    /// Row `y` with what is beside it, counted from the margin above the image; its first pixel is at [`LANES`].
    #[inline(always)]
    pub fn row_and_margin(&mut self, y: usize) -> &mut [f32] {
        let stride = self.stride;
        &mut cast_slice_mut(&mut self.numbers)[y * stride..][..stride]
    }

    /// The same of row `y` and the next.
    #[inline(always)]
    pub fn two_rows(&mut self, y: usize) -> (&mut [f32], &mut [f32]) {
        let stride = self.stride;
        cast_slice_mut::<f32x8, f32>(&mut self.numbers)[y * stride..(y + 2) * stride].split_at_mut(stride)
    }

    /// Takes row `y` of an image; the margin is left as it was.
    #[inline(always)]
    pub fn take_row<V: Value, const C: usize>(&mut self, y: usize, values: &[V]) {
        let length = self.width * C;
        let row = &mut self.row_and_margin(y + 1)[LANES..][..length];
        for (number, value) in row.iter_mut().zip(&values[y * length..][..length]) {
            *number = value.number();
        }
    }

    /// Row `y` of the image moved by whole pixels, `x` to the right and `down` downwards, the margin again and again beyond it.
    #[inline(always)]
    pub fn moved_row<const C: usize>(&self, y: usize, [x, down]: [i64; 2], moved: &mut [f32]) {
        let (width, height) = (self.width as i64, self.height as i64);
        let from = (y as i64 - down).clamp(-1, height) + 1;
        let row = &self.numbers()[from as usize * self.stride + LANES - C..].as_chunks::<C>().0[..self.width + 2];
        let moved = moved.as_chunks_mut::<C>().0;
        let (start, end) = (x.clamp(0, width) as usize, (width + x).clamp(0, width) as usize);
        moved[..start].fill(row[0]);
        moved[end..].fill(row[row.len() - 1]);
        let first = (-x).clamp(0, width) as usize + 1;
        moved[start..end].copy_from_slice(&row[first..first + end - start]);
    }

    /// Makes the margin what lies beyond the edge.
    #[inline(always)]
    pub fn surround<const C: usize>(&mut self, border: Border, full: f32) {
        let (width, height, stride) = (self.width, self.height, self.stride);
        for y in 1..=height {
            let pixels = self.row_and_margin(y)[LANES - C..].as_chunks_mut::<C>().0;
            (pixels[0], pixels[width + 1]) = match border {
                Border::Repeat => (pixels[1], pixels[width]),
                Border::Constant(grey) => (beyond(grey * full), beyond(grey * full)),
            };
        }
        match border {
            Border::Repeat => {
                let numbers: &mut [f32] = cast_slice_mut(&mut self.numbers);
                numbers.copy_within(stride..2 * stride, 0);
                numbers.copy_within(height * stride..(height + 1) * stride, (height + 1) * stride);
            }
            Border::Constant(grey) => {
                self.row_and_margin(0)[LANES - C..].as_chunks_mut::<C>().0.fill(beyond(grey * full));
                self.row_and_margin(height + 1)[LANES - C..].as_chunks_mut::<C>().0.fill(beyond(grey * full));
            }
        }
    }
}

/// A grey pixel without alpha.
fn beyond<const C: usize>(grey: f32) -> [f32; C] {
    let mut pixel = [grey; C];
    pixel.iter_mut().skip(3).for_each(|alpha| *alpha = 0.0);
    pixel
}
