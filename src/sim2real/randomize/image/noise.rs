//! Noise of the sensor.

use super::draw::Uniform;
use super::effect::{Effect, EffectParameter};
use super::error::ImageError;
use super::gaussian::Normal;
use super::line::{LANES, Line};
use super::rounding::upper;
use super::settings::Setting;

/// `x -> x + sqrt(read^2 + shot^2 max(x, 0)) n`, `n` normal, independent from pixel to pixel and channel to channel.
///
/// `shot` stands for the photons, whose count has its mean for variance: `1 / shot^2` of them make white. Their number is
/// taken for normal, not Poisson, which from 30 photons on is the same; the draws are quantiles of which there are 4,096.
/// Of the image alone depends which draws there are: a value's noise is the same whatever else is changed.
///
/// Source: Foi, Trimeche, Katkovnik & Egiazarian, "Practical Poissonian-Gaussian noise modeling and fitting for single-image
/// raw-data", IEEE Transactions on Image Processing 17 (2008).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Standard deviation in the dark, part of the way from black to white; 0 does nothing.
    pub read: f32,
    /// Standard deviation that the photons of white alone have, part of the way from black to white; 0 does nothing.
    pub shot: f32,
}

const fn deviation(name: &'static str, plausible: f64) -> EffectParameter {
    EffectParameter { name, unit: "1", identity: 0.0, plausible: [0.0, plausible], bounds: [0.0, 1.0] }
}

pub(super) static EFFECT: Effect = Effect {
    name: "noise",
    title: "noise of the sensor: of reading it, and of the photons",
    law: "x -> x + sqrt(read^2 + shot^2 max(x, 0)) n, n normal",
    source: "Foi, Trimeche, Katkovnik & Egiazarian, IEEE TIP 17 (2008)",
    parameters: &[deviation("read", 0.02), deviation("shot", 0.04)],
};

impl Setting for Noise {
    const NONE: Self = Self { read: 0.0, shot: 0.0 };
    const EFFECT: &'static Effect = &EFFECT;

    fn drawn(uniform: &mut Uniform<'_>) -> Self {
        Self { read: uniform.number(0), shot: uniform.number(1) }
    }

    fn check(&self) -> Result<(), ImageError> {
        EFFECT.check(&[self.read, self.shot])
    }
}

impl Noise {
    /// Made ready for an image with this key, whose white is `full`.
    pub(super) fn ready(self, key: u64, full: f32) -> Noisy {
        let (dark, of_light) = (self.read * self.read * full * full, self.shot * self.shot * full);
        Noisy { dark, of_light, normal: Normal::new(key) }
    }
}

/// A [`Noise`] as pixels go through it.
#[derive(Clone, Copy)]
pub(super) struct Noisy {
    /// Variance in the dark.
    dark: f32,
    /// Variance by light.
    of_light: f32,
    normal: Normal,
}

