//! Messages under way.

use super::layer::copy_row;

/// Rows of `size` numbers that arrive some time after they were sent, a line a lane. What counts is the last that was sent of those
/// that have arrived.
#[derive(Debug, Clone)]
pub(super) struct DelayLine<T> {
    size: usize,
    depth: usize,
    /// Messages: shape (lanes, depth, size).
    rows: Vec<T>,
    /// When each arrives: shape (lanes, depth).
    due: Vec<u64>,
    /// How many messages each lane has sent since the one it began with, which is number 0.
    sent: Vec<u64>,
    /// Number of the last message that has arrived, one a lane.
    arrived: Vec<u64>,
}

impl<T: Copy + Default> DelayLine<T> {
    /// Lines on which a message is overtaken by the next `longest` at the most.
    pub fn new(lanes: usize, size: usize, longest: usize) -> Self {
        // A power of two, for places by a mask, not by a division.
        let depth = (longest + 2).next_power_of_two();
        Self {
            size,
            depth,
            rows: vec![T::default(); depth * lanes * size],
            due: vec![0; depth * lanes],
            sent: vec![0; lanes],
            arrived: vec![0; lanes],
        }
    }

    /// The place of message `number` of `lane`.
    fn place(&self, lane: usize, number: u64) -> usize {
        (number as usize & (self.depth - 1)) + lane * self.depth
    }

    /// Begins the line of a lane with `row`, which has arrived.
    pub fn begin(&mut self, lane: usize, row: &[T]) {
        (self.sent[lane], self.arrived[lane]) = (0, 0);
        let place = self.place(lane, 0);
        self.due[place] = 0;
        self.rows[place * self.size..][..self.size].copy_from_slice(row);
    }

    /// How many messages `lane` has sent since the one it began with.
    pub fn sent(&self, lane: usize) -> u64 {
        self.sent[lane]
    }

    /// Sends `row`, which arrives at `due`.
    #[inline]
    pub fn send(&mut self, lane: usize, row: &[T], due: u64) {
        self.sent[lane] += 1;
        let place = self.place(lane, self.sent[lane]);
        self.due[place] = due;
        self.rows[place * self.size..][..self.size].copy_from_slice(row);
    }

    /// What counts at `time`.
    #[inline]
    pub fn newest(&mut self, lane: usize, time: u64) -> &[T] {
        let mut number = self.sent[lane];
        while number > self.arrived[lane] && self.due[self.place(lane, number)] > time {
            number -= 1;
        }
        self.arrived[lane] = number;
        &self.rows[self.place(lane, number) * self.size..][..self.size]
    }

    /// Makes lane `to` a copy of lane `from`: of `other`, or else of its own.
    pub fn copy_lane(&mut self, other: Option<&Self>, from: usize, to: usize) {
        // The two are of one depth: longest latencies are equal.
        copy_row(&mut self.due, other.map(|other| other.due.as_slice()), self.depth, from, to);
        copy_row(&mut self.rows, other.map(|other| other.rows.as_slice()), self.depth * self.size, from, to);
        [self.sent[to], self.arrived[to]] = match other {
            Some(other) => [other.sent[from], other.arrived[from]],
            None => [self.sent[from], self.arrived[from]],
        };
    }
}

/// Rows that all arrive after the same number of steps: whole vectors are exchanged, at the cost of a copy.
#[derive(Debug, Clone)]
pub(super) struct FixedLine<T> {
    lanes: usize,
    size: usize,
    /// Shape (delay, lanes, size).
    rows: Vec<T>,
    delay: usize,
    /// The row that is exchanged next.
    next: usize,
}

impl<T: Copy + Default> FixedLine<T> {
    /// Lines of `delay` steps.
    pub fn new(lanes: usize, size: usize, delay: usize) -> Self {
        Self { lanes, size, rows: vec![T::default(); delay * lanes * size], delay, next: 0 }
    }

    /// Begins the line of a lane with `row`, which is all there is until the first message arrives.
    pub fn begin(&mut self, lane: usize, row: &[T]) {
        for slot in 0..self.delay {
            self.rows[(slot * self.lanes + lane) * self.size..][..self.size].copy_from_slice(row);
        }
    }

    /// Sends the rows of all lanes, and exchanges them for those that arrive.
    #[inline]
    pub fn exchange(&mut self, rows: &mut [T]) {
        if self.delay > 0 {
            let length = self.lanes * self.size;
            rows.swap_with_slice(&mut self.rows[self.next * length..][..length]);
            self.next = if self.next + 1 == self.delay { 0 } else { self.next + 1 };
        }
    }

    /// Makes lane `to` a copy of lane `from`: of `other`, or else of its own.
    pub fn copy_lane(&mut self, other: Option<&Self>, from: usize, to: usize) {
        for age in 0..self.delay {
            let target = ((self.next + age) % self.delay * self.lanes + to) * self.size;
            match other {
                Some(other) => {
                    let source = ((other.next + age) % self.delay * other.lanes + from) * self.size;
                    self.rows[target..][..self.size].copy_from_slice(&other.rows[source..][..self.size]);
                }
                None => {
                    let source = ((self.next + age) % self.delay * self.lanes + from) * self.size;
                    self.rows.copy_within(source..source + self.size, target);
                }
            }
        }
    }
}
