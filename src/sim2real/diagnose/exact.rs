//! Channels without noise, such as fees: where they are explained, and what may be left of them.

use super::decision::ABOVE_THE_NOISE;
use super::hypothesis::{Hypothesis, Inquiry};
use super::selection::Selection;
use crate::sim2real::Twin;
use crate::sim2real::identify::{Block, Fit};

/// A row of a channel without noise is off by more than this, in roundings, and more rows than one are, where something is missing.
const FAR_OFF: f64 = 5.0;
const FEWEST: usize = 2;
/// A limit that varies from order to order leaves this part of the squares at most, where it varies by a third of what it takes away.
const VARIES: f64 = 0.1;

/// Whether channels without noise are further off than their rounding, in more than one row, and by more than what is named
/// leaves where it varies from row to row: of the squares the recalibrated twin leaves there, no more than [`VARIES`].
pub(super) fn inexact<T: Twin>(inquiry: &Inquiry<'_, T>, selection: &Selection<T>) -> bool {
    let exact = |name: &str| is_exact(inquiry, name);
    let Selection { recalibrated, selected, .. } = selection;
    let squares =
        |channel: &str| recalibrated.misfits.iter().find(|m| m.channel == channel).map_or(0.0, |m| m.sum_of_squares);
    let off = selected.misfits.iter().any(|m| {
        let left = m.sum_of_squares > VARIES * squares(&m.channel);
        exact(&m.channel) && left && !m.within(ABOVE_THE_NOISE, 1.0)
    });
    let blocks = inquiry.problem(&selected.twin, &inquiry.evidence.compared).blocks();
    let rows = blocks.into_iter().filter(|block| exact(&block.channel)).flat_map(|block| block.range);
    off && rows.filter(|row| selected.fit.residual[*row].abs() > FAR_OFF).count() >= FEWEST
}

/// The parameters that nothing depends on but channels without noise, where these are explained to within their rounding: what is
/// charged is charged by a rule.
pub(super) fn by_a_rule<T: Twin>(inquiry: &Inquiry<'_, T>, hypothesis: &Hypothesis<T>, fit: &Fit) -> Vec<usize> {
    let exact = |name: &str| is_exact(inquiry, name);
    let loose = hypothesis.misfits.iter().any(|misfit| exact(&misfit.channel) && !misfit.within(ABOVE_THE_NOISE, 1.0));
    if loose || !inquiry.twin.channels().iter().any(|channel| channel.exact) {
        return Vec::new();
    }
    let problem = inquiry.problem(&hypothesis.twin, &inquiry.evidence.compared);
    let blocks: Vec<Block> = problem.blocks().into_iter().filter(|block| !exact(&block.channel)).collect();
    let residual = |values: &[f64]| problem.evaluate(values, &hypothesis.fit.state, &[]).residual;
    let at = residual(&fit.values);
    let moves = |k: &usize| {
        let mut values = fit.values.clone();
        values[*k] = if values[*k] == 0.0 { hypothesis.twin.parameters()[*k].scale() } else { 1.2 * values[*k] };
        let moved = residual(&values);
        blocks.iter().any(|block| block.range.clone().any(|row| (moved[row] - at[row]).abs() > 1e-9))
    };
    (inquiry.twin.parameters().len()..fit.values.len()).filter(|k| !moves(k)).collect()
}

fn is_exact<T: Twin>(inquiry: &Inquiry<'_, T>, channel: &str) -> bool {
    inquiry.twin.channels().iter().any(|known| known.exact && known.name == channel)
}
