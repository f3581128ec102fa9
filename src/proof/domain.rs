//! The two domains of the benchmark, and what is said of each.

use std::fmt;

use serde::{Deserialize, Serialize};

/// What effects are concealed in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Domain {
    /// Joints of every kind.
    Robot,
    /// Days of orders.
    Market,
}

/// Words about a domain's cases and baselines.
#[derive(Debug, Clone, Copy)]
pub(super) struct Told {
    /// What its cases are of.
    pub title: &'static str,
    /// How a case comes about.
    pub cases: &'static str,
    /// What the generator does not share with what has to find it, and how it goes about it.
    pub generator: &'static str,
    /// In what sizes are counted.
    pub sizes: &'static str,
    /// What misleads where nothing is missing.
    pub misled: &'static str,
    /// What the baseline is that regresses.
    pub regression: &'static str,
}

impl Domain {
    /// Its word on the command line.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Robot => "robot",
            Self::Market => "market",
        }
    }

    pub(super) fn told(self) -> Told {
        match self {
            Self::Robot => Told {
                title: "joints",
                cases: "a joint and its twin, whose parameters are off, and two recordings",
                generator: "The generator shares no code with the plants, states each effect in another form, and integrates at \
                            0.1 ms or finer.",
                sizes: "An effect's size is what it changes in the recording beyond what refitting inertia, friction, gravity \
                        and initial state could hide, over the noise, and, unless it is the counting itself, before a sensor counts. \
                        Cases in which such refitting hides most of an effect after \
                        all, or in which next to nothing decides how the arm moves on, so that an effect of no size would move it far, \
                        are drawn again.",
                misled: "something named where nothing is missing: coloured noise, rounding, a coarse integrator",
                regression: "\"sparse regression\" differentiates the smoothed position and regresses the balance of torques",
            },
            Self::Market => Told {
                title: "markets",
                cases: "two days of orders, the tapes they met, and a twin that fills at the touch or at the mid",
                generator: "The generator shares no code with the market's mechanisms, states each effect in another form, and \
                            makes tapes by processes of price, volatility, spread, depth and trades. In half of the cases the \
                            tape shows the orders and what they moved, in the others it does not react.",
                sizes: "An effect's size is what it changes in the costs, fees or parts filled of orders, or in the recorded mid, \
                        over the noise there.",
                misled: "something named where nothing is missing: heavy-tailed or autocorrelated costs, decisions that foretell \
                         the market, stamps cut to a second",
                regression: "\"sparse regression\" regresses costs on what they are usually put down to, fees on the notional",
            },
        }
    }
}

impl fmt::Display for Domain {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.word())
    }
}
