//! The aspects of an order log: costs, fees, what had been seen, places in queues, and mids, each a recording of its own.

use crate::market::log_rows::forget_rounded;
use crate::market::look::Look;
use crate::market::{InFlight, fee_bps};
use crate::sim2real::{Measured, Recording, Site};

use super::{OrderLog, Row};

/// What of a log is looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Aspect {
    /// All there is an order.
    Orders,
    /// What orders cost, and how much of them was filled.
    Costs,
    /// What was charged.
    Fees,
    /// What had been seen when orders were decided.
    Seen,
    /// Where orders that rested stood in their queues.
    Queues,
    /// What the mid did.
    Mids,
}

impl OrderLog {
    /// What the recording of a log shows that has no law in common: what orders cost and how much of them was filled; what they were
    /// charged, of what was filled; the mids they had seen; where they stood in their queues; and what the mid did after them.
    #[must_use]
    pub fn aspects(recording: &Recording<Self>) -> Vec<Recording<Self>> {
        let log = &recording.stimulus;
        let of = |stimulus: Self, aspect: Aspect, channels: &[&str]| Recording {
            name: recording.name.clone(),
            time: stimulus.times(),
            measured: recording.measured.iter().filter(|m| channels.contains(&m.channel.as_str())).cloned().collect(),
            stimulus: Self { aspect, ..stimulus },
        };
        let executed = log.as_executed();
        let mut fee = of(executed.with_rows(&[]), Aspect::Fees, &[]);
        let fees = recording.channel("fee").map(|fee| fee.samples.as_slice()).unwrap_or_default();
        fee.measured.extend(fee.stimulus.fees(fees));
        let mut mid = of(executed.with_rows(&log.looks), Aspect::Mids, &[]);
        mid.stimulus.notes.clear();
        mid.measured.extend(mid.stimulus.mids());
        let queued = Self { rows: (0..log.places.len()).map(Row::Queued).collect(), notes: Vec::new(), ..log.clone() };
        let mut ahead = of(queued, Aspect::Queues, &[]);
        ahead.measured.extend(log.ahead());
        let of_orders = |aspect, channels| of(log.clone(), aspect, channels);
        vec![of_orders(Aspect::Costs, &["cost", "filled"]), fee, of_orders(Aspect::Seen, &["seen"]), ahead, mid]
    }

    /// Whether mechanisms of that site may change anything of what is looked at.
    #[must_use]
    pub fn shows(&self, site: Site) -> bool {
        match self.aspect {
            Aspect::Orders => true,
            Aspect::Costs => site != Site::Observation,
            Aspect::Fees | Aspect::Seen => site == Site::Observation,
            Aspect::Queues | Aspect::Mids => site == Site::Plant,
        }
    }

    /// The same log with a row for every fill of an order that rested, and for `looks`; of one time a look, which saw what was there
    /// before, comes first.
    fn with_rows(&self, looks: &[Look]) -> Self {
        let made = (0..self.made.len()).map(Row::Made);
        let mut rows: Vec<Row> =
            looks.iter().map(|look| Row::Look(*look)).chain(self.rows.iter().copied()).chain(made).collect();
        rows.sort_by_key(|row| self.at(row));
        Self { rows, ..self.clone() }
    }

    /// What was charged, row by row, of which `of_orders` is that of orders that took.
    fn fees(&self, of_orders: &[Option<f64>]) -> Option<Measured> {
        let fee = |row: &Row| match row {
            Row::Order(number) => of_orders.get(*number).copied().flatten(),
            Row::Made(number) => self.made[*number].charged.and_then(|charged| fee_bps(charged.fee, charged.notional)),
            Row::Queued(_) | Row::Look(_) => None,
        };
        let mut samples: Vec<Option<f64>> = self.rows.iter().map(fee).collect();
        let notional = |row: &Row| match row {
            Row::Order(number) => self.executed[*number] * self.paid[*number].unwrap_or(0.0),
            Row::Made(number) => self.made[*number].charged.map_or(0.0, |charged| charged.notional),
            Row::Queued(_) | Row::Look(_) => 0.0,
        };
        forget_rounded(&mut samples, &self.rows.iter().map(notional).collect::<Vec<_>>());
        Some(Measured { channel: "fee".into(), unit: "bps".into(), samples }).filter(|fee| !fee.samples.is_empty())
    }

    /// What stood ahead of orders that rested beside what was displayed, where anything did.
    fn ahead(&self) -> Option<Measured> {
        let samples: Vec<Option<f64>> = self.places.iter().map(|place| Some(place.beyond)).collect();
        Some(Measured { channel: "ahead".into(), unit: String::new(), samples }).filter(|ahead| !ahead.samples.is_empty())
    }

    /// The same orders, each of the quantity that was filled of it.
    fn as_executed(&self) -> Self {
        let filled = |(order, executed): (&InFlight, &f64)| InFlight { quantity: *executed, ..*order };
        let orders = self.orders.iter().zip(&self.executed).map(filled).collect();
        Self { orders, ..self.clone() }
    }

    /// What the mid moved from look to look, where anybody looked.
    fn mids(&self) -> Option<Measured> {
        let moved = |row: &Row| match row {
            Row::Order(_) | Row::Made(_) | Row::Queued(_) => None,
            Row::Look(look) => look.moved.map(|moved| moved / look.scatter),
        };
        let samples: Vec<Option<f64>> = self.rows.iter().map(moved).collect();
        (self.looks() > 0).then(|| Measured { channel: "mid".into(), unit: "sd".into(), samples })
    }
}
