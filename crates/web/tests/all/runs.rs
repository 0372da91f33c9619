//! Runs and looks: their columns are those of the engine, to the bit; a look adds nothing and loses nothing.

use std::collections::BTreeMap;

use hpu_cosim::{Control, SceneFile, Simulation, Trace, Wired, WiredSimulation};
use hpu_web::Answer;
use serde_json::{Value, json};

use crate::ask;

/// Returns the columns of an answer by their names.
fn named(answer: &Answer) -> BTreeMap<String, &[f64]> {
    let told = answer.json["columns"].as_array().expect("columns");
    assert_eq!(told.len(), answer.columns.len());
    let name =
        |told: &Value| format!("{} {}", told["name"].as_str().expect("a name"), told["role"].as_str().expect("a role"));
    told.iter().map(name).zip(answer.columns.iter().map(Vec::as_slice)).collect()
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|value| value.to_bits()).collect()
}

#[test]
fn a_run_has_the_rows_of_the_engine() {
    for name in ["hybrid-wall", "rail-drop", "phantom-thrown", "gimbal-switch"] {
        let set = [("run.duration".to_string(), "50 ms".to_string())];
        let answer = ask(&json!({ "do": "run", "scene": name, "set": ["run.duration=50 ms"] }));
        let experiment = SceneFile::find(name).and_then(|file| file.parse(&set)).map_err(|error| error.to_string());
        let experiment = experiment.expect("a scene");
        let simulation = WiredSimulation::new(&experiment).expect("a simulation");
        let mut trace = simulation.brief_trace();
        let summary = simulation.run(simulation.driver(), &mut trace, &mut (), &Control::new());
        let columns = named(&answer);
        for index in simulation.judged() {
            let column = columns[&format!("{} value", simulation.row()[index].name)];
            assert_eq!(bits(column), bits(trace.real(index)), "{name}");
        }
        assert_eq!(answer.json["edges"], summary.edges);
        assert_eq!(answer.json["encoder_edges"], summary.encoder_edges);
        assert_eq!(answer.json["rows"]["count"], trace.rows());
        assert_eq!(answer.json["rows"]["interval_s"], trace.interval_s());
    }
}

/// A scene of another kind of motion each: a bridge that switches, an averaged one, a mass.
const LOOKED_AT: [(&str, &[&str]); 3] =
    [("hybrid-wall", &[]), ("hybrid-wall", &["model.bridge=averaged"]), ("rail-drop", &[])];

#[test]
fn a_look_at_the_rate_of_the_run_shows_its_rows() {
    for (scene, set) in LOOKED_AT {
        let set = [&["run.duration=200 ms"], set].concat();
        let run = ask(&json!({ "do": "run", "scene": scene, "set": set, "ripple": true, "nets": ["position"] }));
        let look = ask(&json!({
            "do": "look", "scene": scene, "set": set, "nets": ["position"], "from_s": 0.15, "to_s": 0.19, "rows": 400,
        }));
        let rows = &look.json["rows"];
        assert_eq!(rows["interval_s"], run.json["rows"]["interval_s"], "{scene}");
        let first = (rows["first_s"].as_f64().expect("s") / rows["interval_s"].as_f64().expect("s")).round() as usize;
        assert_eq!(first, 1500);
        let (run, look) = (named(&run), named(&look));
        assert_eq!(run.keys().collect::<Vec<_>>(), look.keys().collect::<Vec<_>>());
        for (name, near) in look {
            assert!(near.len() >= 399, "{scene} {name}: {}", near.len());
            assert_eq!(bits(near), bits(&run[&name][first..first + near.len()]), "{scene} {set:?} {name}");
        }
    }
}

#[test]
fn the_ripple_of_a_row_is_that_of_the_rows_of_single_edges_inside() {
    let whole = ask(&json!({ "do": "run", "scene": "hybrid-wall", "ripple": true }));
    let run = named(&whole);
    // The hand presses, and the bridge switches; then the wall holds it, and the ripple is the same in every period.
    for row in [2500, 2777, 3141, 5000, 9000, 14_142, 19_999] {
        let (from_s, to_s) = (row as f64 * 1e-4 - 1e-4, row as f64 * 1e-4);
        let look = json!({ "do": "look", "scene": "hybrid-wall", "from_s": from_s, "to_s": to_s + 1e-7, "rows": 5005 });
        let near = ask(&look);
        assert_eq!(near.json["rows"]["interval_s"], 2e-8);
        let near = named(&near);
        let first = near["torque_least_nm least"][1..5001].iter().copied().fold(f64::INFINITY, f64::min);
        let last = near["torque_greatest_nm greatest"][1..5001].iter().copied().fold(f64::NEG_INFINITY, f64::max);
        assert!(last > first + 1e-3, "there is a ripple in row {row}");
        // The rows of single edges are exact states, rounded once. Inside a row the closed forms are in `f64`.
        for (edges, name) in [(first, "torque_least_nm least"), (last, "torque_greatest_nm greatest")] {
            let whole = run[name][row];
            assert!((edges - whole).abs() <= 4.0 * f64::EPSILON * whole.abs(), "row {row}: {edges}, {whole}");
        }
    }
}

