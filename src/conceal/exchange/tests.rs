use super::*;

/// The book in force just before `ts`.
fn before(day: &Day, ts: i64) -> &Quote {
    &day.quotes[day.quotes.partition_point(|quote| quote.ts < ts) - 1]
}

fn offered(quote: &Quote, side: Side) -> &[(i64, i64); LEVELS] {
    if side == Side::Buy { &quote.asks } else { &quote.bids }
}

fn fills_of(day: &Day, order: &ClientOrder) -> Vec<Fill> {
    day.fills.iter().filter(|fill| fill.order == order.id).copied().collect()
}

#[test]
fn same_seed_same_bits() {
    assert_eq!(Exchange::default().day(Seed(5)), Exchange::default().day(Seed(5)));
    assert_ne!(Exchange::default().day(Seed(5)).quotes, Exchange::default().day(Seed(6)).quotes);
}

#[test]
fn the_tape_is_never_crossed_and_strictly_in_time() {
    let day = Exchange::default().day(Seed(2));
    assert!((15_000..=30_000).contains(&day.quotes.len()), "{} rows", day.quotes.len());
    assert!(day.quotes.windows(2).all(|pair| pair[0].ts < pair[1].ts));
    for quote in &day.quotes {
        assert!(quote.bids[0].0 < quote.asks[0].0, "{quote:?}");
        assert!(quote.bids.windows(2).all(|pair| pair[0].0 > pair[1].0), "{quote:?}");
        assert!(quote.asks.windows(2).all(|pair| pair[0].0 < pair[1].0), "{quote:?}");
        assert!(quote.bids.iter().chain(&quote.asks).all(|level| level.1 > 0), "{quote:?}");
    }
    assert!(day.trades.windows(2).all(|pair| pair[0].ts <= pair[1].ts));
}

/// The heart of the data set: a fill is what stood in the book when the order arrived, not when it was decided.
#[test]
fn fills_are_at_prices_displayed_just_before_arrival() {
    let day = Exchange::default().day(Seed(2));
    let mut deeper = 0;
    for order in &day.orders {
        let fills = fills_of(&day, order);
        let latency = fills[0].filled_at - order.decided_at;
        assert!((300_000_000..301_000_000).contains(&latency), "{latency} ns");
        assert_eq!(fills.iter().map(|fill| fill.quantity).sum::<i64>(), order.quantity);
        let book = offered(before(&day, fills[0].filled_at), order.side);
        let mut left = order.quantity;
        let walk: Vec<(i64, i64)> = book
            .iter()
            .map(|(ticks, displayed)| {
                let quantity = left.min(*displayed);
                left -= quantity;
                (*ticks, quantity)
            })
            .filter(|(_, quantity)| *quantity > 0)
            .collect();
        deeper += usize::from(left > 0);
        if left == 0 {
            assert_eq!(fills.iter().map(|fill| (fill.ticks, fill.quantity)).collect::<Vec<_>>(), walk, "{order:?}");
        }
    }
    assert!(deeper <= 8, "{deeper} orders went beyond five levels");
}

#[test]
fn a_good_part_of_the_orders_exceeds_the_touch() {
    let day = Exchange::default().day(Seed(2));
    assert_eq!(day.orders.len(), 800);
    let exceeding = day.orders.iter().filter(|order| fills_of(&day, order).len() > 1).count();
    assert!((160..=320).contains(&exceeding), "{exceeding} of 800");
}

#[test]
fn every_lot_of_the_client_is_on_the_tape() {
    let day = Exchange::default().day(Seed(9));
    for order in &day.orders {
        let fills = fills_of(&day, order);
        let taped = day.trades.iter().filter(|trade| trade.ts == fills[0].filled_at && trade.aggressor == order.side);
        assert_eq!(taped.map(|trade| trade.size).sum::<i64>(), order.quantity);
    }
}

#[test]
fn latency_matters_in_enough_orders() {
    let day = Exchange::default().day(Seed(2));
    let moved = day.orders.iter().filter(|order| {
        let arrival = before(&day, fills_of(&day, order)[0].filled_at);
        (arrival.bids[0].0, arrival.asks[0].0) != order.seen
    });
    let moved = moved.count();
    assert!(moved >= 25, "the best prices moved under way in {moved} orders only");
}

#[test]
fn without_latency_an_order_meets_what_it_saw() {
    let day = Exchange { latency: 0.0, jitter: 0.0, ..Exchange::default() }.day(Seed(4));
    for order in &day.orders {
        let seen = if order.side == Side::Buy { order.seen.1 } else { order.seen.0 };
        let fill = fills_of(&day, order)[0];
        assert_eq!((fill.ticks, fill.filled_at), (seen, order.decided_at));
    }
}

#[test]
fn a_concession_grows_with_the_power_of_the_quantity() {
    let concession = Some(Concession { bps: 4.0, exponent: 0.6 });
    let day = Exchange { concession, ..Exchange::default() }.day(Seed(4));
    let (mut small, mut large) = (Vec::new(), Vec::new());
    for order in &day.orders {
        let fill = fills_of(&day, order)[0];
        let beyond = order.side.sign() as f64 * (fill.price / (fill.ticks as f64 / 100.0) - 1.0) * 1e4;
        assert!(beyond > 0.0);
        if order.quantity < 25 {
            small.push(beyond)
        } else if order.quantity > 320 {
            large.push(beyond)
        }
    }
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let ratio = mean(&large) / mean(&small);
    assert!((4.0..7.0).contains(&ratio), "16 times the quantity to the 0.6 is 5.3, found {ratio}");
}

#[test]
fn a_cap_leaves_part_of_large_orders_unfilled() {
    let day = Exchange { participation: Some(0.1), ..Exchange::default() }.day(Seed(4));
    let mut partial = 0;
    for order in &day.orders {
        let fills = fills_of(&day, order);
        let book = offered(before(&day, fills[0].filled_at), order.side);
        let cap = (0.1 * book.iter().map(|level| level.1).sum::<i64>() as f64) as i64;
        let filled: i64 = fills.iter().map(|fill| fill.quantity).sum();
        assert_eq!(filled, order.quantity.min(cap.max(1)));
        partial += usize::from(filled < order.quantity);
    }
    assert!(partial > 100, "{partial}");
}

#[test]
fn fees_follow_their_plan() {
    for (fees, expected) in [(Fees::None, 0.0), (Fees::OfNotional(0.4), 0.4), (Fees::PerShare(0.005), 1.0)] {
        let day = Exchange { fees, ..Exchange::default() }.day(Seed(4));
        for fill in &day.fills {
            let bps = fill.fee / (fill.price * fill.quantity as f64) * 1e4;
            assert!((bps - expected).abs() <= 0.03 * expected.max(1e-9), "{fees:?}: {bps} bps");
        }
    }
}
