//! Execution twins and order logs read from files: what is found in them, and what is said of bad ones.
#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use std::fs;
use std::path::{Path, PathBuf};

use tempfile::TempDir;
use trueup::io::{InputError, TwinFile};
use trueup::market::{Execution, OrderLog, ShownDelay, execution_assembly, execution_twin};
use trueup::sim2real::{Assembly, Candidate, Recording, Seed, Simulator, Thetas, Twin};

const TWIN: &str = r#"
[twin]
model = "execution"
[assumptions]
price = "mid"
[[instrument]]
symbol = "XYZ"
tick_size = 0.01
average_daily_volume = 1000000
"#;
const QUOTES: &str = "ts,bid,bid_size,ask,ask_size,bid2,bid2_size,ask2,ask2_size\n\
    1000000000,99.99,10,100.01,10,99.98,50,100.03,50\n\
    2000000000,100.00,10,100.02,10,99.97,50,,\n";
const ORDERS: &str = "order_id,symbol,decided_at,side,qty,type,limit_price\n\
    a,XYZ,1000000000,buy,20,market,\n\
    b,XYZ,2000000000,sell,5,market,\n\
    c,XYZ,2000000000,sell,5,limit,100.5\n";
const FILLS: &str = "order_id,filled_at,qty,price,fee\n\
    a,1000000001,10,100.01,0.1\n\
    a,1000000001,10,100.03,0.1\n\
    b,2000000001,5,100.00,0\n";

fn folder(files: &[(&str, &str)]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in [("twin.toml", TWIN), ("quotes.csv", QUOTES), ("orders.csv", ORDERS), ("fills.csv", FILLS)] {
        let text = files.iter().find(|(other, _)| *other == name).map_or(text, |(_, text)| text);
        if !text.is_empty() {
            fs::write(folder.path().join(name), text).unwrap();
        }
    }
    folder
}

fn read(folder: &Path) -> Result<(Assembly<Execution>, Recording<OrderLog>), InputError> {
    let twin = TwinFile::read(folder.join("twin.toml"))?;
    let (assembly, mut recordings) = execution_twin(&twin, &[folder.to_path_buf()])?;
    Ok((assembly, recordings.remove(0)))
}

/// The error the given files make, with the folder's path left out.
fn error(files: &[(&str, &str)]) -> String {
    let folder = folder(files);
    let error = read(folder.path()).err().map_or_else(|| "no error".to_owned(), |error| error.to_string());
    error.replace(&format!("{}/", folder.path().display()), "").replace(&folder.path().display().to_string(), "FOLDER")
}

#[test]
fn a_log_is_read_beside_its_tape() {
    let folder = folder(&[]);
    let (assembly, recording) = read(folder.path()).unwrap();
    assert!(assembly.modelled().is_empty());
    assert_eq!(recording.time, [0.0, 1.0]);
    let samples = |channel: &str| recording.channel(channel).unwrap().samples.clone();
    // Average 100.02 against a mid of 100; 0.2 on 2000.4; the seller pays half a cent spread of two.
    assert!(
        (samples("cost")[0].unwrap() - 2.0).abs() < 1e-9 && (samples("fee")[0].unwrap() - 0.2 / 2000.4 * 1e4).abs() < 1e-9
    );
    assert!((samples("cost")[1].unwrap() - 0.01 / 100.01 * 1e4).abs() < 1e-9);
    assert_eq!(samples("filled"), [Some(1.0), Some(1.0)]);
    assert_eq!(recording.stimulus.notes(), ["1 of 3 orders are not market orders and are left out"]);
}

#[test]
fn a_commission_of_the_twin_is_modelled_and_uncertain() {
    let text = TWIN.replace("price = \"mid\"", "price = \"mid\"\ncommission_bps = 0.5");
    let folder = folder(&[("twin.toml", &text)]);
    let (assembly, _) = read(folder.path()).unwrap();
    assert_eq!(assembly.modelled(), ["commission"]);
    let bps = &assembly.parameters()[0];
    assert_eq!((bps.name.as_ref(), bps.nominal), ("bps", 0.5));
    assert!((bps.prior.unwrap() - 0.15).abs() < 1e-12);
}

