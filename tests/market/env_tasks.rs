//! What there is to do in market environments: what it is paid, how it ends, what is drawn for it, and what is refused.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use crate::env_scene::{ROWS, at_random, env, generated, market, played, portfolio};
use crate::market_scene::{bars, instrument, venue};
use trueup::market::env::{
    DataKind, DrawnExecution, Ended, Execute, MakeMarket, MarketEnv, MarketEnvError, MarketSetup, Pace, Payoff, Portfolio,
    Reward, Ways, make_on,
};
use trueup::market::{Backtest, Cash, Halt, Matching, Role, Settings, Side, WhileHalted};
use trueup::rl::{Actions, Env, EnvError, Episode, Options};
use trueup::sim2real::randomize::{Distribution, Level, Randomized, Randomizer, Redraw, Target};
use trueup::sim2real::{Parameter, Timestamp};

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

/// Commission [bps] that is drawn `at`, on quotes whose data have two regimes.
fn commission_drawn(at: Redraw) -> (MarketSetup, DrawnExecution) {
    let one = Randomized {
        target: Target::of("commission", "bps"),
        parameter: Parameter::new("bps", "bps", 0.5).within(0.0, 1e3),
        distribution: Distribution::Uniform { low: 1.0, high: 9.0 },
        relative: false,
        at,
    };
    let execution = DrawnExecution { randomizer: Randomizer::new(vec![one], vec![]).unwrap(), level: Level::FULL };
    let data = generated(DataKind::Quotes, 1, ROWS);
    let settings = Settings::with_cash(Cash::nearest(1e6).unwrap());
    let (all, histories) = (data.instruments(), data.histories().unwrap());
    let backtest = Backtest::new(all, histories, venue(&[("commission", "bps", 0.5)]), settings).unwrap();
    (MarketSetup::new(backtest), execution)
}

/// Fees of fills [bps], with the time of each [s].
fn fees<T: trueup::market::env::Task>(env: &MarketEnv<T>) -> Vec<(f64, f64)> {
    let record = env.record().unwrap().unwrap();
    let bps = |fill: &trueup::market::Fill| 1e4 * fill.fee.to_f64() / (fill.price.to_f64() * fill.quantity.to_f64());
    record.blotter.fills.iter().map(|fill| (fill.filled_at.0 as f64 / 1e9, bps(fill))).collect()
}

#[test]
fn what_is_drawn_by_the_clock_is_another_in_each_interval_and_the_same_within() {
    let (setup, execution) = commission_drawn(Redraw::EverySeconds(100.0));
    let first = setup.backtest.histories()[0].quotes().times()[0].0 as f64 / 1e9;
    let mut one = env(setup.clone().with_execution(execution.clone()), portfolio(1));
    let mut told = std::collections::BTreeMap::<u64, f64>::new();
    let time = one.about().channel("time").unwrap();
    played(&mut one, Episode { seed: 5, number: 1 }, usize::MAX, |env, observation| {
        let interval = ((env.info(time) - first) / 100.0) as u64;
        let now = env.privileged(0);
        assert!(*told.entry(interval).or_insert(now) == now && (1.0..9.0).contains(&now));
        at_random(observation.len() as u64 + env.info(time) as u64)(env, observation)
    });
    let values: Vec<f64> = told.values().copied().collect();
    assert!(values.len() > 5 && values.windows(2).all(|w| w[0] != w[1]), "{values:?}");
    let paid = fees(&one);
    assert!(paid.len() > 50, "{}", paid.len());
    for (at, bps) in paid {
        // What is filled at the very end of an interval belongs to it.
        let interval = ((at - first) / 100.0) as u64;
        assert!((bps - told[&interval]).abs() < 1e-6, "{bps} at {at}, in an interval of {}", told[&interval]);
    }
    // Another episode draws others, the same one the same.
    let mut again = env(setup.with_execution(execution), portfolio(1));
    let mut ends = |number| {
        played(&mut again, Episode { seed: 5, number }, usize::MAX, at_random(1));
        again.privileged(0)
    };
    assert_eq!(ends(1), *values.last().unwrap());
    assert!(ends(2) != *values.last().unwrap());
}

#[test]
fn what_is_drawn_with_a_regime_is_nominal_outside_it() {
    let (setup, execution) = commission_drawn(Redraw::Regime(1));
    let mut one = env(setup.with_execution(execution), portfolio(1));
    let component = |name: &str| one.about().observation.component(name).unwrap();
    let (calm, turbulent) = (component("regime_0"), component("regime_1"));
    let (mut values, mut outside) = (Vec::new(), 0);
    played(&mut one, Episode { seed: 5, number: 1 }, usize::MAX, |env, observation| {
        let now = env.privileged(0);
        let within = observation[turbulent] > observation[calm];
        assert_eq!(now != 0.5, within, "{now}, probability {}", observation[turbulent]);
        assert!(!within || (1.0..9.0).contains(&now));
        outside += usize::from(!within);
        if within && values.last() != Some(&now) {
            values.push(now);
        }
        at_random(observation.len() as u64 + values.len() as u64)(env, observation)
    });
    assert!(values.len() > 3 && outside > 50, "{values:?}, {outside} steps outside");
    let paid = fees(&one);
    assert!(paid.iter().any(|(_, bps)| (bps - 0.5).abs() < 1e-6));
    assert!(paid.iter().any(|(_, bps)| *bps > 1.0 - 1e-6));
}

#[test]
fn what_cannot_be_drawn_within_an_episode_is_refused() {
    let refused = |at| {
        let (setup, execution) = commission_drawn(at);
        MarketEnv::new("trueup/Test-v0", "", setup.with_execution(execution), portfolio(1), 1).unwrap_err().to_string()
    };
    let told = refused(Redraw::EverySteps(3));
    assert!(told.starts_with("`commission.bps` is drawn anew every so many steps\nhint: "), "{told}");
    let told = refused(Redraw::EverySeconds(1e-6));
    assert!(told.contains("a time between draws") && told.contains("0.000001"), "{told}");
    let told = refused(Redraw::Regime(2));
    assert!(told.starts_with("`commission.bps` is drawn in regime 2, and there are 2, counted from 0\nhint: "), "{told}");
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
    assert!(
        matches!(error, EnvError::Failed { .. }) && error.to_string().contains("before the first step is due"),
        "{error}"
    );
    let mut fits = env(setup(100).with_length(91), portfolio(1));
    played(&mut fits, Episode::default(), usize::MAX, at_random(1));
    assert_eq!(fits.ended(), Ended::Length);
    let mut windowed = env(setup(100).with_length(10), portfolio(1));
    let mut start = |row: f64| {
        windowed
            .reset(Episode::default(), &Options::new().with("start", row), &mut vec![0.0; size])
            .map_err(|e| e.to_string())
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
}
