//! A RUN.toml as an execution twin: it is diagnosed, trued, run again, and brings twins.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use std::path::{Path, PathBuf};

use crate::command_scene::Folder;
use crate::loop_scene::{Market, PHYSICS, RUN, first, run_with, second};
use serde_json::Value;
use trueup::io::{OutputFolder, Overwrite, RunFile, TwinFile};
use trueup::market::{
    Orders, PriceAssumption, Quantity, Side, Strategy, Ticket, View, execution_assembly, execution_logs, prepare_run,
};
use trueup::sim2real::{Simulator, Timestamp, Twin};

/// The profit and loss of a log less that of a backtest, and what execution made of it, cause by cause, with their bands.
struct Gap {
    whole: f64,
    execution: f64,
    /// Whether 0 is where chance alone would put each of the causes that are of execution.
    within_bands: bool,
}

fn gap(folder: &Folder, run: &str, backtest: &str, paper: &str) -> Gap {
    let found = folder.json(&format!("reconcile --backtest {backtest} --paper {paper} --run {run}"));
    let gap = &found["gaps"][0];
    let causes: Vec<&Value> = gap["causes"].as_array().map(|causes| causes.iter().collect()).unwrap_or_default();
    let of_execution = ["queue_fill", "latency", "spread", "impact", "price", "fees"];
    let own: Vec<&Value> =
        causes.into_iter().filter(|cause| of_execution.contains(&cause["cause"].as_str().unwrap())).collect();
    let within = |cause: &&Value| {
        let end = |k: usize| cause["ci95"][k].as_f64().unwrap();
        end(0) <= 0.0 && 0.0 <= end(1)
    };
    Gap {
        whole: gap["gap"].as_f64().unwrap_or_default(),
        execution: own.iter().map(|cause| cause["amount"].as_f64().unwrap()).sum(),
        within_bands: own.iter().all(within),
    }
}

/// A run with two days of market beside it.
fn scene(files: &[(&str, &str)]) -> Folder {
    let market = Market::new(28_800, 3);
    let folder = Folder::with(&[("quotes.csv", &market.quotes), ("bars.csv", &market.bars), ("run.toml", RUN)]);
    for (name, text) in files {
        std::fs::write(folder.path(name), text).unwrap();
    }
    folder
}

fn done(folder: &Folder, arguments: &str) -> String {
    let (code, told, errors) = folder.run(arguments);
    assert_eq!((code, errors.as_str()), (0, ""), "{arguments}: {told}");
    told
}

/// The first day tells what is missing, and on the second the backtest with it comes to what paper came to.
#[test]
fn what_the_first_day_tells_closes_the_gap_of_the_second() {
    let (on_paper, brings) = (second() + PHYSICS, second() + "\n[execution]\ntwin = \"told/trued.toml\"\n");
    let folder = scene(&[
        ("first.toml", &first()),
        ("second.toml", &second()),
        ("paper1.toml", &(first() + PHYSICS)),
        ("paper2.toml", &on_paper),
        ("trued2.toml", &brings),
    ]);
    for (run, out) in [("paper1", "paper1"), ("paper2", "paper2"), ("second", "before")] {
        done(&folder, &format!("backtest {run}.toml --out {out}"));
    }
    let paper = "paper2/orders.parquet paper2/fills.parquet";
    let before = gap(&folder, "second.toml", "before", paper);
    assert!(before.whole < -100.0 && !before.within_bands, "{}", before.whole);

    let told = done(&folder, "diagnose first.toml --recording paper1 --out told");
    assert!(told.starts_with("named: "), "{told}");
    let trued = std::fs::read_to_string(folder.path("told/trued.toml")).unwrap();
    for name in ["commission", "book_walk", "command_delay"] {
        assert!(trued.contains(&format!("name = \"{name}\"")), "{trued}");
    }
    // A walk would have the run start from the mid: it was found beyond the touch.
    assert!(trued.contains("price = \"touch\"\n") && trued.contains("currency = \"USD\"   # as the account\n"), "{trued}");
    done(&folder, "backtest told/trued.toml");

    done(&folder, "backtest trued2.toml --out after");
    let after = gap(&folder, "trued2.toml", "after", paper);
    println!("gap: {} before, {} after", before.whole, after.whole);
    assert!(after.whole.abs() < 1e-3 * before.whole.abs() && after.within_bands, "{} {}", before.whole, after.whole);
    let run: Value = serde_json::from_slice(&folder.bytes("after/run.json")).unwrap();
    assert_eq!(run["reference"], "touch");
    let inputs = run["inputs"].as_array().unwrap();
    let twin = inputs.iter().find(|input| input["path"] == "told/trued.toml").unwrap();
    assert_eq!(twin["sha256"], trueup::io::file_hash(folder.path("told/trued.toml")).unwrap());

    // Trued on what it was trued on, nothing is missing; and a run that brings a twin is one as well.
    for twin in ["told/trued.toml", "trued1.toml"] {
        std::fs::write(folder.path("trued1.toml"), first() + "\n[execution]\ntwin = \"told/trued.toml\"\n").unwrap();
        let found = folder.json(&format!("diagnose {twin} --recording paper1"));
        assert_eq!(found["verdict"], "no_mismatch", "{twin}: {}", found["summary"]);
    }
}

