//! The trading floor: a day of the tape, and the client's orders as they meet it.

use super::case::{Assumed, World};
use super::client::Intent;
use super::climate::TICK;
use super::effect::{Effect, Foreign, Way};
use super::executed::{Execution, Outcome, Piece, Print, Shown, Sizes};
use super::resting::{Resting, Waiting};
use super::tape::{LEVELS, Row, Tape};
use super::wake::{Kernel, Wake};

/// A day before it is traded: all that does not depend on what is concealed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scene<'a> {
    pub tape: &'a Tape,
    pub orders: &'a [Intent],
    pub world: World,
    /// What the venue fills at, where nothing is concealed.
    pub price: Assumed,
    /// Levels of the book that are displayed.
    pub levels: usize,
    /// Usual size of the best level [units].
    pub usual: f64,
    /// The size by which sizes are measured [units].
    pub middle: f64,
    /// Standard deviation of the noise [bps].
    pub noise: f64,
}

/// The shortest way to an exchange whose tape shows the orders, and how much it varies [s].
const WAY: (f64, f64) = (1e-4, 1e-4);
/// An order that is held up on its way takes so much longer, and how often that happens.
const HELD_UP: (f64, f64) = (4.0, 0.04);

/// The floor while the day lasts.
pub(super) struct Floor<'a> {
    pub scene: Scene<'a>,
    effects: &'a [Effect],
    wakes: Vec<Wake>,
    now: Shown,
    past: Vec<Shown>,
    turnover: f64,
    waiting: Waiting,
    outcome: Outcome,
}

/// What happens next.
enum Event {
    Row(usize),
    Trade(usize),
    Decision(usize),
    Arrival(usize),
}

impl<'a> Scene<'a> {
    /// The day with `effects` at work.
    pub fn with(self, effects: &'a [Effect]) -> Outcome {
        let first = Shown { time: 0.0, row: 0, bid: 0, ask: 0 };
        let kernels = effects.iter().filter_map(kernel);
        let mut floor = Floor {
            scene: self,
            effects,
            wakes: kernels.map(|kernel| Wake::new(&kernel)).collect(),
            now: first,
            past: Vec::new(),
            turnover: 0.0,
            waiting: Waiting::new(effects),
            outcome: Outcome::default(),
        };
        floor.trade();
        floor.outcome
    }
}

/// How an effect displaces the price, where it does.
fn kernel(effect: &Effect) -> Option<Kernel> {
    match effect {
        Effect::Displacement { kernel, .. } => Some(kernel.clone()),
        Effect::Toxic { time, .. } | Effect::Foreign(Foreign::Followers { time, .. }) => Some(Kernel::growing(*time)),
        _ => None,
    }
}

