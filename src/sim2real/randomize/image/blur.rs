//! Blur: optics out of focus.

use bytemuck::{cast_slice, cast_slice_mut};
use wide::f32x8;

use super::draw::Uniform;
use super::effect::{Effect, EffectParameter};
use super::error::ImageError;
use super::line::LANES;
use super::scene::Scene;
use super::settings::Setting;
use super::view::Value;

/// A bell-shaped blur of the standard deviation `std`, as large across as along.
///
/// A pixel becomes `w left + (1 - 2 w) itself + w right`, then the same with those above and below, `w = std^2 / 2`. Such a
/// kernel has the variance `std^2` exactly; above a `std` of 0.707 px several of the kind follow each other, whose
/// variances add up, `w` never above 1/4. Pixels beyond the edge are as those at it. Alpha is not blurred.
///
/// Source: Lindeberg, "Scale-space for discrete signals", IEEE Transactions on Pattern Analysis and Machine Intelligence 12
/// (1990): the kernels that make no new extremum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Blur {
    /// Standard deviation [px]; 0 does nothing.
    pub std: f32,
}

pub(super) static EFFECT: Effect = Effect {
    name: "blur",
    title: "optics out of focus",
    law: "each pixel is spread over its neighbours, with the standard deviation std",
    source: "Lindeberg, IEEE TPAMI 12 (1990)",
    parameters: &[EffectParameter { name: "std", unit: "px", identity: 0.0, plausible: [0.0, 0.7], bounds: [0.0, 4.0] }],
};

/// The largest weight of a neighbour in one pass.
const LARGEST: f64 = 0.25;

impl Setting for Blur {
    const NONE: Self = Self { std: 0.0 };
    const EFFECT: &'static Effect = &EFFECT;

    fn drawn(uniform: &mut Uniform<'_>) -> Self {
        Self { std: uniform.number(0) }
    }

    fn check(&self) -> Result<(), ImageError> {
        EFFECT.check(&[self.std])
    }
}

impl Blur {
    /// Takes `values` into the scene, blurred; `lines` is room for three rows.
    #[inline(always)]
    pub(super) fn take<V: Value, const C: usize>(self, values: &[V], scene: &mut Scene, lines: &mut [Vec<f32x8>; 3]) {
        let weight = 0.5 * f64::from(self.std) * f64::from(self.std);
        let passes = (weight / LARGEST).ceil();
        let beside = (weight / passes) as f32;
        if self == Self::NONE {
            for y in 0..scene.height() {
                scene.take_row::<V, C>(y, values);
            }
        }
        let lanes = (scene.width() * C).div_ceil(LANES);
        lines.iter_mut().for_each(|line| line.resize(lanes, f32x8::ZERO));
        for at in 0..passes as usize {
            pass::<V, C>((at == 0).then_some(values), scene, lines, beside);
        }
    }
}

/// Along each row, and across the one above at the same time. A row may have to be taken from `values` before: an image is
/// too large for the nearest memory, rows are not.
#[inline(always)]
fn pass<V: Value, const C: usize>(values: Option<&[V]>, scene: &mut Scene, lines: &mut [Vec<f32x8>; 3], beside: f32) {
    let (width, height) = (scene.width(), scene.height());
    let [above, line, below] = lines;
    // A row ahead: what has only just been written cannot be read at other places without waiting.
    prepare::<V, C>(values, scene, 0);
    prepare::<V, C>(values, scene, 1);
    along::<C>(scene.row_and_margin(1), cast_slice_mut(line), beside);
    // Above the first row it is as in it, and below the last.
    above.copy_from_slice(line);
    for y in 0..height - 1 {
        prepare::<V, C>(values, scene, y + 2);
        let (into, row) = scene.two_rows(y + 1);
        let rows = [&*above, &*line].map(|line| cast_slice(line));
        both::<C>(row, cast_slice_mut(below), rows, &mut into[LANES..], beside);
        std::mem::swap(above, line);
        std::mem::swap(line, below);
    }
    let rows = [&*above, &*line, &*line].map(|line| cast_slice(line));
    mix::<C>(&mut scene.row_and_margin(height)[LANES..LANES + width * C], rows, beside);
}

/// Takes row `y` from `values`, if it has to be, and makes what is beyond its ends as they are.
#[inline(always)]
fn prepare<V: Value, const C: usize>(values: Option<&[V]>, scene: &mut Scene, y: usize) {
    if y < scene.height() {
        if let Some(values) = values {
            scene.take_row::<V, C>(y, values);
        }
        let (start, end) = (LANES, LANES + scene.width() * C);
        let row = scene.row_and_margin(y + 1);
        row.copy_within(start..start + C, start - C);
        row.copy_within(end - C..end, end);
    }
}

