//! The worst of a sample.

/// One in so many returns is in the tail: 5 %.
const ONE_IN: usize = 20;

/// What the worst 5 % of daily returns came to, losses as positive fractions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Tail {
    /// The loss that 95 % of the returns do not exceed: the `floor(n / 20) + 1`-th return from below.
    pub value_at_risk: f64,
    /// Mean loss of the worst 5 %, the one at the edge counted by the part of it that belongs to them.
    pub expected_shortfall: f64,
}

impl Tail {
    /// The tail of `returns`; none of fewer than 20, of which the tail would be a part of one.
    ///
    /// Source: historical simulation; both estimators are those of Acerbi and Tasche, "On the coherence of expected
    /// shortfall", Journal of Banking & Finance 26 (2002), with a level of 5 %.
    pub fn of(returns: &[f64]) -> Option<Self> {
        let (whole, part) = (returns.len() / ONE_IN, returns.len() % ONE_IN);
        if whole == 0 {
            return None;
        }
        let mut sorted = returns.to_vec();
        sorted.sort_by(f64::total_cmp);
        let edge = *sorted.get(whole)?;
        let beyond: f64 = sorted.iter().take(whole).sum();
        let share = part as f64 / ONE_IN as f64;
        let size = returns.len() as f64 / ONE_IN as f64;
        Some(Self { value_at_risk: -edge, expected_shortfall: -(beyond + share * edge) / size })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 50 returns of -50 % to -1 %: the tail is two and a half of them, -50, -49 and half of -48.
    #[test]
    fn the_edge_counts_in_part() {
        let returns: Vec<f64> = (1..=50).map(|k| -0.01 * f64::from(k)).collect();
        let tail = Tail::of(&returns).unwrap();
        assert!((tail.value_at_risk - 0.48).abs() < 1e-15, "{tail:?}");
        assert!((tail.expected_shortfall - (0.50 + 0.49 + 0.24) / 2.5).abs() < 1e-15, "{tail:?}");
        assert_eq!(Tail::of(&returns[..19]), None);
        let twenty = Tail::of(&returns[..20]).unwrap();
        assert!((twenty.value_at_risk - 0.19).abs() < 1e-15 && (twenty.expected_shortfall - 0.2).abs() < 1e-15);
    }
}
