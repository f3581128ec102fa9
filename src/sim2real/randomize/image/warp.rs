//! Where each pixel's light comes from: lens and shift as one map, kept as long as they stay the same.

use std::ops::Range;

use bytemuck::{cast_slice, cast_slice_mut};
use wide::{f32x8, u32x8};

use super::lens::Lens;
use super::line::LANES;
use super::rounding::{lower, nearest, upper, whole_part};
use super::scene::Scene;
use super::shift::Shift;
use super::view::Shape;

/// For each pixel where the one above and left of its light's place begins in a scene, and how far to the right of that and
/// below its light comes from [px].
#[derive(Debug, Default)]
pub(super) struct Warp {
    made_for: Option<(Lens, Shift, Shape)>,
    /// Whether the image before had the same map: then it is kept, otherwise only the rows under way are, which stay in the
    /// nearest memory.
    kept: bool,
    /// Rows of a map that is kept, as far as they are made.
    made: usize,
    first: Vec<u32x8>,
    right: Vec<f32x8>,
    down: Vec<f32x8>,
    /// Columns in focal lengths from the centre.
    columns: Vec<f32x8>,
}

impl Warp {
    /// Begins with an image, of which `rows` are prepared at a time.
    #[inline(always)]
    pub fn begin(&mut self, lens: Lens, shift: Shift, shape: Shape, rows: usize) {
        let Shape { height, width, .. } = shape;
        let same = self.made_for == Some((lens, shift, shape));
        if !(same && self.kept) {
            // What is beyond the end of a row the next one overwrites, and of the last there is room for it.
            let room = (if same { height } else { rows } * width).div_ceil(LANES) + 1;
            self.first.resize(room, u32x8::ZERO);
            self.right.resize(room, f32x8::ZERO);
            self.down.resize(room, f32x8::ZERO);
            self.made = 0;
        }
        self.kept = same;
        if !same {
            self.made_for = Some((lens, shift, shape));
            self.columns.resize(width.div_ceil(LANES), f32x8::ZERO);
            let focal = lens.focal_length * width as f32;
            for (x, column) in cast_slice_mut::<f32x8, f32>(&mut self.columns).iter_mut().enumerate() {
                *column = (x as f32 - 0.5 * (width - 1) as f32) / focal;
            }
        }
    }

    /// Prepares rows to be sampled, unless they are.
    #[inline(always)]
    pub fn prepare<const C: usize>(&mut self, rows: Range<usize>, shape: Shape) {
        let Some((lens, shift, _)) = self.made_for.filter(|_| !self.kept || self.made < rows.end) else { return };
        self.made = rows.end;
        let (start, width) = (self.start(&rows, shape.width), shape.width);
        // Two short ways, one after the other: of a long one a processor has too few pixels under way.
        for (y, start) in rows.clone().zip((start..).step_by(width)) {
            let row = start..start + self.columns.len() * LANES;
            let right = &mut cast_slice_mut::<f32x8, f32>(&mut self.right)[row.clone()];
            let down = &mut cast_slice_mut::<f32x8, f32>(&mut self.down)[row];
            places(lens, shift, shape, y, cast_slice(&self.columns), right, down);
        }
        let pixels = start..start + (rows.len() * width).next_multiple_of(LANES);
        let first = &mut cast_slice_mut::<u32x8, u32>(&mut self.first)[pixels.clone()];
        let right = &mut cast_slice_mut::<f32x8, f32>(&mut self.right)[pixels.clone()];
        let down = &mut cast_slice_mut::<f32x8, f32>(&mut self.down)[pixels];
        part::<C>(shape, first, right, down);
    }

    /// Where some rows of `width` pixels begin.
    fn start(&self, rows: &Range<usize>, width: usize) -> usize {
        if self.kept { rows.start * width } else { 0 }
    }

    /// Rows that are prepared as they are seen, two pixels at a time; what is beyond their channels is anything.
    #[inline(always)]
    pub fn sample<const C: usize>(&self, scene: &Scene, rows: Range<usize>, seen: &mut Vec<Pair>) {
        let width = scene.width();
        let pairs = (rows.len() * width).div_ceil(LANES) * LANES / 2;
        seen.resize(pairs, [0.0; 8]);
        let start = self.start(&rows, width);
        let pixels = start..start + 2 * pairs;
        let first = cast_slice::<u32x8, u32>(&self.first)[pixels.clone()].as_chunks().0;
        let right = cast_slice::<f32x8, f32>(&self.right)[pixels.clone()].as_chunks().0;
        let down = cast_slice::<f32x8, f32>(&self.down)[pixels].as_chunks().0;
        // Pixels above and left of a place, and those beside, are at the same places of slices of the same length, so that one
        // check of bounds is enough. Where a compiler knows that pixels side by side overlap, it joins them in a roundabout way.
        let beside = std::hint::black_box(C);
        let (numbers, stride) = (&scene.numbers()[LANES - C..], scene.stride());
        let length = numbers.len() - stride - beside;
        let (above, above_right) = (&numbers[..length], &numbers[beside..beside + length]);
        let (below, below_right) = (&numbers[stride..stride + length], &numbers[stride + beside..stride + beside + length]);
        for (seen, ((first, right), down)) in seen.iter_mut().zip(first.iter().zip(right).zip(down)) {
            let (right, down) = (both(*right), both(*down));
            let upper = between(pair(above, *first), pair(above_right, *first), right);
            let lower = between(pair(below, *first), pair(below_right, *first), right);
            *seen = between(upper, lower, down);
        }
    }
}

