//! The histories of all instruments, merged by when things happened.

use crate::sim2real::Timestamp;

use super::{Bar, DepthChange, Event, EventKind, History, OrderEvent, Print, Quotes};

/// The rows of one kind of one instrument.
#[derive(Debug, Clone, Copy)]
enum Rows<'d> {
    Bars(&'d [Bar]),
    Quotes(&'d Quotes),
    Prints(&'d [Print], &'d History),
    Depth(&'d [DepthChange]),
    Orders(&'d [OrderEvent]),
}

impl Rows<'_> {
    fn len(&self) -> usize {
        match self {
            Self::Bars(rows) => rows.len(),
            Self::Quotes(rows) => rows.len(),
            Self::Prints(rows, _) => rows.len(),
            Self::Depth(rows) => rows.len(),
            Self::Orders(rows) => rows.len(),
        }
    }

    /// When row `row` happens, at the exchange: a bar when it is over. [`Timestamp::MAX`] beyond the last.
    #[inline]
    fn time(&self, row: usize) -> Timestamp {
        let time = match self {
            Self::Bars(rows) => rows.get(row).map(|bar| bar.known_at),
            Self::Quotes(rows) => rows.times().get(row).copied(),
            Self::Prints(rows, _) => rows.get(row).map(|print| print.time),
            Self::Depth(rows) => rows.get(row).map(|change| change.time),
            Self::Orders(rows) => rows.get(row).map(|event| event.time),
        };
        time.unwrap_or(Timestamp::MAX)
    }

    /// When the row can be known.
    #[inline]
    fn known_at(&self, row: usize) -> Timestamp {
        match self {
            Self::Prints(_, history) => history.print_known_at(row).unwrap_or(Timestamp::MAX),
            Self::Depth(rows) => rows.get(row).map_or(Timestamp::MAX, |change| change.known_at),
            Self::Orders(rows) => rows.get(row).map_or(Timestamp::MAX, |event| event.known_at),
            _ => self.time(row),
        }
    }

    /// One row behind the last of those that belong to the same instant as `row`: a book is told in many changes, and is
    /// whole when all of one instant are in.
    #[inline]
    fn batch(&self, row: usize) -> usize {
        match self {
            Self::Depth(rows) => row + rows[row..].iter().take_while(|change| change.time == rows[row].time).count(),
            Self::Orders(rows) => row + rows[row..].iter().take_while(|event| event.time == rows[row].time).count(),
            _ => row + 1,
        }
    }
}

/// The rows of one kind of one instrument, and how far they have been read.
#[derive(Debug, Clone)]
struct Track<'d> {
    instrument: usize,
    kind: EventKind,
    rows: Rows<'d>,
    next: usize,
}

/// Some rows that became known together: one, but for changes of a book.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Arrival {
    /// What happened, and when at the exchange.
    pub event: Event,
    /// First row of it, on the instrument's history.
    pub row: usize,
    /// One row behind the last.
    pub end: usize,
    /// When it can be known.
    pub known_at: Timestamp,
}

/// Everything that happens, in order: by time; at one time by instrument, and within it bars, trades, changes of the book,
/// quotes.
#[derive(Debug, Clone)]
pub struct Feed<'d> {
    tracks: Vec<Track<'d>>,
    /// Next time of each track.
    times: Vec<Timestamp>,
    /// A tournament of the tracks: at each inner node the loser of the match there, and at 0 the winner of all.
    losers: Vec<u32>,
    last: Option<Timestamp>,
    events: usize,
}

impl<'d> Feed<'d> {
    /// A feed of the given histories, one an instrument.
    #[must_use]
    pub fn new(histories: &'d [History]) -> Self {
        let mut tracks = Vec::new();
        for (instrument, history) in histories.iter().enumerate() {
            for (kind, rows) in [
                (EventKind::Bar, Rows::Bars(history.bars())),
                (EventKind::Trade, Rows::Prints(history.prints(), history)),
                (EventKind::Depth, Rows::Depth(history.depth())),
                (EventKind::Depth, Rows::Orders(history.order_events())),
                (EventKind::Quote, Rows::Quotes(history.quotes())),
            ] {
                if rows.len() > 0 {
                    tracks.push(Track { instrument, kind, rows, next: 0 });
                }
            }
        }
        let times: Vec<Timestamp> = tracks.iter().map(|track| track.rows.time(0)).collect();
        let ends = tracks.iter().map(|track| track.rows.time(track.rows.len() - 1));
        let last = ends.max();
        let events = tracks.iter().map(|track| track.rows.len()).sum();
        let mut feed = Self { losers: vec![0; tracks.len()], tracks, times, last, events };
        feed.build();
        feed
    }

    /// When the next event happens.
    #[inline]
    #[must_use]
    pub fn peek(&self) -> Option<Timestamp> {
        let winner = *self.losers.first()?;
        Some(self.times[winner as usize]).filter(|time| *time < Timestamp::MAX)
    }

    /// When the last event of all happens.
    #[must_use]
    pub fn end(&self) -> Option<Timestamp> {
        self.last
    }

