//! Files of somebody else: names that would leave the folder of `-o`, and texts that would steer a terminal.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use crate::common::{
    ROOT, assert_refused, code, hpu, json, names, quoted, scratch, seen, stderr, stdout, steers, text,
};

/// Names that no file of a result may have.
const HOSTILE: [&str; 14] = [
    "../requirements",
    "/REPLACED/requirements",
    "",
    ".",
    "..",
    ".bashrc",
    "-rf",
    "a/b",
    " a",
    "a ",
    "a.",
    "a\nb",
    "a\u{1b}[2Jb",
    "a\u{0}b",
];

/// Makes a folder with a file beside the place where the command runs, and one above it.
fn repository(test: &str) -> PathBuf {
    let dir = scratch(test);
    fs::create_dir_all(dir.join("repo")).expect("a folder");
    for place in ["requirements.txt", "repo/requirements.txt", "requirements.csv", "x.xml"] {
        fs::write(dir.join(place), "numpy==1.0\n").expect("a file");
    }
    dir
}

/// Runs the command beside the files of a repository. Asserts that nothing has changed there but the folder `out`.
fn run_in(dir: &Path, arguments: &[&str]) -> Output {
    let above = || names(dir).into_iter().map(|name| fs::read(dir.join(name)).ok()).collect::<Vec<_>>();
    let others = || (seen(&dir.join("repo")), above());
    let before = others();
    let output = hpu().current_dir(dir.join("repo")).args(arguments).output().expect("the command starts");
    assert_eq!(others(), before, "{arguments:?}: {}", stderr(&output));
    assert!(output.status.code().is_some_and(|code| code != 101), "{arguments:?}: {}", stderr(&output));
    output
}

fn study(name: &str) -> String {
    format!(
        "name = {}\ntitle = \"evil-package==6.6.6\"\n[[group]]\nname = \"x\"\n[[group.line]]\nwhat = \"a\"\n\
         text = \"{{w.torque_quantum}}\"\nmeasure.w = {{ measure = \"scene\", scene = \"hybrid-wall\" }}\n",
        quoted(name)
    )
}

#[test]
fn a_study_whose_name_would_leave_its_folder_is_refused_at_its_line() {
    let dir = repository("stranger-study");
    let file = dir.join("repo/s.toml");
    for name in HOSTILE.map(|name| name.replace("/REPLACED", text(&dir))) {
        fs::write(&file, study(&name)).expect("a study");
        let output = run_in(&dir, &["-q", "study", "s.toml", "-o", "out"]);
        assert_refused(&output, 4, &["s.toml:1:8: name: ", "a plain name"]);
        // The name may come from a variable.
        let varied = study("x").replace("\"x\"\ntitle", "\"$own\"\ntitle");
        fs::write(&file, format!("{varied}[let]\nown = {}\n", quoted(&name))).expect("a study");
        assert_refused(&run_in(&dir, &["-q", "study", "s.toml", "-o", "out"]), 4, &["a plain name"]);
    }
    for name in ["own", "Knie, zweiter Versuch é", "`touch canary`", "a'b", "% &;", "a.b"] {
        fs::write(&file, study(name)).expect("a study");
        let output = run_in(&dir, &["-q", "study", "s.toml", "-o", "out"]);
        assert_eq!(code(&output), 0, "{name}: {}", stderr(&output));
        let mut expected = [format!("{name}.csv"), format!("{name}.txt"), "journal.txt".into()];
        expected.sort();
        assert_eq!(names(&dir.join("repo/out")), expected);
        fs::remove_dir_all(dir.join("repo/out")).expect("it was written");
    }
}

#[test]
fn no_key_of_a_study_reaches_a_place_outside_of_its_folder() {
    let dir = repository("stranger-sections");
    let file = dir.join("repo/s.toml");
    let verbs =
        ["run", "check", "limits", "map", "chart", "fit", "widths", "cost", "phantom-table-2", "phantom-ladder"];
    let elsewhere = dir.join("elsewhere").display().to_string();
    for verb in verbs {
        let head = format!("name = \"x\"\ntitle = \"x\"\n[{verb}]\n");
        fs::write(&file, format!("{head}zzz = 1\n")).expect("a study");
        let said = stderr(&run_in(&dir, &["-q", "study", "s.toml", "-o", "out"]));
        let keys = said.split_once("accepted here: ").expect("its keys").1.trim().split(", ");
        for key in keys.chain(["out", "json", "jobs", "from", "cache", "quiet"]) {
            // Keys that may be long, and need another tool.
            if ["formal", "exhaustive", "search"].contains(&key) {
                continue;
            }
            for value in ["../x.xml", elsewhere.as_str()] {
                let scene = match (verb, key) {
                    ("run" | "limits" | "map" | "chart" | "fit", key) if key != "scene" => "scene = \"hybrid-wall\"\n",
                    ("cost", "scene") => "name = \"displacement\"\n",
                    _ => "",
                };
                let section = format!("{scene}{key} = {}\n", quoted(value));
                fs::write(&file, format!("{head}{section}")).expect("a study");
                run_in(&dir, &["-q", "study", "s.toml", "-o", "out"]);
            }
        }
    }
}

