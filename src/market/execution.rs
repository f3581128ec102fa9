//! `execution`: the plant an order meets. As it stands it fills every order whole at the price the twin assumes; what
//! that leaves out are mechanisms.

use crate::sim2real::{
    Channel, Clock, Covariate, Dynamics, Observation, Parameter, Plant, Recording, Site, Thetas, Tick, Timestamp, Typical,
};

use super::foresight::{self, Foresight};
use super::{Book, InFlight, OrderLog, Role, ShownDelay, Side, following};

/// What an arriving order meets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Met {
    /// The book it finds.
    pub book: Book,
    /// The price the twin assumes, as it stands when the order arrives [currency].
    pub reference: f64,
    /// Volume it can take part in [units]; infinite where the data do not know it.
    pub volume: f64,
    /// What is displayed where it joins a queue [units]: 0 where it does not, infinite where the data do not know it.
    pub displayed: f64,
    /// The mid that had been seen when it was decided, above what the mid was then [bps of it].
    pub seen: f64,
    /// Whether what the market shows has been moved by own orders already.
    pub shows_own: bool,
    /// By how much the mid moves of itself between the last look and this one, a standard deviation [bps]; infinite where
    /// nobody looks.
    pub scatter: f64,
}

impl Met {
    /// What an order meets that joins no queue, in a market that does not know of it.
    #[must_use]
    pub fn at(book: Book, reference: f64, volume: f64) -> Self {
        Self { book, reference, volume, displayed: 0.0, seen: 0.0, shows_own: false, scatter: f64::INFINITY }
    }
}

/// What mechanisms add to an execution; the default adds nothing.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ExecutionEffect {
    /// By how much the price is worse than the reference [currency]; negative where it is better. What earlier orders have
    /// moved is told apart, as `displaced`.
    pub concession: f64,
    /// Orders are filled in whole multiples of it [units]; 0 where any quantity can be filled.
    pub lot: f64,
    /// What stands ahead of an order that joins a queue beside what is displayed [units].
    pub ahead: f64,
    /// By how much earlier orders of one's own have moved the market up [currency].
    pub displaced: f64,
}

impl ExecutionEffect {
    /// By how much `order`, which takes or rests in the market it has `met`, does worse than the reference [currency]: an order
    /// that takes pays what earlier ones have moved, unless the market shows it.
    #[must_use]
    pub fn paid(&self, order: &InFlight, met: &Met) -> f64 {
        let unseen = order.takes() && !met.shows_own;
        if unseen { self.concession + order.side.sign() * self.displaced } else { self.concession }
    }
}

/// What is reported of an order, or of a position that is held.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Report {
    /// As what the order met the market.
    pub role: Role,
    /// Which way it trades; of a position, `Buy` where it is long.
    pub side: Side,
    /// When it was decided; of a position, when it was charged last.
    pub since: Timestamp,
    /// When it arrived.
    pub until: Timestamp,
    /// Average price [currency].
    pub price: f64,
    /// Quantity filled [units].
    pub quantity: f64,
    /// Units of the underlying in one unit traded.
    pub multiplier: f64,
    /// Fee [currency].
    pub fee: f64,
    /// Cost against the assumed price, a positive number being a loss [bps of the mid at decision].
    pub cost: f64,
    /// Part of the order that was filled, from 0 to 1.
    pub filled: f64,
    /// The mid that had been seen when it was decided, above what the mid was then [bps of it].
    pub seen: f64,
    /// What the mid has done between the last look at it and this one, in standard deviations of what it does of itself.
    pub mid: f64,
    /// What stood ahead of it beside what was displayed where it joined a queue, as a part of that.
    pub ahead: f64,
}

impl Default for Report {
    /// Nothing has happened yet.
    fn default() -> Self {
        Self {
            role: Role::default(),
            side: Side::Buy,
            since: Timestamp::default(),
            until: Timestamp::default(),
            price: 0.0,
            quantity: 0.0,
            multiplier: 1.0,
            fee: 0.0,
            cost: 0.0,
            filled: 0.0,
            seen: 0.0,
            mid: 0.0,
            ahead: 0.0,
        }
    }
}

