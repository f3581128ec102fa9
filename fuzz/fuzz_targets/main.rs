//! Random bytes against every reader and the matching engine: `./x fuzz` builds this, and runs each of the [`targets`].
//!
//! One program holds them all, because trueup is linked once then; `TRUEUP_FUZZ` names the one that runs. A target stops
//! the process where a reader panics, or where what it read and wrote is not read again the same. libFuzzer itself stops
//! it after too long a time or at too much memory.

#![no_main]

mod targets;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::exit;
use std::sync::{Mutex, OnceLock};

use libfuzzer_sys::fuzz_target;
use targets::{Scene, TARGETS, Target};

/// Where the last panic was: readers of other crates may panic, as long as ours catch it.
static PANIC: Mutex<String> = Mutex::new(String::new());

static CHOSEN: OnceLock<(Target, Scene)> = OnceLock::new();

fn choose() -> (Target, Scene) {
    std::panic::set_hook(Box::new(|info| {
        if let Ok(mut told) = PANIC.lock() {
            *told = info.to_string();
        }
    }));
    let name = std::env::var("TRUEUP_FUZZ").unwrap_or_default();
    match TARGETS.into_iter().find(|(own, _)| *own == name) {
        Some(target) => (target, Scene::new()),
        None => {
            let names = TARGETS.map(|(name, _)| name).join(", ");
            eprintln!("error: there is no target `{name}`\nhint: TRUEUP_FUZZ names one of {names}");
            exit(2);
        }
    }
}

fuzz_target!(
    init: {
        CHOSEN.get_or_init(choose);
    },
    |bytes: &[u8]| {
        let ((_, target), scene) = CHOSEN.get_or_init(choose);
        if catch_unwind(AssertUnwindSafe(|| target(scene, bytes))).is_err() {
            let told = PANIC.lock().map(|told| told.clone()).unwrap_or_default();
            eprintln!("{told}");
            std::process::abort();
        }
    }
);
