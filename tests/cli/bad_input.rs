//! Bad input through the real program: exit code 2, file, place, value and hint on standard error, and nothing written.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may stop where it fails")]

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use tempfile::TempDir;

/// A copy of a data set to be spoilt.
struct Spoilt(TempDir);

impl Spoilt {
    fn copy(set: &str) -> Self {
        let folder = TempDir::new().unwrap();
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("data").join(set);
        for entry in fs::read_dir(source).unwrap() {
            let path = entry.unwrap().path();
            fs::copy(&path, folder.path().join(path.file_name().unwrap())).unwrap();
        }
        Self(folder)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Replaces the first `from` in a file.
    fn change(self, name: &str, from: &str, to: &str) -> Self {
        let text = fs::read_to_string(self.path(name)).unwrap();
        assert!(text.contains(from), "{name} does not hold {from}");
        self.write(name, text.replacen(from, to, 1))
    }

    /// Replaces the cell of `column` in line `line` of a CSV file, the header being line 1.
    fn cell(self, name: &str, line: usize, column: &str, to: &str) -> Self {
        let text = fs::read_to_string(self.path(name)).unwrap();
        let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
        let at = lines[0].split(',').position(|head| head == column).unwrap();
        let mut cells: Vec<&str> = lines[line - 1].split(',').collect();
        cells[at] = to;
        lines[line - 1] = cells.join(",");
        self.write(name, lines.join("\n") + "\n")
    }

    fn write(self, name: &str, content: impl AsRef<[u8]>) -> Self {
        fs::write(self.path(name), content).unwrap();
        self
    }

    /// The first `part` of a file, as a fraction.
    fn cut(self, name: &str, part: f64) -> Self {
        let bytes = fs::read(self.path(name)).unwrap();
        let kept = (bytes.len() as f64 * part) as usize;
        self.write(name, &bytes[..kept])
    }

    /// What the command says on standard error, having written nothing and ended with exit code 2.
    fn refused(&self, arguments: &str) -> String {
        let before = self.names();
        let output = Command::new(assert_cmd::cargo::cargo_bin!("trueup"))
            .current_dir(self.0.path())
            .args(arguments.split_whitespace())
            .env_remove("RUST_BACKTRACE")
            .output()
            .unwrap();
        let (out, err) = (String::from_utf8(output.stdout).unwrap(), String::from_utf8(output.stderr).unwrap());
        assert_eq!((output.status.code(), out.as_str()), (Some(2), ""), "{err}");
        assert_eq!(self.names(), before, "something was written");
        assert!(err.contains("\n  hint: "), "no hint: {err}");
        assert!(!err.contains("panicked"), "{err}");
        err
    }

    fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(self.0.path()).unwrap();
        let mut names: Vec<String> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }
}

const JOINT: &str = "diagnose twin.toml --recording train.csv --holdout test.csv --out found";
const EXECUTION: &str = "diagnose twin.toml --recording . --out found";
const BACKTEST: &str = "backtest run.toml --out ran";

fn servo() -> Spoilt {
    Spoilt::copy("servo")
}

fn execution() -> Spoilt {
    Spoilt::copy("execution")
}

fn bars() -> Spoilt {
    Spoilt::copy("bars")
}

#[test]
fn recordings_of_a_joint() {
    let time = servo().cell("train.csv", 100, "t", "0.001").refused(JOINT);
    insta::assert_snapshot!("non_monotonic_time", time);
    let command = servo().cell("train.csv", 17, "u", "NaN").refused(JOINT);
    insta::assert_snapshot!("nan_command", command);
    let word = servo().cell("test.csv", 17, "q", "abc").refused(JOINT);
    insta::assert_snapshot!("word_for_a_number", word);
    let column = servo().change("train.csv", "t,u,q", "t,u,pos").refused(JOINT);
    insta::assert_snapshot!("missing_column", column);
    insta::assert_snapshot!("empty_file", servo().write("train.csv", "").refused(JOINT));
    let short = servo().write("train.csv", "t,u,q\n0,1,0\n0.004,1,0\n0.008,1,0\n").refused(JOINT);
    insta::assert_snapshot!("too_short", short);
    let missing = servo().refused("diagnose twin.toml --recording trian.csv --out found");
    insta::assert_snapshot!("missing_recording", missing);
    let both = servo().refused("diagnose twin.toml --recording train.csv --holdout ./train.csv --out found");
    insta::assert_snapshot!("fitted_and_held_out", both);
    let bytes = fs::read(servo().path("train.csv")).unwrap();
    let copied = servo().write("again.csv", &bytes);
    let copied = copied.refused("diagnose twin.toml --recording train.csv --holdout again.csv --out found");
    insta::assert_snapshot!("fitted_and_held_out_by_another_name", copied);
    let folder = servo().refused("calibrate twin.toml --recording . --out found.toml");
    insta::assert_snapshot!("folder_for_a_file", folder);
}

