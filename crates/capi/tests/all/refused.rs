//! Scenes that have no plant with pins.

use hpu::{Plant, Status};

use crate::common::{set, shipped};

#[test]
fn a_scene_without_a_clock_is_refused() {
    let pairs = set(&["model.solver=rk4", "model.step=10 us", "model.datapath=law", "model.bridge=averaged"]);
    let refused = Plant::open(&shipped("hybrid-wall"), &pairs).err().expect("no clock");
    assert_eq!(refused.status, Status::Refused);
    let wanted = "testbench/scenes/hybrid-wall.toml: with this model.solver it runs without a clock, and pins have one";
    assert_eq!(refused.text, wanted);
}

#[test]
fn all_errors_of_a_scene_are_told() {
    let pairs = set(&["wall.stiffness=soft", "encoder.lines=-1"]);
    let refused = Plant::open(&shipped("hybrid-wall"), &pairs).err().expect("two errors");
    assert!(refused.text.contains("wall.stiffness") && refused.text.ends_with("2 errors"), "{refused}");
}