/// Sends the orders of a log when they were decided: the strategy that made it, as far as the log tells.
struct Decided {
    due: Vec<(Timestamp, Side, f64)>,
    next: usize,
}

impl Decided {
    /// The market orders of a table in the form of the contract, from `start` on.
    fn from(orders: &str, start: Timestamp) -> Self {
        let rows = orders.lines().skip(1).map(|row| row.split(',').collect::<Vec<&str>>());
        let due = rows.map(|cells| {
            let side = if cells[3] == "buy" { Side::Buy } else { Side::Sell };
            (Timestamp(cells[2].parse().unwrap()), side, cells[4].parse().unwrap())
        });
        let mut due: Vec<_> = due.filter(|(at, ..)| *at >= start).collect();
        due.sort_by_key(|(at, ..)| *at);
        Self { due, next: 0 }
    }
}

impl Strategy for Decided {
    fn name(&self) -> &str {
        "decided"
    }
    fn lookback(&self) -> usize {
        1
    }
    fn on_event(&mut self, view: &View<'_>, orders: &mut Orders) {
        let now = view.event().time;
        while let Some((_, side, quantity)) = self.due.get(self.next).filter(|(at, ..)| *at <= now) {
            orders.submit(Ticket::market(0, *side, Quantity::nearest(*quantity).unwrap()));
            self.next += 1;
        }
        if let Some((at, ..)) = self.due.get(self.next) {
            orders.wake_at(*at);
        }
    }
}

/// The same with the log of an exchange that is not ours: of agents, whose market orders take 250 ms. What a diagnosis holds out is
/// the last 30 % in time, from 10:55:20 on: there the backtest is tried with the decisions of the log.
#[test]
fn an_exchange_of_agents_is_met_after_it_was_diagnosed() {
    const HELD_OUT: &str = "2021-02-05T10:56:00Z";
    let start = Timestamp(1_612_522_560_000_000_000);
    let log = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/market/abides/02_market_lat250ms_q50");
    if !log.is_dir() {
        println!("skipped: there is no {}", log.display());
        return;
    }
    let run = format!(
        "[run]\nseed = 1\ncash = 10_000_000\ncurrency = \"USD\"\nMORE\n\n[[instrument]]\n\
         symbol = \"ABM\"\ntick_size = 0.01\naverage_daily_volume = 1_000_926\ndaily_volatility = 0.012\n\n\
         [[data]]\nsymbol = \"ABM\"\nquotes = \"{0}/quotes.parquet\"\n\n[[data]]\nsymbol = \"ABM\"\n\
         trades = \"{0}/trades.parquet\"\n\n[strategy]\nkind = \"buy_and_hold\"\n",
        log.display()
    );
    let second = run.replace("MORE", &format!("start = \"{HELD_OUT}\"\nmax_leverage = 10.0"));
    let brings = second.clone() + "\n[execution]\ntwin = \"told/trued.toml\"\n";
    let [orders, fills] = ["orders.csv", "fills.csv"].map(|name| std::fs::read_to_string(log.join(name)).unwrap());
    let late = |row: &str, column: usize| row.split(',').nth(column).unwrap().parse().map_or(true, |at: i64| at >= start.0);
    let kept = |text: &str, column: usize| -> String {
        text.lines().filter(|row| late(row, column)).map(|row| row.to_owned() + "\n").collect()
    };
    let folder = Folder::with(&[
        ("run.toml", &run.replace("MORE", "")),
        ("second.toml", &second),
        ("trued2.toml", &brings),
        ("orders.csv", &kept(&orders, 2)),
        ("fills.csv", &kept(&fills, 1)),
    ]);
    let told = done(&folder, &format!("diagnose run.toml --recording {} --out told", log.display()));
    assert!(told.starts_with("named: "), "{told}");
    let [before, after] = [("second", "before"), ("trued2", "after")].map(|(run, out)| {
        let prepared = prepare_run(&RunFile::read(folder.path(&format!("{run}.toml"))).unwrap()).unwrap();
        let record = prepared.backtest.run(&mut Decided::from(&orders, start)).unwrap();
        let mut output = OutputFolder::create(folder.path(out), Overwrite::Refuse).unwrap();
        prepared.outputs(&record).unwrap().write(&mut output).unwrap();
        output.finish().unwrap();
        gap(&folder, &format!("{run}.toml"), out, "orders.csv fills.csv")
    });
    println!(
        "gap: {} before, {} after; of execution {} and {}",
        before.whole, after.whole, before.execution, after.execution
    );
    // What is left of the whole is an order at whose decision one side of the quotes was empty: no run could fill it.
    assert!(!before.within_bands && after.within_bands);
    assert!(after.execution.abs() < 0.01 * before.execution.abs() && after.whole.abs() < before.whole.abs());
}

