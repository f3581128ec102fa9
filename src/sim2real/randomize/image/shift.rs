//! Shift: a camera that is not quite where it was.

use super::draw::Uniform;
use super::effect::{Effect, EffectParameter};
use super::error::ImageError;
use super::settings::Setting;

/// The image moves by whole pixels, `x` to the right and `y` down; what comes into sight is as the lens's border says.
/// Drawn uniformly from `-4` to `4` with the border repeated, it is the shift of `DrQ`, which pads by 4 pixels and crops.
///
/// Source: Yarats, Kostrikov & Fergus, "Image augmentation is all you need: regularizing deep reinforcement learning from
/// pixels", ICLR (2021).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shift {
    /// To the right [px]; 0 does nothing. Fractions are taken between pixels.
    pub x: f32,
    /// Down [px]; 0 does nothing.
    pub y: f32,
}

const fn way(name: &'static str) -> EffectParameter {
    EffectParameter { name, unit: "px", identity: 0.0, plausible: [-4.0, 4.0], bounds: [-1_024.0, 1_024.0] }
}

pub(super) static EFFECT: Effect = Effect {
    name: "shift",
    title: "image shifted by whole pixels",
    law: "the pixel at (column, row) shows what was at (column - x, row - y)",
    source: "Yarats, Kostrikov & Fergus, ICLR (2021)",
    parameters: &[way("x"), way("y")],
};

impl Setting for Shift {
    const NONE: Self = Self { x: 0.0, y: 0.0 };
    const EFFECT: &'static Effect = &EFFECT;

    fn drawn(uniform: &mut Uniform<'_>) -> Self {
        Self { x: uniform.whole(0) as f32, y: uniform.whole(1) as f32 }
    }

    fn check(&self) -> Result<(), ImageError> {
        EFFECT.check(&[self.x, self.y])
    }
}

impl Shift {
    /// The same in whole pixels, if it is.
    pub(super) fn whole(self) -> Option<[i64; 2]> {
        let [x, y] = [self.x as i64, self.y as i64];
        (x as f32 == self.x && y as f32 == self.y).then_some([x, y])
    }
}

#[cfg(test)]
mod tests {
    use super::super::settings::tests::applied;
    use super::super::{Border, Lens, Settings};
    use super::*;

    fn shifted(x: f32, y: f32) -> Settings {
        Settings { shift: Shift { x, y }, ..Settings::NONE }
    }

    /// 1 2 3
    /// 4 5 6
    const IMAGE: [u8; 6] = [1, 2, 3, 4, 5, 6];

    #[test]
    fn whole_pixels_move_exactly_and_edges_repeat() {
        assert_eq!(applied(shifted(1.0, 0.0), &IMAGE, [2, 3, 1]), [1, 1, 2, 4, 4, 5]);
        assert_eq!(applied(shifted(-1.0, 0.0), &IMAGE, [2, 3, 1]), [2, 3, 3, 5, 6, 6]);
        assert_eq!(applied(shifted(0.0, 1.0), &IMAGE, [2, 3, 1]), [1, 2, 3, 1, 2, 3]);
        assert_eq!(applied(shifted(1.0, -1.0), &IMAGE, [2, 3, 1]), [4, 4, 5, 4, 4, 5]);
        // Farther than the image is wide.
        assert_eq!(applied(shifted(7.0, 0.0), &IMAGE, [2, 3, 1]), [1, 1, 1, 4, 4, 4]);
        assert_eq!(applied(shifted(-900.0, 900.0), &IMAGE, [2, 3, 1]), [3; 6]);
    }

    #[test]
    fn beyond_the_edge_there_may_be_a_constant() {
        let constant = |x, y| Settings { border: Border::Constant(0.2), ..shifted(x, y) };
        assert_eq!(applied(constant(2.0, 0.0), &IMAGE, [2, 3, 1]), [51, 51, 1, 51, 51, 4]);
        assert_eq!(applied(constant(0.0, -1.0), &IMAGE, [2, 3, 1]), [4, 5, 6, 51, 51, 51]);
        assert_eq!(applied(constant(900.0, 900.0), &IMAGE, [2, 3, 1]), [51; 6]);
    }

    #[test]
    fn fractions_are_taken_between_pixels() {
        // Half a pixel to the right: each is the mean of itself and its left neighbour.
        let image = [10_u8, 20, 40, 80];
        assert_eq!(applied(shifted(0.5, 0.0), &image, [1, 4, 1]), [10, 15, 30, 60]);
        assert_eq!(applied(shifted(0.0, -0.25), &image, [4, 1, 1]), [12, 25, 50, 80]);
    }

    /// A lens that hardly does anything takes the same pixels by the way of the map.
    #[test]
    fn the_map_of_lens_and_shift_agrees_with_whole_rows() {
        let image: Vec<u8> = (0..7 * 5 * 3).map(|at| (at * 37 % 251) as u8).collect();
        for (x, y) in [(0.0, 1.0), (3.0, -2.0), (-4.0, 0.0), (2.0, 9.0), (-30.0, -1.0)] {
            for border in [Border::Repeat, Border::Constant(0.4)] {
                let plain = Settings { border, ..shifted(x, y) };
                let by_map = Settings { lens: Lens { k1: 1e-12, ..Settings::NONE.lens }, ..plain };
                assert_eq!(applied(plain, &image, [7, 5, 3]), applied(by_map, &image, [7, 5, 3]), "{x}, {y}");
            }
        }
    }
}
