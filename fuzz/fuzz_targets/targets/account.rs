//! Corporate actions and rates, as a run reads them. The first byte says how times are written and which file it is, the rest
//! is the file.

use trueup::io::RunFile;
use trueup::market::prepare_run;

use super::scene::{Scene, shown};

const BARS: &[u8] =
    b"ts,open,high,low,close,volume\n2024-03-08T14:30:00Z,10,12,9,11,100\n2024-03-08T14:31:00Z,11,12,10,11,5\n";
const ACTIONS: &[u8] = b"ts,kind,amount,new,old\n2024-03-08T14:31:00Z,split,,2,1\n";
const RATES: &[u8] = b"ts,price\n2024-03-08T14:30:00Z,1.08\n";

pub fn target(scene: &Scene, bytes: &[u8]) {
    let Some((how, rest)) = bytes.split_first() else { return };
    let zone = if how & 1 == 0 { "UTC" } else { "Europe/London" };
    let unit = if how & 2 == 0 { "ns" } else { "s" };
    scene.once("bars.csv", BARS);
    let (actions, rates) = if how & 4 == 0 { (rest, RATES) } else { (ACTIONS, rest) };
    scene.write("actions.csv", actions);
    scene.write("rates.csv", rates);
    let run = format!(
        "[run]\nseed = 1\ncash = 1e6\ncurrency = 'USD'\n[[instrument]]\nsymbol = 'A'\ntick_size = 0.01\ncurrency = 'EUR'\n\
         [[data]]\nsymbol = 'A'\nbars = 'bars.csv'\nstamp = 'open'\n\
         [[data]]\nsymbol = 'A'\nactions = 'actions.csv'\nzone = '{zone}'\ntime_unit = '{unit}'\n\
         [[rate]]\ncurrency = 'EUR'\nfile = 'rates.csv'\nzone = '{zone}'\ntime_unit = '{unit}'\n\
         [strategy]\nkind = 'buy_and_hold'\n"
    );
    let run = RunFile::read(scene.write("run.toml", run.as_bytes())).expect("a run that can be");
    shown(prepare_run(&run));
}
