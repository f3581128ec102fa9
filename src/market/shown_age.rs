//! How old what orders were decided on was, as their own log shows it: which past of the tape is what they saw.

use crate::sim2real::Timestamp;

use super::Quotes;

/// The oldest that what was seen may be [ns].
const OLDEST: i64 = 3_600 * Timestamp::NANOS;
/// Most rows of the tape that are looked at before a decision.
const ROWS: usize = 20_000;
/// Orders that are asked at most, evenly over all: the pasts that each could have seen are many.
const ASKED: usize = 400;
/// Fewer orders than these tell nothing.
const ENOUGH: usize = 25;
/// So many that saw something else than what the tape shows are all asked.
const FEW: usize = 100;
/// The part of the orders that one age must explain: what was seen of other things than the tape is not for an age to say.
const EXPLAINED: f64 = 0.95;
/// Orders that must have seen something else than what the tape shows at their decision, for that to be worth a word.
const OTHERWISE: usize = 4;
/// The part of those that one age must explain: beside many that saw what the tape shows, it is these that speak for an age.
const OF_OTHERS: f64 = 0.8;

/// What the log shows of the age of what was seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum ShownAge {
    /// What was seen is what the tape shows when orders were decided, as far as there is enough to tell.
    Timely,
    /// It is what the tape showed so long before [s].
    Aged(f64),
    /// At no one age is it what the tape showed: at the best, of so many of the orders that were asked.
    Unclear {
        /// Orders that saw what the tape showed at the best age.
        explained: usize,
        /// Orders that were asked.
        known: usize,
    },
}

/// The age at which `quotes` show the mids that orders saw, each with the time of its decision [currency]; the middle of all ages
/// that explain as many.
pub(super) fn shown_age(quotes: &Quotes, seen: &[(Timestamp, f64)]) -> ShownAge {
    let as_shown = |(decided_at, mid): &(Timestamp, f64)| {
        let known = quotes.times().partition_point(|time| time <= decided_at);
        let last = known.checked_sub(1).and_then(|row| quotes.all().get(row)?.mid());
        last.is_some_and(|own| alike(own, *mid))
    };
    let timely: Vec<bool> = seen.iter().map(as_shown).collect();
    let others = timely.iter().filter(|timely| !**timely).count();
    if quotes.is_empty() || seen.len() < ENOUGH || others < OTHERWISE {
        return ShownAge::Timely;
    }
    // Few that saw something else are all asked.
    let few = (0..seen.len()).filter(|k| others <= FEW && !timely[*k]);
    let numbers: Vec<usize> = asked(seen.len()).filter(|k| others > FEW || timely[*k]).chain(few).collect();
    let asked: Vec<&(Timestamp, f64)> = numbers.iter().map(|k| &seen[*k]).collect();
    let timely = numbers.iter().filter(|k| timely[**k]).count();
    // An age at which an order begins, and one after which it ceases, to be explained.
    let ages = asked.iter().flat_map(|(decided_at, mid)| ages(quotes, *decided_at, *mid));
    let mut ends: Vec<(i64, i32)> = ages.flat_map(|(least, most)| [(least, 1), (most + 1, -1)]).collect();
    ends.sort_unstable();
    let (mut count, mut best, mut within) = (0_i32, 0, (0, 0));
    for (k, (age, step)) in ends.iter().enumerate() {
        count += step;
        // All that begins and ceases at an age has to be in.
        let next = ends.get(k + 1).map_or(*age, |(next, _)| *next);
        if next > *age && count > best {
            (best, within) = (count, (*age, next - 1));
        }
    }
    let (explained, known) = (usize::try_from(best).unwrap_or_default(), asked.len());
    if (explained as f64) < EXPLAINED * known as f64 {
        ShownAge::Unclear { explained, known }
    } else if (explained as f64) < timely as f64 + (OF_OTHERS * (known - timely) as f64).max(1.0) {
        ShownAge::Timely
    } else {
        ShownAge::Aged(0.5 * (within.0 + within.1) as f64 / Timestamp::NANOS as f64)
    }
}

/// Which of `count` orders are asked: one of each of [`ASKED`] equal parts, at another place in each, since every so many th of
/// orders that are sent by a clock might always fall at the same part of a second.
fn asked(count: usize) -> impl Iterator<Item = usize> {
    /// Parts of the golden section are spread evenly, however many there are.
    const SECTION: f64 = 0.618_033_988_749_894_9;
    let parts = count.min(ASKED);
    let place = if count > ASKED { SECTION } else { 0.0 };
    (0..parts).map(move |k| ((k as f64 + (place * k as f64).fract()) * count as f64 / parts as f64) as usize)
}

/// The ages at which `quotes` show `mid` to whoever decides at `decided_at`, from the least on: least and most [ns], which do not
/// overlap.
fn ages(quotes: &Quotes, decided_at: Timestamp, mid: f64) -> Vec<(i64, i64)> {
    let times = quotes.times();
    let known = times.partition_point(|time| *time <= decided_at);
    let (mut found, mut least) = (Vec::new(), 0);
    for row in (0..known).rev().take(ROWS) {
        let most = decided_at - times[row];
        if least > OLDEST {
            break;
        }
        // A row is in force up to and without the stamp of the next; of those with one stamp the last is.
        if most >= least && quotes.all().get(row).and_then(|quote| quote.mid()).is_some_and(|own| alike(own, mid)) {
            found.push((least, most));
        }
        least = least.max(most + 1);
    }
    found
}