    /// Number of all rows.
    #[must_use]
    pub fn events(&self) -> usize {
        self.events
    }

    /// The row of the next bar of an instrument, which is not over yet.
    #[must_use]
    pub(super) fn next_bar(&self, instrument: usize) -> Option<usize> {
        let of = |track: &&Track<'_>| track.instrument == instrument && track.kind == EventKind::Bar;
        self.tracks.iter().find(of).map(|track| track.next)
    }

    fn build(&mut self) {
        let count = self.tracks.len();
        // Leaf k stands at node count + k; each match is played once both who play it are known.
        let mut winners = vec![0_u32; 2 * count];
        for (k, winner) in winners.iter_mut().skip(count).enumerate() {
            *winner = k as u32;
        }
        for node in (1..count).rev() {
            let (a, b) = (winners[2 * node], winners[2 * node + 1]);
            let (winner, loser) = if self.beats(a, b) { (a, b) } else { (b, a) };
            (winners[node], self.losers[node]) = (winner, loser);
        }
        if let Some(first) = self.losers.first_mut() {
            *first = if count == 1 { 0 } else { winners[1] };
        }
    }

    /// Whether track `a` comes before track `b`.
    #[inline]
    fn beats(&self, a: u32, b: u32) -> bool {
        (self.times[a as usize], a) < (self.times[b as usize], b)
    }

    /// Plays the matches on the way of a track, whose time has changed, to the top.
    #[inline]
    fn replay(&mut self, track: u32) {
        let (mut winner, mut node) = (track, (self.tracks.len() + track as usize) / 2);
        while node > 0 {
            if self.beats(self.losers[node], winner) {
                std::mem::swap(&mut winner, &mut self.losers[node]);
            }
            node /= 2;
        }
        self.losers[0] = winner;
    }
}

impl Iterator for Feed<'_> {
    type Item = Arrival;

    #[inline(always)]
    fn next(&mut self) -> Option<Arrival> {
        let time = self.peek()?;
        let winner = self.losers[0];
        let track = &mut self.tracks[winner as usize];
        let (row, end) = (track.next, track.rows.batch(track.next));
        let known_at = track.rows.known_at(row).max(time);
        let event = Event { time, instrument: track.instrument, kind: track.kind };
        track.next = end;
        // Rows are in the order in which they were known; the exchange's clock may step back a little.
        self.times[winner as usize] = track.rows.time(end).max(time);
        self.replay(winner);
        Some(Arrival { event, row, end, known_at })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::market::{Bar, Level, Price, Quotes};
    use proptest::prelude::*;

    fn bar(known_at: i64) -> Bar {
        let price = Price(1);
        let (open_at, known_at) = (Timestamp(known_at - 1), Timestamp(known_at));
        Bar { open_at, known_at, open: price, high: price, low: price, close: price, volume: 0.0 }
    }

    #[test]
    fn events_come_by_time_then_instrument_then_kind() {
        let mut quotes = Quotes::with_depth(1);
        for t in [4, 4, 5] {
            quotes.push(Timestamp(t), &[Level { price: 1.0, size: 1.0 }], &[]);
        }
        let histories = [
            History::new(vec![bar(4), bar(8)], quotes).unwrap(),
            History::new(vec![bar(3), bar(5)], Quotes::default()).unwrap(),
        ];
        let feed = Feed::new(&histories);
        assert_eq!((feed.peek(), feed.end(), feed.events()), (Some(Timestamp(3)), Some(Timestamp(8)), 7));
        let order: Vec<(i64, usize, EventKind, usize)> =
            feed.map(|a| (a.event.time.0, a.event.instrument, a.event.kind, a.row)).collect();
        use EventKind::{Bar, Quote};
        assert_eq!(
            order,
            [
                (3, 1, Bar, 0),
                (4, 0, Bar, 0),
                (4, 0, Quote, 0),
                (4, 0, Quote, 1),
                (5, 0, Quote, 2),
                (5, 1, Bar, 1),
                (8, 0, Bar, 1)
            ]
        );
        assert_eq!(Feed::new(&[]).peek(), None);
    }

    proptest! {
        /// Any number of tracks come out as a stable sort by time, instrument and kind would have them.
        #[test]
        fn a_merge_is_a_stable_sort(lengths in proptest::collection::vec((proptest::collection::vec(1..50_i64, 0..30), 0..40_i64), 0..9)) {
            let histories: Vec<History> = lengths
                .iter()
                .map(|(steps, start)| {
                    let mut time = *start;
                    let times = steps.iter().map(|step| { time += step; bar(time) });
                    History::new(times.collect(), Quotes::default()).unwrap()
                })
                .collect();
            let mut expected: Vec<(Timestamp, usize, usize)> = Vec::new();
            for (k, history) in histories.iter().enumerate() {
                expected.extend(history.bars().iter().enumerate().map(|(row, bar)| (bar.known_at, k, row)));
            }
            expected.sort();
            let found: Vec<_> = Feed::new(&histories).map(|a| (a.event.time, a.event.instrument, a.row)).collect();
            prop_assert_eq!(found, expected);
        }
    }
}
