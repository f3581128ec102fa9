//! Twins of every plant.

use std::path::PathBuf;

use trueup::io::{MarketFiles, TwinFile};
use trueup::market::execution_assembly;
use trueup::robot::{cart_pole_assembly, equations_assembly, joint_assembly, tanks_assembly};

use super::scene::{Scene, shown};

pub fn target(scene: &Scene, bytes: &[u8]) {
    // Files that a twin may name.
    ["quotes.parquet", "trades.parquet", "a/b c.csv", "a/\u{e9}\"'.csv"]
        .iter()
        .for_each(|name| drop(scene.once(name, b"x")));
    scene.once("out/nothing", b"");
    let Some(twin) = shown(TwinFile::read(scene.write("twin.toml", bytes))) else { return };
    match twin.model.as_str() {
        "joint" => drop(shown(joint_assembly(&twin))),
        "cart_pole" => drop(shown(cart_pole_assembly(&twin))),
        "tanks" => drop(shown(tanks_assembly(&twin, &[]))),
        "equations" => drop(shown(equations_assembly(&twin, &[]))),
        _ => drop(shown(execution_assembly(&twin))),
    }
    let text = twin.render(&scene.path("out")).expect("a twin that was read can be written");
    let again = TwinFile::read(scene.write("out/twin.toml", text.as_bytes())).expect("what was written can be read");
    assert_eq!((&again.model, again.step), (&twin.model, twin.step));
    assert_eq!((&again.parameters, &again.channels), (&twin.parameters, &twin.channels));
    assert_eq!((&again.equations, &again.controller), (&twin.equations, &twin.controller));
    assert_eq!((&again.mechanisms, &again.assumptions), (&twin.mechanisms, &twin.assumptions));
    assert_eq!((&again.instruments, real(&again.market)), (&twin.instruments, real(&twin.market)));
}

/// The files without links and `..`, which may be spelt in several ways.
fn real(market: &Option<MarketFiles>) -> Option<MarketFiles> {
    let real = |path: &Option<PathBuf>| path.as_ref().map(|path| path.canonicalize().expect("a file that is there"));
    let market = market.as_ref().filter(|market| **market != MarketFiles::default())?;
    let [quotes, trades, bars] = [&market.quotes, &market.trades, &market.bars].map(real);
    Some(MarketFiles { quotes, trades, bars, shows_own_orders: market.shows_own_orders, format: market.format.clone() })
}
