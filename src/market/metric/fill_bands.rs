//! How far a result hangs on the prices of its fills: the same fills at the best and at the worst price there was.

use serde::Serialize;

use crate::market::{Fill, MoneyError, Record};

/// Equity at the end with the fills of a run at other prices of their times [currency].
///
/// Each fill was made at one price of those the data show for its time: between low and high of its bar, between bid and ask of
/// its quote. What is told here is what the choice came to at most; whether an order that waits is filled at all is for
/// [`Matching`](crate::market::Matching), and fees stay as they are.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FillBands {
    /// Each fill at the best price of its time.
    pub optimistic: f64,
    /// As it was filled.
    pub expected: f64,
    /// Each fill at the worst price of its time, or where it was filled if that is worse.
    pub pessimistic: f64,
}

impl FillBands {
    /// Those of `record`.
    ///
    /// # Errors
    /// If an amount of cash is beyond what can be held.
    pub fn of(record: &Record) -> Result<Self, MoneyError> {
        let expected = record.ledger.equity()?.to_f64();
        let [best, worst] = record.blotter.fills.iter().fold([0.0, 0.0], |[best, worst], fill| {
            let [more, less] = spread_of(record, fill);
            [best + more, worst + less]
        });
        Ok(Self { optimistic: expected + best, expected, pessimistic: expected - worst })
    }

    /// Equity at each point of `record` with all fills so far at the best price of their times, and at the worst [currency].
    #[must_use]
    pub fn curves(record: &Record) -> [Vec<f64>; 2] {
        let mut fills = record.blotter.fills.iter().peekable();
        let (mut best, mut worst) = (0.0, 0.0);
        let last = record.equity.len().saturating_sub(1);
        let points = record.equity.iter().enumerate().map(|(k, point)| {
            // What is filled at an instant is not in the equity of that instant yet, but in the last.
            while let Some(fill) = fills.next_if(|fill| fill.filled_at < point.time || k == last) {
                let [more, less] = spread_of(record, fill);
                (best, worst) = (best + more, worst + less);
            }
            (point.equity + best, point.equity - worst)
        });
        let (optimistic, pessimistic) = points.unzip();
        [optimistic, pessimistic]
    }
}

/// By how much the best price of a fill's time was better than its own, and the worst one worse, for all of it [currency].
fn spread_of(record: &Record, fill: &Fill) -> [f64; 2] {
    let [low, high] = fill.why.band.map(|price| price.to_f64());
    let price = fill.price.to_f64();
    let (best, worst) = if fill.side.sign() > 0.0 { (price - low, high - price) } else { (high - price, price - low) };
    let each = fill.quantity.to_f64() * record.worth_of_one(fill);
    [best.max(0.0) * each, worst.max(0.0) * each]
}
