//! Elementary functions of sums, products and quotients alone, so that they give the same bits on every machine: those of
//! the platform's own library differ in the last place. Settings are drawn with them; no pixel is.

use std::f64::consts::{FRAC_PI_2, LN_2};

/// `2^x` for `|x|` up to 1,000, to some 1e-15 of its value.
pub(super) fn exp2(x: f64) -> f64 {
    let whole = (x + 0.5).floor();
    // A number of 1,000 at most, and a power of two that is put together from its exponent.
    let power = f64::from_bits(((whole as i64 + 1_023) as u64) << 52);
    power * exp_of_small((x - whole) * LN_2)
}

/// `e^-x` for `x` from 0 to some 700.
pub(super) fn exp_minus(x: f64) -> f64 {
    exp2(-x / LN_2)
}

/// Taylor's series; at `|x|` of 0.35 and less its 15th term is below 1e-18.
fn exp_of_small(x: f64) -> f64 {
    (1..16).rev().fold(1.0, |sum, n| 1.0 + sum * x / f64::from(n))
}

/// Sine and cosine of an angle of some turns at most [rad], to some 1e-15.
pub(super) fn sin_cos(angle: f64) -> (f64, f64) {
    let quarter = (angle / FRAC_PI_2 + 0.5).floor();
    let x = angle - quarter * FRAC_PI_2;
    let square = x * x;
    // Taylor's series; at 45 degrees and less their last terms are below 1e-17.
    let sine = x * (1..9).rev().fold(1.0, |sum, n| 1.0 - sum * square / f64::from(2 * n * (2 * n + 1)));
    let cosine = (1..9).rev().fold(1.0, |sum, n| 1.0 - sum * square / f64::from(2 * n * (2 * n - 1)));
    match (quarter as i64).rem_euclid(4) {
        0 => (sine, cosine),
        1 => (cosine, -sine),
        2 => (-sine, -cosine),
        _ => (-cosine, sine),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn they_agree_with_the_library() {
        for step in -4_000..4_000 {
            let x = f64::from(step) / 400.0;
            assert!((exp2(x) / x.exp2() - 1.0).abs() < 4e-15, "2^{x}");
            let (sine, cosine) = sin_cos(x);
            assert!((sine - x.sin()).abs() < 3e-15 && (cosine - x.cos()).abs() < 3e-15, "{x} rad");
            assert!((exp_minus(x.abs()) / (-x.abs()).exp() - 1.0).abs() < 1e-14, "e^-{x}");
        }
        assert_eq!(exp2(0.0), 1.0);
        assert_eq!(exp2(3.0), 8.0);
        assert_eq!(sin_cos(0.0), (0.0, 1.0));
    }
}
