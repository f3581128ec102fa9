//! What mechanisms need to be known of the market: without it they would do nothing, unnoticed.

use crate::market::{Execution, History, Instrument, OrderLog, Quotes, Role};
use crate::sim2real::{Mechanism, Timestamp};

use super::DEMANDING;

/// Something a law reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Need {
    /// Bid and ask.
    Quotes,
    /// What is displayed at them.
    Sizes,
    /// Volume an order can take part in: what a bar trades, or what quotes display.
    Volume,
    /// What is traded on an average day.
    DailyVolume,
    /// How much the price moves in a day.
    DailyVolatility,
    /// How much it has moved in the last minutes.
    RecentVolatility,
    /// Queues at the prices at which orders rest.
    Queues,
}

/// A mechanism that can do nothing without some data: a row of [`DEMANDING`], beside its row in the registry.
pub trait Demanding: Mechanism<Execution> {
    /// What form `form` needs.
    fn needs(&self, form: usize) -> &'static [Need];
}

/// What form `form` of the mechanism of that id needs.
#[must_use]
pub fn needs(id: &str, form: usize) -> &'static [Need] {
    DEMANDING.iter().find(|mechanism| mechanism.about().name == id).map_or(&[], |mechanism| mechanism.needs(form))
}

/// A need that a run's data leave open.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Lack {
    /// What there is none of.
    pub what: &'static str,
    /// What to do about it.
    pub hint: &'static str,
}

impl Need {
    /// Whether `log`, its tape and its instrument, knows it.
    #[must_use]
    pub fn is_known_in(self, log: &OrderLog) -> bool {
        let Instrument { average_daily_volume, daily_volatility, .. } = log.instrument();
        match self {
            Self::Quotes => !log.tape().quotes().is_empty(),
            Self::Sizes => display_sizes(log.tape().quotes()),
            Self::Volume => log.knows_volume(),
            Self::DailyVolume => average_daily_volume.is_some(),
            Self::DailyVolatility => daily_volatility.is_some(),
            Self::RecentVolatility => log.orders().iter().any(|order| order.recent_volatility.is_some_and(|v| v > 0.0)),
            Self::Queues => log.has_a(Role::Maker) && display_sizes(log.tape().quotes()),
        }
    }

    /// What a run on `history` lacks of it, if anything. What an instrument does not declare is averaged over days that are over.
    #[must_use]
    pub fn lacking(self, instrument: &Instrument, history: &History) -> Option<Lack> {
        let quoted = !history.quotes().is_empty();
        let has_book = !history.depth().is_empty() || !history.order_events().is_empty();
        let traded = || history.bars().iter().any(|bar| bar.volume > 0.0);
        let lack = |what, hint| Some(Lack { what, hint });
        match self {
            Self::Quotes if !quoted => lack("quotes", "add [[data]] with quotes, or give half_spread as bps"),
            Self::Volume if !quoted && !traded() => {
                lack("volumes", "add [[data]] with bars that know volumes, or with quotes that know sizes")
            }
            Self::Sizes | Self::Volume if quoted && !display_sizes(history.quotes()) => {
                lack("sizes in the quotes", "add the columns bid_size and ask_size, or drop the mechanism")
            }
            Self::DailyVolume if instrument.average_daily_volume.is_none() && !traded() => lack(
                "volumes",
                "add average_daily_volume to [[instrument]], or bars with volumes: days that are over are averaged",
            ),
            Self::DailyVolatility if instrument.daily_volatility.is_none() && days(history) <= DAYS_OF_VOLATILITY => lack(
                "volatilities",
                "add daily_volatility to [[instrument]], or more than a week of data: it is that of days that are over",
            ),
            Self::RecentVolatility if !quoted && !has_book && history.prints().is_empty() && coarse(history) => lack(
                "prices as often as every minute",
                "add [[data]] with quotes, trades or minute bars, or give `fraction` of the daily volatility",
            ),
            Self::Queues if !has_book && !display_sizes(history.quotes()) => lack(
                "sizes displayed at a price",
                "add [[data]] with a book, or quotes that know sizes; on bars and trades alone nobody knows a queue",
            ),
            _ => None,
        }
    }
}

/// Days that have to be over before their volatility is known: it is made of five returns at least.
const DAYS_OF_VOLATILITY: usize = 6;

/// Days of UTC on which something became known.
fn days(history: &History) -> usize {
    const DAY: i64 = 86_400 * Timestamp::NANOS;
    let bars = history.bars().iter().map(|bar| bar.known_at);
    let mut days: Vec<i64> = bars.chain(history.quotes().times().iter().copied()).map(|t| t.0.div_euclid(DAY)).collect();
    days.sort_unstable();
    days.dedup();
    days.len()
}

/// Whether bars are longer than a minute.
fn coarse(history: &History) -> bool {
    history.bars().first().is_none_or(|bar| bar.known_at - bar.open_at > 60 * Timestamp::NANOS)
}

fn display_sizes(quotes: &Quotes) -> bool {
    let all = quotes.all();
    let known = |k| all.get(k).is_some_and(|q| q.bids.iter().chain(q.asks).any(|level| level.size.is_finite()));
    (0..all.len()).any(known)
}

/// Whether `log` knows all that a form needs.
pub(super) fn known(needs: &[Need], log: &OrderLog) -> bool {
    needs.iter().all(|need| need.is_known_in(log))
}
