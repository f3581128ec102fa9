//! How far the mid goes with an order, by the time since and by its size.

use crate::sim2real::{Seed, Timestamp};

use super::blocks::{Estimated, block_count, interval};
use super::mids::{Felt, MidTrack};
use super::power_law::{Point, fit};

/// The mean move of the mid with an order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeanMove {
    /// From the last execution of an order to where the mid is read [s].
    pub delay: f64,
    /// Mean over the orders [bps]; none where the tape ends before for all of them.
    pub mean: Option<f64>,
    /// Its 95 % interval [bps]; none where the tape is too short for one.
    pub ci95: Option<[f64; 2]>,
    /// How many orders it is of.
    pub orders: usize,
}

/// The moves of some orders, cut into blocks of time: sum and count of each.
fn in_blocks(rows: &[(Timestamp, f64)], begin: Timestamp, span: f64, blocks: usize) -> Vec<[f64; 2]> {
    let mut sums = vec![[0.0; 2]; blocks];
    for (at, moved) in rows {
        let block = (at.seconds_since(begin) / span * blocks as f64) as usize;
        let sum = &mut sums[block.min(blocks - 1)];
        *sum = [sum[0] + moved, sum[1] + 1.0];
    }
    sums
}

fn mean_of(sums: &[[f64; 2]], drawn: &[usize]) -> Option<f64> {
    let sum = drawn.iter().fold([0.0; 2], |[sum, count], block| [sum + sums[*block][0], count + sums[*block][1]]);
    (sum[1] > 0.0).then(|| sum[0] / sum[1])
}

/// The mean of `side * (mid after - mid before)` at each of `delays` [s] after the last execution of an order: R(tau).
///
/// Before is when nothing of the order was known. It is what follows an order, not what it does: the orders that come after it
/// are in it. Intervals are by blocks of time twice as long as the delay; where there are not eight of them, there is none.
#[must_use]
pub fn mean_moves(orders: &[Felt], mids: &MidTrack, delays: &[f64], seed: Seed) -> Vec<MeanMove> {
    let mean = |delay: &f64| {
        let moved = |order: &Felt| {
            let moved = mids.signed_move(order.side, order.came_at, order.done_at.plus_seconds(*delay))?;
            Some((order.came_at, moved))
        };
        let rows: Vec<(Timestamp, f64)> = orders.iter().filter_map(moved).collect();
        let mean = (!rows.is_empty()).then(|| rows.iter().map(|(_, moved)| moved).sum::<f64>() / rows.len() as f64);
        let ci95 = block_count(mids.span(), *delay).and_then(|blocks| {
            let sums = in_blocks(&rows, mids.begin(), mids.span(), blocks);
            interval(blocks, seed.child(&format!("moves at {delay}")), |drawn| mean_of(&sums, drawn))
        });
        MeanMove { delay: *delay, mean, ci95, orders: rows.len() }
    };
    delays.iter().map(mean).collect()
}

/// Orders of about one size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SizeBin {
    /// Geometric mean of their sizes [units].
    pub volume: f64,
    /// Mean move of the mid with them [bps].
    pub mean: f64,
    /// Its standard error, as if they were independent [bps].
    pub std_error: f64,
    /// How many.
    pub orders: usize,
}

/// How the move of the mid depends on the size.
#[derive(Debug, Clone, PartialEq)]
pub struct SizeResponse {
    /// By size, the smallest first.
    pub bins: Vec<SizeBin>,
    /// `psi` of `move ~ size^psi`; none where the moves speak for no power within [-0.5, 2].
    pub exponent: Option<Estimated>,
}

/// One order in its bin.
#[derive(Debug, Clone, Copy)]
struct Row {
    at: Timestamp,
    bin: usize,
    moved: f64,
}

/// The move of the mid `delay` [s] after the last execution of orders, by their size: by weighted least squares on the means of `bins` groups of
/// about as many orders each, each weighted by its standard error. The interval is by blocks of time.
///
/// Source: Lillo, Farmer & Mantegna, "Master curve for price-impact function", Nature 421 (2003).
#[must_use]
pub fn size_response(orders: &[Felt], mids: &MidTrack, delay: f64, bins: usize, seed: Seed) -> Option<SizeResponse> {
    let moved = |order: &Felt| {
        let moved = mids.signed_move(order.side, order.came_at, order.done_at.plus_seconds(delay))?;
        (order.volume > 0.0).then_some((order.came_at, order.volume, moved))
    };
    let known: Vec<(Timestamp, f64, f64)> = orders.iter().filter_map(moved).collect();
    let edges = edges(known.iter().map(|(_, volume, _)| *volume).collect(), bins);
    if edges.len() < 4 {
        return None;
    }
    let bin = |volume: f64| edges.partition_point(|edge| *edge <= volume).saturating_sub(1);
    let rows: Vec<Row> = known.iter().map(|(at, volume, moved)| Row { at: *at, bin: bin(*volume), moved: *moved }).collect();
    let mut logs = vec![[0.0; 2]; edges.len()];
    for (_, volume, _) in &known {
        let sum = &mut logs[bin(*volume)];
        *sum = [sum[0] + volume.ln(), sum[1] + 1.0];
    }
    let volumes: Vec<f64> = logs.iter().map(|[sum, count]| (sum / count).exp()).collect();
    let blocks = block_count(mids.span(), delay)?;
    let sums = bin_sums(&rows, edges.len(), (mids.begin(), mids.span()), blocks);
    let whole: Vec<usize> = (0..blocks).collect();
    let found: Vec<SizeBin> = binned(&sums, &whole, &volumes);
    // The weights are those of the whole tape: a draw has bins with hardly an order, whose error would be nothing.
    let weights: Vec<f64> = found.iter().map(|bin| bin.std_error.max(1e-9).powi(-2)).collect();
    let exponent = |drawn: &[usize]| {
        let points: Vec<Point> = binned(&sums, drawn, &volumes)
            .iter()
            .zip(&weights)
            .filter(|(bin, _)| bin.orders > 0)
            .map(|(bin, weight)| Point { x: bin.volume, y: bin.mean, weight: *weight })
            .collect();
        fit(&points, [-0.5, 2.0]).map(|law| law.exponent)
    };
    let estimated = exponent(&whole).and_then(|value| {
        let ci95 = interval(blocks, seed.child("sizes"), exponent)?;
        Some(Estimated { value, ci95 })
    });
    Some(SizeResponse { bins: found, exponent: estimated })
}

