//! A tank that is full.

use crate::robot::{Rims, Tanks};
use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Scene, Seed, Site, Thetas, Tick, Typical};

/// `upper -> min(upper, height)`, and `caught` of what runs over falls into the lower tank; in the form `lower` it is the
/// lower tank, or its sensor, that is full at `lower_height`; in the form `both`, both are.
///
/// Source: Rogers, Holmes, Cross & Worden, "On a grey box modelling framework for nonlinear system identification",
/// Special Topics in Structural Dynamics 6 (2017); Schoukens & Noël, IFAC-PapersOnLine 50 (2017), section 3.
#[derive(Debug, Clone, Copy)]
pub struct Overflow;

impl Mechanism<Tanks> for Overflow {
    fn about(&self) -> About {
        About {
            name: "overflow",
            site: Site::Plant,
            title: "a tank that overflows",
            law: "upper -> min(upper, height), and `caught` of what runs over goes into the lower tank; \
                  lower -> min(lower, lower_height)",
            source: "Rogers, Holmes, Cross & Worden, Special Topics in Structural Dynamics 6 (2017); \
                     Schoukens & Noel, IFAC-PapersOnLine 50 (2017), 3",
            remedy: "keep the levels below the rims, or add the rims to the simulator",
            contains: &[],
        }
    }

    fn forms(&self, typical: &Typical) -> Vec<Form> {
        // The upper level is not seen: it is about as high as the lower, which is what empties into it.
        let [low, high] = typical.range;
        let at = |shares: [f64; 3]| shares.map(|share| low + share * (high - low)).map(|level| level.max(1e-3 * high.abs()));
        let rim = |name, starts: [f64; 3]| {
            Parameter::new(name, "output", f64::INFINITY).within(0.0, f64::INFINITY).starting_at(&starts)
        };
        let upper = || rim("height", at([1.3, 1.0, 0.8]));
        // A sensor that is full reads the largest value there is: a rim is just below it.
        let lower = || rim("lower_height", at([0.999, 0.98, 0.95]));
        let caught = || Parameter::new("caught", "", 0.0).within(0.0, 1.0).starting_at(&[0.3, 0.7, 0.5]);
        vec![
            Form { name: "upper", parameters: vec![upper(), caught()] },
            Form { name: "lower", parameters: vec![lower()] },
            Form { name: "both", parameters: vec![upper(), caught(), lower()] },
        ]
    }

    fn law(&self, form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<Tanks>> {
        let rims = |lane: usize| rims(form, |k| thetas.row(k)[lane]);
        Box::new(Full { form, rims: (0..thetas.lanes()).map(rims).collect() })
    }
}

/// The rims of form `form`, whose parameters are `value`.
fn rims(form: usize, value: impl Fn(usize) -> f64) -> Rims {
    match form {
        0 => Rims { upper: value(0), caught: value(1), ..Rims::default() },
        1 => Rims { lower: value(0), ..Rims::default() },
        _ => Rims { upper: value(0), caught: value(1), lower: value(2) },
    }
}

#[derive(Clone)]
struct Full {
    form: usize,
    rims: Vec<Rims>,
}

impl Law<Tanks> for Full {
    fn change(&mut self, change: &LaneChange<'_>) {
        let form = self.form;
        change.derived(&mut self.rims, |values| rims(form, |k| values[k]));
    }

    fn act(&mut self, _: Tick, _: &Scene<'_, Tanks>, effects: &mut [Rims]) {
        effects.copy_from_slice(&self.rims);
    }
}
