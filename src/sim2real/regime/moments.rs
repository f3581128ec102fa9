//! What a series amounts to in each state: the sums of which a state's distribution is estimated.

use nalgebra::{DMatrix, SymmetricEigen};
use statrs::function::gamma::digamma;
use wide::{CmpEq, f64x2};

use super::densities::Densities;
use super::ends::Ends;
use super::observations::is_lost;
use super::{Degrees, Emission, Family, Spread};

/// Bounds of degrees of freedom that are fitted: above 2, so that there is a variance; from 200 on it is a Gaussian.
const FITTED_DEGREES: (f64, f64) = (2.1, 200.0);

/// Sums over rows, weighted by the probability of each state. Deviations are from `centers`, so that no digits are lost in
/// the difference of squares where a mean is far from 0.
#[derive(Debug, Clone)]
pub(super) struct Moments {
    width: usize,
    /// `[state][column]`.
    centers: Vec<f64>,
    /// Sum of probabilities of rows that were observed: of two rows at once, in two sums.
    rows: Vec<f64x2>,
    /// The same, of a Student's t with each row weighted by how little it strays.
    weights: Vec<f64x2>,
    /// Sum of logarithms of these weights less the weights.
    spans: Vec<f64x2>,
    /// Weighted sum of deviations, `[state][column]`.
    first: Vec<f64x2>,
    /// Of their squares, `[state][column]`, or of their products, `[state][column][column]`, of which the lower half is set.
    second: Vec<f64x2>,
    full: bool,
    heavy: bool,
}

impl Moments {
    pub fn new(centers: Vec<f64>, width: usize, family: Family) -> Self {
        let states = centers.len() / width;
        let full = family == Family::GaussianFull;
        let second = if full { states * width * width } else { states * width };
        Self {
            width,
            rows: vec![f64x2::ZERO; states],
            weights: vec![f64x2::ZERO; states],
            spans: vec![f64x2::ZERO; states],
            first: vec![f64x2::ZERO; states * width],
            second: vec![f64x2::ZERO; second],
            centers,
            full,
            heavy: false,
        }
    }

    /// Adds two rows, with the probability of each state; one that was lost, or is none, adds nothing.
    #[inline(always)]
    pub fn add(&mut self, rows: [Option<&[f64]>; 2], probabilities: &[f64x2], densities: Option<&Densities>) {
        if let Some((densities, degrees)) = densities.and_then(|d| Some((d, d.degrees.as_ref()?))) {
            self.heavy = true;
            let rows = rows.map(|row| row.filter(|row| !is_lost(row)));
            for (state, probability) in probabilities.iter().enumerate() {
                let nu = degrees[state];
                let of_row = |row: &[f64]| (nu + self.width as f64) / (nu + densities.distance(state, row));
                let weight = f64x2::each(|end| rows[end].map_or(1.0, of_row));
                let kept = f64x2::each(|end| if rows[end].is_some() { probability.at(end) } else { 0.0 });
                self.spans[state] += kept * f64x2::each(|end| weight.at(end).ln() - weight.at(end));
                self.add_to(state, rows, kept, kept * weight);
            }
        } else if self.width == 1 {
            let states = probabilities.len();
            let (sums, centers) = (&mut self.rows[..states], &self.centers[..states]);
            let (first, second) = (&mut self.first[..states], &mut self.second[..states]);
            let x = f64x2::each(|end| rows[end].map_or(f64::NAN, |row| row[0]));
            let (here, x) = observed(x);
            for state in 0..states {
                let deviation = x - f64x2::splat(centers[state]);
                let kept = probabilities[state] & here;
                let weighted = kept * deviation;
                sums[state] += kept;
                first[state] += weighted;
                second[state] += weighted * deviation;
            }
        } else {
            let rows = rows.map(|row| row.filter(|row| !is_lost(row)));
            for (state, probability) in probabilities.iter().enumerate() {
                let kept = f64x2::each(|end| if rows[end].is_some() { probability.at(end) } else { 0.0 });
                self.add_to(state, rows, kept, kept);
            }
        }
    }

    /// Sum of probabilities of a state's rows.
    pub fn rows(&self, state: usize) -> f64 {
        both(self.rows[state])
    }

    /// Weight of a state's rows: of a Gaussian all count as they are.
    fn weight(&self, state: usize) -> f64 {
        both(if self.heavy { self.weights[state] } else { self.rows[state] })
    }

