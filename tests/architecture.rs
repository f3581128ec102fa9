//! The layers of the house, downward only: `cli -> strategies -> market | robot -> report, rl, io -> sim2real`. The generator
//! sees nothing but `Seed`, so that what conceals and what diagnoses share no code.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// What a room may see of the crate: the start of a path, so that `sim2real` allows all of it, `sim2real::Seed` that alone.
const LAYERS: &[(&str, &[&str])] = &[
    ("sim2real", &[]),
    ("conceal", &["sim2real::Seed", "sim2real::Draws"]),
    ("io", &["sim2real"]),
    ("report", &["sim2real"]),
    ("rl", &["sim2real"]),
    ("market", &["sim2real", "io", "report", "rl"]),
    ("robot", &["sim2real", "io", "report", "rl"]),
    ("strategies", &["sim2real", "market"]),
    ("proof", &["sim2real", "conceal", "report", "robot", "market"]),
    ("cli", &["sim2real", "conceal", "proof", "io", "report", "rl", "market", "robot", "strategies"]),
];

/// What makes a result depend on more than its input, and the rooms that may have it all the same.
const OUTSIDE: &[(&str, &[&str])] = &[
    ("std::env", &["cli"]),
    ("std::fs", &["cli", "io"]),
    ("std::net", &["cli"]),
    ("std::process", &["cli"]),
    ("std::time::Instant", &["cli"]),
    ("std::time::SystemTime", &["cli"]),
    ("chrono::Utc::now", &["cli"]),
    ("chrono::Local", &["cli"]),
    ("rand::rng", &[]),
    ("rand::random", &[]),
    ("rand::rngs::SysRng", &[]),
    ("rand::rngs::ThreadRng", &[]),
];

/// A path in the code, written out: `use std::{env, fs}` holds two.
struct Reference {
    line: usize,
    path: String,
    in_tests: bool,
}

struct File {
    room: String,
    /// Modules from the crate down to the file.
    modules: Vec<String>,
    shown: String,
    code: String,
}

#[test]
fn rooms_see_downward_only() {
    let files = files();
    let rooms: Vec<&str> = LAYERS.iter().map(|(room, _)| *room).collect();
    let mut report = String::new();
    for file in &files {
        let Some((_, allowed)) = LAYERS.iter().find(|(room, _)| *room == file.room) else {
            let _ = writeln!(report, "{}: the room `{}` has no line in LAYERS of this test", file.shown, file.room);
            continue;
        };
        for seen in within_the_crate(file) {
            let room = seen.path.split("::").next().unwrap_or_default();
            let elsewhere = rooms.contains(&room) && room != file.room;
            if elsewhere && !allowed.iter().any(|allowed| is_under(&seen.path, allowed)) {
                let _ = writeln!(report, "{}:{}: sees `crate::{}`", file.shown, seen.line, seen.path);
                let _ = writeln!(report, "  hint: `{}` may see {}", file.room, listed(allowed));
            }
        }
    }
    assert!(report.is_empty(), "\nlayers are crossed:\n{report}");
}

#[test]
fn nothing_below_the_command_line_sees_the_world() {
    let mut report = String::new();
    for file in &files() {
        for root in ["std", "chrono", "rand"] {
            for seen in references(&file.code, root).into_iter().filter(|seen| !seen.in_tests) {
                let path = format!("{root}::{}", seen.path);
                let found = OUTSIDE.iter().find(|(outside, _)| is_under(&path, outside));
                if let Some((outside, rooms)) = found.filter(|(_, rooms)| !rooms.contains(&file.room.as_str())) {
                    let _ = writeln!(report, "{}:{}: uses `{path}`", file.shown, seen.line);
                    let _ =
                        writeln!(report, "  hint: `{outside}` is for {}; take what is needed as an argument", listed(rooms));
                }
            }
        }
    }
    assert!(report.is_empty(), "\na result must depend on its input alone:\n{report}");
}

/// The scan itself, on code with every form of path it must see.
#[test]
fn the_scan_sees_through_groups_aliases_and_supers() {
    let code = "use crate::{market::{Book, order::Side}, sim2real as core}; // crate::robot\nfn f() { crate::io::read(); }\n\
                use super::super::report::Page;\n#[cfg(test)]\nmod tests { use std::{env, fs as files, time::Instant}; }\n";
    let file = File {
        room: "conceal".to_owned(),
        modules: vec!["conceal".to_owned(), "bars".to_owned()],
        shown: String::new(),
        code: without_comments(code),
    };
    let seen: Vec<(usize, String)> = within_the_crate(&file).into_iter().map(|seen| (seen.line, seen.path)).collect();
    let expected = [(1, "market::Book"), (1, "market::order::Side"), (1, "sim2real"), (2, "io::read"), (3, "report::Page")];
    assert_eq!(seen, expected.map(|(line, path)| (line, path.to_owned())));
    let outside = references(&file.code, "std");
    assert_eq!(outside.iter().map(|seen| seen.path.as_str()).collect::<Vec<_>>(), ["env", "fs", "time::Instant"]);
    assert!(outside.iter().all(|seen| seen.in_tests));
}

