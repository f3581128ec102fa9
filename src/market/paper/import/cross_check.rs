//! What only the whole log shows: rows that are there twice, fills without orders, sums that differ, times that go backwards.

use std::collections::{HashMap, HashSet};

use super::super::{
    FillOrigin, FindingKind, PaperFill, PaperFinding, PaperFindings, PaperLog, PaperOrder, PaperStatus, SourcePlace,
    TimeColumn, TimeMeaning, resolution,
};
use super::ImportSettings;
use crate::market::Quantity;
use crate::sim2real::Timestamp;

/// Symbol and id: exchanges count orders by symbol.
type Key = (String, String);

fn key(symbol: &str, id: &str) -> Key {
    (symbol.to_owned(), id.to_owned())
}

/// The log with its rows held against each other, its symbols mapped and everything in order of time.
pub(super) fn finished(mut log: PaperLog, settings: &ImportSettings) -> PaperLog {
    log.orders = single_orders(log.orders, &mut log.findings);
    log.fills = single_fills(log.fills, &mut log.findings);
    let numbers: HashMap<Key, usize> =
        log.orders.iter().enumerate().map(|(k, order)| (key(&order.symbol, &order.id), k)).collect();
    join_fills(&mut log, &numbers);
    check_orders(&log.orders, &mut log.findings);
    map_symbols(&mut log, settings);
    log.orders.sort_by_key(|order| order.first_time().unwrap_or(Timestamp::MAX));
    log.fills.sort_by_key(|fill| fill.filled_at);
    measure_clocks(&mut log);
    log
}

/// Each order once: of one that is stated twice the later state.
fn single_orders(orders: Vec<PaperOrder>, findings: &mut PaperFindings) -> Vec<PaperOrder> {
    let mut single: Vec<PaperOrder> = Vec::with_capacity(orders.len());
    let mut numbers: HashMap<Key, usize> = HashMap::new();
    for order in orders {
        let known = numbers.get(&key(&order.symbol, &order.id)).and_then(|at| single.get_mut(*at));
        let Some(known) = known else {
            numbers.insert(key(&order.symbol, &order.id), single.len());
            single.push(order);
            continue;
        };
        let message = |what: &str| format!("order {:?} is {what} {}", order.id, known.place);
        if (PaperOrder { place: known.place.clone(), ..order.clone() }) == *known {
            findings.add(PaperFinding::at(FindingKind::Duplicate, order.place.clone(), message("as in")));
        } else {
            let finding = PaperFinding::at(FindingKind::RestatedOrder, order.place.clone(), message("not as in"));
            findings.add(finding);
            *known = order;
        }
    }
    single
}

/// Each fill once: of those of one id the first; of an order with executions no total.
fn single_fills(fills: Vec<PaperFill>, findings: &mut PaperFindings) -> Vec<PaperFill> {
    let order_of = |fill: &PaperFill| Some(key(&fill.symbol, fill.order_id.as_deref()?));
    let executions = fills.iter().filter(|fill| fill.origin == FillOrigin::Execution);
    let executed: HashSet<Key> = executions.filter_map(order_of).collect();
    let mut single: Vec<PaperFill> = Vec::with_capacity(fills.len());
    let mut numbers: HashMap<(Key, Option<String>, FillOrigin), usize> = HashMap::new();
    for fill in fills {
        let order = order_of(&fill);
        let total = fill.origin == FillOrigin::OrderTotal;
        if total && order.as_ref().is_some_and(|order| executed.contains(order)) {
            continue;
        }
        // Two executions without an id may be the same and be two.
        let id = fill.id.clone().or_else(|| total.then(String::new));
        let name = id.map(|id| ((fill.symbol.clone(), id), fill.order_id.clone(), fill.origin));
        let known = name.as_ref().and_then(|name| numbers.get(name)).and_then(|at| single.get(*at));
        if let Some(known) = known {
            let same = PaperFill { place: known.place.clone(), ..fill.clone() } == *known;
            let (kind, what) = if same { (FindingKind::Duplicate, "as") } else { (FindingKind::ConflictingFill, "not as") };
            let id = fill.id.as_deref().or(fill.order_id.as_deref()).unwrap_or_default();
            findings.add(PaperFinding::at(kind, fill.place.clone(), format!("fill {id:?} is {what} in {}", known.place)));
            continue;
        }
        if total {
            let message = "all executions of the order at their average price, at the time of the order";
            findings.add(PaperFinding::at(FindingKind::TotalsOnly, fill.place.clone(), message));
        }
        if let Some(name) = name {
            numbers.insert(name, single.len());
        }
        single.push(fill);
    }
    single
}

/// Holds the fills of each order to what the order says, and gives fills the side of their order.
fn join_fills(log: &mut PaperLog, numbers: &HashMap<Key, usize>) {
    let mut filled = vec![Quantity::ZERO; log.orders.len()];
    let findings = &mut log.findings;
    for fill in &mut log.fills {
        let place = || fill.place.clone();
        let Some(id) = fill.order_id.as_deref() else {
            findings.add(PaperFinding::at(FindingKind::FillWithoutOrder, place(), "the fill names no order"));
            continue;
        };
        let number = numbers.get(&key(&fill.symbol, id)).copied();
        let Some((order, sum)) = number.and_then(|k| Some((log.orders.get(k)?, filled.get_mut(k)?))) else {
            let message = format!("order {id:?} of {} is not in the log", fill.symbol);
            findings.add(PaperFinding::at(FindingKind::FillWithoutOrder, place(), message));
            continue;
        };
        *sum = *sum + fill.quantity;
        if let Some(first) = order.first_time().filter(|first| fill.filled_at < *first) {
            let early = first.seconds_since(fill.filled_at);
            let message = format!("order {id:?} is filled {early:.6} s before its first time, {first}");
            findings.add(PaperFinding::at(FindingKind::TimesOutOfOrder, place(), message));
        }
        fill.side = fill.side.or(Some(order.side));
    }
    for (order, sum) in log.orders.iter().zip(filled) {
        check_sum(order, sum, findings);
    }
}

