//! Scenes that have no plant with pins.

use hpu::{Plant, Status};

use crate::common::{PLANT, set, shipped, written};

#[test]
fn a_scene_without_a_clock_is_refused() {
    let pairs = set(&["model.solver=rk4", "model.step=10 us", "model.datapath=law", "model.bridge=averaged"]);
    let refused = Plant::open(&shipped("hybrid-wall"), &pairs).err().expect("no clock");
    assert_eq!(refused.status, Status::Refused);
    let wanted = "testbench/scenes/hybrid-wall.toml: with this model.solver it runs without a clock, and pins have one";
    assert_eq!(refused.text, wanted);
}

#[test]
fn a_device_that_follows_words_inside_its_loop_is_refused() {
    for (name, model) in [
        ("foc-detents", "model.bridge=averaged"),
        ("foc-detents", "model={ bridge = \"averaged\", currents = \"ideal\" }"),
        ("epfl-paddle-step", "model.bridge=averaged"),
    ] {
        let refused = Plant::open(&shipped(name), &set(&[model])).err().expect("no pins");
        assert_eq!(refused.status, Status::Refused);
        assert!(refused.text.ends_with("follows words inside the loop, and pins are gates"), "{name}: {refused}");
    }
}

#[test]
fn all_errors_of_a_scene_are_told() {
    let pairs = set(&["wall.stiffness=soft", "encoder.lines=-1"]);
    let refused = Plant::open(&shipped("hybrid-wall"), &pairs).err().expect("two errors");
    assert!(refused.text.contains("wall.stiffness") && refused.text.ends_with("2 errors"), "{refused}");
}

/// The pins of a plant alone are gates, so a mass needs somebody to say the word of its amplifier.
#[test]
fn a_plant_alone_is_a_motors_and_nothing_runs_it() {
    let refused = |text: &str, pairs: &[&str]| {
        let refused = Plant::open(&written(&[text]), &set(pairs)).err().expect("no plant alone");
        assert_eq!(refused.status, Status::Refused);
        refused.text
    };
    let mass =
        PLANT.replace("\"motor\"\nmotor = \"vasudevan_2007\"\ninitial_speed = \"100 rad/s\"", "\"mass\"\nmass = 0.1");
    let of_mass = refused(&mass, &[]);
    assert!(of_mass.starts_with("written.toml:1:1: method: missing; write a [method]"), "{of_mass}");
    assert!(refused(PLANT, &["wall.varies=dut.generics.K", "wall.position=1"]).contains("has nothing to vary"));
    assert!(refused(PLANT, &["device.mass=1"]).contains("device.mass"));
    let run = written(&[PLANT]).parse(&[]).expect_err("nothing closes the loop");
    let run = format!("{run:#}");
    assert!(!run.contains('\n') && run.contains("hpu_open of libhpu, or hpu.Plant in Python"), "{run}");
    let mut plant = Plant::open(&written(&[PLANT]), &[]).expect("a plant alone");
    let shorted = plant.drive(&[1, 1, 0, 0]).expect_err("a short circuit");
    assert!(shorted.text.starts_with("both switches of leg a are closed at clock edge 0"), "{shorted}");
}
