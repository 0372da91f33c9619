//! `hpu diff`: which values of two results differ.

use std::fs;

use serde_json::json;

use crate::common::{assert_refused, code, json, run, scratch, stderr, stdout, text};

const FIRST: &str = r#"{
    "scene": "wall", "edges": 1000, "wall_s": 0.5, "complete": true, "seed": null,
    "signals": [{ "name": "spring", "max": 100.0 }, { "name": "drag", "max": -2.0 }],
    "window": [1.5, 2.0]
}"#;

/// The same result with other wall times, its rows in another order, a maximum by one per cent lower, a flag, and
/// another window.
const SECOND: &str = r#"{
    "scene": "wall", "edges": 1000, "wall_s": 7.5, "complete": false, "extra": 1,
    "signals": [{ "name": "drag", "max": -2.0 }, { "name": "spring", "max": 99.0 }],
    "window": [1.5, 2.5]
}"#;

fn files(test: &str) -> [String; 2] {
    let dir = scratch(test);
    [("a.json", FIRST), ("b.json", SECOND)].map(|(name, content)| {
        fs::write(dir.join(name), content).expect("a file");
        text(&dir.join(name)).to_string()
    })
}

#[test]
fn rows_belong_together_by_their_names_and_wall_times_do_not_count() {
    let [a, b] = files("diff-rows");
    let output = run(&["diff", &a, &b, "--json"]);
    assert_eq!(code(&output), 1, "{}", stderr(&output));
    let found = json(&output);
    // scene, edges, complete, seed and extra, two maxima with their names, and the window as one value.
    assert_eq!(found["compared"], 10);
    assert_eq!(found["equal"], false);
    let expected = json!([
        { "key": "complete", "a": true, "b": false, "relative": null },
        { "key": "extra", "b": 1, "relative": null },
        { "key": "seed", "a": null, "relative": null },
        { "key": "signals[spring].max", "a": 100.0, "b": 99.0, "relative": 0.01 },
        { "key": "window", "a": [1.5, 2.0], "b": [1.5, 2.5], "relative": null },
    ]);
    assert_eq!(found["differences"], expected);
}

#[test]
fn the_tolerance_is_a_share_of_the_greater_number() {
    let [a, b] = files("diff-tolerance");
    for (tolerance, count) in [("0.9%", 5), ("1%", 4)] {
        let output = run(&["diff", &a, &b, "--tolerance", tolerance]);
        assert_eq!(code(&output), 1, "{}", stderr(&output));
        let said = stdout(&output).split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(said.contains(&format!("{count} of 10 values differ by more than")), "{said}");
        assert_eq!(said.contains("signals[spring].max 100.0 99.0 1.00 %"), count == 5, "{said}");
    }
    assert_refused(&run(&["diff", &a, &b, "--tolerance", "much"]), 2, &["write a share between 0 and 1"]);
}

#[test]
fn a_result_equals_itself() {
    let [a, _] = files("diff-same");
    let output = run(&["diff", &a, &a]);
    assert_eq!((code(&output), stderr(&output)), (0, String::new()));
    assert!(stdout(&output).ends_with("none of 9 values differs\n"), "{}", stdout(&output));
}

#[test]
fn a_scene_is_run_and_equals_its_own_summary() {
    let dir = scratch("diff-scene");
    let summary = dir.join("summary.json");
    let printed = run(&["run", "free-motion", "--json"]);
    fs::write(&summary, &printed.stdout).expect("a file");
    let same = run(&["diff", "free-motion", text(&summary)]);
    assert_eq!(code(&same), 0, "{}{}", stdout(&same), stderr(&same));
    let other = run(&["diff", "free-motion", "rail-drop", "--json"]);
    assert_eq!(code(&other), 1, "{}", stderr(&other));
    let found = json(&other);
    let keys: Vec<_> = found["differences"].as_array().expect("a list").iter().map(|row| &row["key"]).collect();
    assert!(keys.contains(&&json!("scene")) && keys.contains(&&json!("energy.hand_j")), "{keys:?}");
}

#[test]
fn what_is_no_result_is_refused() {
    let dir = scratch("diff-bad");
    for (name, content, words) in [("list.json", "[1]", "no JSON object"), ("cut.json", "{\"a\": 1", "line 1 column 7")]
    {
        fs::write(dir.join(name), content).expect("a file");
        assert_refused(&run(&["diff", text(&dir.join(name)), "hybrid-wall"]), 4, &[name, words]);
    }
}
