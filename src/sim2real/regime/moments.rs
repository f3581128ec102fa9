//! What a series amounts to in each state: the sums of which a state's distribution is estimated.

use nalgebra::{DMatrix, SymmetricEigen};
use pulp::{Arch, NullaryFnOnce};
use statrs::function::gamma::digamma;

use super::densities::{Densities, bounded};
use super::ends::LANES;
use super::{Degrees, Emission, Family, Spread};
use crate::sim2real::elementary::ln_1p;

/// Sums that are added to side by side: as many on every machine, so that the total has the same bits.
const SUMS: usize = 32;

type Sums = [f64; SUMS];

/// Bounds of degrees of freedom that are fitted: above 2, so that there is a variance; from 200 on it is a Gaussian.
const FITTED_DEGREES: (f64, f64) = (2.1, 200.0);

/// Sums over rows, weighted by the probability of each state. Deviations are from `centers`, so that no digits are lost in
/// the difference of squares where a mean is far from 0.
#[derive(Debug, Clone)]
pub(super) struct Moments {
    width: usize,
    /// `[state][column]`.
    centers: Vec<f64>,
    /// Sum of probabilities of rows that were observed.
    rows: Vec<Sums>,
    /// The same, of a Student's t with each row weighted by how little it strays.
    weights: Vec<Sums>,
    /// Sum of logarithms of these weights less the weights.
    spans: Vec<Sums>,
    /// Weighted sum of deviations, `[state][column]`.
    first: Vec<Sums>,
    /// Of their squares, `[state][column]`, or of their products, `[state][column][column]`, of which the lower half is set.
    second: Vec<Sums>,
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
            rows: vec![[0.0; SUMS]; states],
            weights: vec![[0.0; SUMS]; states],
            spans: vec![[0.0; SUMS]; states],
            first: vec![[0.0; SUMS]; states * width],
            second: vec![[0.0; SUMS]; second],
            centers,
            full,
            heavy: false,
        }
    }

    /// Adds a row of which the state is known, and of which nothing was lost.
    pub fn add_row(&mut self, row: &[f64], state: usize) {
        let from = state * self.width;
        let deviation = |i: usize| row[i] - self.centers[from + i];
        self.rows[state][0] += 1.0;
        for i in 0..self.width {
            self.first[from + i][0] += deviation(i);
            if self.full {
                for j in 0..=i {
                    self.second[(from + i) * self.width + j][0] += deviation(i) * deviation(j);
                }
            } else {
                self.second[from + i][0] += deviation(i) * deviation(i);
            }
        }
    }

    /// Adds rows side by side, `[column][row]`, with the probability of each state, `[state][row]`; one that was lost adds nothing.
    /// What was lost of columns is overwritten.
    pub fn add(&mut self, columns: &mut [[f64; LANES]], probabilities: &[[f64; LANES]], densities: &Densities) {
        self.heavy = densities.degrees.is_some();
        Arch::new().dispatch(Addition { moments: self, columns, probabilities, densities });
    }

    /// Sum of probabilities of a state's rows.
    pub fn rows(&self, state: usize) -> f64 {
        total(self.rows[state])
    }

    /// Weight of a state's rows: of a Gaussian all count as they are.
    fn weight(&self, state: usize) -> f64 {
        total(if self.heavy { self.weights[state] } else { self.rows[state] })
    }

    /// The likeliest distribution of a state; `None` where hardly a row is of it. `floors` are the least variances, of each
    /// column; `before` is what the state had been.
    pub fn emission(&self, state: usize, family: Family, floors: &[f64], before: Option<&Emission>) -> Option<Emission> {
        // A mean and a spread of less than a row are no estimate.
        if self.rows(state) < 1.0 {
            return None;
        }
        let (columns, weight) = (state * self.width..(state + 1) * self.width, self.weight(state));
        let shift: Vec<f64> = self.first[columns.clone()].iter().map(|sum| total(*sum) / weight).collect();
        let mean = shift.iter().zip(&self.centers[columns.clone()]).map(|(shift, center)| center + shift).collect();
        let spread = if self.full {
            Spread::Full(self.covariance(state, &shift, floors))
        } else {
            // Of a Student's t squares are weighted, but divided by the number of rows.
            let squares = self.second[columns].iter().zip(&shift).zip(floors);
            let variance = |sum: f64, shift: f64| (sum - weight * shift * shift) / self.rows(state);
            Spread::Diagonal(squares.map(|((sum, shift), floor)| variance(total(*sum), *shift).max(*floor)).collect())
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
            let sum = total(sums[i.max(j) * width + i.min(j)]);
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
        let known = 1.0 + total(self.spans[state]) / self.rows(state) + digamma(half) - half.ln();
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

fn total(sums: Sums) -> f64 {
    sums.iter().sum()
}

/// What [`Moments::add`] does, with the widest vectors of the processor.
struct Addition<'a> {
    moments: &'a mut Moments,
    columns: &'a mut [[f64; LANES]],
    probabilities: &'a [[f64; LANES]],
    densities: &'a Densities,
}

impl NullaryFnOnce for Addition<'_> {
    type Output = ();

    // What is not inlined here is compiled without the processor's vectors.
    #[inline(always)]
    fn call(self) {
        let Self { moments, columns, probabilities, densities } = self;
        let width = moments.width;
        let mut here = [true; LANES];
        for column in columns.iter_mut() {
            for k in 0..LANES {
                let lost = column[k].is_nan();
                here[k] &= !lost;
                // Nothing times what is no number would be no number either.
                column[k] = if lost { 0.0 } else { column[k] };
            }
        }
        let (mut kept, mut weights) = ([0.0; LANES], [0.0; LANES]);
        for (state, probabilities) in probabilities.iter().enumerate() {
            for k in 0..LANES {
                kept[k] = if here[k] { probabilities[k] } else { 0.0 };
            }
            add_products(&mut moments.rows[state], &kept, &[1.0; LANES]);
            if let Some(degrees) = &densities.degrees {
                let (nu, wide) = (degrees[state], width as f64);
                let (distances, mut spans) = (densities.distances(state, columns), [0.0; LANES]);
                for k in 0..LANES {
                    let weight = (nu + wide) / (nu + distances[k]);
                    weights[k] = kept[k] * weight;
                    spans[k] = ln_1p(wide / nu) - ln_1p(bounded(distances[k] / nu)) - weight;
                }
                add_products(&mut moments.weights[state], &weights, &[1.0; LANES]);
                add_products(&mut moments.spans[state], &kept, &spans);
            } else {
                weights = kept;
            }
            let from = state * width;
            let centers = &moments.centers[from..][..width];
            for (i, (column, center)) in columns.iter().zip(centers).enumerate() {
                let sums = &mut moments.second[if moments.full { (from + i) * width + i } else { from + i }];
                add_deviations([&mut moments.first[from + i], sums], &weights, column, *center);
                for j in 0..if moments.full { i } else { 0 } {
                    let sums = &mut moments.second[(from + i) * width + j];
                    add_joint(sums, &weights, [column, &columns[j]], [*center, centers[j]]);
                }
            }
        }
    }
}

