//! Accounts of a few terms, and what happens to them.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use std::sync::Arc;

use trueup::market::{Account, ActionKind, Cash, CorporateAction, History, Price, Record, Settings, Side, Terms, Ticket};
use trueup::sim2real::Timestamp;

use crate::market_scene::{MINUTE, Plan, quantity, run_plan, settings};

pub fn cash(value: f64) -> Cash {
    Cash::nearest(value).unwrap()
}

pub fn at(price: f64) -> Price {
    Price::nearest(price).unwrap()
}

pub fn minute(k: i64) -> Timestamp {
    Timestamp(k * MINUTE)
}

pub fn buy(instrument: usize, units: f64) -> Ticket {
    Ticket::market(instrument, Side::Buy, quantity(units))
}

pub fn sell(instrument: usize, units: f64) -> Ticket {
    Ticket::market(instrument, Side::Sell, quantity(units))
}

/// An account in US dollars, of instruments with these terms.
pub fn of(terms: &[Terms]) -> Account {
    Account { currencies: vec!["USD".into()], terms: terms.to_vec(), ..Account::default() }
}

pub fn with(account: Account) -> Settings {
    Settings { account: Some(Arc::new(account)), ..settings() }
}

pub fn run(histories: Vec<History>, parts: &[(&str, &str, f64)], account: Account, plan: Plan) -> Record {
    run_plan(histories, parts, with(account), &mut plan.clone())
}

/// A split of the first instrument, so many minutes on.
pub fn split(minutes: i64, new: u32, old: u32) -> CorporateAction {
    CorporateAction { at: minute(minutes), instrument: 0, kind: ActionKind::Split { new, old } }
}
