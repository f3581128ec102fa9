//! Where orders meet the market: the assembly identified from recorded fills, or any other, run on the histories.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use serde::{Deserialize, Serialize};

use crate::sim2real::{Assembly, Run, Seed, Simulator, Site, Thetas, Tick, Timestamp, Twin};

use super::{Book, Execution, History, InFlight, Met, Report, Side};

/// The price mechanisms start from where there are quotes. Where there are bars only it is the open.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Reference {
    /// Midway between bid and ask.
    Mid,
    /// The best price an order can take.
    Touch,
}

impl Reference {
    /// The reference that suits the mechanisms of `venue`: the mid where one of them adds the spread (`half_spread`,
    /// `book_walk`), else the touch.
    #[must_use]
    pub fn suiting(venue: &Assembly<Execution>) -> Self {
        let adds_spread = venue.modelled().iter().any(|name| matches!(*name, "half_spread" | "book_walk"));
        if adds_spread { Self::Mid } else { Self::Touch }
    }

    fn of(self, book: &Book, side: Side) -> Option<f64> {
        match self {
            Self::Mid => book.mid(),
            Self::Touch => book.touch(side),
        }
    }
}

/// An order on its way, and where it will meet the market.
#[derive(Debug, Clone, Copy)]
struct Waiting {
    instrument: usize,
    order: InFlight,
    meets: Meeting,
}

/// Row of the bar or quote an order meets.
#[derive(Debug, Clone, Copy)]
enum Meeting {
    Bar(usize),
    Quote(usize),
}

/// What the market did with an order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Answer {
    /// Which order.
    pub order_id: u64,
    /// Number of the instrument.
    pub instrument: usize,
    /// When it met the market.
    pub time: Timestamp,
    /// Open or mid it met [currency].
    pub mid: f64,
    /// What is reported.
    pub report: Report,
}

/// Where orders meet the market.
///
/// - Bars: an order meets the first bar that opens at or after its arrival, at its open and never at a price already
///   seen. It may take part in the whole bar's volume, which the venue knows and the strategy does not.
/// - Quotes, which go before bars: an order without delay meets the last quote at or before its decision, one with a
///   delay the last quote before its arrival. Where the side it needs is empty, it waits for the first quote that has it.
///   It may take part in what is displayed on that side.
///
/// Each instrument has a run of its own, so that an impact that lasts stays with the instrument it was made in. A replayed
/// history does not react to our orders: what an impact leaves behind is in the mechanisms' memory only.
#[derive(Debug)]
pub struct Venue<'d> {
    histories: &'d [History],
    runs: Vec<Run<Execution>>,
    reference: Reference,
    averages: bool,
    /// Ids of the mechanisms that act on prices, in their order; and what each added to the price of the last answer
    /// [currency].
    conceding: Vec<&'static str>,
    concessions: Vec<f64>,
    /// Row of each instrument's history that the last order met, or would have without a delay: later ones look on from it.
    since: Vec<usize>,
    /// Orders on their way by when they meet the market, and which comes first at one time; and their places in `orders`.
    due: BinaryHeap<Reverse<(Timestamp, u64, usize)>>,
    orders: Vec<Waiting>,
    free: Vec<usize>,
    origin: Timestamp,
    messages: usize,
}

impl<'d> Venue<'d> {
    /// A venue of `assembly` on `histories`, one an instrument called as in `symbols`; the clock of its mechanisms starts at
    /// `origin`.
    #[must_use]
    pub fn new(
        assembly: &Assembly<Execution>,
        reference: Reference,
        histories: &'d [History],
        symbols: &[&str],
        origin: Timestamp,
        seed: Seed,
    ) -> Self {
        let values: Vec<f64> = assembly.parameters().iter().map(|p| p.nominal).collect();
        let thetas = Thetas::single(&values);
        let still = Thetas::single(&[]);
        let runs = symbols.iter().map(|symbol| assembly.run(&thetas, &still, seed.child(symbol))).collect();
        let (due, orders, free) = (BinaryHeap::new(), Vec::new(), Vec::new());
        let averages = assembly.modelled().contains(&"book_walk");
        let at_plant = assembly.mechanisms().map(|(row, ..)| row.about()).filter(|about| about.site == Site::Plant);
        let conceding: Vec<&'static str> = at_plant.map(|about| about.name).collect();
        let concessions = vec![0.0; conceding.len()];
        let since = vec![0; histories.len()];
        Self { histories, runs, reference, averages, conceding, concessions, since, due, orders, free, origin, messages: 0 }
    }

    /// Whether the prices it reports may be averages over several trades, which lie between ticks.
    #[must_use]
    pub fn averages(&self) -> bool {
        self.averages
    }

    /// What each mechanism added to the price of the last answer, against the order positive [currency], by its id.
    pub fn concessions(&self) -> impl Iterator<Item = (&'static str, f64)> {
        self.conceding.iter().copied().zip(self.concessions.iter().copied())
    }

