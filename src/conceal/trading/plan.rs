//! What is to be concealed in a case, and under what circumstances.

use rand::RngExt;
use rand::seq::SliceRandom;

use super::case::{Assumed, Depth, World};
use super::excitation::{Peculiar, UNREACHED};
use super::noise::Noise;
use super::recipe::{FOREIGN, KNOWN, RESTING, compatible};
use crate::conceal::kind::planned;
use crate::conceal::{Kind, Null};
use crate::sim2real::Seed;

/// Kind and names.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Plan {
    pub kind: Kind,
    pub ids: Vec<&'static str>,
}

/// What the data are like.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Circumstances {
    pub world: World,
    pub depth: Depth,
    pub price: Assumed,
    pub noise: Noise,
    /// Whether stamps of the log are cut to a second.
    pub rounded: bool,
    /// Whether orders tell what they saw.
    pub tells_seen: bool,
    /// Whether trades are on the tape.
    pub prints: bool,
    pub peculiar: Option<Peculiar>,
}

/// Cases without an effect, in turn.
const NULLS: [Null; 6] = [Null::White, Null::HeavyTailed, Null::Coloured, Null::Alpha, Null::Rounded, Null::MisSet];

/// Names in the order in which they are dealt: rests come up as often as the others.
fn known() -> Vec<&'static str> {
    KNOWN.into_iter().chain(RESTING).collect()
}

impl Plan {
    pub fn of(seed: Seed, index: usize) -> Self {
        let (kind, ordinal) = planned(index);
        let dealt = |names: &[&'static str], what: &str| {
            let (round, place) = (ordinal / names.len(), ordinal % names.len());
            let mut names = names.to_vec();
            names.shuffle(&mut *seed.stream(&format!("{what} {round}")));
            names[place]
        };
        match kind {
            0 => Self { kind: Kind::Single, ids: vec![dealt(&known(), "singles")] },
            1 => {
                let first = dealt(&known(), "pairs");
                let mut rng = seed.stream(&format!("partner {ordinal}"));
                let others: Vec<&'static str> = known().into_iter().filter(|other| compatible(first, other)).collect();
                Self { kind: Kind::Pair, ids: vec![first, others[rng.random_range(0..others.len())]] }
            }
            2 => Self { kind: Kind::Null(NULLS[ordinal % NULLS.len()]), ids: Vec::new() },
            3 => Self { kind: Kind::Outside, ids: vec![dealt(&FOREIGN, "foreign")] },
            _ => Self { kind: Kind::NotExcited, ids: vec![dealt(&UNREACHED, "unreached")] },
        }
    }

    pub fn has(&self, id: &str) -> bool {
        self.ids.contains(&id)
    }

    /// Whether there are orders that rest.
    pub fn rests(&self) -> bool {
        RESTING.iter().any(|id| self.has(id))
    }

    /// Whether mids alone could show what is concealed.
    fn shows_in_mids(&self) -> bool {
        const NEEDS_MORE: [&str; 11] = [
            "book_walk",
            "command_delay",
            "participation_cap",
            "stale_quotes",
            "adverse_selection",
            "queue_position",
            "last_look",
            "round_price_improvement",
            "momentum_ignition",
            "imbalance_cost",
            "volatility_slippage",
        ];
        !NEEDS_MORE.iter().any(|id| self.has(id)) && matches!(self.kind, Kind::Single | Kind::Outside | Kind::Null(_))
            // Which row of mids an order was decided on could not be told.
            && self.kind != Kind::Null(Null::Rounded)
    }

    /// The circumstances of attempt `seed` at this case.
    pub fn circumstances(&self, seed: Seed) -> Circumstances {
        let mut rng = seed.stream("circumstances");
        // All draws are made, whichever count, so that one name's needs change no other's luck.
        let [live, deep, mids, rounded, midway, noise, seen, prints] = std::array::from_fn(|_| rng.random::<f64>());
        let kept = rng.random_range(0.3..0.6);
        let only_mids = mids < 0.12 && self.shows_in_mids();
        let reacts = self.rests() || self.has("momentum_ignition") || live < 0.5;
        let depth = match () {
            () if only_mids => Depth::MidsOnly,
            () if deep < 0.55 || self.has("book_walk") || self.has("participation_cap") => Depth::FiveLevels,
            () => Depth::Touch,
        };
        // A twin that fills at the mid leaves half a spread out, and so does one at the touch where more is charged.
        let mid = only_mids || if self.has("half_spread") { midway < 0.8 } else { midway < 0.15 && !self.rests() };
        let noise = match self.kind {
            Kind::Null(Null::HeavyTailed) => Noise::HeavyTailed,
            Kind::Null(Null::Coloured) => Noise::Coloured(0.2 + kept),
            Kind::Null(_) => Noise::White,
            _ if noise < 0.2 => Noise::HeavyTailed,
            _ if noise < 0.35 => Noise::Coloured(kept),
            _ => Noise::White,
        };
        // How late an order was, or how old what it saw, nobody could tell from stamps that are cut to a second.
        let timed = self.has("command_delay") || self.has("stale_quotes");
        let plain = matches!(self.kind, Kind::Single | Kind::Pair) && !timed;
        Circumstances {
            world: if reacts && !only_mids { World::Live } else { World::Paper },
            depth,
            price: if mid { Assumed::Mid } else { Assumed::Touch },
            noise,
            rounded: self.kind == Kind::Null(Null::Rounded) || plain && rounded < 0.12 && !self.rests() && !only_mids,
            tells_seen: !only_mids && (self.has("stale_quotes") || seen < 0.5),
            prints: !only_mids && (self.rests() || prints < 0.85),
            peculiar: (self.kind == Kind::NotExcited).then(|| Peculiar::of(self.ids[0])),
        }
    }
}
