//! Market environments: an episode is a backtest to the last bit, knows nothing of the future, and can be copied anywhere.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

mod market_scene;

use std::sync::Arc;

use market_scene::{bars, instrument, venue};
use trueup::market::env::{
    DataKind, DrawnExecution, ENVIRONMENTS, Ended, Execute, Generated, MakeMarket, MarketEnv, MarketEnvError, MarketSetup,
    Pace, Payoff, Portfolio, Reward, Task, Ways, make_on,
};
use trueup::market::{
    Backtest, Cash, Halt, History, Latencies, Latency, Matching, Orders, Quotes, Record, Role, Session, Settings, Side,
    Strategy, View, WhileHalted,
};
use trueup::rl::{Actions, Buffers, Each, Env, EnvError, Episode, Options, Step, Threads, VecEnv, Which, check_env};
use trueup::sim2real::randomize::{Distribution, Level, Randomized, Randomizer, Redraw, Target};
use trueup::sim2real::{Parameter, Seed, Timestamp};

const ROWS: usize = 3_000;

fn generated(kind: DataKind, instruments: usize, rows: usize) -> Generated {
    Generated { kind, rows, instruments, momentum: 0.0, seed: Seed(3) }
}

/// A market whose messages take random times and whose fills cost random amounts, where it is to be `rough`.
fn market(kind: DataKind, instruments: usize, rows: usize, rough: bool) -> Backtest {
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

fn portfolio(instruments: usize) -> Portfolio {
    Portfolio::new((0..instruments).map(|k| format!("GEN{k}")).collect(), Reward::default())
}

fn env<T: Task>(setup: MarketSetup, task: T) -> MarketEnv<T> {
    let count = setup.backtest.instruments().len();
    MarketEnv::new("trueup/Test-v0", "test", setup, task, count).unwrap()
}

/// Numbers within [0, 1) that are the same every time.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1_u64 << 24) as f32
    }

    fn action<E: Env>(&mut self, env: &E) -> Vec<f32> {
        let space = env.about().action.as_box().unwrap();
        space.low.iter().zip(&space.high).map(|(low, high)| low + (high - low) * self.next()).collect()
    }
}

/// What an episode gave.
#[derive(Debug, Clone, PartialEq, Default)]
struct Told {
    /// Bits of all observations, the first among them.
    observations: Vec<Vec<u32>>,
    actions: Vec<Vec<f32>>,
    rewards: Vec<f64>,
    last: Option<(bool, bool)>,
}

fn bits(observation: &[f32]) -> Vec<u32> {
    observation.iter().map(|value| value.to_bits()).collect()
}

