//! The physics that a scene may leave out of its model, and the combinations that are refused.

use hpu_scene::{Datapath, EncoderModel, Friction, Solver, Winding};

use super::{GOOD, parse, says};

fn with(model: &str) -> Result<hpu_scene::Scene, String> {
    parse(&format!("{GOOD}[model]\n{model}\n"), &[])
}

#[track_caller]
fn refused(model: &str, expected: &str) {
    says(with(model).expect_err(model), expected);
}

/// Returns a mass that is accepted, with its model last.
fn mass(model: &str) -> Result<hpu_scene::Scene, String> {
    let text = r#"about = "A mass."
[device]
kind = "mass"
mass = "0.1 kg"
damping = 0
[encoder]
resolution = "20 um"
[amplifier]
full_scale = "10 N"
[clock]
frequency = "50 MHz"
[method]
kind = "conventional"
sample_rate = "1 kHz"
[wall]
position = "10 mm"
stiffness = "1 kN/m"
[hand]
kind = "none"
[run]
duration = "1 s"
[model]
"#;
    parse(&format!("{text}{model}\n"), &[])
}

#[test]
fn nothing_is_left_out_unless_a_scene_says_so() {
    let model = parse(GOOD, &[]).unwrap().model;
    assert_eq!((model.solver, model.step_s, model.datapath), (Solver::Events, None, Datapath::Words));
    assert_eq!(
        (model.winding, model.friction, model.encoder),
        (Winding::Inductive, Friction::StickSlip, EncoderModel::Quantised)
    );
}

#[test]
fn every_solver_is_read_and_those_of_fixed_steps_take_a_step() {
    for solver in Solver::ALL {
        let step = if solver.is_fixed_step() { "\nstep = \"1 us\"" } else { "" };
        let bridge = "\nbridge = \"averaged\"";
        let scene = with(&format!("solver = \"{}\"{step}{bridge}", solver.name())).unwrap();
        assert_eq!(scene.model.solver, solver);
        assert_eq!(scene.step_clocks(), if solver.is_fixed_step() { 50 } else { 50_000 });
    }
}

#[test]
fn a_step_is_a_whole_number_of_clocks_and_at_least_one() {
    for (step, clocks) in [("1 ns", 1), ("20 ns", 1), ("49 ns", 2), ("51 ns", 3), ("1 ms", 50_000)] {
        assert_eq!(with(&format!("solver = \"rk4\"\nstep = \"{step}\"")).unwrap().step_clocks(), clocks, "{step}");
    }
}

#[test]
fn an_unknown_solver_is_refused_with_those_there_are() {
    refused(
        "solver = \"heun\"",
        "17:10: model.solver: `heun` is none of \"events\", \"clock\", \"sample\", \"euler\", \"semi_implicit\", \
         \"midpoint\", \"rk4\"",
    );
}

#[test]
fn a_fixed_step_solver_without_a_step_and_a_step_without_one_are_refused() {
    refused("solver = \"euler\"", "16:1: model.step: missing; write a time as s, ms, min or a number in s");
    for solver in ["events", "clock", "sample"] {
        refused(
            &format!("solver = \"{solver}\"\nstep = 1e-6"),
            &format!(
                "18:8: model.step: \"{solver}\" has no step of its own; leave it out, or write solver = \"euler\", \
                 \"semi_implicit\", \"midpoint\" or \"rk4\""
            ),
        );
    }
    refused("solver = \"rk4\"\nstep = 0", "18:8: model.step: `0` must be above zero");
}

#[test]
fn one_step_a_sample_sees_no_switching() {
    refused(
        "solver = \"sample\"",
        "17:10: model.solver: \"sample\" meets the bridge once a sample and sees no switching; \
         write bridge = \"averaged\"",
    );
    assert!(mass("solver = \"sample\"").is_ok());
}

#[test]
fn a_dead_band_is_that_of_a_mean_voltage_below_the_supply() {
    let banded = |band: &str, bridge: &str| parse(GOOD, &[("bridge.dead_band", band), ("model.bridge", bridge)]);
    let has = |said: String, part: &str| assert!(said.contains(part), "{said}");
    assert_eq!(banded("60 mV", "averaged").unwrap().bridge.dead_band_v, 0.06);
    has(banded("60 mV", "switching").unwrap_err(), "this bridge switches the whole supply; write model.bridge");
    has(banded("24 V", "averaged").unwrap_err(), "not below the supply, 24 V");
    let linear =
        parse(GOOD, &[("bridge.dead_band", "1 V"), ("model.bridge", "averaged"), ("model.datapath", "linear")]);
    has(linear.unwrap_err(), "bridge.dead_band: the linear law has none");
}