#[test]
fn twins() {
    let unit = servo().change("twin.toml", "\"kg m^2\"", "\"g cm^2\"").refused(JOINT);
    insta::assert_snapshot!("wrong_unit", unit);
    let position = servo().change("twin.toml", "unit = \"rad\"", "unit = \"deg\"").refused(JOINT);
    insta::assert_snapshot!("wrong_unit_of_a_channel", position);
    let key = servo().change("twin.toml", "[channels]", "[chanels]").refused(JOINT);
    insta::assert_snapshot!("unknown_key", key);
    let model = servo().change("twin.toml", "\"joint\"", "\"jiont\"").refused(JOINT);
    insta::assert_snapshot!("unknown_model", model);
    let with = |text: &str| {
        let twin = servo();
        let before = fs::read_to_string(twin.path("twin.toml")).unwrap();
        twin.write("twin.toml", before + text)
    };
    let mechanism = with("[[mechanism]]\nname = \"coulomb_frction\"\ntorque = 0.1\n").refused(JOINT);
    insta::assert_snapshot!("unknown_mechanism", mechanism);
    let parameter = with("[[mechanism]]\nname = \"coulomb_friction\"\ntorqe = 0.1\n").refused(JOINT);
    insta::assert_snapshot!("unknown_parameter", parameter);
    let value = with("[[mechanism]]\nname = \"coulomb_friction\"\ntorque = -0.1\n").refused(JOINT);
    insta::assert_snapshot!("value_out_of_bounds", value);
    let nan = servo().change("twin.toml", "value = 0.11", "value = nan").refused(JOINT);
    insta::assert_snapshot!("nan_parameter", nan);
    let file = servo().refused("diagnose twn.toml --recording train.csv --out found");
    insta::assert_snapshot!("missing_twin", file);
}

#[test]
fn order_logs() {
    let price = execution().cell("fills.csv", 9, "price", "-100.01").refused(EXECUTION);
    insta::assert_snapshot!("negative_price", price);
    let side = execution().cell("orders.csv", 3, "side", "byu").refused(EXECUTION);
    insta::assert_snapshot!("unknown_side", side);
    let cut = execution().cut("quotes.parquet", 0.5).refused(EXECUTION);
    insta::assert_snapshot!("truncated_parquet", cut);
    let file = execution().change("twin.toml", "\"quotes.parquet\"", "\"quotes.parqet\"").refused(EXECUTION);
    insta::assert_snapshot!("twin_names_a_missing_file", file);
    let empty = execution().write("fills.csv", "").refused(EXECUTION);
    insta::assert_snapshot!("empty_fills", empty);
    let folder = execution().refused("diagnose twin.toml --recording logs --out found");
    insta::assert_snapshot!("missing_folder", folder);
    let symbol = execution().change("twin.toml", "symbol = \"XYZ\"", "symbol = \"XYY\"").refused(EXECUTION);
    insta::assert_snapshot!("undeclared_symbol", symbol);
}

#[test]
fn runs() {
    let key = bars().change("run.toml", "fast = 10", "fsat = 10").refused(BACKTEST);
    insta::assert_snapshot!("run_unknown_key", key);
    let strategy = bars().change("run.toml", "\"sma_cross\"", "\"sma_corss\"").refused(BACKTEST);
    insta::assert_snapshot!("run_unknown_strategy", strategy);
    let mechanism = bars().change("run.toml", "\"half_spread\"", "\"half_spred\"").refused(BACKTEST);
    insta::assert_snapshot!("run_unknown_mechanism", mechanism);
    let quotes = bars().change("run.toml", "bps = 1.0", "fraction = 1.0").refused(BACKTEST);
    insta::assert_snapshot!("run_mechanism_without_its_data", quotes);
    let cut = bars().cut("bars.parquet", 0.7).refused(BACKTEST);
    insta::assert_snapshot!("run_truncated_parquet", cut);
    let span = bars().change("run.toml", "seed = 7", "seed = 7\nstart = 2030-01-01T00:00:00Z").refused(BACKTEST);
    insta::assert_snapshot!("run_without_data_in_its_span", span);
    let leverage = bars().change("run.toml", "seed = 7", "seed = 7\nmax_leverage = -1.0").refused(BACKTEST);
    insta::assert_snapshot!("run_negative_leverage", leverage);
    let header = "ts,open,high,low,close,volume\n";
    let csv = |rows: &str| {
        bars()
            .change("run.toml", "bars.parquet", "bars.csv")
            .write("bars.csv", format!("{header}2024-08-05T13:30:00Z,10,11,9,10,5\n{rows}"))
    };
    let negative = csv("2024-08-05T13:31:00Z,10,11,-9,10,5\n").refused(BACKTEST);
    insta::assert_snapshot!("run_negative_price", negative);
    let back = csv("2024-08-05T13:31:00Z,10,11,9,10,5\n2024-08-05T13:30:30Z,10,11,9,10,5\n").refused(BACKTEST);
    insta::assert_snapshot!("run_time_goes_back", back);
    insta::assert_snapshot!("run_single_bar", csv("").refused(BACKTEST));
}
