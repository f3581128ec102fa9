//! What is left: noise, which nothing foretells, or physics, which the motion foretells.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::whiteness::autocorrelation_time;
use crate::sim2real::Covariate;

/// Groups into which a covariate is cut for the F test.
const GROUPS: usize = 8;

/// A residual beyond this quantile of its size is drawn in to it: a few wild orders must not hide what the many say.
const WINSOR: f64 = 0.95;
/// A residual of this part of the largest is nothing.
const NOTHING: f64 = 1e-3;

/// A residual counts as structured where a covariate's F test is this strong (-log10 p): complete models reach 5.
pub(super) const DEPENDENT: f64 = 6.5;

/// A covariate that the mean residual depends on.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Dependence {
    /// The covariate.
    pub on: &'static str,
    /// -log10 of the probability of as strong a dependence by chance.
    pub strength: f64,
    /// What it explains of the sum of squared residuals, beyond what chance would.
    pub explained: f64,
}

/// The strongest dependence of mean residuals on a covariate: a one-way analysis of variance over quantile groups
/// (Fisher 1925) of the winsorized residuals.
///
/// For residuals of orders: what one has in common with the next beside the dependence takes as much away from the evidence.
pub(super) fn strongest_dependence(residual: &[f64], rows: &[usize], covariates: &[Covariate]) -> Option<Dependence> {
    let winsorized = winsorize(residual);
    covariates
        .iter()
        .filter_map(|(on, values)| {
            let own: Vec<f64> = rows.iter().map(|row| values[*row]).collect();
            let (strength, explained) = analysis_of_variance(&winsorized, &own)?;
            Some(Dependence { on, strength, explained })
        })
        .max_by(|a, b| a.strength.total_cmp(&b.strength))
}

fn winsorize(residual: &[f64]) -> Vec<f64> {
    let limit = told_at_most(residual);
    residual.iter().map(|r| r.max(-limit).min(limit)).collect()
}

/// The size that winsorized residuals have at most.
pub(super) fn told_at_most(residual: &[f64]) -> f64 {
    let largest = residual.iter().fold(0.0_f64, |most, r| most.max(r.abs()));
    // Where most are nothing at all, as of orders that are filled but for a few, these few are what there is to say.
    let mut sizes: Vec<f64> = residual.iter().map(|r| r.abs()).filter(|size| *size > NOTHING * largest).collect();
    sizes.sort_by(f64::total_cmp);
    sizes.get(((sizes.len() as f64 * WINSOR) as usize).min(sizes.len().saturating_sub(1))).copied().unwrap_or(0.0)
}

/// -log10 of the p-value that the mean of `values` is the same in all quantile groups of `by`, and the sum of squares that the groups
/// explain beyond chance. Values within groups that have something in common with those before them, as noise that remembers itself
/// has, count as so many fewer.
fn analysis_of_variance(values: &[f64], by: &[f64]) -> Option<(f64, f64)> {
    let order = in_order(by);
    let groups = cut(&order, by);
    let count: usize = groups.iter().map(|g| g.len()).sum();
    if groups.len() < 2 || count < groups.len() + 10 {
        return None;
    }
    let mean = |rows: &[usize]| mean(values, rows);
    let all = mean(&order);
    let between: f64 = groups.iter().map(|g| g.len() as f64 * (mean(g) - all).powi(2)).sum();
    let mut left = about_means(values, &groups);
    let within: f64 = left.iter().map(|(_, left)| left * left).sum();
    let (df1, df2) = ((groups.len() - 1) as f64, (count - groups.len()) as f64);
    let explained = (between - df1 * within / df2).max(0.0);
    if within <= 0.0 {
        return Some((if between > 0.0 { 300.0 } else { 0.0 }, explained));
    }
    // As they follow one another.
    left.sort_by_key(|(i, _)| *i);
    let left: Vec<f64> = left.into_iter().map(|(_, left)| left).collect();
    let remembered = autocorrelation_time(&[&left]).max(1.0);
    let f = FisherSnedecor::new(df1, df2).ok()?;
    let p = f.sf(between / df1 / (within / df2) / remembered).max(1e-300);
    Some((-p.log10(), explained))
}

