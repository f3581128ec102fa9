//! Market environments by their ids, on data that are generated or given.

use crate::market::{Backtest, Cash, Execution, History, Instrument, Latencies, Latency, MECHANISMS, Settings};
use crate::rl::{Each, EnvEntry, EnvError, EnvRegistry, Occasion, OptionAbout, OptionKind, Options, VecEnv};
use crate::sim2real::randomize::{Distribution, Level, Randomized, Randomizer, Redraw, Target};
use crate::sim2real::{Assembly, Parameter, Seed};

use super::error::MarketEnvError;
use super::execute::{Execute, Ways};
use super::execution::DrawnExecution;
use super::generate::{DataKind, Generated};
use super::make_market::MakeMarket;
use super::market_env::MarketEnv;
use super::pace::Pace;
use super::portfolio::Portfolio;
use super::reward::{Payoff, Reward};
use super::setup::MarketSetup;
use super::task::Task;

/// All market environments: one row each.
pub const ENVIRONMENTS: EnvRegistry = &[
    EnvEntry {
        id: TRADE,
        about: "hold a share of the portfolio within [-1, 1] in one instrument",
        make: |lanes, options| make(Kind::Trade, lanes, options),
    },
    EnvEntry {
        id: EXECUTE,
        about: "work a parent order to a deadline at the least shortfall",
        make: |lanes, options| make(Kind::Execute, lanes, options),
    },
    EnvEntry {
        id: MAKE_MARKET,
        about: "quote both sides of one instrument, with queues and adverse selection",
        make: |lanes, options| make(Kind::MakeMarket, lanes, options),
    },
    EnvEntry {
        id: ALLOCATE,
        about: "hold shares of the portfolio in several instruments",
        make: |lanes, options| make(Kind::Allocate, lanes, options),
    },
];

const TRADE: &str = "trueup/Trade-v0";
const EXECUTE: &str = "trueup/Execute-v0";
const MAKE_MARKET: &str = "trueup/MakeMarket-v0";
const ALLOCATE: &str = "trueup/Allocate-v0";

/// What there is to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Trade,
    Execute,
    MakeMarket,
    Allocate,
}

