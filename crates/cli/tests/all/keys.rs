//! Tests `hpu keys`: the keys as text, JSON and a schema that every shipped scene satisfies; the nearest names for
//! misspelt ones; all errors at once.

use std::fs;

use hpu_cosim::scene::keys::rows;
use hpu_cosim::scene::shipped;
use serde_json::{Map, Value, json};
use toml_edit::{DocumentMut, Item};

use crate::common::{ROOT, assert_refused, code, json as parsed, run, scratch, stderr, stdout, text};

#[test]
fn every_key_is_listed_with_its_unit_default_range_and_meaning() {
    let all = stdout(&run(&["keys"]));
    let object = parsed(&run(&["keys", "--json"]));
    let listed = object["keys"].as_array().expect("a list");
    assert_eq!(listed.len(), rows().count());
    assert!(listed.len() > 180, "{}", listed.len());
    for (row, object) in rows().zip(listed) {
        assert!(all.contains(&format!("\n  {} ", row.key)) && all.contains(row.meaning), "{}.{}", row.section, row.key);
        assert_eq!((&object["section"], &object["key"]), (&json!(row.section), &json!(row.key)));
        assert_eq!(object["required"], json!(row.default() == "required"), "{}.{}", row.section, row.key);
    }
    assert!(all.starts_with("Every scene\n  about "), "the sections stand before their keys: {all}");
    let pwm = stdout(&run(&["keys", "method.pwm"]));
    let keys: Vec<_> =
        pwm.lines().filter_map(|line| line.strip_prefix("  ").filter(|line| !line.starts_with(' '))).collect();
    let first = |line: &&str| line.split_whitespace().map(str::to_string).collect::<Vec<_>>();
    let told: Vec<_> = keys.iter().map(first).collect();
    assert_eq!(told[0], ["bits", "bit", "12", "2", "to", "24"]);
    assert_eq!(told[3], ["off", "choice", "brake", "brake,", "float"]);
    assert_eq!(told[4][..3], ["dead_time", "s", "0"]);
    assert_eq!(told.len(), 5);
}

#[test]
fn an_unknown_name_is_told_with_the_nearest() {
    assert_refused(&run(&["keys", "metod"]), 2, &["no key has `metod`", "did you mean method?"]);
    assert_refused(&run(&["run", "hybird-wall"]), 4, &["no scene `hybird-wall`", "did you mean hybrid-wall?"]);
    assert_refused(&run(&["block", "truncating_multipler"]), 2, &["did you mean truncating_multiplier?"]);
    let set = |pair: &str| run(&["run", "hybrid-wall", "--set", pair]);
    assert_refused(&set("wall.stifness=1"), 4, &["wall.stifness: unknown key", "did you mean stiffness?"]);
    assert_refused(&set("method.kind=conventionnal"), 4, &["is none of \"hybrid\"", "did you mean conventional?"]);
    let far = run(&["run", "no-such-scene"]);
    assert!(!stderr(&far).contains("did you mean"), "{}", stderr(&far));
}

#[test]
fn a_word_finds_keys_by_their_names_and_meanings() {
    let word = "friction";
    let found = parsed(&run(&["keys", "Friction", "--json"]));
    let names =
        |row: &Value| format!("{}.{}", row["section"].as_str().expect("a text"), row["key"].as_str().expect("a text"));
    let found: Vec<String> = found["keys"].as_array().expect("a list").iter().map(names).collect();
    let has = |row: &hpu_cosim::scene::keys::KeyRow| {
        [row.section, row.key, row.meaning].iter().any(|text| text.to_lowercase().contains(word))
    };
    let expected: Vec<String> = rows().filter(has).map(|row| format!("{}.{}", row.section, row.key)).collect();
    assert!(expected.contains(&"device.coulomb_friction".to_string()), "{expected:?}");
    assert_eq!(found, expected);
    assert_refused(&run(&["keys", "stifness"]), 2, &["no key has `stifness`", "did you mean stiffness?"]);
}

#[test]
fn a_word_finds_blocks_by_their_names_ports_and_meanings() {
    let listed = |word: &[&str]| -> Vec<String> {
        let all = stdout(&run(&[&["block"], word].concat()));
        all.lines().map(|line| line.split(' ').next().expect("a name").to_string()).collect()
    };
    let velocities = listed(&["velocity"]);
    assert!(velocities.contains(&"velocity_register".to_string()), "{velocities:?}");
    assert!(velocities.len() > 2 && velocities.len() < listed(&[]).len() / 2, "{velocities:?}");
    // A word of the meaning alone: the block is not named by it.
    assert_eq!(listed(&["never pulls"]), ["unilateral"]);
    assert_refused(&run(&["block", "velocity", "--variant", "8_bit"]), 2, &["no block `velocity`"]);
}