/// The levels of quotes as changes of a book.
fn book(quotes: &str) -> String {
    let mut rows = "ts,side,price,size,action\n".to_owned();
    for line in quotes.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        for side in ["bid", "ask"] {
            rows += &format!("{},{side},1,0,clear\n", cells[0]);
        }
        for level in cells[1..].chunks(4) {
            rows += &format!("{0},bid,{1},{2},set\n{0},ask,{3},{4},set\n", cells[0], level[0], level[1], level[2], level[3]);
        }
    }
    rows
}

/// What a run assumes of its orders is what its venue does.
#[test]
fn a_run_assumes_what_its_venue_does() {
    let folder = scene(&[]);
    done(&folder, "backtest run.toml --out log");
    let bars = RUN.replace("[[data]]\nsymbol = \"XYZ\"\nquotes = \"quotes.csv\"\n", "");
    let spread = RUN.to_owned() + "\n[[mechanism]]\nname = \"half_spread\"\nfraction = 1.0\n";
    let both = RUN.to_owned() + "\n[twin]\nmodel = \"execution\"\n[assumptions]\nprice = \"mid\"\ncommission_bps = 0.5\n";
    let cases = [
        (RUN.to_owned(), PriceAssumption::Touch, true, 0),
        (run_with("price = \"mid\""), PriceAssumption::Mid, true, 0),
        (bars, PriceAssumption::NextOpen, false, 0),
        (spread, PriceAssumption::Mid, true, 1),
        (both, PriceAssumption::Mid, true, 1),
    ];
    for (text, price, quoted, mechanisms) in cases {
        std::fs::write(folder.path("other.toml"), &text).unwrap();
        let twin = TwinFile::read(folder.path("other.toml")).unwrap();
        let log = execution_logs(&twin, &[folder.path("log")]).unwrap().remove(0);
        assert_eq!((log.stimulus.price(), log.stimulus.tape().quotes().is_empty()), (price, !quoted), "{text}");
        assert_eq!(log.stimulus.tape().bars().is_empty(), quoted);
        let assembly = execution_assembly(&twin).unwrap();
        assert_eq!(assembly.modelled().len(), mechanisms);
        // The backtest has the same mechanisms, and starts from the same price.
        let run = prepare_run(&RunFile::read(folder.path("other.toml")).unwrap()).unwrap();
        assert_eq!(run.backtest.venue().modelled(), assembly.modelled());
        if quoted {
            assert_eq!(format!("{:?}", run.provenance.reference), format!("{price:?}"), "{text}");
        }
    }
    // Orders meet the displayed levels of a book as they meet quotes.
    std::fs::write(folder.path("book.csv"), book(&std::fs::read_to_string(folder.path("quotes.csv")).unwrap())).unwrap();
    let with_book = run_with("price = \"mid\"").replace("quotes = \"quotes.csv\"", "book = \"book.csv\"");
    let quoted = run_with("price = \"mid\"");
    let [by_book, by_quotes] = [with_book, quoted].map(|text| {
        std::fs::write(folder.path("other.toml"), &text).unwrap();
        prepare_run(&RunFile::read(folder.path("other.toml")).unwrap()).unwrap();
        let twin = TwinFile::read(folder.path("other.toml")).unwrap();
        execution_logs(&twin, &[folder.path("log")]).unwrap().remove(0)
    });
    assert_eq!(by_book.stimulus.orders(), by_quotes.stimulus.orders());
    assert_eq!(by_book.measured, by_quotes.measured);
    // Orders that the run does not count are left out, and said.
    std::fs::write(folder.path("first.toml"), first()).unwrap();
    let twin = TwinFile::read(folder.path("first.toml")).unwrap();
    let log = execution_logs(&twin, &[folder.path("log")]).unwrap().remove(0);
    assert!(log.stimulus.notes().iter().any(|note| note.contains("decided outside `start` and `end`")));
    std::fs::write(folder.path("early.toml"), run_with("end = \"2024-01-01T00:00:00Z\"")).unwrap();
    let refused = folder.refused("diagnose early.toml --recording log");
    assert!(refused.contains("no order was decided between `start` and `end` of the run"), "{refused}");
}

