//! Cutting off and rounding, made of instructions that every processor has for many numbers at once.

/// The upper of two numbers: unlike `max`, which asks for what is no number, it is one instruction.
#[inline(always)]
pub(super) fn upper(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// The lower of two numbers.
#[inline(always)]
pub(super) fn lower(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// Added to a number of up to 2^22 it leaves no room for a fraction.
const ROUNDING: f32 = 12_582_912.0;

/// The largest whole number that is not above `x`, which is from 0 to 2^22.
#[inline(always)]
pub(super) fn whole_part(x: f32) -> f32 {
    let nearest = x + ROUNDING - ROUNDING;
    if nearest > x { nearest - 1.0 } else { nearest }
}

/// The integer nearest to a number from 0 to 2^22, of two the even one.
#[inline(always)]
pub(super) fn nearest(x: f32) -> u32 {
    (x + ROUNDING).to_bits() - ROUNDING.to_bits()
}

/// The byte nearest to a number, halves to the even one.
#[inline(always)]
pub(super) fn nearest_byte(x: f32) -> u8 {
    // Cut off when it is rounded already: then the bits are those of a byte, without a further step.
    lower(upper(x + ROUNDING, ROUNDING), ROUNDING + 255.0).to_bits() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_parts_are_those_of_floor() {
        for step in 0..400_000_u32 {
            let x = step as f32 / 20.0;
            assert_eq!(whole_part(x), x.floor(), "{x}");
            assert_eq!(nearest(whole_part(x)), x as u32);
            assert_eq!(nearest(x), x.round_ties_even() as u32);
        }
    }
}
