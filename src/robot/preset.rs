//! Ranges that others have randomized robots by, each with its source.

use crate::sim2real::randomize::{Distribution, Preset, PresetRow, Redraw, Target};

/// Peng, Andrychowicz, Zaremba and Abbeel, "Sim-to-real transfer of robotic control with dynamics randomization", ICRA 2018
/// (arXiv:1710.06537). Table I: controller gains 0.5 to 2 times; section V: drawn anew at the start of each episode, gains
/// logarithmically.
const PENG_GAINS: &str = "Peng et al., ICRA 2018 (arXiv:1710.06537), table I: controller gains, drawn logarithmically";

/// OpenAI et al., "Learning dexterous in-hand manipulation", arXiv:1808.00177v5 (2019). Appendix C.2: drawn at the beginning
/// of every episode and held.
const OPENAI_P: &str = "OpenAI et al., arXiv:1808.00177 (2018), table 1: actuator force gains (P term)";
const OPENAI_DIMENSIONS: &str = "OpenAI et al., arXiv:1808.00177 (2018), table 1: object dimensions";
const OPENAI_DAMPING: &str = "OpenAI et al., arXiv:1808.00177 (2018), table 1: robot joint damping coefficients";
const OPENAI_GRAVITY: &str =
    "OpenAI et al., arXiv:1808.00177 (2018), table 1: gravity vector, each coordinate + N(0, 0.4) m/s^2";

/// Tan et al., "Sim-to-real: learning agile locomotion for quadruped robots", RSS 2018 (arXiv:1804.10332). As it was released,
/// uniform and at every reset: bulletphysics/bullet3 at 3bc08c1, `minitaur_env_randomizer_config.py` in
/// `examples/pybullet/gym/pybullet_envs/minitaur/envs/env_randomizers` (all but the inertial unit).
const TAN_BIAS: &str = "Tan et al., RSS 2018 (arXiv:1804.10332), table I: IMU bias";
const TAN_NOISE: &str = "Tan et al., RSS 2018 (arXiv:1804.10332), table I: IMU noise (std)";
/// From the command to the report of what it did; in the released code a delay of what is observed.
const TAN_LATENCY: &str = "Tan et al., RSS 2018 (arXiv:1804.10332), table I: latency";
const TAN_STRENGTH: &str = "Tan et al., RSS 2018 (arXiv:1804.10332), table I: motor strength";
const TAN_INERTIA: &str = "Tan et al., RSS 2018 (arXiv:1804.10332), table I: inertia";
const TAN_FRICTION: &str = "Tan et al., RSS 2018 (arXiv:1804.10332), table I: motor friction";

/// Hwangbo et al., "Learning agile and dynamic motor skills for legged robots", Science Robotics 4 (2019)
/// (arXiv:1901.08652), section "Modeling rigid-body dynamics": 30 models of the robot, made before training.
const HWANGBO: &str =
    "Hwangbo et al., Science Robotics 4 (2019) (arXiv:1901.08652): masses of links U(-15, 15) %, 30 models";

/// Muratore's simulations of Quanser's devices: famura/SimuRLacra at 0572545,
/// `Pyrado/pyrado/domain_randomization/default_randomizers.py`; drawn at every reset (`DomainRandWrapperLive`).
const CART_POLE: &str =
    "SimuRLacra (2020), default randomizer of QCartPoleSim: B_eq and B_pole, half span a quarter of nominal";
const DEAD_VOLTAGE: &str =
    "SimuRLacra (2020), default randomizer of QBallBalancerSim: V_thold, half span a third of nominal";
const TORQUE_LIMIT: &str =
    "SimuRLacra (2020), default randomizer of PendulumSim: tau_max, standard deviation a tenth of nominal";

/// isaac-sim/IsaacLab at 17ad46e, `source/isaaclab_assets/isaaclab_assets/robots/spot.py`: `min_delay` 0, `max_delay` 4
/// physics steps of 2 ms each, drawn at every reset. There whole steps are drawn, here anything between.
const SPOT: &str = "Isaac Lab (2026), actuators of Boston Dynamics' Spot: a delay of 0 to 4 steps of 2 ms";

/// mekion/the-bimo-project at 8121d15, `IsaacLab/bimo/actuators/STS3215.py`: `backlash_range_deg` (1.0, 2.4), "measured on
/// real robot", uniform at every reset. The whole gap: the law there follows at half of it. It is drawn anew there wherever
/// gears touch again, too.
const BIMO: &str = "Bimo (2026), actuator STS3215: backlash of 1.0 to 2.4 degrees, measured on the robot";