impl Kind {
    fn id(self) -> &'static str {
        match self {
            Self::Trade => TRADE,
            Self::Execute => EXECUTE,
            Self::MakeMarket => MAKE_MARKET,
            Self::Allocate => ALLOCATE,
        }
    }

    fn of(id: &str) -> Option<Self> {
        [Self::Trade, Self::Execute, Self::MakeMarket, Self::Allocate].into_iter().find(|kind| kind.id() == id)
    }

    fn title(self) -> &'static str {
        ENVIRONMENTS.iter().find(|entry| entry.id == self.id()).map_or("", |entry| entry.about)
    }

    /// Whether it is about shares of a portfolio.
    fn holds(self) -> bool {
        matches!(self, Self::Trade | Self::Allocate)
    }

    /// What can be set when it is made, on data that are given.
    fn options(self) -> Vec<OptionAbout> {
        use Occasion::Make;
        let number = |name, unit, values, meaning| OptionAbout::number(Make, name, unit, values, meaning);
        let whole = |name, unit, [nominal, lower, upper]: [u64; 3], meaning| {
            OptionAbout::new(Make, name, unit, OptionKind::Whole { nominal, lower, upper }, meaning)
        };
        let choice = |name, nominal: &str, of: &[&str], meaning| {
            let of = of.iter().map(|one| (*one).to_owned()).collect();
            OptionAbout::new(Make, name, "", OptionKind::Choice { nominal: nominal.to_owned(), of }, meaning)
        };
        let length = match self {
            Self::Trade | Self::Allocate => 1_000,
            Self::Execute => 60,
            Self::MakeMarket => 500,
        };
        let mut all = vec![
            whole(
                "length",
                "steps",
                [length, 0, u64::from(u32::MAX)],
                "steps of an episode, which begins anywhere; 0 for all data",
            ),
            whole("warm_up", "events", [8, 0, 1_000_000], "events of an episode before its first step"),
            choice(
                "pace",
                "data",
                &["data", "bars", "events", "seconds"],
                "what a step lasts: until the next bars, or so many events or seconds; data: bars where there are only bars, else an event",
            ),
            number("every", "", [1.0, 1e-9, 1e9], "how many events or seconds a step lasts"),
        ];
        if self.holds() {
            all.push(choice(
                "reward",
                "profit",
                &["profit", "log_profit", "sharpe"],
                "relative change of value, its logarithm, or the differential Sharpe ratio",
            ));
            all.push(number(
                "sharpe_rate",
                "",
                [0.01, 1e-6, 1.0],
                "weight of the newest return in the differential Sharpe ratio",
            ));
            all.push(number(
                "cost_penalty",
                "",
                [0.0, 0.0, 1e3],
                "how often the fees of a step, over the value, are taken off its reward besides",
            ));
            all.push(number(
                "drawdown_penalty",
                "",
                [0.0, 0.0, 1e3],
                "how often a deeper drawdown is taken off the reward besides",
            ));
            all.push(number("leverage", "", [1.0, 1e-3, 100.0], "what a share of 1 comes to, as a multiple of the value"));
            all.push(number("band", "share", [0.0, 0.0, 1.0], "change of a share below which nothing is traded"));
        }
        if self == Self::Execute {
            all.push(number("quantity", "units", [2_000.0, 1e-9, 1e12], "size of the parent order"));
            all.push(choice("side", "both", &["both", "buy", "sell"], "which way parent orders go"));
        }
        if self == Self::MakeMarket {
            all.push(number("quote", "units", [100.0, 1e-9, 1e12], "largest quote"));
            all.push(number("inventory", "units", [1_000.0, 1e-9, 1e12], "largest inventory, either way"));
            all.push(number(
                "inventory_penalty",
                "ticks",
                [0.1, 0.0, 1e6],
                "what the largest inventory costs a step, on the largest quote",
            ));
        }
        all
    }

    /// What can be set of data that are generated, and of the market they are in.
    fn options_generated(self) -> Vec<OptionAbout> {
        use Occasion::Make;
        let number = |name, unit, values, meaning| OptionAbout::number(Make, name, unit, values, meaning);
        let whole = |name, unit, [nominal, lower, upper]: [u64; 3], meaning| {
            OptionAbout::new(Make, name, unit, OptionKind::Whole { nominal, lower, upper }, meaning)
        };
        let data = match self {
            Self::Trade | Self::Allocate => "bars",
            Self::Execute => "quotes",
            Self::MakeMarket => "book",
        };
        let kinds = ["bars", "quotes", "book"].map(str::to_owned).into();
        let mut all = vec![
            OptionAbout::new(
                Make,
                "data",
                "",
                OptionKind::Choice { nominal: data.into(), of: kinds },
                "what data are generated",
            ),
            whole("rows", "", [20_000, 2, 100_000_000], "rows of data an instrument"),
            whole("data_seed", "", [0, 0, 1 << 53], "seed of the data, the same for all lanes and episodes"),
            number("momentum", "", [0.0, -0.99, 0.99], "correlation of a bar's return with the one before"),
            number("cash", "currency", [1e6, 1e-6, 1e15], "cash of an episode"),
            number("half_spread", "bps", [0.0, 0.0, 1_000.0], "half spread of bars"),
            number("commission", "bps", [0.0, 0.0, 1_000.0], "commission"),
            number("latency", "s", [0.0, 0.0, Latency::LONGEST], "time an order takes, and word of it"),
            number("randomization", "", [0.0, 0.0, 1.0], "how much of execution is drawn anew for every episode"),
        ];
        if self == Self::Allocate {
            all.push(whole("instruments", "", [4, 2, 1_000], "number of instruments"));
        }
        all
    }
}