#[test]
fn mechanisms_are_read_in_the_form_their_keys_say() {
    let text = format!("{TWIN}\n[[mechanism]]\nname = \"half_spread\"\nfraction = {{ value = 0.8, uncertainty = 0.1 }}\n");
    let folder = folder(&[("twin.toml", &text)]);
    let (assembly, recording) = read(folder.path()).unwrap();
    assert_eq!(assembly.modelled(), ["half_spread"]);
    assert_eq!(assembly.parameters()[0].name, "fraction");
    let simulated = assembly.rollout(&Thetas::single(&[0.8]), &recording, 0..1, Seed(1));
    assert!((simulated[0][0].samples[0] - 0.8).abs() < 1e-9, "0.8 of the half spread of a cent on 100");
}

#[test]
fn bad_twins_are_said_with_place_and_remedy() {
    let with = |mechanism: &str| error(&[("twin.toml", &format!("{TWIN}\n[[mechanism]]\n{mechanism}\n"))]);
    insta::assert_snapshot!(with("name = \"half_spred\"\nfraction = 1.0"), @"
    twin.toml:12:1: there is no mechanism `half_spred`
      hint: did you mean `half_spread`?
    ");
    insta::assert_snapshot!(with("name = \"half_spread\"\nfracton = 1.0"), @"
    twin.toml:13:1: `half_spread` has no parameter `fracton`
      hint: did you mean `fraction`?
    ");
    insta::assert_snapshot!(with("name = \"half_spread\""), @"
    twin.toml:11:1: the parameters of `half_spread` are not complete
      hint: give `fraction`, or `bps`, or `fraction_of_recent`
    ");
    assert_eq!(with("name = \"half_spread\"\nbps = 1.0"), "no error");
    insta::assert_snapshot!(with("name = \"command_delay\"\nseconds = -1.0"), @"
    twin.toml:13:1: expected a value from 0 to 60, found -1
      hint: its unit is [s]
    ");
    insta::assert_snapshot!(error(&[("twin.toml", &TWIN.replace("execution", "joint"))]), @r#"twin.toml:3:1: expected the model "execution", found "joint""#);
    insta::assert_snapshot!(error(&[("twin.toml", &format!("{TWIN}[parameters]\nspread = 1.0\n"))]), @"
    twin.toml:11:1: `execution` has no parameter `spread`
      hint: what stands between decision and fill is said by [[mechanism]] sections
    ");
    insta::assert_snapshot!(error(&[("twin.toml", &TWIN.replace("\"mid\"", "\"last\""))]), @r#"
    orders.csv: the twin assumes the price "last", but there are no trades
      hint: name trades under [market] in the twin, or put them beside the orders
    "#);
    insta::assert_snapshot!(error(&[("twin.toml", &TWIN.replace("XYZ", "XYY"))]), @r#"
    orders.csv: row 2, column `symbol`: the twin declares no such instrument, found "XYZ"
      hint: did you mean `XYY`?
    "#);
}

const BARS: &str = "ts,open,high,low,close,volume\n\
    -1000000000,100,101,99,100,50\n0,100,101,99,100.5,50\n1000000000,100.5,101,99,101,50\n2000000000,101,101,99,100,50\n";

#[test]
fn bars_are_a_tape_once_their_stamp_is_said() {
    let bars = |market: &str, price: &str, more: &str| {
        let twin =
            format!("{}\n[market]\nbars = \"bars.csv\"\n{market}\n{more}", TWIN.replace("\"mid\"", &format!("\"{price}\"")));
        folder(&[("twin.toml", &twin), ("quotes.csv", "")])
    };
    let read_with = |market: &str, price: &str, more: &str| {
        let folder = bars(market, price, more);
        fs::write(folder.path().join("bars.csv"), BARS).unwrap();
        read(folder.path()).map_err(|error| error.to_string())
    };
    let (_, recording) = read_with("stamp = \"open\"", "bar_close", "").unwrap();
    let assumed =
        |recording: &Recording<OrderLog>| recording.stimulus.orders().iter().map(|o| o.assumed).collect::<Vec<_>>();
    assert_eq!(assumed(&recording), [100.5, 101.0]);
    assert_eq!(assumed(&read_with("stamp = \"open\"", "next_open", "").unwrap().1), [100.5, 101.0]);
    assert_eq!(assumed(&read_with("stamp = \"close\"", "bar_close", "").unwrap().1), [101.0, 100.0]);
    assert!(read_with("", "bar_close", "").unwrap_err().contains("stamp"));
    let spread = "[[mechanism]]\nname = \"half_spread\"\nfraction = 1.0\n";
    let error = read_with("stamp = \"open\"", "bar_close", spread).unwrap_err();
    assert!(error.contains("lacks the data `half_spread` needs") && error.contains("need quotes"), "{error}");
}

#[test]
fn bad_logs_are_said_with_file_row_column_and_remedy() {
    let orders = |from: &str, to: &str| error(&[("orders.csv", &ORDERS.replace(from, to))]);
    let fills = |from: &str, to: &str| error(&[("fills.csv", &FILLS.replace(from, to))]);
    let quotes = |from: &str, to: &str| error(&[("quotes.csv", &QUOTES.replace(from, to))]);
    insta::assert_snapshot!(orders("sell,5,market", "sel,5,market"), @r#"
    orders.csv: row 3, column `side`: expected `buy` or `sell`, found "sel"
      hint: did you mean `sell`?
    "#);
    insta::assert_snapshot!(orders("buy,20", "buy,-20"), @"
    orders.csv: row 2, column `qty`: expected a number above 0, found -20
      hint: quantities are above 0; which way an order trades is said by its side
    ");
    insta::assert_snapshot!(orders("b,XYZ", "a,XYZ"), @r#"
    orders.csv: row 3, column `order_id`: the id is that of data row 1 too, found "a"
      hint: each order has an id of its own; are rows doubled, or days put together that count from 1 again?
    "#);
    insta::assert_snapshot!(orders("b,XYZ", "b,ABC"), @r#"
    orders.csv: row 3, column `symbol`: the twin declares no such instrument, found "ABC"
      hint: there are `XYZ`
    "#);
    insta::assert_snapshot!(orders("2000000000,sell,5,limit,100.5", "19000000000000,sell,5,market,"), @"
    orders.csv: row 4, column `decided_at`: 1 of 3 orders are outside the tape; this one is decided 18997.000 s after the tape ends (1970-01-01T00:00:03Z), found 1970-01-01T05:16:40Z
      hint: is one of the files in another zone, 5 h or more away? Declare its `zone`
    ");
    insta::assert_snapshot!(orders("market", "limit"), @r#"
    orders.csv: none of the 3 orders is a market order, or a limit order that rested and was filled; the first is "limit"
      hint: only these are modelled so far
    "#);
    insta::assert_snapshot!(fills("b,2000000001", "x,2000000001"), @r#"
    fills.csv: row 4, column `order_id`: there is no such order, found "x"
      hint: each fill names a row of orders: are both files of one log?
    "#);
    insta::assert_snapshot!(fills("b,2000000001", "b,1999999999"), @r#"
    fills.csv: row 4, column `filled_at`: order "b" is filled 0.000000001 s before it was decided (1970-01-01T00:00:02Z), found 1970-01-01T00:00:01.999999999Z
      hint: are both columns in the same zone and unit, and from the same clock?
    "#);
    insta::assert_snapshot!(fills("100.03", "-100.03"), @"
    fills.csv: row 3, column `price`: expected a number above 0, found -100.03
      hint: was a fill value written where nothing was known? Then drop the row
    ");
    insta::assert_snapshot!(quotes("99.99", "100.02"), @"
    quotes.csv: row 2, column `bid`: the bid is above the ask, here and in 1 of 2 rows, found 100.02
      hint: are `bid` and `ask` exchanged?
    ");
    insta::assert_snapshot!(quotes("99.99", "-99.99"), @"
    quotes.csv: row 2, column `bid`: expected a number that is not negative, found -99.99
      hint: leave the cell empty where a side has nothing
    ");
    insta::assert_snapshot!(error(&[("quotes.csv", "")]), @"
    FOLDER: there are neither quotes nor trades nor bars: nothing says what the market did
      hint: name the tape under [market] in the twin, or put quotes, trades or bars beside the orders
    ");
    insta::assert_snapshot!(error(&[("fills.csv", "")]), @"
    FOLDER: there is no fills table in the folder
      hint: an order log is a folder with orders and fills, such as fills.csv or fills.parquet
    ");
}

fn abides(name: &str) -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/market/abides").join(name);
    if !folder.is_dir() {
        println!("skipped: the ABIDES log {name} is not on this machine");
        return None;
    }
    Some(folder)
}

/// Mean absolute residual of the cost over the rows from `start` on.
fn mean_error(assembly: &Assembly<Execution>, recording: &Recording<OrderLog>, start: usize) -> f64 {
    let values: Vec<f64> = assembly.parameters().iter().map(|p| p.nominal).collect();
    let simulated =
        assembly.rollout(&Thetas::single(&values), recording, 0..recording.len(), Seed(1)).remove(0).remove(0).samples;
    let measured = &recording.channel("cost").unwrap().samples;
    let errors: Vec<f64> = (start..recording.len()).filter_map(|k| Some((measured[k]? - simulated[k]).abs())).collect();
    errors.iter().sum::<f64>() / errors.len() as f64
}

fn with(assembly: &Assembly<Execution>, recording: &Recording<OrderLog>, name: &str, value: f64) -> Assembly<Execution> {
    let candidates = assembly.candidates(std::slice::from_ref(recording));
    let found: &Candidate = candidates.iter().find(|c| c.about.name == name).unwrap();
    let values: Vec<f64> = assembly.parameters().iter().map(|p| p.nominal).chain([value]).collect();
    assembly.with(found).with_values(&values)
}

#[test]
fn simulated_exchanges_are_explained_to_the_cent() {
    for (name, delay, assumed) in
        [("01_market_lat1ms_q50", 0.001_000_014, 0.117), ("02_market_lat250ms_q50", 0.250_000_078, 0.129)]
    {
        let Some(folder) = abides(name) else { continue };
        let (bare, recording) = read(&folder).unwrap();
        let shown = recording.stimulus.shown_delay().and_then(ShownDelay::constant).unwrap();
        println!("{name}: {} orders, shown delay {shown} s, notes {:?}", recording.len(), recording.stimulus.notes());
        assert!((shown - delay).abs() < 1e-7, "{name}: {shown}");
        let held_out = mean_error(&bare, &recording, recording.row_at_fraction(0.7));
        assert!((held_out - assumed).abs() < 5e-4, "{name}: {held_out}");
        let found = [("half_spread", 1.0), ("book_walk", 1.0)];
        let instant = found.iter().fold(bare, |a, (mechanism, value)| with(&a, &recording, mechanism, *value));
        let whole = with(&instant, &recording, "command_delay", delay);
        let (late, exact) = (mean_error(&instant, &recording, 0), mean_error(&whole, &recording, 0));
        println!("{name}: mean |residual| {late} bps at no delay, {exact} bps with it");
        assert!(exact < 1e-6, "{name}: {exact}");
        assert!(late > 10.0 * exact.max(1e-9) || late == exact, "{name}: {late}");
    }
}

#[test]
fn orders_beyond_five_levels_are_left_out_and_the_rest_is_explained() {
    let Some(folder) = abides("03_market_lat1ms_q400") else { return };
    let (bare, recording) = read(&folder).unwrap();
    println!(
        "03: {} orders, shown delay {:?}, notes {:?}",
        recording.len(),
        recording.stimulus.shown_delay().and_then(ShownDelay::constant),
        recording.stimulus.notes()
    );
    let found = [("half_spread", 1.0), ("book_walk", 1.0), ("command_delay", 0.001_000_014)];
    let whole = found.iter().fold(bare, |a, (mechanism, value)| with(&a, &recording, mechanism, *value));
    assert!(mean_error(&whole, &recording, 0) < 1e-6, "{}", mean_error(&whole, &recording, 0));
}

#[test]
fn of_limit_orders_alone_the_mid_after_their_fills_is_looked_at() {
    let Some(folder) = abides("06_passive_join_alt") else { return };
    let (_, recording) = read(&folder).unwrap();
    assert!(recording.is_empty() && recording.stimulus.notes().join("\n").contains("458 of 458 orders are not market"));
    let aspects = OrderLog::aspects(&recording);
    assert!(aspects.iter().any(|aspect| aspect.stimulus.looks() > 0 && aspect.channel("mid").is_some()));
    let twin = TwinFile::read(folder.join("twin.toml")).unwrap();
    assert!(execution_assembly(&twin).is_ok());
}