/// Steps `env` by `policy` to the end of an episode, or for so many steps.
fn played<E: Env>(
    env: &mut E,
    episode: Episode,
    most: usize,
    mut policy: impl FnMut(&E, &[f32]) -> Vec<f32>,
) -> Told {
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

fn at_random<E: Env>(seed: u64) -> impl FnMut(&E, &[f32]) -> Vec<f32> {
    let mut numbers = Numbers(seed);
    move |env, _| numbers.action(env)
}

/// Runs `session` with `strategy` until so many events were seen.
fn run_for(mut session: Session, strategy: &mut dyn Strategy, events: usize) -> Record {
    while session.events() < events && session.step(strategy).unwrap().is_some() {}
    session.finish().unwrap()
}

/// Plays an episode at random, and the same actions as a strategy in the backtest that the episode is: the records must be the
/// same, and the policy must have seen the same.
fn same_as_in_a_backtest<T: Task>(mut env: MarketEnv<T>, seed: u64, most: usize, what: &str) -> Record {
    let told = played(&mut env, Episode { seed, number: 2 }, most, at_random(seed));
    let stepped = env.record().unwrap().unwrap();
    let mut actions = told.actions.clone().into_iter();
    let mut seen = Vec::new();
    let policy = |observation: &[f32], action: &mut [f32]| {
        seen.push(bits(observation));
        actions.next().map(|next| action.copy_from_slice(&next)).is_some()
    };
    let mut strategy = env.acted(policy).unwrap();
    let session = env.session().unwrap().unwrap();
    let ran = run_for(session, &mut strategy, env.events());
    drop(strategy);
    assert_eq!(stepped.blotter, ran.blotter, "{what}: orders and fills");
    assert_eq!(stepped, ran, "{what}");
    let steps = told.actions.len();
    assert_eq!(seen[..steps], told.observations[..steps], "{what}: what the policy saw");
    stepped
}

#[test]
fn an_episode_is_the_backtest_of_what_is_done_in_it_to_the_last_bit() {
    let mut fills = 0;
    for (kind, rough) in [DataKind::Bars, DataKind::Quotes, DataKind::Book].into_iter().flat_map(|k| [(k, false), (k, true)]) {
        for length in [None, Some(200)] {
            let setup = || MarketSetup { length, ..MarketSetup::new(market(kind, 1, ROWS, rough)) };
            let what = |task: &str| format!("{task} on {kind:?}, rough: {rough}, length {length:?}");
            let most = 800;
            let traded = same_as_in_a_backtest(env(setup(), portfolio(1)), 1, most, &what("trade"));
            let executed = same_as_in_a_backtest(env(setup(), Execute::new(5_000.0, Ways::Both)), 2, most, &what("execute"));
            let made = same_as_in_a_backtest(env(setup(), MakeMarket::new(300.0, 2_000.0, 0.1)), 3, most, &what("make"));
            for record in [&traded, &executed] {
                assert!(!record.blotter.fills.is_empty(), "{}", what("nothing filled"));
            }
            fills += made.blotter.fills.len();
        }
        let by_seconds = MarketSetup::new(market(kind, 1, ROWS, rough)).with_pace(Pace::Seconds(90.0));
        same_as_in_a_backtest(env(by_seconds, portfolio(1)), 4, 300, "by seconds");
        let by_events = MarketSetup::new(market(kind, 1, ROWS, rough)).with_pace(Pace::Events(7)).with_length(50);
        same_as_in_a_backtest(env(by_events, portfolio(1)), 5, 300, "by events");
        let several = MarketSetup::new(market(DataKind::Bars, 3, ROWS, rough)).with_length(100);
        let record = same_as_in_a_backtest(env(several, portfolio(3)), 6, 300, "several");
        assert!((0..3).all(|k| record.blotter.fills.iter().any(|fill| fill.instrument == k)));
    }
    assert!(fills > 100, "{fills} fills of quotes");
}

/// Decides by itself, and shares nothing with environments.
struct Alone {
    bars: usize,
    warm_up: usize,
}

/// A share that changes with the number of the bar.
fn share(bar: usize) -> f64 {
    f64::from((bar * 7 % 11) as u32) / 5.0 - 1.0
}

impl Strategy for Alone {
    fn name(&self) -> &str {
        "alone"
    }
    fn lookback(&self) -> usize {
        1
    }
    fn on_event(&mut self, view: &View<'_>, orders: &mut Orders) {
        self.bars += 1;
        if self.bars <= self.warm_up {
            return;
        }
        let worth = f64::from(share(self.bars) as f32) * view.equity().to_f64();
        let lots = view.lots_worth(0, worth.abs());
        orders.to_position(view, 0, if worth < 0.0 { -lots } else { lots });
    }
}

#[test]
fn a_strategy_that_knows_no_environment_comes_to_the_same_ledger() {
    for rough in [false, true] {
        let backtest = market(DataKind::Bars, 1, 500, rough);
        let setup = MarketSetup { warm_up: 5, ..MarketSetup::new(backtest.clone()) };
        let mut stepped = env(setup, portfolio(1));
        let mut bar = 5;
        let told = played(&mut stepped, Episode { seed: 9, number: 0 }, usize::MAX, |_, _| {
            bar += 1;
            vec![share(bar) as f32]
        });
        assert_eq!(told.last, Some((false, true)));
        assert_eq!(stepped.ended(), Ended::Data);
        let seed = Episode { seed: 9, number: 0 }.seed();
        let mut alone = Alone { bars: 0, warm_up: 5 };
        let settings = Settings { seed, ..backtest.settings().clone() };
        let same = Backtest::new(
            backtest.instruments().to_vec(),
            backtest.histories().to_vec(),
            backtest.venue().clone(),
            settings,
        );
        // The last bar is the end of the episode: nobody acts there.
        let mut session = same.unwrap().start();
        while session.events() < 499 {
            session.step(&mut alone).unwrap();
        }
        struct Idle;
        impl Strategy for Idle {
            fn name(&self) -> &str {
                "idle"
            }
            fn lookback(&self) -> usize {
                1
            }
            fn on_event(&mut self, _view: &View<'_>, _orders: &mut Orders) {}
        }
        session.step(&mut Idle).unwrap();
        let ran = session.finish().unwrap();
        assert!(ran.blotter.fills.len() > 300);
        assert_eq!(stepped.record().unwrap().unwrap(), ran);
        let gains: f64 = told.rewards.iter().map(|reward| (1.0 + reward).ln()).sum();
        let equity = ran.equity.last().unwrap().equity;
        assert!((gains - (equity / 1e6).ln()).abs() < 1e-9, "rewards add up to what was gained");
    }
}

/// The same market with all that becomes known after the middle changed.
fn with_another_future(backtest: &Backtest, cut: Timestamp) -> Backtest {
    let changed = backtest.histories().iter().map(|history| {
        let mut bars = history.bars().to_vec();
        for bar in bars.iter_mut().filter(|bar| bar.known_at > cut) {
            let up = |price: trueup::market::Price| trueup::market::Price(price.0 * 3 / 2 / 10_000_000 * 10_000_000);
            (bar.open, bar.high, bar.low, bar.close) = (up(bar.open), up(bar.high), up(bar.low), up(bar.close));
            bar.volume *= 9.0;
        }
        let mut quotes = Quotes::with_depth(1);
        let all = history.quotes().all();
        for quote in (0..all.len()).filter_map(|k| all.get(k)) {
            let late = quote.time > cut;
            let moved = |level: &trueup::market::Level| trueup::market::Level {
                price: if late { level.price + 7.0 } else { level.price },
                size: if late { level.size * 3.0 } else { level.size },
            };
            quotes.push(quote.time, &[moved(&quote.bids[0])], &[moved(&quote.asks[0])]);
        }
        let depth = history.depth().iter().copied().map(|mut change| {
            if change.known_at > cut {
                change.size *= 5.0;
            }
            change
        });
        let prints = history.prints().iter().filter(|print| print.time <= cut).copied().collect();
        let history = History::new(bars, quotes).unwrap().with_depth(depth.collect()).unwrap();
        history.with_prints(prints).unwrap()
    });
    backtest.on(changed.collect()).unwrap()
}

#[test]
fn what_comes_later_changes_no_bit_of_what_was_observed() {
    for kind in [DataKind::Bars, DataKind::Quotes, DataKind::Book] {
        let backtest = market(kind, 1, ROWS, true);
        let history = &backtest.histories()[0];
        let last = history.bars().last().map(|bar| bar.known_at);
        let last = last.or(history.quotes().times().last().copied()).or(history.depth().last().map(|d| d.known_at)).unwrap();
        let first = Timestamp(1_704_067_200 * Timestamp::NANOS);
        let cut = first + (last.0 - first.0) / 2;
        let run = |backtest: &Backtest| {
            let mut env = env(MarketSetup::new(backtest.clone()), portfolio(1));
            let time = env.about().channel("time").unwrap();
            let mut times = Vec::new();
            let mut numbers = Numbers(5);
            let told = played(&mut env, Episode::default(), usize::MAX, |env, _| {
                times.push(env.info(time));
                numbers.action(env)
            });
            (told, times)
        };
        let ((before, times), (after, _)) = (run(&backtest), run(&with_another_future(&backtest, cut)));
        let known = times.iter().take_while(|time| **time * 1e9 <= cut.0 as f64 - 1e3).count();
        assert!(known > 500, "{kind:?}: {known}");
        assert_eq!(before.observations[..known], after.observations[..known], "{kind:?}");
        assert_eq!(before.rewards[..known - 1], after.rewards[..known - 1], "{kind:?}");
        assert_ne!(before.observations[known + 5..known + 50], after.observations[known + 5..known + 50], "{kind:?}");
    }
}

#[test]
fn a_copy_goes_on_with_the_same_bits() {
    for kind in [DataKind::Bars, DataKind::Quotes, DataKind::Book] {
        let setup = MarketSetup::new(market(kind, 1, ROWS, true)).with_length(400);
        let mut one = env(setup, portfolio(1));
        played(&mut one, Episode { seed: 4, number: 0 }, 150, at_random(8));
        let mut other = one.clone();
        let on = |env: &mut MarketEnv<Portfolio>| {
            let (mut numbers, mut observation) = (Numbers(77), vec![0.0; env.about().observation.size()]);
            let mut all: Vec<(Vec<u32>, Step)> = Vec::new();
            while all.last().is_none_or(|(_, step)| !step.truncated) {
                let action = numbers.action(env);
                let step = env.step(Actions::Continuous(&action), &mut observation).unwrap();
                all.push((bits(&observation), step));
            }
            (all, env.record().unwrap().unwrap())
        };
        let (first, second) = (on(&mut one), on(&mut other));
        assert_eq!(first.0.len(), 250);
        assert_eq!(first, second, "{kind:?}");
    }
}

#[test]
fn a_lane_does_not_depend_on_others_or_on_threads() {
    for entry in ENVIRONMENTS {
        let options = Options::new().with("rows", 1_500.0).with("length", 40.0).with("randomization", 1.0).with("latency", 0.2);
        let make = |lanes| (entry.make)(lanes, &options).unwrap();
        let run = |env: &mut dyn VecEnv, seeds: &[u64]| {
            let (size, mut out) = (env.about().action.size(), Buffers::of(env));
            let space = env.about().action.as_box().unwrap().clone();
            env.reset(Which::All, Some(seeds), &Options::new(), &mut out.observations).unwrap();
            let mut all = vec![Vec::new(); seeds.len()];
            for step in 0..30_u64 {
                let actions: Vec<f32> = seeds
                    .iter()
                    .flat_map(|seed| {
                        let mut numbers = Numbers(seed * 1_000 + step);
                        (0..size).map(|k| space.low[k] + (space.high[k] - space.low[k]) * numbers.next()).collect::<Vec<_>>()
                    })
                    .collect();
                env.step(Actions::Continuous(&actions), &mut out.out()).unwrap();
                let width = out.observations.len() / seeds.len();
                for (lane, told) in all.iter_mut().enumerate() {
                    let row = &out.observations[lane * width..][..width];
                    told.push((bits(row), out.rewards[lane].to_bits(), out.terminated[lane], out.truncated[lane]));
                }
            }
            all
        };
        let together = run(&mut *make(5), &[3, 4, 5, 6, 7]);
        let swapped = run(&mut *make(2), &[7, 4]);
        assert_eq!([&swapped[0], &swapped[1]], [&together[4], &together[1]], "{}", entry.id);
        assert_ne!(together[0], together[1], "{}", entry.id);
        let mut threads = Threads::new(5, 3, |lanes| (entry.make)(lanes, &options)).unwrap();
        assert_eq!(run(&mut threads, &[3, 4, 5, 6, 7]), together, "{}", entry.id);
    }
}

#[test]
fn every_environment_stays_within_its_spaces_on_any_data() {
    for entry in ENVIRONMENTS {
        assert_eq!(entry.describe().unwrap().id, entry.id);
        for data in ["bars", "quotes", "book"] {
            for (pace, every) in [("data", 1.0), ("events", 5.0), ("seconds", 3.0)] {
                let options = Options::new()
                    .with("data", data)
                    .with("rows", 2_500.0)
                    .with("length", 60.0)
                    .with("pace", if data == "bars" && pace == "seconds" { "bars" } else { pace })
                    .with("every", every);
                let mut env = (entry.make)(2, &options).unwrap();
                let about = env.about().clone();
                assert_eq!((about.observation.check(), about.action.check()), (Ok(()), Ok(())));
                let mut out = Buffers::of(&*env);
                let space = about.action.as_box().unwrap();
                let mut numbers = Numbers(1);
                let (mut ended, mut steps) = (0, 0);
                env.reset(Which::All, Some(&[1, 2]), &Options::new(), &mut out.observations).unwrap();
                while ended < 4 && steps < 2_000 {
                    let draw = |k: usize, draw: f32| space.low[k] + (space.high[k] - space.low[k]) * draw;
                    let actions: Vec<f32> = (0..2 * space.size()).map(|k| draw(k % space.size(), numbers.next())).collect();
                    env.step(Actions::Continuous(&actions), &mut out.out()).unwrap();
                    assert_eq!(about.observation.outside(&out.observations), None, "{} on {data}", entry.id);
                    let over: Vec<bool> = (0..2).map(|k| out.terminated[k] || out.truncated[k]).collect();
                    if over.contains(&true) {
                        ended += 1;
                        env.reset(Which::Mask(&over), None, &Options::new(), &mut out.observations).unwrap();
                        (out.terminated, out.truncated) = (vec![false; 2], vec![false; 2]);
                    }
                    steps += 1;
                }
                assert_eq!(ended, 4, "{} on {data} by {pace}", entry.id);
            }
        }
    }
}

#[test]
fn every_environment_keeps_the_contract() {
    for entry in ENVIRONMENTS {
        for data in ["bars", "quotes", "book"] {
            let options = Options::new().with("rows", 1_200.0).with("length", 25.0).with("data", data);
            let options = options.with("latency", 0.1).with("randomization", 0.5);
            let report = check_env(|lanes| (entry.make)(lanes, &options), 80).unwrap();
            assert!(report.passed() && report.episodes > 0, "{data}: {report}");
        }
    }
}

#[test]
fn an_episode_in_the_midst_is_the_backtest_of_the_rows_from_there() {
    for kind in [DataKind::Bars, DataKind::Quotes] {
        let setup = MarketSetup::new(market(kind, 1, ROWS, false)).with_length(300);
        let mut env = env(setup, portfolio(1));
        let told = played(&mut env, Episode { seed: 11, number: 5 }, usize::MAX, at_random(3));
        assert_eq!((told.rewards.len(), env.ended()), (300, Ended::Length));
        let (backtest, from) = env.backtest().unwrap();
        assert!(from > backtest.histories()[0].bars().first().map_or(Timestamp::MIN, |bar| bar.known_at));
        let cut: Vec<History> = backtest.histories().iter().map(|h| h.within(from, Timestamp::MAX)).collect();
        assert!(cut[0].rows() < backtest.histories()[0].rows());
        let mut actions = told.actions.into_iter();
        let policy =
            |_: &[f32], action: &mut [f32]| actions.next().map(|next| action.copy_from_slice(&next)).is_some();
        let mut strategy = env.acted(policy).unwrap();
        let ran = run_for(backtest.on(cut).unwrap().start(), &mut strategy, env.events());
        let stepped = env.record().unwrap().unwrap();
        // Rows are counted from the first of the whole data.
        let money = |record: &Record| {
            let fills: Vec<_> = record.blotter.fills.iter().map(|f| (f.filled_at, f.quantity, f.price, f.fee)).collect();
            (fills, record.ledger.clone(), record.equity.clone(), record.blotter.orders.clone())
        };
        assert!(!stepped.blotter.fills.is_empty());
        assert_eq!(money(&stepped), money(&ran));
    }
}

#[test]
fn a_book_is_there_when_an_episode_begins_in_the_midst() {
    let backtest = market(DataKind::Book, 1, ROWS, false);
    let mut whole = env(MarketSetup { warm_up: 1_500, ..MarketSetup::new(backtest.clone()) }, portfolio(1));
    let mut part = env(MarketSetup { warm_up: 8, ..MarketSetup::new(backtest) }.with_length(200), portfolio(1));
    let time = whole.about().channel("time").unwrap();
    let mut observation = vec![0.0; whole.about().observation.size()];
    whole.reset(Episode::default(), &Options::new(), &mut observation).unwrap();
    let left = whole.about().observation.component("time_left").unwrap();
    let at = |env: &MarketEnv<Portfolio>| env.info(time);
    // Begins at several rows, and goes on with the other until both are at one event.
    let mut rows = 0;
    for start in [1_100.0, 1_333.0, 1_500.0] {
        let mut whole = whole.clone();
        let (mut own, mut other) = (observation.clone(), observation.clone());
        part.reset(Episode::default(), &Options::new().with("start", start), &mut own).unwrap();
        while at(&part) < at(&whole) && !part.step(Actions::Continuous(&[0.0]), &mut own).unwrap().truncated {}
        while at(&whole) < at(&part) {
            whole.step(Actions::Continuous(&[0.0]), &mut other).unwrap();
        }
        if at(&part) != at(&whole) {
            continue;
        }
        rows += 1;
        (own[left], other[left]) = (0.0, 0.0);
        assert_eq!(bits(&own), bits(&other));
        // Orders meet the same book.
        let fills = |env: &mut MarketEnv<Portfolio>| {
            for share in [1.0, -1.0, 0.5] {
                env.step(Actions::Continuous(&[share]), &mut vec![0.0; observation.len()]).unwrap();
            }
            let record = env.record().unwrap().unwrap();
            record.blotter.fills.iter().map(|f| (f.filled_at, f.price, f.quantity)).collect::<Vec<_>>()
        };
        let (one, other) = (fills(&mut part), fills(&mut whole));
        assert!(!one.is_empty());
        assert_eq!(one, other, "from {start}");
    }
    assert!(rows > 0);
}

#[test]
fn an_executed_order_costs_its_implementation_shortfall_and_is_never_exceeded() {
    for (kind, rough) in [(DataKind::Bars, false), (DataKind::Quotes, true), (DataKind::Book, true)] {
        let setup = MarketSetup::new(market(kind, 1, ROWS, rough)).with_length(50);
        let mut env = env(setup, Execute::new(3_000.0, Ways::Both));
        let mut sides = [0; 2];
        for number in 0..20 {
            let told = played(&mut env, Episode { seed: 6, number }, usize::MAX, at_random(number));
            let record = env.record().unwrap().unwrap();
            let fills = &record.blotter.fills;
            let side = fills[0].side;
            sides[usize::from(side == Side::Sell)] += 1;
            assert!(fills.iter().all(|fill| fill.side == side));
            let done: f64 = fills.iter().map(|fill| fill.quantity.to_f64()).sum();
            let arrival = env.info(env.about().channel("arrival_price").unwrap());
            if env.ended() == Ended::Done {
                assert_eq!(done, 3_000.0, "{kind:?} {number}");
                assert_eq!(told.last, Some((true, false)));
            } else {
                assert!(done < 3_000.0 && env.ended() == Ended::Data, "{kind:?} {number}: {:?}", env.ended());
                continue;
            }
            let paid: f64 = fills
                .iter()
                .map(|f| side.sign() * (f.price.to_f64() - arrival) * f.quantity.to_f64() + f.fee.to_f64())
                .sum();
            let shortfall = 1e4 * paid / (arrival * 3_000.0);
            let rewards: f64 = told.rewards.iter().sum();
            assert!((rewards + shortfall).abs() < 1e-6, "{kind:?} {number}: {rewards} {shortfall}");
        }
        assert!(sides.iter().all(|count| *count > 2), "{sides:?}");
    }
}

#[test]
fn a_maker_rests_and_stays_within_its_inventory() {
    let setup = MarketSetup::new(market(DataKind::Book, 1, 20_000, false));
    let mut env = env(setup, MakeMarket::new(100.0, 300.0, 0.5));
    let mut largest = 0.0_f64;
    let cash = env.about().channel("equity").unwrap();
    let told = played(&mut env, Episode::default(), 8_000, |env, _| {
        let equity = env.info(cash);
        assert!(equity > 0.0);
        vec![0.0, 0.0, 1.0]
    });
    let record = env.record().unwrap().unwrap();
    let mut held = 0.0_f64;
    for fill in &record.blotter.fills {
        assert_eq!(fill.why.role, Role::Maker);
        held += fill.side.sign() * fill.quantity.to_f64();
        largest = largest.max(held.abs());
    }
    assert!(record.blotter.fills.len() > 50, "{}", record.blotter.fills.len());
    assert!(largest <= 300.0, "{largest}");
    // What it is paid is what it gained, less what it held.
    let equity = env.info(cash);
    let paid: f64 = told.rewards.iter().sum();
    assert!(paid <= (equity - 1e6) / (0.01 * 100.0) + 1e-6);
}

#[test]
fn what_is_drawn_for_an_episode_is_what_it_runs_on() {
    let parameter = |name: &'static str, unit| Parameter::new(name, unit, 0.5).within(0.0, 1e3);
    let uniform = |target: Target, parameter, low, high| Randomized {
        target,
        parameter,
        distribution: Distribution::Uniform { low, high },
        relative: false,
        at: Redraw::Reset,
    };
    let randomized = vec![
        uniform(Target::of("commission", "bps"), parameter("bps", "bps"), 1.0, 9.0),
        uniform(Target::of("latency", "order"), parameter("order", "s"), 0.1, 0.9),
    ];
    let execution = DrawnExecution { randomizer: Randomizer::new(randomized.clone(), vec![]).unwrap(), level: Level::FULL };
    let setup = || {
        let data = generated(DataKind::Quotes, 1, ROWS);
        let settings = Settings::with_cash(Cash::nearest(1e6).unwrap());
        let (all, histories) = (data.instruments(), data.histories().unwrap());
        let backtest = Backtest::new(all, histories, venue(&[("commission", "bps", 0.5)]), settings).unwrap();
        MarketSetup::new(backtest).with_length(60)
    };
    let mut one = env(setup().with_execution(execution.clone()), portfolio(1));
    let mut drawn = Vec::new();
    for number in 0..6 {
        played(&mut one, Episode { seed: 2, number }, usize::MAX, at_random(number));
        let values = [one.privileged(0), one.privileged(1)];
        assert!((1.0..9.0).contains(&values[0]) && (0.1..0.9).contains(&values[1]));
        let record = one.record().unwrap().unwrap();
        for fill in &record.blotter.fills {
            let bps = 1e4 * fill.fee.to_f64() / (fill.price.to_f64() * fill.quantity.to_f64());
            assert!((bps - values[0]).abs() < 1e-6, "{bps} {values:?}");
        }
        for order in &record.blotter.orders {
            let took = order.arrives_at.seconds_since(order.decided_at);
            assert!((took - values[1]).abs() < 1e-6, "{took} {values:?}");
        }
        drawn.push(values);
    }
    assert!(drawn.windows(2).all(|w| w[0] != w[1]));
    assert_eq!(one.about().privileged.len(), 2);
    let mut again = env(setup().with_execution(execution), portfolio(1));
    played(&mut again, Episode { seed: 2, number: 3 }, 1, at_random(1));
    assert_eq!([again.privileged(0), again.privileged(1)], drawn[3]);
    let unknown = vec![uniform(Target::of("half_spread", "bps"), parameter("bps", "bps"), 1.0, 2.0)];
    let execution = DrawnExecution { randomizer: Randomizer::new(unknown, vec![]).unwrap(), level: Level::FULL };
    let refused = MarketEnv::new("trueup/Test-v0", "", setup().with_execution(execution), portfolio(1), 1).unwrap_err();
    assert!(refused.to_string().starts_with("`half_spread.bps` cannot be drawn: the venue has commission, latency\nhint: "));
}

#[test]
fn ruin_ends_an_episode_and_a_halt_and_refusals_are_told() {
    // It falls to a tenth within two bars.
    let falling = bars(&[(100.0, 100.0), (100.0, 100.0), (100.0, 99.0), (50.0, 40.0), (20.0, 10.0), (10.0, 10.0)]);
    let settings = Settings { max_leverage: 4.0, ..Settings::with_cash(Cash::nearest(1e5).unwrap()) };
    let backtest = Backtest::new(vec![instrument("A")], vec![falling], venue(&[]), settings.clone()).unwrap();
    let mut task = portfolio(1);
    task.leverage = 3.0;
    let setup = MarketSetup { warm_up: 0, ..MarketSetup::new(backtest) };
    let mut ruined = env(setup, task);
    let told = played(&mut ruined, Episode::default(), usize::MAX, |_, _| vec![1.0]);
    assert_eq!((told.last, ruined.ended()), (Some((true, false)), Ended::Done));
    assert!(ruined.info(ruined.about().channel("equity").unwrap()) <= 0.0);
    let told_of = |env: &MarketEnv<Portfolio>, name| env.info(env.about().channel(name).unwrap());

    let quiet: Vec<(f64, f64)> = vec![(100.0, 100.0); 20];
    let minute = 60 * Timestamp::NANOS;
    let halt = Halt { instrument: 0, from: Timestamp(5 * minute), to: Timestamp(15 * minute), reason: None };
    let matching = Matching { halted: WhileHalted::Refuse, ..Matching::default() };
    let halted = Settings { halts: vec![halt], matching, ..settings };
    let backtest = Backtest::new(vec![instrument("A")], vec![bars(&quiet)], venue(&[]), halted).unwrap();
    let setup = MarketSetup { warm_up: 0, ..MarketSetup::new(backtest) };
    let mut task = portfolio(1);
    // More than the account may carry: refused by the desk.
    task.leverage = 9.0;
    let mut env = env(setup, task);
    let mut seen = Vec::new();
    played(&mut env, Episode::default(), usize::MAX, |env, _| {
        seen.push((told_of(env, "halted"), told_of(env, "refused"), told_of(env, "orders")));
        vec![if seen.len() < 3 { 1.0 } else { 0.05 * (seen.len() % 3) as f32 }]
    });
    assert_eq!(seen[0], (0.0, 0.0, 0.0));
    assert_eq!(seen[2], (0.0, 2.0, 0.0), "both were refused");
    assert!(seen.iter().filter(|(halted, ..)| *halted == 1.0).count() >= 9);
    let record = env.record().unwrap().unwrap();
    let reasons: Vec<_> = record.blotter.orders.iter().filter_map(|order| order.reason).collect();
    assert!(reasons.contains(&trueup::market::Reason::Halted), "{reasons:?}");
}

#[test]
fn what_cannot_be_is_said_with_its_remedy() {
    let refused = |setup: MarketSetup| {
        MarketEnv::new("trueup/Test-v0", "", setup, portfolio(1), 1).map(|_| ()).unwrap_err().to_string()
    };
    let setup = |rows| MarketSetup::new(market(DataKind::Bars, 1, rows, false));
    assert_eq!(
        refused(setup(100).with_length(93)),
        "episodes of 93 steps and 8 rows before them do not fit into 100 rows of data\nhint: shorten `length` or `warm_up`, or give more data"
    );
    assert!(refused(setup(100).with_pace(Pace::Seconds(f64::NAN))).contains("the pace in seconds is NaN"));
    assert!(refused(setup(100).with_pace(Pace::Events(0))).contains("at least 1"));
    assert!(refused(MarketSetup::new(market(DataKind::Bars, 2, 100, false))).contains("the backtest has 2"));
    // A single row, and a window that just fits.
    let mut one = env(MarketSetup { warm_up: 0, ..setup(1) }, portfolio(1));
    let size = one.about().observation.size();
    let told = {
        let mut observation = vec![0.0; size];
        one.reset(Episode::default(), &Options::new(), &mut observation).unwrap();
        one.step(Actions::Continuous(&[1.0]), &mut observation).unwrap()
    };
    assert_eq!((told.reward, told.truncated, one.ended()), (0.0, true, Ended::Data));
    let mut none = env(MarketSetup { warm_up: 1, ..setup(1) }, portfolio(1));
    let error = none.reset(Episode::default(), &Options::new(), &mut vec![0.0; size]).unwrap_err();
    assert!(matches!(error, EnvError::Failed { .. }) && error.to_string().contains("before the first step is due"), "{error}");
    let mut fits = env(setup(100).with_length(91), portfolio(1));
    played(&mut fits, Episode::default(), usize::MAX, at_random(1));
    assert_eq!(fits.ended(), Ended::Length);
    let mut windowed = env(setup(100).with_length(10), portfolio(1));
    let mut start = |row: f64| {
        windowed.reset(Episode::default(), &Options::new().with("start", row), &mut vec![0.0; size]).map_err(|e| e.to_string())
    };
    assert!(start(8.0).is_ok() && start(89.0).is_ok());
    assert!(start(90.0).unwrap_err().contains("give a row from 8 to 89"));
    assert!(start(7.0).is_err());
    assert!(start(-2.0).unwrap_err().contains("option `start` is -2"));
    let mut fresh = env(setup(50), portfolio(1));
    let error = fresh.step(Actions::Continuous(&[0.0]), &mut vec![0.0; size]).unwrap_err();
    assert!(matches!(error, EnvError::NotReset { lane: 0 }));
    let made = |id, options| make_on(id, 1, setup(100), &options).map(|_| ()).unwrap_err().to_string();
    assert!(made("trueup/Nothing-v0", Options::new()).contains("there are trueup/Trade-v0"));
    assert!(made("trueup/Trade-v0", Options::new().with("lenght", 5.0)).contains("did you mean `length`"));
    assert!(made("trueup/Trade-v0", Options::new()).contains("do not fit"));
    assert!(matches!(
        MarketEnv::new("x", "", MarketSetup::new(market(DataKind::Bars, 2, 100, false)), portfolio(2), 1),
        Err(MarketEnvError::Instruments { task: 1, found: 2 })
    ));
}

#[test]
fn rewards_are_what_they_are_said_to_be() {
    let run = |reward: Reward| {
        let mut task = portfolio(1);
        task.reward = reward;
        let mut one = env(MarketSetup::new(market(DataKind::Bars, 1, 400, true)), task);
        let told = played(&mut one, Episode::default(), usize::MAX, at_random(1));
        (told.rewards, one.record().unwrap().unwrap())
    };
    let (profit, record) = run(Reward::default());
    let (log, _) = run(Reward { payoff: Payoff::LogProfit, ..Reward::default() });
    assert!(profit.iter().zip(&log).all(|(one, other)| (one.ln_1p() - other).abs() < 1e-12));
    let (dear, same) = run(Reward { cost_penalty: 3.0, ..Reward::default() });
    assert_eq!(record, same, "what is rewarded changes nothing of the account");
    let taken: f64 = profit.iter().zip(&dear).map(|(one, other)| one - other).sum();
    let fees: f64 = record.blotter.fills.iter().map(|fill| fill.fee.to_f64()).sum();
    assert!(fees > 0.0 && (taken / (3.0 * fees / 1e6) - 1.0).abs() < 0.1, "{taken} {fees}");
    let (deep, _) = run(Reward { drawdown_penalty: 1.0, ..Reward::default() });
    assert!(profit.iter().zip(&deep).all(|(one, other)| other <= one) && profit != deep);
}

#[test]
fn regimes_are_followed_as_they_come() {
    let data = generated(DataKind::Bars, 1, 20_000);
    let backtest = market(DataKind::Bars, 1, 20_000, false);
    let mut one = env(MarketSetup::new(backtest), portfolio(1));
    let turbulent = one.about().observation.component("regime_1").unwrap();
    let mut believed = Vec::new();
    played(&mut one, Episode::default(), usize::MAX, |_, observation| {
        believed.push(observation[turbulent]);
        vec![0.0]
    });
    // Where returns are large for long, the turbulent regime is believed in, and where they are small, the calm one.
    let bars = data.histories().unwrap()[0].bars().to_vec();
    let returns: Vec<f64> = bars.windows(2).map(|w| (w[1].close.to_f64() / w[0].close.to_f64()).ln().abs()).collect();
    let (mut high, mut low) = (Vec::new(), Vec::new());
    for k in 300..believed.len() {
        let recent = returns[k - 20 + 8 - 1..k + 8 - 1].iter().sum::<f64>() / 20.0;
        if recent > 1.2e-3 {
            high.push(f64::from(believed[k]));
        } else if recent < 5e-4 {
            low.push(f64::from(believed[k]));
        }
    }
    let mean = |all: &[f64]| all.iter().sum::<f64>() / all.len() as f64;
    assert!(high.len() > 500 && low.len() > 500);
    assert!(mean(&high) > 0.7 && mean(&low) < 0.2, "{} {}", mean(&high), mean(&low));
    let shared = Arc::new(one);
    assert_eq!(Each::new((*shared).clone(), 2).unwrap().lanes(), 2);
}
