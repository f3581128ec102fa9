//! A range of values of one key of a run.

use toml::Value;

use super::document::Document;
use super::error::{InputError, hint_among};

/// The values one key of a run is tried with.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepRange {
    /// The key: `strategy.fast`, `mechanism.half_spread.bps`, `run.max_leverage`, `instrument.SPY.daily_volatility`.
    pub path: String,
    /// The values.
    pub values: RangeValues,
    /// Where it stands in the document.
    keys: Vec<String>,
}

/// Values as a range gives them.
#[derive(Debug, Clone, PartialEq)]
pub enum RangeValues {
    /// One by one.
    Listed(Vec<Value>),
    /// From one end to the other, both counted.
    Span {
        /// Lower end.
        from: f64,
        /// Upper end.
        to: f64,
        /// Distance of values, where it is given.
        step: Option<f64>,
        /// Number of values, where it is given.
        count: Option<usize>,
        /// Whether values lie evenly by ratio rather than by distance.
        log: bool,
        /// Whether values are whole numbers.
        whole: bool,
    },
}

const KEYS: [&str; 5] = ["from", "to", "step", "count", "log"];

impl SweepRange {
    /// The most values of a range.
    const MOST: usize = 100_000;

    /// The range at `keys` of `document`, whose first two lead to the section.
    pub(super) fn of(document: &Document, keys: Vec<String>, value: &Value) -> Result<Self, InputError> {
        let path = keys[2..].join(".");
        let mut range = Self { path, values: RangeValues::Listed(Vec::new()), keys };
        range.values = match value {
            Value::Array(values) => RangeValues::Listed(values.clone()),
            Value::Table(table) => range.span(document, table)?,
            other => {
                let error = range.error(document, "expected a list of values or { from = ..., to = ... }");
                return Err(error.found(other).hint("a value that stays as it is does not belong into the sweep"));
            }
        };
        range.check(document)?;
        Ok(range)
    }

    /// An error about the range.
    #[must_use]
    pub fn error(&self, document: &Document, message: impl Into<String>) -> InputError {
        self.error_at(document, None, message)
    }

    fn error_at(&self, document: &Document, key: Option<&str>, message: impl Into<String>) -> InputError {
        let keys: Vec<&str> = self.keys.iter().map(String::as_str).chain(key).collect();
        document.error(&keys, message)
    }

    fn span(&self, document: &Document, table: &toml::Table) -> Result<RangeValues, InputError> {
        if let Some(key) = table.keys().find(|key| !KEYS.contains(&key.as_str())) {
            let error = self.error_at(document, Some(key), format!("a range has no key `{key}`"));
            return Err(error.maybe_hint(hint_among(key, &KEYS)));
        }
        let wrong = |key: &str, what: &str| {
            let error = self.error_at(document, Some(key), format!("expected {what}"));
            let found = table.get(key).map(|value| error.clone().found(value));
            found.unwrap_or(error).hint("such as { from = 5, to = 50, step = 5 } or { from = 0.1, to = 10.0, log = true }")
        };
        let mut whole = true;
        let mut number = |key: &str| match table.get(key) {
            None => Ok(None),
            Some(Value::Integer(value)) => Ok(Some(*value as f64)),
            Some(Value::Float(value)) if value.is_finite() => {
                whole = false;
                Ok(Some(*value))
            }
            Some(_) => Err(wrong(key, "a finite number")),
        };
        let (from, to, step) = (number("from")?, number("to")?, number("step")?);
        let (Some(from), Some(to)) = (from, to) else {
            return Err(wrong(if from.is_none() { "from" } else { "to" }, "both ends of the range, `from` and `to`"));
        };
        let count = match table.get("count") {
            None => None,
            Some(Value::Integer(count)) if (2..=Self::MOST as i64).contains(count) => Some(*count as usize),
            Some(_) => return Err(wrong("count", "a whole number of values, 2 or more")),
        };
        let log = match table.get("log") {
            None => false,
            Some(Value::Boolean(log)) => *log,
            Some(_) => return Err(wrong("log", "true or false")),
        };
        if from > to {
            return Err(wrong("to", "an end that is not below the start"));
        }
        if step.is_some_and(|step| step <= 0.0 || (to - from) / step >= Self::MOST as f64) {
            return Err(wrong("step", "a step above 0, and at most 100,000 of them"));
        }
        if log && (from <= 0.0 || step.is_some()) {
            let key = if from <= 0.0 { "from" } else { "step" };
            return Err(wrong(key, "a start above 0 and a `count` in place of a `step`, where log = true"));
        }
        if step.is_some() && count.is_some() {
            return Err(wrong("count", "one of `step` and `count`"));
        }
        Ok(RangeValues::Span { from, to, step, count, log, whole })
    }

    fn check(&self, document: &Document) -> Result<(), InputError> {
        if let RangeValues::Listed(values) = &self.values {
            if values.is_empty() {
                return Err(self.error(document, "the range is empty").hint("give at least one value"));
            }
            if let Some(value) =
                values.iter().find(|value| matches!(value, Value::Array(_) | Value::Table(_) | Value::Datetime(_)))
            {
                let error = self.error(document, "expected a list of numbers, texts, or true and false");
                return Err(error.found(value).hint("each value is put in the place of one key"));
            }
        }
        Ok(())
    }

