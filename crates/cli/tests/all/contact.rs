//! Every command reports whether the wall was touched, and the scene's parameters with their sources.

use serde_json::{Value, json};

use crate::common::{code, json, run, scratch, stderr, stdout, text};

/// Half a second of a hand that ends in free air, before the wall at 1.5 rad.
const AIR: [&str; 4] = ["--set", "hand.path=[[0, 0], [\"150 ms\", 1.4]]", "--set", "run.duration=500 ms"];

fn hpu(verb: &str, more: &[&str]) -> String {
    let output = run(&[&[verb, "hybrid-wall"], &AIR[..], more].concat());
    assert!(code(&output) <= 1, "{}", stderr(&output));
    stdout(&output)
}

fn object(text: &str) -> Value {
    serde_json::from_str(text).expect("one JSON object")
}

#[test]
fn a_verdict_in_free_air_says_that_the_wall_was_not_reached() {
    let said = hpu("run", &["--expect"]);
    let line =
        |name: &str| said.lines().find(|line| line.starts_with(name)).unwrap_or_else(|| panic!("{name}: {said}"));
    assert!(line("outcome").contains("settled: rms"), "{said}");
    assert!(line("outcome").ends_with("; wall not reached in the judged window"), "{said}");
    // The run has 5001 rows at 10 kHz. The last 1500 of them begin at 0.3501 s.
    assert!(line("contact").contains("none in the judged window, 350.1 ms to 500 ms"), "{said}");
    assert!(line("expected   outcome").ends_with("met; wall not reached in the judged window"), "{said}");
    let found = object(&hpu("run", &["--json"]));
    assert_eq!((&found["contact_share"], &found["displayed_stiffness"]), (&json!(0.0), &Value::Null));
    assert_eq!(found["judged_window_s"], json!([0.3501, 0.5]));
    // The wheel that was thrown at the wall has left it again.
    assert!(stdout(&run(&["run", "thrown-hybrid"])).contains("; touched before: the outcome says nothing of the wall"));
    // A scene can ask for contact.
    let wanted = "expect={ contact_share = { value = 1, tolerance = 0 } }";
    let output = run(&[&["run", "hybrid-wall", "--set", wanted], &AIR[..]].concat());
    assert_eq!(code(&output), 1, "{}", stdout(&output));
    assert_eq!(code(&run(&["run", "hybrid-wall", "--set", wanted])), 0);
}

#[test]
fn limits_judges_no_window_without_contact_and_says_what_to_change() {
    let found = object(&hpu("limits", &["--json"]));
    assert!(found["words"].is_null(), "{found}");
    let why = found["words_reason"].as_str().expect("a reason");
    for part in ["wall not reached", "0.3501 s to 0.5 s", "hand.path", "wall.position (1.5 rad)", "run.duration"] {
        assert!(why.contains(part), "{part}: {why}");
    }
    // The linear loop is always in contact.
    assert!(found["linear"]["stable"][0]["to"]["at"].as_f64().is_some_and(|limit| limit > 1.0), "{found}");
}

#[test]
fn maps_fits_and_widths_say_where_the_wall_is_not_reached() {
    let axes = ["--x", "wall.stiffness=0.1..2 N.m/rad:3", "--y", "wall.damping=0..0.1 mN.m.s/rad:2", "--full"];
    let said = hpu("map", &axes);
    assert!(said.contains("- wall_not_reached      6  no verdict of the wall  $ hpu run"), "{said}");
    assert!(!said.contains("settled") && said.contains("  |---|\n"), "{said}");
    // 0.1 N.m/rad is 2.37 words; 1.05 is 24.9 and 2 is 47.4, within 2 %.
    assert!(said.contains("in 2 cells the stiffness misses what is asked for by -15.648 %"), "{said}");
    assert!(said.contains("method.stiffness_format = \"(0,12,3)\" holds it"), "{said}");
    let found = object(&hpu("map", &[&axes[..], &["--json"]].concat()));
    let outcomes = &found["methods"][0]["outcomes"];
    assert_eq!((&outcomes["wall_not_reached"], &outcomes["settled"]), (&json!(6), &json!(0)));
    assert_eq!(found["cells"][0]["contact_share"], 0.0);
    assert!(hpu("fit", &[]).contains("wall not reached"));
    assert_eq!(object(&hpu("fit", &["--json"]))["contact_share"], 0.0);
    assert!(hpu("widths", &["--no-trials"]).contains("settled (wall not reached)"));
    assert_eq!(object(&hpu("widths", &["--no-trials", "--json"]))["contact_shares"], json!([0.0]));
}

