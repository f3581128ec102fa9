//! Every reader on the seeds of the fuzzer, and on what chance makes of them: bytes that are changed, lost, doubled or moved. None may
//! panic. `./x fuzz` looks further, at what leads somewhere new.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails where a value is missing")]

#[path = "../../fuzz/fuzz_targets/targets/mod.rs"]
mod targets;

use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use rand::RngExt;
use trueup::sim2real::{Draws, Seed};

use targets::{Scene, TARGETS, Target};

/// Changes made of each seed.
const CHANGES: usize = 24;
/// What a change may put in: where readers begin to count, to quote, to nest.
const TOKENS: [&[u8]; 12] = [
    b"\n",
    b",",
    b"\"",
    b"-",
    b"1e308",
    b"9223372036854775808",
    b"[[",
    b"{",
    b"\xff\xfe",
    b"\0\0\0\0",
    b"nan",
    b"\xff\xff\xff\x7f",
];

fn seeds(name: &str) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds").join(name);
    let mut paths: Vec<PathBuf> =
        fs::read_dir(folder).expect("a folder of seeds").map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths
}

/// `bytes` with up to four things done to them.
fn changed(bytes: &[u8], draws: &mut Draws) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for _ in 0..draws.random_range(1..5) {
        let place = |draws: &mut Draws, bytes: &[u8]| draws.random_range(0..=bytes.len());
        let (a, b) = (place(draws, &bytes), place(draws, &bytes));
        let range = a.min(b)..a.max(b).min(a.min(b) + 64);
        match draws.random_range(0..6) {
            0 if !bytes.is_empty() => {
                let at = draws.random_range(0..bytes.len());
                bytes[at] ^= 1 << draws.random_range(0..8);
            }
            1 if !bytes.is_empty() => {
                let at = draws.random_range(0..bytes.len());
                bytes[at] = draws.random();
            }
            2 => bytes.truncate(a),
            3 => drop(bytes.drain(range)),
            4 => {
                let again = bytes[range].to_vec();
                drop(bytes.splice(b..b, again));
            }
            _ => {
                let token = TOKENS[draws.random_range(0..TOKENS.len())];
                drop(bytes.splice(a..a, token.iter().copied()));
            }
        }
    }
    bytes
}

/// Whether a target takes some bytes without a panic; else they are kept for who looks into it.
fn survives((name, target): Target, scene: &Scene, bytes: &[u8], what: &str) {
    if catch_unwind(AssertUnwindSafe(|| target(scene, bytes))).is_err() {
        let kept = std::env::temp_dir().join(format!("trueup-{name}"));
        fs::write(&kept, bytes).unwrap();
        panic!("the reader `{name}` panics on {what}: {} bytes, kept in {}", bytes.len(), kept.display());
    }
}

#[test]
fn no_reader_panics_on_its_seeds_nor_on_what_chance_makes_of_them() {
    let mut count = 0;
    for target in TARGETS {
        let scene = Scene::new();
        let mut draws = Seed(1).stream(target.0);
        for path in seeds(target.0) {
            let bytes = fs::read(&path).unwrap();
            survives(target, &scene, &bytes, &format!("{}", path.display()));
            for _ in 0..CHANGES {
                let bytes = changed(&bytes, &mut draws);
                survives(target, &scene, &bytes, &format!("a change of {}", path.display()));
                count += 1;
            }
        }
    }
    println!("{count} changed inputs to {} readers", TARGETS.len());
    assert!(count > 1_000);
}

#[test]
fn every_folder_of_seeds_has_its_reader() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds");
    let mut names: Vec<String> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    assert_eq!(names, TARGETS.map(|(name, _)| name));
}
