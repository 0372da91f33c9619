//! `hpu map`: files, replays, interruptions, and refused maps.

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use serde_json::json;

use crate::common::{ROOT, assert_refused, code, hpu, json, names, run, scratch, stderr, stdout, text};

/// A hand's plan of 30 s. With friction and without a motion that repeats, 20 s of it take far longer than 20 ms, after
/// which the guard of a cell looks.
pub const PLAN_OF_30_S: &str = r#"hand.path=[["0 s", 0], ["150 ms", 1.4], ["250 ms", 1.9], ["30 s", 1.8]]"#;

/// A small map with a boundary: 9 by 5 cells of 150 ms.
pub const SMALL: [&str; 12] = [
    "map",
    "hybrid-wall",
    "--x",
    "wall.stiffness=0.5..6 N.m/rad:9",
    "--y",
    "wall.damping=0..0.4 mN.m.s/rad:5",
    "--set",
    "run.duration=150 ms",
    "--set",
    "device.initial_angle=1.4 rad",
    "--set",
    "hand.path=[[\"0 s\", 1.4], [\"20 ms\", 1.8]]",
];

fn small(out: &Path, more: &[&str]) -> Output {
    run(&[&SMALL[..], &["-o", text(out)], more].concat())
}

fn content(dir: &Path, name: &str) -> String {
    fs::read_to_string(dir.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// Returns the rows of a map's CSV, without the command that made it.
fn rows(dir: &Path) -> Vec<String> {
    content(dir, "map.csv").lines().filter(|line| !line.starts_with('#')).map(str::to_string).collect()
}

#[test]
fn a_map_writes_its_tables_and_pictures_and_draws_itself_in_letters() {
    let out = scratch("map-small").join("out");
    let output = small(&out, &["--quiet"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert_eq!(stderr(&output), "", "no progress where nobody wants any");
    let pictures = ["amplitude", "displayed-stiffness", "energy", "frequency", "map"];
    let mut expected: Vec<String> =
        pictures.iter().flat_map(|name| [format!("{name}.png"), format!("{name}.svg")]).collect();
    expected.extend(["journal.txt", "map.csv", "map.parquet"].map(str::to_string));
    expected.sort();
    assert_eq!(names(&out), expected);
    let said = stdout(&output);
    for word in [
        "settled",
        "limit_cycle",
        "curves     spectral_radius (",
        " of 5)",
        "spectral_radius: ",
        "edge       ",
        "routh",
        "9 by 5 cells",
    ] {
        assert!(said.contains(word), "{word}: {said}");
    }
    assert_eq!(said.lines().filter(|line| line.starts_with("  |")).count(), 5, "{said}");
    for name in ["map.svg", "energy.svg"] {
        let svg = content(&out, name);
        assert!(
            svg.contains("hpu map hybrid-wall --x") && svg.contains("wall.damping in mN\u{b7}m\u{b7}s/rad"),
            "{name}"
        );
    }
    assert!(content(&out, "map.svg").contains("spectral radius"), "the legend names the curves");
    assert_eq!(rows(&out).len(), 1 + 45);
}

#[test]
fn the_command_in_a_row_runs_that_cell_again_to_the_last_digit() {
    let out = scratch("map-replay");
    assert_eq!(code(&small(&out, &["--method", "coarse:method.pwm.bits=10,method.stiffness_format=(0,10,4)"])), 0);
    let rows = rows(&out);
    let columns = rows[0].split(',').count();
    let mut outcomes = Vec::new();
    for line in rows.iter().skip(1) {
        let fields: Vec<&str> = line.splitn(columns, ',').collect();
        if fields[6] == "0" || outcomes.contains(&fields[5]) {
            continue;
        }
        outcomes.push(fields[5]);
        let replay = fields[columns - 1].trim_matches('"').replace("\"\"", "\"");
        let replay = replay.replacen("hpu", env!("CARGO_BIN_EXE_hpu"), 1) + " --json";
        let output = Command::new("sh").args(["-c", &replay]).current_dir(ROOT).output().expect("a shell");
        assert!([0, 1].contains(&code(&output)), "{replay}: {}", stderr(&output));
        let again = json(&output);
        assert_eq!(again["outcome"]["kind"], fields[5]);
        assert_eq!(again["energy"]["dissipated_j"].as_f64(), fields[12].parse().ok(), "{replay}");
        assert_eq!(again["outcome"]["rms_rad"].as_f64(), fields[7].parse().ok(), "{replay}");
    }
    assert_eq!(outcomes, ["settled", "limit_cycle", "not_told"]);
}

#[test]
fn threads_change_nothing_and_full_goes_on_from_what_is_there() {
    let dir = scratch("map-threads");
    for (name, jobs) in [("one", "1"), ("three", "3")] {
        assert_eq!(code(&small(&dir.join(name), &["--jobs", jobs])), 0);
    }
    assert_eq!(rows(&dir.join("one")), rows(&dir.join("three")));
    let before = content(&dir.join("one"), "journal.txt");
    assert_eq!(code(&small(&dir.join("one"), &["--full"])), 0);
    let journal = content(&dir.join("one"), "journal.txt");
    assert!(journal.starts_with(&before), "no cell is run again");
    assert_eq!(journal.lines().count(), 1 + 45);
    let outcomes = |name: &str| -> Vec<String> {
        rows(&dir.join(name)).iter().map(|row| row.split(',').nth(5).unwrap_or_default().to_string()).collect()
    };
    assert_eq!(outcomes("one"), outcomes("three"), "the refined map is the full one");
}

#[test]
fn an_interrupted_map_says_so_and_goes_on_to_what_an_uninterrupted_one_is() {
    let dir = scratch("map-interrupt");
    let (whole, out) = (dir.join("whole"), dir.join("out"));
    let long = ["--full", "--set", "run.duration=1 s"];
    assert_eq!(code(&small(&whole, &long)), 0);
    let arguments = [&SMALL[..], &["-o", text(&out)], &long].concat();
    let child = hpu().args(&arguments).stdout(Stdio::piped()).spawn().expect("starts");
    let done = || fs::read_to_string(out.join("journal.txt")).map_or(0, |text| text.lines().count());
    let start = Instant::now();
    while done() < 4 {
        assert!(start.elapsed() < Duration::from_secs(60), "no cell is done");
        sleep(Duration::from_millis(1));
    }
    let kill = Command::new("sh").args(["-c", &format!("kill -INT {}", child.id())]).status();
    assert!(kill.expect("a shell").success());
    let output = child.wait_with_output().expect("ends");
    assert_eq!(code(&output), 130, "{}", stdout(&output));
    assert!(stdout(&output).contains("interrupted after") && stdout(&output).contains("goes on"));
    assert_eq!(names(&out), ["journal.txt"], "no half of a result");
    let kept = content(&out, "journal.txt");
    assert!(kept.lines().count() < 1 + 45, "{kept}");
    let output = run(&arguments);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert!(content(&out, "journal.txt").starts_with(&kept), "what was done is not done again");
    assert_eq!(rows(&out), rows(&whole));
}

#[test]
fn a_journal_with_flipped_digits_gives_the_map_that_it_gave_and_says_how_many_cells_it_runs_again() {
    let out = scratch("map-flipped");
    assert_eq!(code(&small(&out, &["--full"])), 0);
    let (whole, before) = (content(&out, "journal.txt"), rows(&out));
    // One row has another digit in a number, one has another word before its cell, and one has lost its end.
    let mut lines: Vec<String> = whole.lines().map(String::from).collect();
    let digit = lines[3].rfind(|c: char| c.is_ascii_digit()).expect("a digit");
    let other = if &lines[3][digit..=digit] == "7" { "8" } else { "7" };
    lines[3].replace_range(digit..=digit, other);
    lines[5] = lines[5].replace("\"Ok\"", "\"Oj\"");
    let length = lines[7].len() / 2;
    lines[7].truncate(length);
    fs::write(out.join("journal.txt"), lines.join("\n") + "\n").expect("a journal");
    let output = small(&out, &["--full"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert_eq!(rows(&out), before);
    assert!(stderr(&output).contains("journal.txt: 3 rows are damaged"), "{}", stderr(&output));
    // Now all rows are whole again, in any order.
    let sorted = |text: &str| text.lines().map(String::from).collect::<std::collections::BTreeSet<_>>();
    assert_eq!(sorted(&content(&out, "journal.txt")), sorted(&whole));
    let output = small(&out, &["--full"]);
    assert_eq!((code(&output), stderr(&output).as_str()), (0, ""));
}

#[test]
fn a_cell_that_takes_too_long_is_not_run_and_the_same_command_runs_it_again() {
    let out = scratch("map-guard");
    let (x, y) = ("run.duration=0.01..20 s:2", "wall.stiffness=1..2 N.m/rad:2");
    let set = ["--set", "record.plant_rate=100 Hz", "--set", PLAN_OF_30_S, "-o", text(&out)];
    let arguments = [&["map", "friction-wall", "--x", x, "--y", y, "--full"][..], &set].concat();
    let output = run(&[&arguments[..], &["--cell-timeout", "1ms", "--json"]].concat());
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let said = json(&output);
    assert_eq!((&said["complete"], &said["methods"][0]["outcomes"]["not_run"]), (&json!(false), &json!(2)));
    let outcomes = |out: &Path| -> Vec<String> {
        rows(out).iter().skip(1).map(|row| row.split(',').nth(5).unwrap_or_default().to_string()).collect()
    };
    assert_eq!(outcomes(&out).iter().filter(|outcome| *outcome == "not_run").count(), 2);
    assert_eq!(content(&out, "journal.txt").lines().count(), 1 + 2);
    let output = run(&arguments);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert!(!stdout(&output).contains("not_run"), "{}", stdout(&output));
    assert_eq!(content(&out, "journal.txt").lines().count(), 1 + 4);
    assert!(!outcomes(&out).contains(&"not_run".to_string()));
}

#[test]
fn the_folder_of_another_scene_or_map_is_refused_and_stays_as_it_is() {
    let out = scratch("map-other");
    assert_eq!(code(&small(&out, &[])), 0);
    let before = content(&out, "map.csv");
    let mut other = SMALL;
    other[1] = "hybrid-wall-25mhz";
    assert_refused(&run(&[&other[..], &["-o", text(&out)]].concat()), 2, &["holds another study", "another folder"]);
    other = SMALL;
    other[3] = "wall.stiffness=0.5..6 N.m/rad:10";
    assert_refused(&run(&[&other[..], &["-o", text(&out)]].concat()), 2, &["holds another study", "N.m/rad:10"]);
    // A scene with the same name and another text is another scene.
    let dir = scratch("map-edited");
    let scene = dir.join("wall.toml");
    let shipped = fs::read_to_string(format!("{ROOT}/testbench/scenes/hybrid-wall.toml")).expect("a scene");
    fs::write(&scene, &shipped).expect("a scene");
    other = SMALL;
    other[1] = text(&scene);
    let own = dir.join("out");
    assert_eq!(code(&run(&[&other[..], &["-o", text(&own)]].concat())), 0);
    fs::write(&scene, shipped.replace("1.5 rad", "1.51 rad")).expect("a scene");
    assert_refused(&run(&[&other[..], &["-o", text(&own)]].concat()), 2, &["holds another study"]);
    assert_eq!(content(&out, "map.csv"), before);
}

#[test]
fn what_is_no_map_is_refused_with_its_reason_before_anything_is_written() {
    let dir = scratch("map-refused");
    let out = dir.join("out");
    let refused = |x: &str, y: &str, more: &[&str], exit: i32, words: &[&str]| {
        let output = run(&[&["map", "hybrid-wall", "--x", x, "--y", y, "-o", text(&out)][..], more].concat());
        assert_refused(&output, exit, words);
    };
    let (x, y) = ("wall.stiffness=0.5..6 N.m/rad:9", "wall.damping=0..0.4 mN.m.s/rad:5");
    refused("wall.stifness=1..2", y, &[], 4, &["wall.stifness", "unknown key"]);
    refused("wall.stiffness=1..2 mm", y, &[], 4, &["wall.stiffness", "N.m/rad"]);
    refused("wall.stiffness=2..1", y, &[], 2, &["reversed"]);
    refused("wall.stiffness=1..1", y, &[], 2, &["empty"]);
    refused("wall.stiffness=0..1:5:log", y, &[], 2, &["above zero"]);
    refused("wall.stiffness", y, &[], 2, &["KEY=FROM..TO"]);
    refused(x, x, &[], 2, &["both axes"]);
    refused(x, y, &["--method", "law:model.datapath=linear"], 4, &["method law", "linear"]);
    refused(x, y, &["--method", "a:method.kind=telepathy"], 4, &["method a", "telepathy", "hybrid"]);
    refused(x, y, &["--method", "a:wall.damping=1"], 2, &["wall.damping", "axis"]);
    refused(x, y, &["--method", "a:x"], 2, &["KEY=VALUE"]);
    refused(x, y, &["--cell-timeout", "soon"], 2, &["60s"]);
    refused(x, y, &["--cell-timeout", "0s"], 2, &["above zero"]);
    refused(x, y, &["--cell-events", "0"], 2, &["--cell-events"]);
    let recording = run(&["map", "replay-capture", "--x", x, "--y", y, "-o", text(&out)]);
    assert_refused(&recording, 2, &["recording"]);
    let bounded = run(&["map", "bounded-wall-1khz", "--x", x, "--y", y, "--all-methods", "-o", text(&out)]);
    assert_refused(&bounded, 2, &["--all-methods", "energy_bounding", "conventional"]);
    let phantom = ["map", "phantom-drop", "--x", "room.stiffness=1..2 kN/m", "--y", "drop.weight=0.1..0.2 N"];
    assert_refused(&run(&[&phantom[..], &["--all-methods"]].concat()), 2, &["--all-methods", "axis"]);
    assert_refused(&run(&["map", "no-such-scene", "--x", x, "--y", y]), 4, &["no-such-scene", "hybrid-wall"]);
    assert_eq!(names(&dir), [""; 0]);
}

#[test]
fn a_cell_that_never_ends_is_a_row_with_its_reason_and_the_others_are_done() {
    let out = scratch("map-endless");
    // A hand that has a plan to the end: else the motion repeats, and its eleven days end at once.
    let path = r#"hand.path=[["0 s", 0], ["150 ms", 1.4], ["250 ms", 1.9], ["1000000 s", 1.8]]"#;
    let output = run(&[
        "map",
        "hybrid-wall",
        "--x",
        "run.duration=0.02..1000000 s:2",
        "--y",
        "wall.stiffness=1..2 N.m/rad:2",
        "--set",
        "record.plant_rate=10 Hz",
        "--set",
        path,
        "--cell-events",
        "100000",
        "-o",
        text(&out),
    ]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert!(stdout(&output).contains("2 times: more than 100000 events"), "{}", stdout(&output));
    let rows = rows(&out);
    let outcomes: Vec<&str> = rows.iter().skip(1).filter_map(|row| row.split(',').nth(5)).collect();
    assert_eq!(outcomes[1], "failed");
    assert_eq!(outcomes[3], "failed");
    assert!(outcomes[0] != "failed" && outcomes[2] != "failed", "{outcomes:?}");
}

#[test]
fn json_is_one_object_with_axes_curves_and_cells() {
    let result = json(&run(&[&SMALL[..], &["--json", "--method", "a:", "--method", "b:method.pwm.bits=11"]].concat()));
    assert_eq!(result["complete"], true);
    assert_eq!(result["x"]["values"].as_array().map(Vec::len), Some(9));
    assert_eq!(result["cells"].as_array().map(Vec::len), Some(90));
    let method = &result["methods"][1];
    assert_eq!(method["label"], "b");
    let counted: u64 =
        method["outcomes"].as_object().expect("counts").values().filter_map(serde_json::Value::as_u64).sum();
    assert_eq!(counted, 45);
    assert_eq!(method["curves"]["over"], "y");
    assert_eq!(method["curves"]["criteria"][0]["limits"].as_array().map(Vec::len), Some(5));
}

#[test]
fn all_methods_are_layers_of_their_own_each_with_its_edge() {
    let mut coarse = SMALL;
    coarse[3] = "wall.stiffness=0.1..6 N.m/rad:3:log";
    coarse[5] = "method.sample_rate=1..5 kHz:2";
    let result = json(&run(&[&coarse[..], &["--json", "--all-methods", "--full"]].concat()));
    let layers = result["methods"].as_array().expect("layers");
    assert_eq!(layers.len(), 12);
    for layer in layers {
        assert_eq!(layer["outcomes"]["failed"], 0, "{layer}");
        assert_eq!(layer["run"], 6);
        let reasons = layer["edge"]["reasons"].as_array().expect("reasons");
        let places: u64 = reasons.iter().filter_map(|reason| reason["places"].as_u64()).sum();
        assert_eq!(Some(places), layer["edge"]["places"].as_u64());
    }
    // The plain sampled wall has an edge between 0.1 and 6 N.m/rad at 1 kHz; energy bounding holds at any stiffness.
    let of = |label: &str| layers.iter().find(|layer| layer["label"] == label).expect("a layer");
    assert!(of("conventional")["edge"]["places"].as_u64() > Some(0));
    assert_eq!(of("energy bounding")["edge"]["places"], 0);
}

#[test]
fn where_no_curve_applies_it_is_said() {
    let mut without = SMALL;
    without[3] = "wall.position=1.45..1.55 rad:3";
    let output = run(&without);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert!(stdout(&output).contains("no curves: the criteria have a limit of wall.stiffness"), "{}", stdout(&output));
}

#[test]
fn a_map_that_looks_on_marks_the_cells_whose_own_run_is_settled_for_ever() {
    let out = scratch("map-for-ever").join("out");
    let (x, y) = ("wall.stiffness=0.5..4.5 N.m/rad:3", "wall.damping=0..0.2 mN.m.s/rad:2");
    let asked = ["map", "hybrid-wall", "--x", x, "--y", y, "--full", "--quiet"];
    let plain = json(&run(&[&asked[..], &["--json"]].concat()));
    assert!(plain["methods"][0].get("settled_for_ever").is_none(), "nobody has asked");
    let told = json(&run(&[&asked[..], &["--for-ever=3s", "--json", "-o", text(&out)]].concat()));
    let cells = told["cells"].as_array().expect("cells");
    let (mut kinds, mut proved) = (Vec::new(), 0);
    for cell in cells {
        let at = |key: &str, values: &[&str]| values[cell[key].as_u64().expect("a place") as usize].to_string();
        let stiffness = format!("wall.stiffness={}", at("ix", &["0.5", "2.5", "4.5"]));
        let damping = format!("wall.damping={} mN.m.s/rad", at("iy", &["0", "0.2"]));
        let own = ["run", "hybrid-wall", "--set", &stiffness, "--set", &damping, "--for-ever=3s"];
        let (page, own) = (stdout(&run(&own)), json(&run(&[&own[..], &["--json"]].concat())));
        let settled = page.lines().any(|line| line.starts_with("for ever   settled for ever: "));
        let kind = match own["for_ever"]["kind"].as_str().expect("a kind") {
            "repeats" if settled => "settled",
            // A map has no class of its own for a wall that keeps contact.
            "in_contact" => "bounded",
            kind => kind,
        };
        assert_eq!(cell["for_ever"], kind, "{stiffness}, {damping}: {page}");
        assert!(settled == ["quiet", "stuck", "settled"].contains(&kind), "{page}");
        proved += u32::from(settled);
        kinds.push(kind.to_string());
    }
    assert!(kinds.iter().any(|kind| kind == "quiet") && proved >= 3, "{kinds:?}");
    assert_eq!(told["methods"][0]["settled_for_ever"], proved);
    assert!(content(&out, "map.svg").contains("settled for ever"));
}
