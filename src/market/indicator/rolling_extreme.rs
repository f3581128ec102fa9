//! The least and the greatest number of a window.

use super::{Indicator, Period, is_taken};

/// The least of the last `period` numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct RollingMinimum(Extreme);

/// The greatest of the last `period` numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct RollingMaximum(Extreme);

impl RollingMinimum {
    /// The least of the last `period` numbers.
    #[must_use]
    pub fn new(period: Period) -> Self {
        Self(Extreme::new(period))
    }
}

impl RollingMaximum {
    /// The greatest of the last `period` numbers.
    #[must_use]
    pub fn new(period: Period) -> Self {
        Self(Extreme::new(period))
    }
}

impl Indicator for RollingMinimum {
    type Input = f64;
    type Output = f64;

    #[inline]
    fn update(&mut self, input: f64) -> Option<f64> {
        self.0.update(input, |new, old| new <= old)
    }

    fn value(&self) -> Option<f64> {
        self.0.value()
    }

    fn is_ready(&self) -> bool {
        self.0.is_ready()
    }

    fn reset(&mut self) {
        self.0.reset();
    }
}

impl Indicator for RollingMaximum {
    type Input = f64;
    type Output = f64;

    #[inline]
    fn update(&mut self, input: f64) -> Option<f64> {
        self.0.update(input, |new, old| new >= old)
    }

    fn value(&self) -> Option<f64> {
        self.0.value()
    }

    fn is_ready(&self) -> bool {
        self.0.is_ready()
    }

    fn reset(&mut self) {
        self.0.reset();
    }
}

/// The extreme of a window by a monotone queue: a number stays in it until it leaves the window or one at least as extreme
/// comes in, so that the first is the extreme, and each number enters and leaves once. D. Lemire, "Streaming maximum-minimum
/// filter using no more than three comparisons per element", Nordic Journal of Computing 13 (2006).
#[derive(Debug, Clone)]
struct Extreme {
    /// A ring: input number and input of the candidates, the most extreme at `head`.
    ring: Vec<(u64, f64)>,
    head: usize,
    len: usize,
    seen: u64,
}

/// Places of the ring that hold nothing do not count.
impl PartialEq for Extreme {
    fn eq(&self, other: &Self) -> bool {
        let same = |k| self.ring[self.place(k)] == other.ring[other.place(k)];
        self.seen == other.seen && self.len == other.len && self.ring.len() == other.ring.len() && (0..self.len).all(same)
    }
}

impl Extreme {
    fn new(period: Period) -> Self {
        Self { ring: vec![(0, 0.0); period.get()], head: 0, len: 0, seen: 0 }
    }

    fn place(&self, k: usize) -> usize {
        let at = self.head + k;
        if at >= self.ring.len() { at - self.ring.len() } else { at }
    }

    #[inline]
    fn update(&mut self, input: f64, outdoes: impl Fn(f64, f64) -> bool) -> Option<f64> {
        if !is_taken(input) {
            return None;
        }
        let period = self.ring.len() as u64;
        if self.len > 0 && self.ring[self.head].0 + period <= self.seen {
            self.head = self.place(1);
            self.len -= 1;
        }
        while self.len > 0 && outdoes(input, self.ring[self.place(self.len - 1)].1) {
            self.len -= 1;
        }
        let last = self.place(self.len);
        self.ring[last] = (self.seen, input);
        self.len += 1;
        self.seen += 1;
        self.value()
    }

    fn value(&self) -> Option<f64> {
        self.is_ready().then(|| self.ring[self.head].1)
    }

    fn is_ready(&self) -> bool {
        self.seen >= self.ring.len() as u64
    }

    fn reset(&mut self) {
        (self.head, self.len, self.seen) = (0, 0, 0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Small integers, so that there are many ties.
        #[test]
        fn the_extremes_are_those_of_the_window(inputs in prop::collection::vec(0_i32..6, 1..200), period in 1_usize..12) {
            let count = Period::new(period).unwrap();
            let (mut least, mut greatest) = (RollingMinimum::new(count), RollingMaximum::new(count));
            for end in 1..=inputs.len() {
                let input = f64::from(inputs[end - 1]);
                let window = (end >= period).then(|| &inputs[end - period..end]);
                prop_assert_eq!(least.update(input), window.map(|w| f64::from(*w.iter().min().unwrap())));
                prop_assert_eq!(greatest.update(input), window.map(|w| f64::from(*w.iter().max().unwrap())));
            }
        }
    }
}
