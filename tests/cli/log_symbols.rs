//! Order logs of several symbols: each is a recording of its own, wherever its tape is.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use std::fs;

use crate::command_scene::Folder;
use crate::loop_scene::{Market, PHYSICS, RUN};
use trueup::io::TwinFile;
use trueup::market::{OrderLog, execution_logs};
use trueup::sim2real::Recording;

const TWIN: &str = "[twin]\nmodel = \"execution\"\n[assumptions]\nprice = \"mid\"\n\
    [[instrument]]\nsymbol = \"A\"\ntick_size = 0.01\naverage_daily_volume = 1000.0\n\
    [[instrument]]\nsymbol = \"B\"\ntick_size = 0.5\n";
const ORDERS: &str = "order_id,symbol,decided_at,side,qty,type\n\
    1,B,1000000000,buy,2,market\n2,A,1000000000,buy,20,market\n3,A,2000000000,sell,5,market\n4,B,2500000000,sell,2,market\n";
const FILLS: &str = "order_id,filled_at,qty,price,fee\n1,1000000001,2,50.5,0.1\n3,2000000001,5,100.00,0\n2,1000000001,20,100.01,0.2\n4,2500000001,2,50,0\n";
const A: [&str; 2] = ["1000000000,99.99,10,100.01,10", "2000000000,100.00,10,100.02,10"];
const B: [&str; 2] = ["1000000000,50,3,50.5,3", "2500000000,50,3,51,3"];

fn quotes(rows: [&str; 2]) -> String {
    format!("ts,bid,bid_size,ask,ask_size\n{}\n{}\n", rows[0], rows[1])
}

/// A tape of both, told apart by a column.
fn with_symbols() -> String {
    let row = |symbol: &str, row: &str| format!("{symbol},{row}\n");
    let rows = [row("A", A[0]), row("B", B[0]), row("A", A[1]), row("B", B[1])];
    format!("symbol,ts,bid,bid_size,ask,ask_size\n{}", rows.concat())
}

fn scene(files: &[(&str, &str)]) -> Folder {
    let folder = Folder::with(&[("twin.toml", TWIN), ("orders.csv", ORDERS), ("fills.csv", FILLS)]);
    for (name, text) in files {
        fs::create_dir_all(folder.path(name).parent().unwrap()).unwrap();
        fs::write(folder.path(name), text).unwrap();
    }
    folder
}

fn logs(folder: &Folder) -> Result<Vec<Recording<OrderLog>>, String> {
    let shown = |error: trueup::io::InputError| {
        let place = folder.path("");
        error
            .to_string()
            .replace(&place.display().to_string(), "")
            .replace(place.to_str().unwrap().trim_end_matches('/'), "FOLDER")
    };
    let twin = TwinFile::read(folder.path("twin.toml")).map_err(shown)?;
    execution_logs(&twin, &[folder.path("")]).map_err(shown)
}

/// What a log says of a symbol: its name, its instrument's tick, when orders were decided, on what mids, and at what cost.
fn told(log: &Recording<OrderLog>) -> (String, f64, Vec<i64>, Vec<f64>, Vec<Option<f64>>) {
    let orders = log.stimulus.orders();
    (
        log.name.clone(),
        log.stimulus.instrument().tick_size,
        orders.iter().map(|order| order.decided_at.0).collect(),
        orders.iter().map(|order| order.mid).collect(),
        log.channel("cost").unwrap().samples.clone(),
    )
}

