//! What a label says, of whichever domain it is.

use super::domain::Domain;
use crate::conceal::{Concealed, Kind, benchmark, trading};

/// What was true of a case.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// Number of the case.
    pub index: usize,
    /// What it was for.
    pub kind: Kind,
    /// What was concealed, by registries' names.
    pub effects: Vec<Concealed>,
    /// What was concealed that no registry has, and its size [standard deviations of the noise].
    pub outside: Option<(String, f64)>,
    /// Names that are neither right nor wrong.
    pub tolerated: Vec<String>,
    /// Standard deviation of the noise of the channel whose errors are told, in its unit.
    pub noise: f64,
    /// What makes the case what it is, in words.
    pub circumstances: String,
    /// Whether the data are so poor that no more is promised than not to be sure of what is not so: mids alone of a market.
    pub poor: bool,
}

impl Truth {
    /// What a label of a case of `domain` says.
    ///
    /// # Errors
    /// A text that is no such label.
    pub fn of(domain: Domain, label: &str) -> Result<Self, serde_json::Error> {
        match domain {
            Domain::Robot => serde_json::from_str(label).map(of_joint),
            Domain::Market => serde_json::from_str(label).map(of_market),
        }
    }
}

fn of_joint(label: benchmark::Label) -> Truth {
    let axis = match (label.arm.linear, label.arm.gravity_torque == 0.0) {
        (true, _) => "linear axis",
        (false, true) => "arm without gravity",
        (false, false) => "arm",
    };
    Truth {
        circumstances: format!(
            "{axis}, {:.0} dB, noise {}, {} then {}",
            label.snr, label.noise_kind, label.excitation[0], label.excitation[1]
        ),
        index: label.index,
        kind: label.kind,
        effects: label.effects,
        outside: label.outside,
        tolerated: label.tolerated,
        noise: label.noise,
        poor: false,
    }
}

fn of_market(label: trading::Label) -> Truth {
    let world = match label.world {
        trading::World::Live => "tape shows the orders",
        trading::World::Paper => "tape does not react",
    };
    let depth = match label.depth {
        trading::Depth::FiveLevels => "five levels",
        trading::Depth::Touch => "touch",
        trading::Depth::MidsOnly => "mids alone",
    };
    let noise = format!("noise {:.2} bps, {}", label.noise, label.noise_kind);
    let orders = format!("{} orders then {}", label.orders[0], label.orders[1]);
    let stamps = if label.rounded { "stamps cut to a second".to_owned() } else { String::new() };
    let told = [world.to_owned(), depth.to_owned(), noise, orders, stamps, label.peculiar];
    let told = told.into_iter().chain(label.forms).filter(|words| !words.is_empty());
    Truth {
        circumstances: told.collect::<Vec<String>>().join(", "),
        index: label.index,
        kind: label.kind,
        effects: label.effects,
        outside: label.outside,
        tolerated: label.tolerated,
        noise: label.noise,
        poor: label.depth == trading::Depth::MidsOnly,
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A label of a joint in which nothing is concealed.
    pub(in crate::proof) fn joint_label(index: usize) -> benchmark::Label {
        benchmark::Label {
            index,
            kind: Kind::Single,
            outside: None,
            effects: Vec::new(),
            tolerated: vec!["quantization".to_owned()],
            arm: benchmark::Arm { linear: false, inertia: 0.1, viscous_friction: 0.2, gravity_torque: 2.0, gain: 1.0 },
            nominal: [0.1, 0.2, 2.0, 1.0],
            noise: 5.0 / 3.0,
            noise_kind: "white".to_owned(),
            snr: 30.0,
            excitation: ["multisine".to_owned(), "chirp".to_owned()],
        }
    }

    #[test]
    fn a_label_says_the_same_as_text() {
        let text = serde_json::to_string(&joint_label(3)).unwrap();
        let truth = Truth::of(Domain::Robot, &text).unwrap();
        assert_eq!((truth.index, truth.noise, truth.kind), (3, 5.0 / 3.0, Kind::Single));
        assert_eq!(truth.circumstances, "arm, 30 dB, noise white, multisine then chirp");
        assert!(Truth::of(Domain::Market, &text).is_err());
    }
}
