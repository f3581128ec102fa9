//! Ranges that others have randomized robots by, each with its source.

use crate::sim2real::randomize::{Distribution, Preset, PresetRow, Redraw, Target};

/// Peng, Andrychowicz, Zaremba and Abbeel, "Sim-to-real transfer of robotic control with dynamics randomization", ICRA 2018,
/// table I.
const PENG: &str = "Peng et al., ICRA 2018, table I";
/// OpenAI et al., "Learning dexterous in-hand manipulation", arXiv:1808.00177 (2018), table 1.
const OPENAI: &str = "OpenAI et al., arXiv:1808.00177 (2018), table 1";
/// Tan et al., "Sim-to-real: learning agile locomotion for quadruped robots", RSS 2018, table I.
const TAN: &str = "Tan et al., RSS 2018, table I";
/// Hwangbo et al., "Learning agile and dynamic motor skills for legged robots", Science Robotics 4 (2019).
const HWANGBO: &str = "Hwangbo et al., Science Robotics 4 (2019)";

fn factor(target: Target, distribution: Distribution, source: &'static str) -> PresetRow {
    PresetRow { target, distribution, relative: true, at: Redraw::Reset, unit: "", source }
}

fn absolute(target: Target, distribution: Distribution, unit: &'static str, source: &'static str) -> PresetRow {
    PresetRow { target, distribution, relative: false, at: Redraw::Reset, unit, source }
}

/// The presets of robots. Where sources differ, the narrower range is here: a wider one can be said in a document.
#[must_use]
pub fn presets() -> Vec<Preset> {
    let uniform = |low, high| Distribution::Uniform { low, high };
    let logarithmic = |low, high| Distribution::LogUniform { low, high };
    let own = Target::own;
    vec![
        Preset {
            name: "sensors",
            about: "What sensors report: an offset an episode, and noise",
            rows: vec![
                // Of an inertial unit's angles.
                absolute(Target::of("bias", "offset"), uniform(-0.05, 0.05), "rad", TAN),
                absolute(Target::of("noise", "std"), uniform(0.0, 0.05), "rad", TAN),
            ],
        },
        Preset {
            name: "actuators",
            about: "What becomes of a command: its strength and its delay",
            rows: vec![
                factor(own("gain"), logarithmic(0.75, 1.5), OPENAI),
                absolute(Target::of("command_delay", "seconds"), uniform(0.0, 0.04), "s", TAN),
            ],
        },
        Preset {
            name: "physics",
            about: "Masses, friction and gravity",
            rows: vec![
                factor(own("inertia"), uniform(0.5, 1.5), TAN),
                factor(own("cart_mass"), uniform(0.85, 1.15), HWANGBO),
                factor(own("pole_mass"), uniform(0.85, 1.15), HWANGBO),
                factor(own("half_length"), uniform(0.95, 1.05), OPENAI),
                factor(own("viscous_friction"), logarithmic(0.3, 3.0), OPENAI),
                factor(own("cart_friction"), uniform(0.7, 1.3), OPENAI),
                factor(own("pole_friction"), logarithmic(0.3, 3.0), OPENAI),
                // A vector with a standard deviation of 0.4 m/s^2 is added to gravity there.
                factor(own("gravity"), Distribution::Normal { mean: 1.0, std: 0.4 / 9.81 }, OPENAI),
                absolute(Target::of("coulomb_friction", "torque"), uniform(0.0, 0.05), "N m", TAN),
            ],
        },
        Preset {
            name: "control",
            about: "Gains of the controller that closes the loop",
            rows: vec![
                factor(own("controller.kp"), uniform(0.5, 2.0), PENG),
                factor(own("controller.ki"), uniform(0.5, 2.0), PENG),
                factor(own("controller.kd"), uniform(0.5, 2.0), PENG),
            ],
        },
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_is_a_distribution_with_a_source_and_stands_once() {
        let all = presets();
        let rows: Vec<&PresetRow> = all.iter().flat_map(|preset| &preset.rows).collect();
        for (k, row) in rows.iter().enumerate() {
            row.distribution.check().unwrap();
            assert!(row.source.contains("20"), "{}", row.target);
            assert!(rows[..k].iter().all(|other| other.target != row.target), "{} is here twice", row.target);
            assert!(!row.relative || row.unit.is_empty() && row.distribution.support()[0] > 0.0, "{}", row.target);
        }
    }

    #[test]
    fn rows_of_mechanisms_are_of_the_registry() {
        for row in presets().iter().flat_map(|preset| &preset.rows) {
            let Some(id) = &row.target.mechanism else { continue };
            let mechanism = crate::robot::MECHANISMS.iter().find(|m| m.about().name == id).unwrap();
            let forms = mechanism.forms(&Default::default());
            assert!(forms.iter().any(|f| f.parameters.iter().any(|p| p.name == row.target.parameter)), "{}", row.target);
        }
    }
}
