//! Fewer points that draw the same picture.

/// The rows of a trace that a plot of `buckets` columns needs: of each column the smallest and the largest value, in the
/// order of the rows, so that no extreme is lost. A trace of at most two rows a column is kept whole.
///
/// The result is one list of points for each unbroken stretch: a lost sample (none, or not finite) ends a stretch where
/// it leaves a column empty. It holds at most `2 * buckets` points.
pub(super) fn extremes(x: &[f64], y: &[Option<f64>], buckets: usize) -> Vec<Vec<(f64, f64)>> {
    let rows = x.len().min(y.len());
    let (low, high) =
        x.iter().filter(|v| v.is_finite()).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
    let whole = rows <= 2 * buckets || high <= low;
    let column = |row: usize| {
        if whole { row } else { ((x[row] - low) / (high - low) * buckets as f64).min(buckets as f64 - 1.0) as usize }
    };

    let mut stretches = vec![Vec::new()];
    let mut row = 0;
    while row < rows {
        let (here, start) = (column(row), row);
        let (mut least, mut most): (Option<usize>, Option<usize>) = (None, None);
        while row < rows && column(row) == here {
            if let Some(value) = sample(x, y, row) {
                if least.is_none_or(|r| sample(x, y, r).is_some_and(|v| value < v)) {
                    least = Some(row);
                }
                if most.is_none_or(|r| sample(x, y, r).is_some_and(|v| value > v)) {
                    most = Some(row);
                }
            }
            row += 1;
        }
        match (least, most) {
            (Some(a), Some(b)) => {
                let stretch = stretches.last_mut();
                let mut kept = vec![a.min(b), a.max(b)];
                // Beside an empty column the outermost rows are seen too: the line across it joins them.
                if start > 0 && here > column(start - 1) + 1 {
                    kept.insert(0, start);
                }
                if row < rows && column(row) > here + 1 {
                    kept.push(row - 1);
                }
                kept.dedup();
                if let Some(stretch) = stretch {
                    stretch.extend(kept.iter().filter_map(|r| Some((x[*r], sample(x, y, *r)?))));
                }
            }
            _ => stretches.push(Vec::new()),
        }
    }
    stretches.retain(|s| !s.is_empty());
    stretches
}

fn sample(x: &[f64], y: &[Option<f64>], row: usize) -> Option<f64> {
    y[row].filter(|v| v.is_finite() && x[row].is_finite())
}

/// At most `most` of `points`, chosen so that every place where there was a point keeps one: the first within each cell
/// of a grid as fine as `most` allows. Outliers survive, crowds thin out.
pub(super) fn thin(points: &[(f64, f64)], most: usize) -> Vec<(f64, f64)> {
    let finite: Vec<_> = points.iter().copied().filter(|(x, y)| x.is_finite() && y.is_finite()).collect();
    if finite.len() <= most {
        return finite;
    }
    let bounds = |pick: fn(&(f64, f64)) -> f64| {
        finite.iter().map(pick).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)))
    };
    let (x, y) = (bounds(|p| p.0), bounds(|p| p.1));
    let mut cells = 512.0;
    loop {
        let place = |v: f64, (low, high): (f64, f64)| if high > low { ((v - low) / (high - low) * cells) as u32 } else { 0 };
        let mut taken = std::collections::BTreeSet::new();
        let kept: Vec<_> = finite.iter().copied().filter(|p| taken.insert((place(p.0, x), place(p.1, y)))).collect();
        if kept.len() <= most || cells < 2.0 {
            return kept;
        }
        cells *= 0.8;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extremes_survive_within_the_budget() {
        let x: Vec<f64> = (0..100_000).map(f64::from).collect();
        let mut y: Vec<Option<f64>> = x.iter().map(|x| Some((x * 0.01).sin())).collect();
        y[54_321] = Some(40.0);
        y[54_322] = Some(-40.0);
        let stretches = extremes(&x, &y, 300);
        let points: Vec<_> = stretches.concat();
        assert_eq!(stretches.len(), 1);
        assert!(points.len() <= 600, "{}", points.len());
        assert!(points.contains(&(54_321.0, 40.0)) && points.contains(&(54_322.0, -40.0)));
        assert!(points.windows(2).all(|p| p[0].0 < p[1].0), "rows out of order");
    }

    #[test]
    fn a_line_across_missing_time_joins_what_is_beside_it() {
        let x: Vec<f64> = (0..1_000).map(f64::from).chain((100_000..101_000).map(f64::from)).collect();
        // Held at first, and no longer when the data pause: a line at the highest value would tell otherwise.
        let y: Vec<Option<f64>> = (0..2_000).map(|k| Some(if (100..900).contains(&k) { 1.0 } else { 0.0 })).collect();
        let points = extremes(&x, &y, 50).concat();
        assert!(points.contains(&(999.0, 0.0)) && points.contains(&(100_000.0, 0.0)), "{points:?}");
        assert!(points.len() <= 100 && points.windows(2).all(|p| p[0].0 < p[1].0));
    }

    #[test]
    fn lost_samples_break_the_line_where_they_can_be_seen() {
        let x = [0.0, 1.0, 2.0, 3.0, 4.0];
        let y = [Some(1.0), Some(2.0), None, Some(f64::NAN), Some(5.0)];
        assert_eq!(extremes(&x, &y, 10), vec![vec![(0.0, 1.0), (1.0, 2.0)], vec![(4.0, 5.0)]]);
        let x: Vec<f64> = (0..1000).map(f64::from).collect();
        let mut y: Vec<Option<f64>> = x.iter().map(|v| Some(*v)).collect();
        y[500] = None;
        assert_eq!(extremes(&x, &y, 10).len(), 1, "one lost row of a hundred in its column is not a gap");
        y[400..600].fill(None);
        assert_eq!(extremes(&x, &y, 10).len(), 2);
        assert!(extremes(&[], &[], 10).is_empty());
    }

    #[test]
    fn thinning_keeps_outliers() {
        let mut points: Vec<(f64, f64)> = (0..20_000).map(|i| (f64::from(i % 100), f64::from(i % 7))).collect();
        points.push((50.0, 900.0));
        let kept = thin(&points, 300);
        assert!(kept.len() <= 300 && kept.len() > 30 && kept.contains(&(50.0, 900.0)), "{}", kept.len());
        assert_eq!(thin(&[(1.0, f64::NAN), (1.0, 2.0)], 10), vec![(1.0, 2.0)]);
    }
}