#[test]
fn a_report_of_a_study_lies_in_the_folder_of_its_section() {
    let dir = repository("stranger-junit");
    let section = |name: &str| {
        format!(
            "name = \"x\"\ntitle = \"x\"\n[run]\nscene = \"hybrid-wall\"\nedges = 1000\nno_plot = true\n\
             junit = {name}\n"
        )
    };
    let file = dir.join("repo/s.toml");
    for name in ["../x.xml", "/tmp/x.xml", ".x"] {
        fs::write(&file, section(&quoted(name))).expect("a study");
        let output = run_in(&dir, &["-q", "study", "s.toml", "-o", "out"]);
        assert_refused(&output, 4, &["s.toml:7:9: run.junit: ", "a plain name"]);
    }
    fs::write(&file, section("\"x.xml\"")).expect("a study");
    assert_refused(&run_in(&dir, &["-q", "study", "s.toml"]), 4, &["run.junit: it writes a file; write hpu study -o"]);
    let output = run_in(&dir, &["-q", "study", "s.toml", "-o", "out"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert!(dir.join("repo/out/run/x.xml").is_file());
}

#[test]
fn no_key_of_a_scene_reaches_a_place_outside_of_the_folder() {
    let dir = repository("stranger-scene");
    let keys = json(&hpu().args(["keys", "--json"]).output().expect("the command starts"));
    let keys = keys["keys"].as_array().expect("a list").clone();
    let mut tried = 0;
    for key in keys.iter().filter(|key| key["unit"].as_str().is_some_and(|unit| ["text", "file"].contains(&unit))) {
        let (section, key) = (key["section"].as_str().expect("text"), key["key"].as_str().expect("text"));
        let path = if section.is_empty() { key.to_string() } else { format!("{section}.{key}") };
        tried += 1;
        for value in ["../requirements", "/etc/requirements", "a\nb"] {
            let set = format!("{path}={}", quoted(value));
            run_in(&dir, &["-q", "run", "hybrid-wall", "--edges", "100", "--no-plot", "-o", "out", "--set", &set]);
            let scene = format!("{ROOT}/testbench/dut/knee.toml");
            run_in(&dir, &["-q", "widths", &scene, "--gappa", "-o", "out", "--set", &set]);
        }
    }
    assert!(tried > 5, "{tried} keys");
}

#[test]
fn the_file_of_a_scene_may_have_any_name_and_its_results_are_written_all_the_same() {
    let dir = repository("stranger-file");
    let scene = fs::read_to_string(format!("{ROOT}/testbench/scenes/hybrid-wall.toml")).expect("a scene");
    for name in ["a\nb", ".hidden", "-dash", "a b", "$(touch canary)", "a\u{1b}[31mb", "..", &"x".repeat(240)] {
        let file = format!("./{name}.toml");
        fs::write(dir.join("repo").join(&file), &scene).expect("a scene");
        let output = run_in(&dir, &["-q", "widths", &file, "--gappa", "-o", "out"]);
        assert_eq!(code(&output), 0, "{name}: {}", stderr(&output));
        let output = run_in(&dir, &["-q", "run", &file, "--edges", "1000", "--no-plot", "-o", "out"]);
        assert_eq!(code(&output), 0, "{name}: {}", stderr(&output));
        assert!(!stdout(&output).contains('\u{1b}'), "{}", stdout(&output));
        let output = run_in(
            &dir,
            &["-q", "vectors", "--set-kind", "scene", "--count", "20", "--scene", &file, "displacement", "-o", "out"],
        );
        assert_eq!(code(&output), 0, "{name}: {}", stderr(&output));
        assert!(!dir.join("repo/canary").exists(), "a command ran");
    }
}

#[test]
fn a_new_scene_has_a_plain_name() {
    let dir = repository("stranger-new");
    for name in HOSTILE.iter().filter(|name| !name.contains(['/', '\0'])) {
        let output = run_in(&dir, &["new", "--", name]);
        assert_refused(&output, 2, &["is no name of a scene", "a plain name"]);
        let output = run_in(&dir, &["new", "--", &format!("out/{name}.toml")]);
        assert_refused(&output, 2, &["is no name of a scene"]);
    }
    assert_eq!(code(&run_in(&dir, &["new", "out/my wall"])), 0);
    assert!(dir.join("repo/out/my wall.toml").is_file());
}

#[test]
fn every_file_of_a_result_is_written_by_one_module() {
    let writers = ["fs::write", "File::create", "File::options", "create_dir", "fs::rename", "fs::copy", "OpenOptions"];
    let mut found = Vec::new();
    let mut left = vec![Path::new(ROOT).join("crates/cli/src")];
    while let Some(folder) = left.pop() {
        for entry in fs::read_dir(&folder).expect("a folder").flatten() {
            let path = entry.path();
            if path.is_dir() {
                left.push(path);
                continue;
            }
            let source = fs::read_to_string(&path).expect("a source");
            if writers.iter().any(|writer| source.contains(writer)) {
                let name = path.strip_prefix(Path::new(ROOT).join("crates/cli/src")).expect("a part of it");
                found.push(name.display().to_string());
            }
        }
    }
    found.sort();
    // The others write files whose names are numbers, or their own: journals, manifests, shards, input of Slurm's
    // tools.
    assert_eq!(found, ["journal.rs", "shell/files.rs", "sweep/manifest.rs", "sweep/shard.rs", "sweep/submit.rs"]);
}

#[test]
fn a_study_with_sections_is_one_object_of_json() {
    let dir = repository("stranger-json");
    let sections = "[[run]]\nscene = \"hybrid-wall\"\nedges = 1000\n[[run]]\nscene = \"free-motion\"\nedges = 10\n";
    fs::write(dir.join("repo/s.toml"), study("x") + sections).expect("a study");
    fs::write(dir.join("repo/only.toml"), format!("name = \"x\"\ntitle = \"x\"\n{sections}")).expect("a study");
    fs::write(
        dir.join("repo/bad.toml"),
        study("x")
            + sections
            + "[map]\nscene = \"no-such\"\nx = \"wall.stiffness=1..2:2\"\ny = \"wall.damping=0..1:2\"\n",
    )
    .expect("a study");
    let found = json(&run_in(&dir, &["-q", "study", "s.toml", "--json"]));
    assert_eq!((&found["study"], &found["complete"]), (&"x".into(), &true.into()));
    assert_eq!(found["lines"][0]["what"], "a");
    let scenes = |found: &serde_json::Value| -> Vec<(String, String)> {
        let text = |value: &serde_json::Value| value.as_str().expect("text").to_string();
        let all = found["sections"].as_array().expect("a list").iter();
        all.map(|section| (text(&section["verb"]), text(&section["result"]["scene"]))).collect()
    };
    let both = ["hybrid-wall", "free-motion"].map(|scene| ("run".to_string(), scene.to_string()));
    assert_eq!(scenes(&found), both);
    let found = json(&run_in(&dir, &["-q", "study", "only.toml", "--json"]));
    assert_eq!((scenes(&found), found["lines"].as_array().map(Vec::len)), (both.to_vec(), Some(0)));
    // A section that fails leaves the object of the sections before it.
    let output = run_in(&dir, &["-q", "study", "bad.toml", "--json"]);
    assert_eq!(code(&output), 4, "{}", stderr(&output));
    let found = json(&output);
    assert_eq!((scenes(&found), &found["complete"]), (both.to_vec(), &false.into()));
}

#[test]
fn no_text_of_somebody_else_steers_a_terminal() {
    let dir = repository("stranger-steers");
    let scene = fs::read_to_string(format!("{ROOT}/testbench/scenes/hybrid-wall.toml")).expect("a scene");
    for evil in ["\u{1b}]0;owned\u{7}", "\u{9b}2J", "\u{8}\u{8}\r", "\u{202e}gnp.x", "\u{7f}", "\u{1b}[31m"] {
        let about = scene.replacen(
            "about = \"\"\"\n",
            &format!("about = \"\"\"\n{}. ", &quoted(evil)[1..quoted(evil).len() - 1]),
            1,
        );
        assert_ne!(about, scene);
        let file = format!("a{evil}b.toml");
        fs::write(dir.join("repo").join(&file), &about).expect("a scene");
        let title = study("x").replace("evil-package==6.6.6", &quoted(evil)[1..quoted(evil).len() - 1]);
        fs::write(dir.join("repo/s.toml"), title.replace("what = \"a\"", &format!("what = {}", quoted(evil))))
            .expect("a study");
        fs::write(dir.join("repo/bad.toml"), format!("name = {}\n{} = 1\n", quoted(evil), quoted(evil)))
            .expect("a study");
        let sections = format!("name = \"x\"\ntitle = \"x\"\n[map]\nscene = {}\nx = {0}\n", quoted(evil));
        fs::write(dir.join("repo/sections.toml"), sections).expect("a study");
        let (set, key) = (format!("wall.stiffness={evil}"), format!("{evil}=1"));
        let commands: [&[&str]; 18] = [
            &["run", &file, "--edges", "1000"],
            &["run", &file, "--edges", "1000", "--json"],
            &["run", &file, "--edges", "1000", "--no-plot", "-o", "out"],
            &["scenes", "show", &file, "--json"],
            &["run", "hybrid-wall", "--set", &set],
            &["run", "hybrid-wall", "--set", &key],
            &["run", evil],
            &["run", &format!("{evil}.toml")],
            &["study", "s.toml"],
            &["study", "s.toml", "--json"],
            &["study", "bad.toml"],
            &["study", "sections.toml"],
            &["block", evil],
            &[evil],
            &["run", "hybrid-wall", evil],
            &["map", &file, "--x", evil, "--y", evil],
            &["sweep", "status", evil],
            &["report", &file, "-o", "out/report.html"],
        ];
        for arguments in commands {
            let output = hpu().current_dir(dir.join("repo")).args(arguments).output().expect("the command starts");
            let (out, err) = (stdout(&output), stderr(&output));
            assert!(!steers(&out) && !steers(&err), "{arguments:?}:\n{out:?}\n{err:?}");
            if arguments.contains(&"--json") {
                let value: serde_json::Value = serde_json::from_str(&out).expect("JSON");
                assert!(value.is_object());
            }
        }
    }
}

#[test]
fn pages_pictures_and_reports_hold_no_code_and_no_control_character_of_somebody_else() {
    let dir = repository("stranger-pages");
    let scene = fs::read_to_string(format!("{ROOT}/testbench/scenes/hybrid-wall.toml")).expect("a scene");
    let evil = "\"'></script><script>code()</script>&\u{1b}]0;x\u{7}\u{9b}2J\u{202e}|*_`[a](b)";
    let about = scene.replacen("about = \"\"\"\n", &format!("about = \"\"\"\n{}. ", quoted(evil).trim_matches('"')), 1);
    // A name of a file has no slash.
    let file = format!("{}.toml", evil.replace('/', "-"));
    fs::write(dir.join("repo").join(&file), about).expect("a scene");
    fs::write(dir.join("repo/s.toml"), study("x").replace("evil-package==6.6.6", quoted(evil).trim_matches('"')))
        .expect("a study");
    let expect = ["--set", "expect.outcome=diverged"];
    let commands: [&[&str]; 6] = [
        &["run", &file, "-o", "out", "--junit", "out/run.xml", expect[0], expect[1]],
        &["report", &file, "-o", "out/report.html"],
        &["report", &file, "--with", "widths", "-o", "out/widths.html"],
        &["map", &file, "--x", "wall.stiffness=1..2:2", "--y", "wall.damping=0..0.1 mN.m.s/rad:2", "-o", "out/map"],
        &["study", "s.toml", "-o", "out/study"],
        &["report", "out/map", "-o", "out/folder.html"],
    ];
    for arguments in commands {
        let arguments = [&["-q"][..], arguments].concat();
        let output = hpu().current_dir(dir.join("repo")).args(&arguments).output().expect("the command starts");
        assert!(code(&output) < 2, "{arguments:?}: {}", stderr(&output));
    }
    let (mut read, mut left) = (0, vec![dir.join("repo/out")]);
    while let Some(folder) = left.pop() {
        for path in fs::read_dir(folder).expect("a folder").flatten().map(|entry| entry.path()) {
            let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default();
            if path.is_dir() {
                left.push(path.clone());
            }
            if !["html", "svg", "xml"].contains(&ending) {
                continue;
            }
            read += 1;
            let text = fs::read_to_string(&path).expect("text");
            assert!(!text.contains("<script>code"), "{} has code of somebody else", path.display());
            let control = text.chars().find(|c| c.is_control() && !matches!(c, '\n' | '\t'));
            assert_eq!(control, None, "{}", path.display());
        }
    }
    assert!(read > 8, "{read} files");
}
