//! How the pairs of a window vary, by themselves and together.

use super::double_double::DoubleDouble;
use super::window::Window;
use super::{Period, is_taken};

/// Sums over a window of pairs (x, y), their squares and products, in 106 bits.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct CoMoments {
    period: Period,
    window: Window<(f64, f64)>,
    x: DoubleDouble,
    y: DoubleDouble,
    xx: DoubleDouble,
    yy: DoubleDouble,
    xy: DoubleDouble,
    last: (f64, f64),
    /// Numbers at the end of the window that are equal to the last, of x and of y.
    equal: [usize; 2],
}

/// Squared distances from the means, summed over a full window and times its length.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scatter {
    pub(super) xx: DoubleDouble,
    pub(super) yy: DoubleDouble,
    pub(super) xy: DoubleDouble,
    /// Means of x and of y.
    pub(super) mean: [f64; 2],
}

impl CoMoments {
    pub(super) fn new(period: Period) -> Self {
        let zero = DoubleDouble::ZERO;
        let (x, y, xx, yy, xy) = (zero, zero, zero, zero, zero);
        Self { period, window: Window::new(period), x, y, xx, yy, xy, last: (0.0, 0.0), equal: [0; 2] }
    }

    /// Takes a pair; whether it did.
    #[inline]
    pub(super) fn update(&mut self, (x, y): (f64, f64)) -> bool {
        if !is_taken(x) || !is_taken(y) {
            return false;
        }
        for (equal, same) in self.equal.iter_mut().zip([x == self.last.0, y == self.last.1]) {
            *equal = if same { equal.saturating_add(1) } else { 1 };
        }
        self.last = (x, y);
        self.x += x.into();
        self.y += y.into();
        self.xx += DoubleDouble::product(x, x);
        self.yy += DoubleDouble::product(y, y);
        self.xy += DoubleDouble::product(x, y);
        if let Some((x, y)) = self.window.push((x, y)) {
            self.x -= x.into();
            self.y -= y.into();
            self.xx -= DoubleDouble::product(x, x);
            self.yy -= DoubleDouble::product(y, y);
            self.xy -= DoubleDouble::product(x, y);
        }
        true
    }

    /// How the window varies, once it is full; none where x or y does not vary at all.
    pub(super) fn scatter(&self) -> Option<Scatter> {
        if !self.is_ready() || self.equal.iter().any(|equal| *equal >= self.period.get()) {
            return None;
        }
        let count = DoubleDouble::from(self.period.to_f64());
        let mean = [self.x, self.y].map(|sum| sum.to_f64() / self.period.to_f64());
        let scatter = Scatter {
            xx: self.xx * count - self.x * self.x,
            yy: self.yy * count - self.y * self.y,
            xy: self.xy * count - self.x * self.y,
            mean,
        };
        (scatter.xx.to_f64() > 0.0 && scatter.yy.to_f64() > 0.0).then_some(scatter)
    }

    pub(super) fn period(&self) -> Period {
        self.period
    }

    /// The last pair.
    pub(super) fn last(&self) -> (f64, f64) {
        self.last
    }

    pub(super) fn is_ready(&self) -> bool {
        self.window.is_full()
    }

    pub(super) fn reset(&mut self) {
        let zero = DoubleDouble::ZERO;
        (self.x, self.y, self.xx, self.yy, self.xy) = (zero, zero, zero, zero, zero);
        (self.last, self.equal) = ((0.0, 0.0), [0; 2]);
        self.window.clear();
    }
}