/// Adds weighted deviations, and their squares.
#[inline(always)]
fn add_deviations(sums: [&mut Sums; 2], weights: &[f64; LANES], column: &[f64; LANES], center: f64) {
    let [first, second] = sums;
    let mut added = [*first, *second];
    for (weights, xs) in weights.as_chunks::<SUMS>().0.iter().zip(column.as_chunks::<SUMS>().0) {
        for k in 0..SUMS {
            let deviation = xs[k] - center;
            let weighted = weights[k] * deviation;
            added[0][k] += weighted;
            added[1][k] += weighted * deviation;
        }
    }
    [*first, *second] = added;
}

/// Adds weighted products of the deviations in two columns.
#[inline(always)]
fn add_joint(sums: &mut Sums, weights: &[f64; LANES], columns: [&[f64; LANES]; 2], centers: [f64; 2]) {
    let mut added = *sums;
    let [a, b] = columns.map(|column| column.as_chunks::<SUMS>().0);
    for ((weights, a), b) in weights.as_chunks::<SUMS>().0.iter().zip(a).zip(b) {
        for k in 0..SUMS {
            added[k] += weights[k] * (a[k] - centers[0]) * (b[k] - centers[1]);
        }
    }
    *sums = added;
}

/// Adds products, in one order on every machine.
#[inline(always)]
fn add_products(sums: &mut Sums, a: &[f64; LANES], b: &[f64; LANES]) {
    let mut added = *sums;
    for (a, b) in a.as_chunks::<SUMS>().0.iter().zip(b.as_chunks::<SUMS>().0) {
        for k in 0..SUMS {
            added[k] += a[k] * b[k];
        }
    }
    *sums = added;
}
