use super::*;

fn all() -> Vec<(Distribution, f64, f64)> {
    // Each with its mean and standard deviation.
    let truncated = Distribution::TruncatedNormal { mean: 0.0, std: 1.0, low: 0.0, high: 9.0 };
    let half = (2.0 / std::f64::consts::PI).sqrt();
    let (a, b) = (0.5_f64, 2.0_f64);
    let ln = (b / a).ln();
    let (m, square) = ((b - a) / ln, (b * b - a * a) / (2.0 * ln));
    let s2: f64 = 0.04;
    vec![
        (Distribution::Constant { value: 3.0 }, 3.0, 0.0),
        (Distribution::Uniform { low: -1.0, high: 3.0 }, 1.0, 4.0 / 12.0_f64.sqrt()),
        (Distribution::LogUniform { low: a, high: b }, m, (square - m * m).sqrt()),
        (Distribution::Normal { mean: 2.0, std: 0.5 }, 2.0, 0.5),
        (truncated, half, (1.0 - half * half).sqrt()),
        (Distribution::LogNormal { median: 1.0, sigma: 0.2 }, (s2 / 2.0).exp(), ((s2.exp() - 1.0) * s2.exp()).sqrt()),
        (Distribution::Choice { values: vec![0.0, 10.0], weights: vec![3.0, 1.0] }, 2.5, 10.0 * (3.0_f64 / 16.0).sqrt()),
        (Distribution::Choice { values: vec![1.0, 2.0, 3.0], weights: vec![] }, 2.0, (2.0_f64 / 3.0).sqrt()),
    ]
}

#[test]
fn draws_have_the_mean_and_the_spread_and_stay_within_the_support() {
    for (distribution, mean, std) in all() {
        distribution.check().unwrap();
        let inverse = distribution.inverse();
        let count = 200_000;
        let values: Vec<f64> = (0..count).map(|k| inverse.at((f64::from(k) + 0.5) / f64::from(count))).collect();
        let found = values.iter().sum::<f64>() / f64::from(count);
        let spread = (values.iter().map(|v| (v - found).powi(2)).sum::<f64>() / f64::from(count)).sqrt();
        assert!((found - mean).abs() < 1e-4 && (spread - std).abs() < 1e-3, "{distribution:?}: {found} {spread}");
        let [low, high] = distribution.support();
        let edge = 1.0 / (1_u64 << 53) as f64;
        for u in [edge, 1.0 - edge] {
            assert!((low..=high).contains(&inverse.at(u)), "{distribution:?} at {u}");
        }
        assert!(values.windows(2).all(|w| w[0] <= w[1]), "{distribution:?} does not rise");
        for z in [-3.0, -0.2, 0.0, 1.7] {
            let (by_normal, by_part) = (inverse.at_normal(z), inverse.at(normal_cdf(z)));
            assert!((by_normal - by_part).abs() < 1e-9, "{distribution:?} at {z}: {by_normal} {by_part}");
        }
    }
}

#[test]
fn a_far_tail_is_drawn_from_and_not_its_end() {
    let inverse = Distribution::TruncatedNormal { mean: 0.0, std: 1.0, low: 5.0, high: 7.0 }.inverse();
    let values: Vec<f64> = (1..1_000).map(|k| inverse.at(f64::from(k) / 1_000.0)).collect();
    assert!(values.windows(2).all(|w| w[0] < w[1]), "distinct");
    // The median above 5 of a standard normal: 1 - F(x) = (1 - F(5)) / 2.
    assert!((values[499] - 5.133).abs() < 2e-3, "{}", values[499]);
}

#[test]
fn what_is_no_distribution_is_refused() {
    use Distribution as D;
    let refused = |distribution: D, words: &str| {
        let text = distribution.check().unwrap_err().to_string();
        assert!(text.contains(words) && text.contains("\nhint: "), "{text}");
    };
    refused(D::Uniform { low: 2.0, high: 1.0 }, "found 2 and 1");
    refused(D::Uniform { low: 2.0, high: 2.0 }, "constant");
    refused(D::Uniform { low: f64::NAN, high: 2.0 }, "finite `low`");
    refused(D::Uniform { low: 0.0, high: f64::INFINITY }, "finite `high`");
    refused(D::LogUniform { low: 0.0, high: 2.0 }, "`low` above 0");
    refused(D::Normal { mean: 0.0, std: 0.0 }, "`std` above 0");
    refused(D::Normal { mean: 0.0, std: -1.0 }, "found -1");
    refused(D::TruncatedNormal { mean: 0.0, std: 1.0, low: 50.0, high: 60.0 }, "next to nothing");
    refused(D::TruncatedNormal { mean: 0.0, std: 1.0, low: 1.0, high: -1.0 }, "`low` below `high`");
    refused(D::LogNormal { median: -1.0, sigma: 0.1 }, "median");
    refused(D::LogNormal { median: 1.0, sigma: 0.0 }, "sigma");
    refused(D::Choice { values: vec![], weights: vec![] }, "nothing to choose");
    refused(D::Choice { values: vec![1.0], weights: vec![1.0, 2.0] }, "expected 1 weights");
    refused(D::Choice { values: vec![1.0], weights: vec![-1.0] }, "found -1");
    refused(D::Choice { values: vec![1.0], weights: vec![0.0] }, "not all 0");
    refused(D::Constant { value: f64::NAN }, "finite `value`");
}
