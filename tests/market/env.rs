//! Market environments: an episode is a backtest to the last bit, knows nothing of the future, and can be copied anywhere.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use crate::account_scene::{of, with};
use crate::env_scene::{Numbers, ROWS, at_random, bits, env, market, played, portfolio, run_for};
use crate::market_scene::{bars, instrument, venue};
use trueup::market::env::{
    DataKind, DrawnExecution, ENVIRONMENTS, Ended, Execute, MakeMarket, MarketEnv, MarketSetup, Pace, Portfolio, Task, Ways,
};
use trueup::market::{Backtest, History, Orders, Quotes, Record, Settings, Strategy, Terms, View};
use trueup::rl::{Actions, Buffers, Env, Episode, Options, Step, Threads, VecEnv, Which, check_env};
use trueup::sim2real::randomize::{Distribution, Level, Randomized, Randomizer, Redraw, Target};
use trueup::sim2real::{Parameter, Timestamp};

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
    for (kind, rough) in [DataKind::Bars, DataKind::Quotes, DataKind::Book].into_iter().flat_map(|k| [(k, false), (k, true)])
    {
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

/// A rough market, of which much is drawn within an episode: by the clock and with the regimes of its data.
fn drawn_within(setup: MarketSetup) -> MarketSetup {
    let drawn = |id: &str, name: &'static str, (low, high): (f64, f64), at| Randomized {
        target: Target::of(id, name),
        parameter: Parameter::new(name, "", 0.5).within(0.0, 1e6),
        distribution: Distribution::Uniform { low, high },
        relative: false,
        at,
    };
    let randomized = vec![
        drawn("transient_impact", "bps_at_full_participation", (1.0, 90.0), Redraw::EverySeconds(60.0)),
        drawn("transient_impact", "recovery", (1.0, 900.0), Redraw::Regime(1)),
        drawn("adverse_selection", "bps", (0.0, 3.0), Redraw::Regime(0)),
        drawn("commission", "bps", (0.0, 2.0), Redraw::EverySeconds(45.0)),
        drawn("latency", "order", (0.0, 2.0), Redraw::EverySeconds(60.0)),
        drawn("latency", "feed", (0.0, 0.5), Redraw::Regime(1)),
        drawn("latency", "response", (0.0, 0.5), Redraw::Reset),
    ];
    let execution = DrawnExecution { randomizer: Randomizer::new(randomized, vec![]).unwrap(), level: Level::FULL };
    setup.with_execution(execution)
}

#[test]
fn what_is_drawn_within_an_episode_is_drawn_in_its_backtest() {
    for kind in [DataKind::Bars, DataKind::Quotes, DataKind::Book] {
        for (seed, length) in [(1, None), (2, Some(200))] {
            let setup = || drawn_within(MarketSetup { length, ..MarketSetup::new(market(kind, 1, ROWS, true)) });
            let record = same_as_in_a_backtest(env(setup(), portfolio(1)), seed, 800, &format!("{kind:?} drawn within"));
            assert!(!record.blotter.fills.is_empty());
            // A copy in the midst goes on with the same bits, and draws the same.
            let paced = MarketSetup { length: None, ..setup() }.with_pace(Pace::Seconds(5.0));
            let mut one = env(paced, portfolio(1));
            played(&mut one, Episode { seed, number: 2 }, 5, at_random(seed));
            let mut other = one.clone();
            let go_on = |env: &mut MarketEnv<Portfolio>| {
                let (mut observation, mut all) = (vec![0.0; env.about().observation.size()], Vec::new());
                for k in 0..20_u8 {
                    let step = env.step(Actions::Continuous(&[f32::from(k % 5) / 2.0 - 1.0]), &mut observation).unwrap();
                    let drawn: Vec<u64> = (0..7).map(|k| env.privileged(k).to_bits()).collect();
                    all.push((bits(&observation), step.reward.to_bits(), drawn));
                }
                all
            };
            let told = go_on(&mut one);
            assert!(told == go_on(&mut other));
            assert!(told[0].2 != told[19].2, "{kind:?}: nothing was drawn");
        }
    }
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
    let kinds = [DataKind::Bars, DataKind::Quotes, DataKind::Book];
    for (kind, drawn) in kinds.into_iter().flat_map(|kind| [(kind, false), (kind, true)]) {
        let backtest = market(kind, 1, ROWS, true);
        let history = &backtest.histories()[0];
        let last = history.bars().last().map(|bar| bar.known_at);
        let last = last.or(history.quotes().times().last().copied()).or(history.depth().last().map(|d| d.known_at)).unwrap();
        let first = Timestamp(1_704_067_200 * Timestamp::NANOS);
        let cut = first + (last.0 - first.0) / 2;
        let run = |backtest: &Backtest| {
            let setup = MarketSetup::new(backtest.clone());
            let mut env = env(if drawn { drawn_within(setup) } else { setup }, portfolio(1));
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
        let options =
            Options::new().with("rows", 1_500.0).with("length", 40.0).with("randomization", 1.0).with("latency", 0.2);
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
        let policy = |_: &[f32], action: &mut [f32]| actions.next().map(|next| action.copy_from_slice(&next)).is_some();
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

/// 2,000 at 100 on 100,000 of equity; at 66 equity is 32,000, and the broker closes: there is nothing more for the learner to do.
#[test]
fn a_margin_call_ends_an_episode() {
    let history = bars(&[(100.0, 100.0), (100.0, 66.0), (66.0, 66.0), (66.0, 66.0), (66.0, 66.0)]);
    let settings = with(of(&[Terms::default().with_regulation_t()]));
    let backtest = Backtest::new(vec![instrument("A")], vec![history], venue(&[]), settings).unwrap();
    let setup = MarketSetup { warm_up: 0, ..MarketSetup::new(backtest) };
    let mut doubled = portfolio(1);
    doubled.leverage = 2.0;
    let mut called = env(setup.clone(), doubled);
    let told = played(&mut called, Episode::default(), 9, |_, _| vec![1.0]);
    assert_eq!((told.rewards.len(), told.last, called.ended()), (1, Some((true, false)), Ended::MarginCall));
    assert!((told.rewards[0] + 0.68).abs() < 1e-12, "{:?}", told.rewards);
    let channel = called.about().info.iter().position(|channel| channel.name == "ended").unwrap();
    assert_eq!(called.info(channel), f64::from(Ended::MarginCall as u8));
    let record = called.record().unwrap().unwrap();
    assert_eq!((record.account.margin_calls.len(), record.blotter.fills[0].quantity.to_f64()), (1, 2_000.0));
    // With what the account can carry the episode goes on to the end of the data.
    let mut carried = env(setup, portfolio(1));
    let told = played(&mut carried, Episode::default(), 9, |_, _| vec![1.0]);
    assert_eq!((told.last, carried.ended()), (Some((false, true)), Ended::Data));
}