/// The number of quantile groups of `by`, two or more, and `values` about their means in these.
pub(super) fn about_groups(values: &[f64], by: &[f64]) -> Option<(usize, Vec<f64>)> {
    let order = in_order(by);
    let groups = cut(&order, by);
    let left = || about_means(values, &groups).into_iter().map(|(_, left)| left).collect();
    (groups.len() > 1).then(|| (groups.len(), left()))
}

/// The rows of what is known, by its size.
fn in_order(by: &[f64]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..by.len()).filter(|i| by[*i].is_finite()).collect();
    order.sort_by(|a, b| by[*a].total_cmp(&by[*b]));
    order
}

fn mean(values: &[f64], rows: &[usize]) -> f64 {
    rows.iter().map(|i| values[*i]).sum::<f64>() / rows.len() as f64
}

/// Rows, and by how much their values differ from the mean of their group.
fn about_means(values: &[f64], groups: &[&[usize]]) -> Vec<(usize, f64)> {
    let of_group = |group: &&[usize]| {
        let own = mean(values, group);
        group.iter().map(move |i| (*i, values[*i] - own)).collect::<Vec<_>>()
    };
    groups.iter().flat_map(of_group).collect()
}

/// Quantile groups of the sorted rows; equal values stay together.
fn cut<'a>(order: &'a [usize], by: &[f64]) -> Vec<&'a [usize]> {
    let mut groups = Vec::new();
    let mut from = 0;
    for k in 1..=GROUPS {
        let mut to = (order.len() * k / GROUPS).max(from);
        while to > from && to < order.len() && by[order[to]] == by[order[to - 1]] {
            to += 1;
        }
        if to > from {
            groups.push(&order[from..to]);
            from = to;
        }
    }
    groups
}

/// What is left of the first channel in a stretch of a recording.
pub(super) struct Left {
    /// What tells its recording from others.
    pub recording: usize,
    /// Residuals, in units of the noise.
    pub residual: Vec<f64>,
    /// The rows they belong to.
    pub rows: Vec<usize>,
}

/// The share of the held-out squared residual that a regression on the covariates, learnt on the fitted rows, foretells.
///
/// For sampled signals, whose residuals depend on one another: noise, however coloured, is not foretold on data the
/// regression has not seen; missing physics is. Each covariate enters with its square, its sign, its past, and
/// multiplied by time.
pub(super) fn foretold(fitted: &[Left], held_out: &[Left], covariates: &BTreeMap<usize, Vec<Covariate>>) -> f64 {
    let (Some(train), Some(test)) = (stack(fitted, covariates), stack(held_out, covariates)) else { return 0.0 };
    let (design, target) = train;
    let center = design.row_mean();
    let spread: Vec<f64> = design.column_iter().map(|c| c.variance().sqrt()).collect();
    // What did not vary while it was learnt from says nothing, however it varies later.
    let standard = |m: &DMatrix<f64>| {
        DMatrix::from_fn(m.nrows(), m.ncols(), |i, k| {
            let constant = spread[k] <= 1e-9 * center[k].abs().max(1e-12);
            if constant { 0.0 } else { (m[(i, k)] - center[k]) / spread[k] }
        })
    };
    let x = standard(&design);
    let mut information = x.tr_mul(&x);
    let ridge = 1e-2 * x.nrows() as f64;
    (0..x.ncols()).for_each(|k| information[(k, k)] += ridge);
    let Some(inverse) = information.try_inverse() else { return 0.0 };
    let mean = target.mean();
    let weights = inverse * x.tr_mul(&target.add_scalar(-mean));
    let (design, target) = test;
    let left = (target.add_scalar(-mean) - standard(&design) * weights).norm_squared();
    let whole = target.norm_squared();
    if whole > 0.0 { (1.0 - left / whole).max(0.0) } else { 0.0 }
}

/// Rows a regression uses at the most, or little more.
const ROWS: usize = 6_000;

/// Lags, in rows, at which covariates enter the regression: what acts inside a plant shows in its output for a while.
const LAGS: [usize; 7] = [0, 6, 15, 30, 60, 100, 160];

