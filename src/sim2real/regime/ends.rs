//! A series as recursions take it: row by row from its first, or from both its ends at once to where they meet.
//!
//! A recursion waits for itself: what a row gives is needed by the next. Two that do not wait for one another, side by side in one
//! register, take hardly longer than one, so a series that lies ready as a whole is taken from both ends.

use std::fmt::Debug;
use std::ops::{Add, Div, Mul};

use bytemuck::Pod;
use wide::{CmpLt, f64x2};

use super::{HiddenMarkov, Observations};

/// Numbers that are evaluated side by side.
pub(super) const LANES: usize = 128;

/// What a recursion counts in: a number, or one for each end of a series.
pub(super) trait Ends:
    Pod + Debug + PartialEq + Send + Sync + Add<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// Number of ends.
    const COUNT: usize;

    /// What is evaluated side by side of one state.
    type Group: Pod + AsRef<[Self]>;

    /// The number `of` each end.
    fn each(of: impl FnMut(usize) -> f64) -> Self;

    /// That of an end.
    fn at(self, end: usize) -> f64;

    /// The same, but for that of one end.
    fn with(self, end: usize, number: f64) -> Self {
        Self::each(|each| if each == end { number } else { self.at(each) })
    }

    /// Whether any is below a bound.
    fn below(self, bound: f64) -> bool;

    /// Each, or the bound where it is not below.
    fn at_most(self, bound: f64) -> Self;
}

impl Ends for f64 {
    const COUNT: usize = 1;

    type Group = [f64; LANES];

    #[inline(always)]
    fn each(mut of: impl FnMut(usize) -> f64) -> Self {
        of(0)
    }

    #[inline(always)]
    fn at(self, _: usize) -> f64 {
        self
    }

    #[inline(always)]
    fn below(self, bound: f64) -> bool {
        self < bound
    }

    #[inline(always)]
    fn at_most(self, bound: f64) -> Self {
        if self < bound { self } else { bound }
    }
}

impl Ends for f64x2 {
    const COUNT: usize = 2;

    type Group = [f64x2; LANES / 2];

    #[inline(always)]
    fn each(mut of: impl FnMut(usize) -> f64) -> Self {
        Self::from([of(0), of(1)])
    }

    #[inline(always)]
    fn at(self, end: usize) -> f64 {
        self.as_array_ref()[end]
    }

    #[inline(always)]
    fn below(self, bound: f64) -> bool {
        self.cmp_lt(Self::splat(bound)).any()
    }

    #[inline(always)]
    fn at_most(self, bound: f64) -> Self {
        self.cmp_lt(Self::splat(bound)).blend(self, Self::splat(bound))
    }
}

/// Numbers of each state: an array where the compiler knows how many there are, which it then keeps in registers.
pub(super) trait PerState: AsRef<[Self::Of]> + AsMut<[Self::Of]> + Clone + Debug + PartialEq + Send + Sync {
    /// Of one end or both.
    type Of: Ends;

    /// Whatever else there is one of for each state.
    type Each<T>: AsRef<[T]> + AsMut<[T]>;

    /// Those of so many states.
    fn of(states: usize, of: impl FnMut(usize) -> Self::Of) -> Self;

    /// One for each of so many states.
    fn each<T>(states: usize, of: impl FnMut(usize) -> T) -> Self::Each<T>;
}

impl<X: Ends> PerState for Vec<X> {
    type Of = X;
    type Each<T> = Vec<T>;

    fn of(states: usize, of: impl FnMut(usize) -> X) -> Self {
        (0..states).map(of).collect()
    }

    fn each<T>(states: usize, of: impl FnMut(usize) -> T) -> Vec<T> {
        (0..states).map(of).collect()
    }
}

impl<X: Ends, const N: usize> PerState for [X; N] {
    type Of = X;
    type Each<T> = [T; N];

    #[inline(always)]
    fn of(_: usize, of: impl FnMut(usize) -> X) -> Self {
        std::array::from_fn(of)
    }

    #[inline(always)]
    fn each<T>(_: usize, of: impl FnMut(usize) -> T) -> [T; N] {
        std::array::from_fn(of)
    }
}

