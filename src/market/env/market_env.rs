//! A backtest, stepped: the environment of any task in a market.

use std::sync::Arc;

use crate::market::{Backtest, BacktestError, Event, Record, Session};
use crate::rl::{
    About, Actions, Env, EnvError, Episode, InfoChannel, Occasion, OptionAbout, OptionKind, Options, Space, Step, StreamName,
};
use crate::sim2real::Timestamp;

use super::driver::{Acted, Driver};
use super::error::MarketEnvError;
use super::features::FeatureSettings;
use super::setup::{MarketSetup, Ready};
use super::task::{Component, Outcome, Task};

/// Where an episode of a window begins.
const START: StreamName = StreamName::new("start");

/// How an episode ended, as the info channel `ended` tells it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Ended {
    /// It is under way.
    #[default]
    No,
    /// The task is done, or the portfolio is worth nothing.
    Done,
    /// It had as many steps as there are.
    Length,
    /// The data ended.
    Data,
    /// The broker had to close what the account could not carry.
    MarginCall,
}

/// What every market environment tells beside observation and reward; the task's own follow.
const TELLS: [(&str, &str); 11] = [
    ("equity", "currency"),
    ("cash", "currency"),
    ("fees", "currency"),
    ("orders", ""),
    ("fills", ""),
    ("refused", ""),
    ("halted", ""),
    ("time", "s"),
    ("events", ""),
    ("steps", ""),
    ("ended", ""),
];

/// The environment of a task: an episode is a backtest under way, of which each step goes on to the event at which the next is due.
///
/// It owns what it runs on, so that it can be held anywhere; the data are shared by all copies. A copy goes on with the same bits.
#[derive(Debug)]
pub struct MarketEnv<T: Task> {
    shared: Arc<Shared>,
    driver: Driver<T>,
    course: Option<Course>,
}

#[derive(Debug)]
struct Shared {
    about: About,
    ready: Ready,
    /// Components of observations that are the task's.
    own: usize,
}

/// An episode under way.
#[derive(Debug)]
struct Course {
    session: Session,
    backtest: Arc<Backtest>,
    drawn: Vec<f64>,
    from: Timestamp,
    event: Event,
    ended: Ended,
}

impl<T: Task> Clone for MarketEnv<T> {
    fn clone(&self) -> Self {
        let forked = |course: &Course| {
            Some(Course {
                session: course.session.fork()?,
                backtest: Arc::clone(&course.backtest),
                drawn: course.drawn.clone(),
                ..*course
            })
        };
        // Data are in memory, so that any session can be forked.
        let course = self.course.as_ref().and_then(forked);
        Self { shared: Arc::clone(&self.shared), driver: self.driver.clone(), course }
    }
}

impl<T: Task> MarketEnv<T> {
    /// The environment `id` of `task` in the market of `setup`, in which so many instruments are traded.
    ///
    /// # Errors
    /// What cannot be of the setup; a backtest of another number of instruments.
    pub fn new(id: &str, title: &str, setup: MarketSetup, task: T, instruments: usize) -> Result<Self, MarketEnvError> {
        let found = setup.backtest.instruments().len();
        if found != instruments {
            return Err(MarketEnvError::Instruments { task: instruments, found });
        }
        if setup.backtest.histories().iter().any(crate::market::History::is_empty) {
            return Err(MarketEnvError::Streamed);
        }
        let features = setup.features.clone();
        let ready = Ready::new(setup)?;
        let components = components(&task, &features, instruments);
        let own = task.components().len();
        let mut about = About::new(id, title, space(&components), Space::Box(task.actions()));
        about.reward_range = task.reward_range();
        about.max_steps = ready.length;
        let told = TELLS.iter().copied().chain(task.tells());
        about.info = told.map(|(name, unit)| InfoChannel::new(name, unit)).collect();
        about.privileged = ready.draws.as_ref().map(super::execution::Draws::channels).unwrap_or_default();
        about.options = vec![start_option()];
        let driver = Driver::new(task, ready.pacer(), Arc::clone(&ready.tables), ready.length);
        Ok(Self { shared: Arc::new(Shared { about, ready, own }), driver, course: None })
    }

    /// The same with options it was made with beside its own, so that it tells of them.
    #[must_use]
    pub fn with_options(mut self, options: Vec<OptionAbout>) -> Self {
        if let Some(shared) = Arc::get_mut(&mut self.shared) {
            shared.about.options.splice(0..0, options);
        }
        self
    }

