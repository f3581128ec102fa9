//! Standard input as the feed of a paper run: lines, read by a thread of their own, so that waiting for one can be ended.

use std::io::{BufRead, BufReader};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::time::Duration;

use crate::io::InputError;
use crate::market::paper_run::{LineSource, NextLine};

use super::stops::Stops;

/// Lines that are read ahead.
const AHEAD: usize = 1_024;

/// Longest time without a look at what may stop the run.
const LOOK: Duration = Duration::from_millis(50);

pub(super) struct StandardInput {
    lines: Receiver<std::io::Result<String>>,
    stops: Stops,
}

impl StandardInput {
    pub fn open(stops: Stops) -> Self {
        let (sender, lines) = sync_channel(AHEAD);
        std::thread::spawn(move || read(&sender));
        Self { lines, stops }
    }
}

/// Reads to the end, or until nobody listens. What is no UTF-8 is no JSON either: it is read as such, and refused there.
fn read(sender: &SyncSender<std::io::Result<String>>) {
    let mut input = BufReader::new(std::io::stdin().lock());
    loop {
        let mut bytes = Vec::new();
        let line = match input.read_until(b'\n', &mut bytes) {
            Ok(0) => return,
            Ok(_) => Ok(String::from_utf8_lossy(&bytes).trim_end_matches(['\n', '\r']).to_owned()),
            Err(error) => Err(error),
        };
        let ends = line.is_err();
        if sender.send(line).is_err() || ends {
            return;
        }
    }
}

impl LineSource for StandardInput {
    fn next_line(&mut self) -> Result<NextLine, InputError> {
        if self.stops.asked().is_some() {
            return Ok(NextLine::End);
        }
        match self.lines.recv_timeout(LOOK) {
            Ok(Ok(text)) => Ok(NextLine::Text(text)),
            Ok(Err(error)) => Err(InputError::new("standard input", format!("cannot be read ({error})"))),
            Err(RecvTimeoutError::Timeout) => Ok(NextLine::Later),
            Err(RecvTimeoutError::Disconnected) => Ok(NextLine::End),
        }
    }

    fn refused(&mut self, why: &InputError) {
        eprintln!("left out: {why}");
    }
}
