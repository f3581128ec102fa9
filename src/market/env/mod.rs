//! Market environments: the backtest, stepped.
//!
//! An episode *is* a backtest, and a step goes on to the event at which the next action is due. So there is nothing of a market here:
//! feeds, venues, mechanisms, latencies and accounts are the backtest's own, and a policy does in a [backtest](MarketEnv::acted)
//! what it does in an environment, to the last bit.

mod books;
mod driver;
mod error;
mod execute;
mod execution;
mod features;
#[cfg(feature = "io")]
mod from_run;
mod generate;
mod make_market;
mod market_env;
mod pace;
#[cfg(test)]
mod plain_tests;
mod portfolio;
mod registry;
mod reward;
mod setup;
mod task;

pub use driver::Acted;
pub use error::MarketEnvError;
pub use execute::{Execute, Ways};
pub use execution::DrawnExecution;
pub use features::{FeatureSettings, calm_and_turbulent};
pub use generate::{DataKind, Generated};
pub use make_market::MakeMarket;
pub use market_env::{Ended, MarketEnv};
pub use pace::Pace;
pub use portfolio::Portfolio;
pub use registry::{ENVIRONMENTS, make_on};
pub use reward::{Payoff, Reward};
pub use setup::MarketSetup;
pub use task::{Outcome, Task};
