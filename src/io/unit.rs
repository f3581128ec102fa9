//! Units, as they are written in documents.

/// A unit that is not the one expected.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("expected the unit `{expected}`, found `{found}`")]
pub struct UnitMismatch {
    /// The unit found.
    pub found: String,
    /// The unit expected.
    pub expected: String,
    /// How to convert, where it is known.
    pub hint: String,
}

/// What unit values are expected in, for a hint.
#[must_use]
pub fn unit_told(unit: &str) -> String {
    if unit.is_empty() { "it is a pure number".to_owned() } else { format!("its unit is [{unit}]") }
}

/// Holds a unit to be the one expected. It may be written with blanks, `*` or `·` between its factors and with `²` for
/// `^2`; `1`, `-` and nothing at all are the unit of a pure number; no claim (`None`) passes.
///
/// # Errors
/// Another unit.
pub fn check_unit(found: Option<&str>, expected: &str) -> Result<(), UnitMismatch> {
    let Some(found) = found else { return Ok(()) };
    if normal(found) == normal(expected) {
        return Ok(());
    }
    let factor = FACTORS.iter().find(|(from, to, _)| normal(from) == normal(found) && normal(to) == normal(expected));
    let hint = match factor {
        Some((from, to, factor)) => format!("convert the values first: 1 {from} = {factor} {to}"),
        None if expected.is_empty() => "this is a pure number: leave the unit out".to_owned(),
        None => format!("give the values in `{expected}`"),
    };
    Err(UnitMismatch { found: found.to_owned(), expected: expected.to_owned(), hint })
}

/// Units often met instead of the expected ones, and their conversion (exact, or to 9 digits where pi is in it).
const FACTORS: &[(&str, &str, f64)] = &[
    ("deg", "rad", 0.017_453_292_5),
    ("deg/s", "rad/s", 0.017_453_292_5),
    ("rpm", "rad/s", 0.104_719_755),
    ("mm", "m", 1e-3),
    ("cm", "m", 1e-2),
    ("mm/s", "m/s", 1e-3),
    ("ms", "s", 1e-3),
    ("us", "s", 1e-6),
    ("g", "kg", 1e-3),
    ("kN", "N", 1e3),
    ("mN m", "N m", 1e-3),
    ("N cm", "N m", 1e-2),
    ("kg cm^2", "kg m^2", 1e-4),
    ("g cm^2", "kg m^2", 1e-7),
    ("%", "", 1e-2),
];

/// The unit in one spelling.
fn normal(unit: &str) -> String {
    let plain = unit.replace("**", "^").replace('²', "^2").replace('³', "^3").replace(['*', '·', '⋅', '×'], " ");
    let plain = plain.replace('/', " / ").replace('^', " ^ ");
    let factors: Vec<&str> = plain.split_whitespace().map(|factor| if factor == "Nm" { "N m" } else { factor }).collect();
    match factors.as_slice() {
        ["1" | "-"] => String::new(),
        all => all.join(" "),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pure_number_is_told_as_one() {
        assert_eq!([unit_told("N m"), unit_told("")], ["its unit is [N m]", "it is a pure number"]);
    }

    #[test]
    fn spellings_of_one_unit_are_equal() {
        for found in ["N m s/rad", "N*m*s/rad", "N·m·s / rad", " N  m s/rad ", "Nm s/rad"] {
            assert_eq!(check_unit(Some(found), "N m s/rad"), Ok(()), "{found}");
        }
        assert_eq!(check_unit(Some("kg m²"), "kg m^2"), Ok(()));
        assert_eq!(check_unit(Some("1"), ""), Ok(()));
        assert_eq!(check_unit(None, "rad"), Ok(()));
    }

    #[test]
    fn another_unit_is_refused_with_its_conversion() {
        let mismatch = check_unit(Some("deg"), "rad").unwrap_err();
        assert_eq!(mismatch.to_string(), "expected the unit `rad`, found `deg`");
        assert_eq!(mismatch.hint, "convert the values first: 1 deg = 0.0174532925 rad");
        // Millisecond, and metre times second.
        assert!(check_unit(Some("ms"), "m s").is_err());
        assert!(check_unit(Some("N/m"), "N m").is_err());
        assert!(check_unit(Some(""), "N m").is_err());
    }
}
