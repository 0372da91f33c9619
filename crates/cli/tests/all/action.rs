//! The GitHub action: its script runs here as it does there.

use std::process::{Command, Output};

use crate::common::{ROOT, code, scratch, stderr, text};

/// Runs the action's script with the `hpu` of these tests in front of all others.
fn scenes(arguments: &[&str]) -> Output {
    let own = std::path::Path::new(env!("CARGO_BIN_EXE_hpu")).parent().expect("a folder");
    let path = format!("{}:{}", text(own), std::env::var("PATH").unwrap_or_default());
    let mut command = Command::new("bash");
    command.arg(".github/actions/hpu/scenes.sh").args(arguments).current_dir(ROOT).env("PATH", path);
    command.output().expect("bash")
}

#[test]
fn the_action_keeps_a_report_of_each_scene_and_fails_where_an_expectation_is_not_met() {
    let out = scratch("action");
    let wall = "testbench/scenes/hybrid-wall.toml";
    let met = scenes(&[text(&out), wall, wall, "--", "run.duration=0.4"]);
    assert_eq!(code(&met), 0, "{}", stderr(&met));
    for name in ["hybrid-wall", "hybrid-wall-2"] {
        let report = std::fs::read_to_string(out.join(format!("{name}.xml"))).expect("a report");
        assert!(report.contains("<testsuite") && report.contains("failures=\"0\""), "{report}");
        assert!(out.join(name).join("position.svg").exists() && out.join(format!("{name}.html")).exists());
    }
    let other = scenes(&[text(&out), wall, "--", "run.duration=0.4", "expect.outcome=diverged"]);
    assert_eq!(code(&other), 1, "{}", stderr(&other));
    let report = std::fs::read_to_string(out.join("hybrid-wall.xml")).expect("a report");
    assert!(!report.contains("failures=\"0\""), "{report}");
    let wrong = scenes(&[text(&out), wall, "--", "wall.stifness=1"]);
    assert_eq!(code(&wrong), 4, "{}", stderr(&wrong));
    for none in [&[][..], &[text(&out)], &[text(&out), "--", "run.duration=1"]] {
        assert_eq!(code(&scenes(none)), 2);
    }
}

/// The action names this script, and each of its inputs is used.
#[test]
fn the_action_calls_its_script_with_its_inputs() {
    let action = std::fs::read_to_string(format!("{ROOT}/.github/actions/hpu/action.yml")).expect("the action");
    assert!(action.contains("\"$GITHUB_ACTION_PATH/scenes.sh\" hpu-out $SCENES -- \"${set[@]}\""));
    let (inputs, steps) = action.split_once("runs:").expect("steps");
    let names: Vec<_> = inputs.lines().filter_map(|line| line.strip_prefix("  ")?.strip_suffix(':')).collect();
    assert_eq!(names, ["scenes", "set", "artefact"]);
    for name in names {
        assert!(steps.contains(&format!("inputs.{name}")), "{name}");
    }
}