    /// Mean volume of a row, or mean size displayed at the best prices, of the first instrument [units].
    #[must_use]
    pub fn mean_size(&self) -> f64 {
        self.shared.ready.tables.first().map_or(0.0, super::features::Features::mean_size)
    }

    /// The backtest that the episode under way is, with what was drawn for it, and since when its data count: from the beginning
    /// where that is [`Timestamp::MIN`].
    #[must_use]
    pub fn backtest(&self) -> Option<(&Arc<Backtest>, Timestamp)> {
        self.course.as_ref().map(|course| (&course.backtest, course.from))
    }

    /// A session of the episode under way before its first event: what a policy [does in a backtest](Self::acted) of it.
    ///
    /// # Errors
    /// As [`Backtest::run`]. None where no episode is under way.
    pub fn session(&self) -> Option<Result<Session, MarketEnvError>> {
        let Course { backtest, from, .. } = self.course.as_ref()?;
        let beginning = super::setup::Beginning { backtest: Arc::clone(backtest), drawn: Vec::new(), from: *from };
        Some(self.shared.ready.session(&beginning))
    }

    /// A policy as a strategy for the backtest of the episode under way: it is given observations, writes actions, and says whether it
    /// acts at all. None where no episode is under way.
    pub fn acted<P: FnMut(&[f32], &mut [f32]) -> bool + Send>(&self, policy: P) -> Option<Acted<T, P>> {
        let from = self.course.as_ref()?.from;
        let mut driver = self.driver.clone();
        driver.begin(self.driver.episode, self.shared.ready.pacer(), self.shared.ready.seen(from));
        let (observation, action) = (vec![0.0; driver.size()], vec![0.0; self.shared.about.action.size()]);
        Some(Acted { driver, policy, observation, action, own: self.shared.own })
    }

    /// All that the episode left so far: what is under way is booked as at the end of a run. None where no episode is under way.
    #[must_use]
    pub fn record(&self) -> Option<Result<Record, BacktestError>> {
        Some(self.course.as_ref()?.session.fork()?.finish())
    }

    /// The session of the episode under way.
    #[cfg(test)]
    pub(super) fn session_mut(&mut self) -> Option<&mut Session> {
        self.course.as_mut().map(|course| &mut course.session)
    }

    /// Events of the episode so far.
    #[must_use]
    pub fn events(&self) -> usize {
        self.course.as_ref().map_or(0, |course| course.session.events())
    }

    /// How the episode ended.
    #[must_use]
    pub fn ended(&self) -> Ended {
        self.course.as_ref().map_or(Ended::No, |course| course.ended)
    }

    fn begun(&mut self, episode: Episode, start: Option<usize>, observation: &mut [f32]) -> Result<Course, MarketEnvError> {
        let ready = &self.shared.ready;
        let draw = episode.stream(START).uniform();
        let beginning = ready.begin(episode, start, draw)?;
        let mut session = ready.session(&beginning)?;
        self.driver.begin(episode, ready.pacer(), ready.seen(beginning.from));
        let event = loop {
            match session.step(&mut self.driver)? {
                None => return Err(MarketEnvError::NothingDue),
                Some(event) if self.driver.due => break event,
                Some(_) => {}
            }
        };
        let view = session.seen(event)?;
        self.driver.observe(&view, self.shared.own, observation);
        let super::setup::Beginning { backtest, drawn, from } = beginning;
        Ok(Course { session, backtest, drawn, from, event, ended: Ended::No })
    }
}

impl<T: Task> Env for MarketEnv<T> {
    fn about(&self) -> &About {
        &self.shared.about
    }

    fn reset(&mut self, episode: Episode, options: &Options, observation: &mut [f32]) -> Result<(), EnvError> {
        let about = &self.shared.about;
        options.check(&about.id, &about.options, Occasion::Reset)?;
        let start = options.number(&about.options, "start")?;
        let start = (start >= 0.0).then_some(start as usize);
        // As it was, should the next episode not begin.
        let before = self.driver.clone();
        match self.begun(episode, start, observation) {
            Ok(mut course) => {
                if let Some(over) = &mut self.course {
                    course.session.reuse(&mut over.session);
                }
                self.course = Some(course);
                Ok(())
            }
            Err(error) => {
                self.driver = before;
                Err(error.into())
            }
        }
    }

