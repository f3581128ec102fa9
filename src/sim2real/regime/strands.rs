//! A series as several strands that are taken side by side, one in each lane of a vector: every other from the first row on, those
//! between from the last row back, so that the innermost meet. But for the outermost they begin within the series, some rows before their own, with
//! nothing known of what came before: whether that was forgotten by then shows where one strand ends and the next begins.

use std::ops::Range;

use super::Observations;

/// Strands that are taken side by side.
pub(super) const STRANDS: usize = 8;

/// Steps that are evaluated at once: with fewer the recursion stops too often, with more what is evaluated of several columns is too much
/// at once.
pub(super) const BLOCK: usize = 32;

/// Numbers of each step of a block, `[step][lane]`.
pub(super) type Rows = [f64; BLOCK * STRANDS];

/// Where the strands of a series are.
#[derive(Debug, Clone, Copy)]
pub(super) struct Strands<'a> {
    series: Observations<'a>,
    /// Strands from each end; no other lane has rows.
    pub from_each: usize,
    /// Rows of a strand. The outermost from the last row on has fewer, and comes by rows behind the series first, which are lost.
    pub length: usize,
    /// Steps before a strand's own.
    pub run_in: usize,
}

impl<'a> Strands<'a> {
    /// One in each lane; `None` where the series is so short that the run-in would be much of it.
    pub fn many(series: Observations<'a>, run_in: usize) -> Option<Self> {
        let length = series.len().div_ceil(STRANDS);
        (length >= 4 * run_in).then_some(Self { series, from_each: STRANDS / 2, length, run_in })
    }

    /// One from each end.
    pub fn two(series: Observations<'a>) -> Self {
        Self { series, from_each: 1, length: series.len().div_ceil(2), run_in: 0 }
    }

    /// The lane of the strand with so many `outer` ones between it and its end.
    pub fn lane(outer: usize, back: bool) -> usize {
        2 * outer + usize::from(back)
    }

    /// Lanes with a strand: these come first.
    pub fn lanes(&self) -> usize {
        2 * self.from_each
    }

    /// Number of rows behind the series.
    pub fn behind(&self) -> usize {
        self.lanes() * self.length - self.series.len()
    }

    /// Rows, in the order of the series, by the number of rows between them and the end that a lane goes from.
    fn rows(&self, lane: usize, between: Range<usize>) -> Range<usize> {
        if lane.is_multiple_of(2) {
            return between;
        }
        let (all, rows) = (self.lanes() * self.length, self.series.len());
        (all - between.end).min(rows)..(all - between.start).min(rows)
    }

    /// Writes the rows of [`BLOCK`] steps from step `from` of the run-in on, `[column][step][lane]`; NaN where there is none.
    pub fn columns(&self, from: usize, into: &mut [Rows]) {
        let written = match self.series.width() {
            1 => self.full::<1>(from, into),
            2 => self.full::<2>(from, into),
            3 => self.full::<3>(from, into),
            4 => self.full::<4>(from, into),
            _ => None,
        };
        if written.is_none() {
            (0..STRANDS).for_each(|lane| self.column(lane, from, into));
        }
    }

    /// The same where all lanes have rows of few columns in each step, which is almost always; `None` where they have not.
    #[inline(always)]
    fn full<const W: usize>(&self, from: usize, into: &mut [Rows]) -> Option<()> {
        let mut parts = [&[[0.0; W]; BLOCK]; STRANDS];
        for (lane, part) in parts.iter_mut().enumerate() {
            let rows = self.rows(lane, self.between(lane, from..from + BLOCK)?);
            *part = self.series.values().as_chunks().0.get(rows)?.as_array()?;
        }
        let [columns] = into.as_chunks_mut::<W>().0 else { return None };
        for (k, column) in columns.iter_mut().enumerate() {
            for (step, lanes) in column.as_chunks_mut::<STRANDS>().0.iter_mut().enumerate() {
                for pair in 0..STRANDS / 2 {
                    lanes[2 * pair] = parts[2 * pair][step][k];
                    lanes[2 * pair + 1] = parts[2 * pair + 1][BLOCK - 1 - step][k];
                }
            }
        }
        Some(())
    }

    /// Numbers of rows between those of some steps, counted from the first of the run-in, and the end that a lane goes from; `None` where there
    /// are no such rows.
    fn between(&self, lane: usize, steps: Range<usize>) -> Option<Range<usize>> {
        let before = lane / 2 * self.length;
        let end = steps.end.min(self.run_in + self.length);
        let known = lane < self.lanes() && before + steps.start >= self.run_in && steps.start < end;
        known.then(|| before + steps.start - self.run_in..before + end - self.run_in)
    }

    fn column(&self, lane: usize, from: usize, into: &mut [Rows]) {
        let rows = self.between(lane, from..from + BLOCK).map_or(0..0, |between| self.rows(lane, between));
        let count = BLOCK.min(self.run_in + self.length - from);
        let part = self.series.slice(rows.start, rows.end);
        for (k, column) in into.iter_mut().enumerate() {
            // What is behind the series comes first.
            let (lost, steps) = column.as_chunks_mut::<STRANDS>().0.split_at_mut(count - rows.len());
            lost.iter_mut().for_each(|step| step[lane] = f64::NAN);
            if lane.is_multiple_of(2) {
                steps.iter_mut().zip(part.iter()).for_each(|(step, row)| step[lane] = row[k]);
            } else {
                steps.iter_mut().zip(part.iter().rev()).for_each(|(step, row)| step[lane] = row[k]);
            }
        }
    }
}
