//! `[randomize]` tried on a joint.

use super::joint_assembly;
use crate::io::{Document, InputError, RandomizedTwin, TwinFile, randomized_twin};
use crate::sim2real::randomize::{Distribution, Preset, PresetRow, Redraw, Target};
use crate::sim2real::{Seed, Simulator};

const HEAD: &str = "[twin]\nmodel = \"joint\"\n[parameters]\ninertia = 0.1\nviscous_friction = 0.2\ngravity_torque = 0.0\n\
                    [channels]\ncommand = { column = \"u\" }\nposition = { column = \"q\", unit = \"rad\" }\n\
                    [[mechanism]]\nname = \"coulomb_friction\"\ntorque = 0.1\n";

fn presets() -> Vec<Preset> {
    let row = |target: Target, relative: bool, unit| PresetRow {
        target,
        distribution: Distribution::Uniform { low: 0.5, high: 1.5 },
        relative,
        at: Redraw::Reset,
        unit,
        source: "a test",
    };
    let rows = vec![
        row(Target::own("inertia"), true, ""),
        row(Target::own("gravity_torque"), true, ""),
        row(Target::of("noise", "std"), false, "rad"),
        row(Target::of("bias", "offset"), false, "m"),
        row(Target::of("half_spread", "bps"), false, "bps"),
    ];
    vec![Preset { name: "all", about: "a test", rows }]
}

fn resolved(text: &str) -> Result<RandomizedTwin<crate::robot::Joint>, InputError> {
    let file = TwinFile::parse(Document::from_text("twin.toml", format!("{HEAD}{text}")))?;
    let assembly = joint_assembly(&file)?;
    randomized_twin(&assembly, file.document(), file.randomize.as_ref(), file.posterior.as_ref(), &presets())
}

#[test]
fn what_a_twin_does_not_list_is_added_and_does_nothing_until_it_is_drawn() {
    let twin = resolved(
        "[[randomize.parameter]]\nmechanism = \"coulomb_friction\"\nparameter = \"torque\"\ndistribution = \"uniform\"\n\
         low = 0.05\nhigh = 0.3\n[[randomize.parameter]]\nmechanism = \"command_delay\"\nparameter = \"seconds\"\n\
         distribution = \"uniform\"\nlow = 0.0\nhigh = 0.02\nunit = \"s\"\n",
    )
    .unwrap();
    assert_eq!((twin.added, twin.places), (vec!["command_delay"], vec![4, 5]));
    assert_eq!(twin.assembly.parameters()[5].nominal, 0.0);
    let table = twin.randomizer.begin(Seed(1), 0, 3, 0, twin.level);
    assert!(table.row(0).iter().all(|v| (0.05..0.3).contains(v)));
}

#[test]
fn a_posterior_is_drawn_from_by_itself_and_entries_come_before_it() {
    let own = "[posterior]\nnames = [\"inertia\", \"viscous_friction\", \"coulomb_friction.torque\"]\nvalues = [0.1, 0.2, 0.15]\n\
               std = [0.001, 0.002, 0.003]\ncorrelation = [[0.5], [0.1, 0.2]]\n";
    let twin = resolved(own).unwrap();
    assert_eq!((twin.places, twin.randomizer.correlations().len()), (vec![0, 1, 4], 3));
    assert!(matches!(resolved("").unwrap_err().to_string(), text if text.contains("neither [randomize] nor [posterior]")));
}

#[test]
fn presets_concern_what_a_twin_has() {
    let twin = resolved("[randomize]\npreset = [\"all\"]\n").unwrap();
    let names: Vec<String> = twin.randomizer.randomized().iter().map(|one| one.target.to_string()).collect();
    assert_eq!(names, ["inertia", "noise.std"]);
    let said = twin.notes.join("\n");
    assert!(said.contains("`gravity_torque`: it is told in factors") && said.contains("in `m`"), "{said}");
}

#[test]
fn what_is_not_there_is_refused_with_what_may_be_meant() {
    let one = |mechanism: &str, parameter: &str, rest: &str| {
        let text =
            format!("[[randomize.parameter]]\n{mechanism}parameter = \"{parameter}\"\ndistribution = \"uniform\"\n{rest}");
        resolved(&text).unwrap_err().to_string()
    };
    let range = "low = 0.05\nhigh = 0.3\n";
    insta::assert_snapshot!(one("mechanism = \"columb_friction\"\n", "torque", range), @"
    twin.toml:14:1: there is no mechanism `columb_friction`
      hint: did you mean `coulomb_friction`?
    ");
    insta::assert_snapshot!(one("mechanism = \"coulomb_friction\"\n", "torqe", range), @"
    twin.toml:15:1: `coulomb_friction`, as the twin lists it, has no parameter `torqe`
      hint: did you mean `torque`?
    ");
    insta::assert_snapshot!(one("mechanism = \"command_delay\"\n", "second", range), @"
    twin.toml:15:1: `command_delay` has no parameter `second`
      hint: did you mean `seconds`?
    ");
    insta::assert_snapshot!(one("", "torque", range), @r#"
    twin.toml:14:1: the model `joint` has no parameter `torque`
      hint: `coulomb_friction` has one: add mechanism = "coulomb_friction"
    "#);
    insta::assert_snapshot!(one("", "inertia", "low = 0.3\nhigh = 0.05\n"), @r#"
    twin.toml:15:1: `inertia`: expected `low` below `high`, found 0.3 and 0.05
      hint: swap them; for one value alone say distribution = "constant"
    "#);
    insta::assert_snapshot!(one("", "inertia", "low = -0.3\nhigh = 0.05\n"), @"
    twin.toml:15:1: `inertia`: draws as low as -0.3 make no sense: an inertia is above 0
      hint: draw from a range above 0, or by factors with relative = true
    ");
    insta::assert_snapshot!(one("", "inertia", "low = 0.05\nhigh = 0.3\nunit = \"g cm^2\"\n"), @"
    twin.toml:18:1: expected the unit `kg m^2`, found `g cm^2`
      hint: convert the values first: 1 g cm^2 = 0.0000001 kg m^2
    ");
    insta::assert_snapshot!(resolved("[randomize]\npreset = [\"al\"]\n").unwrap_err().to_string(), @"
    twin.toml:14:11: there is no preset `al` for this model
      hint: did you mean `all`?
    ");
    insta::assert_snapshot!(resolved("[randomize]\nposterior = \"none.toml\"\n").unwrap_err().to_string(), @r#"
    twin.toml:14:1: the document is not there, found "none.toml"
      hint: name the trued.toml that `trueup diagnose --out` has written
    "#);
}