#[test]
fn a_hand_that_fell_through_a_wrapping_wall_is_not_settled_without_a_word() {
    // The hand rests 0.449 rad behind the wall. 293 counts times 36 are 2 times 4096 plus 2356: 0.152 N.m of the 0.67
    // N.m asked for.
    let said = stdout(&run(&["run", "wrap-product"]));
    assert!(said.contains("; through the wall, whose product has wrapped 2 times"), "{said}");
    let found = json(&run(&["run", "wrap-product", "--json"]));
    assert_eq!((&found["contact_share"], &found["product_wraps"]), (&json!(1.0), &json!(2)));
    let ratio = found["displayed_ratio"].as_f64().expect("a ratio");
    assert!((0.15..0.30).contains(&ratio), "{ratio}");
    let held = json(&run(&["run", "wrap-saturated", "--json"]));
    assert_eq!((&held["contact_share"], &held["product_wraps"]), (&json!(1.0), &Value::Null));
}

#[test]
fn a_wrapped_position_counter_is_not_a_wall_that_was_not_reached() {
    // The hand is at 2.5 rad, 999.77 mrad or 652 counts past the wall at 978 counts. A counter of 10 bits holds 512
    // counts to either side of the wall.
    let hand = ["--set", "hand.path=[[0, 0], [0.1, 2.5]]", "--set", "hand.stiffness=3", "--set", "wall.wraps=true"];
    let with = |bits: &str, more: &[&str]| {
        let bits = format!("method.position_bits={bits}");
        run(&[&["run", "hybrid-wall", "--set", &bits], &hand[..], more].concat())
    };
    let said = stdout(&with("10", &[]));
    let wanted =
        "; the datapath saw no contact though the device was 999.77 mrad past the wall: the position counter wrapped";
    let outcome = said.lines().find(|line| line.starts_with("outcome")).expect("an outcome");
    assert!(outcome.ends_with(wanted), "{outcome}");
    let found = json(&with("10", &["--json"]));
    assert_eq!((&found["contact_share"], &found["unseen_contact"]["position_wrapped"]), (&json!(0.0), &json!(true)));
    let depth = found["unseen_contact"]["depth"].as_f64().expect("a depth");
    assert!((depth - 1.0).abs() < 2e-3, "{depth}");
    // A wider counter sees the contact; in free air there is none to see.
    assert_eq!(json(&with("12", &["--json"]))["unseen_contact"], Value::Null);
    assert_eq!(object(&hpu("run", &["--json"]))["unseen_contact"], Value::Null);
    let out = scratch("unseen").join("out");
    assert_eq!(code(&with("10", &["-o", text(&out)])), 0);
    for name in ["position.svg", "torque.svg"] {
        let svg = std::fs::read_to_string(out.join(name)).expect("a picture");
        assert!(svg.contains("; 1.00 rad past the wall, counter wrapped"), "{name}");
    }
}

