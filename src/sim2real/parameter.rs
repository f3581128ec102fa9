//! Parameters with their units, bounds and priors, and their values over the lanes of a run.

use std::borrow::Cow;

/// A number a plant or a mechanism depends on.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Name, unique within its plant or mechanism.
    pub name: Cow<'static, str>,
    /// Unit, as written in a twin ("N m s/rad"); empty for a pure number.
    pub unit: Cow<'static, str>,
    /// The value a twin has today; for a mechanism the value at which it does nothing.
    pub nominal: f64,
    /// Smallest value that makes sense.
    pub lower: f64,
    /// Largest value that makes sense.
    pub upper: f64,
    /// Standard deviation of the Gaussian prior around `nominal`, in the parameter's unit; none for a flat prior, 0 for
    /// a value known exactly, which no fit moves.
    pub prior: Option<f64>,
    /// Where fits begin, beside `nominal`. A value that does nothing has no gradient to follow, so a mechanism names
    /// at least one that does something.
    pub starts: Vec<f64>,
    /// What time stamps or the like show of it by themselves, better than any fit could: value and standard deviation.
    pub shown: Option<[f64; 2]>,
    /// For an initial state: that it may well be exactly 0, as where a recording begins at rest, and about how large it is otherwise.
    pub rests_or: Option<f64>,
    /// Whether the output is differentiable in it, to within the step of a finite difference.
    pub smooth: bool,
    /// Whether its effect grows in proportion to it, from the nominal value on, where it is small: a screen then solves
    /// for it instead of trying values.
    pub linear: bool,
    /// Whether it says when something happens or by how long it is late. Such a number is what it is; all others stand for what a
    /// law of another form does, and are off as that form differs.
    pub shift: bool,
    /// Where the bounds come from.
    pub source: Cow<'static, str>,
}

impl Parameter {
    /// A parameter with a flat prior over all reals.
    #[must_use]
    pub fn new(name: &'static str, unit: &'static str, nominal: f64) -> Self {
        Self::named(name, unit, nominal)
    }

    /// The same of a name and a unit that are not known when the program is compiled.
    #[must_use]
    pub fn named(name: impl Into<Cow<'static, str>>, unit: impl Into<Cow<'static, str>>, nominal: f64) -> Self {
        Self {
            name: name.into(),
            unit: unit.into(),
            nominal,
            lower: f64::NEG_INFINITY,
            upper: f64::INFINITY,
            prior: None,
            starts: Vec::new(),
            shown: None,
            rests_or: None,
            smooth: true,
            linear: false,
            shift: false,
            source: Cow::Borrowed(""),
        }
    }

    /// Sets the bounds.
    #[must_use]
    pub fn within(mut self, lower: f64, upper: f64) -> Self {
        self.lower = lower;
        self.upper = upper;
        self
    }

    /// Sets the standard deviation of the prior, in the parameter's unit; 0 freezes it.
    #[must_use]
    pub fn known_to(mut self, std: f64) -> Self {
        self.prior = Some(std);
        self
    }

    /// Sets where fits begin.
    #[must_use]
    pub fn starting_at(mut self, starts: &[f64]) -> Self {
        self.starts = starts.to_vec();
        self
    }

    /// Says of an initial state that it may well be exactly 0, and otherwise is about this large.
    #[must_use]
    pub fn at_rest_or_about(mut self, size: f64) -> Self {
        self.rests_or = Some(size).filter(|size| *size > 0.0 && size.is_finite());
        self
    }

    /// Says that the output jumps as this parameter moves: fits scan it and refine without derivatives.
    #[must_use]
    pub fn stepped(mut self) -> Self {
        self.smooth = false;
        self
    }

    /// Says that its effect grows in proportion to it, where it is small. Whether recordings would show it is judged by its first
    /// start, which should be as large as it may well be.
    #[must_use]
    pub fn proportional(mut self) -> Self {
        self.linear = true;
        self
    }

    /// Says that it is a moment, or how late something is.
    #[must_use]
    pub fn in_time(mut self) -> Self {
        self.shift = true;
        self
    }