    /// The price an order of `side` for `instrument` would meet if it arrived as it is decided and nothing stood between:
    /// what the backtest assumes [currency]. Decisions come in the order of time.
    #[must_use]
    pub fn assumed(&mut self, instrument: usize, side: Side, decided_at: Timestamp) -> Option<f64> {
        let history = self.histories.get(instrument)?;
        match self.meets(instrument, side, decided_at, decided_at)?.1 {
            Meeting::Bar(row) => {
                self.since[instrument] = row;
                history.bars().get(row).map(|bar| bar.open.to_f64())
            }
            Meeting::Quote(row) => self.reference.of(&history.quotes().all().get(row)?.book(), side),
        }
    }

    /// Sends an order for `instrument`, and says whether the history is long enough for it to meet the market.
    pub fn send(&mut self, order_id: u64, instrument: usize, order: &InFlight) -> bool {
        let tick = self.tick(order.decided_at);
        let Some(run) = self.runs.get_mut(instrument) else { return false };
        let Some(order) = run.send(tick, order).first().copied() else { return false };
        let met = self.meets(instrument, order.side, order.decided_at, order.arrives_at);
        let Some((time, meets)) = met else { return false };
        let waiting = Waiting { instrument, order, meets };
        let place = match self.free.pop() {
            Some(place) => {
                self.orders[place] = waiting;
                place
            }
            None => {
                self.orders.push(waiting);
                self.orders.len() - 1
            }
        };
        self.due.push(Reverse((time, order_id, place)));
        true
    }

    /// When the next order meets the market.
    #[inline]
    #[must_use]
    pub fn next_due(&self) -> Option<Timestamp> {
        self.due.peek().map(|Reverse((time, ..))| *time)
    }

    /// Lets the next order meet the market.
    pub fn answer(&mut self) -> Option<Answer> {
        let Reverse((time, order_id, place)) = self.due.pop()?;
        self.free.push(place);
        let Waiting { instrument, order, meets, .. } = self.orders[place];
        let (mid, met) = self.meeting(instrument, &order, meets)?;
        let tick = self.tick(time);
        let run = self.runs.get_mut(instrument)?;
        run.deliver(&[order]);
        let (concessions, mut before) = (&mut self.concessions, 0.0);
        run.advance_seen(
            tick,
            |_| met,
            |law, effects| {
                let after = effects.first().map_or(0.0, |effect| effect.concession);
                if let Some(own) = concessions.get_mut(law) {
                    *own = after - before;
                }
                before = after;
            },
        );
        let report = *run.observe(tick.time).first()?;
        Some(Answer { order_id, instrument, time, mid, report })
    }

    /// The mid and all else that `order` meets.
    fn meeting(&self, instrument: usize, order: &InFlight, meets: Meeting) -> Option<(f64, Met)> {
        let history = self.histories.get(instrument)?;
        match meets {
            Meeting::Bar(row) => {
                let bar = history.bars().get(row)?;
                let open = bar.open.to_f64();
                Some((open, Met { book: Book::at_price(bar.open_at, open), reference: open, volume: bar.volume }))
            }
            Meeting::Quote(row) => {
                let book = history.quotes().all().get(row)?.book();
                let reference = self.reference.of(&book, order.side)?;
                let volume = book.opposite(order.side).iter().map(|level| level.size).sum();
                Some((book.mid().unwrap_or(reference), Met { book, reference, volume }))
            }
        }
    }

    /// When and where an order meets the market.
    fn meets(
        &self,
        instrument: usize,
        side: Side,
        decided_at: Timestamp,
        arrives_at: Timestamp,
    ) -> Option<(Timestamp, Meeting)> {
        let history = self.histories.get(instrument)?;
        if history.quotes().is_empty() {
            let bars = history.bars();
            let row = first_from(self.since[instrument], bars.len(), |row| bars[row].open_at < arrives_at);
            return bars.get(row).map(|bar| (bar.open_at, Meeting::Bar(row)));
        }
        let quotes = history.quotes().all();
        // What carries the stamp of the decision was known by then; what carries that of the arrival was not.
        let seen = quotes.times().partition_point(|time| *time < arrives_at || *time <= decided_at);
        let usable = |row: &usize| quotes.get(*row).is_some_and(|quote| self.reference.of(&quote.book(), side).is_some());
        if let Some(row) = seen.checked_sub(1).filter(usable) {
            return Some((arrives_at, Meeting::Quote(row)));
        }
        let row = (seen..quotes.len()).find(usable)?;
        Some((quotes.times()[row].max(arrives_at), Meeting::Quote(row)))
    }

    fn tick(&mut self, time: Timestamp) -> Tick {
        let index = self.messages;
        self.messages += 1;
        Tick { index, time: time.seconds_since(self.origin), step: 0.0 }
    }
}

/// The first row from `start` on that is not `before`, or `rows` where all are: found in steps that double, for it is
/// most often near.
fn first_from(start: usize, rows: usize, before: impl Fn(usize) -> bool) -> usize {
    let (mut low, mut step) = (start, 1);
    while low + step <= rows && before(low + step - 1) {
        low += step;
        step *= 2;
    }
    let mut high = (low + step).min(rows);
    while low < high {
        let middle = low + (high - low) / 2;
        if before(middle) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    low
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_row_is_found_from_anywhere_before_it() {
        for rows in 0..40 {
            for answer in 0..=rows {
                for start in 0..=answer {
                    assert_eq!(first_from(start, rows, |row| row < answer), answer, "from {start} of {rows}");
                }
            }
        }
    }
}
