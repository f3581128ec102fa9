//! What a trade leaves behind: a displacement of the price that stays, fades or builds up, as a sum of exponentials.

/// How a displacement goes on after the trade that made it: the sum of `weight * exp(-rate t)`, with rates in [1/s].
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Kernel(Vec<(f64, f64)>);

impl Kernel {
    /// It stays.
    pub fn lasting() -> Self {
        Self(vec![(1.0, 0.0)])
    }

    /// It fades with two time constants [s], the first with a share.
    pub fn twofold(share: f64, fast: f64, slow: f64) -> Self {
        Self(vec![(share, 1.0 / fast), (1.0 - share, 1.0 / slow)])
    }

    /// It fades with a time constant [s], but for a part that stays.
    pub fn with_plateau(plateau: f64, time: f64) -> Self {
        Self(vec![(plateau, 0.0), (1.0 - plateau, 1.0 / time)])
    }

    /// It fades nearly as `t^-exponent` from `time` [s] on: seven exponentials, each slower by a factor of four.
    pub fn power(time: f64, exponent: f64) -> Self {
        let raw: Vec<(f64, f64)> = (0..7)
            .map(|k| {
                let rate = 4.0_f64.powi(-k) / time;
                ((rate * time).powf(exponent), rate)
            })
            .collect();
        let sum: f64 = raw.iter().map(|(weight, _)| weight).sum();
        Self(raw.into_iter().map(|(weight, rate)| (weight / sum, rate)).collect())
    }

    /// It builds up with a time constant [s], and stays.
    pub fn growing(time: f64) -> Self {
        Self(vec![(1.0, 0.0), (-1.0, 1.0 / time)])
    }

    /// What is left of 1 after `time` [s].
    #[cfg(test)]
    pub fn after(&self, time: f64) -> f64 {
        self.0.iter().map(|(weight, rate)| weight * (-rate * time).exp()).sum()
    }
}

/// The displacement that many trades have left so far.
#[derive(Debug, Clone)]
pub(super) struct Wake {
    kernel: Kernel,
    parts: Vec<f64>,
    now: f64,
}

impl Wake {
    pub fn new(kernel: &Kernel) -> Self {
        Self { parts: vec![0.0; kernel.0.len()], kernel: kernel.clone(), now: 0.0 }
    }

    /// What is left at `time` [s], no earlier than any before.
    pub fn at(&mut self, time: f64) -> f64 {
        let passed = (time - self.now).max(0.0);
        self.now = self.now.max(time);
        if passed > 0.0 {
            for (part, (_, rate)) in self.parts.iter_mut().zip(&self.kernel.0) {
                *part *= (-rate * passed).exp();
            }
        }
        self.parts.iter().sum()
    }

    /// A trade at the time asked for last.
    pub fn kick(&mut self, size: f64) {
        self.parts.iter_mut().zip(&self.kernel.0).for_each(|(part, (weight, _))| *part += weight * size);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wake_is_the_sum_of_what_each_trade_has_left() {
        let kernels = [
            Kernel::lasting(),
            Kernel::twofold(0.3, 2.0, 50.0),
            Kernel::with_plateau(0.2, 20.0),
            Kernel::power(1.0, 0.4),
            Kernel::growing(5.0),
        ];
        for kernel in kernels {
            let mut wake = Wake::new(&kernel);
            let trades = [(1.0, 3.0), (4.0, -1.0), (40.0, 2.0)];
            for (time, size) in trades {
                wake.at(time);
                wake.kick(size);
            }
            let direct: f64 = trades.iter().map(|(time, size)| size * kernel.after(60.0 - time)).sum();
            assert!((wake.at(60.0) - direct).abs() < 1e-12, "{kernel:?}");
        }
        assert!((Kernel::power(1.0, 0.4).after(0.0) - 1.0).abs() < 1e-12);
        let fading = Kernel::power(1.0, 0.4);
        let slope = (fading.after(100.0) / fading.after(10.0)).log10();
        assert!((slope + 0.4).abs() < 0.12, "nearly a power law: {slope}");
    }
}
