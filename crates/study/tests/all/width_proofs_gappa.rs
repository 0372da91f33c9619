//! Runs Gappa itself on the exported script (Debian's package `gappa`).

use std::io::Write;
use std::process::{Command, Stdio};

use crate::proofs_common::{axis, experiment};
use hpu_prove::ranges::{axis_bounds, gappa};
use hpu_study::Device;

/// Returns whether Gappa proves all of a script, and its output.
fn proves(script: &str) -> (bool, String) {
    let started = Command::new("gappa").stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
    let mut gappa = started.unwrap_or_else(|error| panic!("no gappa ({error}); on Debian: apt-get install gappa"));
    gappa.stdin.take().unwrap().write_all(script.as_bytes()).unwrap();
    let out = gappa.wait_with_output().unwrap();
    (out.status.success(), String::from_utf8_lossy(&out.stderr).into_owned())
}

#[test]
fn gappa_proves_the_script_and_refuses_a_tighter_one() {
    let rescaled = [("method.rescaled", "true"), ("method.reference_rate", "1300 Hz")];
    let scenes = [
        axis("hybrid-wall", &[]),
        axis("hybrid-wall", &rescaled),
        axis("conventional-wall-1khz", &[]),
        axis("wrap-product", &[]),
        axis("hybrid-wall", &[("method.stiffness_format", "\"(0,8,4)\""), ("wall.stiffness", "0.01 N.m/rad")]),
    ];
    for scene in scenes {
        let script = gappa(&scene, &axis_bounds(&scene).unwrap()).unwrap();
        let (proved, words) = proves(&script);
        assert!(proved, "{script}\n{words}");
        // The sum does not stay below the greatest torque less one, so Gappa must refuse that.
        let range = script.lines().find(|line| line.contains("torque in")).unwrap();
        let most = range.rsplit([',', ']']).nth(1).unwrap().trim();
        let tighter = range.replace(most, &format!("{}", most.parse::<f64>().unwrap() - 1.0));
        assert!(!proves(&script.replace(range, &tighter)).0, "{tighter}");
    }
}

#[test]
fn gappa_proves_the_kinematics_and_the_torques_of_the_phantom_and_no_smaller_error() {
    for words in ["\"fitted\"", "\"narrow\""] {
        let scene = experiment("phantom-drop", &[("method.words", words)]).phantom().unwrap();
        let script = scene.gappa().unwrap();
        let (proved, said) = proves(&script);
        assert!(proved, "{script}\n{said}");
        // Gappa must refuse a hundredth of the error of x.
        let goal = script.lines().find(|line| line.contains("x - X in")).unwrap();
        let error: f64 = goal.rsplit([',', ']']).nth(1).unwrap().trim().parse().unwrap();
        let tighter = goal.replace(&format!("{error}"), &format!("{}", error / 100.0));
        assert!(!proves(&script.replace(goal, &tighter)).0, "{tighter}");
    }
}