/// Lower ends of groups of about as many each. Sizes that many orders have are in one group.
fn edges(mut volumes: Vec<f64>, bins: usize) -> Vec<f64> {
    volumes.sort_by(f64::total_cmp);
    let mut edges: Vec<f64> =
        (0..bins.max(1)).filter_map(|k| volumes.get(volumes.len() * k / bins.max(1)).copied()).collect();
    edges.dedup();
    edges
}

/// Of each block and bin: count, sum and sum of squares.
fn bin_sums(rows: &[Row], bins: usize, (begin, span): (Timestamp, f64), blocks: usize) -> Vec<Vec<[f64; 3]>> {
    let mut sums = vec![vec![[0.0; 3]; bins]; blocks];
    for row in rows {
        let block = (row.at.seconds_since(begin) / span * blocks as f64) as usize;
        let sum = &mut sums[block.min(blocks - 1)][row.bin];
        *sum = [sum[0] + 1.0, sum[1] + row.moved, sum[2] + row.moved * row.moved];
    }
    sums
}

fn binned(sums: &[Vec<[f64; 3]>], drawn: &[usize], volumes: &[f64]) -> Vec<SizeBin> {
    let of = |(bin, volume): (usize, &f64)| {
        let [count, sum, square] = drawn.iter().fold([0.0; 3], |total, block| {
            let own = sums[*block][bin];
            [total[0] + own[0], total[1] + own[1], total[2] + own[2]]
        });
        let known = count.max(1.0);
        let mean = sum / known;
        let variance = (square / known - mean * mean).max(0.0);
        SizeBin { volume: *volume, mean, std_error: (variance / known).sqrt(), orders: count as usize }
    };
    volumes.iter().enumerate().map(of).collect()
}

#[cfg(test)]
mod tests {
    use rand::RngExt;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;
    use crate::market::Side;

    /// An order a second. It moves the mid by a power of its size, all at once, and half of it is gone two seconds later.
    fn market(count: i64, exponent: f64, noise: f64) -> (Vec<Felt>, MidTrack) {
        let mut draws = Seed(9).stream("market");
        let (mut orders, mut mids, mut log_mid, mut fades) = (Vec::new(), MidTrack::default(), 5.0, [0.0; 2]);
        for second in 0..count {
            let at = Timestamp(second * Timestamp::NANOS);
            let side = if draws.random::<bool>() { Side::Buy } else { Side::Sell };
            let volume = draws.random::<f64>().max(1e-6).powf(-1.0 / 1.5);
            let draw: f64 = StandardNormal.sample(&mut draws);
            log_mid += 1e-4 * noise * draw - fades[0];
            mids.push(at, f64::exp(log_mid));
            let moved = 1e-4 * side.sign() * volume.powf(exponent);
            log_mid += moved;
            fades = [fades[1], 0.5 * moved];
            mids.push(at + 10, f64::exp(log_mid));
            orders.push(Felt { came_at: at, done_at: at + 10, side, volume });
        }
        (orders, mids)
    }

    #[test]
    fn the_power_of_the_size_is_found_within_its_interval() {
        for exponent in [0.2, 0.5, 1.0] {
            let (orders, mids) = market(4_000, exponent, 0.3);
            let found = size_response(&orders, &mids, 0.0, 10, Seed(1)).unwrap();
            let own = found.exponent.unwrap();
            assert!((own.value - exponent).abs() < 0.1, "{own:?}, not {exponent}");
            assert!(own.ci95[0] - 0.05 < exponent && exponent < own.ci95[1] + 0.05, "{own:?}");
            assert_eq!(found.bins.iter().map(|bin| bin.orders).sum::<usize>(), 4_000);
        }
    }

    #[test]
    fn a_move_and_what_is_left_of_it_are_found_and_nothing_beyond_the_tape() {
        let (orders, mids) = market(4_000, 0.0, 0.3);
        let found = mean_moves(&orders, &mids, &[0.0, 2.5, 600.0], Seed(1));
        assert!((found[0].mean.unwrap() - 1.0).abs() < 0.02 && found[0].orders == 4_000, "{found:?}");
        // Half of it is left, whatever the others did meanwhile.
        let [low, high] = found[1].ci95.unwrap();
        assert!((found[1].mean.unwrap() - 0.5).abs() < 0.1 && low < 0.5 && 0.5 < high, "{found:?}");
        assert!(found[2].ci95.is_none() && found[2].orders < 3_500, "the tape has no eight blocks of 1200 s: {found:?}");
    }

    #[test]
    fn sizes_that_are_alike_tell_nothing_of_a_power() {
        let (mut orders, mids) = market(500, 0.5, 0.3);
        orders.iter_mut().for_each(|order| order.volume = 1.0);
        assert_eq!(size_response(&orders, &mids, 0.0, 10, Seed(1)), None);
        assert_eq!(size_response(&[], &mids, 0.0, 10, Seed(1)), None);
        assert_eq!(mean_moves(&[], &mids, &[1.0], Seed(1))[0].mean, None);
    }
}
