//! Runs from their documents to their outputs: what a backtest leaves is a log like any other, and a diagnosis of it names
//! what the run modelled.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails where a value is missing")]

use std::path::PathBuf;

use tempfile::TempDir;
use trueup::conceal::Column;
use trueup::conceal::exchange::Exchange;
use trueup::io::{OutputFolder, OutputTable, Overwrite, RunFile, Table, TimeFormat, TwinFile, Values, write_table};
use trueup::market::{
    Backtest, EventKind, OrderLog, Orders, PreparedRun, Quantity, Record, RunOutputs, Side, Strategy, View, execution_twin,
    explained, prepare_run,
};
use trueup::sim2real::diagnose::{Verdict, diagnose};
use trueup::sim2real::{Recording, Seed, Simulator, Thetas, Timestamp};

struct Scene(TempDir);

impl Scene {
    fn new(files: &[(&str, &str)]) -> Self {
        let scene = Self(tempfile::tempdir().unwrap());
        files.iter().for_each(|(name, text)| std::fs::write(scene.path(name), text).unwrap());
        scene
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn run_file(&self) -> RunFile {
        RunFile::read(self.path("run.toml")).unwrap()
    }

    /// What is said of the run, without the folder's path.
    fn error(&self) -> String {
        let error = RunFile::read(self.path("run.toml")).and_then(|run| prepare_run(&run)).err();
        let shown = error.map_or_else(|| "no error".to_owned(), |error| error.to_string());
        shown.replace(&format!("{}/", self.0.path().display()), "")
    }
}

/// A table of the generator as one that can be written.
fn output(table: &trueup::conceal::Table) -> OutputTable {
    table.columns().iter().fold(OutputTable::new(), |out, (name, column)| {
        let values = match column {
            Column::Time(times) => Values::Times(times.iter().map(|t| Some(Timestamp(*t))).collect()),
            Column::Whole(values) => Values::Integers(values.iter().copied().map(Some).collect()),
            Column::Real(values) => Values::Floats(values.iter().copied().map(Some).collect()),
            Column::Text(values) => Values::Texts(values.iter().cloned().map(Some).collect()),
            Column::Sparse(values) => Values::Floats(values.clone()),
            Column::Empty(rows) => Values::Floats(vec![None; *rows]),
        };
        out.with(name, values)
    })
}

const QUOTED: &str = "
[run]
seed = 3
cash = 1_000_000
currency = 'USD'
max_leverage = 4.0
[[instrument]]
symbol = 'XYZ'
tick_size = 0.01
[[data]]
symbol = 'XYZ'
quotes = 'quotes.parquet'
[strategy]
kind = 'any'
[[mechanism]]
name = 'half_spread'
fraction = 1.0
[[mechanism]]
name = 'book_walk'
fraction = 1.0
[[mechanism]]
name = 'commission'
per_share = 0.005
";

const TWIN: &str = "
[twin]
model = 'execution'
[assumptions]
price = 'mid'
[[instrument]]
symbol = 'XYZ'
tick_size = 0.01
[[mechanism]]
name = 'commission'
per_share = { value = 0.005, uncertainty = 0.0 }
[market]
quotes = 'quotes.parquet'
";

/// Half an hour of quotes, five levels deep.
fn quoted() -> Scene {
    let scene = Scene::new(&[("run.toml", QUOTED), ("twin.toml", TWIN)]);
    let exchange = Exchange { session: 1_800.0, orders: 1, ..Exchange::default() };
    let day = exchange.day(Seed(11));
    let tables = day.tables(&exchange);
    let (_, quotes) = tables.iter().find(|(name, _)| *name == "quotes").unwrap();
    write_table(scene.path("quotes.parquet"), &output(quotes), Overwrite::Refuse).unwrap();
    scene
}

/// Buys and sells in turn, every few events, orders of sizes that a generator draws.
#[derive(Default)]
struct InTurn {
    events: u64,
    state: u64,
}

impl Strategy for InTurn {
    fn name(&self) -> &str {
        "in_turn"
    }
    fn lookback(&self) -> usize {
        1
    }
    fn on_event(&mut self, view: &View<'_>, orders: &mut Orders) {
        assert_eq!(view.event().kind, EventKind::Quote);
        self.events += 1;
        if !self.events.is_multiple_of(7) {
            return;
        }
        self.state = self.state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let lots = 1 + (self.state >> 33) % 400;
        let side = if self.events.is_multiple_of(2) { Side::Buy } else { Side::Sell };
        orders.market(0, side, Quantity::nearest(lots as f64).unwrap());
    }
}

fn recorded(scene: &Scene, strategy: &mut dyn Strategy) -> (PreparedRun, Record, RunOutputs) {
    let file = scene.run_file();
    let prepared = prepare_run(&file).unwrap();
    let record = prepared.backtest.run(strategy).map_err(|error| explained(&file, &error)).unwrap();
    let outputs = prepared.outputs(&record).unwrap();
    let mut folder = OutputFolder::create(scene.path("out"), Overwrite::Refuse).unwrap();
    outputs.write(&mut folder).unwrap();
    folder.finish().unwrap();
    (prepared, record, outputs)
}

/// Largest distance between what the log of a backtest says and what its own venue says when it is held to that log.
fn worst(backtest: &Backtest, log: &Recording<OrderLog>) -> f64 {
    let venue = backtest.venue();
    let values: Vec<f64> = venue.parameters().iter().map(|p| p.nominal).collect();
    let simulated = venue.rollout(&Thetas::single(&values), log, 0..log.len(), Seed(1)).remove(0);
    let pairs = log.measured.iter().zip(&simulated).flat_map(|(m, s)| m.samples.iter().zip(&s.samples));
    pairs.filter_map(|(measured, simulated)| Some((measured.as_ref()? - simulated).abs())).fold(0.0, f64::max)
}

/// The venue of the backtest is the assembly that diagnosis identifies from its fills, by a twin that knows the broker's
/// schedule and assumes the mid.
#[test]
fn a_diagnosis_of_a_backtest_names_what_the_run_modelled() {
    let scene = quoted();
    let (prepared, record, _) = recorded(&scene, &mut InTurn::default());
    assert!(record.blotter.fills.len() > 200, "{} fills", record.blotter.fills.len());
    let twin = TwinFile::read(scene.path("twin.toml")).unwrap();
    let (assembly, recordings) = execution_twin(&twin, &[scene.path("out")]).unwrap();
    assert!(worst(&prepared.backtest, &recordings[0]) < 1e-6, "what ran and what is diagnosed are not the same venue");
    let found = diagnose(&assembly, &recordings, &[], Seed(1), &|_, _, _| {}).diagnosis;
    let mut named: Vec<&str> = found.effects.iter().map(|effect| effect.mechanism.as_str()).collect();
    named.sort_unstable();
    assert_eq!((found.verdict, named), (Verdict::Named, vec!["book_walk", "half_spread"]), "{}", found.summary);
    for effect in &found.effects {
        let value = effect.parameters["fraction"].value;
        assert!((value - 1.0).abs() < 1e-3, "{}: {value} of the quoted", effect.mechanism);
    }
    for fit in &found.fit {
        assert!(
            fit.trued_rmse <= 1e-3 * fit.nominal_rmse.max(1e-9),
            "{}: {} of {}",
            fit.channel,
            fit.trued_rmse,
            fit.nominal_rmse
        );
    }
}

#[test]
fn what_is_written_reads_back_as_what_happened() {
    let scene = quoted();
    let (_, record, outputs) = recorded(&scene, &mut InTurn::default());
    let table = |name: &str| Table::read(scene.path("out").join(name)).unwrap();
    let (orders, fills, equity) = (table("orders.parquet"), table("fills.parquet"), table("equity.parquet"));
    let format = TimeFormat::default();
    let decided: Vec<Timestamp> = record.blotter.orders.iter().map(|order| order.decided_at).collect();
    assert_eq!(orders.times("decided_at", &format).unwrap(), decided);
    let (bids, asks) = (orders.floats_complete("seen_bid").unwrap(), orders.floats_complete("seen_ask").unwrap());
    assert!(bids.iter().zip(&asks).all(|(bid, ask)| bid < ask));
    let sides: Vec<String> = record.blotter.orders.iter().map(|order| order.side.word().to_owned()).collect();
    assert_eq!(orders.texts_complete("side").unwrap(), sides);
    // Prices and fees are integers of 1e-9 and 1e-18: what is written is the nearest number, to the bit.
    let prices: Vec<f64> = record.blotter.fills.iter().map(|fill| fill.price.to_f64()).collect();
    assert_eq!(fills.floats_complete("price").unwrap(), prices);
    let fees: Vec<f64> = record.blotter.fills.iter().map(|fill| fill.fee.nearest_f64()).collect();
    assert_eq!(fills.floats_complete("fee").unwrap(), fees);
    assert_eq!(equity.floats_complete("equity").unwrap().last(), record.equity.last().map(|point| &point.equity));
    assert_eq!(equity.rows(), record.equity.len());

    let json: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(scene.path("out").join("run.json")).unwrap()).unwrap();
    assert_eq!((json["schema"].as_str(), json["seed"].as_u64()), (Some("trueup.run/1"), Some(3)));
    assert_eq!(json["counts"]["fills"].as_u64(), Some(prices.len() as u64));
    assert_eq!(json["inputs"][1]["path"], "quotes.parquet");
    assert!(json["inputs"].as_array().unwrap().iter().all(|input| input["sha256"].as_str().unwrap().len() == 64));
    assert!(json["metrics"]["sharpe"].is_null() && json["metrics"]["cagr"].is_null(), "half an hour makes no year");
    let costs = &outputs.summary.metrics.costs;
    assert_eq!(costs.mechanisms.keys().copied().collect::<Vec<_>>(), ["book_walk", "half_spread"]);
    let parts: f64 = costs.mechanisms.values().sum();
    assert!(costs.mechanisms.values().all(|cost| *cost > 0.0) && (parts - costs.spread_and_impact).abs() < 1e-6 * parts);
    assert_eq!(outputs.json().unwrap(), recorded_again(&scene));
}

