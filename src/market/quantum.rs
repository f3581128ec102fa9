//! The number of which all quantities are multiples.

/// A quantity that is further from a whole number of units is none, in units.
const WHOLE: f64 = 1e-6;

/// The largest number of which all `quantities` are multiples, where they are of `unit`; none where they are not, where there is
/// none but 0, or where it is `unit` itself, which says nothing.
pub(super) fn quantum(quantities: impl IntoIterator<Item = f64>, unit: f64) -> Option<f64> {
    let mut divisor = 0;
    for quantity in quantities {
        let units = quantity / unit;
        let whole = units.round();
        // Beyond 2^53 a double counts no single units.
        if !(0.0..9e15).contains(&whole) || (units - whole).abs() > WHOLE * whole.max(1.0) {
            return None;
        }
        divisor = common(divisor, whole as u64);
    }
    (divisor > 1).then_some(divisor as f64 * unit)
}

/// The greatest common divisor, by Euclid.
fn common(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { common(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_greatest_common_divisor() {
        assert_eq!(quantum([300.0, 0.0, 450.0, 75.0], 1.0), Some(75.0));
        assert_eq!(quantum([300.0, 451.0], 1.0), None);
        assert_eq!(quantum([0.0, 0.0], 1.0), None);
        assert_eq!(quantum([], 1.0), None);
    }

    #[test]
    fn units_need_not_be_whole_and_what_is_of_other_units_has_none() {
        let found = quantum([0.03, 0.12, 0.3], 0.001);
        assert!(found.is_some_and(|step| (step - 0.03).abs() < 1e-12), "{found:?}");
        assert_eq!(quantum([0.03, 0.1255], 0.001), None);
        assert_eq!(quantum([f64::NAN], 1.0), None);
        assert_eq!(quantum([-5.0], 1.0), None);
        assert_eq!(quantum([5.0], 0.0), None);
    }
}
