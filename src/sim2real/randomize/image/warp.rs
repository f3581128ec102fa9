//! Where each pixel's light comes from: lens and shift as one map, kept as long as they stay the same.

use super::lens::Lens;
use super::pixel::{Pixel, between};
use super::scene::Scene;
use super::shift::Shift;
use super::view::Shape;

/// For each pixel the one above and left of where its light comes from, and how far to the right of that and below [px].
#[derive(Debug, Default)]
pub(super) struct Warp {
    made_for: Option<(Lens, Shift, Shape)>,
    first: Vec<u32>,
    right: Vec<f32>,
    down: Vec<f32>,
    /// Columns in focal lengths from the centre.
    columns: Vec<f32>,
}

impl Warp {
    /// Makes the map, unless it is there already.
    #[inline(always)]
    pub fn prepare(&mut self, lens: Lens, shift: Shift, shape: Shape) {
        // The number of channels makes no difference, but comparing it costs nothing.
        if self.made_for == Some((lens, shift, shape)) {
            return;
        }
        self.made_for = Some((lens, shift, shape));
        let Shape { height, width, .. } = shape;
        let padded = padded(width);
        self.first.resize(height * padded, 0);
        self.right.resize(height * padded, 0.0);
        self.down.resize(height * padded, 0.0);
        self.columns.clear();
        let focal = lens.focal_length * width as f32;
        self.columns.extend((0..padded).map(|x| (x as f32 - 0.5 * (width - 1) as f32) / focal));
        // Neither needs 16 bits: processors multiply such numbers faster.
        let (stride, short) = ((width as u32 + 2) & 0x7fff, |whole| whole_bits(whole) & 0x7fff);
        let outputs = self.first.chunks_exact_mut(padded).zip(self.right.chunks_exact_mut(padded));
        for (y, ((first, right), down)) in outputs.zip(self.down.chunks_exact_mut(padded)).enumerate() {
            places(lens, shift, shape, y, &self.columns, right, down);
            let last = [width as f32, height as f32];
            for ((first, right), down) in first.iter_mut().zip(right).zip(down) {
                let (left, above) = (lower(whole_part(*right), last[0]), lower(whole_part(*down), last[1]));
                *first = short(above) * stride + short(left);
                *right -= left;
                *down -= above;
            }
        }
    }

    /// Row `y` of the image as it is seen.
    #[inline(always)]
    pub fn sample(&self, scene: &Scene, y: usize, line: &mut [Pixel]) {
        let (pixels, stride, width) = (scene.pixels(), scene.stride(), line.len());
        let row = y * padded(width)..y * padded(width) + width;
        let places = self.first[row.clone()].iter().zip(&self.right[row.clone()]).zip(&self.down[row]);
        for (pixel, ((first, right), down)) in line.iter_mut().zip(places) {
            let first = *first as usize;
            // One check of bounds instead of two.
            let block = &pixels[first..first + stride + 2];
            let (above, below) = ([block[0], block[1]], [block[stride], block[stride + 1]]);
            let (right, down) = (Pixel::splat(*right), Pixel::splat(*down));
            *pixel = between(between(above[0], above[1], right), between(below[0], below[1], right), down);
        }
    }
}

/// Places of a row that are reckoned with: with a whole number of vectors none is done by itself.
fn padded(width: usize) -> usize {
    width.next_multiple_of(8)
}

/// Where the light of row `y` comes from [px], within a margin that begins one pixel before the image.
#[inline(always)]
fn places(lens: Lens, shift: Shift, shape: Shape, y: usize, columns: &[f32], across: &mut [f32], along: &mut [f32]) {
    let focal = lens.focal_length * shape.width as f32;
    let y_from_centre = (y as f32 - 0.5 * (shape.height - 1) as f32) / focal;
    let (row, start) = ((y as f32 + 1.0) - shift.y, 1.0 - shift.x);
    let (last_x, last_y) = ((shape.width + 1) as f32, (shape.height + 1) as f32);
    for (column, ((across, along), x)) in across.iter_mut().zip(along).zip(columns).enumerate() {
        // The displacement is added to the place itself, so that without one the place is exact.
        let (by_x, by_y) = lens.displacement(*x, y_from_centre);
        *across = lower(upper(column as i32 as f32 + start + focal * by_x, 0.0), last_x);
        *along = lower(upper(row + focal * by_y, 0.0), last_y);
    }
}

/// The upper of two numbers: unlike `max`, which asks for what is no number, it is one instruction.
#[inline(always)]
fn upper(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// The lower of two numbers.
#[inline(always)]
fn lower(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// Added to a number of up to 2^22 it leaves no room for a fraction.
const ROUNDING: f32 = 12_582_912.0;

/// The largest whole number that is not above `x`, which is from 0 to 2^22. Unlike `floor` it is made of instructions that every
/// processor has for four numbers at once.
#[inline(always)]
fn whole_part(x: f32) -> f32 {
    let nearest = x + ROUNDING - ROUNDING;
    if nearest > x { nearest - 1.0 } else { nearest }
}

/// A whole number as an integer.
#[inline(always)]
fn whole_bits(whole: f32) -> u32 {
    (whole + ROUNDING).to_bits() - ROUNDING.to_bits()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_parts_are_those_of_floor() {
        for step in 0..400_000_u32 {
            let x = step as f32 / 20.0;
            assert_eq!(whole_part(x), x.floor(), "{x}");
            assert_eq!(whole_bits(whole_part(x)), x as u32);
        }
    }
}
