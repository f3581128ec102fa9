//! The effects that act on a pixel's colour alone, as one step: a 3 x 3 matrix and an offset.

use super::line::Line;

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
        Colour {
            matrix: self.matrix.map(|row| row.map(|value| value as f32)),
            offset: self.offset.map(|value| value as f32 * full),
        }
    }
}

/// A [`ColourMap`] as pixels go through it.
#[derive(Clone, Copy)]
pub(super) struct Colour {
    matrix: [[f32; 3]; 3],
    offset: [f32; 3],
}

impl Colour {
    /// What becomes of a row of `C` channels; alpha stays what it is.
    #[inline(always)]
    pub fn apply<const C: usize>(&self, line: &mut Line) {
        let Self { matrix, offset } = *self;
        let [red, green, blue, _] = line.channels_mut();
        if C == 1 {
            for grey in red {
                *grey = matrix[0][0] * *grey + offset[0];
            }
            return;
        }
        for ((red, green), blue) in red.iter_mut().zip(green).zip(blue) {
            let mix = |row: usize| {
                let [r, g, b] = matrix[row];
                r * *red + g * *green + (b * *blue + offset[row])
            };
            (*red, *green, *blue) = (mix(0), mix(1), mix(2));
        }
    }
}
