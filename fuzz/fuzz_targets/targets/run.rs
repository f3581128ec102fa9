//! Runs, with the data and the strategy they name.

use trueup::io::RunFile;
use trueup::market::prepare_run;
use trueup::strategies::STRATEGIES;

use super::scene::{Scene, shown};

const BARS: &[u8] =
    b"ts,open,high,low,close,volume\n2024-03-08T14:30:00Z,10,12,9,11,100\n2024-03-08T14:31:00Z,11,12,10,11,5\n";
const QUOTES: &[u8] = b"ts,bid,bid_size,ask,ask_size\n2024-03-08T14:30:00Z,10,1,11,1\n2024-03-08T14:31:00Z,10,1,11,1\n";

pub fn target(scene: &Scene, bytes: &[u8]) {
    scene.once("bars.csv", BARS);
    scene.once("quotes.csv", QUOTES);
    let Some(run) = shown(RunFile::read(scene.write("run.toml", bytes))) else { return };
    shown(prepare_run(&run));
    for strategy in STRATEGIES {
        if let Some(settings) = shown(run.strategy_settings()) {
            shown((strategy.build)(settings));
        }
    }
}