impl Report {
    /// What is reported of `order` where `quantity` [units] of it is filled, or held, at `price` [currency], without a fee.
    #[must_use]
    pub fn of(order: &InFlight, price: f64, quantity: f64) -> Self {
        Self {
            role: order.role,
            side: order.side,
            since: order.decided_at,
            until: order.arrives_at,
            price,
            quantity,
            multiplier: order.multiplier,
            fee: 0.0,
            cost: cost_bps(order.side, price, order.assumed, order.mid),
            filled: quantity / order.quantity,
            seen: 0.0,
            mid: 0.0,
            ahead: 0.0,
        }
    }

    /// From decision to arrival; of a position, the time it is charged for [s].
    #[must_use]
    pub fn held_for(&self) -> f64 {
        self.until.seconds_since(self.since).max(0.0)
    }

    /// Whether it tells of a trade, and not of a position that is held or of a look at the market.
    #[must_use]
    pub fn trades(&self) -> bool {
        matches!(self.role, Role::Taker | Role::Maker)
    }

    /// What changed hands, or is held, multiplier included [currency].
    #[must_use]
    pub fn notional(&self) -> f64 {
        self.price * self.quantity * self.multiplier
    }
}

/// Cost of an order of `side` that filled at `price` although `assumed` was expected [bps of `mid`]; a loss is positive.
#[must_use]
pub fn cost_bps(side: Side, price: f64, assumed: f64, mid: f64) -> f64 {
    side.sign() * (price - assumed) / mid * 1e4
}

/// A fee [currency] as a part of the notional it was paid on [bps]; none where nothing was traded.
#[must_use]
pub fn fee_bps(fee: f64, notional: f64) -> Option<f64> {
    (notional > 0.0).then(|| fee / notional * 1e4)
}

impl Observation for Report {
    fn channel(&self, k: usize) -> f64 {
        match k {
            0 => self.cost,
            1 => fee_bps(self.fee, self.notional()).unwrap_or(0.0),
            2 => self.filled,
            3 => self.seen,
            4 => self.mid,
            _ => self.ahead,
        }
    }
}

/// The plant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Execution;

/// What is seen of an order: cost against the assumed price, fee, part filled, the mid it was decided on, and its place in a queue;
/// and what is seen of the market between orders: the mid.
static CHANNELS: &[Channel] = &[
    Channel::new("cost", "bps"),
    Channel::new("fee", "bps").exact(),
    Channel::new("filled", "").exact(),
    Channel::new("seen", "bps"),
    Channel::new("mid", "sd"),
    Channel::new("ahead", ""),
];

/// An execution under way: the last report, and what the mid is on its way to.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Executed {
    /// The last report.
    pub report: Report,
    /// What orders foresaw, and what the mid has done since it was looked at last.
    pub foresight: Foresight,
}

impl Plant for Execution {
    type Command = InFlight;
    type Input = Met;
    type State = Executed;
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

    fn channels(&self) -> &[Channel] {
        CHANNELS
    }

    fn parameters(&self) -> Vec<Parameter> {
        Vec::new()
    }

    fn typical(&self, recordings: &[Recording<OrderLog>]) -> Typical {
        let orders = || recordings.iter().flat_map(|recording| recording.stimulus.orders());
        let costs: Vec<f64> = recordings
            .iter()
            .filter_map(|recording| recording.channel("cost"))
            .flat_map(|cost| cost.samples.iter().flatten().copied())
            .collect();
        let delays = || recordings.iter().filter_map(|recording| recording.stimulus.shown_delay());
        let size = |values: Vec<f64>| median(values).filter(|v| *v > 0.0).unwrap_or(1.0);
        let mean = costs.iter().sum::<f64>() / costs.len().max(1) as f64;
        let spread = (costs.iter().map(|c| (c - mean).powi(2)).sum::<f64>() / costs.len().max(1) as f64).sqrt();
        Typical {
            command: size(orders().map(|order| order.quantity).collect()),
            effort: size(costs.iter().map(|cost| cost.abs()).collect()),
            output: if spread > 0.0 { spread } else { 1.0 },
            quantum: recordings.iter().filter_map(|recording| recording.stimulus.quantum()).reduce(f64::min),
            delay: median(delays().filter_map(ShownDelay::constant).collect()),
            delays: usual(delays().map(ShownDelay::estimate)),
            duration: recordings
                .iter()
                .filter_map(|recording| Some(recording.time.last()? - recording.time.first()?))
                .fold(0.0, f64::max),
            age: median(recordings.iter().filter_map(|recording| recording.stimulus.shown_age()).collect()),
            ..Typical::default()
        }
    }