#[test]
fn a_scene_in_the_place_of_a_block_is_told_its_option() {
    for verb in ["check", "cost", "block"] {
        assert_refused(&run(&[verb, "hybrid-wall"]), 2, &["no block `hybrid-wall`", "--scene hybrid-wall"]);
    }
}

#[test]
fn all_errors_of_a_scene_are_told_at_once() {
    let file = scratch("errors").join("bad.toml");
    let scene = fs::read_to_string(format!("{ROOT}/testbench/scenes/hybrid-wall.toml")).expect("a shipped scene");
    let bad =
        scene.replace("position = \"1.5 rad\"", "position = true").replace("frequency = \"50 MHz\"", "frequency = 0");
    fs::write(&file, bad).expect("a scene");
    let output = run(&["run", text(&file)]);
    assert_refused(&output, 4, &["clock.frequency: `0` must be above zero", "wall.position: `true` is not an angle"]);
    assert!(stderr(&output).ends_with("\n2 errors\n"), "{}", stderr(&output));
    assert_eq!(stderr(&output).lines().count(), 3, "{}", stderr(&output));
}

/// Returns the refusals of a value by a schema. It knows the keywords of JSON Schema that our schema uses; any other
/// keyword fails the test.
fn refused(schema: &Value, value: &Value, at: &str) -> Vec<String> {
    let fails = |schema: &Value| !refused(schema, value, at).is_empty();
    let words = schema.as_object().expect("a schema is an object");
    let mut all = Vec::new();
    for (word, rule) in words {
        let list = || rule.as_array().expect("a list");
        let holds = match word.as_str() {
            "$schema" | "title" | "description" | "default" => true,
            "type" => match rule {
                Value::String(of) => is_of(of, value),
                _ => list().iter().any(|of| is_of(of.as_str().expect("a type"), value)),
            },
            "enum" => list().iter().any(|option| same(option, value)),
            "const" => same(rule, value),
            "minimum" => value.as_f64().is_none_or(|number| number >= rule.as_f64().expect("a number")),
            "maximum" => value.as_f64().is_none_or(|number| number <= rule.as_f64().expect("a number")),
            "required" => value
                .as_object()
                .is_none_or(|object| list().iter().all(|key| object.contains_key(key.as_str().expect("a key")))),
            "anyOf" => list().iter().any(|schema| !fails(schema)),
            "not" => fails(rule),
            "allOf" => {
                all.extend(list().iter().flat_map(|schema| refused(schema, value, at)));
                true
            }
            "if" => {
                let then = schema.get(if fails(rule) { "else" } else { "then" });
                all.extend(then.into_iter().flat_map(|schema| refused(schema, value, at)));
                true
            }
            "then" | "else" => schema.get("if").is_some(),
            "items" => {
                let items = value.as_array().into_iter().flatten();
                all.extend(items.flat_map(|item| refused(rule, item, at)));
                true
            }
            "properties" => {
                let rules = rule.as_object().expect("properties");
                for (key, schema) in rules {
                    all.extend(
                        value.get(key).into_iter().flat_map(|value| refused(schema, value, &format!("{at}.{key}"))),
                    );
                }
                true
            }
            "additionalProperties" => {
                let known = schema["properties"].as_object().expect("properties");
                let object = value.as_object().into_iter().flatten();
                for (key, value) in object.filter(|(key, _)| !known.contains_key(*key)) {
                    match rule {
                        Value::Bool(false) => all.push(format!("{at}.{key}: unknown")),
                        _ => all.extend(refused(rule, value, &format!("{at}.{key}"))),
                    }
                }
                true
            }
            other => panic!("{other} at {at} is no word that this test knows"),
        };
        if !holds {
            all.push(format!("{at}: {word} {rule}"));
        }
    }
    all
}

fn is_of(of: &str, value: &Value) -> bool {
    match of {
        "object" => value.is_object(),
        "array" => value.is_array(),
        "string" => value.is_string(),
        "boolean" => value.is_boolean(),
        "number" => value.is_number(),
        "integer" => value.is_i64() || value.is_u64(),
        other => panic!("{other} is no type"),
    }
}

/// Returns whether two values are equal; numbers are compared whatever their notation.
fn same(one: &Value, other: &Value) -> bool {
    match (one.as_f64(), other.as_f64()) {
        (Some(one), Some(other)) => one == other,
        _ => one == other,
    }
}

/// Converts TOML into JSON.
fn as_json(item: &Item) -> Value {
    if let Some(table) = item.as_table_like() {
        return table.iter().map(|(key, item)| (key.to_string(), as_json(item))).collect::<Map<_, _>>().into();
    }
    if let Some(array) = item.as_array() {
        return array.iter().map(|value| as_json(&Item::Value(value.clone()))).collect();
    }
    let number = item.as_integer().map(Value::from).or_else(|| item.as_float().map(Value::from));
    let text = || item.as_str().map(Value::from).or_else(|| item.as_bool().map(Value::from));
    number.or_else(text).expect("a value of JSON")
}

