//! The last inputs of an indicator, in a ring that never grows.

use super::Period;

/// The last `period` inputs, oldest first.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Window<T> {
    /// All of it is there from the beginning, so that nothing is allocated later, not even by a clone.
    values: Vec<T>,
    /// Where the next input goes: the place of the oldest, once the window is full.
    next: usize,
    count: usize,
}

impl<T: Copy + Default> Window<T> {
    pub(super) fn new(period: Period) -> Self {
        Self { values: vec![T::default(); period.get()], next: 0, count: 0 }
    }

    /// Takes an input, and gives the one that leaves for it.
    #[inline]
    pub(super) fn push(&mut self, value: T) -> Option<T> {
        let left = std::mem::replace(&mut self.values[self.next], value);
        self.next = if self.next + 1 == self.values.len() { 0 } else { self.next + 1 };
        if self.is_full() {
            return Some(left);
        }
        self.count += 1;
        None
    }

    pub(super) fn is_full(&self) -> bool {
        self.count == self.values.len()
    }

    pub(super) fn clear(&mut self) {
        (self.next, self.count) = (0, 0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_leaves_came_in_a_period_ago() {
        let mut window = Window::new(Period::new(3).unwrap());
        for round in 0..2 {
            assert_eq!([1, 2, 3].map(|x| window.push(x)), [None; 3], "round {round}");
            assert!(window.is_full());
            assert_eq!([4, 5, 6, 7].map(|x| window.push(x)), [1, 2, 3, 4].map(Some));
            window.clear();
            assert!(!window.is_full());
        }
    }
}