#[test]
fn a_symbol_is_a_recording_wherever_its_tape_is() {
    let sections = "[[data]]\nsymbol = \"A\"\nquotes = \"a.csv\"\n[[data]]\nsymbol = \"B\"\nquotes = \"b.csv\"\n";
    let (a, b, both) = (quotes(A), quotes(B), with_symbols());
    let named = format!("{TWIN}[market]\nquotes = \"tape.csv\"\n");
    let listed = format!("{TWIN}{sections}");
    let scenes = [
        scene(&[("quotes.csv", &both)]),
        scene(&[("tape.csv", &both), ("twin.toml", &named)]),
        scene(&[("A/quotes.csv", &a), ("B/quotes.csv", &b)]),
        scene(&[("a.csv", &a), ("b.csv", &b), ("twin.toml", &listed)]),
    ];
    for folder in &scenes {
        let logs = logs(folder).unwrap();
        let told: Vec<_> = logs.iter().map(told).collect();
        assert_eq!(told.len(), 2);
        assert_eq!((told[0].0.as_str(), told[0].1, &told[0].2), ("A", 0.01, &vec![1_000_000_000, 2_000_000_000]));
        assert_eq!((told[1].0.as_str(), told[1].1, &told[1].3), ("B", 0.5, &vec![50.25, 50.5]));
        // Larger than what is displayed: its cost is not known. The other sold half a cent of a spread of two below the mid.
        assert!(told[0].4[0].is_none() && (told[0].4[1].unwrap() - 0.01 / 100.01 * 1e4).abs() < 1e-9);
        assert!((told[1].4[0].unwrap() - 0.25 / 50.25 * 1e4).abs() < 1e-9);
        assert_eq!(logs[0].stimulus.instrument().average_daily_volume, Some(1000.0));
        assert_eq!(logs[1].stimulus.instrument().average_daily_volume, None);
    }
    // Two folders of two symbols each are told apart by both.
    let twin = TwinFile::read(scenes[1].path("twin.toml")).unwrap();
    let names: Vec<String> =
        execution_logs(&twin, &[scenes[0].path(""), scenes[2].path("")]).unwrap().into_iter().map(|log| log.name).collect();
    assert!(names.len() == 4 && names[0].ends_with(" A") && names[3].ends_with(" B") && names[0] != names[2], "{names:?}");
    // A twin that names its tape by instrument keeps its document.
    let twin = TwinFile::read(scenes[3].path("twin.toml")).unwrap();
    assert_eq!(twin.render(&scenes[3].path("")).unwrap(), listed);
}

