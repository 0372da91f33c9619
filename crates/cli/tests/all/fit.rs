//! `hpu fit`, and scenes whose model is left open. No test reads a wall time.

use crate::common::{assert_refused, code, json, run, stderr, stdout};

#[test]
fn a_fit_says_what_is_left_out_and_how_to_run_it() {
    let output = run(&["fit", "prescribed-sweep", "--json"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let found = json(&output);
    assert_eq!(found["scene"], "prescribed-sweep");
    assert_eq!(found["within"], 0.01);
    // A hand that imposes the motion leaves nothing for the bridge to do.
    assert_eq!(found["set"]["model.bridge"], "averaged");
    assert!(found["left_out"].as_array().is_some_and(|all| !all.is_empty()));
    assert!(found["command"].as_str().is_some_and(|text| text.contains("--set model.bridge=averaged")));
    let errors = found["errors"].as_object().expect("an object");
    assert!(errors.values().all(|error| error.as_f64().is_some_and(|error| error <= 0.005)), "{errors:?}");
}

#[test]
fn a_scene_whose_model_is_open_is_run_by_the_one_that_is_chosen() {
    let output = run(&["run", "bounded-wall-1khz", "--set", "model=auto", "--json"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert_eq!(json(&output)["fitted"]["set"]["model.bridge"], "averaged");
    let said = run(&["run", "bounded-wall-1khz", "--set", "model=auto"]);
    assert!(stdout(&said).contains("left out   the bridge's switching"), "{}", stdout(&said));
    // A model that is given is not chosen.
    let given = run(&["run", "bounded-wall-1khz", "--set", "model=auto", "--set", "model.bridge=averaged", "--json"]);
    assert!(json(&given)["fitted"].is_null());
}

#[test]
fn bad_fits_are_refused() {
    let refused = |args: &[&str], code, words: &str| assert_refused(&run(args), code, &[words]);
    refused(&["fit", "hybrid-wall", "--within", "2"], 2, "write a share between 0 and 1, as in 1% or 0.01");
    refused(&["fit", "hybrid-wall", "--within", "0%"], 2, "write a share between 0 and 1");
    refused(&["fit", "replay-capture"], 4, "a recording has no device");
    refused(&["fit", "nowhere"], 4, "no scene `nowhere`");
    refused(&["run", "hybrid-wall", "--set", "model=fast"], 4, "or model = \"auto\" for what hpu fit chooses");
    let axes = ["--x", "wall.stiffness=1..2:2", "--y", "wall.damping=0..1e-4:2"];
    let map = [&["map", "hybrid-wall", "--set", "model=auto"][..], &axes].concat();
    refused(&map, 4, "model = \"auto\" is chosen for one scene");
}
