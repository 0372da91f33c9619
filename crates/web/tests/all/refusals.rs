//! Refusals are those of the command, each with the key that caused it.

use hpu_cosim::SceneFile;
use serde_json::{Value, json};

use crate::{ask, refused};

#[test]
fn a_refused_override_has_the_commands_message_and_its_key() {
    let bad = [
        ("wall.stiffness", "-1"),
        ("wall.stiffness", "2 apples"),
        ("method.pwm.bits", "99"),
        ("method.kind", "magic"),
        ("clock.frequency", "1e30"),
        ("no.such", "1"),
    ];
    let scene = SceneFile::find("hybrid-wall").expect("a shipped scene");
    for (key, value) in bad {
        let errors = refused(&json!({ "do": "run", "scene": "hybrid-wall", "set": [format!("{key}={value}")] })).json();
        let first = &errors["errors"][0];
        let command = scene.parse(&[(key.to_string(), value.to_string())]).expect_err("a refusal");
        assert_eq!(first["message"], command.to_string(), "{key}");
        assert!(key.starts_with(first["key"].as_str().expect("a key")), "{key}: {first}");
    }
}

#[test]
fn all_refused_overrides_are_told_at_once() {
    let set = ["wall.stiffness=-1", "encoder.lines=0", "bridge.supply=-3 V"];
    let errors = refused(&json!({ "do": "run", "scene": "hybrid-wall", "set": set })).json();
    let mut keys: Vec<_> =
        errors["errors"].as_array().expect("errors").iter().map(|error| error["key"].clone()).collect();
    keys.sort_by_key(ToString::to_string);
    assert_eq!(keys, ["bridge.supply", "encoder.lines", "wall.stiffness"]);
}

#[test]
fn scenes_that_a_page_cannot_run_are_refused_at_their_key() {
    let key = |set: &str| {
        refused(&json!({ "do": "run", "scene": "hybrid-wall", "set": [set] })).json()["errors"][0]["key"].clone()
    };
    assert_eq!(key("model=auto"), "model");
    assert_eq!(key("model.datapath=linear"), "model.datapath");
    let design = include_str!("../../../../testbench/dut/knee.toml");
    let files: Value =
        ["QuadTrack", "DutyGen", "KneeCtl"].iter().map(|name| (format!("knee/{name}.v"), "text")).collect();
    let scene = json!({ "name": "knee.toml", "text": design, "files": files });
    let errors = refused(&json!({ "do": "run", "scene": scene })).json();
    assert!(errors["errors"][0]["message"].as_str().expect("a message").contains("simulator"), "{errors}");
}

#[test]
fn nonsense_is_refused_and_ends_nothing() {
    const AXIS: &str = "run.duration=1..2:2";
    let nonsense = [
        json!(17),
        json!({ "do": "dance" }),
        json!({ "do": "run" }),
        json!({ "do": "run", "scene": "no-such-scene" }),
        json!({ "do": "run", "scene": "../hybrid-wall.toml" }),
        json!({ "do": "run", "scene": "hybrid-wall", "set": ["wall.stiffness"] }),
        json!({ "do": "wave", "scene": "hybrid-wall", "format": "mp3" }),
        json!({ "do": "look", "scene": "hybrid-wall", "from_s": 0.0 }),
        json!({ "do": "plan", "columns": 3, "rows": 3, "classes": ["settled"] }),
        json!({ "do": "plan", "columns": 0, "rows": 0, "classes": [] }),
        json!({ "do": "plan", "columns": 1_u64 << 32, "rows": 1_u64 << 32, "classes": [] }),
        json!({ "do": "plan", "columns": u64::MAX, "rows": 2, "classes": ["settled", null] }),
        json!({ "do": "cell", "scene": "hybrid-wall", "x": "wall.stiffness=1..2:2", "y": AXIS, "cell": 4 }),
        json!({ "do": "map", "scene": "hybrid-wall", "x": "wall.stiffness=2..1", "y": "wall.damping=0..1" }),
    ];
    for request in nonsense {
        let errors = refused(&request).json();
        assert!(!errors["errors"][0]["message"].as_str().expect("a message").is_empty(), "{request}");
    }
    assert!(hpu_web::answer("{").is_err());
    ask(&json!({ "do": "keys", "scene": "hybrid-wall" }));
}
