//! How likely a row is in each state: densities made ready to be evaluated, of a row or of several at once.

use std::f64::consts::LOG2_E;

use nalgebra::DMatrix;
use pulp::{Arch, NullaryFnOnce};
use statrs::function::gamma::ln_gamma;
use wide::f64x2;

use super::ends::{Ends, LANES, PerState, Steps};
use super::{Emission, HiddenMarkov, RegimeError, Spread};
use crate::sim2real::elementary::{exp2, ln_1p};

/// Squared distances are cut here, so that a density is never 0 in all states at once.
const FARTHEST: f64 = 1e300;

/// The densities of all states: arrays over states, nothing allocated when one is evaluated.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Densities {
    width: usize,
    /// `[state][column]`.
    means: Vec<f64>,
    /// What makes deviations white, the inverse of the factor: its diagonal `[state][column]`, or its lower triangle row
    /// after row, `[state][width (width + 1) / 2]`.
    whitening: Vec<f64>,
    triangular: bool,
    /// Logarithm of the density at the mean.
    peaks: Vec<f64>,
    /// The largest of them: no density is above it.
    pub highest: f64,
    /// Degrees of freedom, where the states have any.
    pub degrees: Option<Vec<f64>>,
}

impl Densities {
    pub fn new(emissions: &[Emission]) -> Result<Self, RegimeError> {
        let width = emissions.first().map_or(0, |e| e.mean.len());
        if width == 0 {
            return Err(RegimeError::Shape { what: "states", found: 0, expected: 1 });
        }
        let triangular = emissions.iter().any(|e| matches!(e.spread, Spread::Full(_)));
        let heavy = emissions.iter().any(|e| e.degrees.is_some());
        let mut densities = Self {
            width,
            means: vec![],
            whitening: vec![],
            triangular,
            peaks: vec![],
            highest: f64::NEG_INFINITY,
            degrees: heavy.then(Vec::new),
        };
        for (state, emission) in emissions.iter().enumerate() {
            if emission.mean.len() != width {
                return Err(RegimeError::Shape { what: "a mean", found: emission.mean.len(), expected: width });
            }
            let factor = emission.factor(state)?;
            let determinant: f64 = factor.diagonal().iter().map(|d| d.ln()).sum();
            let inverse = factor.solve_lower_triangular(&DMatrix::identity(width, width)).ok_or(RegimeError::Spread {
                state,
                what: "variance",
                found: 0.0,
            })?;
            densities.means.extend(&emission.mean);
            for row in 0..width {
                let from = if triangular { 0 } else { row };
                densities.whitening.extend((from..=row).map(|column| inverse[(row, column)]));
            }
            let wide = width as f64;
            let peak = match emission.degrees {
                None => -0.5 * wide * std::f64::consts::TAU.ln(),
                Some(nu) => ln_gamma(0.5 * (nu + wide)) - ln_gamma(0.5 * nu) - 0.5 * wide * (nu * std::f64::consts::PI).ln(),
            };
            densities.peaks.push(peak - determinant);
            densities.highest = densities.highest.max(peak - determinant);
            if let Some(degrees) = &mut densities.degrees {
                let Some(nu) = emission.degrees else {
                    return Err(RegimeError::Shape {
                        what: "states with degrees of freedom",
                        found: state,
                        expected: emissions.len(),
                    });
                };
                degrees.push(nu);
            }
        }
        Ok(densities)
    }

    /// Squared Mahalanobis distances of rows side by side, `[column][row]`, from the mean of a state.
    #[inline(always)]
    pub fn distances<const N: usize>(&self, state: usize, columns: &[[f64; N]]) -> [f64; N] {
        let means = &self.means[state * self.width..][..self.width];
        let mut sums = [0.0; N];
        if self.triangular {
            let size = self.width * (self.width + 1) / 2;
            let mut rest = &self.whitening[state * size..][..size];
            for line in 1..=self.width {
                let (weights, after) = rest.split_at(line);
                let mut white = [0.0; N];
                for ((column, mean), weight) in columns.iter().zip(means).zip(weights) {
                    for k in 0..N {
                        white[k] += weight * (column[k] - mean);
                    }
                }
                for k in 0..N {
                    sums[k] += squared(white[k]);
                }
                rest = after;
            }
        } else {
            let whitening = &self.whitening[state * self.width..][..self.width];
            for ((column, mean), weight) in columns.iter().zip(means).zip(whitening) {
                for k in 0..N {
                    sums[k] += squared(weight * (column[k] - mean));
                }
            }
        }
        sums.map(bounded)
    }

    /// Writes the logarithm of each state's density at `row`; 0 in all states where the row was lost.
    pub fn logarithms(&self, row: &[f64], into: &mut [f64]) {
        let (into, _) = into.as_chunks_mut::<1>();
        self.evaluate(row.as_chunks::<1>().0, Unit::Natural, into);
    }

