//! Incremental indicators beside TA-Lib, which computes them over whole series, and held to their contract.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]
use proptest::prelude::*;
use ta_lib::{Core, MAType, OutRange};
use trueup::market::indicator::{
    Adx, Atr, Bollinger, Correlation, Donchian, Ema, EwmaVolatility, Indicator, LARGEST, Macd, Obv, Period, RateOfChange,
    Regression, RollingMaximum, RollingMinimum, Rsi, SessionVwap, Sma, StandardDeviation, Stochastic, Vwap, WilderAverage,
    ZScore, check_indicator,
};
use trueup::market::{Bar, Price};
use trueup::sim2real::Timestamp;

const LENGTH: usize = 400;

fn period(count: usize) -> Period {
    Period::new(count).unwrap()
}

/// A random walk of bars on ticks of a cent, with gaps between them.
fn walk() -> impl Strategy<Value = Vec<Bar>> {
    let step = (-50_i64..=50, -50_i64..=50, 0_i64..30, 0_i64..30, 0.0..1e4_f64);
    prop::collection::vec(step, LENGTH).prop_map(|steps| {
        let mut last = 10_000_i64;
        let bar = |(k, (gap, body, above, below, volume)): (usize, (i64, i64, i64, i64, f64))| {
            let open = (last + gap).max(200);
            let close = (open + body).max(200);
            last = close;
            let [open, high, low, close] =
                [open, open.max(close) + above, open.min(close) - below, close].map(|ticks| Price(ticks * 10_000_000));
            let open_at = Timestamp(k as i64 * 60 * Timestamp::NANOS);
            Bar { open_at, known_at: open_at + 60 * Timestamp::NANOS, open, high, low, close, volume }
        };
        steps.into_iter().enumerate().map(bar).collect()
    })
}

fn column(bars: &[Bar], of: fn(&Bar) -> Price) -> Vec<f64> {
    bars.iter().map(|bar| of(bar).to_f64()).collect()
}

fn closes(bars: &[Bar]) -> Vec<f64> {
    column(bars, |bar| bar.close)
}

/// What TA-Lib gives, a value a row and none before it begins.
fn rows(buffer: &[f64], range: OutRange) -> Vec<Option<f64>> {
    let mut all = vec![None; range.beg_idx];
    all.extend(buffer[..range.count].iter().copied().map(Some));
    all
}

fn ours<I: Indicator>(mut indicator: I, inputs: impl IntoIterator<Item = I::Input>) -> Vec<Option<I::Output>> {
    inputs.into_iter().map(|input| indicator.update(input)).collect()
}

