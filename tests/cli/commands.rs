//! The command line as its users meet it: what is printed where, what is written, and the exit code.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may stop where it fails")]

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use serde_json::Value;
use tempfile::TempDir;

/// A folder to work in, and what a command did there.
struct Scene(TempDir);

#[derive(Debug)]
struct Ran {
    code: i32,
    out: String,
    err: String,
}

impl Scene {
    fn new() -> Self {
        Self(TempDir::new().unwrap())
    }

    /// A folder with the servo's twin and the first 1,500 rows (6 s) of its recordings.
    fn servo() -> Self {
        let scene = Self::new();
        let source = data().join("servo");
        fs::copy(source.join("twin.toml"), scene.path("twin.toml")).unwrap();
        for name in ["train.csv", "test.csv"] {
            let text = fs::read_to_string(source.join(name)).unwrap();
            let rows: Vec<&str> = text.lines().take(1_501).collect();
            fs::write(scene.path(name), rows.join("\n") + "\n").unwrap();
        }
        scene
    }

    /// A folder with a small order log and its twin.
    fn execution() -> Self {
        let scene = Self::new();
        let source = data().join("execution");
        for name in ["twin.toml", "orders.csv", "fills.csv", "quotes.parquet", "trades.parquet"] {
            fs::copy(source.join(name), scene.path(name)).unwrap();
        }
        scene
    }

    /// A folder with a run and 600 of its bars.
    fn bars() -> Self {
        let scene = Self::new();
        let source = data().join("bars");
        fs::copy(source.join("bars.parquet"), scene.path("bars.parquet")).unwrap();
        fs::copy(source.join("run.toml"), scene.path("run.toml")).unwrap();
        scene
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        fs::write(self.path(name), content).unwrap();
    }

    fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap()
    }

    fn run(&self, arguments: &str) -> Ran {
        let output = Command::new(assert_cmd::cargo::cargo_bin!("trueup"))
            .current_dir(self.0.path())
            .args(arguments.split_whitespace())
            .env_remove("RUST_BACKTRACE")
            .output()
            .unwrap();
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
        Ran { code: output.status.code().unwrap(), out: text(output.stdout), err: text(output.stderr) }
    }

    /// All names in the folder, sorted.
    fn names(&self) -> Vec<String> {
        names(self.0.path())
    }
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

fn data() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("data")
}

const SERVO: &str = "diagnose twin.toml --recording train.csv --holdout test.csv";

#[test]
fn every_command_explains_itself() {
    let scene = Scene::new();
    for command in [
        "",
        "demo",
        "diagnose",
        "calibrate",
        "rollout",
        "backtest",
        "paper",
        "audit",
        "sweep",
        "walk-forward",
        "reconcile",
        "prove",
        "regimes",
        "mechanisms",
        "data",
        "data make",
        "data import",
        "env",
        "env list",
        "env bench",
    ] {
        let ran = scene.run(&format!("{command} --help"));
        assert_eq!((ran.code, ran.err.as_str()), (0, ""), "{command}");
        let name = if command.is_empty() { "trueup".to_owned() } else { command.replace(' ', "_") };
        insta::assert_snapshot!(format!("help_{name}"), ran.out);
    }
    let version = scene.run("--version");
    assert_eq!(version.out, format!("trueup {}\n", env!("CARGO_PKG_VERSION")));
    for wrong in ["diagnos", "diagnose --recordin a.csv", "diagnose twin.toml", "mechanisms --threads 0", ""] {
        let ran = scene.run(wrong);
        assert_eq!((ran.code, ran.out.as_str()), (2, ""), "{wrong}");
        assert!(!ran.err.is_empty());
    }
    assert!(scene.names().is_empty());
}