/// Whether two prices are the same but for their last digits.
fn alike(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-9 * a.abs().max(b.abs())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::market::Level;

    const SECOND: i64 = Timestamp::NANOS;

    /// A quote every second, each with a mid of its own.
    fn quotes() -> Quotes {
        let mut quotes = Quotes::with_depth(1);
        for k in 0..400_i64 {
            let level = |price: f64| [Level { price, size: 1.0 }];
            quotes.push(Timestamp(k * SECOND), &level(99.0 + k as f64), &level(101.0 + k as f64));
        }
        quotes
    }

    /// Orders every three seconds and a fraction, each of which saw what stood `age` [ns] before, but for every `other`th.
    fn orders(age: i64, other: usize) -> Vec<(Timestamp, f64)> {
        let one = |k: i64| {
            let at = Timestamp(10 * SECOND + 3 * k * SECOND + (k * 37 % 100) * SECOND / 100);
            let mid = 100.0 + ((at.0 - age) / SECOND) as f64;
            (at, if k as usize % other == other - 1 { 7.0 } else { mid })
        };
        (0..100).map(one).collect()
    }

    #[test]
    fn the_age_is_that_at_which_the_tape_showed_what_was_seen() {
        for age in [SECOND / 4, SECOND, 5 * SECOND / 2] {
            let ShownAge::Aged(found) = shown_age(&quotes(), &orders(age, 1_000)) else { panic!("no age of {age} ns") };
            // Decisions are a hundredth of a second apart within their seconds.
            assert!((found - age as f64 / 1e9).abs() <= 0.0051, "{found}, not {age} ns");
        }
        let ShownAge::Aged(found) = shown_age(&quotes(), &orders(SECOND / 4, 25)) else {
            panic!("four in a hundred are others")
        };
        assert!((found - 0.25).abs() <= 0.0051, "{found}");
    }

    #[test]
    fn what_is_timely_or_of_no_one_age_is_said_to_be() {
        assert_eq!(shown_age(&quotes(), &orders(0, 1_000)), ShownAge::Timely);
        assert_eq!(shown_age(&quotes(), &orders(SECOND, 1_000)[..20]), ShownAge::Timely, "too few to tell");
        assert_eq!(shown_age(&quotes(), &orders(SECOND, 5)), ShownAge::Unclear { explained: 80, known: 100 });
        assert_eq!(shown_age(&Quotes::default(), &orders(0, 1_000)), ShownAge::Timely);
    }

    /// Where the market hardly moves within the age, few orders saw something else, and these agree on it.
    #[test]
    fn a_few_that_agree_tell_of_an_age_and_a_few_that_do_not_tell_nothing() {
        let few = |age: i64| -> Vec<(Timestamp, f64)> {
            let one = |k: i64| {
                let at = Timestamp(10 * SECOND + k * SECOND / 4 + (k * 37 % 100) * SECOND / 400);
                (at, 100.0 + ((at.0 - age) / SECOND) as f64)
            };
            (0..700).map(one).collect()
        };
        let quick = few(SECOND / 250);
        let others = quick.iter().filter(|(at, mid)| *mid != 100.0 + (at.0 / SECOND) as f64).count();
        assert!((4..10).contains(&others), "{others}");
        let ShownAge::Aged(found) = shown_age(&quotes(), &quick) else { panic!("no age of {others} orders") };
        assert!((found - 0.004).abs() < 0.0035, "{found}");
        let mut odd = few(0);
        (0..6).for_each(|k| odd[100 * k + 7].1 = 100.0 + k as f64);
        assert_eq!(shown_age(&quotes(), &odd), ShownAge::Timely, "each saw another past");
    }

    /// Of many orders some are asked, and few that saw something else are no age.
    #[test]
    fn of_many_orders_some_are_asked() {
        let many = |age: i64, others: usize| -> Vec<(Timestamp, f64)> {
            let one = |k: i64| {
                let at = Timestamp(10 * SECOND + k * SECOND / 4 + (k * 37 % 100) * SECOND / 400);
                (at, 100.0 + ((at.0 - age) / SECOND) as f64)
            };
            let mut orders: Vec<(Timestamp, f64)> = (0..1_500).map(one).collect();
            orders.iter_mut().step_by(1_500 / others.max(1)).take(others).for_each(|order| order.1 = 7.0);
            orders
        };
        let ShownAge::Aged(found) = shown_age(&quotes(), &many(3 * SECOND / 2, 0)) else { panic!("no age") };
        assert!((found - 1.5).abs() <= 0.02, "{found}");
        assert_eq!(shown_age(&quotes(), &many(0, 9)), ShownAge::Timely);
        let ShownAge::Unclear { explained, known } = shown_age(&quotes(), &many(SECOND, 300)) else { panic!("an age") };
        assert!(explained < known && known <= ASKED, "{explained} of {known}");
    }
}