#[test]
fn a_map_says_in_how_many_cells_a_wrapped_counter_hid_the_contact() {
    // The hand of the test above, and one that stays before the wall at 978 counts.
    let axes = ["--x", "hand.stiffness=3..4 N.m/rad:2", "--y", "wall.position=1.5..2.6 rad:2", "--full"];
    let set = ["method.position_bits=10", "wall.wraps=true", "hand.path=[[0, 0], [0.1, 2.5]]", "run.duration=0.4s"];
    let set = set.map(|set| ["--set", set]).concat();
    let out = scratch("map_of_hidden_contacts").join("map");
    let output = run(&[&["map", "hybrid-wall"][..], &axes, &set, &["-o", text(&out)]].concat());
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let said = stdout(&output);
    assert!(said.contains("warning    in 4 cells the position counter wrapped under the device"), "{said}");
    assert!(said.contains("warning    in 2 cells of wall_not_reached the device was past its wall"), "{said}");
    let table = std::fs::read_to_string(out.join("map.csv")).expect("the table");
    let mut rows = table.lines().filter(|line| !line.starts_with('#')).map(|line| line.split(',').collect::<Vec<_>>());
    let heads = rows.next().expect("heads");
    let column = |name: &str| heads.iter().position(|head| *head == name).expect("a column");
    for row in rows {
        let past = row[column("y")] == "1.5";
        assert_eq!(
            (row[column("contact_share")], row[column("contact_unseen")]),
            ("0e0", if past { "1e0" } else { "0e0" })
        );
    }
    let svg = std::fs::read_to_string(out.join("map.svg")).expect("a picture");
    assert!(svg.contains("; hatched: past the wall, contact not seen"));
}

#[test]
fn a_map_says_in_how_many_settled_cells_the_hand_fell_through_the_wall() {
    // The same hand at walls of 0.3 and 1.5 N.m/rad. 0.24 rad behind the first wall is 0.07 N.m, which the word holds.
    let axes = ["--x", "wall.stiffness=0.3..1.5 N.m/rad:2", "--y", "wall.position=1.5..1.501 rad:2", "--full"];
    let each = |index: u64| {
        let set = if index.is_multiple_of(2) { "wall.stiffness=0.3 N.m/rad" } else { "wall.stiffness=1.5 N.m/rad" };
        let wall = if index < 2 { "wall.position=1.5 rad" } else { "wall.position=1.501 rad" };
        json(&run(&["run", "wrap-product", "--json", "--set", set, "--set", wall]))["product_wraps"].clone()
    };
    let expected: Vec<Value> = (0..4).map(each).collect();
    let wrapped = expected.iter().filter(|wraps| !wraps.is_null()).count();
    assert!(wrapped > 0 && wrapped < 4, "{expected:?}");
    let found = json(&run(&[&["map", "wrap-product", "--json"], &axes[..]].concat()));
    let cells: Vec<Value> =
        found["cells"].as_array().expect("cells").iter().map(|cell| cell["product_wraps"].clone()).collect();
    assert_eq!(cells, expected);
    assert_eq!(found["methods"][0]["product_wrapped"], wrapped);
    let said = stdout(&run(&[&["map", "wrap-product"], &axes[..]].concat()));
    let wanted =
        format!("warning    in {wrapped} settled cells the hand is through the wall: the spring's product has wrapped");
    assert!(said.contains(&wanted), "{said}");
}

