//! Markets for environments, and how these are played.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use trueup::market::env::{DataKind, Generated, MarketEnv, MarketSetup, Portfolio, Reward, Task};
use trueup::market::{Backtest, Cash, Latencies, Latency, Record, Session, Settings, Strategy};
use trueup::rl::{Actions, Env, Episode, Options};
use trueup::sim2real::Seed;

use crate::market_scene::venue;

pub const ROWS: usize = 3_000;

pub fn generated(kind: DataKind, instruments: usize, rows: usize) -> Generated {
    Generated { kind, rows, instruments, momentum: 0.0, seed: Seed(3) }
}

/// A market whose messages take random times and whose fills cost random amounts, where it is to be `rough`.
pub fn market(kind: DataKind, instruments: usize, rows: usize, rough: bool) -> Backtest {
    let data = generated(kind, instruments, rows);
    let mut all = data.instruments();
    let mut parts: Vec<(&str, &str, f64)> = Vec::new();
    let mut settings = Settings { max_leverage: 1.0, ..Settings::with_cash(Cash::nearest(1e6).unwrap()) };
    if rough {
        parts = vec![("adverse_selection", "", 1.0), ("transient_impact", "exponential", 9.0), ("commission", "bps", 0.7)];
        let order = Latency::Exponential { least: 0.05, mean: 0.4 };
        let feed = Latency::Uniform { least: 0.0, most: 0.3 };
        settings.latencies = Latencies { feed, response: order.clone(), order, ..Latencies::default() };
        for one in &mut all {
            (one.average_daily_volume, one.daily_volatility) = (Some(1e6), Some(0.02));
        }
    }
    Backtest::new(all, data.histories().unwrap(), venue(&parts), settings).unwrap()
}

pub fn portfolio(instruments: usize) -> Portfolio {
    Portfolio::new((0..instruments).map(|k| format!("GEN{k}")).collect(), Reward::default())
}

pub fn env<T: Task>(setup: MarketSetup, task: T) -> MarketEnv<T> {
    let count = setup.backtest.instruments().len();
    MarketEnv::new("trueup/Test-v0", "test", setup, task, count).unwrap()
}

/// Numbers within [0, 1) that are the same every time.
pub struct Numbers(pub u64);

impl Numbers {
    pub fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1_u64 << 24) as f32
    }

    pub fn action<E: Env>(&mut self, env: &E) -> Vec<f32> {
        let space = env.about().action.as_box().unwrap();
        space.low.iter().zip(&space.high).map(|(low, high)| low + (high - low) * self.next()).collect()
    }
}

/// What an episode gave.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Told {
    /// Bits of all observations, the first among them.
    pub observations: Vec<Vec<u32>>,
    pub actions: Vec<Vec<f32>>,
    pub rewards: Vec<f64>,
    pub last: Option<(bool, bool)>,
}

pub fn bits(observation: &[f32]) -> Vec<u32> {
    observation.iter().map(|value| value.to_bits()).collect()
}

/// Steps `env` by `policy` to the end of an episode, or for so many steps.
pub fn played<E: Env>(env: &mut E, episode: Episode, most: usize, mut policy: impl FnMut(&E, &[f32]) -> Vec<f32>) -> Told {
    let mut observation = vec![0.0; env.about().observation.size()];
    env.reset(episode, &Options::new(), &mut observation).unwrap();
    let mut told = Told { observations: vec![bits(&observation)], ..Told::default() };
    for _ in 0..most {
        let action = policy(env, &observation);
        let step = env.step(Actions::Continuous(&action), &mut observation).unwrap();
        assert_eq!(env.about().observation.outside(&observation), None, "step {}", told.rewards.len());
        assert!(step.reward.is_finite());
        told.observations.push(bits(&observation));
        told.actions.push(action);
        told.rewards.push(step.reward);
        if step.terminated || step.truncated {
            told.last = Some((step.terminated, step.truncated));
            break;
        }
    }
    told
}

pub fn at_random<E: Env>(seed: u64) -> impl FnMut(&E, &[f32]) -> Vec<f32> {
    let mut numbers = Numbers(seed);
    move |env, _| numbers.action(env)
}

/// Runs `session` with `strategy` until so many events were seen.
pub fn run_for(mut session: Session, strategy: &mut dyn Strategy, events: usize) -> Record {
    while session.events() < events && session.step(strategy).unwrap().is_some() {}
    session.finish().unwrap()
}
