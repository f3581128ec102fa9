//! The record of a proof.

use trueup::proof::Journal;

use super::scene::{Scene, shown};

pub fn target(_: &Scene, bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    let Some(journal) = shown(Journal::read(&text)) else { return };
    assert!(journal.whole <= text.len());
    shown(journal.entries());
    let lines = journal.lines.iter().map(|line| line.text());
    let written: Result<String, _> = [journal.header.text()].into_iter().chain(lines).collect();
    let written = written.expect("what was read can be written");
    let again = Journal::read(&written).expect("what was written can be read");
    assert_eq!((&again.header, &again.lines), (&journal.header, &journal.lines));
}