fn is_under(path: &str, start: &str) -> bool {
    path.strip_prefix(start).is_some_and(|rest| rest.is_empty() || rest.starts_with("::"))
}

fn listed(names: &[&str]) -> String {
    if names.is_empty() { "nothing".to_owned() } else { names.join(", ") }
}

/// Every source file of every room; files beside the rooms (`lib.rs`, `main.rs`) are the doors between them.
fn files() -> Vec<File> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut paths = Vec::new();
    collect(&root.join("src"), &mut paths);
    collect(&root.join("strategies"), &mut paths);
    paths.sort();
    let files: Vec<File> = paths.iter().filter_map(|path| file(root, path)).collect();
    assert!(files.iter().any(|file| file.room == "sim2real"), "the scan found no core: is it looking in the right place?");
    files
}

fn collect(folder: &Path, paths: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            collect(&path, paths);
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            paths.push(path);
        }
    }
}

fn file(root: &Path, path: &Path) -> Option<File> {
    let inside = path.strip_prefix(root).ok()?;
    let in_src = inside.strip_prefix("src").unwrap_or(inside).with_extension("");
    let mut modules: Vec<String> = in_src.iter().map(|part| part.to_string_lossy().into_owned()).collect();
    modules.retain(|module| module != "mod");
    if modules.len() == 1 && ["lib", "main"].contains(&modules[0].as_str()) {
        return None;
    }
    let code = without_comments(&std::fs::read_to_string(path).ok()?);
    Some(File { room: modules.first()?.clone(), modules, shown: inside.display().to_string(), code })
}

fn without_comments(code: &str) -> String {
    code.lines().map(|line| line.split("//").next().unwrap_or_default()).collect::<Vec<_>>().join("\n")
}

/// Paths from the root of the crate, whether they go down from `crate` or up by `super`.
fn within_the_crate(file: &File) -> Vec<Reference> {
    let mut seen = references(&file.code, "crate");
    for climb in references(&file.code, "super") {
        let mut path = climb.path.as_str();
        let mut left = file.modules.len() - 1;
        while let Some(rest) = path.strip_prefix("super::") {
            (path, left) = (rest, left.saturating_sub(1));
        }
        if left == 0 {
            seen.push(Reference { path: path.to_owned(), ..climb });
        }
    }
    seen.sort_by_key(|reference| reference.line);
    seen
}

/// Every path that begins with `root::`, without the root.
fn references(code: &str, root: &str) -> Vec<Reference> {
    let start = format!("{root}::");
    let tests = code.find("#[cfg(test)]").unwrap_or(code.len());
    let mut found = Vec::new();
    for (at, _) in code.match_indices(&start) {
        let before = code[..at].chars().next_back();
        if before.is_some_and(|c| c.is_alphanumeric() || c == '_' || c == ':') {
            continue;
        }
        let (paths, _) = expanded(&code[at + start.len()..]);
        let line = code[..at].matches('\n').count() + 1;
        found.extend(paths.into_iter().map(|path| Reference { line, path, in_tests: at > tests }));
    }
    found
}

/// The paths that a piece of code begins with, groups written out, and what comes after them.
fn expanded(code: &str) -> (Vec<String>, &str) {
    let code = code.trim_start();
    if let Some(mut rest) = code.strip_prefix('{') {
        let mut paths = Vec::new();
        loop {
            let (some, after) = expanded(rest);
            paths.extend(some.into_iter().filter(|path| !path.is_empty()));
            let Some(end) = after.find([',', '}']) else { return (paths, "") };
            rest = &after[end + 1..];
            if after.as_bytes()[end] == b'}' {
                return (paths, rest);
            }
        }
    }
    let end = code.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(code.len());
    let (name, rest) = code.split_at(end);
    match rest.strip_prefix("::") {
        Some(deeper) => {
            let (paths, after) = expanded(deeper);
            let joined = |path: String| if path.is_empty() { name.to_owned() } else { format!("{name}::{path}") };
            (paths.into_iter().map(joined).collect(), after)
        }
        None => (vec![name.to_owned()], rest),
    }
}