fn scene(text: &str) -> Value {
    as_json(text.parse::<DocumentMut>().expect("TOML").as_item())
}

fn schema() -> Value {
    let output = run(&["keys", "--schema"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    parsed(&output)
}

/// Returns every shipped scene, and the scenes of designs of the user's own.
fn scenes() -> Vec<(String, Value)> {
    let mut all: Vec<_> = shipped().iter().map(|shipped| (shipped.name.to_string(), scene(shipped.text))).collect();
    for name in ["knee", "paddle", "rim"] {
        let text = fs::read_to_string(format!("{ROOT}/testbench/dut/{name}.toml")).expect("a scene");
        all.push((name.to_string(), scene(&text)));
    }
    all
}

#[test]
fn every_shipped_scene_satisfies_the_schema() {
    let schema = schema();
    assert_eq!(schema["$schema"], "https://json-schema.org/draft/2020-12/schema");
    for (name, scene) in scenes() {
        assert_eq!(refused(&schema, &scene, ""), Vec::<String>::new(), "{name}");
    }
    let mut auto = scene(shipped()[0].text);
    auto["model"] = json!("auto");
    assert_eq!(refused(&schema, &auto, ""), Vec::<String>::new());
}

#[test]
fn the_schema_refuses_unknown_keys_in_every_section_of_every_scene() {
    let schema = schema();
    for (name, scene) in scenes() {
        let sections = scene.as_object().expect("a scene").iter().filter(|(_, value)| value.is_object());
        // The sections of a design have free names below them.
        for (section, _) in sections {
            let mut spoilt = scene.clone();
            spoilt[section]["zzz"] = json!(1);
            let said = refused(&schema, &spoilt, "");
            assert!(said.iter().any(|said| said == &format!(".{section}.zzz: unknown")), "{name}: {section}: {said:?}");
        }
        let mut spoilt = scene.clone();
        spoilt["zzz"] = json!(1);
        assert!(!refused(&schema, &spoilt, "").is_empty(), "{name}");
    }
}

#[test]
fn the_schema_refuses_what_a_scene_refuses() {
    let schema = schema();
    let good = &shipped().iter().find(|shipped| shipped.name == "hybrid-wall").expect("it is shipped").text;
    let mass = &shipped().iter().find(|shipped| shipped.name == "rail-drop").expect("it is shipped").text;
    for (text, section, key, value) in [
        // A key of another kind, or of another device.
        (good, "method", "window", json!(3)),
        (good, "method", "shaper", json!({ "cutoff": 2.5 })),
        (good, "hand", "torque", json!(0)),
        (good, "device", "mass", json!(1)),
        (good, "encoder", "resolution", json!(1e-5)),
        (mass, "encoder", "lines", json!(1024)),
        (mass, "model", "winding", json!("resistive")),
        // A value of another type, an option that does not exist, a size beyond its range.
        (good, "wall", "position", json!(true)),
        (good, "wall", "stiffness", json!(-1)),
        (good, "wall", "stiffness", json!(1e7)),
        (good, "method", "kind", json!("hybird")),
        (good, "method", "position_bits", json!(33)),
        (good, "method", "position_bits", json!(1)),
        (good, "method", "pwm", json!({ "mode": "none" })),
        (good, "record", "clock", json!("yes")),
        (good, "run", "seed", json!(0.5)),
        (good, "accuracy", "outputs", json!(["zzz"])),
        (good, "expect", "amplitude", json!({ "value": 1 })),
    ] {
        let mut spoilt = scene(text);
        if spoilt.get(section).is_none() {
            spoilt[section] = json!({});
        }
        assert_eq!(refused(&schema, &spoilt, ""), Vec::<String>::new(), "{section}");
        spoilt[section][key] = value.clone();
        assert!(!refused(&schema, &spoilt, "").is_empty(), "{section}.{key} = {value}");
        // The program refuses the value too.
        let set = format!("{section}.{key}={}", toml(&value));
        let name = if text == good { "hybrid-wall" } else { "rail-drop" };
        assert_eq!(code(&run(&["run", name, "--edges", "10", "--set", &set])), 4, "{set}");
    }
    for (section, key) in [("wall", "position"), ("wall", "stiffness"), ("method", "sample_rate"), ("run", "duration")]
    {
        let mut spoilt = scene(good);
        spoilt[section].as_object_mut().expect("a section").remove(key);
        assert!(!refused(&schema, &spoilt, "").is_empty(), "without {section}.{key}");
    }
}

/// Writes a value of JSON as TOML.
fn toml(value: &Value) -> String {
    match value {
        Value::Object(object) => {
            let pairs: Vec<_> = object.iter().map(|(key, value)| format!("{key} = {}", toml(value))).collect();
            format!("{{ {} }}", pairs.join(", "))
        }
        _ => value.to_string(),
    }
}