/// A row and what is left and right of each of its pixels.
#[inline(always)]
fn beside_each<const C: usize>(row: &[f32]) -> [&[f32]; 3] {
    [LANES - C, LANES, LANES + C].map(|start| &row[start..])
}

/// Blurs a row.
#[inline(always)]
fn along<const C: usize>(row: &[f32], into: &mut [f32], beside: f32) {
    mix::<C>(into, beside_each::<C>(row), beside);
}

/// Blurs a row into `below`, and at once the one above it, `line`, across.
#[inline(always)]
fn both<const C: usize>(row: &[f32], below: &mut [f32], [above, line]: [&[f32]; 2], into: &mut [f32], beside: f32) {
    let own = 1.0 - 2.0 * beside;
    let [before, itself, after] = beside_each::<C>(row);
    let rows = before.iter().zip(itself).zip(after).zip(above).zip(line);
    for ((below, into), ((((before, itself), after), above), line)) in below.iter_mut().zip(&mut *into).zip(rows) {
        *below = own * itself + beside * (before + after);
        *into = own * line + beside * (above + *below);
    }
    if C == 4 {
        // Alpha is not blurred.
        for (below, itself) in below.iter_mut().zip(itself).skip(3).step_by(4) {
            *below = *itself;
        }
        for (into, line) in into.iter_mut().zip(line).skip(3).step_by(4) {
            *into = *line;
        }
    }
}

/// Spreads the second row by the weight `beside` over the first and the third.
#[inline(always)]
fn mix<const C: usize>(into: &mut [f32], [before, row, after]: [&[f32]; 3], beside: f32) {
    let own = 1.0 - 2.0 * beside;
    for (((into, before), itself), after) in into.iter_mut().zip(before).zip(row).zip(after) {
        *into = own * itself + beside * (before + after);
    }
    if C == 4 {
        // Alpha is not blurred.
        for (into, row) in into.iter_mut().zip(row).skip(3).step_by(4) {
            *into = *row;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Settings;
    use super::super::settings::tests::applied;
    use super::*;

    fn blurred(std: f32) -> Settings {
        Settings { blur: Blur { std }, ..Settings::NONE }
    }

    #[test]
    fn a_dot_becomes_the_kernel() {
        // w = 0.5 / 2 = 1/4: (1/4, 1/2, 1/4) along, the same across; of 160 that is 10, 20, 40.
        let mut dot = [0_u8; 25];
        dot[12] = 160;
        let expected = [0, 0, 0, 0, 0, 0, 10, 20, 10, 0, 0, 20, 40, 20, 0, 0, 10, 20, 10, 0, 0, 0, 0, 0, 0];
        assert_eq!(applied(blurred(0.5_f32.sqrt()), &dot, [5, 5, 1]), expected);
    }

    #[test]
    fn beyond_the_edge_it_is_as_at_the_edge() {
        // A row of 160, 0: the first becomes 3/4 and the second 1/4 of 160.
        assert_eq!(applied(blurred(0.5_f32.sqrt()), &[160_u8, 0], [1, 2, 1]), [120, 40]);
        assert_eq!(applied(blurred(0.5_f32.sqrt()), &[160_u8, 0], [2, 1, 1]), [120, 40]);
        assert_eq!(applied(blurred(3.0), &[77_u8, 8, 200, 31], [1, 1, 4]), [77, 8, 200, 31]);
    }

    #[test]
    fn the_variance_is_what_it_says_in_one_pass_and_in_many() {
        for std in [0.3_f32, 0.6, 0.71, 1.3, 2.6] {
            let mut dot = vec![0.0_f32; 41 * 41];
            dot[20 * 41 + 20] = 1.0;
            let spread = applied(blurred(std), &dot, [41, 41, 1]);
            let moment = |power: i32| {
                let of = |(at, value): (usize, &f32)| f64::from(*value) * ((at % 41) as f64 - 20.0).powi(power);
                spread.iter().enumerate().map(of).sum::<f64>()
            };
            assert!((moment(0) - 1.0).abs() < 1e-4, "{std}: {}", moment(0));
            assert!((moment(2).sqrt() / f64::from(std) - 1.0).abs() < 2e-3, "{std}: {}", moment(2).sqrt());
        }
    }

    #[test]
    fn alpha_is_not_blurred() {
        let image = [160_u8, 0, 80, 9, 0, 160, 80, 200];
        assert_eq!(applied(blurred(0.5_f32.sqrt()), &image, [1, 2, 4]), [120, 40, 80, 9, 40, 120, 80, 200]);
    }
}
