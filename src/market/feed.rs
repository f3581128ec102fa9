//! The histories of all instruments, merged by when things happened.

use std::ops::Range;
use std::sync::Arc;

use crate::sim2real::Timestamp;

use super::line::Line;
use super::sources::RowKind;
use super::stream::StreamError;
use super::{Bar, Event, History, Sources};

/// The rows of one kind of one instrument, and how far they have been read.
#[derive(Debug, Clone, Copy)]
struct Track {
    instrument: usize,
    kind: RowKind,
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
#[derive(Debug)]
pub struct Feed {
    lines: Vec<Line>,
    tracks: Vec<Track>,
    /// Next time of each track.
    times: Vec<Timestamp>,
    /// A tournament of the tracks: at each inner node the loser of the match there, and at 0 the winner of all.
    losers: Vec<u32>,
    /// The track given out last has to read on before the next row.
    low: Option<u32>,
}

/// Bars of one instrument that come one after the other.
pub(super) struct BarsAlone<'f> {
    pub instrument: usize,
    /// All at hand.
    pub bars: &'f Arc<Vec<Bar>>,
    /// Those of them that come before more must be read.
    pub next: Range<usize>,
    /// The row of the first of these.
    pub row: usize,
    /// When other data come between.
    pub end: Timestamp,
}

impl Feed {
    /// A feed of the given histories, one an instrument.
    #[must_use]
    pub fn new(histories: &[History]) -> Self {
        Self::of(histories.iter().map(Line::whole).collect())
    }

    /// The same without the rows that were known before `from`.
    #[must_use]
    pub fn from(histories: &[History], from: Timestamp) -> Self {
        let mut feed = Self::new(histories);
        for (track, time) in feed.tracks.iter_mut().zip(&mut feed.times) {
            let line = &feed.lines[track.instrument];
            track.next = line.first_known(track.kind, from);
            *time = line.time(track.kind, track.next);
        }
        feed.build();
        feed
    }

    /// A feed of streams, of each instrument those at its place. It is for who reads on when it [is low](Self::is_low).
    ///
    /// # Errors
    /// What the streams refuse of their first rows.
    pub fn streaming(sources: Vec<Sources>) -> Result<Self, StreamError> {
        Ok(Feed::of(sources.into_iter().map(Line::of).collect::<Result<_, _>>()?))
    }

    fn of(lines: Vec<Line>) -> Self {
        let all = lines.iter().enumerate().flat_map(|(instrument, line)| {
            let told = RowKind::ALL.into_iter().filter(|kind| line.tells(*kind));
            told.map(move |kind| Track { instrument, kind, next: 0 })
        });
        let tracks: Vec<Track> = all.collect();
        let times = tracks.iter().map(|track| lines[track.instrument].time(track.kind, 0)).collect();
        let mut feed = Self { losers: vec![0; tracks.len()], lines, tracks, times, low: None };
        feed.build();
        feed
    }

    /// The same from here on, where all data are in memory: streams give their rows once.
    pub(super) fn forked(&self) -> Option<Self> {
        let lines = self.lines.iter().map(Line::forked).collect::<Option<_>>()?;
        let Self { tracks, times, losers, low, .. } = self;
        Some(Self { lines, tracks: tracks.clone(), times: times.clone(), losers: losers.clone(), low: *low })
    }

    /// When the next event happens.
    #[inline]
    #[must_use]
    pub fn peek(&self) -> Option<Timestamp> {
        let winner = *self.losers.first()?;
        Some(self.times[winner as usize]).filter(|time| *time < Timestamp::MAX)
    }

    /// Number of all rows, where all are in memory.
    #[must_use]
    pub fn rows(&self) -> Option<usize> {
        self.lines.iter().map(Line::rows).sum()
    }

    /// The data of an instrument.
    #[inline(always)]
    pub(super) fn line(&self, instrument: usize) -> &Line {
        &self.lines[instrument]
    }

    /// The data of all instruments.
    pub(super) fn lines(&self) -> &[Line] {
        &self.lines
    }

    /// The row of the next bar of an instrument, which is not over yet.
    #[must_use]
    pub(super) fn next_bar(&self, instrument: usize) -> Option<usize> {
        let of = |track: &&Track| track.instrument == instrument && track.kind == RowKind::Bars;
        self.tracks.iter().find(of).map(|track| track.next)
    }

    /// Whether rows have to be [read](Self::read_on) before the next event.
    #[inline(always)]
    #[must_use]
    pub fn is_low(&self) -> bool {
        self.low.is_some()
    }

    /// Reads on where it is low; of the instrument and kind that came last, rows before `keep` may be forgotten.
    ///
    /// # Errors
    /// What the stream refuses.
    pub fn read_on(&mut self, keep: usize) -> Result<(), StreamError> {
        let Some(low) = self.low.take() else { return Ok(()) };
        let Track { instrument, kind, next } = self.tracks[low as usize];
        self.lines[instrument].read_on(kind, next, keep)
    }

    /// The bars of an instrument at hand, where one of them comes next.
    pub(super) fn bars_alone(&self) -> Option<BarsAlone<'_>> {
        let winner = *self.losers.first()?;
        let Track { instrument, kind, next } = self.tracks[winner as usize];
        if kind != RowKind::Bars {
            return None;
        }
        let (bars, first, limit) = self.lines[instrument].bars_at_hand();
        // The row before the limit is the one with which more is read.
        let to = bars.len().min(limit.saturating_sub(1).saturating_sub(first));
        // The winner has beaten all others: who comes second is among the losers on its way.
        let (mut node, mut end) = ((self.tracks.len() + winner as usize) / 2, Timestamp::MAX);
        while node > 0 {
            end = end.min(self.times[self.losers[node] as usize]);
            node /= 2;
        }
        let from = next - first;
        Some(BarsAlone { instrument, bars, next: from..to.max(from), row: next, end })
    }

    /// The first `count` of [these bars](Self::bars_alone) are over.
    pub(super) fn skip_bars(&mut self, count: usize) {
        let winner = self.losers[0];
        let track = &mut self.tracks[winner as usize];
        track.next += count;
        self.times[winner as usize] = self.lines[track.instrument].time(track.kind, track.next);
        self.replay(winner);
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

impl Iterator for Feed {
    type Item = Arrival;

    #[inline(always)]
    fn next(&mut self) -> Option<Arrival> {
        let time = self.peek()?;
        let winner = self.losers[0];
        let track = &mut self.tracks[winner as usize];
        let Track { instrument, kind, next: row } = *track;
        let line = &self.lines[instrument];
        let end = line.batch(kind, row);
        let known_at = line.known_at(kind, row, time);
        let event = Event { time, instrument, kind: kind.event() };
        track.next = end;
        if line.is_low(kind, end) {
            self.low = Some(winner);
        }
        // Rows are in the order in which they were known; the exchange's clock may step back a little.
        self.times[winner as usize] = line.time(kind, end).max(time);
        self.replay(winner);
        Some(Arrival { event, row, end, known_at })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::market::{Bar, EventKind, Level, Price, Quotes};
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
        assert_eq!((feed.peek(), feed.rows()), (Some(Timestamp(3)), Some(7)));
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