    /// What orders foresaw is a matter of who sent them: it belongs to a recording, as the state does from which a motion starts.
    fn initial_parameters(&self, recording: &Recording<OrderLog>, _row: usize) -> Vec<Parameter> {
        if recording.stimulus.looks() == 0 {
            return Vec::new();
        }
        foresight::NAMES.iter().map(|name| Parameter::new(name, "bps", 0.0)).collect()
    }

    fn resolution(&self, recording: &Recording<OrderLog>, channel: &str) -> f64 {
        Self::resolution_of(recording, channel)
    }

    fn sent(&self, recording: &Recording<OrderLog>) -> usize {
        recording.stimulus.sent()
    }

    /// What costs scatter by, where prices are told finer than in ticks; but of no more than a price that is rounded to its tick.
    fn scatter(&self, recording: &Recording<OrderLog>, channel: &str) -> f64 {
        let own = recording.stimulus.cost_scatter().filter(|_| channel == "cost");
        own.map_or(0.0, |scatter| scatter.min(Self::of_ticks(recording)))
    }

    fn covariates(&self, recording: &Recording<OrderLog>) -> Vec<Covariate> {
        super::covariate::covariates(recording)
    }

    /// Laws act against an order, and the same on purchases and on sales.
    fn no_law_knows(&self, covariate: &str) -> bool {
        covariate == super::covariate::SIDE
    }

    fn notes(&self, recording: &Recording<OrderLog>) -> Vec<String> {
        recording.stimulus.notes().to_vec()
    }

    /// What is foreseen comes in any case.
    fn contradicts(&self, recording: &Recording<OrderLog>, alphas: &[f64]) -> Option<String> {
        if alphas.is_empty() { None } else { following::followed(&recording.stimulus, alphas) }
    }

    fn concerns(&self, site: Site, log: &OrderLog) -> bool {
        log.shows(site)
    }

    fn aspects(&self, recording: &Recording<OrderLog>) -> Vec<Recording<OrderLog>> {
        OrderLog::aspects(recording)
    }

    fn dynamics(&self, _thetas: &Thetas) -> Self {
        *self
    }
}

impl Execution {
    /// Half a cent: what a fee that is rounded to the cent is off by at most [currency].
    const FEE_ROUNDING: f64 = 0.005;
    /// What the rounding of mids is of what they do of themselves [sd]: as much as would cost a tenth of the evidence.
    const PART_OF_NOISE: f64 = 0.3;
    /// What a place between bounds is off by, as a part of what was displayed.
    const PLACE: f64 = 0.03;
    /// What a price that is told finer than in ticks, or a mid that was shown, is off by, as a part of what one in ticks is.
    const FINER: f64 = 0.1;

    /// To what precision a log can tell a channel, in its unit: no fit of it can be better than that.
    ///
    /// - `cost` [bps]: the standard deviation of a price rounded to its tick, `tick / sqrt(12)`, over the mid; a tenth of it where prices
    ///   are told finer than in ticks;
    /// - `seen` [bps]: a tenth of the same, for a mid that was seen is one that was shown;
    /// - `fee` [bps]: half a cent over the notional;
    /// - `filled` []: half a lot over the quantity;
    /// - `mid`: a part of what the mid does of itself, in which it is told;
    /// - `ahead`: a part of what was displayed, to which a place can be told.
    ///
    /// Each is the median over the orders; 0 for a channel of another name, or without orders.
    #[must_use]
    pub fn resolution_of(recording: &Recording<OrderLog>, channel: &str) -> f64 {
        let instrument = recording.stimulus.instrument();
        let of = |order: &InFlight| match channel {
            "fee" => Self::FEE_ROUNDING / (order.quantity * order.mid) * 1e4,
            "filled" => 0.5 * instrument.lot_size / order.quantity,
            // It is told in what the mid does of itself, of which its rounding is a part.
            "mid" => Self::PART_OF_NOISE,
            _ => 0.0,
        };
        match channel {
            "ahead" => Self::PLACE,
            "seen" => Self::FINER * Self::of_ticks(recording),
            "cost" if recording.stimulus.cost_scatter().is_some() => Self::FINER * Self::of_ticks(recording),
            "cost" => Self::of_ticks(recording),
            _ => median(recording.stimulus.orders().iter().map(of).collect()).unwrap_or(0.0),
        }
    }