    #[inline(always)]
    fn add_to(&mut self, state: usize, rows: [Option<&[f64]>; 2], probability: f64x2, weight: f64x2) {
        self.rows[state] += probability;
        self.weights[state] += weight;
        let from = state * self.width;
        let centers = &self.centers[from..][..self.width];
        let deviation = |i: usize| f64x2::each(|end| rows[end].map_or(0.0, |row| row[i] - centers[i]));
        for i in 0..self.width {
            let weighted = weight * deviation(i);
            self.first[from + i] += weighted;
            if self.full {
                for j in 0..=i {
                    self.second[(from + i) * self.width + j] += weighted * deviation(j);
                }
            } else {
                self.second[from + i] += weighted * deviation(i);
            }
        }
    }

    /// The likeliest distribution of a state; `None` where hardly a row is of it. `floors` are the least variances, of each
    /// column; `before` is what the state had been.
    pub fn emission(&self, state: usize, family: Family, floors: &[f64], before: Option<&Emission>) -> Option<Emission> {
        // A mean and a spread of less than a row are no estimate.
        if self.rows(state) < 1.0 {
            return None;
        }
        let (columns, weight) = (state * self.width..(state + 1) * self.width, self.weight(state));
        let shift: Vec<f64> = self.first[columns.clone()].iter().map(|sum| both(*sum) / weight).collect();
        let mean = shift.iter().zip(&self.centers[columns.clone()]).map(|(shift, center)| center + shift).collect();
        let spread = if self.full {
            Spread::Full(self.covariance(state, &shift, floors))
        } else {
            // Of a Student's t squares are weighted, but divided by the number of rows.
            let squares = self.second[columns].iter().zip(&shift).zip(floors);
            let variance = |sum: f64, shift: f64| (sum - weight * shift * shift) / self.rows(state);
            Spread::Diagonal(squares.map(|((sum, shift), floor)| variance(both(*sum), *shift).max(*floor)).collect())
        };
        let degrees = match family {
            Family::Gaussian | Family::GaussianFull => None,
            Family::StudentT(Degrees::Fixed(degrees)) => Some(degrees),
            Family::StudentT(Degrees::Fitted) => Some(match before.and_then(|b| b.degrees) {
                Some(degrees) => self.degrees(state, degrees),
                None => 8.0,
            }),
        };
        Some(Emission { mean, spread, degrees })
    }

    /// The covariance, of which no direction is narrower than the floors.
    fn covariance(&self, state: usize, shift: &[f64], floors: &[f64]) -> Vec<Vec<f64>> {
        let (width, weight) = (self.width, self.weight(state));
        let sums = &self.second[state * width * width..][..width * width];
        let scaled = DMatrix::from_fn(width, width, |i, j| {
            let sum = both(sums[i.max(j) * width + i.min(j)]);
            (sum / weight - shift[i] * shift[j]) / (floors[i] * floors[j]).sqrt()
        });
        let SymmetricEigen { mut eigenvalues, eigenvectors } = SymmetricEigen::new(scaled.clone());
        let floored = if eigenvalues.min() < 1.0 {
            eigenvalues.apply(|value| *value = value.max(1.0));
            &eigenvectors * DMatrix::from_diagonal(&eigenvalues) * eigenvectors.transpose()
        } else {
            scaled
        };
        let element = |i: usize, j: usize| floored[(i.max(j), i.min(j))] * (floors[i] * floors[j]).sqrt();
        (0..width).map(|i| (0..width).map(|j| element(i, j)).collect()).collect()
    }

    /// The likeliest degrees of freedom, given the weights that rows had under `before` (D. Peel and G. J. McLachlan, *Robust
    /// mixture modelling using the t distribution*, Statistics and Computing 10, 2000, equation 30).
    fn degrees(&self, state: usize, before: f64) -> f64 {
        let half = 0.5 * (before + self.width as f64);
        let known = 1.0 + both(self.spans[state]) / self.rows(state) + digamma(half) - half.ln();
        let slope = |nu: f64| (0.5 * nu).ln() - digamma(0.5 * nu) + known;
        // It falls from infinity at 0.
        let (mut low, mut high) = FITTED_DEGREES;
        if slope(low) <= 0.0 {
            return low;
        }
        if slope(high) >= 0.0 {
            return high;
        }
        while high - low > 1e-9 * high {
            let middle = 0.5 * (low + high);
            if slope(middle) > 0.0 { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    }
}

/// The sum of two sums.
fn both(sums: f64x2) -> f64 {
    sums.at(0) + sums.at(1)
}

/// Which of two values were observed, as a mask; and the values, 0 where one was lost.
#[inline(always)]
fn observed(values: f64x2) -> (f64x2, f64x2) {
    let here = values.cmp_eq(values);
    (here, values & here)
}