#[test]
fn the_ripple_of_a_long_row_is_that_of_the_short_rows_inside() {
    // A short row is little longer than a period of the modulator; a long one has thousands, and few are searched.
    for scene in ["hybrid-wall", "conventional-wall-1khz"] {
        let whole = ask(&json!({ "do": "run", "scene": scene, "set": ["run.duration=2 s"], "ripple": true }));
        let look = json!({
            "do": "look", "scene": scene, "set": ["run.duration=2 s"], "from_s": 0, "to_s": 2, "rows": 10,
        });
        let look = ask(&look);
        assert_eq!((&look.json["rows"]["interval_s"], &whole.json["rows"]["interval_s"]), (&json!(0.2), &json!(1e-4)));
        let (run, long) = (named(&whole), named(&look));
        let of = |columns: &BTreeMap<String, &[f64]>, name: &str| columns[name][1..].to_vec();
        let [least, greatest] = ["torque_least_nm least", "torque_greatest_nm greatest"].map(|name| {
            let (short, long) = (of(&run, name), of(&long, name));
            assert!(long.len() >= 9, "{scene}: {} rows", long.len());
            short.chunks(2000).map(<[f64]>::to_vec).zip(long).collect::<Vec<_>>()
        });
        for (row, ((lows, low), (highs, high))) in least.into_iter().zip(greatest).enumerate() {
            let least = lows.into_iter().fold(f64::INFINITY, f64::min);
            let greatest = highs.into_iter().fold(f64::NEG_INFINITY, f64::max);
            let allowed = 1e-13 * (least.abs() + greatest.abs());
            assert!((low - least).abs() <= allowed, "{scene}, row {row}: {low} is not {least}");
            assert!((high - greatest).abs() <= allowed, "{scene}, row {row}: {high} is not {greatest}");
        }
    }
}

#[test]
fn a_look_beyond_the_run_ends_with_it() {
    let look = |from_s: f64, to_s: f64, rows: f64| {
        let set = ["run.duration=1 ms"];
        let look = json!({
            "do": "look", "scene": "hybrid-wall", "set": set, "from_s": from_s, "to_s": to_s, "rows": rows,
        });
        ask(&look).json["rows"]["count"].as_u64().expect("a count")
    };
    assert_eq!(look(-1.0, 7.0, 100.0), 100);
    assert_eq!(look(7.0, 8.0, 100.0), 0);
    assert!(look(0.0, 1e-3, 1e300) <= 50_000);
    assert!(look(0.0, 1e-3, -5.0) <= 2);
}

#[test]
fn a_long_run_holds_a_bounded_trace() {
    let run = ask(
        &json!({ "do": "run", "scene": "free-motion", "set": ["run.duration=400 s", "record.plant_rate=100 kHz"] }),
    );
    let values: usize = run.columns.iter().map(Vec::len).sum();
    assert!(values <= 2 * Trace::USUAL, "{values}");
}

#[test]
fn the_command_makes_the_same_run() {
    let run =
        ask(&json!({ "do": "run", "scene": "hybrid-wall", "set": ["wall.stiffness=2 N.m/rad", "method.pwm.bits=10"] }));
    assert_eq!(run.json["command"], "hpu run hybrid-wall --set wall.stiffness='2 N.m/rad' --set method.pwm.bits=10");
}

#[test]
fn keys_have_values_ranges_and_methods() {
    let told = ask(&json!({ "do": "keys", "scene": "hybrid-wall", "set": ["wall.stiffness=2 N.m/rad"] })).json;
    let keys = told["keys"].as_array().expect("keys");
    let key = |name: &str| keys.iter().find(|key| key["key"] == name).unwrap_or_else(|| panic!("no {name}"));
    let stiffness = key("wall.stiffness");
    assert_eq!((&stiffness["value"], &stiffness["unit"]), (&json!(2.0), &json!("N.m/rad")));
    assert_eq!(stiffness["source"], "--set wall.stiffness=2 N.m/rad");
    assert_eq!(stiffness["takes"]["kind"], "quantity");
    assert_eq!(stiffness["takes"]["unit"], "N.m/rad");
    assert_eq!(key("method.pwm.bits")["takes"]["kind"], "whole");
    assert_eq!(key("method.damping_format")["toml"], "\"(0,8,4)\"");
    let methods = told["methods"].as_array().expect("methods");
    assert!(methods.len() > 5);
    for method in methods {
        ask(&json!({ "do": "run", "scene": "hybrid-wall", "set": method["set"] }));
    }
}

#[test]
fn a_waveform_is_a_file_of_its_format() {
    let wave = |format: &str| {
        let set = ["run.duration=5 ms"];
        let answer = ask(&json!({ "do": "wave", "scene": "hybrid-wall", "set": set, "format": format }));
        assert_eq!(answer.json["name"], format!("hybrid-wall.{format}"));
        answer.file
    };
    let vcd = String::from_utf8(wave("vcd")).expect("a VCD is text");
    assert!(vcd.contains("$enddefinitions") && vcd.contains("\n#500000\n"), "5 ms are 500000 times 10 ns");
    // An FST begins with the block of its header: kind 0, and 329 bytes.
    assert_eq!(wave("fst")[..9], [0, 0, 0, 0, 0, 0, 0, 1, 0x49]);
}

#[test]
fn a_hash_changes_with_the_run_alone() {
    let hash = |set: &[&str]| ask(&json!({ "do": "hash", "scene": "one-tick", "set": set })).json["hash"].clone();
    assert_eq!(hash(&[]), hash(&["about=another text"]));
    assert_ne!(hash(&[]), hash(&["wall.position=2 mm"]));
    assert_eq!(hash(&[]).as_str().expect("a text").len(), 64);
}