    /// Number of values, where it is known: whole numbers without `step` and `count` are all taken.
    #[must_use]
    pub fn count(&self) -> Option<usize> {
        match &self.values {
            RangeValues::Listed(values) => Some(values.len()),
            RangeValues::Span { count: Some(count), .. } => Some(*count),
            // The last step may miss the end by the rounding of a division.
            RangeValues::Span { from, to, step: Some(step), .. } => Some(((to - from) / step + 1e-9).floor() as usize + 1),
            RangeValues::Span { from, to, log: false, whole: true, .. } if to - from < Self::MOST as f64 => {
                Some((to - from) as usize + 1)
            }
            RangeValues::Span { from, to, .. } => (from == to).then_some(1),
        }
    }

    /// The values in order, where it is known which they are; whole numbers that fall together are there once.
    #[must_use]
    pub fn grid(&self) -> Option<Vec<Value>> {
        let count = self.count()?;
        let mut values: Vec<Value> = (0..count).map(|k| self.nth(k, count)).collect();
        if matches!(self.values, RangeValues::Span { .. }) {
            values.dedup();
        }
        Some(values)
    }

    /// The value at `place`, from 0 to below 1: one of those of a grid where there are such, else any between the ends.
    #[must_use]
    pub fn at(&self, place: f64) -> Value {
        match (&self.values, self.count()) {
            (_, Some(count)) => self.nth(((place * count as f64) as usize).min(count.saturating_sub(1)), count),
            (RangeValues::Span { from, to, log: false, whole: true, .. }, None) => {
                written((from + (place * (to - from + 1.0)).floor()).min(*to), true)
            }
            (RangeValues::Span { from, to, log, whole, .. }, None) => written(between(*from, *to, *log, place), *whole),
            (RangeValues::Listed(_), None) => Value::Integer(0),
        }
    }

    /// The `k`-th of `count` values.
    fn nth(&self, k: usize, count: usize) -> Value {
        match &self.values {
            RangeValues::Listed(values) => values.get(k).cloned().unwrap_or(Value::Integer(0)),
            RangeValues::Span { from, step: Some(step), whole, .. } => written(from + k as f64 * step, *whole),
            RangeValues::Span { from, to, log, whole, .. } => {
                written(between(*from, *to, *log, k as f64 / (count.max(2) - 1) as f64), *whole)
            }
        }
    }
}

fn between(from: f64, to: f64, log: bool, part: f64) -> f64 {
    let value = if log { from * (to / from).powf(part) } else { from + part * (to - from) };
    value.clamp(from, to)
}

fn written(value: f64, whole: bool) -> Value {
    if whole { Value::Integer(value.round() as i64) } else { Value::Float(value) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn range(text: &str) -> SweepRange {
        let document = Document::from_text("run.toml", format!("[sweep.ranges]\nx = {text}\n"));
        let table: toml::Table = document.parse().unwrap();
        SweepRange::of(&document, ["sweep", "ranges", "x"].map(str::to_owned).to_vec(), &table["sweep"]["ranges"]["x"])
            .unwrap()
    }

    fn grid(text: &str) -> Vec<f64> {
        let number = |value: &Value| value.as_float().or(value.as_integer().map(|v| v as f64)).unwrap();
        range(text).grid().unwrap().iter().map(number).collect()
    }

    #[test]
    fn a_range_is_as_it_is_written() {
        assert_eq!(grid("{ from = 5, to = 21, step = 5 }"), [5.0, 10.0, 15.0, 20.0]);
        assert_eq!(grid("{ from = 3, to = 5 }"), [3.0, 4.0, 5.0]);
        assert_eq!(grid("{ from = 0.1, to = 0.3, step = 0.1 }").len(), 3);
        assert_eq!(grid("{ from = 0.5, to = 2.0, log = true, count = 3 }"), [0.5, 1.0, 2.0]);
        assert_eq!(grid("{ from = 1, to = 8, log = true, count = 4 }"), [1.0, 2.0, 4.0, 8.0]);
        assert_eq!(range("[\"a\", true, 3]").count(), Some(3));
        assert_eq!(range("{ from = 0.5, to = 2.0 }").count(), None);
        assert_eq!(range("{ from = 2, to = 2 }").grid(), Some(vec![Value::Integer(2)]));
    }

    #[test]
    fn draws_reach_both_ends_and_go_no_further() {
        let whole = range("{ from = 3, to = 5 }");
        assert_eq!([0.0, 0.4, 0.99].map(|p| whole.at(p)), [3, 4, 5].map(Value::Integer));
        let log = range("{ from = 0.25, to = 4.0, log = true }");
        assert_eq!(log.at(0.5), Value::Float(1.0));
        assert_eq!(range("[\"a\", \"b\"]").at(0.5), Value::String("b".into()));
        assert_eq!(range("{ from = 0.0, to = 1.0, step = 0.5 }").at(0.999), Value::Float(1.0));
    }
}