/// Of these, those at which they enter by time as well.
const LATER: [usize; 4] = [0, 15, 60, 160];

fn stack(pieces: &[Left], covariates: &BTreeMap<usize, Vec<Covariate>>) -> Option<(DMatrix<f64>, DVector<f64>)> {
    let mut rows: Vec<Vec<f64>> = Vec::new();
    let mut target = Vec::new();
    // Some thousands of rows say as much as all of a slow signal.
    let total: usize = pieces.iter().map(|p| p.rows.len()).sum();
    let step = (total / ROWS).max(1);
    for piece in pieces {
        let Some(columns) = covariates.get(&piece.recording) else { continue };
        for (value, row) in piece.residual.iter().zip(&piece.rows).step_by(step) {
            let features = columns.iter().flat_map(|(_, c)| {
                let now = LAGS.iter().flat_map(move |lag| {
                    let v = c[row.saturating_sub(*lag)];
                    [v, v * v, v * v.abs(), if v > 0.0 { 1.0 } else { -1.0 }]
                });
                // What changes with time, as oil that warms, shows in how the same motion is answered later.
                let later = LATER.iter().map(move |lag| c[row.saturating_sub(*lag)] * *row as f64);
                now.chain(later)
            });
            rows.push(features.collect());
            target.push(*value);
        }
    }
    let width = rows.first()?.len();
    (rows.len() > 3 * width && width > 0)
        .then(|| (DMatrix::from_fn(rows.len(), width, |i, k| rows[i][k]), DVector::from_vec(target)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim2real::Seed;
    use rand_distr::{Distribution, StandardNormal};

    #[test]
    fn a_dependence_is_seen_and_chance_is_not() {
        let mut rng = Seed(5).stream("structure");
        let mut draw = || -> f64 { StandardNormal.sample(&mut rng) };
        let size: Vec<f64> = (0..600).map(|_| draw().abs()).collect();
        let noise: Vec<f64> = (0..600).map(|_| draw()).collect();
        let with: Vec<f64> = noise.iter().zip(&size).map(|(n, s)| n + if *s > 1.0 { 1.0 } else { 0.0 }).collect();
        let rows: Vec<usize> = (0..600).collect();
        let covariates = [("size", size)];
        assert!(strongest_dependence(&with, &rows, &covariates).unwrap().strength > 12.0);
        assert!(strongest_dependence(&noise, &rows, &covariates).unwrap().strength < 4.0);
    }

    /// Noise that remembers itself differs from one time of day to the next, and that says nothing.
    #[test]
    fn what_noise_has_in_common_with_itself_is_no_dependence() {
        let mut rng = Seed(6).stream("structure");
        let mut draw = || -> f64 { StandardNormal.sample(&mut rng) };
        let mut last = 0.0;
        let coloured: Vec<f64> = (0..800)
            .map(|_| {
                last = 0.9 * last + draw();
                last
            })
            .collect();
        let rows: Vec<usize> = (0..800).collect();
        let number: Vec<f64> = rows.iter().map(|row| *row as f64).collect();
        let found = strongest_dependence(&coloured, &rows, &[("number", number.clone())]).unwrap();
        assert!(found.strength < 5.0, "{found:?}");
        let later: Vec<f64> = coloured.iter().zip(&number).map(|(n, k)| n + 0.012 * k).collect();
        let found = strongest_dependence(&later, &rows, &[("number", number)]).unwrap();
        assert!(found.strength > 7.0, "what is there besides is: {found:?}");
        let all: f64 = later.iter().map(|v| v * v).sum();
        assert!(found.explained > 0.1 * all && found.explained < all, "{found:?} of {all}");
    }

    #[test]
    fn a_covariate_with_few_values_is_cut_between_them() {
        let by = [1.0, 1.0, 1.0, 2.0, 2.0, 2.0];
        let order = [0, 1, 2, 3, 4, 5];
        assert_eq!(cut(&order, &by), vec![&[0, 1, 2][..], &[3, 4, 5][..]]);
    }
}