/// The environment of a kind by its options, on generated data.
fn make(kind: Kind, lanes: usize, options: &Options) -> Result<Box<dyn VecEnv>, EnvError> {
    let mut known = kind.options_generated();
    known.extend(kind.options());
    options.check(kind.id(), &known, Occasion::Make)?;
    let number = |name: &str| options.number(&known, name);
    let data = match options.text(&known, "data")?.as_str() {
        "bars" => DataKind::Bars,
        "quotes" => DataKind::Quotes,
        _ => DataKind::Book,
    };
    let instruments = if kind == Kind::Allocate { number("instruments")? as usize } else { 1 };
    let generated = Generated {
        kind: data,
        rows: number("rows")? as usize,
        instruments,
        momentum: number("momentum")?,
        seed: Seed(number("data_seed")? as u64),
    };
    let market = Market {
        cash: number("cash")?,
        half_spread: number("half_spread")?,
        commission: number("commission")?,
        latency: number("latency")?,
        randomization: number("randomization")?,
        leverage: if kind.holds() { number("leverage")? } else { 1.0 },
        bars: data == DataKind::Bars,
    };
    let backtest = market.backtest(generated.instruments(), generated.histories().map_err(MarketEnvError::from)?)?;
    let setup = MarketSetup { execution: market.drawn()?, ..MarketSetup::new(backtest) };
    made(kind, lanes, setup, options, known)
}

/// The environment `id`, one of [`ENVIRONMENTS`], in the market of `setup`, with its options but for those of generated data.
/// `length`, `warm_up` and `pace` are the options', not those of `setup`.
///
/// # Errors
/// An id there is not, options there are not or that cannot be, and what [`MarketEnv::new`] refuses.
pub fn make_on(id: &str, lanes: usize, setup: MarketSetup, options: &Options) -> Result<Box<dyn VecEnv>, EnvError> {
    let Some(kind) = Kind::of(id) else {
        let known: Vec<&str> = ENVIRONMENTS.iter().map(|entry| entry.id).collect();
        let remedy = format!("there are {}", known.join(", "));
        return Err(EnvError::UnknownOption { id: "market".into(), name: id.into(), remedy });
    };
    let known = kind.options();
    options.check(kind.id(), &known, Occasion::Make)?;
    made(kind, lanes, setup, options, known)
}

fn made(
    kind: Kind,
    lanes: usize,
    mut setup: MarketSetup,
    options: &Options,
    known: Vec<OptionAbout>,
) -> Result<Box<dyn VecEnv>, EnvError> {
    let number = |name: &str| options.number(&known, name);
    let length = number("length")? as u32;
    setup.length = (length > 0).then_some(length);
    setup.warm_up = number("warm_up")? as usize;
    let every = number("every")?;
    setup.pace = match options.text(&known, "pace")?.as_str() {
        "bars" => Pace::Bars,
        "events" => Pace::Events(every as u32),
        "seconds" => Pace::Seconds(every),
        _ => setup.pace,
    };
    match kind {
        Kind::Trade | Kind::Allocate => {
            let payoff = match options.text(&known, "reward")?.as_str() {
                "log_profit" => Payoff::LogProfit,
                "sharpe" => Payoff::DifferentialSharpe { rate: number("sharpe_rate")? },
                _ => Payoff::Profit,
            };
            let (cost_penalty, drawdown_penalty) = (number("cost_penalty")?, number("drawdown_penalty")?);
            let names = setup.backtest.instruments().iter().map(|one| one.symbol.clone()).collect();
            let mut task = Portfolio::new(names, Reward { payoff, cost_penalty, drawdown_penalty });
            (task.leverage, task.band) = (number("leverage")?, number("band")?);
            let count = if kind == Kind::Trade { 1 } else { setup.backtest.instruments().len() };
            lanes_of(kind, lanes, setup, task, count, known)
        }
        Kind::Execute => {
            let ways = match options.text(&known, "side")?.as_str() {
                "buy" => Ways::Buy,
                "sell" => Ways::Sell,
                _ => Ways::Both,
            };
            let task = Execute::new(number("quantity")?, ways);
            lanes_of(kind, lanes, setup, task, 1, known)
        }
        Kind::MakeMarket => {
            let task = MakeMarket::new(number("quote")?, number("inventory")?, number("inventory_penalty")?);
            lanes_of(kind, lanes, setup, task, 1, known)
        }
    }
}