impl Noisy {
    /// What becomes of a row of `C` channels, of which the first pixel has the number `first`; alpha stays what it is.
    #[inline(always)]
    pub fn apply<const C: usize>(&self, line: &mut Line, first: u64) {
        let [red, green, blue, _] = line.channels_mut().map(|channel| channel.as_chunks_mut::<LANES>().0);
        for (((red, green), blue), first) in red.iter_mut().zip(green).zip(blue).zip((first..).step_by(LANES)) {
            // Roots take their time, in which the processor draws.
            for (place, draws) in [red, green, blue].into_iter().zip(self.normal.draw(first)).take(C) {
                for (value, draw) in place.iter_mut().zip(draws) {
                    *value += (self.dark + self.of_light * upper(*value, 0.0)).sqrt() * draw;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Settings;
    use super::super::settings::tests::applied;
    use super::*;

    const SIDE: usize = 300;
    const COUNT: f64 = (SIDE * SIDE * 3) as f64;

    fn noise_of(noise: Noise, grey: f32, key: u64) -> Vec<f64> {
        let image = vec![grey; SIDE * SIDE * 3];
        let noisy = applied(Settings { noise, key, ..Settings::NONE }, &image, [SIDE, SIDE, 3]);
        noisy.iter().map(|value| f64::from(*value) - f64::from(grey)).collect()
    }

    fn mean_of_products(a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>() / a.len().min(b.len()) as f64
    }

    #[test]
    fn mean_variance_and_shape_are_those_of_the_law() {
        // sqrt(0.03^2 + 0.08^2 * 0.25) = 0.05.
        for (noise, grey, std) in [
            (Noise { read: 0.03, shot: 0.0 }, 0.5, 0.03),
            (Noise { read: 0.0, shot: 0.08 }, 0.25, 0.04),
            (Noise { read: 0.03, shot: 0.08 }, 0.25, 0.05),
        ] {
            let found = noise_of(noise, grey, 11);
            let mean = found.iter().sum::<f64>() / COUNT;
            assert!(mean.abs() < 4.5 * std / COUNT.sqrt(), "{noise:?}: {mean}");
            let variance = mean_of_products(&found, &found) / (std * std);
            assert!((variance - 1.0).abs() < 4.5 * (2.0 / COUNT).sqrt(), "{noise:?}: {variance}");
            let third = found.iter().map(|n| (n / std).powi(3)).sum::<f64>() / COUNT;
            assert!(third.abs() < 4.5 * (15.0 / COUNT).sqrt(), "{third}");
            let fourth = found.iter().map(|n| (n / std).powi(4)).sum::<f64>() / COUNT;
            assert!((fourth - 2.99).abs() < 4.5 * (96.0 / COUNT).sqrt(), "{fourth}");
        }
    }

    /// The largest distance from the normal distribution function is what chance makes it (Kolmogorov and Smirnov).
    #[test]
    fn draws_are_distributed_normally() {
        let mut found = noise_of(Noise { read: 0.05, shot: 0.0 }, 0.5, 5);
        found.sort_by(f64::total_cmp);
        let below = |x: f64| 0.5 * statrs::function::erf::erfc(-x / std::f64::consts::SQRT_2);
        let distance =
            found.iter().enumerate().map(|(at, n)| (below(n / 0.05) - at as f64 / COUNT).abs()).fold(0.0, f64::max);
        assert!(distance < 1.95 / COUNT.sqrt() + 0.5 / 4_096.0, "{distance}");
    }

    #[test]
    fn noise_is_independent_of_its_neighbours_channels_and_keys() {
        let noise = Noise { read: 0.03, shot: 0.0 };
        let found = noise_of(noise, 0.5, 11);
        let limit = 4.5 * 0.03 * 0.03 / COUNT.sqrt();
        let row = 3 * SIDE;
        // To the other channels, the pixel beside, the row below, and farther.
        for lag in [1, 2, 3, 4, 6, 9, row, row - 3, row + 3, 2 * row, 7, 3 * 64, 3 * 1_024] {
            let product = mean_of_products(&found, &found[lag..]);
            assert!(product.abs() < 1.1 * limit, "lag {lag}: {product}");
        }
        for key in [0, 1, 10, 12, 11 ^ 1 << 63, u64::MAX] {
            let product = mean_of_products(&found, &noise_of(noise, 0.5, key));
            assert!(product.abs() < limit, "key {key}: {product}");
        }
        // Nor do the squares go together.
        let squares: Vec<f64> = found.iter().map(|n| (n / 0.03).powi(2) - 1.0).collect();
        for lag in [1, 2, 3, row] {
            let product = mean_of_products(&squares, &squares[lag..]);
            assert!(product.abs() < 4.5 * 2.0 / COUNT.sqrt(), "lag {lag}: {product}");
        }
    }

    #[test]
    fn bytes_get_the_same_noise_as_floats() {
        let bytes: Vec<u8> = (0..30 * 30 * 3).map(|at| (at % 256) as u8).collect();
        let floats: Vec<f32> = bytes.iter().map(|byte| f32::from(*byte) / 255.0).collect();
        let settings = Settings { noise: Noise { read: 0.02, shot: 0.05 }, key: 3, ..Settings::NONE };
        for (byte, float) in applied(settings, &bytes, [30, 30, 3]).iter().zip(applied(settings, &floats, [30, 30, 3])) {
            assert!((f32::from(*byte) - 255.0 * float).abs() <= 0.501, "{byte} {float}");
        }
    }

    #[test]
    fn alpha_has_none() {
        let settings = Settings { noise: Noise { read: 0.5, shot: 0.5 }, ..Settings::NONE };
        let out = applied(settings, &[9_u8; 64 * 4], [8, 8, 4]);
        assert!(out.iter().skip(3).step_by(4).all(|alpha| *alpha == 9));
        assert!(out.iter().any(|value| *value != 9));
    }
}