#[test]
fn mechanisms_are_listed_for_people_and_programs() {
    let scene = Scene::new();
    let ran = scene.run("mechanisms --json");
    assert_eq!((ran.code, ran.err.as_str()), (0, ""));
    let listing: Value = serde_json::from_str(&ran.out).unwrap();
    assert_eq!(listing["schema"], "trueup.mechanisms/1");
    let rows = listing["mechanisms"].as_array().unwrap();
    let ids: Vec<&str> = rows.iter().map(|row| row["id"].as_str().unwrap()).collect();
    for id in ["command_delay", "coulomb_friction", "half_spread", "bias", "commission"] {
        assert_eq!(ids.iter().filter(|other| **other == id).count(), 1, "{id}");
    }
    for row in rows {
        assert!(matches!(row["site"].as_str().unwrap(), "command" | "plant" | "observation"));
        assert!(!row["source"].as_str().unwrap().is_empty() && !row["law"].as_str().unwrap().is_empty());
        let domains = row["domains"].as_array().unwrap();
        assert!(!domains.is_empty() && domains.iter().all(|d| d == "robot" || d == "market"));
        for parameter in row["forms"].as_array().unwrap().iter().flat_map(|form| form["parameters"].as_array().unwrap()) {
            assert!(parameter["name"].is_string() && parameter["unit"].is_string());
            for key in ["nominal", "lower", "upper"] {
                assert!(parameter[key].is_number() || parameter[key].is_null(), "{parameter}");
            }
        }
    }
    let delay = rows.iter().find(|row| row["id"] == "command_delay").unwrap();
    assert_eq!(delay["domains"], serde_json::json!(["robot", "market"]));
    // Its bounds differ between servos, processes and markets, so it has a form for each; signals may begin at rest besides.
    let forms: Vec<&str> = delay["forms"].as_array().unwrap().iter().map(|form| form["name"].as_str().unwrap()).collect();
    assert_eq!((forms.len(), forms.iter().filter(|name| **name == "from_rest").count()), (5, 2));
    let spread = rows.iter().find(|row| row["id"] == "half_spread").unwrap();
    let forms: Vec<&str> = spread["forms"].as_array().unwrap().iter().map(|form| form["name"].as_str().unwrap()).collect();
    assert_eq!(forms, ["fraction", "bps", "of_volatility"]);
    let saturation = rows.iter().find(|row| row["id"] == "saturation").unwrap();
    assert!(saturation["forms"][0]["parameters"][0]["upper"].is_null());
    let table = scene.run("mechanisms").out;
    assert!(ids.iter().all(|id| table.contains(id)) && table.lines().all(|line| line.chars().count() <= 110));
}

/// The keys of an object, sorted.
fn keys(value: &Value) -> Vec<&str> {
    let mut keys: Vec<&str> = value.as_object().unwrap().keys().map(String::as_str).collect();
    keys.sort_unstable();
    keys
}

