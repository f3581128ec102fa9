//! Numbers as a reader wants them: as many digits as mean something, thousands apart, a true minus.

use crate::sim2real::diagnose::Bin;

/// What stands for a value that is not defined.
pub(crate) const UNDEFINED: &str = "\u{2013}";

/// `value` to `digits` significant digits.
pub(crate) fn significant(value: f64, digits: i32) -> String {
    if value.is_nan() {
        return UNDEFINED.into();
    }
    if value.is_infinite() {
        return if value > 0.0 { "\u{221e}".into() } else { "\u{2212}\u{221e}".into() };
    }
    if value == 0.0 {
        return "0".into();
    }
    let exponent = magnitude(value, digits);
    if !(-4..9).contains(&exponent) {
        return scientific(value, digits);
    }
    decimals(value, usize::try_from(digits - 1 - exponent).unwrap_or(0))
}

/// `value` to three significant digits.
pub(crate) fn number(value: f64) -> String {
    significant(value, 3)
}

/// A value and its standard deviation, the latter to two digits and the former to the same place: `0.1803 ± 0.0021`.
pub(crate) fn uncertain(value: f64, std: f64) -> String {
    if !std.is_finite() || std <= 0.0 || !value.is_finite() {
        return significant(value, 4);
    }
    let exponent = magnitude(std, 2);
    // Outside this range a plain number would be a row of zeros.
    if !(-6..6).contains(&exponent) || value.abs() >= 1e9 {
        return format!("{} \u{b1} {}", scientific(value, 4), scientific(std, 2));
    }
    let places = usize::try_from(1 - exponent).unwrap_or(0);
    format!("{} \u{b1} {}", decimals(value, places), decimals(std, places))
}

/// A part of one as a percentage, with a space before the sign that does not break; 99.97 % does not read as 100 %, nor 0.02 % as 0 %.
pub(crate) fn percent(part: f64) -> String {
    if !part.is_finite() {
        return UNDEFINED.into();
    }
    let percent = 100.0 * part;
    match percent.abs() {
        p if p > 0.0 && p < 0.05 => "< 0.1\u{a0}%".into(),
        p if (99.95..100.0).contains(&p) => "> 99.9\u{a0}%".into(),
        p if p < 1.0 || (99.0..100.0).contains(&p) => format!("{}\u{a0}%", decimals(percent, 1)),
        _ => format!("{}\u{a0}%", decimals(percent, 0)),
    }
}

/// A part of one that is a round number of percent: `95 %`.
pub(crate) fn whole_percent(part: f64) -> String {
    format!("{}\u{a0}%", decimals(100.0 * part, 0))
}

/// A probability that something is so: nothing is certain.
pub(crate) fn confidence(part: f64) -> String {
    if part > 0.99 { "> 99\u{a0}%".into() } else { percent(part) }
}

/// An interval of parts of one, as percentages to a tenth.
pub(crate) fn percents(low: f64, high: f64) -> String {
    if !low.is_finite() || !high.is_finite() {
        return UNDEFINED.into();
    }
    format!("{} to {}\u{a0}%", decimals(100.0 * low, 1), decimals(100.0 * high, 1))
}

/// A range of a state: `|velocity| < 0.2 rad/s`, `position 0.3 to 0.5 rad`.
pub(crate) fn range(bin: &Bin) -> String {
    let value = |v: f64| significant(v, 2);
    let text = match (bin.from, bin.to) {
        (Some(from), Some(to)) => format!("{} {} to {}", bin.on, value(from), value(to)),
        (Some(from), None) => format!("{} > {}", bin.on, value(from)),
        (None, Some(to)) => format!("{} < {}", bin.on, value(to)),
        (None, None) => return bin.on.clone(),
    };
    with_unit(&text, &bin.unit)
}

/// A number on an axis: no more digits than it needs, millions as `M`.
pub(super) fn tick(value: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    let (scaled, suffix) = match value.abs() {
        a if a >= 1e9 => (value / 1e9, "G"),
        a if a >= 1e6 => (value / 1e6, "M"),
        a if a >= 1e4 => (value / 1e3, "k"),
        _ => (value, ""),
    };
    let exponent = magnitude(scaled, 6);
    if exponent < -4 {
        return scientific(scaled, 3);
    }
    let text = decimals(scaled, usize::try_from(5 - exponent).unwrap_or(0));
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    format!("{text}{suffix}")
}

/// `text` with a unit after it, if there is one and something to measure with it.
pub(crate) fn with_unit(text: &str, unit: &str) -> String {
    if unit.is_empty() || text == UNDEFINED { text.into() } else { format!("{text} {unit}") }
}

