//! Blur: optics out of focus.

use bytemuck::{cast_slice, cast_slice_mut};

use super::draw::Uniform;
use super::effect::{Effect, EffectParameter};
use super::error::ImageError;
use super::pixel::Pixel;
use super::scene::Scene;
use super::settings::Setting;

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
    /// Blurs what is within the scene's margin; `lines` is room for three rows.
    #[inline(always)]
    pub(super) fn apply<const C: usize>(self, scene: &mut Scene, lines: &mut [Vec<Pixel>; 3]) {
        let weight = 0.5 * f64::from(self.std) * f64::from(self.std);
        let passes = (weight / LARGEST).ceil();
        let beside = (weight / passes) as f32;
        lines.iter_mut().for_each(|line| line.resize(scene.stride(), Pixel::ZERO));
        for _ in 0..passes as usize {
            pass::<C>(scene, lines, beside);
        }
    }
}

/// Along each row, and across it as soon as the next one is ready: an image is too large for the nearest memory, rows are not.
#[inline(always)]
fn pass<const C: usize>(scene: &mut Scene, [above, line, below]: &mut [Vec<Pixel>; 3], beside: f32) {
    along::<C>(scene.row_and_margin(1), line, beside);
    // Above the first row it is as in it, and below the last.
    above.copy_from_slice(line);
    for y in 1..=scene.height() {
        if y < scene.height() {
            along::<C>(scene.row_and_margin(y + 1), below, beside);
        } else {
            below.copy_from_slice(line);
        }
        mix::<C>(scene.row_and_margin(y), [above, line, below], beside);
        std::mem::swap(above, line);
        std::mem::swap(line, below);
    }
}

/// Blurs a row, beyond whose ends it is as at them.
#[inline(always)]
fn along<const C: usize>(row: &mut [Pixel], into: &mut [Pixel], beside: f32) {
    let last = row.len() - 1;
    (row[0], row[last]) = (row[1], row[last - 1]);
    mix::<C>(&mut into[1..last], [&row[..last - 1], &row[1..last], &row[2..]], beside);
}

/// Spreads the second row by the weight `beside` over the first and the third. It is done number by number: of such a loop compilers make
/// the widest vectors, of one over pixels they do not.
#[inline(always)]
fn mix<const C: usize>(into: &mut [Pixel], rows: [&[Pixel]; 3], beside: f32) {
    let own = 1.0 - 2.0 * beside;
    let into: &mut [f32] = cast_slice_mut(into);
    let [before, row, after] = rows.map(cast_slice::<Pixel, f32>);
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