/// Two pixels of four numbers each.
pub(super) type Pair = [f32; 8];

/// The pixels that begin at two places.
#[inline(always)]
fn pair(numbers: &[f32], [one, other]: [u32; 2]) -> Pair {
    let mut pair = [0.0; 8];
    pair[..4].copy_from_slice(&numbers[one as usize..one as usize + 4]);
    pair[4..].copy_from_slice(&numbers[other as usize..other as usize + 4]);
    pair
}

/// A number for each of two pixels.
#[inline(always)]
fn both([one, other]: [f32; 2]) -> Pair {
    [one, one, one, one, other, other, other, other]
}

/// The way from `a` to `b` by `part`: `a` itself at 0, and wherever both are the same.
#[inline(always)]
fn between(a: Pair, b: Pair, part: Pair) -> Pair {
    let mut between = [0.0; 8];
    for (((between, a), b), part) in between.iter_mut().zip(a).zip(b).zip(part) {
        *between = a + part * (b - a);
    }
    between
}

/// Where the light of row `y` comes from [px], within a margin that begins one pixel before the image.
#[inline(always)]
fn places(lens: Lens, shift: Shift, shape: Shape, y: usize, columns: &[f32], across: &mut [f32], along: &mut [f32]) {
    // From 32 bits they become floats in one step.
    let [y, width, height] = [y, shape.width, shape.height].map(|count| count as u32 as f32);
    let focal = lens.focal_length * width;
    let y_from_centre = (y - 0.5 * (height - 1.0)) / focal;
    let (row, start) = ((y + 1.0) - shift.y, 1.0 - shift.x);
    for (column, ((across, along), x)) in across.iter_mut().zip(along).zip(columns).enumerate() {
        // The displacement is added to the place itself, so that without one the place is exact.
        let (by_x, by_y) = lens.displacement(*x, y_from_centre);
        *across = column as i32 as f32 + start + focal * by_x;
        *along = row + focal * by_y;
    }
}

/// Parts places into the pixel above and left of each, and what is to the right of that and below.
#[inline(always)]
fn part<const C: usize>(shape: Shape, first: &mut [u32], across: &mut [f32], along: &mut [f32]) {
    let stride = Scene::stride_of(shape) as u32;
    let [width, height] = [shape.width, shape.height].map(|count| count as u32 as f32);
    for ((first, across), along) in first.iter_mut().zip(across).zip(along) {
        let x = lower(upper(*across, 0.0), width + 1.0);
        let y = lower(upper(*along, 0.0), height + 1.0);
        let (left, above) = (lower(whole_part(x), width), lower(whole_part(y), height));
        *first = nearest(above) * stride + nearest(left) * C as u32;
        *across = x - left;
        *along = y - above;
    }
}

#[cfg(test)]
mod tests {
    use super::super::{ImageMut, Lens, Settings, Shape, Shift, Workspace};

    /// The map of the second image of a kind is made anew to be kept, that of the third is there already.
    #[test]
    fn a_map_that_is_kept_is_as_one_that_is_not() {
        let lens = Lens { k1: 0.3, k2: -0.1, p1: 0.02, p2: 0.01, ..Settings::NONE.lens };
        let mut workspace = Workspace::new();
        for (height, width) in [(40, 37), (3, 5), (90, 84), (7, 600), (5, 1)] {
            let shape = Shape::new(height, width, 3).unwrap();
            let image: Vec<u8> = (0..shape.values()).map(|at| (at * 37 % 251) as u8).collect();
            for x in [0.0, -3.0] {
                let settings = Settings { lens, shift: Shift { x, y: 1.5 }, ..Settings::NONE };
                let seen = |workspace: &mut Workspace| {
                    let mut seen = image.clone();
                    settings.apply(ImageMut::new(&mut seen, shape).unwrap(), workspace).unwrap();
                    seen
                };
                let expected = seen(&mut Workspace::new());
                for _ in 0..4 {
                    assert_eq!(seen(&mut workspace), expected, "{height} x {width}");
                }
            }
        }
    }
}
