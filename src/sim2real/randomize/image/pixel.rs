//! A pixel as it is reckoned with, and rows of them from and to a buffer.

use wide::f32x4;

use super::view::Value;

/// Red, green, blue and alpha, from 0 to [`Value::FULL`](super::view::sealed::Value::FULL); a grey pixel has the first alone.
///
/// Four numbers are what the vector instructions of any 64-bit processor take at once. Each is reckoned with as an `f32`
/// alone would be.
pub(super) type Pixel = f32x4;

/// A pixel of four numbers.
#[inline]
pub(super) fn pixel(numbers: [f32; 4]) -> Pixel {
    f32x4::from(numbers)
}

/// The way from `a` to `b` by `part`: `a` itself at 0, and wherever both are the same.
#[inline]
pub(super) fn between(a: Pixel, b: Pixel, part: Pixel) -> Pixel {
    a + part * (b - a)
}

/// Pixels that are read and written together.
const TOGETHER: usize = 4;

/// Reads a row of `C` channels. Numbers beyond the channels may be those of the next pixel: nothing looks at them.
#[inline]
pub(super) fn load<V: Value, const C: usize>(row: &[V], line: &mut [Pixel]) {
    for (block, places) in line.chunks_mut(TOGETHER).enumerate() {
        let values = &row[block * TOGETHER * C..];
        match (values.get(..(TOGETHER - 1) * C + 4), places.as_chunks_mut::<TOGETHER>()) {
            // Four values at once are one instruction.
            (Some(values), ([places], _)) => {
                for (k, place) in places.iter_mut().enumerate() {
                    let start = k * C;
                    *place = pixel([start, start + 1, start + 2, start + 3].map(|at| values[at].number()));
                }
            }
            // The last pixels of a row have fewer.
            _ => {
                for (values, place) in values.as_chunks::<C>().0.iter().zip(places) {
                    let mut numbers = [0.0; 4];
                    numbers.iter_mut().zip(values).for_each(|(number, value)| *number = value.number());
                    *place = pixel(numbers);
                }
            }
        }
    }
}

/// Writes a row of `C` channels, cut off and rounded as the values need it.
#[inline]
pub(super) fn store<V: Value, const C: usize>(line: &[Pixel], row: &mut [V]) {
    for (block, pixels) in line.chunks(TOGETHER).enumerate() {
        let mut four = [Pixel::ZERO; TOGETHER];
        four[..pixels.len()].copy_from_slice(pixels);
        let nearest = V::nearest(&four);
        let values = &mut row[block * TOGETHER * C..];
        match values.get_mut(..(TOGETHER - 1) * C + 4) {
            Some(values) if pixels.len() == TOGETHER => {
                for (k, nearest) in nearest.iter().enumerate() {
                    // What is written beyond the pixel's own values is written over with the next one.
                    values[k * C..k * C + 4].copy_from_slice(nearest);
                }
            }
            _ => {
                for (values, nearest) in values.as_chunks_mut::<C>().0.iter_mut().zip(&nearest[..pixels.len()]) {
                    values.copy_from_slice(&nearest[..C]);
                }
            }
        }
    }
}
