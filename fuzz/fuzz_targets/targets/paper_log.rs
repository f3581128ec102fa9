//! The journal of a paper run: bytes as they are, and as lines that are sound.

use trueup::io::{InputError, Journal, JournalLines, JournalSync, RunFile};
use trueup::market::paper_run::{JournalUse, PaperFeed, PreparedPaper};

use super::scene::{Scene, shown};

const RUN: &str = "[run]\nseed = 7\ncash = 1000\ncurrency = \"USD\"\n[[instrument]]\nsymbol = \"XYZ\"\ntick_size = 0.01\nlot_size = 1\n\
[[data]]\nsymbol = \"XYZ\"\ntrades = \"t.csv\"\n[strategy]\nkind = \"buy_and_hold\"\n";

/// The lines of a journal, as far as they are sound.
fn lines(path: &std::path::Path) -> Result<Vec<String>, InputError> {
    let mut seen = Vec::new();
    let (mut read, _) = JournalLines::open(path, |_, line| {
        seen.push(line.to_owned());
        Ok(())
    })?;
    let mut again = Vec::new();
    while let Some((_, line)) = read.next_line()? {
        again.push(line);
    }
    assert_eq!(seen, again);
    Ok(seen)
}

pub fn target(scene: &Scene, bytes: &[u8]) {
    let path = scene.write("journal.jsonl", bytes);
    if let Some(sound) = shown(lines(&path)) {
        shown(Journal::open(&path, JournalSync::Asked, |_, _| Ok(())).map(drop));
        assert_eq!(shown(lines(&path)), Some(sound), "a cut takes nothing that is sound");
    }
    // What has the right checksums may be nonsense all the same.
    let run = scene.once("run.toml", RUN.as_bytes());
    scene.once("t.csv", b"ts,price,size\n1,1,1\n2,1.5,3\n");
    let sound: Vec<String> = String::from_utf8_lossy(bytes).lines().map(str::to_owned).collect();
    drop(std::fs::remove_file(&path));
    let mut journal = Journal::create(&path, JournalSync::Asked).expect("room for a file");
    journal.add(&sound).expect("room for lines");
    drop(journal);
    let Some(run) = shown(RunFile::read(&run)) else { return };
    shown(PreparedPaper::open(run, PaperFeed::Files, &path, JournalUse::Read).map(drop));
}
