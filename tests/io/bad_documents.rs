//! Twins and runs that say what cannot be: each gives an error with place and hint, and no damage to one a panic.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may stop where it fails")]

use std::fs;

use crate::scene::Scene;
use proptest::prelude::*;
use trueup::io::{Document, RunFile, TwinFile};

const TWIN: &str = "\
[twin]
model = \"joint\"
[parameters]
inertia = { value = 0.11, unit = \"kg m^2\", uncertainty = 0.2 }
gain = { value = 1, unit = \"N m per unit\" }
[channels]
command = { column = \"u\" }
position = { column = \"q\", unit = \"deg\" }
[[mechanism]]
name = \"coulomb_friction\"
torque = { value = 0.12, unit = \"N m\", uncertainty = 0.01 }
width = 0.5
";

fn twin(change: &str, to: &str) -> String {
    assert!(TWIN.contains(change));
    TwinFile::parse(Document::from_text("twin.toml", TWIN.replacen(change, to, 1))).expect_err("an error").to_string()
}

#[test]
fn a_twin_is_held_to_its_contract() {
    insta::assert_snapshot!(twin("model", "modle"), @"
    twin.toml:2:1: unknown key `modle`
      hint: did you mean `model`?
    ");
    insta::assert_snapshot!(twin("[channels]", "[channel]"), @"
    twin.toml:6:2: unknown key `channel`
      hint: did you mean `channels`?
    ");
    insta::assert_snapshot!(twin("value = 0.11", "value = \"heavy\""), @r#"
    twin.toml:4:21: expected a number, found string "heavy"
      hint: write numbers without quotes and without a unit
    "#);
    insta::assert_snapshot!(twin("value = 0.11", "value = nan"), @"
    twin.toml:4:1: expected a finite number, found NaN
      hint: a twin needs a nominal value, if only a rough one
    ");
    insta::assert_snapshot!(twin("uncertainty = 0.2", "uncertainty = -0.2"), @"
    twin.toml:4:44: expected a finite uncertainty that is not negative, found -0.2
      hint: it is the standard deviation as a fraction of the value: 0.2 for 20 %, 0 for known exactly
    ");
    insta::assert_snapshot!(twin("uncertainty = 0.2", "uncertanty = 0.2"), @"
    twin.toml:4:44: unknown key `uncertanty`
      hint: did you mean `uncertainty`?
    ");
    insta::assert_snapshot!(twin("width = 0.5", "width = true"), @r#"twin.toml:12:9: expected a number or { value = ..., unit = "...", uncertainty = ... }, found boolean `true`"#);
    insta::assert_snapshot!(twin("width = 0.5", "width = inf"), @"
    twin.toml:12:1: expected a finite number, found inf
      hint: a twin needs a nominal value, if only a rough one
    ");
    insta::assert_snapshot!(twin("width = 0.5", "[[mechanism]]\nname = \"coulomb_friction\""), @"
    twin.toml:13:1: the mechanism `coulomb_friction` is here twice
      hint: drop one of the two, or give one the effect of both
    ");
    insta::assert_snapshot!(twin("name = \"coulomb_friction\"", ""), @"
    twin.toml:9:1: the key `name` is missing
      hint: add `name = ...` or a section `[name]`
    ");
    insta::assert_snapshot!(twin("column = \"u\"", "colum = \"u\""), @"
    twin.toml:7:13: unknown key `colum`
      hint: did you mean `column`?
    ");
    let file = TwinFile::parse(Document::from_text("twin.toml", TWIN)).unwrap();
    let position = &file.channels["position"];
    let mismatch = file.check_unit(&["channels", "position", "unit"], position.unit.as_deref(), "rad").unwrap_err();
    insta::assert_snapshot!(mismatch, @"
    twin.toml:8:28: expected the unit `rad`, found `deg`
      hint: convert the values first: 1 deg = 0.0174532925 rad
    ");
}

#[test]
fn a_twin_reads_back_as_it_was_rendered_and_still_finds_its_files() {
    let market = "[twin]\nmodel = 'execution'\n[assumptions]\nprice = 'bar_close'\ncommission_per_share = 0.005\n[[instrument]]\n\
        symbol = 'X \"Y\"'\ntick_size = 0.01\naverage_daily_volume = 4_000_000\n[market]\nbars = 'bars.csv'\nstamp = 'close'\n\
        zone = 'America/New_York'\ntime_unit = 'ms'\nprice_scale = 1e-4\ncolumns = { ts = 'when is' }\n";
    let scene = Scene::new().with("bars.csv", "ts\n1\n").with("joint.toml", TWIN).with("market.toml", market);
    for name in ["joint.toml", "market.toml"] {
        let twin = TwinFile::read(scene.path(name)).unwrap();
        let out = scene.path("out/deep");
        let text = twin.render(&out).unwrap();
        fs::create_dir_all(&out).unwrap();
        fs::write(out.join(name), &text).unwrap();
        let back = TwinFile::read(out.join(name)).unwrap();
        assert_eq!((&back.model, &back.parameters, &back.channels), (&twin.model, &twin.parameters, &twin.channels));
        assert_eq!((&back.mechanisms, &back.instruments), (&twin.mechanisms, &twin.instruments));
        assert_eq!(back.assumptions, twin.assumptions);
        assert_eq!(back.market.as_ref().map(|m| &m.format), twin.market.as_ref().map(|m| &m.format));
        assert_eq!(back.render(&out).unwrap(), text);
        assert!(!text.contains(&scene.0.path().display().to_string()), "{text}");
    }
    fs::remove_file(scene.path("bars.csv")).unwrap();
    let scene = scene.with("bar.csv", "");
    insta::assert_snapshot!(scene.shown(TwinFile::read(scene.path("market.toml"))), @"
    market.toml:11:1: names the file bars.csv, but there is no such file
      hint: did you mean bar.csv?
    ");
    let scene = scene.with("market.toml", market.replace("bar_close", "midle"));
    insta::assert_snapshot!(scene.shown(TwinFile::read(scene.path("market.toml"))), @"
    market.toml:4:9: unknown value `midle`
      hint: did you mean `mid`?
    ");
    let scene = scene.with("market.toml", market.replace("America/New_York", "new york"));
    insta::assert_snapshot!(scene.shown(TwinFile::read(scene.path("market.toml"))), @"
    market.toml:13:8: unknown time zone `new york`
      hint: did you mean `America/New_York`?
    ");
    let scene = scene.with("market.toml", market.replace("stamp = 'close'", ""));
    insta::assert_snapshot!(scene.shown(TwinFile::read(scene.path("market.toml"))), @r#"
    market.toml:10:2: bars need a `stamp`, which is missing
      hint: say what a bar's time is: stamp = "open" or stamp = "close" of the bar
    "#);
}

const RUN: &str = "\
[run]
seed = 7
cash = 1_000_000
currency = \"USD\"
start = \"2013-10-07T09:30:00-04:00\"
end = 2013-10-08T00:00:00Z
[[instrument]]
symbol = \"SPY\"
tick_size = 0.01
[[data]]
symbol = \"SPY\"
bars = \"bars.csv\"
stamp = \"open\"
zone = \"America/New_York\"
columns = { ts = \"ts_exchange_local\" }
[strategy]
kind = \"sma_cross\"
fast = 10
slow = 50
[[mechanism]]
name = \"half_spread\"
bps = 1.0
";

#[derive(Debug, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct Averages {
    fast: u32,
    slow: u32,
}

fn run(change: &str, to: &str) -> String {
    assert!(RUN.contains(change));
    let scene = Scene::new().with("bars.csv", "ts\n1\n").with("run.toml", RUN.replacen(change, to, 1));
    let read = RunFile::read(scene.path("run.toml"));
    scene.shown(read.and_then(|run| run.strategy_settings::<Averages>()))
}

#[test]
fn a_run_is_held_to_its_contract() {
    let scene = Scene::new().with("bars.csv", "ts\n1\n").with("run.toml", RUN);
    let file = RunFile::read(scene.path("run.toml")).unwrap();
    assert_eq!(file.strategy_settings::<Averages>().unwrap(), Averages { fast: 10, slow: 50 });
    assert_eq!(file.run.start.unwrap().to_string(), "2013-10-07T13:30:00Z");
    assert_eq!(file.run.end.unwrap().to_string(), "2013-10-08T00:00:00Z");
    assert_eq!(
        (file.data[0].path.clone(), file.data[0].format.time.zone),
        (scene.path("bars.csv"), chrono_tz::Tz::America__New_York)
    );
    assert_eq!(file.mechanisms[0].parameter("bps").unwrap().value, 1.0);
    insta::assert_snapshot!(run("slow = 50", "slaw = 50"), @"
    run.toml:19:1: unknown key `slaw`
      hint: did you mean `slow`?
    ");
    insta::assert_snapshot!(run("slow = 50", "slow = -1"), @"run.toml:19:8: expected an integer, 0 or more, found integer `-1`");
    insta::assert_snapshot!(run("slow = 50", ""), @"
    run.toml:16:1: the key `slow` is missing
      hint: add `slow = ...` or a section `[slow]`
    ");
    insta::assert_snapshot!(run("kind =", "knd ="), @"
    run.toml:16:1: the key `kind` is missing
      hint: add `kind = ...` or a section `[kind]`
    ");
    insta::assert_snapshot!(run("seed = 7", "seed = 7\nsede = 7"), @"
    run.toml:3:1: unknown key `sede`
      hint: did you mean `seed`?
    ");
    insta::assert_snapshot!(run("cash = 1_000_000", "cash = -1"), @"
    run.toml:3:1: expected a finite number that is not negative, found -1
      hint: it is what the run starts with
    ");
    insta::assert_snapshot!(run("2013-10-07T09:30:00-04:00", "yesterday"), @r#"
    run.toml:5:9: expected an instant, found "yesterday"
      hint: such as "2024-03-08T14:30:00Z" (RFC 3339)
    "#);
    insta::assert_snapshot!(run("2013-10-07T09:30:00-04:00", "2014-10-07T09:30:00-04:00"), @"
    run.toml:6:1: expected an end after the start, 2014-10-07T13:30:00Z, found 2013-10-08T00:00:00Z
      hint: swap or correct them
    ");
    insta::assert_snapshot!(run("stamp = \"open\"\n", ""), @r#"
    run.toml:10:1: bars need a `stamp`, which is missing
      hint: say what a bar's time is: stamp = "open" or stamp = "close" of the bar
    "#);
    insta::assert_snapshot!(run("stamp = \"open\"", "stamp = \"opne\""), @"
    run.toml:13:9: unknown value `opne`
      hint: did you mean `open`?
    ");
    insta::assert_snapshot!(run("stamp = \"open\"", "stamp = \"open\"\ninterval = \"a minute\""), @r#"
    run.toml:14:12: expected the length of a bar, found "a minute"
      hint: a whole number and a unit: "1s", "5m", "1h", "1d"
    "#);
    insta::assert_snapshot!(run("stamp = \"open\"", "trades = \"bars.csv\""), @"
    run.toml:10:1: expected exactly one of `bars`, `quotes`, `trades`, `book` and `actions`
      hint: a second file of the same instrument has a [[data]] section of its own
    ");
    insta::assert_snapshot!(run("bars = \"bars.csv\"", "bars = \"bas.csv\""), @"
    run.toml:12:1: names the file bas.csv, but there is no such file
      hint: did you mean bars.csv?
    ");
    insta::assert_snapshot!(run("bars = \"bars.csv\"", "bars = \"spy/minute_2024.parquet\""), @"
    run.toml:12:1: names the file spy/minute_2024.parquet, but there is no such file
      hint: paths start from the folder of this document: there is no folder spy either
    ");
    insta::assert_snapshot!(run("bars = \"bars.csv\"", "bars = \"minute_2024.parquet\""), @"
    run.toml:12:1: names the file minute_2024.parquet, but there is no such file
      hint: paths start from the folder of this document: in the folder FOLDER there are bars.csv, run.toml
    ");
    insta::assert_snapshot!(run("[[data]]\nsymbol = \"SPY\"", "[[data]]\nsymbol = \"SPI\""), @"
    run.toml:11:1: there is no [[instrument]] with the symbol `SPI`
      hint: did you mean `SPY`?
    ");
    insta::assert_snapshot!(run("tick_size = 0.01", "tick_size = 0"), @"
    run.toml:9:1: expected a finite number greater than 0, found 0
      hint: correct the value, or leave the key out where it may be
    ");
    insta::assert_snapshot!(run("[strategy]\nkind = \"sma_cross\"\nfast = 10\nslow = 50\n", ""), @"
    run.toml:1:1: the key `strategy` is missing
      hint: add `strategy = ...` or a section `[strategy]`
    ");
    insta::assert_snapshot!(run("[[data]]", "[[data]"), @"run.toml:10:8: unclosed array table, expected `]`");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_damaged_document_makes_a_reader_panic(
        places in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4),
        run in any::<bool>(),
    ) {
        let mut bytes = if run { RUN } else { TWIN }.as_bytes().to_vec();
        for (at, byte) in places {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        let scene = Scene::new().with("a.toml", &bytes).with("bars.csv", "ts\n1\n");
        let _ = (TwinFile::read(scene.path("a.toml")), RunFile::read(scene.path("a.toml")));
    }
}
