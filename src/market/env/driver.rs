//! A task in a session: when its steps are due, and how many rows of each instrument are known.

use std::sync::Arc;

use crate::market::{EventKind, Orders, Strategy, View};
use crate::rl::Episode;

use super::features::Features;
use super::pace::Pacer;
use super::task::Task;

/// What is the same in an environment and in a backtest of what is done in it.
#[derive(Debug, Clone)]
pub(super) struct Driver<T> {
    pub task: T,
    pub episode: Episode,
    pacer: Pacer,
    tables: Arc<Vec<Features>>,
    /// Rows known of each instrument.
    seen: Vec<usize>,
    kinds: Vec<EventKind>,
    /// Steps taken, and how many there are at most.
    pub steps: u32,
    pub most: Option<u32>,
    /// Whether somebody is to decide at the event that was seen last.
    pub due: bool,
    begun: bool,
}

impl<T: Task> Driver<T> {
    pub fn new(task: T, pacer: Pacer, tables: Arc<Vec<Features>>, most: Option<u32>) -> Self {
        let kinds: Vec<EventKind> = tables.iter().map(Features::kind).collect();
        let seen = vec![0; kinds.len()];
        Self { task, episode: Episode::default(), pacer, tables, seen, kinds, steps: 0, most, due: false, begun: false }
    }

    /// Begins an episode, of whose rows so many were known before.
    pub fn begin(&mut self, episode: Episode, pacer: Pacer, seen: impl Iterator<Item = usize>) {
        (self.episode, self.pacer, self.steps, self.due, self.begun) = (episode, pacer, 0, false, false);
        self.seen.iter_mut().zip(seen).for_each(|(own, seen)| *own = seen);
    }

    /// Size of an observation.
    pub fn size(&self) -> usize {
        self.task.components().len() + 1 + self.tables.iter().map(Features::width).sum::<usize>()
    }

    /// Asks for what an action says.
    #[inline]
    pub fn act(&mut self, view: &View<'_>, orders: &mut Orders, action: &[f32]) {
        self.steps += 1;
        let last = self.most.is_some_and(|most| self.steps >= most);
        self.task.act(view, orders, action, last);
    }

    /// Part of the episode that is left, 1 where nobody knows.
    fn left(&self) -> f64 {
        self.most.map_or(1.0, |most| 1.0 - f64::from(self.steps.min(most)) / f64::from(most.max(1)))
    }

    /// Writes what is observed: what the task says of itself, the part of the episode that is left, and the market of each
    /// instrument.
    #[inline]
    pub fn observe(&self, view: &View<'_>, own: usize, into: &mut [f32]) {
        let (task, rest) = into.split_at_mut(own);
        self.task.observe(view, task);
        let Some((left, mut rest)) = rest.split_first_mut() else { return };
        *left = self.left() as f32;
        for (table, seen) in self.tables.iter().zip(&self.seen) {
            let (one, others) = rest.split_at_mut(table.width());
            table.write(*seen, one);
            rest = others;
        }
    }
}

impl<T: Task> Strategy for Driver<T> {
    fn name(&self) -> &str {
        "environment"
    }

    fn lookback(&self) -> usize {
        1
    }

    #[inline]
    fn on_event(&mut self, view: &View<'_>, orders: &mut Orders) {
        let event = view.event();
        if self.kinds.get(event.instrument) == Some(&event.kind) {
            self.seen[event.instrument] += 1;
        }
        if self.begun {
            self.task.watch(view, orders);
        }
        self.due = self.pacer.sees(view, orders) && !self.task.goes_on_alone();
        if self.due && !self.begun {
            self.begun = true;
            self.task.begin(self.episode, view);
        }
    }
}

/// A policy as a strategy: what is done in an environment, done in a backtest, with the same observations, orders and fills to the
/// last bit.
pub struct Acted<T, P> {
    pub(super) driver: Driver<T>,
    pub(super) policy: P,
    pub(super) observation: Vec<f32>,
    pub(super) action: Vec<f32>,
    pub(super) own: usize,
}

impl<T, P> std::fmt::Debug for Acted<T, P> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Acted").finish_non_exhaustive()
    }
}

impl<T: Task, P: FnMut(&[f32], &mut [f32]) -> bool + Send> Strategy for Acted<T, P> {
    fn name(&self) -> &str {
        "policy"
    }

    fn lookback(&self) -> usize {
        self.driver.lookback()
    }

    fn on_event(&mut self, view: &View<'_>, orders: &mut Orders) {
        self.driver.on_event(view, orders);
        if !self.driver.due || self.driver.most.is_some_and(|most| self.driver.steps >= most) {
            return;
        }
        self.driver.observe(view, self.own, &mut self.observation);
        if (self.policy)(&self.observation, &mut self.action) {
            self.driver.act(view, orders, &self.action);
        }
    }
}
