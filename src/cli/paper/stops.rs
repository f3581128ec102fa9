//! What stops a paper run: Ctrl-C, a signal to end, and the kill file.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Instant;

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

use crate::io::InputError;
use crate::market::paper_run::StopReason;

/// Exit code of a process that Ctrl-C has ended at once: what shells expect, 128 and the number of the signal.
const ENDED: i32 = 130;

/// Time between two looks for the kill file [ms].
const LOOK: u64 = 50;

/// Whether the run is to stop.
#[derive(Debug, Clone)]
pub(super) struct Stops {
    interrupted: Arc<AtomicBool>,
    kill_file: Option<PathBuf>,
    killed: Arc<AtomicBool>,
    begun: Instant,
    /// When to look again [ms since `begun`].
    next_look: Arc<AtomicU64>,
}

impl Stops {
    /// Listens to signals from now on: the first asks the run to stop, a second Ctrl-C ends the process at once.
    pub fn listen(kill_file: Option<&Path>) -> Result<Self, InputError> {
        if let Some(path) = kill_file.filter(|path| path.exists()) {
            return Err(InputError::new(path, "the kill file is there already").hint("remove it to begin"));
        }
        let interrupted = Arc::new(AtomicBool::new(false));
        // In this order: the process ends where the flag was set before.
        let listening = flag::register_conditional_shutdown(SIGINT, ENDED, Arc::clone(&interrupted))
            .and_then(|_| flag::register(SIGINT, Arc::clone(&interrupted)))
            .and_then(|_| flag::register(SIGTERM, Arc::clone(&interrupted)));
        listening.map_err(|error| InputError::new("signals", format!("cannot be listened to ({error})")))?;
        let (killed, next_look) = Default::default();
        Ok(Self { interrupted, kill_file: kill_file.map(Path::to_path_buf), killed, begun: Instant::now(), next_look })
    }

    /// Why the run is to stop, if it is.
    pub fn asked(&self) -> Option<StopReason> {
        if self.interrupted.load(Ordering::Relaxed) {
            return Some(StopReason::Interrupted);
        }
        let path = self.kill_file.as_ref()?;
        let now = u64::try_from(self.begun.elapsed().as_millis()).unwrap_or(u64::MAX);
        if now >= self.next_look.load(Ordering::Relaxed) {
            self.next_look.store(now + LOOK, Ordering::Relaxed);
            self.killed.fetch_or(path.exists(), Ordering::Relaxed);
        }
        self.killed.load(Ordering::Relaxed).then_some(StopReason::KillFile)
    }
}
