//! Orders out of trades beside a book: the trades of one stamp, one side and neighbouring numbers are one order.

use crate::market::{NumberedPrint, Price, Quantity, Side};
use crate::sim2real::Timestamp;

use super::book::TapeBook;
use super::found::{LeftOut, TapeCounts, TapeFill, TapeOrder, TapeOrderKind, TapeSink};

/// Trades that are put together into one order.
#[derive(Debug, Clone)]
struct Run {
    at: Timestamp,
    side: Side,
    first_number: Option<i64>,
    touch: Option<[Price; 2]>,
    fills: Vec<TapeFill>,
    /// Why it cannot be used, where that is known already.
    left_out: Option<LeftOut>,
}

/// Reads trades in the order of their stamps, each beside the book that was shown strictly before its stamp.
///
/// An order that takes level after level never meets a better price after a worse one, so a trade at a better price begins
/// another order. Orders of one stamp after the first are left out: what the first left them is not on the tape. So are, where that
/// is asked for, orders that come within some milliseconds of the trade before them: in bursts feeds tell of the book later than that.
#[derive(Debug, Default)]
pub(super) struct ByTrade {
    run: Option<Run>,
    /// Stamp and number of the last trade, whoever took.
    last: Option<(Timestamp, Option<i64>)>,
    unnumbered: i64,
    /// How long after a trade an order must come at least [ns].
    apart: i64,
}

impl ByTrade {
    pub(super) fn new(apart: i64) -> Self {
        Self { apart, ..Self::default() }
    }

    /// Takes in a trade; `book` is what was shown strictly before its stamp.
    pub(super) fn trade<S: TapeSink>(
        &mut self,
        trade: &NumberedPrint,
        book: &TapeBook,
        counts: &mut TapeCounts,
        sink: &mut S,
    ) -> Result<(), S::Error> {
        let print = trade.print.what;
        counts.prints += 1;
        sink.print(print)?;
        let before = self.last.replace((print.time, trade.number));
        let exact = Price::nearest(print.price).ok().zip(Quantity::nearest(print.size).ok().filter(|size| size.0 > 0));
        let (Some((price, quantity)), Some(side)) = (exact, print.aggressor) else {
            counts.leave(if print.aggressor.is_none() { LeftOut::NoAggressor } else { LeftOut::Unfit });
            return self.end_run(counts, sink);
        };
        let fill = TapeFill { filled_at: print.time, quantity, price };
        let missing = before.is_some_and(|(_, last)| follows(last, trade.number) == Some(false));
        if let Some(run) = self.run.as_mut().filter(|run| !missing && run.goes_on_with(side, &fill)) {
            run.fills.push(fill);
            return Ok(());
        }
        let shares = before.is_some_and(|(at, _)| at == print.time);
        let too_soon = before.is_some_and(|(at, _)| print.time - at < self.apart);
        if let Some(run) = self.run.as_mut().filter(|run| missing && run.at == print.time) {
            run.left_out = Some(LeftOut::MissingTrade);
        }
        self.end_run(counts, sink)?;
        let left_out = match book.touch() {
            _ if shares && missing => Some(LeftOut::MissingTrade),
            _ if shares => Some(LeftOut::SharedStamp),
            _ if too_soon => Some(LeftOut::TooSoon),
            None => Some(LeftOut::NoBook),
            Some(_) => None,
        };
        self.run =
            Some(Run { at: print.time, side, first_number: trade.number, touch: book.touch(), fills: vec![fill], left_out });
        Ok(())
    }

    /// Gives out what is left.
    pub(super) fn end_run<S: TapeSink>(&mut self, counts: &mut TapeCounts, sink: &mut S) -> Result<(), S::Error> {
        let Some(run) = self.run.take() else { return Ok(()) };
        let Some(touch) = run.touch.filter(|_| run.left_out.is_none()) else {
            counts.leave(run.left_out.unwrap_or(LeftOut::NoBook));
            return Ok(());
        };
        self.unnumbered += 1;
        let order = TapeOrder {
            id: run.first_number.unwrap_or(self.unnumbered),
            side: run.side,
            quantity: Quantity(run.fills.iter().map(|fill| fill.quantity.0).fold(0, i64::saturating_add)),
            decided_at: run.at + -1,
            kind: TapeOrderKind::Market,
            touch,
            fills: run.fills,
        };
        counts.take(&order);
        sink.order(order)
    }
}

impl Run {
    /// Whether a trade belongs to the same order.
    fn goes_on_with(&self, side: Side, fill: &TapeFill) -> bool {
        let last = self.fills.last().map_or(fill.price, |last| last.price);
        self.at == fill.filled_at && self.side == side && side.opposite().accepts(fill.price, last)
    }
}

/// Whether one number follows the other, where trades have numbers.
fn follows(last: Option<i64>, number: Option<i64>) -> Option<bool> {
    let (last, number) = (last?, number?);
    Some(last.checked_add(1) == Some(number))
}
