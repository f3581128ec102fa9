//! What is plain leaves behind what the usual way does, to the last bit: in an environment, and in a backtest.

use proptest::prelude::*;
use proptest::strategy::Strategy as Drawable;

use crate::market::{
    Backtest, Cash, Execution, MECHANISMS, Notice, OrderId, Orders, Quantity, Session, Settings, Side, Strategy, View,
};
use crate::rl::{Actions, Env, Episode, Options};
use crate::sim2real::{Assembly, Parameter, Seed, Timestamp, Typical};

use super::{DataKind, Generated, MarketEnv, MarketSetup, Portfolio, Reward};

const ROWS: usize = 400;

/// A backtest on bars whose venue has some mechanisms, each with one value for all its parameters.
fn market(instruments: usize, mechanisms: &[(&str, f64)], max_leverage: f64) -> Backtest {
    let generated = Generated { kind: DataKind::Bars, rows: ROWS, instruments, momentum: 0.1, seed: Seed(3) };
    let mut venue = Assembly::new(Execution, MECHANISMS);
    for (id, value) in mechanisms {
        let mechanism = MECHANISMS.iter().find(|row| row.about().name == *id).unwrap();
        let form = mechanism.forms(&Typical::default()).into_iter().next().unwrap();
        let parameters = form.parameters.into_iter().map(|own| Parameter { nominal: *value, ..own }).collect();
        venue = venue.with_mechanism(*mechanism, 0, parameters);
    }
    let settings = Settings { max_leverage, ..Settings::with_cash(Cash::nearest(50_000.0).unwrap()) };
    Backtest::new(generated.instruments(), generated.histories().unwrap(), venue, settings).unwrap()
}

/// Some of the mechanisms that orders on bars meet: of prices, of quantities, which leave something over, of fees and of what is held; in
/// half of the cases none, where nothing is asked of a run of laws.
fn mechanisms() -> impl Drawable<Value = Vec<(&'static str, f64)>> {
    let all = [("half_spread", 0.4), ("lot_size", 7.0), ("sqrt_impact", 0.3), ("commission", 2.0), ("borrow_fee", 0.5)];
    Drawable::prop_map(0..64_u32, move |which| {
        let which = if which < 32 { which } else { 0 };
        all.into_iter().enumerate().filter(|(k, _)| which >> k & 1 == 1).map(|(_, m)| m).collect()
    })
}

/// The bits of all an environment tells.
fn told<T: super::Task>(env: &MarketEnv<T>) -> Vec<u64> {
    (0..env.about().info.len()).map(|channel| env.info(channel).to_bits()).collect()
}

/// Asks for market orders mostly, and for what is not plain now and then; all of it by draws of its own, so that runs that are the same
/// ask for the same.
struct Drawn {
    state: u64,
    sent: Option<OrderId>,
    notices: Vec<Notice>,
}

impl Drawn {
    fn new(state: u64) -> Self {
        Self { state, sent: None, notices: Vec::new() }
    }

    fn draw(&mut self, below: u64) -> u64 {
        self.state = self.state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.state >> 33) % below
    }
}

impl Strategy for Drawn {
    fn name(&self) -> &str {
        "drawn"
    }

    fn lookback(&self) -> usize {
        2
    }

    fn on_event(&mut self, view: &View<'_>, orders: &mut Orders) {
        let instrument = self.draw(view.instruments().len() as u64) as usize;
        let quantity = Quantity(1_000_000_000 * self.draw(300) as i64);
        let side = if self.draw(2) == 0 { Side::Buy } else { Side::Sell };
        match self.draw(16) {
            0..=6 => self.sent = Some(orders.market(instrument, side, quantity)),
            7 => {
                let Some(price) = view.price(instrument) else { return };
                self.sent = Some(orders.limit(instrument, side, quantity, price));
            }
            8 => self.sent.into_iter().for_each(|id| orders.cancel(id)),
            9 => orders.wake_at(Timestamp(view.now().0 + 90_000_000_000)),
            10 => {
                orders.market(instrument, side, quantity);
                orders.market(instrument, side.opposite(), quantity);
            }
            _ => {}
        }
    }

    fn on_notice(&mut self, _view: &View<'_>, notice: &Notice, orders: &mut Orders) {
        self.notices.push(*notice);
        if self.draw(8) == 0 {
            orders.market(notice.instrument, notice.side, Quantity(5_000_000_000));
        }
    }
}