#[test]
fn a_winding_without_inductance_asks_for_an_averaged_bridge_and_has_no_current_of_its_own() {
    refused(
        "winding = \"resistive\"",
        "17:11: model.winding: without inductance nothing smooths the switching; write bridge = \"averaged\" beside it",
    );
    let model = "[model]\nbridge = \"averaged\"\nwinding = \"resistive\"\n";
    assert_eq!(parse(&format!("{GOOD}{model}"), &[]).unwrap().model.winding, Winding::Resistive);
    assert_eq!(
        parse(&format!("{GOOD}{model}"), &[("device.initial_current", "1 A")]).unwrap_err(),
        "--set device.initial_current=1 A: device.initial_current: the current of a \"resistive\" winding follows from \
         voltage and speed; leave this out"
    );
    says(mass("winding = \"resistive\"").unwrap_err(), "23:11: model.winding: a mass has no winding; leave this out");
}

#[test]
fn smoothed_friction_needs_its_speed_and_no_other_has_one() {
    refused(
        "friction = \"smoothed\"",
        "16:1: model.friction_speed: missing; write an angular speed as rad/s, mrad/s, deg/s, rpm, \
         rev/s or a number in rad/s",
    );
    for model in ["friction_speed = 1", "friction = \"none\"\nfriction_speed = 1"] {
        let line = 16 + model.lines().count();
        refused(
            model,
            &format!(
                "{line}:18: model.friction_speed: only smoothed friction has it; \
                 write friction = \"smoothed\" beside it"
            ),
        );
    }
    let smoothed = |speed_rad_per_s| Friction::Smoothed { speed_rad_per_s };
    assert_eq!(with("friction = \"smoothed\"\nfriction_speed = 2").unwrap().model.friction, smoothed(2.0));
    assert_eq!(mass("friction = \"smoothed\"\nfriction_speed = \"3 mm/s\"").unwrap().model.friction, smoothed(0.003));
    assert_eq!(with("friction = \"none\"").unwrap().model.friction, Friction::None);
}

#[test]
fn an_ideal_encoder_needs_the_law_in_steps() {
    refused(
        "encoder = \"ideal\"",
        "17:11: model.encoder: \"ideal\" is a position in floats, which only the law in floats reads; \
         write datapath = \"law\"",
    );
    for solver in ["events", "clock"] {
        says(
            mass(&format!("encoder = \"ideal\"\ndatapath = \"law\"\nsolver = \"{solver}\"")).unwrap_err(),
            &format!(
                "23:11: model.encoder: \"ideal\" is read once a step, and \"{solver}\" has none; write \
                 solver = \"sample\", \"euler\", \"semi_implicit\", \"midpoint\" or \"rk4\""
            ),
        );
    }
    let scene = mass("encoder = \"ideal\"\ndatapath = \"law\"\nsolver = \"sample\"").unwrap();
    assert_eq!(scene.model.encoder, EncoderModel::Ideal);
}

#[test]
fn the_linear_law_is_flowed_exactly_with_its_inductance_and_without_coulombs_friction() {
    let linear = |model: &str| with(&format!("datapath = \"linear\"\n{model}")).unwrap_err();
    says(
        linear("solver = \"clock\""),
        "18:10: model.solver: \"clock\" is not for the linear law, which is flowed exactly; leave it out",
    );
    says(linear("winding = \"resistive\""), "18:11: model.winding: the linear law has its inductance; leave this out");
    says(
        linear("friction = \"smoothed\"\nfriction_speed = 1"),
        "18:12: model.friction: the linear law has no Coulomb friction; write \"none\"",
    );
}

#[test]
fn a_recording_has_no_device_to_step() {
    let text = GOOD.replace(
        "kind = \"none\"",
        "kind = \"capture\"\nfile = { path = \"good.vcd\", to = 1e6 }\nchannel_a = \"D0\"\nchannel_b = \"D1\"",
    );
    says(
        parse(&format!("{text}[model]\nsolver = \"euler\"\nstep = 1e-6\n"), &[]).unwrap_err(),
        "20:10: model.solver: \"capture\" has no device for \"euler\" to move; write solver = \"events\" or \"clock\"",
    );
}