fn lanes_of<T: Task>(
    kind: Kind,
    lanes: usize,
    setup: MarketSetup,
    task: T,
    instruments: usize,
    known: Vec<OptionAbout>,
) -> Result<Box<dyn VecEnv>, EnvError> {
    let env = MarketEnv::new(kind.id(), kind.title(), setup, task, instruments)?.with_options(known);
    Ok(Box::new(Each::new(env, lanes)?))
}

/// The market that generated data are in.
#[derive(Debug, Clone, Copy)]
struct Market {
    cash: f64,
    half_spread: f64,
    commission: f64,
    latency: f64,
    randomization: f64,
    leverage: f64,
    bars: bool,
}

/// The widest that is drawn at full randomization: half spread and commission [bps], and latency [s].
const WIDEST: [f64; 3] = [5.0, 2.0, 0.5];

impl Market {
    /// What is drawn, with its nominal value and the widest it can be.
    fn randomizable(&self) -> Vec<(Target, f64, f64)> {
        let mut all = vec![
            (Target::of("commission", "bps"), self.commission, WIDEST[1]),
            (Target::of("latency", "order"), self.latency, WIDEST[2]),
        ];
        if self.bars {
            all.push((Target::of("half_spread", "bps"), self.half_spread, WIDEST[0]));
        }
        all
    }

    fn drawn(&self) -> Result<Option<DrawnExecution>, MarketEnvError> {
        if self.randomization <= 0.0 {
            return Ok(None);
        }
        let one = |(target, nominal, widest): (Target, f64, f64)| {
            let unit = if target.parameter == "bps" { "bps" } else { "s" };
            let parameter = Parameter::named(target.parameter.clone(), unit, nominal).within(0.0, Latency::LONGEST);
            let distribution = Distribution::Uniform { low: 0.0, high: (2.0 * nominal).max(widest) };
            Randomized { target, parameter, distribution, relative: false, at: Redraw::Reset }
        };
        let randomizer = Randomizer::new(self.randomizable().into_iter().map(one).collect(), Vec::new())?;
        let level = Level::new(self.randomization).unwrap_or(Level::FULL);
        Ok(Some(DrawnExecution { randomizer, level }))
    }

    fn backtest(&self, instruments: Vec<Instrument>, histories: Vec<History>) -> Result<Backtest, MarketEnvError> {
        let mut venue = Assembly::new(Execution, MECHANISMS);
        let drawn = self.randomization > 0.0;
        if self.commission > 0.0 || drawn {
            venue = with_bps(venue, "commission", self.commission);
        }
        if self.bars && (self.half_spread > 0.0 || drawn) {
            venue = with_bps(venue, "half_spread", self.half_spread);
        }
        let seconds = self.latency;
        let [order, response] = [Latency::Constant { seconds }, Latency::Constant { seconds }];
        let latencies = Latencies { order, response, ..Latencies::default() };
        let cash = Cash::nearest(self.cash)?;
        let settings = Settings { latencies, max_leverage: self.leverage.max(1.0), ..Settings::with_cash(cash) };
        Ok(Backtest::new(instruments, histories, venue, settings)?)
    }
}

/// `venue` with a mechanism in its form that is stated in bps.
fn with_bps(venue: Assembly<Execution>, id: &str, bps: f64) -> Assembly<Execution> {
    let Some(mechanism) = MECHANISMS.iter().find(|row| row.about().name == id) else { return venue };
    let forms = mechanism.forms(&crate::sim2real::Typical::default());
    let Some((form, found)) = forms.into_iter().enumerate().find(|(_, form)| form.name == "bps") else { return venue };
    let parameters = found.parameters.into_iter().map(|parameter| Parameter { nominal: bps, ..parameter }).collect();
    venue.with_mechanism(*mechanism, form, parameters)
}
