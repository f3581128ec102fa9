//! `execution`: the plant an order meets. As it stands it fills every order whole at the price the twin assumes; what
//! that leaves out are mechanisms.

use crate::sim2real::{Channel, Clock, Dynamics, Observation, Parameter, Plant, Recording, Thetas, Tick, Typical};

use super::{Book, InFlight, OrderLog};

/// What an arriving order meets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Met {
    /// The book it finds.
    pub book: Book,
    /// The price the twin assumes, as it stands when the order arrives [currency].
    pub reference: f64,
    /// Volume it can take part in [units]; infinite where the data do not know it.
    pub volume: f64,
}

/// What mechanisms add to an execution; the default adds nothing.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ExecutionEffect {
    /// By how much the price is worse than the reference [currency]; negative where it is better.
    pub concession: f64,
}

/// What is reported of an order.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Report {
    /// Average price [currency].
    pub price: f64,
    /// Quantity filled [units].
    pub quantity: f64,
    /// Fee [currency].
    pub fee: f64,
    /// Cost against the assumed price, a positive number being a loss [bps of the mid at decision].
    pub cost: f64,
    /// Part of the order that was filled, from 0 to 1.
    pub filled: f64,
}

impl Observation for Report {
    fn channel(&self, k: usize) -> f64 {
        match k {
            0 => self.cost,
            1 if self.price * self.quantity > 0.0 => self.fee / (self.price * self.quantity) * 1e4,
            1 => 0.0,
            _ => self.filled,
        }
    }
}

/// The plant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Execution;

impl Plant for Execution {
    type Command = InFlight;
    type Input = Met;
    type State = Report;
    type Effect = ExecutionEffect;
    type Observation = Report;
    type Dynamics = Self;
    type Stimulus = OrderLog;

    fn name(&self) -> &'static str {
        "execution"
    }

    fn clock(&self) -> Clock {
        Clock::Event
    }

    fn channels(&self) -> &'static [Channel] {
        &[Channel { name: "cost", unit: "bps" }, Channel { name: "fee", unit: "bps" }, Channel { name: "filled", unit: "" }]
    }

    fn parameters(&self) -> Vec<Parameter> {
        Vec::new()
    }

    fn typical(&self, _recordings: &[Recording<OrderLog>]) -> Typical {
        Typical::default()
    }

    fn initial_parameters(&self, _recording: &Recording<OrderLog>, _row: usize) -> Vec<Parameter> {
        Vec::new()
    }

    fn dynamics(&self, _thetas: &Thetas) -> Self {
        *self
    }
}

impl Dynamics<Execution> for Execution {
    fn initial(&self, initial: &Thetas) -> Vec<Report> {
        vec![Report::default(); initial.lanes()]
    }

    fn advance(&self, _tick: Tick, reports: &mut [Report], met: &[Met], orders: &[InFlight], effects: &[ExecutionEffect]) {
        for (((report, met), order), effect) in reports.iter_mut().zip(met).zip(orders).zip(effects) {
            let price = met.reference + order.side.sign() * effect.concession;
            let quantity = order.quantity.min(order.participation_limit * met.volume);
            *report = Report {
                price,
                quantity,
                fee: 0.0,
                cost: order.side.sign() * (price - order.assumed) / order.mid * 1e4,
                filled: quantity / order.quantity,
            };
        }
    }

    fn observe(&self, states: &[Report], observations: &mut [Report]) {
        observations.copy_from_slice(states);
    }
}
