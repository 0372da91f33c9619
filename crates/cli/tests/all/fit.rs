//! `hpu fit`, and scenes that leave their model open. No test reads a wall time.

use crate::common::{assert_refused, code, json, names, run, scratch, stderr, stdout, text};

#[test]
fn a_fit_says_what_is_left_out_and_how_to_run_it() {
    let dir = scratch("fit-drawn");
    let output = run(&["fit", "prescribed-sweep", "-o", text(&dir), "--json"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let found = json(&output);
    assert_eq!(names(&dir), ["fit.csv", "fit.json", "fit.png", "fit.svg", "fit.txt"]);
    let kept = std::fs::read_to_string(dir.join("fit.json")).expect("its JSON");
    assert_eq!(serde_json::from_str::<serde_json::Value>(&kept).expect("JSON"), found);
    // Each model that was run is a row. The chosen one has the worst of the errors, and its command.
    let table = std::fs::read_to_string(dir.join("fit.csv")).expect("its table");
    let rows: Vec<Vec<&str>> = table.lines().skip(2).map(|row| row.splitn(4, ',').collect()).collect();
    let tried = found["models_tried"].as_u64().expect("a number") as usize;
    assert!(rows.len() >= tried.min(10) && table.starts_with("# hpu fit prescribed-sweep\nspeedup,error,"), "{table}");
    let chosen: Vec<_> = rows.iter().filter(|row| row[2] == "the least model").collect();
    assert_eq!(chosen.len(), 1, "{table}");
    assert_eq!(Some(chosen[0][3].trim_matches('"').replace("\"\"", "\"").as_str()), found["command"].as_str());
    let worst = found["errors"].as_object().expect("an object").values().filter_map(serde_json::Value::as_f64);
    assert_eq!(chosen[0][1].parse::<f64>(), Ok(worst.fold(0.0, f64::max)));
    let picture = std::fs::read_to_string(dir.join("fit.svg")).expect("its picture");
    assert!(picture.contains("prescribed-sweep: models that were tried"), "the title");
    assert_eq!(found["scene"], "prescribed-sweep");
    assert_eq!(found["within"], 0.01);
    // A hand that imposes the motion leaves no effect to the bridge.
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
    let said = stdout(&said);
    let line =
        |name: &str| said.lines().find(|line| line.starts_with(name)).unwrap_or_else(|| panic!("{name}: {said}"));
    assert!(line("judged     ").contains("peak_penetration ") && !line("judged     ").contains("energy"), "{said}");
    assert!(line("not judged ").contains("energy ") && line("not judged ").contains("accuracy.outputs"), "{said}");
    // A model that is given is not chosen.
    let given = run(&["run", "bounded-wall-1khz", "--set", "model=auto", "--set", "model.bridge=averaged", "--json"]);
    assert!(json(&given)["fitted"].is_null());
}

#[test]
fn a_fit_names_what_it_judged_and_tells_how_far_off_the_rest_is() {
    // The verdict of a limit cycle is its amplitude and frequency. The phase of its trace after 2 s is not judged.
    let found = json(&run(&["fit", "slow-winding", "--json"]));
    assert_eq!(found["judged"], serde_json::json!(["peak_penetration", "amplitude", "frequency", "verdict"]));
    let off = |key: &str, output: &str| found[key][output].as_f64().unwrap_or_else(|| panic!("{output}: {found}"));
    assert!(off("errors", "amplitude") <= 0.005 && found["errors"]["trace"].is_null(), "{found}");
    // Computes the same error from the two runs: the rms of the difference over the range of motion.
    let dir = scratch("fit-trace");
    let angles = |name: &str, set: &[String]| {
        let out = dir.join(name);
        let mut arguments = vec!["run", "slow-winding", "--no-plot", "-o", text(&out)];
        set.iter().for_each(|set| arguments.extend(["--set", set]));
        assert_eq!(code(&run(&arguments)), 0);
        let trace = std::fs::read_to_string(out.join("trace.csv")).expect("a trace");
        let column =
            trace.lines().next().expect("a head").split(',').position(|name| name.starts_with("angle")).expect("it");
        let angle = |line: &str| line.split(',').nth(column).expect("a cell").parse::<f64>().expect("a number");
        trace.lines().skip(1).map(angle).collect::<Vec<_>>()
    };
    let set = found["set"].as_object().expect("keys");
    let set: Vec<_> = set.iter().map(|(key, value)| format!("{key}={}", value.as_str().expect("text"))).collect();
    let (written, fitted) = (angles("written", &[]), angles("fitted", &set));
    let range = written.iter().copied().fold(f64::MIN, f64::max) - written.iter().copied().fold(f64::MAX, f64::min);
    let square: f64 = written.iter().zip(&fitted).map(|(a, b)| (a - b) * (a - b)).sum();
    let rms = (square / written.len() as f64).sqrt() / range;
    let told = off("errors_not_judged", "trace");
    assert!(rms > 0.01 && (told - rms).abs() < 1e-3 * rms, "told {told}, is {rms}");
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