/// Latencies of a run delay its orders: what is found is the delay, which then stands once.
#[test]
fn latencies_of_a_run_are_delays_that_it_models() {
    let late = RUN.to_owned() + "\n[latency]\norder = 0.4\ncompute = 0.1\nresponse = 0.05   # and back\n";
    let folder = scene(&[("late.toml", &late)]);
    let assembly = |text: &str| {
        std::fs::write(folder.path("late.toml"), text).unwrap();
        TwinFile::read(folder.path("late.toml")).and_then(|twin| execution_assembly(&twin))
    };
    let delay = assembly(&late).unwrap();
    assert_eq!((delay.modelled(), delay.parameters()[0].nominal), (vec!["command_delay"], 0.5));
    let more = late.clone() + "\n[[mechanism]]\nname = \"command_delay\"\nseconds = 1.0\n";
    assert_eq!(assembly(&more).unwrap().parameters()[0].nominal, 1.5);
    done(&folder, "backtest late.toml --out log");
    done(&folder, "calibrate late.toml --recording log --out out/calibrated.toml");
    let text = std::fs::read_to_string(folder.path("out/calibrated.toml")).unwrap();
    assert!(text.contains("[latency]\nresponse = 0.05   # and back\n") && !text.contains("order = "), "{text}");
    assert!(text.contains("quotes = \"../quotes.csv\"") && text.contains("bars = \"../bars.csv\""), "{text}");
    let back = RunFile::read(folder.path("out/calibrated.toml")).unwrap();
    assert!((back.mechanisms[0].parameters[0].1.value - 1.5).abs() < 0.3, "{text}");
    let uneven = late.replace("order = 0.4", "order = { kind = \"uniform\", least = 0.1, most = 0.2 }");
    let refused = assembly(&uneven).unwrap_err().to_string();
    assert!(refused.contains("knows constant latencies alone") && refused.contains("hint: give seconds"), "{refused}");
}