/// A model as recursions from the ends take it: from the last row back, transitions are those of the model transposed, and nothing is known
/// of the state after that row.
pub(super) struct Chain<'a, X> {
    pub model: &'a HiddenMarkov,
    /// `[from][to]` in the order in which states are come by.
    pub transition: Vec<X>,
    /// Of each state before any row.
    pub begin: Vec<X>,
}

impl<'a, X: Ends> Chain<'a, X> {
    pub fn of(model: &'a HiddenMarkov) -> Self {
        let (transition, states) = (model.transition(), model.states());
        let transition = (0..states * states)
            .map(|k| X::each(|end| transition[if end == 0 { k } else { k % states * states + k / states }]))
            .collect();
        let begin = model.initial().iter().map(|p| X::each(|end| if end == 0 { *p } else { 1.0 })).collect();
        Self { model, transition, begin }
    }
}

/// A series from its ends: in each step a row of each. A last row that is alone is joined by one behind the series, which is lost.
#[derive(Debug, Clone, Copy)]
pub(super) struct Steps<'a> {
    series: Observations<'a>,
    ends: usize,
    pub count: usize,
}

impl<'a> Steps<'a> {
    pub fn of<X: Ends>(series: Observations<'a>) -> Self {
        Self { series, ends: X::COUNT, count: series.len().div_ceil(X::COUNT) }
    }

    /// Number of the row that is come by from an end.
    #[inline(always)]
    pub fn row_number(&self, step: usize, end: usize) -> usize {
        if end == 0 { step } else { self.ends * self.count - 1 - step }
    }

    /// That row; `None` of the one behind the series.
    #[inline(always)]
    pub fn row(&self, step: usize, end: usize) -> Option<&'a [f64]> {
        let (row, width) = (self.row_number(step, end), self.series.width());
        self.series.values().get(row * width..(row + 1) * width)
    }

    /// Whether a row behind the series is among them.
    pub fn uneven(&self) -> bool {
        self.ends * self.count > self.series.len()
    }

    /// Writes the rows from step `from` on, `[column][step][end]`; NaN where there is none.
    #[inline(always)]
    pub fn columns<X: Ends>(&self, from: usize, into: &mut [[f64; LANES]]) {
        let to = (from + LANES / X::COUNT).min(self.count);
        let alone = usize::from(from == 0 && self.uneven());
        if alone > 0 || to - from < LANES / X::COUNT {
            into.as_flattened_mut().fill(f64::NAN);
        }
        let place = |step: usize, end: usize| (step * X::COUNT + end) % LANES;
        let first = self.series.slice(from, to);
        let last = self.series.slice(X::COUNT * self.count - to, X::COUNT * self.count - from);
        if X::COUNT == 2 {
            match self.series.width() {
                1 => return both_of::<1>([first, last], alone, into),
                2 => return both_of::<2>([first, last], alone, into),
                3 => return both_of::<3>([first, last], alone, into),
                4 => return both_of::<4>([first, last], alone, into),
                _ => {}
            }
        }
        let mut write = |place: usize, row: &[f64]| into.iter_mut().zip(row).for_each(|(column, x)| column[place] = *x);
        first.iter().enumerate().for_each(|(step, row)| write(place(step, 0), row));
        if X::COUNT > 1 {
            last.iter().rev().enumerate().for_each(|(step, row)| write(place(alone + step, 1), row));
        }
    }
}

/// Writes rows from both ends, the last of the second first; of the first `alone` rows there is no second. Most series have few columns:
/// where their number is known both rows of a step are written at once.
fn both_of<const W: usize>([first, last]: [Observations; 2], alone: usize, into: &mut [[f64; LANES]]) {
    let ([columns, ..], (first, _), (last, _)) =
        (into.as_chunks_mut::<W>().0, first.values().as_chunks::<W>(), last.values().as_chunks::<W>())
    else {
        return;
    };
    let (single, first) = first.split_at(alone.min(first.len()));
    for (k, column) in columns.iter_mut().enumerate() {
        let (begin, steps) = column.as_chunks_mut::<2>().0.split_at_mut(alone);
        for (step, row) in begin.iter_mut().zip(single) {
            step[0] = row[k];
        }
        for ((step, first), last) in steps.iter_mut().zip(first).zip(last.iter().rev()) {
            *step = [first[k], last[k]];
        }
    }
}
