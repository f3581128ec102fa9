//! One figure of the table: what was measured, how sure that is, what was wanted, and what the baselines reach.

use serde::{Deserialize, Serialize};

use super::wilson::{quantile, wilson};

/// A figure.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Figure {
    /// What it is of, in a few words.
    pub name: String,
    /// What it is of, in full.
    pub meaning: String,
    /// In what it is counted.
    pub unit: Unit,
    /// Its value; none where no case tells, or where most of what it is the median of is infinite.
    pub value: Option<f64>,
    /// Its 95 % interval.
    pub interval: Option<[f64; 2]>,
    /// Number of cases, or of what else it is a figure of.
    pub of: usize,
    /// What was wanted.
    pub goal: Option<Goal>,
    /// How it stands to that.
    pub standing: Standing,
    /// The same figure of the twin refitted with nothing added.
    pub recalibration: Option<f64>,
    /// Of sparse regression.
    pub regression: Option<f64>,
    /// Of a fit that was told the names.
    pub oracle: Option<f64>,
}

/// In what a figure is counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Unit {
    /// Parts of one, shown in per cent.
    Share,
    /// Seconds.
    Seconds,
    /// A pure number.
    Number,
}

/// What is wanted of a figure.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Goal {
    /// The least.
    pub least: f64,
    /// The aim.
    pub aim: f64,
    /// Where the aim ends, when more is not better.
    pub until: Option<f64>,
}

/// How a figure stands to its goal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Standing {
    /// It reaches the aim.
    Aim,
    /// It reaches the least.
    Least,
    /// It reaches neither.
    Missed,
    /// Nothing is wanted, or nothing was measured.
    Open,
}

impl Goal {
    /// At least so much, and rather more: a goal whose aim is lower than its least wants a small figure.
    pub(super) const fn new(least: f64, aim: f64) -> Self {
        Self { least, aim, until: None }
    }

    fn standing(&self, value: f64) -> Standing {
        let reaches = |bound: f64| if self.aim >= self.least { value >= bound } else { value <= bound };
        match () {
            () if reaches(self.aim) && self.until.is_none_or(|until| value <= until) => Standing::Aim,
            () if reaches(self.least) => Standing::Least,
            () => Standing::Missed,
        }
    }
}

impl Figure {
    /// A share: how many of these hold.
    pub(super) fn share(name: &str, holds: impl IntoIterator<Item = bool>) -> Self {
        let (hits, of) = holds.into_iter().fold((0, 0), |(hits, of), hit| (hits + usize::from(hit), of + 1));
        let value = (of > 0).then(|| hits as f64 / of as f64);
        Self { interval: (of > 0).then(|| wilson(hits, of)), ..Self::new(name, Unit::Share, value, of) }
    }

    /// A quantile of values; infinite ones are those that were not to be had.
    pub(super) fn quantile(name: &str, unit: Unit, part: f64, values: impl IntoIterator<Item = f64>) -> Self {
        let mut values: Vec<f64> = values.into_iter().collect();
        values.sort_by(f64::total_cmp);
        let found = quantile(&values, part);
        let interval = found.map(|(_, interval)| interval).filter(|interval| interval.iter().all(|v| v.is_finite()));
        Self { interval, ..Self::new(name, unit, found.map(|(value, _)| value), values.len()) }
    }

    /// A number without an interval.
    pub(super) fn number(name: &str, value: Option<f64>, of: usize) -> Self {
        Self::new(name, Unit::Number, value, of)
    }

    fn new(name: &str, unit: Unit, value: Option<f64>, of: usize) -> Self {
        let standing = Standing::Open;
        let value = value.filter(|value| value.is_finite());
        let none = None;
        Self {
            name: name.to_owned(),
            meaning: String::new(),
            unit,
            value,
            interval: None,
            of,
            goal: None,
            standing,
            recalibration: none,
            regression: none,
            oracle: none,
        }
    }

    /// The same figure with what it means.
    pub(super) fn meaning(self, meaning: &str) -> Self {
        Self { meaning: meaning.to_owned(), ..self }
    }

    /// The same figure with what was wanted of it.
    pub(super) fn wanting(mut self, goal: Goal) -> Self {
        self.goal = Some(goal);
        self.standing = match self.value {
            Some(value) => goal.standing(value),
            // Something was there to be measured, and could not be.
            None if self.of > 0 => Standing::Missed,
            None => Standing::Open,
        };
        self
    }

    /// Its value and interval as text.
    #[must_use]
    pub fn shown(&self) -> String {
        match (self.value, self.interval) {
            (None, _) if self.of > 0 => "not found".to_owned(),
            (None, _) => "no cases".to_owned(),
            (Some(value), None) => self.told(value),
            (Some(value), Some([low, high])) => {
                format!("{} ({} to {})", self.told(value), self.unit.bare(low), self.unit.bare(high))
            }
        }
    }