/// Both begin at the same row, and agree from row `from` on to a part in 1e9 of `scale`.
fn agree(name: &str, ours: &[Option<f64>], theirs: &[Option<f64>], from: usize, scale: f64) -> Result<(), TestCaseError> {
    prop_assert_eq!(ours.len(), theirs.len());
    prop_assert_eq!(ours.iter().position(Option::is_some), theirs.iter().position(Option::is_some), "{} begins", name);
    for (row, (a, b)) in ours.iter().zip(theirs).enumerate().skip(from) {
        if let (Some(a), Some(b)) = (a, b) {
            prop_assert!((a - b).abs() <= 1e-9 * scale.max(b.abs()), "{} at {}: {} and {}", name, row, a, b);
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn averages_are_those_of_ta_lib(bars in walk(), n in 2_usize..40) {
        let (core, closes, end) = (Core::new(), closes(&bars), LENGTH - 1);
        let mut out = vec![0.0; LENGTH];
        let range = core.sma(0, end, &closes, n as i32, &mut out).unwrap();
        agree("sma", &ours(Sma::new(period(n)), closes.clone()), &rows(&out, range), 0, 1.0)?;
        let range = core.ema(0, end, &closes, n as i32, &mut out).unwrap();
        agree("ema", &ours(Ema::new(period(n)), closes.clone()), &rows(&out, range), 0, 1.0)?;
        let range = core.stddev(0, end, &closes, n as i32, 1.0, &mut out).unwrap();
        // TA-Lib takes the root of a small difference of large squares: 1e-16 of 100 squared.
        let (found, expected) = (ours(StandardDeviation::new(period(n)), closes.clone()), rows(&out, range));
        for (a, b) in found.iter().zip(&expected) {
            let (a, b) = (a.unwrap_or_default(), b.unwrap_or_default());
            prop_assert!((a * a - b * b).abs() < 1e-8, "stddev: {} and {}", a, b);
        }
        let range = core.min(0, end, &closes, n as i32, &mut out).unwrap();
        prop_assert_eq!(ours(RollingMinimum::new(period(n)), closes.clone()), rows(&out, range));
        let range = core.max(0, end, &closes, n as i32, &mut out).unwrap();
        prop_assert_eq!(ours(RollingMaximum::new(period(n)), closes), rows(&out, range));
    }

    #[test]
    fn bands_and_convergence_are_those_of_ta_lib(
        bars in walk(),
        n in 2_usize..30,
        more in 1_usize..20,
        signal in 1_usize..12,
    ) {
        let (core, closes, end) = (Core::new(), closes(&bars), LENGTH - 1);
        let [mut a, mut b, mut c] = [0; 3].map(|_| vec![0.0; LENGTH]);
        let range = core.bbands(0, end, &closes, n as i32, 2.0, 2.0, MAType::SMA, &mut a, &mut b, &mut c).unwrap();
        let bands = ours(Bollinger::new(period(n), 2.0).unwrap(), closes.clone());
        // 2e-6 of 100: where all closes are nearly the same TA-Lib's root has no more digits.
        for (out, of) in [(&a, 0), (&b, 1), (&c, 2)] {
            let side: Vec<_> = bands.iter().map(|b| b.map(|b| [b.upper, b.middle, b.lower][of])).collect();
            agree("bollinger", &side, &rows(out, range), 0, if of == 1 { 1.0 } else { 2e5 })?;
        }
        let (fast, slow) = (n as i32, (n + more) as i32);
        let range = core.macd(0, end, &closes, fast, slow, signal as i32, &mut a, &mut b, &mut c).unwrap();
        let macd = ours(Macd::new(period(n), period(n + more), period(signal)).unwrap(), closes);
        for (out, of) in [(&a, 0), (&b, 1), (&c, 2)] {
            let line: Vec<_> = macd.iter().map(|m| m.map(|m| [m.line, m.signal, m.histogram][of])).collect();
            agree("macd", &line, &rows(out, range), 0, 1.0)?;
        }
    }

    #[test]
    fn momentum_is_that_of_ta_lib(bars in walk(), n in 2_usize..30) {
        let (core, closes, end) = (Core::new(), closes(&bars), LENGTH - 1);
        let mut out = vec![0.0; LENGTH];
        let range = core.rsi(0, end, &closes, n as i32, &mut out).unwrap();
        agree("rsi", &ours(Rsi::new(period(n)), closes.clone()), &rows(&out, range), 0, 100.0)?;
        let range = core.roc(0, end, &closes, n as i32, &mut out).unwrap();
        let percent = |change: Option<f64>| change.map(|change| 100.0 * change);
        let change: Vec<_> = ours(RateOfChange::new(period(n)), closes.clone()).into_iter().map(percent).collect();
        agree("roc", &change, &rows(&out, range), 0, 100.0)?;
        let volumes: Vec<f64> = bars.iter().map(|bar| bar.volume).collect();
        let range = core.obv(0, end, &closes, &volumes, &mut out).unwrap();
        agree("obv", &ours(Obv::new(), closes.into_iter().zip(volumes)), &rows(&out, range), 0, 1e4)?;
    }

    #[test]
    fn ranges_are_those_of_ta_lib(bars in walk(), n in 2_usize..15, slow in 1_usize..5, signal in 1_usize..5) {
        let (core, end) = (Core::new(), LENGTH - 1);
        let [high, low, close] = [(|b| b.high) as fn(&Bar) -> Price, |b| b.low, |b| b.close].map(|of| column(&bars, of));
        let [mut a, mut b] = [0; 2].map(|_| vec![0.0; LENGTH]);
        let range = core.atr(0, end, &high, &low, &close, n as i32, &mut a).unwrap();
        agree("atr", &ours(Atr::new(period(n)), bars.clone()), &rows(&a, range), 0, 1.0)?;
        let (k, d, plain) = (slow as i32, signal as i32, MAType::SMA);
        let range = core.stoch(0, end, &high, &low, &close, n as i32, k, plain, d, plain, &mut a, &mut b).unwrap();
        let both = ours(Stochastic::new(period(n), period(slow), period(signal)), bars.clone());
        // One range of 0 in TA-Lib counts as a close at the bottom; here there is always one.
        if bars.windows(n).all(|w| w.iter().map(|b| b.high).max() > w.iter().map(|b| b.low).min()) {
            agree("%K", &both.iter().map(|o| o.map(|o| o.k)).collect::<Vec<_>>(), &rows(&a, range), 0, 100.0)?;
            agree("%D", &both.iter().map(|o| o.map(|o| o.d)).collect::<Vec<_>>(), &rows(&b, range), 0, 100.0)?;
        }
        // Averages that begin otherwise agree to 1e-9 when (1 - 1/n)^k of the difference is left: 25 n rows.
        let range = core.adx(0, end, &high, &low, &close, n as i32, &mut a).unwrap();
        let adx = ours(Adx::new(period(n)), bars.clone());
        // Where no bar has a direction at first, TA-Lib's index is 0; here there is none until one has.
        let directed = |w: &[Bar]| {
            let (rise, fall) = (w[1].high.to_f64() - w[0].high.to_f64(), w[0].low.to_f64() - w[1].low.to_f64());
            rise != fall && rise.max(fall) > 0.0
        };
        if bars[..=n].windows(2).any(directed) {
            agree("adx", &adx.iter().map(|d| d.map(|d| d.index)).collect::<Vec<_>>(), &rows(&a, range), 25 * n, 100.0)?;
        }
        for up in [true, false] {
            let range = if up {
                core.plus_di(0, end, &high, &low, &close, n as i32, &mut a).unwrap()
            } else {
                core.minus_di(0, end, &high, &low, &close, n as i32, &mut a).unwrap()
            };
            let theirs = rows(&a, range);
            for (row, direction) in adx.iter().enumerate().skip(25 * n) {
                let found = direction.map(|d| if up { d.up } else { d.down }).unwrap();
                prop_assert!((found - theirs[row].unwrap()).abs() < 1e-7, "di at {}: {} and {:?}", row, found, theirs[row]);
            }
        }
        let channel = ours(Donchian::new(period(n)), bars.clone());
        let range = core.max(0, end, &high, n as i32, &mut a).unwrap();
        prop_assert_eq!(channel.iter().map(|c| c.map(|c| c.upper)).collect::<Vec<_>>(), rows(&a, range));
        let range = core.min(0, end, &low, n as i32, &mut a).unwrap();
        prop_assert_eq!(channel.iter().map(|c| c.map(|c| c.lower)).collect::<Vec<_>>(), rows(&a, range));
    }

    #[test]
    fn lines_are_those_of_ta_lib(bars in walk(), n in 3_usize..40) {
        let (core, end) = (Core::new(), LENGTH - 1);
        let (closes, highs) = (closes(&bars), column(&bars, |bar| bar.high));
        let mut out = vec![0.0; LENGTH];
        let range = core.correl(0, end, &closes, &highs, n as i32, &mut out).unwrap();
        let correlation = ours(Correlation::new(period(n)), closes.iter().copied().zip(highs));
        for (row, (a, b)) in correlation.iter().zip(rows(&out, range)).enumerate() {
            // Sums of squares of 100, of which TA-Lib keeps 16 digits, against variances of a tick squared at least.
            if let (Some(a), Some(b)) = (a, b) {
                let window = &closes[row + 1 - n..=row];
                if window.iter().any(|close| (close - window[0]).abs() > 1.0) {
                    prop_assert!((a - b).abs() < 1e-6, "correlation at {}: {} and {}", row, a, b);
                }
            }
        }
        let range = core.linearreg_slope(0, end, &closes, n as i32, &mut out).unwrap();
        let lines = ours(Regression::new(period(n)), closes.iter().enumerate().map(|(k, close)| (k as f64, *close)));
        let constant = |row: usize| closes[row + 1 - n..=row].iter().all(|close| *close == closes[row]);
        for (row, theirs) in rows(&out, range).into_iter().enumerate().skip(n - 1).filter(|(row, _)| !constant(*row)) {
            let line = lines[row].unwrap();
            prop_assert!((line.slope - theirs.unwrap()).abs() < 1e-9, "slope at {}: {} and {:?}", row, line.slope, theirs);
        }
    }

    /// What TA-Lib has not, computed as it is defined over each window anew.
    #[test]
    fn what_ta_lib_has_not_is_as_defined(bars in walk(), n in 2_usize..40, decay in 0.5..0.99_f64) {
        let closes = closes(&bars);
        let returns: Vec<f64> = closes.windows(2).map(|pair| (pair[1] / pair[0]).ln()).collect();
        let volatility = ours(EwmaVolatility::new(decay).unwrap(), returns.clone());
        let scores = ours(ZScore::new(period(n)), closes.clone());
        let highs = column(&bars, |bar| bar.high);
        let lines = ours(Regression::new(period(n)), highs.iter().copied().zip(closes.clone()));
        for end in n..=LENGTH {
            let window = &closes[end - n..end];
            let mean = window.iter().sum::<f64>() / n as f64;
            let deviation = (window.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n as f64).sqrt();
            match scores[end - 1] {
                Some(score) => prop_assert!((score - (closes[end - 1] - mean) / deviation).abs() < 1e-9),
                None => prop_assert!(window.iter().all(|x| *x == window[0])),
            }
            let Some(line) = lines[end - 1] else { continue };
            let x = &highs[end - n..end];
            let mean_x = x.iter().sum::<f64>() / n as f64;
            let sxx: f64 = x.iter().map(|x| (x - mean_x).powi(2)).sum();
            let sxy: f64 = x.iter().zip(window).map(|(x, y)| (x - mean_x) * (y - mean)).sum();
            let residuals: Vec<f64> = x.iter().zip(window).map(|(x, y)| y - mean - sxy / sxx * (x - mean_x)).collect();
            let deviation = (residuals.iter().map(|r| r * r).sum::<f64>() / n as f64).sqrt();
            prop_assert!((line.slope - sxy / sxx).abs() < 1e-9 && (line.residual - residuals[n - 1]).abs() < 1e-9);
            prop_assert!((line.deviation - deviation).abs() < 1e-9);
        }
        let last = returns.len() - 1;
        let weight = |k: usize| decay.powi((last - k) as i32);
        let (mut squares, mut weights) = (0.0, 0.0);
        for (k, r) in returns.iter().enumerate() {
            squares += weight(k) * r * r;
            weights += weight(k);
        }
        prop_assert!((volatility[last].unwrap() / (squares / weights).sqrt() - 1.0).abs() < 1e-9);
        let typical = |bar: &Bar| (bar.high.to_f64() + bar.low.to_f64() + bar.close.to_f64()) / 3.0;
        let average = ours(SessionVwap::new(chrono_tz::UTC), bars.clone());
        let value: f64 = bars.iter().map(|bar| typical(bar) * bar.volume).sum();
        let volume: f64 = bars.iter().map(|bar| bar.volume).sum();
        prop_assert!((average[LENGTH - 1].unwrap() / (value / volume) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn every_indicator_keeps_its_contract(bars in walk(), n in 2_usize..20) {
        let n = period(n);
        let closes = closes(&bars);
        let bad = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 2.0 * LARGEST];
        let [one, two] = [1, 2].map(period);
        macro_rules! check {
            ($indicator:expr, $inputs:expr, $refused:expr) => {
                check_indicator(stringify!($indicator), &$indicator, &$inputs, &$refused)
                    .map_err(|violation| TestCaseError::fail(violation.to_string()))?
            };
        }
        check!(Sma::new(n), closes, bad);
        check!(Ema::new(n), closes, bad);
        check!(WilderAverage::new(n), closes, bad);
        check!(StandardDeviation::new(n), closes, bad);
        check!(ZScore::new(n), closes, bad);
        check!(Bollinger::new(n, 2.0).unwrap(), closes, bad);
        check!(RollingMinimum::new(n), closes, bad);
        check!(RollingMaximum::new(n), closes, bad);
        check!(RateOfChange::new(n), closes, bad);
        check!(Rsi::new(n), closes, bad);
        check!(Macd::new(one, n, two).unwrap(), closes, bad);
        check!(EwmaVolatility::new(0.9).unwrap(), closes, bad);
        check!(EwmaVolatility::centred(n), closes, bad);
        let pairs: Vec<(f64, f64)> = bars.iter().map(|bar| (bar.close.to_f64(), bar.volume)).collect();
        let bad_pairs = [(f64::NAN, 1.0), (1.0, f64::NAN), (f64::INFINITY, 1.0)];
        check!(Regression::new(n), pairs, bad_pairs);
        check!(Correlation::new(n), pairs, bad_pairs);
        check!(Obv::new(), pairs, bad_pairs);
        check!(Vwap::new(), pairs, bad_pairs);
        check!(Atr::new(n), bars, []);
        check!(Adx::new(n), bars, []);
        check!(Donchian::new(n), bars, []);
        check!(Stochastic::new(n, two, one), bars, []);
        let bad_bars = [f64::NAN, -1.0].map(|volume| Bar { volume, ..bars[0] });
        check!(SessionVwap::new(chrono_tz::UTC), bars, bad_bars);
    }
}
