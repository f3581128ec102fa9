//! What a history takes, and what it refuses.

use super::*;
use crate::market::{DepthAction, Level, OrderAction, Price, Side};

fn bar(open_at: i64, prices: [i64; 4], volume: f64) -> Bar {
    let [open, high, low, close] = prices.map(|p| Price(p * 1_000_000_000));
    Bar { open_at: Timestamp(open_at), known_at: Timestamp(open_at + 10), open, high, low, close, volume }
}

fn of_bars(bars: &[Bar]) -> Result<History, HistoryError> {
    History::new(bars.to_vec(), Quotes::default())
}

#[test]
fn bars_that_cannot_be_are_refused() {
    let good = bar(0, [10, 12, 9, 11], 5.0);
    assert!(of_bars(&[good, bar(10, [11, 11, 11, 11], 0.0)]).is_ok());
    assert!(matches!(of_bars(&[good, bar(9, [11, 11, 11, 11], 0.0)]), Err(HistoryError::Time { row: 1, .. })));
    assert!(matches!(of_bars(&[Bar { known_at: Timestamp(0), ..good }]), Err(HistoryError::Span { row: 0, .. })));
    for (prices, fault) in
        [([13, 12, 9, 11], "open"), ([10, 12, 9, 8], "close"), ([10, 8, 9, 10], "high"), ([0, 12, 0, 11], "low")]
    {
        assert!(matches!(of_bars(&[bar(0, prices, 1.0)]), Err(HistoryError::Bar { row: 0, column, .. }) if column == fault));
    }
    for volume in [-1.0, f64::NAN, f64::INFINITY] {
        let found = of_bars(&[bar(0, [10, 12, 9, 11], volume)]);
        assert!(matches!(found, Err(HistoryError::Bar { column: "volume", .. })));
    }
}

#[test]
fn quotes_that_cannot_be_are_refused() {
    let level = |price: f64, size: f64| Level { price, size };
    let fault = |rows: &[(i64, &[Level], &[Level])]| {
        let mut quotes = Quotes::with_depth(2);
        rows.iter().for_each(|(time, bids, asks)| quotes.push(Timestamp(*time), bids, asks));
        History::new(Vec::new(), quotes).map(|_| ()).map_err(|error| error.to_string())
    };
    let (bid, ask) = (level(99.0, 1.0), level(101.0, 1.0));
    assert_eq!(fault(&[(0, &[bid], &[ask]), (0, &[], &[ask]), (1, &[bid], &[])]), Ok(()));
    assert!(fault(&[(1, &[bid], &[ask]), (0, &[bid], &[ask])]).unwrap_err().starts_with("quote 1: its time"));
    assert!(fault(&[(0, &[ask], &[bid])]).unwrap_err().contains("the bid is above the ask"));
    assert!(fault(&[(0, &[level(0.0, 1.0)], &[ask])]).unwrap_err().starts_with("quote 0: bid is 0"));
    assert!(fault(&[(0, &[bid], &[level(101.0, 0.0)])]).unwrap_err().starts_with("quote 0: ask_size is 0"));
    assert!(fault(&[(0, &[bid], &[ask, level(100.5, 1.0)])]).unwrap_err().starts_with("quote 0: ask2 is 100.5"));
}

#[test]
fn a_tape_is_cut_by_when_things_were_known() {
    let bars = [0, 10, 20, 30].map(|t| bar(t, [10, 12, 9, 11], 1.0));
    let history = of_bars(&bars).unwrap();
    assert_eq!(history.within(Timestamp(20), Timestamp(39)).bars(), &bars[1..3]);
}

#[test]
fn trades_and_books_are_held_to_what_they_can_be_and_cut_like_the_rest() {
    let print = |time: i64, price: f64, size: f64| Print { time: Timestamp(time), price, size, aggressor: None };
    let prints = |rows: &[Print]| History::default().with_prints(rows.to_vec()).map_err(|error| error.to_string());
    assert!(prints(&[print(1, 9.0, 1.0), print(0, 9.0, 1.0)]).unwrap_err().starts_with("trade 1: its time"));
    for (price, size, fault) in [(0.0, 1.0, "price"), (f64::NAN, 1.0, "price"), (9.0, -1.0, "size"), (9.0, f64::NAN, "size")]
    {
        assert!(prints(&[print(0, price, size)]).unwrap_err().starts_with(&format!("trade 0: {fault} is")));
    }
    let change = |time: i64, known_at: i64, price: i64, size: f64| DepthChange {
        time: Timestamp(time),
        known_at: Timestamp(known_at),
        side: Side::Buy,
        action: DepthAction::Set,
        price: Price(price),
        size,
    };
    let depth = |rows: &[DepthChange]| History::default().with_depth(rows.to_vec()).map_err(|error| error.to_string());
    assert!(depth(&[change(5, 6, 1, 0.0), change(4, 6, 1, 1.0)]).is_ok(), "events may overtake each other on their way");
    assert!(depth(&[change(5, 6, 1, 0.0), change(4, 5, 1, 1.0)]).unwrap_err().contains("does not follow"));
    assert!(depth(&[change(5, 4, 1, 0.0)]).unwrap_err().contains("before it happened"));
    assert!(depth(&[change(5, 6, 0, 0.0)]).unwrap_err().contains("price is 0"));
    assert!(depth(&[change(5, 6, 1, -1.0)]).unwrap_err().contains("size is -1"));
    assert!(depth(&[DepthChange { action: DepthAction::Clear, ..change(5, 6, 0, f64::NAN) }]).is_ok());
    let event = |action, size| OrderEvent {
        time: Timestamp(1),
        known_at: Timestamp(2),
        id: 7,
        action,
        side: Side::Sell,
        price: Price(1),
        size,
    };
    let orders = |row| History::default().with_order_events(vec![row]);
    assert!(orders(event(OrderAction::Delete, 0.0)).is_ok());
    assert!(orders(event(OrderAction::Add, 0.0)).is_err() && orders(event(OrderAction::Change, f64::NAN)).is_err());
    let all = History::default().with_prints((0..4).map(|t| print(t, 1.0, 1.0)).collect()).unwrap();
    let all = all.with_depth((0..4).map(|t| change(0, t, 1, 1.0)).collect()).unwrap();
    let within = all.within(Timestamp(1), Timestamp(2));
    assert_eq!((within.prints(), within.depth()), (&all.prints()[1..3], &all.depth()[1..3]));
    assert!(!within.is_empty() && all.within(Timestamp(9), Timestamp(9)).is_empty());
}