    /// Writes each state's density at `row` over the highest that any has; 1 in all states where the row was lost.
    #[inline(always)]
    pub fn weights(&self, row: &[f64], into: &mut [f64]) {
        self.evaluate(row.as_chunks::<1>().0, Unit::Bits, into.as_chunks_mut::<1>().0);
        into.iter_mut().for_each(|value| *value = exp2(*value));
    }

    /// Of rows side by side, `[column][row]`, writes the logarithm of each density, `[state][row]`, 0 where a row was lost. The bits are the
    /// same however many rows there are.
    #[inline(always)]
    fn evaluate<const N: usize>(&self, columns: &[[f64; N]], unit: Unit, into: &mut [[f64; N]]) {
        let (less, size) = match unit {
            Unit::Natural => (0.0, 1.0),
            Unit::Bits => (self.highest, LOG2_E),
        };
        let scaled = |state: usize| ((self.peaks[state] - less) * size, 0.5 * size);
        match (columns, &self.degrees) {
            ([column], None) => {
                // Most series are such: no more is done than must be.
                for (state, logs) in into.iter_mut().enumerate() {
                    let ((top, half), mean) = (scaled(state), self.means[state]);
                    let whitening = self.whitening[state] * half.sqrt();
                    for k in 0..N {
                        logs[k] = top - bounded(squared(whitening * (column[k] - mean)));
                    }
                }
            }
            (_, None) => {
                for (state, logs) in into.iter_mut().enumerate() {
                    let ((top, half), distances) = (scaled(state), self.distances(state, columns));
                    for k in 0..N {
                        logs[k] = top - half * distances[k];
                    }
                }
            }
            (_, Some(degrees)) => {
                for ((state, logs), nu) in into.iter_mut().enumerate().zip(degrees) {
                    let ((top, half), distances) = (scaled(state), self.distances(state, columns));
                    let half = half * (nu + self.width as f64);
                    for k in 0..N {
                        logs[k] = top - half * ln_1p(bounded(distances[k] / nu));
                    }
                }
            }
        }
        let mut lost = false;
        for column in columns {
            for value in column {
                lost |= value.is_nan();
            }
        }
        if lost {
            for k in (0..N).filter(|k| columns.iter().any(|column| column[*k].is_nan())) {
                into.iter_mut().for_each(|logs| logs[k] = 0.0);
            }
        }
    }
}

#[inline(always)]
fn squared(x: f64) -> f64 {
    x * x
}

/// No squared distance is above `FARTHEST`; nor is that of a difference of infinities, which is NaN.
#[inline(always)]
pub(super) fn bounded(distance: f64) -> f64 {
    if distance < FARTHEST { distance } else { FARTHEST }
}

/// What logarithms of densities are told in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Unit {
    Natural,
    /// To the base of 2, over the highest density.
    Bits,
}

/// What is evaluated of each row and state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Evaluated {
    /// What [`Densities::logarithms`] writes.
    Logarithms,
    /// What [`Densities::weights`] writes.
    Weights,
}

/// Some steps into a series, and what is evaluated of their rows.
pub(super) struct Block<'a, X: Ends> {
    /// The first of them.
    pub from: usize,
    /// Number of steps.
    pub count: usize,
    /// `[state][step]`.
    values: &'a [X::Group],
}

impl<X: Ends> Block<'_, X> {
    /// Shows `see` each step with what is evaluated of its rows in each state.
    #[inline(always)]
    pub fn each_step<S: PerState<Of = X>>(&self, mut see: impl FnMut(usize, &mut S)) {
        let columns = S::each(self.values.len(), |state| &self.values[state]);
        for lane in 0..self.count {
            let value = |state: usize| columns.as_ref()[state].as_ref()[lane % (LANES / X::COUNT)];
            let mut values = S::of(self.values.len(), value);
            see(self.from + lane, &mut values);
        }
    }
}

/// Evaluates a series block by block, each with the widest vectors of the processor: bit by bit what is evaluated of each row by itself.
pub(super) fn each_block<X: Ends>(model: &HiddenMarkov, evaluated: Evaluated, steps: Steps, mut see: impl FnMut(Block<X>)) {
    let (densities, size) = (model.densities(), LANES / X::COUNT);
    let mut columns = vec![[0.0; LANES]; densities.width];
    // Of the kind that needs the widest places.
    let mut values = vec![f64x2::ZERO; model.states() * LANES / 2];
    for from in (0..steps.count).step_by(size) {
        steps.columns::<X>(from, &mut columns);
        let into: &mut [[f64; LANES]] = bytemuck::cast_slice_mut(&mut values);
        evaluate(densities, evaluated, &columns, into);
        see(Block { from, count: size.min(steps.count - from), values: bytemuck::cast_slice(&values) });
    }
}

