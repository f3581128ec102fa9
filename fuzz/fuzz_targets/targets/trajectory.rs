//! Recordings of what moves, as each of the plants reads them.

use std::slice::from_ref;

use trueup::io::{Document, Need, TwinFile, read_trajectory};
use trueup::robot::{cart_pole_recordings, equations_recordings, joint_recordings, tanks_recordings};

use super::scene::{Scene, shown};

const JOINT: &str = "[twin]\nmodel = 'joint'\n[channels]\ncommand = { column = 'u' }\nposition = { column = 'q' }\n";
const CART: &str = "[twin]\nmodel = 'cart_pole'\n[channels]\ncommand = { column = 'u' }\nposition = { column = 'q' }\n\
                    angle = { column = 'a' }\n";
const TANKS: &str =
    "[twin]\nmodel = 'tanks'\n[channels]\ncommand = { column = 'u' }\nlevel = { column = 'q', unit = 'V' }\n";
const EQUATIONS: &str = "[twin]\nmodel = 'equations'\n[inputs]\nu = { column = 'u', interpolated = true }\n\
                         w = { column = 'q', interpolated = true }\n[outputs]\ny = { expression = 'x', column = 'q' }\n";

pub fn target(scene: &Scene, bytes: &[u8]) {
    let path = scene.write("a.csv", bytes);
    let roles = [("command", "u", Need::EveryRow), ("position", "q", Need::SomeRows), ("angle", "a", Need::Nothing)];
    if let Some(table) = shown(read_trajectory(&path, &roles)) {
        assert!(table.time.windows(2).all(|pair| pair[0] < pair[1]) && table.complete("command").is_some());
    }
    let twin = |text: &str| TwinFile::parse(Document::from_text(scene.path("twin.toml"), text)).expect("a twin");
    let paths = from_ref(&path);
    shown(joint_recordings(&twin(JOINT), paths));
    shown(cart_pole_recordings(&twin(CART), paths));
    shown(tanks_recordings(&twin(TANKS), paths));
    shown(equations_recordings(&twin(EQUATIONS), paths));
}