    /// Names where law or bounds come from.
    #[must_use]
    pub fn from_source(mut self, source: &'static str) -> Self {
        self.source = Cow::Borrowed(source);
        self
    }

    /// Whether no fit may move it.
    #[must_use]
    pub fn frozen(&self) -> bool {
        self.prior == Some(0.0)
    }

    /// A typical size of the parameter, for scaling steps of fits: never 0.
    #[must_use]
    pub fn scale(&self) -> f64 {
        // A nominal value of infinity (a limit that is never reached) is no yardstick.
        let origin = if self.nominal.is_finite() { self.nominal } else { 0.0 };
        let start = self.starts.iter().fold(0.0_f64, |m, s| m.max((s - origin).abs()));
        let width = if self.lower.is_finite() && self.upper.is_finite() { 0.1 * (self.upper - self.lower) } else { 1.0 };
        [start, self.prior.unwrap_or(0.0), 0.1 * self.nominal.abs(), width]
            .into_iter()
            .find(|s| *s > 0.0 && s.is_finite())
            .unwrap_or(1.0)
    }

    /// Whether `value` lies within a thousandth of its scale, or of the distance between the bounds where that is less, from
    /// a bound.
    #[must_use]
    pub fn at_bound(&self, value: f64) -> bool {
        let span = (self.upper - self.lower).min(self.scale());
        value - self.lower <= 1e-3 * span || self.upper - value <= 1e-3 * span
    }
}

/// Values of parameters over the lanes of a run: one row a parameter, one entry a lane.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Thetas {
    lanes: usize,
    rows: Vec<Vec<f64>>,
}

impl Thetas {
    /// The given points, one a lane; each point is one value a parameter, so all must be equally long.
    ///
    /// # Panics
    /// If the points differ in length: an error of the calling code, not of any input.
    #[must_use]
    pub fn from_lanes<V: AsRef<[f64]>>(points: &[V]) -> Self {
        let parameters = points.first().map_or(0, |p| p.as_ref().len());
        assert!(points.iter().all(|p| p.as_ref().len() == parameters), "lanes of different lengths");
        let rows = (0..parameters).map(|k| points.iter().map(|p| p.as_ref()[k]).collect()).collect();
        Self { lanes: points.len(), rows }
    }

    /// One lane with the given values.
    #[must_use]
    pub fn single(values: &[f64]) -> Self {
        Self::from_lanes(&[values])
    }

    /// Number of lanes.
    #[must_use]
    pub fn lanes(&self) -> usize {
        self.lanes
    }

    /// Number of parameters.
    #[must_use]
    pub fn parameters(&self) -> usize {
        self.rows.len()
    }

    /// Values of parameter `k`, one a lane.
    #[must_use]
    pub fn row(&self, k: usize) -> &[f64] {
        &self.rows[k]
    }

    /// The parameters from `start`, `count` of them, as a set of their own.
    #[must_use]
    pub fn block(&self, start: usize, count: usize) -> Self {
        Self { lanes: self.lanes, rows: self.rows[start..start + count].to_vec() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lanes_are_rows_of_parameters() {
        let thetas = Thetas::from_lanes(&[[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]]);
        assert_eq!((thetas.lanes(), thetas.parameters()), (3, 2));
        assert_eq!(thetas.row(1), &[2.0, 4.0, 6.0]);
        assert_eq!(thetas.block(1, 1).row(0), &[2.0, 4.0, 6.0]);
    }

    #[test]
    fn scale_is_never_zero_and_bounds_are_seen() {
        let torque = Parameter::new("torque", "N m", 0.0).within(0.0, 10.0).starting_at(&[0.1]);
        assert_eq!(torque.scale(), 0.1);
        assert!(torque.at_bound(0.000_05) && torque.at_bound(9.999_99) && !torque.at_bound(0.5));
        assert!(Parameter::new("free", "", 0.0).scale() > 0.0);
        assert!(!Parameter::new("free", "", 0.0).at_bound(0.0));
    }
}