fn check_sum(order: &PaperOrder, sum: Quantity, findings: &mut PaperFindings) {
    let mut note = |kind, message: String| findings.add(PaperFinding::at(kind, order.place.clone(), message));
    let says_filled = order.filled.map_or(order.status == Some(PaperStatus::Filled), |filled| filled.0 > 0);
    match order.filled {
        _ if sum == Quantity::ZERO && says_filled => {
            let how_much = order.filled.map_or_else(|| "all".to_owned(), |filled| filled.to_string());
            note(
                FindingKind::OrderWithoutFill,
                format!("{how_much} of order {:?} was filled, and no fill says so", order.id),
            );
        }
        Some(filled) if filled != sum => {
            note(
                FindingKind::FilledOtherwise,
                format!("order {:?} was filled {filled}, its fills add up to {sum}", order.id),
            );
        }
        _ => {}
    }
    if let Some(quantity) = order.quantity.filter(|quantity| sum > *quantity) {
        note(FindingKind::Overfilled, format!("{sum} of order {:?} was filled, {quantity} was ordered", order.id));
    }
}

/// Holds each order to itself and to those it names.
fn check_orders(orders: &[PaperOrder], findings: &mut PaperFindings) {
    let ids: HashSet<&str> = orders.iter().map(|order| order.id.as_str()).collect();
    for order in orders {
        let mut note = |kind, message: String| findings.add(PaperFinding::at(kind, order.place.clone(), message));
        if let Some(by) = &order.replaced_by {
            note(FindingKind::Replaced, format!("order {:?} was replaced by {by:?}", order.id));
        }
        for (link, role) in [(&order.replaced_by, "successor"), (&order.parent, "predecessor")] {
            if let Some(link) = link.as_ref().filter(|link| !ids.contains(link.as_str())) {
                note(FindingKind::BrokenChain, format!("{link:?}, the {role} of order {:?}, is not in the log", order.id));
            }
        }
        if order.first_time().is_none() {
            note(FindingKind::WithoutTime, format!("order {:?} has no time", order.id));
        }
        let times = [order.decided_at, order.submitted_at, order.ended_at];
        let times: Vec<Timestamp> = times.into_iter().flatten().collect();
        if let Some([before, after]) = times.array_windows().find(|[before, after]| after < before) {
            let early = before.seconds_since(*after);
            note(FindingKind::TimesOutOfOrder, format!("order {:?}: {after} comes {early:.6} s before {before}", order.id));
        }
    }
}

fn map_symbols(log: &mut PaperLog, settings: &ImportSettings) {
    if settings.symbols.is_empty() {
        return;
    }
    let unmapped: Vec<String> =
        log.symbols().into_iter().filter(|symbol| settings.symbols.get(symbol).is_none()).map(str::to_owned).collect();
    for symbol in unmapped {
        let message = format!("{symbol:?} is not in the mapping of symbols");
        log.findings.add(PaperFinding::of_log(FindingKind::Unmapped, message));
    }
    let symbols = log.orders.iter_mut().map(|order| &mut order.symbol);
    for symbol in symbols.chain(log.fills.iter_mut().map(|fill| &mut fill.symbol)) {
        if let Some(ours) = settings.symbols.get(symbol) {
            ours.clone_into(symbol);
        }
    }
}

/// Measures how fine the times are, and says which of them are not what they seem.
fn measure_clocks(log: &mut PaperLog) {
    let of_orders =
        |time: fn(&PaperOrder) -> Option<Timestamp>| -> Vec<Timestamp> { log.orders.iter().filter_map(time).collect() };
    let values = TimeColumn::ALL.map(|column| match column {
        TimeColumn::DecidedAt => of_orders(|order| order.decided_at),
        TimeColumn::SubmittedAt => of_orders(|order| order.submitted_at),
        TimeColumn::EndedAt => of_orders(|order| order.ended_at),
        TimeColumn::FilledAt => log.fills.iter().map(|fill| fill.filled_at).collect(),
    });
    for clock in &mut log.clocks {
        let of_column = TimeColumn::ALL.iter().zip(&values).find(|(column, _)| **column == clock.column);
        let Some((_, times)) = of_column else { continue };
        clock.values = times.len();
        clock.resolution = resolution(times.iter().copied());
        let place = SourcePlace { table: clock.source.clone(), row: None, column: None };
        let mut note = |kind, message: String| log.findings.add(PaperFinding::at(kind, place.clone(), message));
        let word = clock.column.word();
        if clock.meaning == TimeMeaning::Polled && !times.is_empty() {
            note(FindingKind::PolledTimes, format!("`{word}` is {}: it happened no later", clock.meaning.words()));
        }
        // A few values may be whole seconds by chance.
        if let Some(step) = clock.resolution.filter(|step| *step >= Timestamp::NANOS && times.len() > 3) {
            note(FindingKind::RoundedTimes, format!("`{word}` is in steps of {} s", step / Timestamp::NANOS));
        }
    }
    log.clocks.retain(|clock| clock.values > 0);
}