/// Runs up to so many events.
fn advance(session: &mut Session, strategy: &mut Drawn, events: usize) {
    while session.events() < events && session.advance(strategy, events - session.events()).unwrap() {}
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Observations, rewards, figures and checkpoints at every step, copies in the midst that go on the other way, and the record.
    #[test]
    fn an_environment_steps_as_it_does_the_usual_way(
        mechanisms in mechanisms(), shares in proptest::collection::vec((-1.4_f32..1.4, 0..3_u8), 1..120), copied in 0..120_usize, leverage in 1.0..2.0_f64,
    ) {
        let env = || {
            let setup = MarketSetup::new(market(1, &mechanisms, 1.5));
            let mut task = Portfolio::new(vec!["GEN0".into()], Reward { cost_penalty: 0.5, ..Reward::default() });
            task.leverage = leverage;
            MarketEnv::new("plain", "", setup, task, 1).unwrap()
        };
        let (mut plain, mut usual) = (env(), env());
        let size = plain.about().observation.size();
        let (mut one, mut other) = (vec![0.0; size], vec![0.0; size]);
        let episode = Episode { seed: 5, number: 1 };
        plain.reset(episode, &Options::new(), &mut one).unwrap();
        usual.reset(episode, &Options::new(), &mut other).unwrap();
        prop_assert!(usual.session_mut().unwrap().go_the_usual_way());
        let mut share = 0.0;
        for (k, (next, holds)) in shares.into_iter().enumerate() {
            if k == copied {
                let copy = plain.clone();
                plain = usual.clone();
                usual = copy;
                usual.session_mut().unwrap().go_the_usual_way();
            }
            share = if holds == 0 { share } else { next };
            let steps = [plain.step(Actions::Continuous(&[share]), &mut one), usual.step(Actions::Continuous(&[share]), &mut other)];
            let [a, b] = steps.map(Result::unwrap);
            prop_assert_eq!((a.reward.to_bits(), a.terminated, a.truncated), (b.reward.to_bits(), b.terminated, b.truncated));
            prop_assert!(one.iter().zip(&other).all(|(a, b)| a.to_bits() == b.to_bits()));
            prop_assert_eq!(told(&plain), told(&usual));
            prop_assert_eq!(plain.session_mut().unwrap().checkpoint(), usual.session_mut().unwrap().checkpoint());
            if a.terminated || a.truncated {
                break;
            }
        }
        prop_assert_eq!(plain.record().unwrap().unwrap(), usual.record().unwrap().unwrap());
    }

    /// A backtest that is looked at now and then, that is forked, and that is ended early.
    #[test]
    fn a_backtest_goes_as_it_does_the_usual_way(
        mechanisms in mechanisms(), instruments in 1..3_usize, seed: u64, looks in proptest::collection::vec(1..60_usize, 1..12),
    ) {
        goes_the_usual_way(&mechanisms, instruments, seed, &looks);
    }
}

/// Holds a backtest that may be plain to one that is not.
fn goes_the_usual_way(mechanisms: &[(&str, f64)], instruments: usize, seed: u64, looks: &[usize]) {
    let setup = std::sync::Arc::new(market(instruments, mechanisms, 2.0));
    let start = || setup.start_with_room(Timestamp::MIN, None);
    let (mut plain, mut usual) = (start(), start());
    assert!(usual.go_the_usual_way());
    let (mut one, mut other) = (Drawn::new(seed), Drawn::new(seed));
    let mut events = 0;
    for look in looks {
        events += look;
        advance(&mut plain, &mut one, events);
        // It may have gone an event further than it was asked to.
        while usual.events() < plain.events() && usual.step(&mut other).unwrap().is_some() {}
        assert_eq!(plain.checkpoint(), usual.checkpoint());
        assert_eq!(&one.notices, &other.notices);
        assert_eq!(plain.fork().unwrap().finish().unwrap(), usual.fork().unwrap().finish().unwrap());
    }
    assert_eq!(plain.finish().unwrap(), usual.finish().unwrap());
}

/// An order that is cut to whole lots: word of its fill comes while one share of it is still open, which counts where more is asked for.
#[test]
fn what_is_left_of_a_plain_order_is_open_until_it_ends() {
    let mechanisms = [("lot_size", 7.0), ("sqrt_impact", 0.3), ("borrow_fee", 0.5)];
    goes_the_usual_way(&mechanisms, 1, 2_681_792_287_680_061_112, &[1, 38, 21]);
}