#[test]
fn a_summary_lists_every_parameter_with_its_unit_and_who_said_it() {
    let set = ["--set", "wall.stiffness=0.1", "--edges", "1000"];
    let found = json(&run(&[&["run", "hybrid-wall", "--json"], &set[..]].concat()));
    let parameters = found["parameters"].as_array().expect("parameters");
    let of = |key: &str| {
        let parameter = parameters.iter().find(|parameter| parameter["key"] == key);
        parameter.unwrap_or_else(|| panic!("{key}: {parameters:?}"))
    };
    let said = |key: &str, value: Value, unit: &str, source: &str| {
        let parameter = of(key);
        assert_eq!((&parameter["value"], &parameter["unit"]), (&value, &json!(unit)), "{key}");
        assert_eq!(parameter["source"], source, "{key}");
    };
    said("wall.stiffness", json!(0.1), "N.m/rad", "--set");
    said("run.duration", json!(20e-6), "s", "--edges");
    said("device.coulomb_friction", json!(0.0), "N.m", "default");
    said("device.wheel_ratio", json!(7.0), "", "scene");
    said("device.torque_constant", json!(25.9e-3), "N.m/A", "motor vasudevan_2007");
    said("method.pwm.bits", json!(12), "bit", "default");
    said("hand.path", json!("[[0, 0], [0.15, 1.4], [0.25, 1.9], [0.4, 1.2], [0.5, 1.8]]"), "s, rad", "scene");
    let missed = &found["realised"]["stiffness_missed"];
    assert_eq!(missed["format"], "(0,12,3)", "{missed}");
    let text = stdout(&run(&[&["run", "hybrid-wall"], &set[..]].concat()));
    let line =
        |key: &str| text.lines().find(|line| line.starts_with("parameter") && line.contains(key)).expect("a line");
    assert!(line("wall.stiffness").contains("0.1 N.m/rad") && line("wall.stiffness").ends_with("--set"), "{text}");
    assert!(text.contains(
        "warning    stiffness misses what is asked for by -15.648 %; method.stiffness_format = \"(0,12,3)\""
    ));
    let limits =
        stdout(&run(&["limits", "hybrid-wall", "--set", "wall.stiffness=0.1", "--range", "0.1..0.2", "--phases", "1"]));
    assert!(limits.contains("wall.stiffness misses what is asked for by -15.648 %"), "{limits}");
}