    #[inline]
    fn step(&mut self, action: Actions<'_>, observation: &mut [f32]) -> Result<Step, EnvError> {
        let (driver, own) = (&mut self.driver, self.shared.own);
        let Some(course) = &mut self.course else { return Err(EnvError::NotReset { lane: 0 }) };
        course.step(driver, action.continuous(), own, observation).map_err(|error| {
            // A run that cannot go on has no state to go on from.
            self.course = None;
            MarketEnvError::from(error).into()
        })
    }

    fn info(&self, channel: usize) -> f64 {
        let Some(course) = &self.course else { return f64::NAN };
        match channel.checked_sub(TELLS.len()) {
            Some(own) => self.driver.task.told(own),
            None => course.tell(channel, self.driver.steps),
        }
    }

    fn privileged(&self, parameter: usize) -> f64 {
        let Some(course) = &self.course else { return f64::NAN };
        let drawn = course.session.redrawn().unwrap_or(&course.drawn);
        drawn.get(parameter).copied().unwrap_or(f64::NAN)
    }
}

impl Course {
    #[inline]
    fn step<T: Task>(
        &mut self,
        driver: &mut Driver<T>,
        action: &[f32],
        own: usize,
        observation: &mut [f32],
    ) -> Result<Step, BacktestError> {
        let mut event = self.event;
        let equity = self.session.hear(event, |view, orders| driver.act(view, orders, action))?;
        self.session.send_on(event.time, equity, driver)?;
        let mut ended = false;
        loop {
            match self.session.step(driver)? {
                Some(next) => event = next,
                None => ended = true,
            }
            if driver.due || ended {
                break;
            }
        }
        self.event = event;
        let over = ended || self.session.is_over();
        let view = self
            .session
            .seen(event)
            .map_err(|error| BacktestError::Money { place: format!("the account at {}", event.time), error })?;
        let blotter = self.session.blotter();
        let task = &mut driver.task;
        let Outcome { reward, done } = if over { task.cut_off(&view, blotter) } else { task.settle(&view, blotter) };
        driver.observe(&view, own, observation);
        let last = driver.most.is_some_and(|most| driver.steps >= most);
        self.ended = match () {
            () if self.session.margin_calls() > 0 => Ended::MarginCall,
            () if done => Ended::Done,
            () if last => Ended::Length,
            () if over => Ended::Data,
            () => Ended::No,
        };
        let terminated = matches!(self.ended, Ended::Done | Ended::MarginCall);
        Ok(Step { reward, terminated, truncated: !terminated && self.ended != Ended::No })
    }

    /// The value of an info channel that every market environment has.
    fn tell(&self, channel: usize, steps: u32) -> f64 {
        let blotter = self.session.blotter();
        match channel {
            3 => blotter.orders.len() as f64,
            4 => blotter.fills.len() as f64,
            5 => blotter.rejected.values().sum::<usize>() as f64,
            7 => self.event.time.0 as f64 / Timestamp::NANOS as f64,
            8 => self.session.events() as f64,
            9 => f64::from(steps),
            10 => f64::from(self.ended as u8),
            _ => self.tell_of_account(channel),
        }
    }

    /// The same of those for which the account is looked at, which takes longer.
    fn tell_of_account(&self, channel: usize) -> f64 {
        let Ok(view) = self.session.seen(self.event) else { return f64::NAN };
        match channel {
            0 => view.equity().to_f64(),
            1 => view.cash().to_f64(),
            2 => super::portfolio::fees(&view),
            _ => (0..view.instruments().len()).filter(|k| view.halt(*k).is_some()).count() as f64,
        }
    }
}

fn start_option() -> OptionAbout {
    let kind = OptionKind::Number { nominal: -1.0, lower: -1.0, upper: 1e15 };
    let meaning = "row of the first instrument's data at which an episode of a given length begins; below 0 it is drawn";
    OptionAbout::new(Occasion::Reset, "start", "rows", kind, meaning)
}

/// All components of observations, in their order.
fn components<T: Task>(task: &T, features: &FeatureSettings, instruments: usize) -> Vec<Component> {
    let mut all = task.components();
    all.push(("time_left".into(), "", 0.0, 1.0));
    for k in 0..instruments {
        let name = |name: String| if instruments > 1 { format!("{name}@{k}") } else { name };
        all.extend(features.components().into_iter().map(|(own, unit, low, high)| (name(own), unit, low, high)));
    }
    all
}

fn space(components: &[Component]) -> crate::rl::BoxSpace {
    let rows: Vec<(&str, &str, f32, f32)> = components.iter().map(|c| (c.0.as_str(), c.1, c.2, c.3)).collect();
    crate::rl::BoxSpace::of(&rows)
}
