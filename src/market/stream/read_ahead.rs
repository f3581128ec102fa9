//! A stream that is read by a thread of its own, while the rows before are worked on.

use std::io;
use std::sync::mpsc::{Receiver, Sender, SyncSender, channel, sync_channel};
use std::thread::{Builder, JoinHandle};

use super::{DataNotes, Stream, StreamError};

/// Pieces that lie ready at most: one is enough to keep both sides busy, and another for those that take longer.
const READY: usize = 2;

/// Reads ahead in a stream. What it gives is what the stream gives, piece by piece; it only was read before it is asked for.
pub(in crate::market) struct ReadAhead<T> {
    pieces: Receiver<Piece<T>>,
    /// Where rows were that have been given, for those that come next: memory is not asked for anew.
    used: Sender<Vec<T>>,
    notes: Option<DataNotes>,
    reader: Option<JoinHandle<()>>,
}

/// What one call of the stream gave.
struct Piece<T> {
    rows: Vec<T>,
    more: Result<bool, StreamError>,
    notes: Option<DataNotes>,
}

impl<T: Send + 'static> ReadAhead<T> {
    /// Begins to read.
    ///
    /// # Errors
    /// If no thread can be started.
    pub(in crate::market) fn new<S: Stream<T> + ?Sized + 'static>(mut stream: Box<S>) -> io::Result<Self>
    where
        T: super::Dated,
    {
        let (ready, pieces) = sync_channel(READY);
        let (used, again) = channel();
        let reader = Builder::new().name("read-ahead".to_owned()).spawn(move || read(&mut *stream, &ready, &again))?;
        Ok(Self { pieces, used, notes: None, reader: Some(reader) })
    }
}

/// Reads to the end, to an error, or until nobody wants more.
fn read<T: super::Dated, S: Stream<T> + ?Sized>(stream: &mut S, ready: &SyncSender<Piece<T>>, again: &Receiver<Vec<T>>) {
    loop {
        let mut rows: Vec<T> = again.try_recv().unwrap_or_default();
        rows.clear();
        let more = stream.refill(&mut rows);
        let goes_on = matches!(more, Ok(true));
        let piece = Piece { rows, more, notes: stream.notes().cloned() };
        if ready.send(piece).is_err() || !goes_on {
            return;
        }
    }
}

impl<T: super::Dated + Send + 'static> Stream<T> for ReadAhead<T> {
    fn refill(&mut self, into: &mut Vec<T>) -> Result<bool, StreamError> {
        let Ok(Piece { mut rows, more, notes }) = self.pieces.recv() else {
            // It is over; or its reader has panicked, which is no end.
            if let Some(Err(panic)) = self.reader.take().map(JoinHandle::join) {
                std::panic::resume_unwind(panic);
            }
            return Ok(false);
        };
        self.notes = notes;
        into.append(&mut rows);
        // Where the reader has ended, nobody uses it again.
        drop(self.used.send(rows));
        more
    }

    fn notes(&self) -> Option<&DataNotes> {
        self.notes.as_ref()
    }
}

#[cfg(test)]
mod tests {
    use super::super::Dated;
    use super::*;
    use crate::market::HistoryError;
    use crate::sim2real::Timestamp;

    #[derive(Debug, Clone, Copy, PartialEq)]
    struct Row(i64);

    impl Dated for Row {
        fn time(&self) -> Timestamp {
            Timestamp(self.0)
        }

        fn known_at(&self) -> Timestamp {
            Timestamp(self.0)
        }
    }

    /// Some rows a call, then an end or an error.
    struct Some3 {
        next: i64,
        until: i64,
        fails: bool,
        notes: DataNotes,
    }

    impl Stream<Row> for Some3 {
        fn refill(&mut self, into: &mut Vec<Row>) -> Result<bool, StreamError> {
            if self.next >= self.until {
                let error = HistoryError::Span { row: 7, open_at: Timestamp(1), known_at: Timestamp(0) };
                return if self.fails { Err(error.into()) } else { Ok(false) };
            }
            let end = self.until.min(self.next + 3);
            into.extend((self.next..end).map(Row));
            self.notes.read((end - self.next) as u64);
            self.next = end;
            Ok(true)
        }

        fn notes(&self) -> Option<&DataNotes> {
            Some(&self.notes)
        }
    }

    fn stream(until: i64, fails: bool) -> Some3 {
        Some3 { next: 0, until, fails, notes: DataNotes::of("rows") }
    }

    #[test]
    fn it_gives_what_the_stream_gives_piece_by_piece_with_its_notes() {
        for (until, fails) in [(0, false), (1, false), (100, false), (100, true), (0, true)] {
            let (mut alone, mut ahead) = (stream(until, fails), ReadAhead::new(Box::new(stream(until, fails))).unwrap());
            let (mut expected, mut found) = (Vec::new(), Vec::new());
            loop {
                let (more, same) = (alone.refill(&mut expected), ahead.refill(&mut found));
                assert_eq!((&same, &found), (&more, &expected));
                assert_eq!(ahead.notes(), alone.notes());
                if !matches!(more, Ok(true)) {
                    break;
                }
            }
            // After an end or an error nothing comes any more.
            assert_eq!((ahead.refill(&mut found), &found), (Ok(false), &expected));
        }
    }

    #[test]
    fn whoever_stops_listening_ends_the_reading() {
        let mut ahead = ReadAhead::new(Box::new(stream(i64::MAX, false))).unwrap();
        ahead.refill(&mut Vec::new()).unwrap();
        let reader = ahead.reader.take().unwrap();
        drop(ahead);
        reader.join().unwrap();
    }

    #[test]
    #[should_panic = "broken within"]
    fn a_panic_of_the_reader_is_no_end() {
        struct Broken;
        impl Stream<Row> for Broken {
            fn refill(&mut self, _: &mut Vec<Row>) -> Result<bool, StreamError> {
                panic!("broken within");
            }
        }
        ReadAhead::new(Box::new(Broken)).unwrap().refill(&mut Vec::new()).unwrap();
    }
}