fn factor(target: Target, distribution: Distribution, source: &'static str) -> PresetRow {
    PresetRow { target, distribution, relative: true, at: Redraw::Reset, unit: "", source }
}

fn absolute(target: Target, distribution: Distribution, unit: &'static str, source: &'static str) -> PresetRow {
    PresetRow { target, distribution, relative: false, at: Redraw::Reset, unit, source }
}

/// The presets of robots. Where these sources differ, the narrower range is here: a wider one can be said in a document.
#[must_use]
pub fn presets() -> Vec<Preset> {
    vec![sensors(), actuators(), transmission(), physics(), control()]
}

fn uniform(low: f64, high: f64) -> Distribution {
    Distribution::Uniform { low, high }
}

fn logarithmic(low: f64, high: f64) -> Distribution {
    Distribution::LogUniform { low, high }
}

fn sensors() -> Preset {
    Preset {
        name: "sensors",
        about: "What sensors report: an offset an episode, noise, and how late it is",
        rows: vec![
            // Of an inertial unit's angles.
            absolute(Target::of("bias", "offset"), uniform(-0.05, 0.05), "rad", TAN_BIAS),
            absolute(Target::of("noise", "std"), uniform(0.0, 0.05), "rad", TAN_NOISE),
            absolute(Target::of("observation_delay", "seconds"), uniform(0.0, 0.04), "s", TAN_LATENCY),
        ],
    }
}

fn actuators() -> Preset {
    Preset {
        name: "actuators",
        about: "What becomes of a command: its strength, its limits and its delay",
        rows: vec![
            factor(Target::own("gain"), uniform(0.8, 1.2), TAN_STRENGTH),
            absolute(Target::of("command_delay", "seconds"), uniform(0.0, 0.008), "s", SPOT),
            factor(Target::of("dead_zone", "width"), uniform(2.0 / 3.0, 4.0 / 3.0), DEAD_VOLTAGE),
            factor(Target::of("saturation", "limit"), Distribution::Normal { mean: 1.0, std: 0.1 }, TORQUE_LIMIT),
        ],
    }
}

/// By itself: a gap takes a second mass, of which nobody says how it is shared out.
fn transmission() -> Preset {
    let gap = uniform(1.0_f64.to_radians(), 2.4_f64.to_radians());
    Preset {
        name: "transmission",
        about: "The gap between the gears of a small servo",
        rows: vec![absolute(Target::of("backlash", "gap"), gap, "rad", BIMO)],
    }
}

fn physics() -> Preset {
    let own = Target::own;
    let at_startup = |row: PresetRow| PresetRow { at: Redraw::Startup, ..row };
    Preset {
        name: "physics",
        about: "Masses, friction and gravity",
        rows: vec![
            factor(own("inertia"), uniform(0.5, 1.5), TAN_INERTIA),
            at_startup(factor(own("cart_mass"), uniform(0.85, 1.15), HWANGBO)),
            at_startup(factor(own("pole_mass"), uniform(0.85, 1.15), HWANGBO)),
            factor(own("half_length"), uniform(0.95, 1.05), OPENAI_DIMENSIONS),
            factor(own("viscous_friction"), logarithmic(0.3, 3.0), OPENAI_DAMPING),
            factor(own("cart_friction"), uniform(0.75, 1.25), CART_POLE),
            factor(own("pole_friction"), uniform(0.75, 1.25), CART_POLE),
            // Of the vector that is added there, what is along gravity.
            factor(own("gravity"), Distribution::Normal { mean: 1.0, std: 0.4 / 9.81 }, OPENAI_GRAVITY),
            absolute(Target::of("coulomb_friction", "torque"), uniform(0.0, 0.05), "N m", TAN_FRICTION),
        ],
    }
}

fn control() -> Preset {
    Preset {
        name: "control",
        about: "Gains of the controller that closes the loop",
        rows: vec![
            factor(Target::own("controller.kp"), logarithmic(0.75, 1.5), OPENAI_P),
            factor(Target::own("controller.ki"), logarithmic(0.5, 2.0), PENG_GAINS),
            factor(Target::own("controller.kd"), logarithmic(0.5, 2.0), PENG_GAINS),
        ],
    }
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
            let parameter = forms.iter().flat_map(|f| &f.parameters).find(|p| p.name == row.target.parameter);
            let parameter = parameter.unwrap_or_else(|| panic!("{} is no parameter", row.target));
            let [low, high] = row.distribution.support();
            assert!(row.relative || parameter.lower <= low && high <= parameter.upper, "{}", row.target);
        }
    }
}
