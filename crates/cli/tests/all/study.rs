//! `hpu study`: the example of the documentation, what is kept, and the errors of a bad file.

use std::fs;

use hpu_papers::measure::measures;

use crate::common::{ROOT, assert_refused, code, json, names, run, scratch, stderr, stdout, text};

const EXAMPLE: &str = "testbench/studies/example.toml";

#[test]
fn the_example_measures_judges_and_calls_other_verbs() {
    let out = scratch("study-example").join("out");
    let output = run(&["study", EXAMPLE, "-o", text(&out), "--quiet"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let told = stdout(&output);
    // The limits of the linear loop at 1 kHz: as `hpu reproduce hybrid-loop` has it.
    assert!(told.contains("conventional, 1 kHz  0.497 N.m/rad\n"), "{told}");
    assert!(told.contains("(a)   confirmed       \"higher rates allow stiffer walls\" (general knowledge)"), "{told}");
    let method = told.lines().find(|line| line.starts_with("hybrid ")).expect("a line of a method");
    assert!(method.contains("settles") && method.ends_with(" uJ"), "{method}");
    let heads = told.lines().find(|line| line.contains("energy of the hand")).expect("heads of columns");
    assert_eq!(heads.find("rms"), method.find(|c: char| c.is_ascii_digit()), "{heads}\n{method}");
    assert!(told.contains("hpu map hybrid-wall") && told.contains("conventional-wall-1khz"), "{told}");
    assert_eq!(names(&out), ["example.csv", "example.txt", "journal.txt", "limits", "map"]);
    assert!(names(&out.join("map")).contains(&"journal.txt".to_string()));
    let before = fs::read_to_string(out.join("journal.txt")).expect("a journal");
    let again = run(&["study", EXAMPLE, "-o", text(&out), "--quiet"]);
    assert_eq!((code(&again), stdout(&again)), (0, told));
    assert_eq!(fs::read_to_string(out.join("journal.txt")).expect("a journal"), before, "nothing ran again");
}

#[test]
fn a_shipped_study_runs_by_its_name_and_draws_the_velocities_that_it_measures() {
    let out = scratch("study-velocities").join("out");
    let output = run(&["study", "velocity-estimators", "-o", text(&out), "--quiet"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let told = stdout(&output);
    assert!(told.contains("$ hpu study velocity-estimators\n") && told.contains("\nedge timer "), "{told}");
    assert_eq!(
        names(&out),
        ["journal.txt", "velocities.png", "velocities.svg", "velocity-estimators.csv", "velocity-estimators.txt"]
    );
    let svg = fs::read_to_string(out.join("velocities.svg")).expect("a picture");
    for name in ["difference", "filtered, 2^-3", "window of 8", "FOAW, up to 16", "edge timer", "Levant, 100 rad/s2"] {
        assert!(svg.contains(name), "{name}");
    }
    assert!(!svg.contains("window of 32"), "of the first group alone");
    assert_refused(&run(&["study", "velocity-estimator"]), 4, &["velocity-estimator"]);
}

#[test]
fn a_changed_study_or_scene_is_another_one() {
    let dir = scratch("study-other");
    let (file, scene, out) = (dir.join("own.toml"), dir.join("wall.toml"), dir.join("out"));
    let shipped = fs::read_to_string(format!("{ROOT}/testbench/scenes/hybrid-wall.toml")).expect("a scene");
    fs::write(&scene, &shipped).expect("a file");
    let own = format!(
        "name = \"own\"\ntitle = \"Own\"\n[[group]]\nname = \"g\"\n[[group.line]]\nwhat = \"w\"\n\
         text = \"{{m.torque_quantum * 1e6:.6 uN.m}}\"\nmeasure.m = {{ measure = \"scene\", scene = \"{}\" }}\n",
        scene.display()
    );
    fs::write(&file, &own).expect("a file");
    let study = || run(&["study", text(&file), "-o", text(&out)]);
    let first = study();
    // 265 mN.m in 4096 counts.
    assert!(code(&first) == 0 && stdout(&first).contains("64.697"), "{}{}", stdout(&first), stderr(&first));
    fs::write(&scene, shipped.replace("[wall]", "# Another comment.\n[wall]")).expect("a file");
    assert_refused(&study(), 2, &["holds another study", "another folder"]);
    fs::write(&scene, &shipped).expect("a file");
    assert_eq!(code(&study()), 0);
    fs::write(&file, own.replace("\"w\"", "\"v\"")).expect("a file");
    assert_refused(&study(), 2, &["holds another study"]);
    let object = json(&run(&["study", text(&file), "--json"]));
    assert_eq!((&object["study"], &object["lines"][0]["what"]), (&"own".into(), &"v".into()));
}

#[test]
fn all_errors_of_a_file_are_told_before_anything_runs() {
    let dir = scratch("study-bad");
    let file = dir.join("bad.toml");
    let head = "name = \"bad\"\ntitle = \"Bad\"\n";
    let map = "[map]\nscene = \"hybrid-wall\"\nxx = 1\nfull = true\n";
    let limits = "[limits]\nscene = \"hybrid-wall\"\nphases = \"many\"\n";
    fs::write(&file, format!("{head}{map}{limits}")).expect("a file");
    let out = dir.join("out");
    let output = run(&["study", text(&file), "-o", text(&out)]);
    let words = ["bad.toml:5:6: map.xx: unknown key; accepted here: scene, x, y", "bad.toml:7:1: invalid value 'many'"];
    assert_refused(&output, 4, &words);
    fs::write(&file, format!("{head}[mapp]\n")).expect("a file");
    assert_refused(&run(&["study", text(&file)]), 4, &["bad.toml:3:2: mapp: unknown key", "did you mean map?"]);
    assert_refused(&run(&["study", text(&dir.join("none.toml"))]), 4, &["none.toml"]);
    assert_eq!(names(&dir), ["bad.toml"]);
}

#[test]
fn the_documentation_of_studies_names_every_measure_and_its_values() {
    let told = fs::read_to_string(format!("{ROOT}/testbench/studies/README.md")).expect("a file");
    for measure in measures() {
        let row = told.lines().find(|line| line.starts_with(&format!("| `{}` |", measure.name)));
        let row = row.unwrap_or_else(|| panic!("{} is not told", measure.name));
        assert!(row.contains(measure.about), "{row}");
        let keys = measure.keys.iter().map(|key| key.name);
        for word in keys.chain(measure.gives.iter().copied()) {
            assert!(row.contains(&format!("`{word}`")), "{}: {word}", measure.name);
        }
    }
}