impl Floor<'_> {
    fn trade(&mut self) {
        let mut arrivals: Vec<(f64, usize)> =
            self.scene.orders.iter().enumerate().map(|(k, order)| (order.time + self.way(order), k)).collect();
        arrivals.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (mut row, mut trade, mut decision, mut arrival) = (0, 0, 0, 0);
        let (rows, trades) = (&self.scene.tape.rows, &self.scene.tape.trades);
        loop {
            let next = [
                rows.get(row).map(|row| row.time),
                trades.get(trade).map(|trade| trade.time),
                self.scene.orders.get(decision).map(|order| order.time),
                arrivals.get(arrival).filter(|(_, order)| *order < decision).map(|(time, _)| *time),
            ];
            let soonest = (0..next.len()).filter_map(|k| Some((next[k]?, k))).min_by(|a, b| a.0.total_cmp(&b.0));
            let Some((time, which)) = soonest else { return };
            let (event, place) = match which {
                0 => (Event::Row(row), &mut row),
                1 => (Event::Trade(trade), &mut trade),
                2 => (Event::Decision(decision), &mut decision),
                _ => (Event::Arrival(arrivals[arrival].1), &mut arrival),
            };
            *place += 1;
            self.happens(time, &event);
        }
    }

    fn happens(&mut self, time: f64, event: &Event) {
        match event {
            Event::Row(row) => {
                self.show(time, *row);
                let filled = self.waiting.crossed(time, &self.now);
                self.filled_at_rest(filled);
            }
            Event::Trade(trade) => {
                let trade = &self.scene.tape.trades[*trade];
                let price = self.now.touch(trade.bought) as f64;
                self.outcome.prints.push(Print { time, price, size: trade.size, bought: trade.bought });
                let filled = self.waiting.traded(time, price, trade);
                self.filled_at_rest(filled);
            }
            Event::Decision(order) => {
                let order = &self.scene.orders[*order];
                let aged = self.effects.iter().find_map(|effect| match effect {
                    Effect::Age { seconds } => Some(*seconds),
                    _ => None,
                });
                let seen = aged.map_or(self.now, |age| self.shown_at(order.time - age));
                let execution = Execution {
                    decided: self.now,
                    seen,
                    met: self.now,
                    arrived: time,
                    pieces: Vec::new(),
                    fee: 0.0,
                    kick: 0.0,
                };
                self.outcome.executions.push(execution);
            }
            Event::Arrival(order) => self.arrive(time, *order),
        }
    }

    fn way(&self, order: &Intent) -> f64 {
        let shortest = match self.scene.world {
            World::Live => WAY.0 + WAY.1 * order.dice[0],
            World::Paper => 0.0,
        };
        let found = self.effects.iter().find_map(|effect| match effect {
            Effect::Latency { seconds, way } => Some((*seconds, *way)),
            _ => None,
        });
        let Some((seconds, way)) = found else { return shortest };
        let drawn = match way {
            Way::Lognormal(width) => (width * order.normals[0]).exp(),
            // Two exponentials have a median of 1.678 times the mean of one.
            Way::Twofold => -((1.0 - order.dice[1]).ln() + (1.0 - order.dice[2]).ln()) / 1.678,
        };
        let held_up = if order.dice[3] < HELD_UP.1 { HELD_UP.0 } else { 1.0 };
        shortest + seconds * drawn * held_up
    }

    /// The book as row `row` of the tape has it, moved as trades have moved it.
    fn show(&mut self, time: f64, row: usize) {
        let displaced: f64 = match self.scene.world {
            World::Live => self.wakes.iter_mut().map(|wake| wake.at(time)).sum(),
            World::Paper => 0.0,
        };
        let Row { price, spread, .. } = self.scene.tape.rows[row];
        let middle = price * (1.0 + 1e-4 * displaced) / TICK;
        let bid = (middle - 0.5 * spread as f64).round() as i64;
        self.now = Shown { time, row, bid: bid.max(1), ask: bid.max(1) + spread };
        self.past.push(self.now);
        self.outcome.shown.push(self.now);
    }

    fn shown_at(&self, time: f64) -> Shown {
        let known = self.past.partition_point(|shown| shown.time <= time);
        self.past.get(known.saturating_sub(1)).copied().unwrap_or(self.now)
    }

    /// Sizes an order that buys, or sells, would take from.
    pub fn sizes(&self, shown: &Shown, buys: bool) -> Sizes {
        sizes(&self.scene.tape.rows[shown.row], buys, self.scene.usual)
    }

    fn arrive(&mut self, time: f64, number: usize) {
        let order = &self.scene.orders[number];
        self.outcome.executions[number].met = self.now;
        self.outcome.executions[number].arrived = time;
        if let Some(patience) = order.rests {
            let limit = self.outcome.executions[number].decided.touch(!order.buys);
            let displayed = if limit == self.now.touch(!order.buys) { self.sizes(&self.now, !order.buys)[0] } else { 0.0 };
            self.waiting.join(Resting::new(number, order, limit, displayed, time + patience));
            return;
        }
        let left: f64 = self.wakes.iter_mut().map(|wake| wake.at(time)).sum();
        let granted = self.granted(time, order);
        if granted < 1.0 {
            return;
        }
        let taken = self.taken(time, order, granted, left);
        let kick = self.kicked(order, granted, true);
        let execution = &mut self.outcome.executions[number];
        execution.pieces = taken;
        execution.kick = kick.iter().sum();
        self.wakes.iter_mut().zip(kick).for_each(|(wake, kick)| wake.kick(order.sign() * kick));
        let price = self.outcome.executions[number].price().unwrap_or_default() * TICK;
        self.outcome.executions[number].fee = self.charged(granted, price);
        if self.scene.world == World::Live {
            for piece in &self.outcome.executions[number].pieces {
                let (price, size) = (piece.price, piece.quantity);
                self.outcome.prints.push(Print { time, price, size, bought: order.buys });
            }
            self.show(time, self.now.row);
        }
    }

    /// By how much `order` displaces the price, its own way, by each wake, where it takes, or rests and gives, `quantity` [bps].
    fn kicked(&self, order: &Intent, quantity: f64, takes: bool) -> Vec<f64> {
        let size = quantity / self.scene.middle;
        let kick = |effect: &Effect| match effect {
            Effect::Displacement { bps, power, .. } => Some(if takes { bps * size.powf(*power) } else { 0.0 }),
            Effect::Foreign(Foreign::Followers { bps, .. }) => Some(*bps),
            Effect::Toxic { bps, .. } => Some(if takes { 0.0 } else { -bps * (0.5 - order.dice[1].ln() / 2.0).min(3.0) }),
            _ => None,
        };
        self.effects.iter().filter_map(kick).collect()
    }

    /// What an order pays beside its reference, the walk left out [bps]; in a market that does not react with what earlier orders
    /// have `left`.
    fn conceded(&self, time: f64, order: &Intent, quantity: f64, left: f64) -> f64 {
        let shown = &self.now;
        let half_spread = 0.5 * (shown.ask - shown.bid) as f64 / shown.mid() * 1e4;
        let size = quantity / self.scene.middle;
        let one = |effect: &Effect| match effect {
            Effect::Spread { fraction } => {
                // To half ticks, by chance up or down.
                let half_ticks = fraction * (shown.ask - shown.bid) as f64;
                let rounded = (half_ticks + order.dice[2]).floor();
                half_spread * rounded / (shown.ask - shown.bid) as f64
            }
            Effect::Impact { bps, growth } => bps * growth.at(size),
            Effect::Slippage { fraction } => fraction * self.scene.tape.realized(time) * 1e4,
            Effect::Foreign(foreign) => foreign.cost(time, order, shown, &self.scene),
            _ => 0.0,
        };
        let own: f64 = match self.scene.world {
            World::Live => 0.0,
            World::Paper => order.sign() * left + 0.5 * self.kicked(order, quantity, true).iter().sum::<f64>(),
        };
        own + self.scene.noise * order.noise + self.effects.iter().map(one).sum::<f64>()
    }

    /// How much of `order` is granted: after refusals, caps and lots [units].
    fn granted(&self, time: f64, order: &Intent) -> f64 {
        let mut quantity = order.quantity;
        for effect in self.effects {
            match effect {
                Effect::Cap { fraction, wobble } => {
                    let displayed: f64 = self.sizes(&self.now, order.buys)[..self.scene.levels].iter().sum();
                    quantity = quantity.min((fraction * displayed * (wobble * order.normals[1]).exp()).floor());
                }
                Effect::Foreign(foreign) if foreign.refuses(time, order, &self.scene) => quantity = 0.0,
                _ => {}
            }
        }
        let lots = self.effects.iter().filter_map(|effect| match effect {
            Effect::Lots { lot } => Some(*lot),
            _ => None,
        });
        lots.fold(quantity, |quantity, lot| (quantity / lot + 1e-9).floor() * lot)
    }

    /// The pieces in which an order that takes is filled over `quantity` [units].
    fn taken(&self, time: f64, order: &Intent, quantity: f64, left: f64) -> Vec<Piece> {
        let shown = &self.now;
        let reference = match self.scene.price {
            Assumed::Touch => shown.touch(order.buys) as f64,
            Assumed::Mid => shown.mid(),
        };
        let conceded = self.conceded(time, order, quantity, left);
        let base = Piece { time, quantity, price: reference + order.sign() * 1e-4 * conceded * shown.mid() };
        let hidden = self.effects.iter().find_map(|effect| match effect {
            Effect::Walk { hidden, .. } => Some(*hidden),
            _ => None,
        });
        hidden.map_or_else(|| vec![base], |hidden| self.walked(order, base, hidden))
    }

    /// The pieces of `whole`, level after level, of which each hides up to so much beside what it shows.
    fn walked(&self, order: &Intent, whole: Piece, hidden: f64) -> Vec<Piece> {
        const FURTHEST: usize = 4 * LEVELS;
        let sizes = self.sizes(&self.now, order.buys);
        let steps = self.scene.tape.rows[self.now.row].steps;
        let (mut left, mut pieces) = (whole.quantity, Vec::new());
        for level in 0..FURTHEST {
            // Behind what is displayed the book goes on as its last level does.
            let displayed = sizes[level.min(LEVELS - 1)];
            let there = displayed * (1.0 - hidden * (1.0 - order.dice[level % 4]).ln());
            let quantity = if level + 1 == FURTHEST { left } else { left.min(there.ceil()) };
            let step = steps[level.min(LEVELS - 1)] + level.saturating_sub(LEVELS - 1) as i64 * steps[1];
            pieces.push(Piece { quantity, price: whole.price + order.sign() * step as f64, ..whole });
            left -= quantity;
            if left <= 0.0 {
                break;
            }
        }
        pieces
    }

    /// What is charged for `quantity` [units] at `price` [currency], to the cent.
    fn charged(&mut self, quantity: f64, price: f64) -> f64 {
        let before = self.turnover;
        self.turnover += quantity * price;
        let one = |effect: &Effect| match effect {
            Effect::Fee(fee) => fee.of(quantity, price),
            Effect::Foreign(Foreign::Turnover { bps }) => {
                let days = before / (self.scene.middle * price * self.scene.orders.len() as f64);
                1e-4 * bps * quantity * price * 0.5_f64.powi((days * 2.0).floor().min(3.0) as i32)
            }
            _ => 0.0,
        };
        let fee: f64 = self.effects.iter().map(one).sum();
        (100.0 * fee).round() / 100.0
    }

    fn filled_at_rest(&mut self, filled: Vec<(usize, Piece)>) {
        for (number, piece) in filled {
            let order = &self.scene.orders[number];
            let fee = self.charged(piece.quantity, piece.price * TICK);
            let part = piece.quantity / order.quantity;
            let kick = self.kicked(order, order.quantity, false);
            for (wake, kick) in self.wakes.iter_mut().zip(kick) {
                wake.at(piece.time);
                wake.kick(order.sign() * kick * part);
                self.outcome.executions[number].kick += kick * part;
            }
            self.outcome.executions[number].fee += fee;
            self.outcome.executions[number].pieces.push(piece);
        }
    }
}

/// Sizes displayed to those who buy, or sell [units].
pub(super) fn sizes(row: &Row, buys: bool, usual: f64) -> Sizes {
    let side = if buys { row.asks } else { row.bids };
    side.map(|size| (size * usual).round().max(1.0))
}