#[test]
fn a_diagnosis_is_printed_written_and_diagnosed_again() {
    let scene = Scene::servo();
    let ran = scene.run(&format!("{SERVO} --out found"));
    assert_eq!((ran.code, ran.err.as_str()), (0, ""), "{}", ran.out);
    assert!(ran.out.starts_with("named: The joint leaves out Coulomb friction"), "{}", ran.out);
    for part in ["What is missing", "Errors on held-out data", "Parameters of the twin", "What was tried", "Checks"] {
        assert!(ran.out.contains(part), "{part}:\n{}", ran.out);
    }
    assert_eq!(names(&scene.path("found")), ["diagnosis.json", "report.html", "trued.toml"]);
    assert!(scene.read("found/report.html").contains("</html>"));

    // Standard output holds what the file holds, and with --json nothing else.
    let json = scene.run(&format!("{SERVO} --json --fail-on mismatch"));
    assert_eq!((json.code, json.err.as_str()), (1, ""));
    assert_eq!(json.out, scene.read("found/diagnosis.json"), "the same seed gives the same bytes");
    let found: Value = serde_json::from_str(&json.out).unwrap();
    let promised = ["checks", "effects", "fit", "next_experiment", "parameters", "schema", "summary", "verdict", "where"];
    assert!(promised.iter().all(|key| keys(&found).contains(key)));
    assert_eq!(
        keys(&found),
        [
            "checks",
            "effects",
            "fit",
            "held_out",
            "modelled",
            "next_experiment",
            "parameters",
            "schema",
            "scores",
            "summary",
            "verdict",
            "where"
        ]
    );
    assert_eq!((&found["schema"], &found["verdict"]), (&"trueup.diagnosis/1".into(), &"named".into()));
    let effect = &found["effects"][0];
    let known = ["active", "confidence", "gain", "margin", "mechanism", "moved", "parameters", "rivals", "site", "where"];
    assert_eq!(keys(effect), known);
    assert_eq!((&effect["mechanism"], &effect["site"]), (&"coulomb_friction".into(), &"plant".into()));
    let (_, torque) = effect["parameters"].as_object().unwrap().iter().find(|(name, _)| name.ends_with("torque")).unwrap();
    assert_eq!(keys(torque), ["std", "unit", "value"]);
    assert!(["intervals", "onset"].iter().all(|key| keys(&found["where"]).contains(key)));
    assert_eq!(keys(&found["parameters"]["inertia"]), ["nominal", "std", "unit", "value"]);
    let fit = keys(&found["fit"][0]);
    for key in ["channel", "unit", "noise_floor", "nominal_rmse", "recalibrated_rmse", "trued_rmse", "improvement_ci95"] {
        assert!(fit.contains(&key), "{key}");
    }
    for key in ["adequacy", "at_bound", "placebo_p", "remainder", "tried"] {
        assert!(keys(&found["checks"]).contains(&key), "{key}");
    }

    // What was added is part of the trued twin, so there is nothing left of it to find.
    let again = scene.run("diagnose found/trued.toml --recording train.csv --holdout test.csv --json --fail-on mismatch");
    assert_eq!((again.code, again.err.as_str()), (0, ""), "{}", again.out);
    let again: Value = serde_json::from_str(&again.out).unwrap();
    assert_eq!(again["verdict"], "no_mismatch");
    assert_eq!(again["modelled"], serde_json::json!(["coulomb_friction"]));
    assert_eq!(again["parameters"]["inertia"]["nominal"], found["parameters"]["inertia"]["value"]);
}

#[test]
fn verdicts_are_findings_only_where_they_were_asked_for() {
    let scene = Scene::servo();
    assert_eq!(scene.run(&format!("{SERVO} --fail-on no_mismatch,not_excited")).code, 0);
    let named = scene.run(&format!("{SERVO} --fail-on no_mismatch --fail-on named"));
    assert_eq!(named.code, 1);
    assert!(named.out.contains("Nothing was written; --out DIR") && named.err.is_empty());
    assert_eq!(scene.run(&format!("{SERVO} --fail-on mismtach")).code, 2);
    assert_eq!(scene.names(), ["test.csv", "train.csv", "twin.toml"]);
    let told = scene.run(&format!("{SERVO} --progress"));
    assert_eq!(told.out, scene.run(SERVO).out);
    assert!(told.err.contains("comparing mechanisms"), "{}", told.err);
}