    /// The standard deviation of a price rounded to its tick [bps of the mid], the median over the orders.
    fn of_ticks(recording: &Recording<OrderLog>) -> f64 {
        let tick_size = recording.stimulus.instrument().tick_size;
        let of = |order: &InFlight| tick_size / 12.0_f64.sqrt() / order.mid * 1e4;
        median(recording.stimulus.orders().iter().map(of).collect()).unwrap_or(0.0)
    }
}

/// The middle value, the upper of two.
fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

/// One value of several, each with its standard deviation, the surer the weightier. None of none.
fn usual(all: impl Iterator<Item = [f64; 2]>) -> Option<[f64; 2]> {
    // What never varied is known to the last digit.
    let weighed: Vec<[f64; 2]> = all.map(|[value, std]| [value, std.max(1e-9 * value.abs()).powi(-2)]).collect();
    let whole: f64 = weighed.iter().map(|[_, weight]| weight).sum();
    (whole > 0.0 && whole.is_finite()).then(|| {
        let value = weighed.iter().map(|[value, weight]| value * weight).sum::<f64>() / whole;
        [value, whole.sqrt().recip()]
    })
}

/// The largest multiple of `lot` that is in `quantity`; all of it where there are no lots. What is short of one by no more than
/// its last digits counts as one.
fn whole_lots(quantity: f64, lot: f64) -> f64 {
    if lot > 0.0 { ((quantity / lot) * (1.0 + 1e-12)).floor() * lot } else { quantity }
}

impl Dynamics<Execution> for Execution {
    fn initial(&self, initial: &Thetas) -> Vec<Executed> {
        let alphas = |lane: usize| (0..initial.parameters()).map(move |k| initial.row(k)[lane]);
        let state = |lane| Executed { foresight: Foresight::of(alphas(lane)), ..Executed::default() };
        (0..initial.lanes()).map(state).collect()
    }

    fn advance(&self, tick: Tick, states: &mut [Executed], met: &[Met], orders: &[InFlight], effects: &[ExecutionEffect]) {
        for (((state, met), order), effect) in states.iter_mut().zip(met).zip(orders).zip(effects) {
            let quantity = match order.role {
                Role::Watcher => {
                    let moved = state.foresight.look(tick.time, effect.displaced / order.mid * 1e4);
                    state.report = Report { role: Role::Watcher, mid: moved / met.scatter, ..Report::default() };
                    continue;
                }
                // What is held is held, however much is traded.
                Role::Holder => order.quantity,
                // Of what would have filled it, whoever stands ahead of an order that rests gets the first part.
                Role::Taker | Role::Maker => whole_lots((order.fillable(met.volume) - effect.ahead).max(0.0), effect.lot),
            };
            let price = met.reference + order.side.sign() * effect.paid(order, met);
            let ahead = if met.displayed > 0.0 { effect.ahead / met.displayed } else { 0.0 };
            state.report = Report { seen: met.seen, ahead, ..Report::of(order, price, quantity) };
            // Whoever rests decided long ago.
            if order.takes() {
                state.foresight.decided(tick.time, order.side.sign());
            }
        }
    }

    fn observe(&self, states: &[Executed], observations: &mut [Report]) {
        observations.iter_mut().zip(states).for_each(|(observation, state)| *observation = state.report);
    }
}
