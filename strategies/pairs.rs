//! `pairs`: two instruments that go together, traded where they part.

use serde::Deserialize;

use crate::market::indicator::{Indicator, Regression, ZScore};
use crate::market::{EventKind, Orders, Quantity, Strategy, View};

use super::reversion::{Reversion, Thresholds};
use super::{Kind, StrategyError, check_period, check_weight, most_of_it, read};

/// Long the first of two instruments and short the second where the spread between them is far below its mean, the other
/// way about where it is far above, until it is back.
///
/// The spread is `ln A - h ln B` of their closes. With a `hedge_ratio` given, its score is taken from the mean and standard
/// deviation of the last `window` spreads. Without, h is the slope of the regression of `ln A` on `ln B` over the last
/// `window`, and the score is the last residual over the standard deviation of all. As the logarithms are those of values,
/// 1 held of A is hedged by h held of B, in money; h = 1 is the one dollar long and short of E. Gatev, W. N. Goetzmann and
/// K. G. Rouwenhorst, "Pairs trading: performance of a relative-value arbitrage rule", Review of Financial Studies 19
/// (2006); the regression is that of G. Vidyamurthy, Pairs Trading: Quantitative Methods and Analysis, 2004.
///
/// Bars count where both instruments have one that was known at the same time; others are passed over. Sizes are fixed when
/// a side is taken; what of them is not filled is asked for again at each bar. Nothing is begun at a slope that is not above
/// 0, with a size below a lot, or while the spread varies by less than 1e-12, which is rounding.
#[derive(Debug, Clone)]
pub struct Pairs {
    parameters: Parameters,
    thresholds: Thresholds,
    spread: Spread,
    reversion: Reversion,
    /// The side the targets are those of.
    side: i64,
    targets: [Quantity; 2],
}

pub(super) const KIND: Kind = Kind {
    name: "pairs",
    about: "long one of two instruments and short the other where the spread between them is far off its mean",
    example: include_str!("pairs.toml"),
    parameters: &["symbols", "window", "hedge_ratio", "entry", "exit", "stop", "weight"],
    instruments: 2,
    build: |parameters| Ok(Box::new(Pairs::new(read(&KIND, parameters)?)?)),
};

/// Parameters of [`Pairs`].
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// The two instruments; the first two of the run where none are named.
    pub symbols: Option<[String; 2]>,
    /// Number of bars of the spread's mean and deviation, or of the regression.
    pub window: usize,
    /// What is held of the second for 1 of the first, in money; none for the slope of the regression.
    pub hedge_ratio: Option<f64>,
    /// How far off a side is taken [standard deviations].
    pub entry: f64,
    /// How far off it is left [standard deviations].
    #[serde(default)]
    pub exit: f64,
    /// How far off it is given up [standard deviations]; none for never.
    pub stop: Option<f64>,
    /// Part of the equity to hold, both sides counted as positive.
    #[serde(default = "most_of_it")]
    pub weight: f64,
}

/// Where the hedge ratio comes from.
#[derive(Debug, Clone)]
enum Spread {
    Fixed { ratio: f64, score: ZScore },
    Rolling(Regression),
}

impl Spread {
    /// The least deviation that counts: logarithms of prices are rounded to a thousandth of it.
    const LEAST: f64 = 1e-12;

    /// The score and the hedge ratio after logarithms of both prices.
    fn update(&mut self, a: f64, b: f64) -> Option<(f64, f64)> {
        match self {
            Self::Fixed { ratio, score } => {
                let value = score.update(a - *ratio * b)?;
                (score.deviation().value()? > Self::LEAST).then_some((value, *ratio))
            }
            Self::Rolling(regression) => {
                let line = regression.update((b, a))?;
                (line.deviation > Self::LEAST).then(|| (line.residual / line.deviation, line.slope))
            }
        }
    }
}

impl Pairs {
    /// A strategy with the given parameters.
    ///
    /// # Errors
    /// If not 4 <= window <= 1,000,000, or 0 <= exit < entry < stop; if the two symbols are one; or if the hedge ratio or
    /// the weight is not above 0.
    pub fn new(parameters: Parameters) -> Result<Self, StrategyError> {
        let value = |parameter, value: String, hint| Err(StrategyError::Value { kind: KIND.name, parameter, value, hint });
        let period = check_period(&KIND, "window", parameters.window, 4)?;
        let thresholds = Thresholds::new(&KIND, parameters.entry, parameters.exit, parameters.stop)?;
        if let Some([a, b]) = &parameters.symbols
            && a == b
        {
            return value("symbols", format!("{a} twice"), "a pair is of two instruments");
        }
        let spread = match parameters.hedge_ratio {
            Some(ratio) if !(ratio > 0.0 && ratio <= 1e6) => {
                return value("hedge_ratio", ratio.to_string(), "it is above 0, as 1; leave it out for a regression");
            }
            Some(ratio) => Spread::Fixed { ratio, score: ZScore::new(period) },
            None => Spread::Rolling(Regression::new(period)),
        };
        check_weight(&KIND, parameters.weight)?;
        let targets = [Quantity::ZERO; 2];
        Ok(Self { parameters, thresholds, spread, reversion: Reversion::default(), side: 0, targets })
    }

    fn legs(&self, view: &View<'_>) -> Option<[usize; 2]> {
        match &self.parameters.symbols {
            Some([a, b]) => Some([view.find(a)?, view.find(b)?]),
            None => (view.instruments().len() >= 2).then_some([0, 1]),
        }
    }

    /// Takes `side` of the spread, with sizes of both legs for the equity of now.
    fn take(&mut self, view: &View<'_>, legs: [usize; 2], side: i64, ratio: f64) {
        self.side = side;
        self.targets = [Quantity::ZERO; 2];
        if side == 0 || ratio <= 0.0 {
            return;
        }
        let first = self.parameters.weight * view.equity().to_f64() / (1.0 + ratio);
        let [a, b] = [view.lots_worth(legs[0], first), view.lots_worth(legs[1], ratio * first)];
        if a > Quantity::ZERO && b > Quantity::ZERO {
            self.targets = [Quantity(side * a.0), Quantity(-side * b.0)];
        }
    }
}

impl Strategy for Pairs {
    fn name(&self) -> &str {
        KIND.name
    }
    fn copied(&self) -> Option<Box<dyn Strategy>> {
        Some(Box::new(self.clone()))
    }

    fn lookback(&self) -> usize {
        1
    }

    fn on_event(&mut self, view: &View<'_>, orders: &mut Orders) {
        let event = view.event();
        let Some(legs) = self.legs(view).filter(|legs| legs.contains(&event.instrument)) else { return };
        let [Some(a), Some(b)] = legs.map(|leg| view.bars(leg).last()) else { return };
        if event.kind != EventKind::Bar || a.known_at != b.known_at {
            return;
        }
        if let Some((score, ratio)) = self.spread.update(a.close.to_f64().ln(), b.close.to_f64().ln()) {
            let side = self.reversion.after(score, &self.thresholds);
            if side != self.side {
                self.take(view, legs, side, ratio);
            }
        }
        for (leg, target) in legs.into_iter().zip(self.targets) {
            orders.to_position(view, leg, target);
        }
    }
}
