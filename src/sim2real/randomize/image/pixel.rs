//! A pixel as it is reckoned with, and rows of them from and to a buffer.

use wide::f32x4;

use super::view::Value;

/// Red, green, blue and alpha, from 0 to [`Value::FULL`](super::view::sealed::Value::FULL); a grey pixel has the first alone.
///
/// Four numbers are what the vector instructions of any 64-bit processor take at once. Each is reckoned with as an `f32`
/// alone would be.
pub(super) type Pixel = f32x4;

/// A pixel of four numbers.
#[inline(always)]
pub(super) fn pixel(numbers: [f32; 4]) -> Pixel {
    f32x4::from(numbers)
}

/// The way from `a` to `b` by `part`: `a` itself at 0, and wherever both are the same.
#[inline(always)]
pub(super) fn between(a: Pixel, b: Pixel, part: Pixel) -> Pixel {
    a + part * (b - a)
}

/// Pixels that are read and written together.
const TOGETHER: usize = 4;

/// Reads a row of `C` channels. Numbers beyond the channels may be those of the next pixel: nothing looks at them.
#[inline(always)]
pub(super) fn load<V: Value, const C: usize>(row: &[V], line: &mut [Pixel]) {
    let (blocks, rest) = line.as_chunks_mut::<TOGETHER>();
    let last = blocks.len() * TOGETHER * C;
    for (values, places) in row.chunks_exact(TOGETHER * C).zip(blocks) {
        for (k, place) in places.iter_mut().enumerate() {
            // Four values at once are one instruction.
            *place = match values[k * C..].first_chunk::<4>() {
                Some([a, b, c, d]) => pixel([a.number(), b.number(), c.number(), d.number()]),
                None => one::<V, C>(&values[k * C..]),
            };
        }
    }
    for (values, place) in row[last..].as_chunks::<C>().0.iter().zip(rest) {
        *place = one::<V, C>(values);
    }
}

/// A pixel of no more than its own values.
#[inline(always)]
fn one<V: Value, const C: usize>(values: &[V]) -> Pixel {
    let mut numbers = [0.0; 4];
    numbers.iter_mut().zip(values).take(C).for_each(|(number, value)| *number = value.number());
    pixel(numbers)
}

/// Writes a row of `C` channels, cut off and rounded as the values need it.
#[inline(always)]
pub(super) fn store<V: Value, const C: usize>(line: &[Pixel], row: &mut [V]) {
    let (blocks, rest) = line.as_chunks::<TOGETHER>();
    let (values, last) = row.split_at_mut(blocks.len() * TOGETHER * C);
    for (values, pixels) in values.chunks_exact_mut(TOGETHER * C).zip(blocks) {
        for (k, nearest) in V::nearest(pixels).into_iter().enumerate() {
            let own = &mut values[k * C..];
            // What is written beyond the pixel's own values is written over with the next one.
            match own.first_chunk_mut::<4>() {
                Some(four) => *four = nearest,
                None => own.copy_from_slice(&nearest[..own.len()]),
            }
        }
    }
    for (values, pixel) in last.as_chunks_mut::<C>().0.iter_mut().zip(rest) {
        let [nearest, ..] = V::nearest(&[*pixel; TOGETHER]);
        values.copy_from_slice(&nearest[..C]);
    }
}