/// `run.json` of the same run, run once more.
fn recorded_again(scene: &Scene) -> String {
    let prepared = prepare_run(&scene.run_file()).unwrap();
    let record = prepared.backtest.run(&mut InTurn::default()).unwrap();
    prepared.outputs(&record).unwrap().json().unwrap()
}

/// Fills at the touch pay a spread that no mechanism adds, and the page says so.
#[test]
fn the_price_a_run_starts_from_can_be_said() {
    let scene = quoted();
    let bare = QUOTED.split("[[mechanism]]").next().unwrap();
    std::fs::write(scene.path("run.toml"), bare).unwrap();
    let (_, _, outputs) = recorded(&scene, &mut InTurn::default());
    let kinds: Vec<&str> = outputs.page.costs.iter().map(|cost| cost.kind.as_str()).collect();
    assert_eq!(kinds, ["timing", "spread to the touch", "rounding to a tick", "commission"]);
    assert!(outputs.page.costs[1].amount > 0.0 && outputs.summary.metrics.costs.mechanisms.is_empty());
    let price = |word: &str| {
        std::fs::write(scene.path("run.toml"), bare.replace("seed = 3", &format!("seed = 3\nprice = '{word}'"))).unwrap();
        scene.error()
    };
    assert_eq!((price("mid"), price("touch")), ("no error".to_owned(), "no error".to_owned()));
    insta::assert_snapshot!(price("next_open"), @r#"
    run.toml:4:1: orders meet the quotes, which are there
      hint: with quotes it is "mid" or "touch"
    "#);
    insta::assert_snapshot!(price("bar_close"), @r#"
    run.toml:4:1: "bar_close" is what an order was decided on: no order meets it
      hint: give "next_open" with bars, "mid" or "touch" with quotes
    "#);
}

const BARS: &str = "ts,open,high,low,close,volume\n0,10,11,9,10,0\n60000000000,10,11,9,10,0\n";
const ON_BARS: &str = "
[run]
seed = 3
cash = 1_000
currency = 'USD'
[[instrument]]
symbol = 'XYZ'
tick_size = 0.01
[[data]]
symbol = 'XYZ'
bars = 'bars.csv'
stamp = 'open'
[strategy]
kind = 'buy_and_hold'
";

#[test]
fn a_mechanism_that_lacks_its_data_is_an_error_before_the_run() {
    let with = |mechanism: &str, bars: &str| {
        let run = format!("{ON_BARS}[[mechanism]]\n{mechanism}\n");
        Scene::new(&[("run.toml", &run), ("bars.csv", bars)]).error()
    };
    insta::assert_snapshot!(with("name = 'book_walk'\nfraction = 1.0", BARS), @"
    run.toml:16:1: `book_walk` needs quotes, and there are none of `XYZ`
      hint: add [[data]] with quotes, or give half_spread as bps
    ");
    insta::assert_snapshot!(with("name = 'half_spread'\nfraction = 1.0", BARS), @"
    run.toml:16:1: `half_spread` needs quotes, and there are none of `XYZ`
      hint: add [[data]] with quotes, or give half_spread as bps
    ");
    insta::assert_snapshot!(with("name = 'sqrt_impact'\nbps_at_full_participation = 10.0", BARS), @"
    run.toml:16:1: `sqrt_impact` needs volumes, and there are none of `XYZ`
      hint: add average_daily_volume to [[instrument]], or bars with volumes: days that are over are averaged
    ");
    insta::assert_snapshot!(with("name = 'participation_cap'\nfraction = 0.1", BARS), @"
    run.toml:16:1: `participation_cap` needs volumes, and there are none of `XYZ`
      hint: add [[data]] with bars that know volumes, or with quotes that know sizes
    ");
    insta::assert_snapshot!(with("name = 'textbook_slippage'", BARS), @"
    run.toml:16:1: `textbook_slippage` needs volumes, and there are none of `XYZ`
      hint: add average_daily_volume to [[instrument]], or bars with volumes: days that are over are averaged
    ");
    insta::assert_snapshot!(with("name = 'volatility_slippage'\nfraction = 0.05", BARS), @"
    run.toml:16:1: `volatility_slippage` needs volatilities, and there are none of `XYZ`
      hint: add daily_volatility to [[instrument]], or more than a week of data: it is that of days that are over
    ");
    insta::assert_snapshot!(with("name = 'queue_position'\nahead = 0.5", BARS), @"
    run.toml:16:1: `queue_position` needs sizes displayed at a price, and there are none of `XYZ`
      hint: add [[data]] with a book, or quotes that know sizes; on bars and trades alone nobody knows a queue
    ");
    let traded = BARS.replace(",0\n", ",5\n");
    for mechanism in [
        "name = 'textbook_slippage'",
        "name = 'transient_impact'\nbps_at_full_participation = 100.0\nrecovery = 60.0",
        "name = 'half_spread'\nbps = 1.0",
        "name = 'sqrt_impact'\nbps_at_full_participation = 10.0",
        "name = 'participation_cap'\nfraction = 0.1",
    ] {
        assert_eq!(with(mechanism, &traded), "no error", "{mechanism}");
    }
    insta::assert_snapshot!(with("name = 'half_spred'\nbps = 1.0", BARS), @"
    run.toml:16:1: there is no mechanism `half_spred`
      hint: did you mean `half_spread`?
    ");
}

#[test]
fn a_run_that_cannot_be_is_said_with_place_and_remedy() {
    let with = |from: &str, to: &str| {
        assert!(ON_BARS.contains(from));
        Scene::new(&[("run.toml", &ON_BARS.replacen(from, to, 1)), ("bars.csv", BARS)]).error()
    };
    assert_eq!(with("seed", "seed"), "no error");
    insta::assert_snapshot!(with("currency", "max_leverage = 0.0\ncurrency"), @"
    run.toml:5:1: expected a finite number greater than 0, found 0
      hint: 1 borrows nothing; 2 holds positions of up to twice the equity
    ");
    insta::assert_snapshot!(with("currency", "price = 'mid'\ncurrency"), @r#"
    run.toml:5:1: the price "mid" needs quotes, and there are none
      hint: with bars it is "next_open"
    "#);
    insta::assert_snapshot!(with("currency", "start = '2020-01-01T00:00:00Z'\ncurrency"), @"
    run.toml:5:1: there are no data of `XYZ` between `start` and `end`
      hint: leave them out to run on all data; times without a zone in files are UTC unless declared
    ");
    insta::assert_snapshot!(with("tick_size = 0.01", "tick_size = 0.01\n[[instrument]]\nsymbol = 'ABC'\ntick_size = 0.01"), @"
    run.toml:9:1: there are no data of `ABC`
      hint: add [[data]] with its symbol and bars, quotes, trades or book, or drop the instrument
    ");
    insta::assert_snapshot!(with("stamp = 'open'", "stamp = 'open'\ninterval = '1h'"), @"
    bars.csv: column `ts`: most bars are 60 s apart, but `interval` says 3600 s
      hint: give the length of one bar
    ");
}
