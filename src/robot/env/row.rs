//! A number a lane, from the beginning of a cache line on.

use std::ops::{Deref, DerefMut};

/// Bytes of a cache line, which is as wide as the widest vectors.
const LINE: usize = 64;

/// So many numbers side by side, of which each vector lies in one cache line: where allocators begin is by chance, and a step of
/// cart-poles takes up to a sixth longer where each vector lies in two.
#[derive(Debug)]
pub(super) struct Row {
    numbers: Vec<f64>,
    first: usize,
    count: usize,
}

impl Row {
    pub fn new(value: f64, count: usize) -> Self {
        let numbers = vec![value; count + LINE / size_of::<f64>() - 1];
        // Whoever cannot tell says `usize::MAX`.
        let first = numbers.as_ptr().align_offset(LINE).min(numbers.len() - count);
        Self { numbers, first, count }
    }
}

impl Clone for Row {
    fn clone(&self) -> Self {
        // Elsewhere it begins elsewhere.
        let mut row = Self::new(0.0, self.count);
        row.copy_from_slice(self);
        row
    }
}

impl Deref for Row {
    type Target = [f64];

    #[inline(always)]
    fn deref(&self) -> &[f64] {
        &self.numbers[self.first..self.first + self.count]
    }
}

impl DerefMut for Row {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [f64] {
        &mut self.numbers[self.first..self.first + self.count]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_and_copies_of_them_begin_with_a_cache_line() {
        let rows: Vec<Row> = [0, 1, 7, 64, 100].map(|count| Row::new(1.5, count)).into();
        for (mut row, count) in rows.into_iter().zip([0, 1, 7, 64, 100]) {
            row.iter_mut().enumerate().for_each(|(k, number)| *number += k as f64);
            let copy = row.clone();
            assert!(
                row.len() == count && *copy == *row && row.iter().enumerate().all(|(k, number)| *number == 1.5 + k as f64)
            );
            assert!([&row, &copy].iter().all(|row| row.as_ptr().addr() % LINE == 0));
        }
    }
}