    /// A value with as many digits as it takes to see how it stands: 92.9 % is not the 93 % that were wanted.
    pub(super) fn told(&self, value: f64) -> String {
        let usual = self.unit.digits(value);
        let tells = |digits: &usize| {
            self.goal.is_none_or(|goal| goal.standing(self.unit.rounded(value, *digits)) == goal.standing(value))
        };
        self.unit.with_unit(value, (usual..usual + MORE_DIGITS).find(tells).unwrap_or(usual))
    }

    /// What was wanted as text: the least and the aim.
    #[must_use]
    pub fn wanted(&self) -> Option<[String; 2]> {
        let goal = self.goal?;
        let aim = match goal.until {
            Some(until) => format!("{} to {}", self.unit.bare(goal.aim), self.unit.shown(until)),
            None => self.unit.shown(goal.aim),
        };
        Some([self.unit.shown(goal.least), aim])
    }

    /// The least and the aim in a few letters.
    #[must_use]
    pub fn wanted_short(&self) -> String {
        self.wanted().map_or_else(String::new, |[least, aim]| format!("{least}, {aim}"))
    }

    /// A baseline's value as text.
    #[must_use]
    pub fn beside(&self, value: Option<f64>) -> String {
        value.map_or_else(|| "\u{2013}".to_owned(), |value| self.unit.shown(value))
    }
}

/// A value is shown with fewer more digits than this.
const MORE_DIGITS: usize = 4;

impl Unit {
    fn shown(self, value: f64) -> String {
        self.with_unit(value, self.digits(value))
    }

    fn bare(self, value: f64) -> String {
        self.with_digits(value, self.digits(value))
    }

    fn with_unit(self, value: f64, digits: usize) -> String {
        let bare = self.with_digits(value, digits);
        match self {
            Self::Share => format!("{bare}\u{a0}%"),
            Self::Seconds => format!("{bare}\u{a0}s"),
            Self::Number => bare,
        }
    }

    fn with_digits(self, value: f64, digits: usize) -> String {
        format!("{:.digits$}", value * self.per_one())
    }

    /// What `with_digits` shows of a value.
    fn rounded(self, value: f64, digits: usize) -> f64 {
        self.with_digits(value, digits).parse::<f64>().map_or(value, |shown| shown / self.per_one())
    }

    /// Digits behind the point that are usual for a value.
    fn digits(self, value: f64) -> usize {
        match self {
            Self::Share => usize::from(value > 0.0 && value < 0.1),
            Self::Seconds => 2 * usize::from(value < 10.0),
            Self::Number => 3 * usize::from(value < 100.0),
        }
    }

    fn per_one(self) -> f64 {
        match self {
            Self::Share => 100.0,
            Self::Seconds | Self::Number => 1.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn standings_know_which_way_is_up() {
        let of = |value: f64, goal: Goal| Figure::number("x", Some(value), 1).wanting(goal).standing;
        assert_eq!(of(0.96, Goal::new(0.85, 0.95)), Standing::Aim);
        assert_eq!(of(0.90, Goal::new(0.85, 0.95)), Standing::Least);
        assert_eq!(of(0.80, Goal::new(0.85, 0.95)), Standing::Missed);
        assert_eq!(of(0.02, Goal::new(0.10, 0.03)), Standing::Aim);
        assert_eq!(of(0.20, Goal::new(0.10, 0.03)), Standing::Missed);
        let coverage = Goal { until: Some(0.97), ..Goal::new(0.85, 0.93) };
        assert_eq!((of(0.95, coverage), of(0.99, coverage)), (Standing::Aim, Standing::Least));
    }

    #[test]
    fn what_was_not_to_be_had_is_not_passed_over() {
        let figure = Figure::quantile("onset", Unit::Seconds, 0.5, [0.1, f64::INFINITY, f64::INFINITY]);
        let figure = figure.wanting(Goal::new(0.3, 0.1));
        assert_eq!((figure.value, figure.standing, figure.shown().as_str()), (None, Standing::Missed, "not found"));
        assert_eq!(Figure::share("x", []).wanting(Goal::new(0.5, 0.9)).standing, Standing::Open);
        assert_eq!(Figure::share("x", [true, true, false, true]).shown(), "75\u{a0}% (30 to 95)");
    }

    #[test]
    fn a_value_is_told_from_what_was_wanted() {
        let of = |hits: usize, least: f64| {
            let holds = (0..70).map(|k| k < hits);
            Figure::share("x", holds).wanting(Goal::new(least, 0.99)).shown()
        };
        assert_eq!(of(65, 0.93), "92.9\u{a0}% (84 to 97)");
        assert_eq!(of(65, 0.92), "93\u{a0}% (84 to 97)");
        assert_eq!(of(60, 0.93), "86\u{a0}% (76 to 92)");
        let goal = Goal::new(0.1, 0.03);
        assert_eq!(Figure::number("ece", Some(0.10004), 1).wanting(goal).shown(), "0.10004");
    }
}