/// A length of time in the unit in which it reads best: `45 s`, `3.2 h`, `120 days`.
pub(crate) fn span(seconds: f64) -> String {
    const DAY: f64 = 86_400.0;
    if !seconds.is_finite() {
        return UNDEFINED.into();
    }
    let (value, unit) = match seconds.abs() {
        s if s < 120.0 => (seconds, "s"),
        s if s < 7_200.0 => (seconds / 60.0, "min"),
        s if s < 2.0 * DAY => (seconds / 3_600.0, "h"),
        _ => (seconds / DAY, "days"),
    };
    let places = usize::from(value.abs() < 10.0 && value.fract() != 0.0);
    format!("{}\u{a0}{unit}", decimals(value, places))
}

/// A part of one as a percentage to a hundredth.
pub(crate) fn fine(part: f64) -> String {
    if part.is_finite() { format!("{}\u{a0}%", decimals(100.0 * part, 2)) } else { UNDEFINED.into() }
}

/// An axis label: `position [rad]`.
pub(crate) fn axis(name: &str, unit: &str) -> String {
    if unit.is_empty() { name.into() } else { format!("{name} [{unit}]") }
}

/// Power of ten of the leading digit, after rounding to `digits` digits.
fn magnitude(value: f64, digits: i32) -> i32 {
    let exponent = value.abs().log10().floor();
    let unit = 10.0_f64.powf(exponent - f64::from(digits - 1));
    let carried = (value.abs() / unit).round() >= 10.0_f64.powi(digits) * (1.0 - 1e-12);
    exponent as i32 + i32::from(carried)
}

fn scientific(value: f64, digits: i32) -> String {
    if value == 0.0 {
        return "0".into();
    }
    let exponent = magnitude(value, digits);
    let mantissa = value / 10.0_f64.powi(exponent);
    let power: String = exponent.to_string().chars().map(superscript).collect();
    format!("{} \u{d7} 10{power}", decimals(mantissa, usize::try_from(digits - 1).unwrap_or(0)))
}

fn superscript(c: char) -> char {
    match c {
        '-' => '\u{207b}',
        '1' => '\u{b9}',
        '2' => '\u{b2}',
        '3' => '\u{b3}',
        '0' | '4'..='9' => char::from_u32(0x2070 + (c as u32 - '0' as u32)).unwrap_or(c),
        _ => c,
    }
}

/// `value` with `places` decimals, thousands apart.
pub(crate) fn decimals(value: f64, places: usize) -> String {
    let text = format!("{:.places$}", value.abs());
    let (whole, fraction) = text.split_once('.').map_or((text.as_str(), None), |(w, f)| (w, Some(f)));
    let mut grouped = String::with_capacity(text.len() + 4);
    if value < 0.0 && text.bytes().any(|b| b.is_ascii_digit() && b != b'0') {
        grouped.push('\u{2212}');
    }
    for (i, digit) in whole.chars().enumerate() {
        if i > 0 && (whole.len() - i).is_multiple_of(3) {
            grouped.push(',');
        }
        grouped.push(digit);
    }
    if let Some(fraction) = fraction {
        grouped.push('.');
        grouped.push_str(fraction);
    }
    grouped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_are_those_that_mean_something() {
        assert_eq!(number(0.081_234), "0.0812");
        assert_eq!(number(9.996), "10.0");
        assert_eq!(number(-1234.4), "\u{2212}1,234");
        assert_eq!(number(1.5e-7), "1.50 \u{d7} 10\u{207b}\u{2077}");
        assert_eq!((number(f64::NAN).as_str(), number(0.0).as_str()), (UNDEFINED, "0"));
        assert_eq!(uncertain(0.180_34, 0.0021), "0.1803 \u{b1} 0.0021");
        assert_eq!(uncertain(12_345.6, 120.0), "12,346 \u{b1} 120");
        assert_eq!(uncertain(2.5, f64::NAN), "2.500");
        assert_eq!(
            (percent(0.9997), percent(0.98), percent(0.0002)),
            ("> 99.9\u{a0}%".into(), "98\u{a0}%".into(), "< 0.1\u{a0}%".into())
        );
    }

    #[test]
    fn time_is_told_in_its_unit() {
        let spans = [0.5, 90.0, 150.0, 5_400.0, 7_200.0, 108_000.0, 864_000.0].map(span);
        assert_eq!(
            spans.map(|s| s.replace('\u{a0}', " ")),
            ["0.5 s", "90 s", "2.5 min", "90 min", "2 h", "30 h", "10 days"]
        );
        assert_eq!((fine(0.012_34), fine(f64::NAN).as_str()), ("1.23\u{a0}%".into(), UNDEFINED));
    }

    #[test]
    fn ticks_are_short() {
        assert_eq!((tick(1_000_000.0), tick(1_000_200.0)), ("1M".into(), "1.0002M".into()));
        assert_eq!((tick(0.1 + 0.2), tick(-0.05), tick(25_000.0)), ("0.3".into(), "\u{2212}0.05".into(), "25k".into()));
    }
}
