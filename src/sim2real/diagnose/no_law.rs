//! What no law knows: whether messages depend on such a quantity more than on what was named.
//!
//! A law that happens to go with it explains a part of it, perhaps nearly all: where purchases and sales take turns and the ones cost
//! more than the others, a permanent impact does. But it is the quantity that explains most, in as few words, and what depends on it
//! is nothing that the library has.

use super::hypothesis::{Hypothesis, Inquiry};
use super::locate::{Covariates, identity};
use super::selection::Selection;
use super::structure::{about_groups, told_at_most};
use super::weigh::ACCEPT;
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
    let of_channel = |channel: &str| blocks.iter().filter(|block| block.channel == channel).collect::<Vec<&Block>>();
    let channels: Vec<Vec<&Block>> = selection.selected.misfits.iter().map(|m| of_channel(&m.channel)).collect();
    selection.without.iter().any(|less| {
        let both = |blocks: &[&Block]| [less, &selection.selected].map(|h| left_by(h, blocks));
        let moved = |blocks: &[&Block]| -> f64 {
            let [without, with] = both(blocks);
            without.iter().zip(&with).map(|(without, with)| (without - with).powi(2)).sum()
        };
        // Where it does most: elsewhere it explains nothing.
        let Some(own) = channels.iter().max_by(|a, b| moved(a).total_cmp(&moved(b))) else { return false };
        let [without, with] = both(own);
        unknown.iter().any(|name| {
            let by: Vec<f64> = own.iter().flat_map(|block| values(of_part(block.part), name, &block.rows)).collect();
            beaten(&without, &with, &by)
        })
    })
}

/// What a hypothesis leaves of some blocks, in units of the noise.
fn left_by<T>(hypothesis: &Hypothesis<T>, blocks: &[&Block]) -> Vec<f64> {
    blocks.iter().flat_map(|block| hypothesis.fit.residual.as_slice()[block.range.clone()].iter().copied()).collect()
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
    let (by_mean, by_law) = (about_mean(without), about_mean(with));
    let most = told_at_most(&by_mean);
    let squares = |left: &[f64]| left.iter().map(|r| r.clamp(-most, most).powi(2)).sum::<f64>().max(f64::MIN_POSITIVE);
    let left = squares(&by_groups);
    let beside = |others: &[f64], constants: f64| {
        rows * (squares(others) / left).ln() - (groups as f64 - constants) * rows.ln() > ACCEPT
    };
    // A mean is one constant, a law has one besides.
    beside(&by_mean, 1.0) && beside(&by_law, 2.0)
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
        // Of four hundred orders a limit cuts ten, nine of them purchases.
        let cut: Vec<f64> = rows.clone().map(|row| if row % 44 == 0 || row == 33 { -20.0 } else { 0.0 }).collect();
        assert!(!beaten(&cut, &left(&[0.0; 400], 0.0, &side), &side));
    }
}