#[test]
fn without_the_right_name_no_wrong_one_is_given_for_certain() {
    let scene = Scene::servo();
    // Nor those that hold it as a special case, or come to the same.
    let family = ["coulomb_friction", "stribeck_friction", "load_friction", "hysteresis", "backlash"];
    let without: Vec<String> = family.iter().map(|id| format!("--without {id}")).collect();
    let ran = scene.run(&format!("{SERVO} {} --json", without.join(" ")));
    let found: Value = serde_json::from_str(&ran.out).unwrap();
    assert_ne!(found["verdict"], "named", "{}", found["summary"]);
    let unknown = scene.run(&format!("{SERVO} --without coulomb_frction"));
    assert_eq!(unknown.code, 2);
    insta::assert_snapshot!(unknown.err, @r"
    error: --without: there is no mechanism `coulomb_frction`
      hint: did you mean `coulomb_friction`?
    ");
}

#[test]
fn nothing_is_written_over_unless_forced() {
    let scene = Scene::servo();
    fs::create_dir(scene.path("found")).unwrap();
    scene.write("found/report.html", "mine");
    let refused = scene.run(&format!("{SERVO} --out found"));
    assert_eq!((refused.code, refused.out.as_str()), (2, ""));
    insta::assert_snapshot!(refused.err, @r"
    error: found/report.html: the file exists already, and nothing is written over unasked
      hint: name another output with --out, or allow it with --force
    ");
    assert_eq!((scene.read("found/report.html").as_str(), names(&scene.path("found")).len()), ("mine", 1));
    assert_eq!(scene.run(&format!("{SERVO} --out found --force")).code, 0);
    assert_ne!(scene.read("found/report.html"), "mine");
    assert_eq!(scene.run(&format!("{SERVO} --out train.csv")).code, 2);
    assert_eq!(scene.run("calibrate twin.toml --recording train.csv --out twin.toml").code, 2);
    assert!(scene.read("twin.toml").contains("as its designer has it"));
}

#[test]
fn a_calibration_moves_what_is_uncertain_and_adds_nothing() {
    let scene = Scene::servo();
    let command = "calibrate twin.toml --recording train.csv --holdout test.csv";
    let ran = scene.run(&format!("{command} --out calibrated.toml"));
    assert_eq!((ran.code, ran.err.as_str()), (0, ""));
    assert!(ran.out.contains("known exactly: not fitted") && ran.out.contains("Written: calibrated.toml"), "{}", ran.out);
    let json = scene.run(&format!("{command} --json"));
    let listing: Value = serde_json::from_str(&json.out).unwrap();
    assert_eq!(listing["schema"], "trueup.calibration/1");
    assert_eq!(keys(&listing["parameters"]), ["gain", "gravity_torque", "inertia", "viscous_friction"]);
    let twin: toml::Table = scene.read("calibrated.toml").parse().unwrap();
    assert!(twin.get("mechanism").is_none());
    assert_eq!(twin["parameters"]["inertia"]["value"].as_float(), listing["parameters"]["inertia"]["value"].as_f64());
    assert_eq!(twin["parameters"]["gain"]["value"].as_float(), Some(1.0));
    let inertia = &listing["parameters"]["inertia"];
    assert!(inertia["value"] != inertia["nominal"] && inertia["std"].as_f64().unwrap() > 0.0, "{inertia}");
    assert!(listing["fit"][0]["recalibrated_rmse"] != listing["fit"][0]["nominal_rmse"]);

    let market = Scene::execution();
    let nothing = market.run("calibrate twin.toml --recording .");
    assert_eq!(nothing.code, 2);
    insta::assert_snapshot!(nothing.err, @r"
    error: twin.toml:2:2: the twin has no parameter that a fit may move
      hint: give a parameter an uncertainty above 0; `trueup diagnose` adds what is missing
    ");
}

#[test]
fn a_backtest_leaves_a_log_that_can_be_diagnosed() {
    let scene = Scene::bars();
    let ran = scene.run("backtest run.toml --out ran");
    assert_eq!((ran.code, ran.err.as_str()), (0, ""));
    assert!(ran.out.starts_with("sma_cross on XYZ, 5 August 2024 to 30 August 2024: "), "{}", ran.out);
    let written = ["equity.parquet", "fills.parquet", "orders.parquet", "report.html", "run.json", "trades.parquet"];
    assert_eq!(names(&scene.path("ran")), written);
    let summary: Value = serde_json::from_str(&scene.read("ran/run.json")).unwrap();
    assert_eq!(summary["schema"], "trueup.run/1");
    for key in ["metrics", "counts", "seed", "version", "inputs"] {
        assert!(keys(&summary).contains(&key), "{key}");
    }
    assert_eq!(summary["inputs"][1]["path"], "bars.parquet");
    assert_eq!(scene.run("backtest run.toml --json").out, scene.read("ran/run.json"));
    assert_eq!(scene.run("backtest run.toml --out ran").code, 2);

    // Fills at the open of the next bar, half a spread of 1 bps and 0.005 USD a share: what the run says it assumed is
    // what a diagnosis of its log, against a twin that assumes none of it, finds.
    scene.write(
        "twin.toml",
        "[twin]\nmodel = \"execution\"\n[assumptions]\nprice = \"next_open\"\n[[instrument]]\nsymbol = \"XYZ\"\n\
         tick_size = 0.01\n[market]\nbars = \"bars.parquet\"\nstamp = \"open\"\n",
    );
    let found = scene.run("diagnose twin.toml --recording ran --json");
    assert_eq!(found.code, 0, "{}", found.err);
    let found: Value = serde_json::from_str(&found.out).unwrap();
    let effects = found["effects"].as_array().unwrap();
    let mut named: Vec<&str> = effects.iter().map(|effect| effect["mechanism"].as_str().unwrap()).collect();
    named.sort_unstable();
    assert_eq!(named, ["commission", "half_spread"], "{}", found["summary"]);
}

#[test]
fn the_demonstration_finds_what_was_concealed() {
    let scene = Scene::new();
    let ran = scene.run("demo");
    assert_eq!((ran.code, ran.err.as_str()), (0, ""), "{}", ran.out);
    for set in ["servo", "execution"] {
        assert!(scene.path(&format!("trueup-demo/{set}/diagnosis/report.html")).is_file());
    }
    let found = |set: &str| -> Vec<String> {
        let text = scene.read(&format!("trueup-demo/{set}/diagnosis/diagnosis.json"));
        let found: Value = serde_json::from_str(&text).unwrap();
        assert!(["named", "ambiguous"].contains(&found["verdict"].as_str().unwrap()), "{set}: {}", found["summary"]);
        let effects = found["effects"].as_array().unwrap();
        let mut names: Vec<String> = effects.iter().map(|e| e["mechanism"].as_str().unwrap().to_owned()).collect();
        names.sort_unstable();
        names
    };
    assert_eq!(found("servo"), ["coulomb_friction"]);
    // What an order takes from the book moves the mid until it is filled up again: that may be called one impact or another.
    let mut execution = found("execution");
    execution.retain(|name| !["permanent_impact", "transient_impact"].contains(&name.as_str()));
    assert_eq!(execution, ["book_walk", "command_delay", "commission", "half_spread"]);
    assert!(ran.out.find("Found missing").unwrap() < ran.out.find("What the generator had concealed").unwrap());
    assert_eq!(scene.run("demo").code, 2, "nothing is written over");
}

#[test]
fn the_sets_in_the_repository_are_those_that_are_made() {
    let scene = Scene::new();
    assert_eq!(scene.run("data make").code, 0);
    assert_eq!(names(&scene.path("data")), names(&data()));
    for set in names(&data()) {
        let (made, kept) = (scene.path("data").join(&set), data().join(&set));
        assert_eq!(names(&made), names(&kept), "{set}");
        for name in names(&made) {
            let (made, kept) = (made.join(&name), kept.join(&name));
            if name.ends_with(".md") || name.ends_with(".toml") {
                assert_eq!(fs::read(&made).unwrap(), fs::read(&kept).unwrap(), "{set}/{name}");
            } else {
                assert_same_table(&made, &kept);
            }
        }
    }
    assert_eq!(scene.run("data make").code, 2, "nothing is written over");
    assert_eq!(scene.run("data make --force").code, 0);
}

fn assert_same_table(made: &Path, kept: &Path) {
    use trueup::io::Table;
    let (made, kept) = (Table::read(made).unwrap(), Table::read(kept).unwrap());
    assert_eq!((made.names(), made.rows()), (kept.names(), kept.rows()), "{}", kept.path().display());
    for name in made.names() {
        assert_eq!(made.texts(name).ok(), kept.texts(name).ok(), "{}: {name}", kept.path().display());
        // Numbers of Parquet are no texts.
        assert_eq!(made.floats(name).ok(), kept.floats(name).ok(), "{}: {name}", kept.path().display());
    }
}
