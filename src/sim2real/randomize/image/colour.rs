//! The effects that act on a pixel's colour alone, as one step: a 3 x 3 matrix and an offset.

use super::pixel::{Pixel, pixel};

/// `x -> matrix x + offset`, with `x` from 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ColourMap {
    pub matrix: [[f64; 3]; 3],
    pub offset: [f64; 3],
}

impl ColourMap {
    pub const IDENTITY: Self = Self { matrix: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], offset: [0.0; 3] };

    /// This, and then a gain of each channel and an offset of all.
    pub fn then_scale(&mut self, gain: [f64; 3], offset: f64) {
        for ((row, own), gain) in self.matrix.iter_mut().zip(&mut self.offset).zip(gain) {
            row.iter_mut().for_each(|value| *value *= gain);
            *own = *own * gain + offset;
        }
    }

    /// This, and then a mix of the channels.
    pub fn then_mix(&mut self, mix: [[f64; 3]; 3]) {
        let product = |row: [f64; 3], column: [f64; 3]| row[0] * column[0] + row[1] * column[1] + row[2] * column[2];
        let columns = [0, 1, 2].map(|j| self.matrix.map(|row| row[j]));
        self.matrix = mix.map(|row| columns.map(|column| product(row, column)));
        self.offset = mix.map(|row| product(row, self.offset));
    }

    /// Made ready for pixels whose white is `full`.
    pub fn ready(&self, full: f32) -> Colour {
        let columns = [0, 1, 2].map(|j| self.matrix.map(|row| row[j] as f32));
        let [red, green, blue] = columns.map(|[r, g, b]| pixel([r, g, b, 0.0]));
        let [r, g, b] = self.offset.map(|value| value as f32 * full);
        Colour { red, green, blue, offset: pixel([r, g, b, 0.0]) }
    }
}

/// A [`ColourMap`] as pixels go through it.
#[derive(Clone, Copy)]
pub(super) struct Colour {
    red: Pixel,
    green: Pixel,
    blue: Pixel,
    offset: Pixel,
}

impl Colour {
    /// What becomes of a pixel; its alpha stays what it is.
    #[inline(always)]
    pub fn apply<const C: usize>(&self, place: Pixel) -> Pixel {
        let [r, g, b, _] = place.to_array();
        let light = self.red * Pixel::splat(r) + self.green * Pixel::splat(g) + (self.blue * Pixel::splat(b) + self.offset);
        // Where there is no alpha nothing looks at it.
        if C == 4 { light + pixel([0.0, 0.0, 0.0, 1.0]) * place } else { light }
    }
}
