//! The ways a backtest can be run that must all come to the same: whole, on streams, stopped and forked.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use trueup::market::{Backtest, Dated, History, Known, Moment, Record, Session, Sources, Stored, Strategy, Stream};

fn stream<T: Dated + Clone + Send + 'static>(rows: Vec<T>, at_a_time: usize) -> Option<Box<dyn Stream<T>>> {
    (!rows.is_empty()).then(|| Box::new(Stored::new(rows, at_a_time).unwrap()) as Box<dyn Stream<T>>)
}

/// The rows of a history as streams, so many at a time.
fn streams_of(history: &History, at_a_time: usize) -> Sources {
    let quotes = history.quotes().all();
    let quotes = (0..quotes.len()).filter_map(|k| quotes.get(k)).map(|q| Known { known_at: q.time, what: q.book() });
    let prints = history.prints().iter().enumerate();
    let prints = prints.map(|(k, print)| Known { known_at: history.print_known_at(k).unwrap(), what: *print });
    Sources {
        bars: stream(history.bars().to_vec(), at_a_time),
        quotes: stream(quotes.collect(), at_a_time),
        trades: stream(prints.collect(), at_a_time),
        depth: stream(history.depth().to_vec(), at_a_time),
        order_events: stream(history.order_events().to_vec(), at_a_time),
    }
}

fn to_the_end(mut session: Session, strategy: &mut dyn Strategy) -> Record {
    while session.step(strategy).unwrap().is_some() {}
    session.finish().unwrap()
}

/// Holds `record`, that of `backtest` with `strategy` as it is at the start, to be what comes of streams of `at_a_time` rows, and
/// of a fork in the middle.
pub fn same_every_way(backtest: &Backtest, record: &Record, strategy: &(impl Strategy + Clone), at_a_time: usize) {
    let (instruments, settings) = (backtest.instruments().to_vec(), backtest.settings().clone());
    let streaming = Backtest::streaming(instruments, backtest.venue().clone(), settings).unwrap();
    let sources = backtest.histories().iter().map(|history| streams_of(history, at_a_time)).collect();
    let streamed = to_the_end(streaming.start_on(sources).unwrap(), &mut strategy.clone());
    assert_eq!(Record { data: record.data.clone(), ..streamed }, *record, "on streams");

    let (mut session, mut own) = (backtest.start(), strategy.clone());
    session.run_to(Moment::Events(record.held.events / 2), &mut own).unwrap();
    let (fork, mut copy) = (session.fork().unwrap(), own.clone());
    assert_eq!(to_the_end(session, &mut own), *record, "stopped in the middle");
    assert_eq!(to_the_end(fork, &mut copy), *record, "forked in the middle");

    let (mut session, mut own) = (backtest.start(), strategy.clone());
    while session.advance(&mut own, 3).unwrap() {}
    let (rows, of) = session.progress();
    assert_eq!(Some(rows), of, "every row is counted");
    assert_eq!(session.finish().unwrap(), *record, "a few events at a time");
}