/// Evaluates rows side by side, `[column][row]`, in each state, `[state][row]`.
pub(super) fn evaluate<const N: usize>(
    densities: &Densities,
    evaluated: Evaluated,
    columns: &[[f64; N]],
    into: &mut [[f64; N]],
) {
    Arch::new().dispatch(Evaluation { densities, evaluated, columns, into });
}

struct Evaluation<'a, const N: usize> {
    densities: &'a Densities,
    evaluated: Evaluated,
    columns: &'a [[f64; N]],
    into: &'a mut [[f64; N]],
}

impl<const N: usize> NullaryFnOnce for Evaluation<'_, N> {
    type Output = ();

    // What is not inlined here is compiled without the processor's vectors.
    #[inline(always)]
    fn call(self) {
        let Self { densities, evaluated, columns, into } = self;
        match evaluated {
            Evaluated::Logarithms => densities.evaluate(columns, Unit::Natural, into),
            Evaluated::Weights => {
                densities.evaluate(columns, Unit::Bits, into);
                into.as_flattened_mut().iter_mut().for_each(|value| *value = exp2(*value));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use statrs::distribution::{Continuous, Normal, StudentsT};

    fn logarithm(emission: Emission, row: &[f64]) -> f64 {
        let mut log = [f64::NAN];
        Densities::new(&[emission]).unwrap().logarithms(row, &mut log);
        log[0]
    }

    #[test]
    fn densities_are_those_of_the_distributions() {
        let emission = Emission { mean: vec![1.5], spread: Spread::Diagonal(vec![4.0]), degrees: None };
        let expected = Normal::new(1.5, 2.0).unwrap().ln_pdf(-0.7);
        assert!((logarithm(emission.clone(), &[-0.7]) - expected).abs() < 1e-12);
        let heavy = Emission { degrees: Some(3.5), ..emission };
        let expected = StudentsT::new(1.5, 2.0, 3.5).unwrap().ln_pdf(-0.7);
        assert!((logarithm(heavy, &[-0.7]) - expected).abs() < 1e-9);
    }

    /// By hand: determinant 3, inverse [[2, -1], [-1, 2]] / 3, at (1, -1): (2 + 2 + 2) / 3 = 2.
    #[test]
    fn a_full_covariance_by_hand() {
        let spread = Spread::Full(vec![vec![2.0, 1.0], vec![1.0, 2.0]]);
        let emission = Emission { mean: vec![0.0, 0.0], spread, degrees: None };
        let expected = -std::f64::consts::TAU.ln() - 0.5 * 3.0_f64.ln() - 1.0;
        assert!((logarithm(emission, &[1.0, -1.0]) - expected).abs() < 1e-12);
        // A diagonal one is the product over its columns.
        let emission = Emission { mean: vec![0.0, 1.0], spread: Spread::Diagonal(vec![1.0, 9.0]), degrees: None };
        let expected = Normal::new(0.0, 1.0).unwrap().ln_pdf(0.3) + Normal::new(1.0, 3.0).unwrap().ln_pdf(4.0);
        assert!((logarithm(emission, &[0.3, 4.0]) - expected).abs() < 1e-12);
    }

    #[test]
    fn what_spreads_cannot_be() {
        let of = |spread, degrees| Densities::new(&[Emission { mean: vec![0.0, 0.0], spread, degrees }]).map(|_| ());
        let zero = of(Spread::Diagonal(vec![1.0, 0.0]), None);
        assert_eq!(zero, Err(RegimeError::Spread { state: 0, what: "variance", found: 0.0 }));
        assert!(of(Spread::Diagonal(vec![1.0]), None).unwrap_err().to_string().contains("1, where 2 are expected"));
        let flat = of(Spread::Full(vec![vec![1.0, 1.0], vec![1.0, 1.0]]), None).unwrap_err();
        assert!(flat.to_string().contains("determinant of the covariance is 0"), "{flat}");
        let skew = of(Spread::Full(vec![vec![1.0, 0.5], vec![0.2, 1.0]]), None).unwrap_err();
        assert!(skew.to_string().contains("not symmetric"), "{skew}");
        assert!(of(Spread::Diagonal(vec![1.0; 2]), Some(0.0)).is_err());
    }

    #[test]
    fn a_lost_row_says_nothing() {
        let states = [(0.0, 1.0), (3.0, 2.0)].map(|(mean, variance)| Emission {
            mean: vec![mean],
            spread: Spread::Diagonal(vec![variance]),
            degrees: None,
        });
        let mut logs = [f64::NAN; 2];
        Densities::new(&states).unwrap().logarithms(&[f64::NAN], &mut logs);
        assert_eq!(logs, [0.0; 2]);
        // And one that is too far from any is of no state, but breaks nothing.
        Densities::new(&states).unwrap().logarithms(&[1e200], &mut logs);
        assert!(logs.iter().all(|l| l.is_finite()), "{logs:?}");
    }
}