#[test]
fn ids_are_those_of_a_symbol_where_fills_name_theirs() {
    let orders = ORDERS.replace("\n2,A", "\n1,A").replace("\n4,B", "\n3,B");
    let fills = "symbol,order_id,filled_at,qty,price,fee\nB,1,1000000001,2,50.5,0.1\nA,3,2000000001,5,100.00,0\n\
                 A,1,1000000001,20,100.01,0.2\nB,3,2500000001,2,50,0\n";
    let (both, plain) = (with_symbols(), logs(&scene(&[("quotes.csv", &with_symbols())])).unwrap());
    let named = logs(&scene(&[("quotes.csv", &both), ("orders.csv", &orders), ("fills.csv", fills)])).unwrap();
    assert_eq!(named.iter().map(told).collect::<Vec<_>>(), plain.iter().map(told).collect::<Vec<_>>());
    let error = logs(&scene(&[("quotes.csv", &both), ("orders.csv", &orders)])).unwrap_err();
    insta::assert_snapshot!(error, @r#"
    orders.csv: row 3, column `order_id`: an order of `B` has this id too, and fills do not name their symbol, found "1"
      hint: add a column `symbol` to the fills
    "#);
    let twice = orders.replace("3,A", "1,A");
    let error = logs(&scene(&[("quotes.csv", &both), ("orders.csv", &twice), ("fills.csv", fills)])).unwrap_err();
    insta::assert_snapshot!(error, @r#"
    orders.csv: row 4, column `order_id`: the id is that of data row 2 too, found "1"
      hint: each order has an id of its own; are rows doubled, or days put together that count from 1 again?
    "#);
}

#[test]
fn what_is_wrong_is_said_at_its_row_in_the_file() {
    let both = with_symbols();
    let with = |name: &str, text: &str| logs(&scene(&[("quotes.csv", &both), (name, text)])).unwrap_err();
    insta::assert_snapshot!(with("fills.csv", &FILLS.replace("\n4,", "\n9,")), @r#"
    fills.csv: row 5, column `order_id`: there is no such order, found "9"
      hint: each fill names a row of orders: are both files of one log?
    "#);
    insta::assert_snapshot!(with("orders.csv", &ORDERS.replace("sell,5", "sel,5")), @r#"
    orders.csv: row 4, column `side`: expected `buy` or `sell`, found "sel"
      hint: did you mean `sell`?
    "#);
    insta::assert_snapshot!(with("quotes.csv", &both.replace("B,2500000000,50,", "B,2500000000,-50,")), @"
    quotes.csv: row 5, column `bid`: expected a number that is not negative, found -50
      hint: leave the cell empty where a side has nothing
    ");
    insta::assert_snapshot!(with("quotes.csv", &quotes(A)), @"
    quotes.csv: there are orders of `A`, `B`, and nothing says of which these rows are
      hint: add a column `symbol`, give the twin a [[data]] section for each symbol, or put tapes into folders named as symbols
    ");
    insta::assert_snapshot!(with("quotes.csv", &both.replace("B,", "BB,")), @r#"
    orders.csv: row 2, column `symbol`: there is no tape of this symbol, found "B"
      hint: did you mean `BB`?
    "#);
    insta::assert_snapshot!(with("orders.csv", &ORDERS.replace(",A,", ",C,")), @r#"
    orders.csv: row 3, column `symbol`: the twin declares no such instrument, found "C"
      hint: there are `A` and `B`
    "#);
}

/// One in a hundred orders may be of a symbol without a tape, or rest; they are counted.
#[test]
fn a_few_orders_without_a_tape_are_counted_and_left_out() {
    let more = |count: usize| -> String {
        (0..count).map(|k| format!("x{k},A,{},buy,1,market\n", 1_000_000_001 + k)).collect::<String>()
            + "y,C,1000000000,buy,1,market\n"
    };
    let orders = ORDERS.to_owned() + &more(200);
    let both = with_symbols();
    let found = logs(&scene(&[("quotes.csv", &both), ("orders.csv", &orders)])).unwrap();
    assert_eq!(found.iter().map(Recording::len).collect::<Vec<_>>(), [202, 2]);
    let note = "1 orders of `C` are left out: the twin declares no such instrument";
    assert!(found[0].stimulus.notes().iter().any(|told| told == note), "{:?}", found[0].stimulus.notes());
    let resting = orders
        .replace("y,C,1000000000,buy,1,market", "")
        .replace("1,B,1000000000,buy,2,market", "1,B,1000000000,buy,2,limit");
    let resting = resting.replace("4,B,2500000000,sell,2,market", "4,B,2500000000,sell,2,limit");
    let found = logs(&scene(&[("quotes.csv", &both), ("orders.csv", &resting)])).unwrap();
    assert_eq!(found.len(), 1);
    let notes = found[0].stimulus.notes().join("\n");
    assert!(notes.contains("2 orders of `B` are left out: none of the 2 orders is a market order"), "{notes}");
    let few = ORDERS.to_owned() + &more(5);
    let error = logs(&scene(&[("quotes.csv", &both), ("orders.csv", &few)])).unwrap_err();
    assert!(error.contains("the twin declares no such instrument, found \"C\""), "{error}");
}

/// A run of two instruments, one of which costs more on paper: the report tells which is off, before and after.
#[test]
fn a_reader_can_tell_which_symbol_is_off() {
    let instrument =
        "[[instrument]]\nsymbol = \"XYZ\"\ntick_size = 0.01\naverage_daily_volume = 500_000\ndaily_volatility = 0.009\n\n";
    let data = "[[data]]\nsymbol = \"XYZ\"\nquotes = \"quotes.csv\"\n\n[[data]]\nsymbol = \"XYZ\"\nbars = \"bars.csv\"\nstamp = \"open\"\ninterval = \"5s\"\n\n";
    let second = |text: &str| text.replace("XYZ", "WIDE").replace("quotes.csv", "wide.csv");
    let run = RUN
        .replace(instrument, &(instrument.to_owned() + &second(instrument)))
        .replace(data, &(data.to_owned() + &second(data)));
    assert!(run.matches("WIDE").count() == 3, "{run}");
    let market = Market::new(6_000, 5);
    // The same market with a spread that is ten cents wider.
    let wide = market.quotes.lines().enumerate().map(|(row, line)| {
        let cells = line.split(',').enumerate().map(|(k, cell)| match (row, k) {
            (0, _) | (_, 0) => cell.to_owned(),
            (_, k) if k % 4 == 1 => format!("{:.2}", cell.parse::<f64>().unwrap() - 0.05),
            (_, k) if k % 4 == 3 => format!("{:.2}", cell.parse::<f64>().unwrap() + 0.05),
            _ => cell.to_owned(),
        });
        cells.collect::<Vec<_>>().join(",") + "\n"
    });
    let wide: String = wide.collect();
    let mid = run.replace("seed = 7", "seed = 7\nprice = \"mid\"");
    let paper = mid.clone() + PHYSICS;
    let folder = Folder::with(&[
        ("quotes.csv", &market.quotes),
        ("wide.csv", &wide),
        ("bars.csv", &market.bars),
        ("run.toml", &mid),
        ("paper.toml", &paper),
    ]);
    let (code, _, errors) = folder.run("backtest paper.toml --out paper");
    assert_eq!((code, errors.as_str()), (0, ""));
    let (code, told, errors) = folder.run("diagnose run.toml --recording paper --out told");
    assert_eq!((code, errors.as_str()), (0, ""));
    assert!(told.contains("The same, recording by recording"), "{told}");
    let diagnosis: serde_json::Value = serde_json::from_slice(&folder.bytes("told/diagnosis.json")).unwrap();
    let names: Vec<&str> =
        diagnosis["effects"].as_array().unwrap().iter().map(|effect| effect["mechanism"].as_str().unwrap()).collect();
    assert!(names.contains(&"half_spread") && names.contains(&"commission"), "{names:?}");
    let of = |symbol: &str| {
        let all = diagnosis["where"]["recordings"].as_array().unwrap();
        let own = all.iter().find(|error| error["recording"] == symbol && error["channel"] == "cost").unwrap();
        ["share_of_error", "nominal_rmse", "trued_rmse"].map(|key| own[key].as_f64().unwrap())
    };
    let ([narrow, narrow_before, narrow_after], [share, before, after]) = (of("XYZ"), of("WIDE"));
    assert!(share > 0.7 && (narrow + share - 1.0).abs() < 1e-9, "{share}");
    assert!(after < 0.5 * before && narrow_after < narrow_before, "{before} {after} {narrow_before} {narrow_after}");
    let page = fs::read_to_string(folder.path("told/report.html")).unwrap();
    assert!(page.contains("The same recording by recording") && page.contains("<th scope=\"row\">WIDE</th>"));
    let (code, _, errors) = folder.run("backtest told/trued.toml");
    assert_eq!((code, errors.as_str()), (0, ""));
}

/// A tape without symbols is read some rows at a time, one with symbols as a whole; both are put in order of time.
#[test]
fn a_tape_is_the_same_read_whole_or_in_pieces() {
    const ROWS: i64 = 70_000;
    let mut rows: Vec<String> =
        (0..ROWS).map(|k| format!("{},{}.5,{},{}.5,7", k * 1_000_000, 100 + k % 7, 1 + k % 5, 101 + k % 7)).collect();
    // Rows of the first block and of the last change places, and of two of one time the order of the file is kept.
    rows.swap(10, 69_000);
    rows.insert(500, "499000000,1.5,1,2.5,7".to_owned());
    let orders: String = (0..300_i64).map(|k| format!("o{k},A,{},buy,2,market\n", 5_000_000 + k * 233_000_000)).collect();
    let fills: String = (0..300_i64).map(|k| format!("o{k},{},2,103.5,0\n", 5_000_000 + k * 233_000_000)).collect();
    let orders = format!("order_id,symbol,decided_at,side,qty,type\n{orders}x,A,499000000,sell,1,market\n");
    let fills = format!("order_id,filled_at,qty,price,fee\n{fills}");
    let plain = format!("ts,bid,bid_size,ask,ask_size\n{}\n", rows.join("\n"));
    let named: String = rows.iter().map(|row| format!("A,{row}\n")).collect();
    let named = format!("symbol,ts,bid,bid_size,ask,ask_size\n{named}");
    let [pieces, whole] = [plain, named].map(|quotes| {
        let files = [("quotes.csv", quotes.as_str()), ("orders.csv", &orders), ("fills.csv", &fills)];
        logs(&scene(&files)).unwrap().remove(0)
    });
    assert_eq!(pieces.stimulus.tape(), whole.stimulus.tape());
    assert_eq!((pieces.stimulus.tape().quotes().len(), &pieces.measured), (70_001, &whole.measured));
    assert!(pieces.stimulus.tape().quotes().times().is_sorted());
    // Of two quotes of one time the one that stands later in the file is the last.
    let last = pieces.stimulus.orders().iter().find(|order| order.decided_at.0 == 499_000_000).unwrap();
    assert_eq!(last.mid, 0.5 * (1.5 + 2.5));
}
