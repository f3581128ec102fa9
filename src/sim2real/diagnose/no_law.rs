//! What no law knows: whether messages depend on such a quantity more than on what was named.
//!
//! A law that happens to go with it explains a part of it, perhaps nearly all: where purchases and sales take turns and the ones cost
//! more than the others, a permanent impact does. But it is the quantity that explains most, in as few words, and what depends on it
//! is nothing that the library has.

use super::hypothesis::{Hypothesis, Inquiry};
use super::locate::{Covariates, identity};
use super::select::{ACCEPT, Selection};
use super::structure::{about_groups, told_at_most};
use crate::sim2real::Twin;
use crate::sim2real::identify::Block;

/// Whether a quantity that no law knows explains more of what is left without something that was named than that does.
pub(super) fn explains_more<T: Twin>(inquiry: &Inquiry<'_, T>, selection: &Selection<T>, covariates: &Covariates) -> bool {
    let parts = &inquiry.evidence.compared;
    let of_part = |part: usize| covariates.get(&identity(parts[part].recording)).map_or(&[][..], Vec::as_slice);
    let mut unknown: Vec<&str> = (0..parts.len()).flat_map(|part| of_part(part).iter().map(|(name, _)| *name)).collect();
    unknown.retain(|name| inquiry.twin.no_law_knows(name));
    unknown.sort_unstable();
    unknown.dedup();
    if unknown.is_empty() {
        return false;
    }
    let blocks = inquiry.problem(&selection.selected.twin, parts).blocks();
    selection.selected.misfits.iter().any(|misfit| {
        let own: Vec<&Block> = blocks.iter().filter(|block| block.channel == misfit.channel).collect();
        unknown.iter().any(|name| {
            let by: Vec<f64> = own.iter().flat_map(|block| values(of_part(block.part), name, &block.rows)).collect();
            let left = |h: &Hypothesis<T>| -> Vec<f64> {
                own.iter().flat_map(|block| h.fit.residual.as_slice()[block.range.clone()].iter().copied()).collect()
            };
            let with = left(&selection.selected);
            selection.without.iter().any(|less| beaten(&left(less), &with, &by))
        })
    })
}

/// A covariate in some rows; not a number where it is not known.
fn values<'a>(covariates: &'a [(&'static str, Vec<f64>)], name: &str, rows: &'a [usize]) -> impl Iterator<Item = f64> + 'a {
    let known = covariates.iter().find(|(own, _)| *own == name).map(|(_, values)| values);
    rows.iter().map(move |row| known.map_or(f64::NAN, |values| values[*row]))
}

/// Whether groups of residuals without a law by a quantity tell something of them, and more than the law does, by evidence as strong as a
/// mechanism needs: `without` and `with` it, about their means, wild ones all drawn in as far.
fn beaten(without: &[f64], with: &[f64], by: &[f64]) -> bool {
    let known = about_groups(without, by).filter(|(_, left)| left.len() == with.len());
    let Some((groups, by_groups)) = known else { return false };
    let rows = with.len() as f64;
    let about_mean = |left: &[f64]| -> Vec<f64> {
        let mean = left.iter().sum::<f64>() / rows;
        left.iter().map(|r| r - mean).collect()
    };
    let by_law = about_mean(with);
    let most = told_at_most(&by_law);
    let squares = |left: &[f64]| left.iter().map(|r| r.clamp(-most, most).powi(2)).sum::<f64>().max(f64::MIN_POSITIVE);
    let left = squares(&by_groups);
    let beside = |others: &[f64], constants: f64| {
        rows * (squares(others) / left).ln() - (groups as f64 - constants) * rows.ln() > ACCEPT
    };
    // A mean is one constant, a law has one besides.
    beside(&about_mean(without), 1.0) && beside(&by_law, 2.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Purchases and sales take turns, and so does the price that they have moved, but for two purchases now and then.
    #[test]
    fn what_goes_with_the_side_is_beaten_by_it_where_it_is_the_side() {
        let rows = 0..400;
        let noise = |row: usize| 0.3 * ((row * 7_919 % 997) as f64 / 997.0 - 0.5);
        let side: Vec<f64> = rows.clone().map(|row| if row % 2 == 0 || row % 10 == 5 { 1.0 } else { -1.0 }).collect();
        let moved: Vec<f64> = rows.clone().map(|row| if row % 2 == 0 { 1.0 } else { -1.0 }).collect();
        let left = |cost: &[f64], law: f64, state: &[f64]| -> Vec<f64> {
            rows.clone().map(|row| cost[row] + noise(row) - law * state[row]).collect()
        };
        assert!(beaten(&left(&side, 0.0, &moved), &left(&side, 0.8, &moved), &side));
        assert!(!beaten(&left(&moved, 0.0, &moved), &left(&moved, 1.0, &moved), &side));
        assert!(
            !beaten(&left(&side, 0.0, &side), &left(&side, 1.0, &side), &side),
            "what cannot be told apart keeps its name"
        );
        assert!(!beaten(&left(&side, 0.0, &side), &left(&side, 0.8, &moved), &[f64::NAN; 400]));
    }
}