#[test]
fn limits_warn_of_a_wall_that_the_hand_falls_through() {
    let output = run(&["limits", "wrap-product", "--range", "3..5", "--phases", "1"]);
    let text = stdout(&output);
    assert!(text.contains("settle although the product has wrapped"), "{text}");
    // A product that saturates never wraps.
    let text = stdout(&run(&["limits", "wrap-saturated", "--range", "3..5", "--phases", "1"]));
    assert!(!text.contains("wrapped"), "{text}");
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn widths_and_fit_flag_a_stiffness_that_its_word_misses() {
    // 0.06 N.m/rad is 1.42 words of 42.18 mN.m/rad: one word is 30 % less.
    let soft = ["--set", "wall.stiffness=0.06"];
    for verb in ["widths", "fit"] {
        let text = stdout(&run(&[&[verb, "hybrid-wall"], &soft[..]].concat()));
        let said =
            text.lines().find(|line| line.contains("stiffness misses what is asked for by -29.7")).expect("told");
        assert!(said.contains("method.stiffness_format"), "{said}");
        let json = stdout(&run(&[&[verb, "hybrid-wall", "--json"], &soft[..]].concat()));
        assert!(json.contains("stiffness_missed") && (json.contains("29.7") || json.contains("-0.297")), "{verb}");
        assert!(!stdout(&run(&[verb, "hybrid-wall"])).contains("misses"), "{verb}");
    }
}

/// A hand that pulls the shaft from the wall at 0.7 rad to 2 rad behind the start. Ten bits hold it down to 456 - 512 =
/// -56 counts, or -85.9 mrad.
const AWAY: [&str; 6] = [
    "--set",
    "wall.position=0.7 rad",
    "--set",
    "method.position_bits=10",
    "--set",
    "hand.path=[[0, 0.8], [\"100 ms\", 0.8], [\"300 ms\", -2]]",
];

#[test]
fn a_counter_that_wraps_under_its_device_is_told_with_its_share_and_the_bits_that_hold_the_motion() {
    let with = |more: &[&str]| run(&[&["run", "hybrid-wall"], &AWAY[..], more].concat());
    let said = stdout(&with(&[]));
    let line =
        |name: &str| said.lines().find(|line| line.starts_with(name)).unwrap_or_else(|| panic!("{name}: {said}"));
    assert!(line("outcome").contains("position lost: ") && line("outcome").contains("counter had wrapped"), "{said}");
    assert!(line("position").contains("wraps: 10 bits hold -85.9"), "{said}");
    let found = json(&with(&["--json"]));
    let lost = &found["position_wrapped"];
    let number = |value: &Value| value.as_f64().expect("a number");
    let position = found["signals"].as_array().expect("signals").iter().find(|net| net["name"] == "position");
    assert_eq!(position.expect("a net")["overflowed"], lost["edges"]);
    assert!(number(&lost["share"]) > 0.5 && number(&lost["first_s"]) > 0.1, "{lost}");
    // With the bits that are told, nothing is lost.
    let bits = lost["holding_bits"].as_u64().expect("bits");
    assert!(line("position").ends_with(&format!("; method.position_bits = {bits} holds all of it")), "{said}");
    let wide = json(&with(&["--set", &format!("method.position_bits={bits}"), "--json"]));
    assert_eq!(wide["position_wrapped"], Value::Null);
    let out = scratch("wrapped_counter").join("out");
    assert_eq!(code(&with(&["-o", text(&out)])), 0);
    let bits = std::fs::read_to_string(out.join("bits.svg")).expect("a picture");
    assert!(bits.contains("overflow of position"), "the title");
}

#[test]
fn a_map_and_limits_count_the_runs_whose_counter_wrapped() {
    // The hand presses 0.8 rad behind a wall at 0.7 rad; on its way it was far before it, where ten bits wrap.
    let hand = "hand.path=[[0, 0], [\"60 ms\", -2], [\"200 ms\", 0.8]]";
    let set = ["wall.position=0.7 rad", "method.position_bits=10", hand, "run.duration=500 ms"];
    let set = set.map(|set| ["--set", set]).concat();
    let found =
        json(&run(&[&["limits", "hybrid-wall", "--range", "0.5..0.6", "--phases", "2", "--json"], &set[..]].concat()));
    let words = &found["words"];
    assert!(words["runs"].as_u64() > Some(1) && words["runs_with_wrapped_position"] == words["runs"], "{words}");
    let axes = ["--x", "wall.stiffness=0.5..0.6 N.m/rad:2", "--y", "method.position_bits=10..12:2", "--full"];
    let found = json(&run(&[&["map", "hybrid-wall", "--json"], &axes[..], &set].concat()));
    assert_eq!(found["methods"][0]["position_wrapped"], 2, "the cells of ten bits, not those of twelve");
    for cell in found["cells"].as_array().expect("cells") {
        let lost = cell["position_lost_share"].as_f64().expect("a share");
        assert_eq!(lost > 0.0, cell["iy"] == 0, "{cell}");
    }
}

#[test]
fn cells_and_limits_of_a_wall_out_of_range_give_their_reason() {
    let axes = ["--x", "wall.stiffness=0.5..0.6 N.m/rad:2", "--y", "method.position_bits=10..12:2", "--full"];
    let found = json(&run(&[&["map", "hybrid-wall", "--json"], &axes[..]].concat()));
    for cell in found["cells"].as_array().expect("cells") {
        let reason = cell["reason"].as_str().unwrap_or_default();
        assert_eq!(reason.contains("1.5 rad does not fit 10 bits"), cell["iy"] == 0, "{cell}");
    }
    let narrow = ["--set", "method.position_bits=10"];
    for verb in ["run", "limits", "fit", "widths"] {
        let output = run(&[&[verb, "hybrid-wall"], &narrow[..]].concat());
        assert!(
            code(&output) == 4 && stderr(&output).contains("wall.position: 1.5 rad does not fit 10 bits"),
            "{verb}"
        );
    }
}

#[test]
fn contact_is_told_as_the_logic_counts_it_and_as_the_device_is() {
    let said = stdout(&run(&["run", "conventional-wall-1khz"]));
    let line = said.lines().find(|line| line.starts_with("contact")).expect("contact");
    assert!(
        line.contains("37.51 % of the judged window")
            && line.contains(" as the logic counts it; the device itself 46."),
        "{line}"
    );
    let found = json(&run(&["run", "conventional-wall-1khz", "--json"]));
    let tenths = |key: &str| (1000.0 * found[key].as_f64().expect("a share")).round() / 10.0;
    assert_eq!((tenths("contact_share"), tenths("device_contact_share")), (37.5, 46.9));
}