#[test]
fn a_twin_is_brought_by_one_line_and_what_contradicts_it_is_refused() {
    let twin = "[twin]\nmodel = \"execution\"\n[assumptions]\nprice = \"mid\"\ncommission_bps = 0.5\n\
                [[mechanism]]\nname = \"half_spread\"\nfraction = 0.9\n";
    let brings = RUN.to_owned() + "\n[execution]\ntwin = \"trued.toml\"\n";
    let folder = scene(&[("trued.toml", twin), ("brings.toml", &brings)]);
    let run = prepare_run(&RunFile::read(folder.path("brings.toml")).unwrap()).unwrap();
    assert_eq!(run.backtest.venue().modelled(), ["half_spread", "commission"]);
    assert_eq!(format!("{:?}", run.provenance.reference), "Mid");
    let refused = |name: &str, text: &str, expected: &str| {
        std::fs::write(folder.path(name), text).unwrap();
        let said = folder.refused("backtest brings.toml");
        assert!(said.contains(expected), "{said}");
    };
    let with = |more: &str| format!("{brings}\n{more}");
    let spread = "[[mechanism]]\nname = \"half_spread\"\nfraction = 1.0\n";
    refused("brings.toml", &with(spread), "`half_spread` is listed here and in ");
    refused("brings.toml", &with(spread), "trued.toml:7:1");
    refused(
        "brings.toml",
        &with("[[mechanism]]\nname = \"commission\"\nbps = 1.0\n"),
        "a commission among the mechanisms too, in ",
    );
    let touch = run_with("price = \"touch\"") + "\n[execution]\ntwin = \"trued.toml\"\n";
    refused("brings.toml", &touch, "the run starts from the price \"touch\", its twin from \"mid\"");
    refused("brings.toml", &with("").replace("trued.toml", "treud.toml"), "did you mean");
    refused("brings.toml", &with("").replace("twin =", "twins ="), "did you mean `twin`?");
    refused("brings.toml", &with("").replace("trued.toml", "brings.toml"), "brings.toml brings a twin itself");
    refused(
        "brings.toml",
        &with("[assumptions]\nprice = \"mid\"\n"),
        "a run has no section [assumptions], unless it is a twin too",
    );
    std::fs::write(folder.path("brings.toml"), &brings).unwrap();
    let walk = twin.replace("half_spread", "book_walk");
    let market = Market::new(400, 1);
    let sizeless = market.quotes.lines().enumerate().map(|(row, line)| {
        let cells: Vec<&str> = line.split(',').collect();
        let size = |k: usize| if row == 0 { cells[k] } else { "" };
        format!("{},{},{},{},{}\n", cells[0], cells[1], size(2), cells[3], size(4))
    });
    let quotes = std::fs::read_to_string(folder.path("quotes.csv")).unwrap();
    std::fs::write(folder.path("quotes.csv"), sizeless.collect::<String>()).unwrap();
    refused("trued.toml", &walk, "`book_walk` needs sizes in the quotes, and there are none of `XYZ`");
    std::fs::write(folder.path("quotes.csv"), quotes).unwrap();
    refused("trued.toml", "[twin]\nmodel = \"joint\"\n", "is a twin of the model `joint`");
    std::fs::write(folder.path("trued.toml"), twin).unwrap();
    let alone = folder.refused("backtest trued.toml");
    assert!(
        alone.contains("hint: name it in a RUN.toml, with the two lines [execution] and twin = \"trued.toml\""),
        "{alone}"
    );
    std::fs::write(folder.path("brings.toml"), RUN.to_owned() + "\n[twin]\nmodel = \"joint\"\n").unwrap();
    let joint = folder.refused("diagnose brings.toml --recording .");
    assert!(joint.contains("what is run is a twin of the model `execution`"), "{joint}");
}

/// Whatever document a run is, what is written after a fit says the same as the fitted twin, wherever it is written.
#[test]
fn a_trued_run_reads_back_as_what_was_fitted() {
    let listed = RUN.to_owned()
        + "\n[[mechanism]] # dear\nname = \"half_spread\"\nfraction = { value = 1.0, uncertainty = 0.5 } # a guess\n";
    let folder = scene(&[("run.toml", &listed)]);
    std::fs::create_dir(folder.path("deep")).unwrap();
    let mut twin = TwinFile::read(folder.path("run.toml")).unwrap();
    twin.mechanisms[0].parameters[0].1.value = 0.75;
    twin.mechanisms.push(trueup::io::MechanismEntry {
        name: "commission".to_owned(),
        parameters: vec![("bps".to_owned(), trueup::io::Quantity::with_std(0.8, 0.01, "bps"))],
    });
    for out in [folder.path("deep"), folder.path("")] {
        let text = twin.render(&out).unwrap();
        assert!(text.contains("[[mechanism]] # dear\n") && text.contains(" } # a guess\n"), "{text}");
        std::fs::write(out.join("trued.toml"), &text).unwrap();
        let back = TwinFile::read(out.join("trued.toml")).unwrap();
        assert_eq!(back.mechanisms, twin.mechanisms);
        let real =
            |twin: &TwinFile| -> Vec<PathBuf> { twin.data.iter().map(|data| data.path.canonicalize().unwrap()).collect() };
        assert_eq!(real(&back), real(&twin));
        assert_eq!((&back.instruments, back.run.unwrap().run), (&twin.instruments, twin.run.as_ref().unwrap().run.clone()));
    }
}
